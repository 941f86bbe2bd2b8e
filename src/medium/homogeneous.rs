//! Homogeneous medium. Scene-file manual (`MakeNamedMedium`, `"string type" "homogeneous"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum sigma_a` | (0.0011, 0.0024, 0.014) | absorption per world unit |
//! | `spectrum sigma_s` | (2.55, 3.21, 3.77) | scattering per world unit |
//! | `string preset` | none | measured coefficients, in mm⁻¹ |
//! | `float scale` | 1 | multiplies both |
//! | `float g` | 0 | asymmetry of the Henyey–Greenstein phase function |

use crate::medium::{MediumEvent, channel_weights};
use crate::sampling::rng::Rng;
use crate::scatter::HenyeyGreenstein;
use crate::spectrum::Rgb;

/// A medium with the same coefficients everywhere.
#[derive(Clone, Copy, Debug)]
pub struct Homogeneous {
    sigma_t: Rgb,
    sigma_s: Rgb,
    /// Mean free path of the channel that light goes furthest in, of those that scatter; 0 if none does.
    pub mean_free_path: f32,
    /// Phase function.
    pub phase: HenyeyGreenstein,
}

/// exp(−`sigma` · `t`) per channel, with 0 · ∞ = 0: where nothing is in the way, distance does not matter.
#[inline]
pub(super) fn beer_lambert(sigma: Rgb, t: f32) -> Rgb {
    sigma.map(|s| if s == 0.0 { 1.0 } else { (-s * t).exp() })
}

impl Homogeneous {
    /// Coefficients are non-negative and finite, per unit of render space.
    pub fn new(sigma_a: Rgb, sigma_s: Rgb, phase: HenyeyGreenstein) -> Self {
        let sigma_t = sigma_a + sigma_s;
        let least = (0..3)
            .filter(|&channel| sigma_s[channel] > 0.0)
            .map(|channel| sigma_t[channel])
            .fold(f32::INFINITY, f32::min);
        Self {
            sigma_t,
            sigma_s,
            mean_free_path: 1.0 / least,
            phase,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.sigma_t.is_black()
    }

    pub(super) fn transmittance(&self, t_max: f32) -> Rgb {
        beer_lambert(self.sigma_t, t_max)
    }

    /// Whether it scatters at all.
    pub fn scatters(&self) -> bool {
        !self.sigma_s.is_black()
    }

    /// What reaches the distance `t` and is scattered there, per length.
    #[inline]
    pub fn scattered_at(&self, t: f32) -> Rgb {
        self.sigma_s * beer_lambert(self.sigma_t, t)
    }

    /// Density per length with which [`Medium::sample`](crate::medium::Medium::sample) draws the distance `t` for a path
    /// of throughput `beta`.
    #[inline]
    pub fn pdf(&self, t: f32, beta: Rgb) -> f32 {
        dot(
            channel_weights(beta),
            self.sigma_t * beer_lambert(self.sigma_t, t),
        )
    }

    /// See [`ColumnFlight`]: the density is 1. A medium that only absorbs needs no dice.
    pub(super) fn sample(
        &self,
        t_max: f32,
        beta: Rgb,
        depth: Option<f32>,
        rng: &mut Rng,
    ) -> MediumEvent {
        if self.sigma_s.is_black() {
            return MediumEvent::Pass {
                weight: self.transmittance(t_max),
            };
        }
        let flight = ColumnFlight::new(self.sigma_t, self.sigma_s, beta, depth, rng);
        let t = flight.limit() as f32;
        if t < t_max {
            MediumEvent::Scatter {
                t,
                weight: flight.scatter(t),
            }
        } else {
            MediumEvent::Pass {
                weight: flight.pass(t_max),
            }
        }
    }
}

/// Extinction whose products with chances might underflow: 2⁻⁸⁰.
const NEARLY_CLEAR: f32 = 1.0 / (1u128 << 80) as f32;

/// A flight whose length, in columns of density, is drawn by the extinction of one channel and weighed by all of them (the
/// balance heuristic over channels; pbrt 3rd ed., section 15.2.1).
pub(super) struct ColumnFlight {
    /// Chances of the channels.
    q: Rgb,
    /// Coefficients that weights are quotients of, in units in which they do not underflow.
    sigma_t: Rgb,
    sigma_s: Rgb,
    /// Relative to the channel of least extinction, so that nothing underflows in thick media.
    excess: Rgb,
    limit: f64,
}

impl ColumnFlight {
    /// For a path of throughput `beta`; `depth` as in [`Medium::sample`](crate::medium::Medium::sample).
    #[inline]
    pub(super) fn new(
        sigma_t: Rgb,
        sigma_s: Rgb,
        beta: Rgb,
        depth: Option<f32>,
        rng: &mut Rng,
    ) -> Self {
        let q = channel_weights(beta);
        let u = rng.uniform();
        // The last channel with a chance takes what rounding leaves of the unit interval.
        let channel = if u < q.r() || q.g() + q.b() == 0.0 {
            0
        } else if u < q.r() + q.g() || q.b() == 0.0 {
            1
        } else {
            2
        };
        let depth = depth.unwrap_or_else(|| rng.exponential());
        let scale = if sigma_t.max_component() < NEARLY_CLEAR {
            NEARLY_CLEAR.recip()
        } else {
            1.0
        };
        Self {
            q,
            sigma_t: sigma_t * scale,
            sigma_s: sigma_s * scale,
            excess: sigma_t - Rgb::splat(sigma_t.min_component()),
            limit: if sigma_t[channel] > 0.0 {
                f64::from(depth) / f64::from(sigma_t[channel])
            } else {
                // No extinction in that channel: the flight never ends, whatever its depth.
                f64::INFINITY
            },
        }
    }

    /// The column at which it ends, unless the medium does before; perhaps ∞.
    #[inline]
    pub(super) fn limit(&self) -> f64 {
        self.limit
    }

    /// Weight of a collision there.
    #[inline]
    pub(super) fn scatter(&self, column: f32) -> Rgb {
        let tr = beer_lambert(self.excess, column);
        self.sigma_s * tr / dot(self.q, self.sigma_t * tr)
    }

    /// Weight of a path that leaves the medium behind that column.
    #[inline]
    pub(super) fn pass(&self, column: f32) -> Rgb {
        let tr = beer_lambert(self.excess, column);
        tr * (1.0 / dot(self.q, tr))
    }
}

#[inline]
fn dot(a: Rgb, b: Rgb) -> f32 {
    let p = a * b;
    p.r() + p.g() + p.b()
}
