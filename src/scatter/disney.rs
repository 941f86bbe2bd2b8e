//! The lobes that only the Disney material has: its diffuse base and its clear coat (Burley 2012, "Physically-Based
//! Shading at Disney", and 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering").

use std::f32::consts::{FRAC_1_PI, PI};

use crate::math::Vec3;
use crate::sampling::warp::{cosine_hemisphere, cosine_hemisphere_pdf};
use crate::scatter::fresnel::schlick_weight;
use crate::scatter::microfacet::{mirror, unit};
use crate::scatter::same_hemisphere;
use crate::spectrum::Rgb;

/// Everything that is spread widely: four colours, each with a shape of its own.
#[derive(Clone, Copy, Debug)]
pub struct DisneyBase {
    /// Diffuse reflection that fades toward grazing angles.
    pub diffuse: Rgb,
    /// Flat reflection in the shape of Hanrahan and Krueger 1993, which looks like scattering in a thin sheet.
    pub flat: Rgb,
    /// Reflection back toward the light at grazing angles.
    pub retro: Rgb,
    /// Glow of cloth at grazing angles.
    pub sheen: Rgb,
    /// Roughness, of which the shapes depend.
    pub roughness: f32,
    /// Lobes that pbrt-v3 makes of it, black ones included.
    pub n_lobes_in_pbrt: u32,
}

impl DisneyBase {
    /// Value in sr⁻¹, cosine excluded, the same on both sides of the horizon: which side counts is decided by the
    /// geometric normal.
    pub fn f(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let (cos_o, cos_i) = (wo.z().abs(), wi.z().abs());
        let (fade_o, fade_i) = (schlick_weight(cos_o), schlick_weight(cos_i));
        // Burley 2015, eq. 4.
        let diffuse = self.diffuse * (FRAC_1_PI * (1.0 - 0.5 * fade_o) * (1.0 - 0.5 * fade_i));
        // Without a half vector nothing but that is defined.
        let Some(h) = unit(wo + wi) else {
            return diffuse;
        };
        let cos_d = wi.dot(h);
        let grazing = cos_d * cos_d * self.roughness;
        let r = 2.0 * grazing;
        let retro = FRAC_1_PI * r * (fade_o + fade_i + fade_o * fade_i * (r - 1.0));
        diffuse
            + self.flat_part(cos_o, cos_i, fade_o, fade_i, grazing)
            + self.retro * retro
            + self.sheen * schlick_weight(cos_d)
    }

    fn flat_part(&self, cos_o: f32, cos_i: f32, fade_o: f32, fade_i: f32, grazing: f32) -> Rgb {
        if self.flat.is_black() || !(cos_o + cos_i > 0.0) {
            return Rgb::BLACK;
        }
        let toward = |fade: f32| 1.0 + fade * (grazing - 1.0);
        let fade = toward(fade_o) * toward(fade_i);
        // 1.25 roughly keeps the albedo.
        self.flat * (FRAC_1_PI * 1.25 * (fade * (1.0 / (cos_o + cos_i) - 0.5) + 0.5))
    }

    /// Draws `wi` with a density proportional to its cosine, on the side of `wo`.
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let wi = cosine_hemisphere(u);
        Vec3::new(wi.x(), wi.y(), wi.z().copysign(wo.z()))
    }

    /// Density of [`DisneyBase::sample`] in sr⁻¹.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if same_hemisphere(wo, wi) {
            cosine_hemisphere_pdf(wi.z().abs())
        } else {
            0.0
        }
    }
}

/// A clear coat of index 1.5 over everything else, with a distribution of facets that has long tails.
#[derive(Clone, Copy, Debug)]
pub struct Clearcoat {
    weight: f32,
    /// Width of the distribution, inside (0, 1).
    alpha: f32,
}

impl Clearcoat {
    /// `weight` ≥ 0 scales it, `gloss` goes from satin, 0, to polished, 1; beyond, the distribution stays defined.
    pub fn new(weight: f32, gloss: f32) -> Self {
        Self {
            weight,
            alpha: (0.1 + gloss * (0.001 - 0.1)).clamp(0.001, 0.99),
        }
    }

    /// Value in sr⁻¹, cosine excluded.
    pub fn f(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let Some(h) = unit(wo + wi) else {
            return Rgb::BLACK;
        };
        let fresnel = 0.04 + 0.96 * schlick_weight(wo.dot(h));
        let masking = masking(wo.z().abs()) * masking(wi.z().abs());
        Rgb::splat(0.25 * self.weight * self.d(h) * fresnel * masking)
    }

    /// Roughly what part of the light it reflects: that of a smooth coat.
    pub fn importance(&self, wo: Vec3) -> f32 {
        self.weight * (0.04 + 0.96 * schlick_weight(wo.z().abs()))
    }

    /// Draws the direction that a facet mirrors `wo` to. `None` where that goes into the surface.
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let a2 = self.alpha * self.alpha;
        let sin2 = a2 * (-u[0] * a2.ln()).exp_m1() / (1.0 - a2);
        let (sin, cos) = (sin2.sqrt(), (1.0 - sin2).max(0.0).sqrt());
        let (sin_phi, cos_phi) = (2.0 * PI * u[1]).sin_cos();
        let h = Vec3::new(sin * cos_phi, sin * sin_phi, cos.copysign(wo.z()));
        let wi = mirror(wo, h);
        same_hemisphere(wo, wi).then_some(wi)
    }

    /// Density of [`Clearcoat::sample`] in sr⁻¹.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if !same_hemisphere(wo, wi) {
            return 0.0;
        }
        match unit(wo + wi) {
            Some(h) => self.d(h) * h.z().abs() / (4.0 * wo.dot(h)),
            None => 0.0,
        }
    }

    /// Density of facets with normal `h` (Burley 2012, eq. 4), with the sine instead of 1 − cos².
    fn d(&self, h: Vec3) -> f32 {
        let a2 = self.alpha * self.alpha;
        let sin2 = h.x() * h.x() + h.y() * h.y();
        (a2 - 1.0) / (PI * a2.ln() * (sin2 + a2 * h.z() * h.z()))
    }
}

/// Smith's masking for GGX of width 0.25, over 2 cos θ.
fn masking(cos: f32) -> f32 {
    const A2: f32 = 0.25 * 0.25;
    1.0 / (cos + (A2 + (1.0 - A2) * cos * cos).sqrt())
}
