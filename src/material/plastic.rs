//! Diffuse base and glossy coat. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kd` | 0.25 | diffuse reflectance |
//! | `spectrum texture Ks` | 0.25 | factor of the glossy reflection |
//! | `float texture roughness` | 0.1 | roughness of the coat |
//! | `bool remaproughness` | true | roughness is perceptual, 0 to 1; false: α of the distribution |
//! | `float texture bumpmap` | – | displacement |
//!
//! The coat reflects as if its inside, of index 1.5, were on the side of the normal: totally beyond 41.8°. That is how
//! pbrt-v3 has it, and the reason why its plastic shines.

use crate::material::roughness::Roughness;
use crate::material::{Input, Inputs};
use crate::scatter::diffuse::Diffuse;
use crate::scatter::fresnel::Fresnel;
use crate::scatter::rough_reflection::RoughReflection;
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::SpectrumSource;

/// Inputs of the plastic material.
#[derive(Clone, PartialEq, Debug)]
pub struct Plastic {
    /// `"Kd"`, clamped to ≥ 0 where it is evaluated.
    pub kd: SpectrumSource,
    /// `"Ks"`, clamped to ≥ 0 where it is evaluated.
    pub ks: SpectrumSource,
    /// `"roughness"` along both axes.
    pub roughness: Roughness,
}

impl Plastic {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        let (kd, ks) = (at.reflectance(self.kd), at.reflectance(self.ks));
        if !kd.is_black() {
            bsdf.add(Bxdf::Diffuse(Diffuse::new(kd, 0.0)));
        }
        if !ks.is_black() {
            bsdf.add(Bxdf::RoughReflection(RoughReflection {
                r: ks,
                distribution: self.roughness.distribution(at),
                fresnel: Fresnel::Dielectric {
                    eta_outside: 1.5,
                    eta_inside: 1.0,
                },
            }));
        }
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let mut inputs = vec![self.kd.into(), self.ks.into()];
        inputs.extend(self.roughness.inputs());
        inputs
    }
}
