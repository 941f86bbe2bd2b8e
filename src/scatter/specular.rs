//! Perfectly smooth interfaces: mirror and dielectric; and none at all. Their densities are deltas, so they have no `f` and no `pdf`.

use crate::math::Vec3;
use crate::scatter::bsdf::TransportMode;
use crate::scatter::fresnel;
use crate::spectrum::Rgb;

/// What a smooth interface did with a path.
#[derive(Clone, Copy, Debug)]
pub struct SpecularSample {
    /// New direction in the shading frame.
    pub wi: Vec3,
    /// Throughput factor: f |cos| / probability.
    pub weight: Rgb,
    /// The path went through.
    pub transmitted: bool,
}

/// One of the ways a smooth interface leaves open.
#[derive(Clone, Copy, Debug)]
pub struct SpecularPart {
    /// Direction, in the same frame as that it came from.
    pub wi: Vec3,
    /// The part of the light from there that goes on: f |cos|.
    pub weight: Rgb,
    /// For what goes through: index of refraction on the side it came from, relative to the other; 1 straight ahead.
    pub refraction: Option<f32>,
}

/// Mirror reflection without Fresnel factor.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    /// Reflectance.
    pub kr: Rgb,
}

impl Mirror {
    /// The mirrored direction.
    pub fn sample(&self, wo: Vec3) -> SpecularSample {
        SpecularSample {
            wi: Vec3::new(-wo.x(), -wo.y(), wo.z()),
            weight: self.kr,
            transmitted: false,
        }
    }
}

/// A hole: light goes straight through.
#[derive(Clone, Copy, Debug)]
pub struct PassThrough {
    /// Transmittance.
    pub kt: Rgb,
}

impl PassThrough {
    /// The direction straight ahead.
    pub fn sample(&self, wo: Vec3) -> SpecularSample {
        SpecularSample {
            wi: -wo,
            weight: self.kt,
            transmitted: true,
        }
    }
}

/// Smooth boundary between vacuum (+z side) and a medium of index `eta`: reflection and refraction by Fresnel.
#[derive(Clone, Copy, Debug)]
pub struct SmoothDielectric {
    /// Tint of the reflected part.
    pub kr: Rgb,
    /// Tint of the refracted part.
    pub kt: Rgb,
    /// Index of refraction on the −z side relative to the +z side, positive.
    pub eta: f32,
}

impl SmoothDielectric {
    /// What it reflects and refracts together.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        let reflectance = fresnel::dielectric(wo.z(), 1.0, self.eta);
        self.kr * reflectance + self.kt * (1.0 - reflectance)
    }

    /// Reflects or refracts. The choice follows the energy each way carries; `u` decides.
    pub fn sample(&self, wo: Vec3, u: f32, mode: TransportMode) -> Option<SpecularSample> {
        let reflectance = fresnel::dielectric(wo.z(), 1.0, self.eta);
        let (reflected, refracted) = (self.kr * reflectance, self.kt * (1.0 - reflectance));
        let (r, t) = (reflected.max_component(), refracted.max_component());
        if r + t <= 0.0 {
            return None;
        }
        let p_reflect = r / (r + t);
        if u < p_reflect {
            let mirrored = Vec3::new(-wo.x(), -wo.y(), wo.z());
            return Some(SpecularSample {
                wi: mirrored,
                weight: reflected * (1.0 / p_reflect),
                transmitted: false,
            });
        }
        let (wi, eta) = self.refract(wo)?;
        let weight = refracted * (compression(eta, mode) / (1.0 - p_reflect));
        Some(SpecularSample {
            wi,
            weight,
            transmitted: true,
        })
    }

    /// What is reflected and what is refracted.
    pub fn parts(&self, wo: Vec3, mode: TransportMode) -> [Option<SpecularPart>; 2] {
        let reflectance = fresnel::dielectric(wo.z(), 1.0, self.eta);
        let reflected = SpecularPart {
            wi: Vec3::new(-wo.x(), -wo.y(), wo.z()),
            weight: self.kr * reflectance,
            refraction: None,
        };
        let refracted = self.refract(wo).map(|(wi, eta)| SpecularPart {
            wi,
            weight: self.kt * ((1.0 - reflectance) * compression(eta, mode)),
            refraction: Some(eta),
        });
        [Some(reflected), refracted]
    }

    /// The refracted direction and the index of refraction on the side of `wo`, relative to the other.
    fn refract(&self, wo: Vec3) -> Option<(Vec3, f32)> {
        let entering = wo.z() > 0.0;
        let eta = if entering { 1.0 / self.eta } else { self.eta };
        let n = Vec3::new(0.0, 0.0, if entering { 1.0 } else { -1.0 });
        Some((fresnel::refract(wo, n, eta)?, eta))
    }
}

/// Radiance is compressed into the cone of the denser side (pbrt 3rd ed., section 16.1.3).
fn compression(eta: f32, mode: TransportMode) -> f32 {
    if mode == TransportMode::Radiance {
        eta * eta
    } else {
        1.0
    }
}
