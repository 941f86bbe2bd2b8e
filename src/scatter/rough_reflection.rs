//! Reflection from rough surfaces: mirrors in a distribution of directions.

use crate::math::Vec3;
use crate::scatter::fresnel::Fresnel;
use crate::scatter::microfacet::{TrowbridgeReitz, unit};
use crate::spectrum::Rgb;

/// Reflection by microfacets (Torrance and Sparrow 1967; pbrt, 3rd ed., section 8.4.4).
#[derive(Clone, Copy, Debug)]
pub struct RoughReflection {
    /// Factor of the reflectance.
    pub r: Rgb,
    /// Directions of the facets.
    pub distribution: TrowbridgeReitz,
    /// Reflectance of a facet.
    pub fresnel: Fresnel,
}

impl RoughReflection {
    /// Value in sr⁻¹, cosine excluded. Defined for directions on different sides of the shading normal, too: which
    /// side counts is decided by the geometric normal.
    #[inline]
    pub fn f(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let Some(h) = unit(wo + wi) else {
            return Rgb::BLACK;
        };
        if wo.z() == 0.0 || wi.z() == 0.0 {
            return Rgb::BLACK;
        }
        let facing_up = if h.z() < 0.0 { -h } else { h };
        let reflectance = self.fresnel.evaluate(wi.dot(facing_up));
        let value = self.distribution.d(h) * self.distribution.visibility(wo, wi);
        self.r * reflectance * value
    }

    /// Roughly what part of the light it reflects: its facets look both ways from the surface itself.
    #[inline]
    pub fn importance(&self, wo: Vec3) -> Rgb {
        self.r * self.fresnel.evaluate(wo.z())
    }

    /// Draws the mirrored direction of a facet visible from `wo`; `None` where that goes into the surface.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<Vec3> {
        self.distribution.sample_reflection(wo, u)
    }

    /// Density in sr⁻¹ with which pbrt-v3 draws `wi`.
    pub fn pdf_in_pbrt(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.distribution.pdf_reflection_in_pbrt(wo, wi)
    }

    /// Density of [`RoughReflection::sample`] in sr⁻¹.
    #[inline]
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.distribution.pdf_reflection(wo, wi)
    }
}
