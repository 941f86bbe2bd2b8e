//! Artists' material with many sliders (Burley 2012 and 2015). Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture color` | 0.5 | base colour |
//! | `float texture metallic` | 0 | dielectric to metal |
//! | `float texture eta` | 1.5 | index of refraction |
//! | `float texture roughness` | 0.5 | its square is the width of the highlight |
//! | `float texture speculartint` | 0 | tints the highlight with the base colour |
//! | `float texture anisotropic` | 0 | stretches the highlight along u |
//! | `float texture sheen`, `sheentint` | 0, 0.5 | glow of cloth at grazing angles, and its tint |
//! | `float texture clearcoat`, `clearcoatgloss` | 0, 1 | strength and gloss of a second highlight |
//! | `float texture spectrans` | 0 | opaque to glass-like |
//! | `spectrum texture scatterdistance` | 0 | how far light wanders beneath, scene units; not when thin |
//! | `bool thin` | false | a thin sheet instead of a solid |
//! | `float texture flatness` | 0 | flattens the diffuse part; only when thin |
//! | `float texture difftrans` | 1 | 0 reflects, 2 transmits all diffuse light; only when thin |
//! | `float texture bumpmap` | – | displacement |

use crate::material::{Input, Inputs};
use crate::scatter::diffuse::DiffuseTransmission;
use crate::scatter::disney::{Clearcoat, DisneyBase};
use crate::scatter::fresnel::Fresnel;
use crate::scatter::microfacet::TrowbridgeReitz;
use crate::scatter::rough_dielectric::RoughDielectric;
use crate::scatter::rough_reflection::RoughReflection;
use crate::scatter::specular::SmoothDielectric;
use crate::scatter::{Bsdf, Bssrdf, Bxdf};
use crate::spectrum::Rgb;
use crate::texture::{FloatSource, SpectrumSource};

/// Inputs of the Disney material.
#[derive(Clone, PartialEq, Debug)]
pub struct Disney {
    /// `"color"`.
    pub color: SpectrumSource,
    /// `"metallic"`.
    pub metallic: FloatSource,
    /// `"eta"`, positive.
    pub eta: FloatSource,
    /// `"roughness"`.
    pub roughness: FloatSource,
    /// `"speculartint"`.
    pub specular_tint: FloatSource,
    /// `"anisotropic"`.
    pub anisotropic: FloatSource,
    /// `"sheen"`.
    pub sheen: FloatSource,
    /// `"sheentint"`.
    pub sheen_tint: FloatSource,
    /// `"clearcoat"`.
    pub clearcoat: FloatSource,
    /// `"clearcoatgloss"`.
    pub clearcoat_gloss: FloatSource,
    /// `"spectrans"`.
    pub specular_transmission: FloatSource,
    /// What is below the surface.
    pub interior: Interior,
}

/// What a Disney material has beneath its surface.
#[derive(Clone, PartialEq, Debug)]
pub enum Interior {
    /// A solid: `"scatterdistance"` in world space, and the length in render space of one world unit.
    Solid(SpectrumSource, f32),
    /// A thin sheet: `"flatness"` and `"difftrans"`.
    Thin(FloatSource, FloatSource),
}

/// Scale of the distance for a `"scatterdistance"` of 1, as pbrt-v3 has it.
const DISTANCE_SCALE: f32 = 0.2;

impl Disney {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        let color = at.reflectance(self.color);
        let luminance = color.luminance();
        let tint = if luminance > 0.0 {
            color * (1.0 / luminance)
        } else {
            Rgb::ONE
        };
        // As a constant is: a texture may go anywhere.
        let roughness = at.float(self.roughness).max(0.0);
        let eta = at.index_of_refraction(self.eta);
        self.add_base(at, color, tint, roughness, bsdf);

        let aspect = (1.0 - 0.9 * at.float(self.anisotropic)).max(0.0).sqrt();
        let facets = |roughness: f32| {
            let alpha = roughness * roughness;
            TrowbridgeReitz::new(alpha / aspect, alpha * aspect)
        };
        let metallic = at.float(self.metallic).clamp(0.0, 1.0);
        let head_on = ((eta - 1.0) / (eta + 1.0)).powi(2);
        let dielectric = Rgb::ONE.lerp(tint, at.float(self.specular_tint)) * head_on;
        bsdf.add(Bxdf::RoughReflection(RoughReflection {
            r: Rgb::ONE,
            distribution: facets(roughness).separable(),
            fresnel: Fresnel::Disney {
                r0: dielectric.lerp(color, metallic).clamp_negative(),
                metallic,
                eta,
            },
        }));

        let clearcoat = at.float(self.clearcoat);
        if clearcoat > 0.0 {
            let gloss = at.float(self.clearcoat_gloss);
            bsdf.add(Bxdf::Clearcoat(Clearcoat::new(clearcoat, gloss)));
        }

        let transmission = at.float(self.specular_transmission);
        if transmission > 0.0 {
            // After two refractions light has the base colour.
            let kt = color.sqrt() * transmission;
            let facets = match self.interior {
                // Sheets of a lower index blur less (Burley 2015, figure 15).
                Interior::Thin(..) => facets((0.65 * eta - 0.35) * roughness),
                Interior::Solid(..) => facets(roughness).separable(),
            };
            bsdf.add(RoughDielectric::lobe(Rgb::BLACK, kt, facets, eta));
        }
        if let Interior::Thin(_, diffuse_transmission) = self.interior {
            // Neither metal nor glass takes from it, as in pbrt-v3.
            let kt = (color * (0.5 * at.float(diffuse_transmission))).clamp_negative();
            bsdf.add(Bxdf::DiffuseTransmission(DiffuseTransmission { kt }));
        }
    }

    /// How light wanders beneath, if it does: then the surface lets it in and out instead of reflecting it diffusely.
    /// `least` is the distance that cannot be told from none.
    pub(super) fn bssrdf(&self, at: &Inputs, least: f32) -> Option<Bssrdf<'static>> {
        let Interior::Solid(distance, scale) = self.interior else {
            return None;
        };
        let (weight, distance) = (self.diffuse_weight(at), at.reflectance(distance));
        (weight > 0.0 && !distance.is_black()).then(|| {
            let reflectance = at.reflectance(self.color) * weight;
            let distance = (distance * (DISTANCE_SCALE * scale)).max(Rgb::splat(least));
            Bssrdf::exponential(at.index_of_refraction(self.eta), reflectance, distance)
        })
    }

    /// Whether [`Disney::bssrdf`] finds anything anywhere, as far as the distance tells.
    pub(super) fn may_spread_light(&self) -> bool {
        match self.interior {
            Interior::Solid(SpectrumSource::Constant(distance), _) => {
                !distance.clamp_negative().is_black()
            }
            Interior::Solid(SpectrumSource::Texture(_), _) => true,
            Interior::Thin(..) => false,
        }
    }

    /// The part that is neither metal nor glass.
    fn diffuse_weight(&self, at: &Inputs) -> f32 {
        (1.0 - at.float(self.metallic)) * (1.0 - at.float(self.specular_transmission))
    }

    fn add_base(&self, at: &Inputs, color: Rgb, tint: Rgb, roughness: f32, bsdf: &mut Bsdf) {
        let weight = self.diffuse_weight(at);
        if !(weight > 0.0) {
            return;
        }
        let base = color * weight;
        let (mut diffuse, mut flat) = (base, Rgb::BLACK);
        let mut n_diffuse = 1;
        if let Interior::Thin(flatness, transmission) = self.interior {
            n_diffuse = 2;
            let flatness = at.float(flatness);
            let reflected = base * (1.0 - 0.5 * at.float(transmission));
            diffuse = (reflected * (1.0 - flatness)).clamp_negative();
            flat = (reflected * flatness).clamp_negative();
        } else if self.bssrdf(at, f32::MIN_POSITIVE).is_some() {
            n_diffuse = 0;
            diffuse = Rgb::BLACK;
            bsdf.add(Bxdf::SmoothDielectric(SmoothDielectric {
                kr: Rgb::BLACK,
                kt: Rgb::ONE,
                eta: at.index_of_refraction(self.eta),
            }));
        }
        let sheen = at.float(self.sheen).max(0.0);
        let n_sheens = u32::from(sheen > 0.0);
        let sheen = if sheen > 0.0 {
            Rgb::ONE.lerp(tint, at.float(self.sheen_tint)) * (weight * sheen)
        } else {
            Rgb::BLACK
        };
        bsdf.add(Bxdf::DisneyBase(DisneyBase {
            diffuse,
            flat,
            retro: base,
            sheen: sheen.clamp_negative(),
            roughness,
            // One more is the retro-reflection.
            n_lobes_in_pbrt: n_diffuse + 1 + n_sheens,
        }));
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let floats = [
            self.metallic,
            self.eta,
            self.roughness,
            self.specular_tint,
            self.anisotropic,
            self.sheen,
            self.sheen_tint,
            self.clearcoat,
            self.clearcoat_gloss,
            self.specular_transmission,
        ];
        let mut inputs = vec![self.color.into()];
        inputs.extend(floats.map(Input::from));
        match self.interior {
            Interior::Solid(distance, _) => inputs.push(distance.into()),
            Interior::Thin(flatness, transmission) => {
                inputs.extend([flatness, transmission].map(Input::from));
            }
        }
        inputs
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point3, Vec3};
    use crate::texture::{TextureContext, Textures};

    #[test]
    fn light_wanders_in_solids_that_are_neither_metal_nor_glass() {
        let constant = FloatSource::Constant;
        let mut disney = Disney {
            color: SpectrumSource::Constant(Rgb::splat(0.5)),
            metallic: constant(0.5),
            eta: constant(1.5),
            roughness: constant(0.5),
            specular_tint: constant(0.0),
            anisotropic: constant(0.0),
            sheen: constant(0.0),
            sheen_tint: constant(0.0),
            clearcoat: constant(0.0),
            clearcoat_gloss: constant(0.0),
            specular_transmission: constant(0.2),
            interior: Interior::Solid(SpectrumSource::Constant(Rgb::splat(2.0)), 3.0),
        };
        let ctx = TextureContext {
            p: Point3::ZERO,
            uv: [0.0; 2],
            duv_dx: [0.0; 2],
            duv_dy: [0.0; 2],
            dp_dx: Vec3::ZERO,
            dp_dy: Vec3::ZERO,
            face: 0,
        };
        let textures = Textures::default();
        let at = Inputs {
            ctx: &ctx,
            textures: &textures,
        };
        let bssrdf = disney.bssrdf(&at, 1e-9).expect("light wanders");
        assert!((bssrdf.effective_albedo().r() - 0.5 * 0.5 * 0.8).abs() < 1e-6);
        // Half of what the shorter exponential draws lies within its scale times ln 2.
        let median = bssrdf.sample_radius(0, 0.125).expect("light wanders");
        assert!((median - 1.2 * std::f32::consts::LN_2).abs() < 1e-5);
        disney.metallic = constant(1.0);
        assert!(disney.bssrdf(&at, 1e-9).is_none());
        disney.metallic = constant(0.0);
        disney.interior = Interior::Thin(constant(0.0), constant(1.0));
        assert!(disney.bssrdf(&at, 1e-9).is_none());
    }
}
