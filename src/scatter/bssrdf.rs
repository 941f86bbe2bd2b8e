//! Light that enters a surface at one point and leaves it at another (pbrt 3rd ed., sections 11.4 and 15.4).
//!
//! S(po, wo, pi, wi) = (1 − F(wo)) Sp(|po − pi|) Sw(wi). The first factor is the transmission lobe of the boundary at
//! po, the second a [`Bssrdf`], the last a [`SubsurfaceExit`] lobe at pi.

use std::f32::consts::{FRAC_1_PI, TAU};

use crate::math::Vec3;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::scatter::bsdf::TransportMode;
use crate::scatter::diffusion::{DiffusionTable, TabulatedProfile};
use crate::scatter::fresnel;
use crate::spectrum::Rgb;

/// Spread of light below a surface, by distance, channel by channel.
#[derive(Clone, Copy, Debug)]
pub struct Bssrdf<'a> {
    channels: [Profile<'a>; 3],
    eta: f32,
}

/// The spread in one channel.
#[derive(Clone, Copy, Debug)]
enum Profile<'a> {
    /// Nothing comes back.
    Black,
    /// From a table; `sigma_t` is extinction per length.
    Tabulated {
        profile: TabulatedProfile<'a>,
        sigma_t: f32,
        max_radius: f32,
    },
    /// Two exponentials: `reflectance` is the part that comes back, `distance` their scale.
    Exponential { reflectance: f32, distance: f32 },
}

/// Radii beyond this many scales of the longer exponential hold less than 10⁻⁹ of the light.
const EXPONENTIAL_REACH: f32 = 20.0;

impl<'a> Bssrdf<'a> {
    /// The medium of extinction `sigma_t` per length (finite) and single-scattering albedo `albedo`, under a boundary
    /// of relative index `eta`.
    pub fn tabulated(table: &'a DiffusionTable, eta: f32, sigma_t: Rgb, albedo: Rgb) -> Self {
        let (sigma_t, albedo) = (sigma_t.to_array(), albedo.to_array());
        let channels = [0, 1, 2].map(|c| {
            let profile = table.profile(albedo[c]);
            match profile.filter(|p| p.effective_albedo() > 0.0) {
                Some(profile) if sigma_t[c] > 0.0 => Profile::Tabulated {
                    profile,
                    sigma_t: sigma_t[c],
                    max_radius: table.max_radius() / sigma_t[c],
                },
                _ => Profile::Black,
            }
        });
        Self { channels, eta }
    }

    /// The approximation of Christensen and Burley 2015: `reflectance` comes back, spread by `distance`
    /// (above 0).
    pub fn exponential(eta: f32, reflectance: Rgb, distance: Rgb) -> Self {
        let (reflectance, distance) = (reflectance.to_array(), distance.to_array());
        let channels = [0, 1, 2].map(|c| {
            if reflectance[c] > 0.0 {
                Profile::Exponential {
                    reflectance: reflectance[c],
                    distance: distance[c],
                }
            } else {
                Profile::Black
            }
        });
        Self { channels, eta }
    }

    /// The part of the light that comes back somewhere.
    pub fn effective_albedo(&self) -> Rgb {
        Rgb::from_array(self.channels.map(|channel| match channel {
            Profile::Black => 0.0,
            Profile::Tabulated { profile, .. } => profile.effective_albedo(),
            Profile::Exponential { reflectance, .. } => reflectance,
        }))
    }

    /// The distance within which all light of a channel comes back.
    pub fn max_radius(&self, channel: usize) -> f32 {
        match self.channels[channel] {
            Profile::Black => 0.0,
            Profile::Tabulated { max_radius, .. } => max_radius,
            Profile::Exponential { distance, .. } => 3.0 * distance * EXPONENTIAL_REACH,
        }
    }

    /// Sp at distance `r` > 0, per area.
    pub fn sp(&self, r: f32) -> Rgb {
        let ring = TAU * r;
        Rgb::from_array(self.channels.map(|channel| match channel {
            Profile::Black => 0.0,
            Profile::Tabulated {
                profile, sigma_t, ..
            } => profile.radial(r * sigma_t) * sigma_t / ring,
            Profile::Exponential {
                reflectance,
                distance,
            } => reflectance * exponential_pdf(r, distance) / ring,
        }))
    }

    /// Draws a distance from the profile of a channel. `None` where nothing comes back.
    pub fn sample_radius(&self, channel: usize, u: f32) -> Option<f32> {
        match self.channels[channel] {
            Profile::Black => None,
            Profile::Tabulated {
                profile, sigma_t, ..
            } => Some(profile.sample(u)? / sigma_t),
            Profile::Exponential { distance, .. } => {
                let (u, scale) = if u < 0.25 {
                    (u * 4.0, distance)
                } else {
                    ((u - 0.25) * (4.0 / 3.0), 3.0 * distance)
                };
                Some(-(-u).ln_1p() * scale)
            }
        }
    }

    /// Density of [`Bssrdf::sample_radius`] per area of the plane, at distance `r` > 0.
    pub fn pdf_area(&self, channel: usize, r: f32) -> f32 {
        let per_length = match self.channels[channel] {
            Profile::Black => 0.0,
            Profile::Tabulated {
                profile, sigma_t, ..
            } => profile.pdf(r * sigma_t) * sigma_t,
            Profile::Exponential { distance, .. } => exponential_pdf(r, distance),
        };
        per_length / (TAU * r)
    }

    /// The lobe by which light leaves.
    pub fn exit(&self) -> SubsurfaceExit {
        let lost = 2.0 * fresnel::first_moment(1.0 / f64::from(self.eta)) as f32;
        SubsurfaceExit {
            eta: self.eta,
            norm: FRAC_1_PI / (1.0 - lost),
        }
    }
}

/// A quarter and three quarters of two exponentials, per length.
fn exponential_pdf(r: f32, distance: f32) -> f32 {
    ((-r / distance).exp() + (-r / (3.0 * distance)).exp()) / (4.0 * distance)
}

/// Diffuse transmission out of the medium: what the boundary lets through.
#[derive(Clone, Copy, Debug)]
pub struct SubsurfaceExit {
    /// Relative index inside.
    eta: f32,
    /// Makes the cosine-weighted integral 1.
    norm: f32,
}

impl SubsurfaceExit {
    /// Value in sr⁻¹. With radiance it undoes the compression of the transmission at the entry.
    pub fn f(&self, wi: Vec3, mode: TransportMode) -> f32 {
        let passed = 1.0 - fresnel::dielectric(wi.z(), 1.0, self.eta);
        let expansion = match mode {
            TransportMode::Radiance => self.eta * self.eta,
            TransportMode::Importance => 1.0,
        };
        passed * self.norm * expansion
    }

    /// Draws a direction outside in proportion to its cosine.
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        cosine_hemisphere(u)
    }

    /// Density of [`SubsurfaceExit::sample`] in sr⁻¹.
    pub fn pdf(&self, wi: Vec3) -> f32 {
        if wi.z() > 0.0 {
            cosine_hemisphere_pdf(wi.z())
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ f(r) 2πr dr over distances on a scale that reaches from tiny to all.
    fn over_the_plane(max: f32, f: impl Fn(f32) -> f32) -> f64 {
        let n = 200_000;
        let (low, high) = ((f64::from(max) * 1e-7).ln(), f64::from(max).ln());
        let h = (high - low) / f64::from(n);
        (0..n)
            .map(|k| {
                let r = (low + (f64::from(k) + 0.5) * h).exp();
                f64::from(f(r as f32)) * std::f64::consts::TAU * r * r * h
            })
            .sum()
    }

    #[test]
    fn what_comes_back_over_the_plane_is_the_effective_albedo() {
        let table = DiffusionTable::new(0.0, 1.4);
        let sigma_t = Rgb::new(0.1, 3.0, 200.0);
        let media = [
            Bssrdf::tabulated(&table, 1.4, sigma_t, Rgb::new(0.3, 0.9, 0.999)),
            Bssrdf::exponential(1.4, Rgb::new(0.2, 0.9, 1.0), Rgb::new(1e-3, 1.0, 40.0)),
        ];
        for medium in media {
            for c in 0..3 {
                let whole = over_the_plane(medium.max_radius(c), |r| medium.sp(r).to_array()[c]);
                let expected = f64::from(medium.effective_albedo().to_array()[c]);
                assert!(
                    (whole - expected).abs() < 2e-3 * expected,
                    "{c}: {whole} {expected}"
                );
                let density = over_the_plane(medium.max_radius(c), |r| medium.pdf_area(c, r));
                assert!((density - 1.0).abs() < 2e-3, "{c}: {density}");
            }
        }
    }

    #[test]
    fn distances_of_the_exponentials_are_drawn_with_their_density() {
        let medium = Bssrdf::exponential(1.5, Rgb::ONE, Rgb::splat(0.7));
        let n = 100_000;
        let below = |r: f32| {
            let drawn = (0..n).filter(|k| {
                let u = (*k as f32 + 0.5) / n as f32;
                medium.sample_radius(1, u).is_some_and(|drawn| drawn < r)
            });
            drawn.count() as f64 / f64::from(n)
        };
        for r in [0.05, 0.5, 2.0, 7.0] {
            let expected = over_the_plane(r, |r| medium.pdf_area(1, r));
            assert!((below(r) - expected).abs() < 1e-3, "{r}: {expected}");
        }
    }

    #[test]
    fn all_light_that_reaches_the_boundary_leaves() {
        for eta in [1.0f32, 1.33, 1.7] {
            let exit = Bssrdf::exponential(eta, Rgb::ONE, Rgb::ONE).exit();
            let n = 100_000;
            let sum: f64 = (0..n)
                .map(|k| {
                    let cos = (k as f32 + 0.5) / n as f32;
                    let wi = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                    f64::from(exit.f(wi, TransportMode::Importance) * cos * TAU) / f64::from(n)
                })
                .sum();
            // As good as the polynomial for the moment of the reflectance.
            assert!((sum - 1.0).abs() < 1e-2, "{eta}: {sum}");
        }
    }
}
