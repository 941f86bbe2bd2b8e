//! Rough interface between dielectrics: each microfacet reflects and refracts.

use crate::math::Vec3;
use crate::scatter::bsdf::{Bxdf, TransportMode};
use crate::scatter::fresnel;
use crate::scatter::microfacet::{TrowbridgeReitz, mirror, unit};
use crate::scatter::same_hemisphere;
use crate::scatter::specular::SmoothDielectric;
use crate::spectrum::Rgb;

/// Reflection and transmission by microfacets of a dielectric (Walter et al. 2007; pbrt, 3rd ed., section 8.4.4).
///
/// One lobe for both, so that each facet reflects and refracts in proportion to what it sends either way.
#[derive(Clone, Copy, Debug)]
pub struct RoughDielectric {
    /// Tint of the reflected part.
    kr: Rgb,
    /// Tint of the refracted part.
    kt: Rgb,
    distribution: TrowbridgeReitz,
    /// Index of refraction on the −z side relative to the +z side, positive.
    eta: f32,
}

/// Narrowest transmitted lobe, in radians, that directions in single precision still resolve.
const LEAST_WIDTH: f32 = 1.0 / 32768.0;

/// A facet that sends `wo` to `wi`.
struct Facet {
    /// Its normal, on the side of `wo`.
    h: Vec3,
    cos_o: f32,
    /// Its Fresnel reflectance.
    reflectance: f32,
}

impl RoughDielectric {
    /// The lobe of an interface. `eta` > 0 is the index on the −z side relative to the +z side.
    ///
    /// Where both indices are nearly the same, every facet transmits nearly straight ahead: what deflects light less
    /// than directions resolve is a smooth interface.
    pub fn lobe(kr: Rgb, kt: Rgb, distribution: TrowbridgeReitz, eta: f32) -> Bxdf<'static> {
        if distribution.min_alpha() * (eta - 1.0).abs() < LEAST_WIDTH * eta.max(1.0) {
            return Bxdf::SmoothDielectric(SmoothDielectric { kr, kt, eta });
        }
        Bxdf::RoughDielectric(Self {
            kr,
            kt,
            distribution,
            eta,
        })
    }

    /// Value in sr⁻¹, cosine excluded.
    pub fn f(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        if wo.z() == 0.0 || wi.z() == 0.0 {
            return Rgb::BLACK;
        }
        if same_hemisphere(wo, wi) {
            let Some(facet) = self.mirroring_facet(wo, wi) else {
                return Rgb::BLACK;
            };
            let value = self.distribution.d(facet.h) * self.distribution.visibility(wo, wi);
            return self.kr * (facet.reflectance * value);
        }
        let Some((facet, dh_dwi)) = self.refracting_facet(wo, wi) else {
            return Rgb::BLACK;
        };
        // Radiance is compressed into the cone of the denser side (pbrt 3rd ed., section 16.1.3).
        let eta = self.relative_index(wo);
        let compression = match mode {
            TransportMode::Radiance => 1.0 / (eta * eta),
            TransportMode::Importance => 1.0,
        };
        let value = 4.0
            * self.distribution.d(facet.h)
            * self.distribution.visibility(wo, wi)
            * facet.cos_o
            * dh_dwi;
        self.kt * ((1.0 - facet.reflectance) * value * compression)
    }

    /// Roughly what part of the light it scatters.
    pub fn importance(&self, wo: Vec3) -> Rgb {
        let reflectance = fresnel::dielectric(wo.z(), 1.0, self.eta);
        self.kr * reflectance + self.kt * (1.0 - reflectance)
    }

    /// Draws a facet visible from `wo`, then, by `u_side`, whether it reflects or refracts. `None` where that goes
    /// nowhere.
    pub fn sample(&self, wo: Vec3, u_side: f32, u: [f32; 2]) -> Option<Vec3> {
        let h = self.distribution.sample_normal(wo, u);
        let facet = self.facet(wo, h)?;
        let p_reflect = self.p_reflect(&facet)?;
        let wi = if u_side < p_reflect {
            mirror(wo, h)
        } else {
            fresnel::refract(wo, h, 1.0 / self.relative_index(wo))?
        };
        (same_hemisphere(wo, wi) == (u_side < p_reflect) && wi.z() != 0.0).then_some(wi)
    }

    /// Density of [`RoughDielectric::sample`] in sr⁻¹.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        if wo.z() == 0.0 || wi.z() == 0.0 {
            return 0.0;
        }
        let density = if same_hemisphere(wo, wi) {
            self.mirroring_facet(wo, wi).and_then(|facet| {
                let dh_dwi = 0.25 / facet.cos_o;
                let p = self.p_reflect(&facet)?;
                Some(self.distribution.pdf_normal(wo, facet.h) * dh_dwi * p)
            })
        } else {
            self.refracting_facet(wo, wi).and_then(|(facet, dh_dwi)| {
                let p = 1.0 - self.p_reflect(&facet)?;
                Some(self.distribution.pdf_normal(wo, facet.h) * dh_dwi * p)
            })
        };
        density.unwrap_or(0.0)
    }

    /// Densities in sr⁻¹ with which pbrt-v3 draws `wi` by reflection, and by transmission: two lobes, each of which is
    /// there unless its tint is black.
    pub fn pdfs_in_pbrt(&self, wo: Vec3, wi: Vec3) -> [Option<f32>; 2] {
        let reflection = || self.distribution.pdf_reflection_in_pbrt(wo, wi);
        let transmission = || self.pdf_transmission_in_pbrt(wo, wi);
        [
            (!self.kr.is_black()).then(reflection),
            (!self.kt.is_black()).then(transmission),
        ]
    }

    fn pdf_transmission_in_pbrt(&self, wo: Vec3, wi: Vec3) -> f32 {
        if same_hemisphere(wo, wi) {
            return 0.0;
        }
        let eta = self.relative_index(wo);
        let generalized = (wo + wi) + wi * (eta - 1.0);
        let Some(h) = unit(generalized) else {
            return 0.0;
        };
        if wo.dot(h) * wi.dot(h) > 0.0 {
            return 0.0;
        }
        let dh_dwi = eta * eta * wi.abs_dot(h) / generalized.length_squared();
        self.distribution.pdf_normal_in_pbrt(wo, h) * dh_dwi
    }

    /// Index on the other side of `wo` relative to that on its own side.
    #[inline]
    fn relative_index(&self, wo: Vec3) -> f32 {
        if wo.z() > 0.0 {
            self.eta
        } else {
            1.0 / self.eta
        }
    }

    /// A facet with normal `h` on the side of `wo`; `None` if it is seen from behind.
    #[inline]
    fn facet(&self, wo: Vec3, h: Vec3) -> Option<Facet> {
        let cos_o = wo.dot(h);
        if !(cos_o > 0.0) {
            return None;
        }
        let signed = if wo.z() > 0.0 { cos_o } else { -cos_o };
        Some(Facet {
            h,
            cos_o,
            reflectance: fresnel::dielectric(signed, 1.0, self.eta),
        })
    }

    /// Probability with which a facet reflects; `None` if it sends nothing anywhere.
    #[inline]
    fn p_reflect(&self, facet: &Facet) -> Option<f32> {
        let reflected = self.kr.max_component() * facet.reflectance;
        let refracted = self.kt.max_component() * (1.0 - facet.reflectance);
        let sum = reflected + refracted;
        (sum > 0.0).then(|| reflected / sum)
    }

    #[inline]
    fn mirroring_facet(&self, wo: Vec3, wi: Vec3) -> Option<Facet> {
        self.facet(wo, unit(wo + wi)?)
    }

    /// The facet that refracts `wo` to `wi`, on the other side, and the change of its normal with `wi`.
    #[inline]
    fn refracting_facet(&self, wo: Vec3, wi: Vec3) -> Option<(Facet, f32)> {
        let eta = self.relative_index(wo);
        // Its normal, by Snell's law. Written so that wo and wi cancel before anything is rounded.
        let generalized = (wo + wi) + wi * (eta - 1.0);
        let h = unit(generalized)?;
        let h = if same_hemisphere(wo, h) { h } else { -h };
        let facet = self.facet(wo, h)?;
        let cos_i = -wi.dot(h);
        if !(cos_i > 0.0) {
            return None;
        }
        let dh_dwi = eta * eta * cos_i / generalized.length_squared();
        Some((facet, dh_dwi))
    }
}
