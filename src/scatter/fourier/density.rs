//! The density from which directions of a table are drawn.
//!
//! Splines and truncated series swing below 0, so that they are no densities. What is drawn from is made of their
//! values at the nodes, without what is negative, and interpolated linearly over both elevations and the azimuth: it
//! is close to the table, integrates to 1 exactly, and costs a few look-ups.

use std::f32::consts::PI;

use crate::sampling::rng::ONE_MINUS_EPSILON;
use crate::scatter::fourier::{Series, interval};

/// Most steps of the azimuth over [0, π].
const MAX_STEPS: usize = 512;

/// Least density, in parts of the mean over the azimuth of the strongest neighbour, so that nothing that a spline
/// makes of it is out of reach.
const FLOOR: f64 = 1.0 / 16.0;

#[derive(Clone, Debug)]
pub(super) struct Density {
    /// By node of μo, then of μi.
    azimuths: Vec<Azimuths>,
    /// Values at the steps of each azimuth, and their running integrals.
    values: Vec<f32>,
    integrals: Vec<f32>,
    /// By node of μo: running integrals over μi, both azimuths folded into one.
    rows: Vec<f32>,
}

/// Values over the azimuth at one pair of nodes: linear between `n_steps` + 1 of them, from 0 to π.
#[derive(Clone, Copy, Debug)]
struct Azimuths {
    start: usize,
    n_steps: usize,
    /// The integral over [0, π].
    mass: f32,
}

impl Density {
    pub(super) fn new(mu: &[f32], series: &[Series], coefficients: &[f32]) -> Self {
        let n = mu.len();
        let mut samples: Vec<Vec<f64>> = series
            .iter()
            .map(|series| positive_values(&coefficients[series.start..series.start + series.len]))
            .collect();
        let means: Vec<f64> = samples.iter().map(|values| mean(values)).collect();
        for o in 0..n {
            for i in 0..n {
                let around = |k: usize| k.saturating_sub(1)..(k + 2).min(n);
                let neighbours = around(o).flat_map(|o| around(i).map(move |i| o * n + i));
                let floor = FLOOR * neighbours.map(|k| means[k]).fold(0.0, f64::max);
                for value in &mut samples[o * n + i] {
                    *value = value.max(floor);
                }
            }
        }
        // One factor for all keeps the sums within single precision, whatever the unit of the table.
        let greatest = samples.iter().flatten().copied().fold(0.0, f64::max);
        let scale = if greatest > 0.0 { 1.0 / greatest } else { 0.0 };
        let mut density = Self {
            azimuths: Vec::with_capacity(samples.len()),
            values: Vec::new(),
            integrals: Vec::new(),
            rows: Vec::with_capacity(samples.len()),
        };
        for values in &samples {
            density.push(values, scale);
        }
        for o in 0..n {
            let mut sum = 0f64;
            for i in 0..n {
                if i > 0 {
                    let masses = [i - 1, i].map(|i| f64::from(density.azimuths[o * n + i].mass));
                    let width = f64::from(mu[i]) - f64::from(mu[i - 1]);
                    sum += 0.5 * (masses[0] + masses[1]) * width;
                }
                density.rows.push(sum as f32);
            }
        }
        density
    }

    fn push(&mut self, values: &[f64], scale: f64) {
        let n_steps = values.len() - 1;
        let step = std::f64::consts::PI / n_steps as f64;
        let start = self.values.len();
        let mut sum = 0f64;
        for (k, value) in values.iter().enumerate() {
            if k > 0 {
                sum += 0.5 * (values[k - 1] + value) * scale * step;
            }
            self.values.push((value * scale) as f32);
            self.integrals.push(sum as f32);
        }
        self.azimuths.push(Azimuths {
            start,
            n_steps,
            mass: sum as f32,
        });
    }

    /// Density in sr⁻¹, for the azimuth `phi` in [0, π]; its mean over the azimuth if there is none.
    pub(super) fn pdf(&self, mu: &[f32], mu_o: f32, mu_i: f32, phi: Option<f32>) -> f32 {
        let n = mu.len();
        let Some((rows, total)) = self.rows_at(mu, mu_o) else {
            return 0.0;
        };
        if !(mu_i >= mu[0] && mu_i <= mu[n - 1]) {
            return 0.0;
        }
        let (i, t) = place(mu, mu_i);
        let mut sum = 0.0;
        for (o, weight_o) in rows {
            for (i, weight_i) in [(i, 1.0 - t), (i + 1, t)] {
                sum += weight_o * weight_i * self.value(o * n + i, phi);
            }
        }
        // Both signs of the azimuth share it.
        0.5 * sum / total
    }

    /// Draws the cosine and the azimuth, in [−π, π], of the direction of travel of light. Without an axis every
    /// azimuth is alike.
    pub(super) fn sample(
        &self,
        mu: &[f32],
        mu_o: f32,
        has_axis: bool,
        u_part: f32,
        u: [f32; 2],
    ) -> Option<(f32, f32)> {
        let n = mu.len();
        let (rows, total) = self.rows_at(mu, mu_o)?;
        let shares = rows.map(|(o, weight)| weight * self.row_total(n, o) / total);
        let (row, u_part) = choose(shares[0], u_part);
        let o = rows[row].0;

        let integrals = &self.rows[o * n..(o + 1) * n];
        let (i, u_mu) = segment(integrals, u[0])?;
        let masses = [i, i + 1].map(|i| self.azimuths[o * n + i].mass);
        let t = linear(u_mu, masses);
        let mu_i = (mu[i] + t * (mu[i + 1] - mu[i])).clamp(mu[i], mu[i + 1]);

        let (near, far) = ((1.0 - t) * masses[0], t * masses[1]);
        let (side, u_part) = choose(near / (near + far), u_part);
        let sign = if u_part < 0.5 { 1.0 } else { -1.0 };
        let azimuths = self.azimuths[o * n + i + side];
        if !has_axis {
            return Some((mu_i, sign * PI * u[1]));
        }
        let range = azimuths.start..azimuths.start + azimuths.n_steps + 1;
        let (k, u_phi) = segment(&self.integrals[range], u[1])?;
        let ends = [k, k + 1].map(|k| self.values[azimuths.start + k]);
        let step = PI / azimuths.n_steps as f32;
        let phi = (step * (k as f32 + linear(u_phi, ends))).min(PI);
        Some((mu_i, sign * phi))
    }

    /// The nodes around `mu_o` with their weights, and the integral of the row between them; `None` if that is 0 or so
    /// small beside the greatest value, 1, that densities might overflow.
    fn rows_at(&self, mu: &[f32], mu_o: f32) -> Option<([(usize, f32); 2], f32)> {
        let n = mu.len();
        if !(mu_o >= mu[0] && mu_o <= mu[n - 1]) {
            return None;
        }
        let (o, t) = place(mu, mu_o);
        let rows = [(o, 1.0 - t), (o + 1, t)];
        let total = rows
            .iter()
            .map(|(o, weight)| weight * self.row_total(n, *o))
            .sum();
        (total >= f32::MIN_POSITIVE).then_some((rows, total))
    }

    fn row_total(&self, n: usize, o: usize) -> f32 {
        self.rows[(o + 1) * n - 1]
    }

    fn value(&self, pair: usize, phi: Option<f32>) -> f32 {
        let azimuths = self.azimuths[pair];
        let Some(phi) = phi else {
            return azimuths.mass / PI;
        };
        let place = phi * azimuths.n_steps as f32 / PI;
        let k = (place as usize).min(azimuths.n_steps - 1);
        let t = (place - k as f32).min(1.0);
        let values = &self.values[azimuths.start + k..];
        values[0] * (1.0 - t) + values[1] * t
    }
}

/// Values of a series over [0, π], two steps for each coefficient, without what is negative.
fn positive_values(coefficients: &[f32]) -> Vec<f64> {
    let n_steps = (2 * coefficients.len()).clamp(1, MAX_STEPS);
    if coefficients.len() <= 1 {
        let value = coefficients.first().map_or(0.0, |a| f64::from(*a).max(0.0));
        return vec![value; 2];
    }
    let cosines: Vec<f64> = (0..2 * n_steps)
        .map(|k| (std::f64::consts::PI * k as f64 / n_steps as f64).cos())
        .collect();
    let at = |step: usize| {
        let terms = coefficients.iter().enumerate();
        let sum: f64 = terms
            .map(|(k, a)| f64::from(*a) * cosines[k * step % (2 * n_steps)])
            .sum();
        sum.max(0.0)
    };
    (0..=n_steps).map(at).collect()
}

/// Mean of values that are linear between even steps.
fn mean(values: &[f64]) -> f64 {
    let pairs = values.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
    pairs.sum::<f64>() / (values.len() - 1) as f64
}

/// The interval of `nodes` that holds `x`, and how far into it `x` lies, in [0, 1].
fn place(nodes: &[f32], x: f32) -> (usize, f32) {
    let i = interval(nodes, x);
    (i, (x - nodes[i]) / (nodes[i + 1] - nodes[i]))
}

/// The first of two with the probability `first`, else the second; and what the choice leaves of the number.
fn choose(first: f32, u: f32) -> (usize, f32) {
    if u < first {
        (0, (u / first).min(ONE_MINUS_EPSILON))
    } else {
        (
            1,
            ((u - first) / (1.0 - first)).clamp(0.0, ONE_MINUS_EPSILON),
        )
    }
}

/// The segment that `u` falls into, by running integrals of which the first is 0, and how far into its integral. `None`
/// if there is nothing in any.
fn segment(integrals: &[f32], u: f32) -> Option<(usize, f32)> {
    let last = integrals.len() - 1;
    if integrals[last] <= 0.0 {
        return None;
    }
    let x = u * integrals[last];
    let after = integrals.partition_point(|&integral| integral <= x);
    // Rounding may reach the end: then the last segment that holds anything.
    let after = if after > last {
        integrals.partition_point(|&integral| integral < integrals[last])
    } else {
        after
    };
    let (begin, end) = (integrals[after - 1], integrals[after]);
    let rest = (x - begin) / (end - begin);
    Some((after - 1, rest.clamp(0.0, ONE_MINUS_EPSILON)))
}

/// Draws from a density over [0, 1] that is linear between two values, not both 0.
fn linear(u: f32, [a, b]: [f32; 2]) -> f32 {
    // The root of the quadratic without cancellation.
    let sum = a + ((1.0 - u) * a * a + u * b * b).sqrt();
    if sum > 0.0 {
        (u * (a + b) / sum).min(1.0)
    } else {
        u
    }
}
