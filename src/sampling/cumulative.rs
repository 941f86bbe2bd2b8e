//! Inverting cumulative weights quickly: the discrete half of sampling a table by its values.

use crate::sampling::rng::ONE_MINUS_EPSILON;

/// Cumulative weights as 32-bit fractions, with a guide to where each stretch of the unit interval begins.
///
/// Every positive weight keeps at least one unit of 2⁻³², so that nothing with light is out of reach.
#[derive(Clone, Debug)]
pub struct Cumulative {
    /// Where each entry begins.
    starts: Vec<u32>,
    /// For each stretch of [0, 1): the last entry that begins at or before it.
    guide: Vec<u32>,
    /// Position of the bits that choose the stretch.
    shift: u32,
}

/// Entries for each stretch of the guide: two cache lines of them.
const ENTRIES_PER_STRETCH: usize = 4;

impl Cumulative {
    /// From weights that are finite and not negative; without any, the last entry is always drawn.
    pub fn new(weights: &[f64]) -> Self {
        let starts: Vec<u32> = starts(weights).collect();
        let n_stretches = (weights.len() / ENTRIES_PER_STRETCH)
            .next_power_of_two()
            .max(1);
        let shift = 32 - n_stretches.trailing_zeros();
        let guide = (0..n_stretches as u64)
            .map(|k| {
                let begin = (k << shift) as u32;
                let after = starts.partition_point(|&start| start <= begin);
                after.saturating_sub(1) as u32
            })
            .collect();
        Self {
            starts,
            guide,
            shift,
        }
    }

    /// The entry at `u` in [0, 1), and how far into it `u` lies, in [0, 1).
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32) {
        let x = (u as f64 * 4_294_967_296.0) as u32;
        let stretch = if self.shift == 32 {
            0
        } else {
            (x >> self.shift) as usize
        };
        let first = self.guide[stretch] as usize;
        let last = self
            .guide
            .get(stretch + 1)
            .map_or(self.starts.len() - 1, |&k| k as usize);
        // The last entry that begins at or before x: entries without weight begin where the next one does.
        let index = first + self.starts[first..=last].partition_point(|&start| start <= x) - 1;
        (index, rest(&self.starts, index, x))
    }
}

/// Where each of some weights begins, in units of 2⁻³² of their sum: what [`find`] looks through. As for
/// [`Cumulative::new`].
pub fn starts(weights: &[f64]) -> impl Iterator<Item = u32> {
    let total: f64 = weights.iter().sum();
    let n_positive = weights.iter().filter(|w| **w > 0.0).count();
    let units = 4_294_967_296.0 - n_positive as f64;
    let (mut sum, mut n_before) = (0.0, 0u32);
    weights.iter().map(move |&weight| {
        let share = if total > 0.0 {
            (sum / total * units) as u32
        } else {
            0
        };
        sum += weight;
        let start = share.saturating_add(n_before);
        n_before += u32::from(weight > 0.0);
        start
    })
}

/// The part of the unit interval that an entry is.
#[inline]
pub fn share(starts: &[u32], index: usize) -> f32 {
    length(starts, index) as f32 * 2f32.powi(-32)
}

/// The entry at `u` in [0, 1) among a few, and how far into it `u` lies, in [0, 1): without a guide, which for less than
/// a hundred is more to read than they are.
#[inline]
pub fn find(starts: &[u32], u: f32) -> (usize, f32) {
    let x = (u as f64 * 4_294_967_296.0) as u32;
    let index = starts.partition_point(|&start| start <= x) - 1;
    (index, rest(starts, index, x))
}

/// How far into an entry `x` lies.
#[inline]
fn rest(starts: &[u32], index: usize, x: u32) -> f32 {
    let rest = (x - starts[index]) as f32 / length(starts, index) as f32;
    rest.min(ONE_MINUS_EPSILON)
}

/// The length of an entry in units of 2⁻³².
#[inline]
fn length(starts: &[u32], index: usize) -> u64 {
    let end = starts
        .get(index + 1)
        .map_or(1 << 32, |&start| u64::from(start));
    end - u64::from(starts[index])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    #[test]
    fn entries_are_drawn_in_proportion_to_their_weights() {
        for n in [1, 2, 31, 64, 1000, 70_000] {
            let mut rng = Rng::new(n as u64);
            let weights: Vec<f64> = (0..n)
                .map(|i| {
                    if i % 3 == 1 {
                        0.0
                    } else {
                        rng.uniform() as f64
                    }
                })
                .collect();
            let total: f64 = weights.iter().sum();
            let table = Cumulative::new(&weights);
            // Walk the unit interval in steps finer than any entry that matters.
            let n_steps = 1 << 21;
            let mut counts = vec![0u32; n];
            for k in 0..n_steps {
                let u = (k as f32 + 0.5) / n_steps as f32;
                let (index, rest) = table.sample(u);
                assert!((0.0..1.0).contains(&rest));
                assert_eq!(find(&table.starts, u), (index, rest));
                counts[index] += 1;
            }
            for (i, (&count, &weight)) in counts.iter().zip(&weights).enumerate() {
                let expected = weight / total * n_steps as f64;
                assert!(
                    (count as f64 - expected).abs() <= 2.0,
                    "{n} entries, {i}: {count} {expected}"
                );
            }
        }
    }

    #[test]
    fn n04_entries_without_weight_are_never_drawn() {
        for weights in [
            [0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [1e-38, 0.0, 1e38],
        ] {
            let table = Cumulative::new(&weights);
            for u in [0.0, 1e-30, 0.25, 0.5, ONE_MINUS_EPSILON] {
                let (index, rest) = table.sample(u);
                assert!(
                    weights[index] > 0.0 && (0.0..1.0).contains(&rest),
                    "{weights:?} at {u}"
                );
            }
        }
    }
}
