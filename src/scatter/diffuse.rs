//! Diffuse reflection, Lambert and Oren–Nayar, and diffuse transmission.

use std::f32::consts::FRAC_1_PI;

use crate::math::Vec3;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::scatter::same_hemisphere;
use crate::spectrum::Rgb;

/// Diffuse reflection from rough facets; Lambert's law where the roughness is 0.
///
/// Oren and Nayar 1994 in the form of pbrt (3rd ed., section 8.4.1).
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    kd: Rgb,
    /// (A, B) of the model; (1, 0) is Lambert.
    a: f32,
    b: f32,
}

impl Diffuse {
    /// `kd` is hemispherical reflectance for zero roughness; `sigma` is the standard deviation of facet slopes in
    /// degrees, clamped to [0, 90].
    pub fn new(kd: Rgb, sigma: f32) -> Self {
        let sigma2 = sigma.clamp(0.0, 90.0).to_radians().powi(2);
        Self {
            kd,
            a: 1.0 - sigma2 / (2.0 * (sigma2 + 0.33)),
            b: 0.45 * sigma2 / (sigma2 + 0.09),
        }
    }

    /// Hemispherical reflectance for zero roughness.
    #[inline]
    pub fn kd(&self) -> Rgb {
        self.kd
    }

    /// Whether it follows Lambert's law.
    pub fn is_lambertian(&self) -> bool {
        self.b == 0.0
    }

    /// Value in sr⁻¹, cosine excluded, the same on both sides of the horizon: which side counts is decided by the
    /// geometric normal in [`crate::scatter::Bsdf`].
    #[inline]
    pub fn f(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let lambert = self.kd * FRAC_1_PI;
        if self.b == 0.0 {
            return lambert;
        }
        let (sin_i, sin_o) = (sin_theta(wi), sin_theta(wo));
        // cos(φi − φo), 0 where either azimuth is undefined.
        let max_cos = if sin_i > 0.0 && sin_o > 0.0 {
            ((wi.x() * wo.x() + wi.y() * wo.y()) / (sin_i * sin_o)).max(0.0)
        } else {
            0.0
        };
        let (cos_i, cos_o) = (wi.z().abs(), wo.z().abs());
        let (sin_alpha, tan_beta) = if cos_i > cos_o {
            (sin_o, sin_i / cos_i)
        } else {
            (sin_i, sin_o / cos_o)
        };
        lambert * (self.a + self.b * max_cos * sin_alpha * tan_beta)
    }

    /// Draws `wi` with a density proportional to its cosine, on the side of `wo`.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let wi = cosine_hemisphere(u);
        if wo.z() < 0.0 {
            Vec3::new(wi.x(), wi.y(), -wi.z())
        } else {
            wi
        }
    }

    /// Density of [`Diffuse::sample`] in sr⁻¹.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if same_hemisphere(wo, wi) {
            cosine_hemisphere_pdf(wi.z().abs())
        } else {
            0.0
        }
    }
}

/// Diffuse transmission: light from the other side leaves evenly in all directions.
#[derive(Clone, Copy, Debug)]
pub struct DiffuseTransmission {
    /// Hemispherical transmittance.
    pub kt: Rgb,
}

impl DiffuseTransmission {
    /// Value in sr⁻¹, cosine excluded, for any pair of directions: which side counts is decided by the geometric
    /// normal.
    #[inline]
    pub fn f(&self) -> Rgb {
        self.kt * FRAC_1_PI
    }

    /// Draws `wi` with a density proportional to its cosine, on the other side of `wo`.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let wi = cosine_hemisphere(u);
        Vec3::new(wi.x(), wi.y(), wi.z().copysign(-wo.z()))
    }

    /// Density of [`DiffuseTransmission::sample`] in sr⁻¹.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if same_hemisphere(wo, wi) {
            0.0
        } else {
            cosine_hemisphere_pdf(wi.z().abs())
        }
    }
}

#[inline]
fn sin_theta(w: Vec3) -> f32 {
    (w.x() * w.x() + w.y() * w.y()).sqrt()
}
