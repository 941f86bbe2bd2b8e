//! Catmull–Rom splines over nodes of any spacing (pbrt 3rd ed., section 8.6.1).
//!
//! Slopes are finite differences to the neighbours on both sides; at the ends, to the one that exists.

use std::ops::{Add, Mul, Sub};

/// A number of the inner loop or of a table.
pub trait Real:
    Copy + PartialOrd + From<f32> + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self>
{
    /// `self / other`.
    fn ratio(self, other: Self) -> Self;
}

impl Real for f32 {
    #[inline]
    fn ratio(self, other: Self) -> Self {
        self / other
    }
}

impl Real for f64 {
    #[inline]
    fn ratio(self, other: Self) -> Self {
        self / other
    }
}

/// The weights of up to four neighbouring nodes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SplineWeights<T> {
    /// Index of the node of the second weight; the first belongs to the node before, if there is one.
    pub interval: usize,
    /// Weights of the nodes `interval` − 1 to `interval` + 2; 0 for a node that does not exist.
    pub weights: [T; 4],
}

impl<T: Real> SplineWeights<T> {
    /// The weights at `x`; `None` outside of the nodes. `nodes` ascend and are at least two.
    pub fn new(nodes: &[T], x: T) -> Option<Self> {
        let n = nodes.len();
        if !(x >= nodes[0] && x <= nodes[n - 1]) {
            return None;
        }
        let i = nodes.partition_point(|node| *node <= x).clamp(1, n - 1) - 1;
        let [zero, one, two, three] = [0.0, 1.0, 2.0, 3.0].map(T::from);
        let (x0, x1) = (nodes[i], nodes[i + 1]);
        let width = x1 - x0;
        let t = (x - x0).ratio(width);
        let (t2, t3) = (t * t, t * t * t);
        let mut weights = [
            zero,
            two * t3 - three * t2 + one,
            three * t2 - two * t3,
            zero,
        ];
        // Share of the slope at the left node, then at the right one.
        let (slope0, slope1) = (t3 - two * t2 + t, t3 - t2);
        if i > 0 {
            let w = (slope0 * width).ratio(x1 - nodes[i - 1]);
            weights[0] = weights[0] - w;
            weights[2] = weights[2] + w;
        } else {
            weights[1] = weights[1] - slope0;
            weights[2] = weights[2] + slope0;
        }
        if i + 2 < n {
            let w = (slope1 * width).ratio(nodes[i + 2] - x0);
            weights[1] = weights[1] - w;
            weights[3] = weights[3] + w;
        } else {
            weights[1] = weights[1] - slope1;
            weights[2] = weights[2] + slope1;
        }
        Some(Self {
            interval: i,
            weights,
        })
    }

    /// The nodes that have a weight, with it.
    #[inline]
    pub fn terms(self) -> impl Iterator<Item = (usize, T)> {
        let weights = self.weights.into_iter().enumerate();
        let used = weights.filter(|(_, weight)| *weight != T::from(0.0));
        // The first and the last have a weight only where their nodes exist.
        used.map(move |(k, weight)| (self.interval + k - 1, weight))
    }

    /// The weighted sum of values that are looked up by node.
    #[inline]
    pub fn sum(&self, value: impl Fn(usize) -> T) -> T {
        let terms = self.terms();
        terms.fold(T::from(0.0), |sum, (node, weight)| {
            sum + weight * value(node)
        })
    }
}

/// Bits of the interval within which an inversion ends: more than single precision has.
const INVERSION_BITS: u32 = 32;

/// Integral of the spline from the first node to each node.
pub fn cumulative_integrals(nodes: &[f64], values: &[f64]) -> Vec<f64> {
    let n = nodes.len();
    let mut integrals = vec![0.0; n];
    for i in 0..n - 1 {
        let (x0, x1) = (nodes[i], nodes[i + 1]);
        let (f0, f1) = (values[i], values[i + 1]);
        let width = x1 - x0;
        let slope0 = match i {
            0 => f1 - f0,
            _ => width * (f1 - values[i - 1]) / (x1 - nodes[i - 1]),
        };
        let slope1 = if i + 2 < n {
            width * (values[i + 2] - f0) / (nodes[i + 2] - x0)
        } else {
            f1 - f0
        };
        let area = width * ((f0 + f1) * 0.5 + (slope0 - slope1) / 12.0);
        integrals[i + 1] = integrals[i] + area;
    }
    integrals
}

/// Where a spline through ascending values takes the value `y`; the end nodes beyond its range.
pub fn invert(nodes: &[f64], values: &[f64], y: f64) -> f64 {
    let n = nodes.len();
    if !(y > values[0]) {
        return nodes[0];
    }
    if !(y < values[n - 1]) {
        return nodes[n - 1];
    }
    let i = values.partition_point(|value| *value <= y).clamp(1, n - 1) - 1;
    let (mut low, mut high) = (nodes[i], nodes[i + 1]);
    // Each halving gains a bit.
    for _ in 0..INVERSION_BITS {
        let middle = low + (high - low) * 0.5;
        let value = SplineWeights::new(nodes, middle).map_or(y, |w| w.sum(|k| values[k]));
        if value <= y {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: [f64; 6] = [0.0, 0.3, 1.0, 1.1, 2.5, 4.0];

    #[test]
    fn straight_lines_are_interpolated_exactly_and_nodes_keep_their_values() {
        let line = NODES.map(|x| 3.0 * x - 1.0);
        let wave = NODES.map(f64::sin);
        for k in 0..=400 {
            let x = 0.01 * f64::from(k);
            let weights = SplineWeights::new(&NODES, x).expect("it lies within the nodes");
            assert!(
                (weights.sum(|i| line[i]) - (3.0 * x - 1.0)).abs() < 1e-12,
                "{x}"
            );
            assert!((weights.sum(|i| wave[i]) - x.sin()).abs() < 0.2, "{x}");
        }
        for (x, y) in NODES.iter().zip(wave) {
            let weights = SplineWeights::new(&NODES, *x).expect("a node lies within the nodes");
            assert!((weights.sum(|i| wave[i]) - y).abs() < 1e-12);
        }
        assert_eq!(SplineWeights::new(&NODES, -0.1), None);
        assert_eq!(SplineWeights::new(&NODES, f64::NAN), None);
    }

    #[test]
    fn integrals_match_quadrature_of_the_spline() {
        let values = [0.0, 0.8, 0.4, 0.5, 2.0, 0.1];
        let integrals = cumulative_integrals(&NODES, &values);
        for end in 1..NODES.len() {
            let steps = 100_000;
            let h = NODES[end] / f64::from(steps);
            let sum: f64 = (0..steps)
                .map(|k| {
                    let x = (f64::from(k) + 0.5) * h;
                    let weights = SplineWeights::new(&NODES, x).expect("it lies within the nodes");
                    weights.sum(|i| values[i]) * h
                })
                .sum();
            assert!(
                (sum - integrals[end]).abs() < 1e-7,
                "{sum} {}",
                integrals[end]
            );
        }
    }

    #[test]
    fn inversion_finds_where_a_value_is_taken() {
        let values = [0.0, 0.1, 0.5, 0.55, 0.9, 1.3];
        for k in 0..=130 {
            let y = 0.01 * f64::from(k);
            let x = invert(&NODES, &values, y);
            let weights = SplineWeights::new(&NODES, x).expect("it lies within the nodes");
            assert!((weights.sum(|i| values[i]) - y).abs() < 1e-9, "{y} {x}");
        }
        assert_eq!(invert(&NODES, &values, -1.0), 0.0);
        assert_eq!(invert(&NODES, &values, 2.0), 4.0);
    }
}
