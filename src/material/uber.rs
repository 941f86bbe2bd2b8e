//! Diffuse, glossy, mirror and transparent parts in one. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kd`, `Ks` | 0.25, 0.25 | diffuse and glossy reflectance |
//! | `spectrum texture Kr`, `Kt` | 0, 0 | tints of specular reflection and transmission |
//! | `float texture roughness` | 0.1 | roughness of the glossy part |
//! | `float texture uroughness` | `roughness` | roughness along u |
//! | `float texture vroughness` | `uroughness` | roughness along v |
//! | `float texture eta` (or `index`) | 1.5 | index of refraction on the inside |
//! | `spectrum texture opacity` | 1 | the rest of the light goes straight through |
//! | `bool remaproughness` | true | roughness is perceptual, 0 to 1; false: α of the distribution |
//! | `float texture bumpmap` | – | displacement |

use crate::material::roughness::Roughness;
use crate::material::{Input, Inputs};
use crate::scatter::diffuse::Diffuse;
use crate::scatter::fresnel::Fresnel;
use crate::scatter::rough_reflection::RoughReflection;
use crate::scatter::specular::{PassThrough, SmoothDielectric};
use crate::scatter::{Bsdf, Bxdf};
use crate::spectrum::Rgb;
use crate::texture::{FloatSource, SpectrumSource};

/// Inputs of the uber material. Colours are clamped to ≥ 0 where they are evaluated.
#[derive(Clone, PartialEq, Debug)]
pub struct Uber {
    /// `"Kd"`.
    pub kd: SpectrumSource,
    /// `"Ks"`.
    pub ks: SpectrumSource,
    /// `"Kr"`.
    pub kr: SpectrumSource,
    /// `"Kt"`.
    pub kt: SpectrumSource,
    /// `"opacity"`.
    pub opacity: SpectrumSource,
    /// `"uroughness"` and `"vroughness"`.
    pub roughness: Roughness,
    /// `"eta"`, positive.
    pub eta: FloatSource,
}

impl Uber {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        let eta = at.index_of_refraction(self.eta);
        let opacity = at.reflectance(self.opacity);
        let passed = (Rgb::ONE - opacity).clamp_negative();
        if passed.is_black() {
            bsdf.set_eta(eta);
        } else {
            // Russian roulette then takes no note of the index, as in pbrt-v3.
            bsdf.add(Bxdf::PassThrough(PassThrough { kt: passed }));
        }
        let part = |source| opacity * at.reflectance(source);
        let (kd, ks, kr, kt) = (part(self.kd), part(self.ks), part(self.kr), part(self.kt));
        if !kd.is_black() {
            bsdf.add(Bxdf::Diffuse(Diffuse::new(kd, 0.0)));
        }
        if !ks.is_black() {
            bsdf.add(Bxdf::RoughReflection(RoughReflection {
                r: ks,
                distribution: self.roughness.distribution(at),
                fresnel: Fresnel::Dielectric {
                    eta_outside: 1.0,
                    eta_inside: eta,
                },
            }));
        }
        if !(kr.is_black() && kt.is_black()) {
            bsdf.add(Bxdf::SmoothDielectric(SmoothDielectric { kr, kt, eta }));
        }
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let colours = [self.kd, self.ks, self.kr, self.kt, self.opacity];
        let mut inputs: Vec<_> = colours.into_iter().map(Input::from).collect();
        inputs.extend(self.roughness.inputs());
        inputs.push(self.eta.into());
        inputs
    }
}
