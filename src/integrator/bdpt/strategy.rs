//! The strategies by name, and what one of them finds.

use crate::spectrum::Rgb;

/// A way to find a path as a whole: so many of its vertices come from either end.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Strategy {
    /// Vertices from the light.
    pub s: usize,
    /// Vertices from the camera, at least 1.
    pub t: usize,
}

impl Strategy {
    /// All that find paths of up to `max_depth` scattering events, by their number and then by `s`. A light that the
    /// camera sees is found by chance alone.
    pub fn all(max_depth: u32) -> impl Iterator<Item = Self> {
        (0..=max_depth as usize)
            .flat_map(|depth| {
                (0..depth + 2).map(move |s| Self {
                    s,
                    t: depth + 2 - s,
                })
            })
            .filter(|strategy| *strategy != Self { s: 1, t: 1 })
    }

    /// Its place in [`Strategy::all`].
    pub fn index(self) -> usize {
        // One strategy for no scattering event, d + 2 for d of them.
        match self.depth() {
            0 => 0,
            depth => depth * (depth + 3) / 2 - 1 + self.s,
        }
    }

    /// Scattering events of its paths.
    pub fn depth(self) -> usize {
        self.s + self.t - 2
    }
}

/// What a strategy found.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Contribution {
    /// What the two parts of the path and the connection let through.
    pub(super) carried: Rgb,
    /// What it counts: one over densities that it does not hold yet.
    pub(super) factor: f64,
    /// The same, shared with the other strategies.
    pub(super) weighted_factor: f64,
}

impl Contribution {
    /// Nothing.
    pub(super) const NONE: Self = Self {
        carried: Rgb::BLACK,
        factor: 0.0,
        weighted_factor: 0.0,
    };

    /// As a part of the sum over all strategies.
    pub fn weighted(&self) -> Rgb {
        self.carried * self.weighted_factor as f32
    }

    /// As if there were no other strategy. What weighs nothing is nothing, as in pbrt-v3.
    pub fn unweighted(&self) -> Rgb {
        if self.weighted_factor > 0.0 {
            self.carried * self.factor as f32
        } else {
            Rgb::BLACK
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strategies_are_numbered_without_gaps_and_have_their_depth() {
        for max_depth in 0..7 {
            let all: Vec<Strategy> = Strategy::all(max_depth).collect();
            for (index, strategy) in all.iter().enumerate() {
                assert_eq!(strategy.index(), index, "{strategy:?}");
                assert!(strategy.depth() <= max_depth as usize, "{strategy:?}");
            }
        }
        assert_eq!(
            Strategy::all(0).collect::<Vec<_>>(),
            [Strategy { s: 0, t: 2 }]
        );
        assert_eq!(Strategy::all(5).count(), 26);
    }
}
