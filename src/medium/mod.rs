//! Participating media: where along a ray light scatters, and how much arrives unscattered.
//!
//! Coefficients are per unit of render space. Knows no boundaries: the caller says where the medium ends.
//! Media absorb and scatter; pbrt-v3's do not emit.

pub mod grid;
pub mod homogeneous;
mod lattice;
pub mod majorant;
pub mod presets;
mod veil;

use crate::math::Ray;
use crate::sampling::rng::Rng;
use crate::scatter::HenyeyGreenstein;
use crate::spectrum::Rgb;
pub use grid::{DensityGrid, GridMedium};
pub use homogeneous::Homogeneous;
pub use veil::{Blocks, Veil};

/// A participating medium.
#[derive(Clone, Debug)]
pub enum Medium {
    /// The same everywhere.
    Homogeneous(Homogeneous),
    /// Density on a grid.
    Grid(Box<GridMedium>),
}

/// What happened to a path between two boundaries.
#[derive(Clone, Copy, Debug)]
pub enum MediumEvent {
    /// It scattered at distance `t`, below the end of the segment.
    Scatter {
        /// Distance along the ray.
        t: f32,
        /// Throughput factor, albedo included.
        weight: Rgb,
    },
    /// It reached the end of the segment.
    Pass {
        /// Throughput factor.
        weight: Rgb,
    },
}

impl Medium {
    /// Phase function.
    #[inline]
    pub fn phase(&self) -> HenyeyGreenstein {
        match self {
            Self::Homogeneous(medium) => medium.phase,
            Self::Grid(medium) => medium.phase,
        }
    }

    /// Whether it neither absorbs nor scatters anywhere.
    pub fn is_empty(&self) -> bool {
        match self {
            Self::Homogeneous(medium) => medium.is_empty(),
            Self::Grid(medium) => medium.is_empty(),
        }
    }

    /// Whether it scatters anywhere: if not, no dice are thrown in it.
    #[inline]
    pub fn scatters(&self) -> bool {
        match self {
            Self::Homogeneous(medium) => medium.scatters(),
            Self::Grid(medium) => medium.scatters(),
        }
    }

    /// Whether it is the same everywhere, and scatters.
    pub fn is_fog(&self) -> bool {
        matches!(self, Self::Homogeneous(medium) if medium.scatters())
    }

    /// Whether it has a [`Medium::veil`].
    pub fn veils(&self) -> bool {
        matches!(self, Self::Grid(grid) if grid.scatters())
    }

    /// How much light comes through to places in it, where that depends on the place and light is scattered: told apart in
    /// no more than `n_most` blocks, or in one.
    pub fn veil(&self, n_most: usize) -> Option<Veil> {
        match self {
            Self::Grid(grid) if self.veils() => Some(grid.veil(n_most)),
            Self::Grid(_) | Self::Homogeneous(_) => None,
        }
    }

    /// Draws what happens to a path of throughput `beta` on the segment (0, `t_max`) of the ray; `t_max` may be ∞.
    /// `depth` is the exponential variate of mean 1 that the length of the flight is drawn by, if it is one of a set that
    /// is more even than chance; `rng` gives one otherwise.
    ///
    /// Unbiased for each channel. `beta` decides only which channel guides the choice.
    #[inline]
    pub fn sample(
        &self,
        ray: &Ray,
        t_max: f32,
        beta: Rgb,
        depth: Option<f32>,
        rng: &mut Rng,
    ) -> MediumEvent {
        match self {
            Self::Homogeneous(medium) => medium.sample(t_max, beta, depth, rng),
            Self::Grid(medium) => medium.sample(ray, t_max, beta, depth, rng),
        }
    }

    /// Unbiased estimate of the transmittance of the segment (0, `t_max`) of the ray; `t_max` may be ∞.
    #[inline]
    pub fn transmittance(&self, ray: &Ray, t_max: f32, rng: &mut Rng) -> Rgb {
        match self {
            Self::Homogeneous(medium) => medium.transmittance(t_max),
            Self::Grid(medium) => medium.transmittance(ray, t_max, rng),
        }
    }
}

/// Probabilities with which the channels guide a choice for a path of throughput `beta`: in proportion to what each
/// carries, so that the weights of a coloured medium stay bounded along the path.
#[inline]
fn channel_weights(beta: Rgb) -> Rgb {
    let sum = beta.r() + beta.g() + beta.b();
    if sum > 0.0 && sum.is_finite() {
        // Not times the reciprocal, which is infinite for the smallest numbers.
        beta / sum
    } else {
        Rgb::splat(1.0 / 3.0)
    }
}

#[cfg(test)]
mod tests;
