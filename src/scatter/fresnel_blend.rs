//! Diffuse base under a rough coat.

use std::f32::consts::PI;

use crate::math::Vec3;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::scatter::fresnel::schlick_weight;
use crate::scatter::microfacet::{TrowbridgeReitz, unit};
use crate::scatter::same_hemisphere;
use crate::spectrum::Rgb;

/// Diffuse reflection below a microfacet coat that takes more of the light at grazing angles (Ashikhmin and Shirley
/// 2000, in the form of pbrt, 3rd ed., section 14.1.3: with this distribution and no masking).
#[derive(Clone, Copy, Debug)]
pub struct FresnelBlend {
    /// Reflectance of the base.
    pub rd: Rgb,
    /// Reflectance of the coat, seen straight on.
    pub rs: Rgb,
    /// Directions of the coat's facets.
    pub distribution: TrowbridgeReitz,
}

impl FresnelBlend {
    /// Value in sr⁻¹, cosine excluded, the same on both sides of the horizon: which side counts is decided by the
    /// geometric normal.
    #[inline]
    pub fn f(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let (cos_o, cos_i) = (wo.z().abs(), wi.z().abs());
        let passed = one_minus_pow5(0.5 * cos_i) * one_minus_pow5(0.5 * cos_o);
        let base = self.rd * (Rgb::ONE - self.rs) * (28.0 / (23.0 * PI) * passed);
        let greater = cos_o.max(cos_i);
        let Some(h) = unit(wo + wi) else {
            return Rgb::BLACK;
        };
        let cos_h = wi.abs_dot(h);
        if !(cos_h * greater > 0.0) {
            return base;
        }
        let coat = self.distribution.d(h) / (4.0 * cos_h * greater);
        base + self.schlick(cos_h) * coat
    }

    /// Draws `wi` on the side of `wo`: half the time by its cosine, half the time mirrored at a facet. `None` where
    /// that goes into the surface. `u_part` decides.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_part: f32, u: [f32; 2]) -> Option<Vec3> {
        if u_part < 0.5 {
            let wi = cosine_hemisphere(u);
            return Some(Vec3::new(wi.x(), wi.y(), wi.z().copysign(wo.z())));
        }
        self.distribution.sample_reflection(wo, u)
    }

    /// Density of [`FresnelBlend::sample`] in sr⁻¹.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        let base = cosine_hemisphere_pdf(wi.z().abs());
        0.5 * (base + self.distribution.pdf_reflection(wo, wi))
    }

    /// Density in sr⁻¹ with which pbrt-v3 draws `wi`.
    pub fn pdf_in_pbrt(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        let base = cosine_hemisphere_pdf(wi.z().abs());
        0.5 * (base + self.distribution.pdf_reflection_in_pbrt(wo, wi))
    }

    /// Schlick's approximation of Fresnel's equations.
    #[inline]
    fn schlick(&self, cos: f32) -> Rgb {
        self.rs + (Rgb::ONE - self.rs) * schlick_weight(cos)
    }
}

/// 1 − (1 − x)⁵ without cancellation for small x.
#[inline]
fn one_minus_pow5(x: f32) -> f32 {
    x * (5.0 + x * (-10.0 + x * (10.0 + x * (-5.0 + x))))
}
