//! Choosing by weight in constant time.
//!
//! A probability is the difference of two prefix sums, in f64, so that what is drawn is what the probability says. An
//! entry of weight 0 is never returned, whatever the random number. A table without any weight cannot be built: the
//! constructor returns `None`, which means "no sample".
//!
//! Weights that are negative, infinite or NaN count as 0. So do weights below 2⁻⁵² of the total: no prefix sum
//! resolves them, and a random number that hit one by its coarseness would return an absurd 1/pmf. Every other entry
//! has a positive probability.
//!
//! Random numbers lie in [0, 1); they may be `f32` or `f64`. Others are clamped into that range, NaN to its end.

/// An entry chosen by weight.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DiscreteSample {
    /// The entry.
    pub index: usize,
    /// Its probability; above 0.
    pub pmf: f32,
    /// What the choice left of the random number, uniform in [0, 1).
    pub u: f32,
}

/// Discrete choice in constant time (Walker 1974, built by Vose 1991).
#[derive(Clone, Debug)]
pub struct AliasTable {
    slots: Vec<Slot>,
}

/// One of n equal shares of the unit interval, divided between two entries.
#[derive(Clone, Copy, Debug)]
struct Slot {
    /// The part of the share that is the entry's own; the rest is the alias's.
    own: f64,
    alias: u32,
    /// Probability of the entry, over all shares.
    pmf: f32,
}

impl AliasTable {
    /// Entries weighted by `weights`. `None` without any weight, or for more than 2³² entries.
    pub fn new<W: Copy + Into<f64>>(weights: &[W]) -> Option<Self> {
        let n = u32::try_from(weights.len()).ok()?;
        let mut cdf = vec![0.0; weights.len() + 1];
        if fill_cdf(weights, &mut cdf) <= 0.0 {
            return None;
        }
        let share = |index: u32| cdf[index as usize + 1] - cdf[index as usize];
        let slot = |index| Slot {
            own: share(index) * f64::from(n),
            alias: index,
            pmf: share(index) as f32,
        };
        let mut slots: Vec<Slot> = (0..n).map(slot).collect();

        // Entries with less than a full share give the rest of their slot to one with more.
        let (mut poor, mut rich): (Vec<u32>, Vec<u32>) =
            (0..n).partition(|&index| slots[index as usize].own < 1.0);
        while let (Some(taker), Some(&giver)) = (poor.pop(), rich.last()) {
            slots[taker as usize].alias = giver;
            let left = (slots[giver as usize].own + slots[taker as usize].own) - 1.0;
            slots[giver as usize].own = left;
            if left < 1.0 {
                rich.pop();
                poor.push(giver);
            }
        }
        // Rounding can leave poor entries without a giver: they keep their slot, unless they have no weight at all and
        // so must never be returned.
        let heaviest = (0..n).max_by(|&a, &b| share(a).total_cmp(&share(b)))?;
        for &index in &poor {
            let weightless = share(index) == 0.0;
            slots[index as usize].alias = if weightless { heaviest } else { index };
        }
        Some(Self { slots })
    }

    /// Chooses an entry.
    pub fn sample(&self, u: impl Into<f64>) -> DiscreteSample {
        let scaled = unit(u.into()) * self.slots.len() as f64;
        let index = (scaled as usize).min(self.slots.len() - 1);
        let Slot { own, alias, .. } = self.slots[index];
        let position = scaled - index as f64;
        let (index, rest) = if position < own {
            (index, position / own)
        } else {
            (alias as usize, (position - own) / (1.0 - own))
        };
        DiscreteSample {
            index,
            pmf: self.pmf(index),
            u: below_one(rest),
        }
    }

    /// Probability of an entry. Panics beyond the last.
    pub fn pmf(&self, index: usize) -> f32 {
        self.slots[index].pmf
    }
}

/// Largest f64 below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Writes prefix sums from 0 to 1, or zeros if there is no weight; returns the sum of the weights.
fn fill_cdf<W: Copy + Into<f64>>(weights: &[W], cdf: &mut [f64]) -> f64 {
    let usable = |weight: W| -> f64 {
        let weight = weight.into();
        if weight > 0.0 && weight.is_finite() {
            weight
        } else {
            0.0
        }
    };
    let largest = weights
        .iter()
        .map(|&weight| usable(weight))
        .fold(0.0, f64::max);
    if largest == 0.0 {
        return 0.0;
    }
    // Relative to the largest, nothing overflows.
    let relative_total: f64 = weights.iter().map(|&weight| usable(weight) / largest).sum();
    let negligible = relative_total * f64::EPSILON;
    let mut sum = 0.0;
    for (entry, &weight) in cdf[1..].iter_mut().zip(weights) {
        let weight = usable(weight) / largest;
        if weight >= negligible {
            sum += weight;
        }
        *entry = sum;
    }
    for entry in cdf {
        *entry /= sum;
    }
    // Only the caller's scale can overflow; infinity is as good as any number then, being above 0.
    relative_total * largest
}

/// Into [0, 1), NaN to the end.
fn unit(u: f64) -> f64 {
    if u < BELOW_ONE { u.max(0.0) } else { BELOW_ONE }
}

/// To f32 without reaching 1.
fn below_one(x: f64) -> f32 {
    (x as f32).min(1.0 - f32::EPSILON / 2.0)
}
