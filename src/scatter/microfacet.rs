//! Distribution of microfacet normals: anisotropic Trowbridge–Reitz (GGX), with Smith's masking.
//!
//! Everything is written in terms of the length s(w) = √(w_z² + (α_x w_x)² + (α_y w_y)²) of a direction that is
//! stretched with the surface, so that nothing divides by a cosine: Λ = (s/|w_z| − 1)/2, and what a lobe needs stays
//! finite at grazing angles.
//!
//! Walter et al. 2007 and pbrt (3rd ed., section 8.4) for the model; Dupuy and Benyoub 2023, "Sampling Visible GGX
//! Normals with Spherical Caps", and Eto and Tokuyoshi 2023, "Bounded VNDF Sampling for Smith–GGX Reflections", for
//! the samplers.

use std::f32::consts::{FRAC_1_PI, TAU};

use crate::math::Vec3;
use crate::scatter::same_hemisphere;

/// Least α of an axis; smaller ones are clamped to it.
pub const MIN_ALPHA: f32 = 1e-3;
/// Greatest α of an axis: slopes of a million to one.
const MAX_ALPHA: f32 = 1e6;

/// α of a scene file's roughness, by the polynomial of the scene format. A roughness of 0 gives 0.047, 1 gives 1.62.
pub fn alpha_from_roughness(roughness: f32) -> f32 {
    let x = roughness.max(1e-3).ln();
    1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)))
}

/// The Trowbridge–Reitz distribution of normals, in the shading frame. Directions may lie on either side of the
/// surface; the distribution is the same seen from both.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TrowbridgeReitz {
    alpha_x: f32,
    alpha_y: f32,
    masking: Masking,
}

/// How masking and shadowing go together.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Masking {
    /// Correlated by height: G = 1/(1 + Λo + Λi).
    Correlated,
    /// Independent: G = 1/(1 + Λo) · 1/(1 + Λi).
    Separable,
}

impl TrowbridgeReitz {
    /// `alpha_x` and `alpha_y` are widths along the frame's x and y, clamped to at least [`MIN_ALPHA`]; what is no
    /// number counts as that.
    pub fn new(alpha_x: f32, alpha_y: f32) -> Self {
        let sensible = |alpha: f32| {
            if alpha >= MIN_ALPHA {
                alpha.min(MAX_ALPHA)
            } else {
                MIN_ALPHA
            }
        };
        Self {
            alpha_x: sensible(alpha_x),
            alpha_y: sensible(alpha_y),
            masking: Masking::Correlated,
        }
    }

    /// The same with masking and shadowing independent of each other, instead of correlated by height.
    pub fn separable(self) -> Self {
        Self {
            masking: Masking::Separable,
            ..self
        }
    }

    /// The smaller of its two widths.
    #[inline]
    pub fn min_alpha(&self) -> f32 {
        self.alpha_x.min(self.alpha_y)
    }

    /// Density of normals in sr⁻¹: area of facets with normal `h` (unit, either sign) per area of the surface.
    #[inline]
    pub fn d(&self, h: Vec3) -> f32 {
        let (x, y) = (h.x() / self.alpha_x, h.y() / self.alpha_y);
        let e = x * x + y * y + h.z() * h.z();
        FRAC_1_PI / (self.alpha_x * self.alpha_y * e * e)
    }

    /// G(wo, wi) / (4 |cos θo| |cos θi|), where G is the part of the facets seen from both directions.
    #[inline]
    pub fn visibility(&self, wo: Vec3, wi: Vec3) -> f32 {
        let (cos_o, cos_i) = (wo.z().abs(), wi.z().abs());
        let (o, i) = (self.stretched_length(wo), self.stretched_length(wi));
        match self.masking {
            Masking::Correlated => 0.5 / (o * cos_i + i * cos_o),
            Masking::Separable => 1.0 / ((cos_o + o) * (cos_i + i)),
        }
    }

    /// Draws a normal as visible from `wo`, on the side of `wo`.
    #[inline]
    pub fn sample_normal(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        self.on_upper_side(wo, |wo| self.normal_in_cap(wo, u, 0.0))
    }

    /// Density of [`TrowbridgeReitz::sample_normal`] in sr⁻¹; `h` is a unit vector on the side of `wo`. 0 for facets
    /// that are seen from behind.
    #[inline]
    pub fn pdf_normal(&self, wo: Vec3, h: Vec3) -> f32 {
        let cos = wo.dot(h);
        if cos <= 0.0 || !same_hemisphere(wo, h) {
            return 0.0;
        }
        2.0 * self.d(h) * cos / (wo.z().abs() + self.stretched_length(wo))
    }

    /// Draws a direction that a facet visible from `wo` mirrors `wo` to. `None` where that goes into the surface.
    ///
    /// Facets that surely mirror into the surface are not drawn, so that few directions are lost.
    #[inline]
    pub fn sample_reflection(&self, wo: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let h = self.on_upper_side(wo, |wo| self.normal_in_cap(wo, u, self.cut(wo)));
        let wi = mirror(wo, h);
        same_hemisphere(wo, wi).then_some(wi)
    }

    /// Density of [`TrowbridgeReitz::sample_reflection`] in sr⁻¹.
    #[inline]
    pub fn pdf_reflection(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        let Some(h) = unit(wo + wi) else {
            return 0.0;
        };
        let kept = 1.0 - self.cut(wo);
        self.d(h) / (2.0 * (kept * wo.z().abs() + self.stretched_length(wo)))
    }

    /// Density in sr⁻¹ with which pbrt-v3 draws the normal `h`, unit and of either sign, as visible from `wo`: that of
    /// facets seen from behind as well.
    #[inline]
    pub fn pdf_normal_in_pbrt(&self, wo: Vec3, h: Vec3) -> f32 {
        2.0 * self.d(h) * wo.abs_dot(h) / (wo.z().abs() + self.stretched_length(wo))
    }

    /// The same for the direction `wi` that a facet mirrors `wo` to: facets that mirror into the surface are drawn, and
    /// lost.
    #[inline]
    pub fn pdf_reflection_in_pbrt(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        unit(wo + wi).map_or(0.0, |h| {
            0.5 * self.d(h) / (wo.z().abs() + self.stretched_length(wo))
        })
    }

    /// Length of `w` in the space where the surface is stretched to α = 1.
    #[inline]
    fn stretched_length(&self, w: Vec3) -> f32 {
        let (x, y) = (self.alpha_x * w.x(), self.alpha_y * w.y());
        (x * x + y * y + w.z() * w.z()).sqrt()
    }

    /// Applies `sample` to `wo` as seen from above.
    #[inline]
    fn on_upper_side(&self, wo: Vec3, sample: impl Fn(Vec3) -> Vec3) -> Vec3 {
        if wo.z() < 0.0 {
            -sample(-wo)
        } else {
            sample(wo)
        }
    }

    /// Part by which the lower bound of the cap of mirrored directions may be raised for reflection: 1 − k of Eto and
    /// Tokuyoshi, without the cancellation.
    #[inline]
    fn cut(&self, wo: Vec3) -> f32 {
        let a = self.min_alpha().min(1.0);
        let (a2, z2) = (a * a, wo.z() * wo.z());
        let s = 1.0 + (wo.x() * wo.x() + wo.y() * wo.y()).sqrt();
        a2 * (s * s + z2) / (s * s + a2 * z2)
    }

    /// A normal visible from `wo`, which lies above: half of `wo` and a direction drawn from the cap z > −b of the
    /// unit sphere in stretched space, where b = (1 − `cut`) cos θ.
    #[inline]
    fn normal_in_cap(&self, wo: Vec3, u: [f32; 2], cut: f32) -> Vec3 {
        let length = self.stretched_length(wo);
        let scale = 1.0 / length;
        let (x, y) = (self.alpha_x * wo.x() * scale, self.alpha_y * wo.y() * scale);
        let z = wo.z() * scale;
        let b = (1.0 - cut) * z;
        // 1 − b and the heights over the bounds of the cap, each from terms of one sign.
        let one_minus_b = (x * x + y * y) / (1.0 + z) + cut * z;
        let above_cap = (1.0 - u[1]) * (1.0 + b);
        let below_pole = u[1] * (1.0 + b);
        let r = (below_pole * (above_cap + one_minus_b)).sqrt();
        let (sin, cos) = (TAU * u[0]).sin_cos();
        let h = Vec3::new(
            self.alpha_x * (x + r * cos),
            self.alpha_y * (y + r * sin),
            above_cap + cut * z,
        );
        // All three vanish together only where u is 1.
        unit(h).unwrap_or(Vec3::new(0.0, 0.0, 1.0))
    }
}

/// The direction of a vector made of unit vectors; `None` if nothing is left of them.
#[inline]
pub fn unit(v: Vec3) -> Option<Vec3> {
    let square = v.length_squared();
    (square >= f32::MIN_POSITIVE).then(|| v * (1.0 / square.sqrt()))
}

/// `w` mirrored at a facet with normal `h`.
#[inline]
pub fn mirror(w: Vec3, h: Vec3) -> Vec3 {
    h * (2.0 * w.dot(h)) - w
}
