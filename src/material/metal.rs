//! Rough conductor. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture eta` | copper | index of refraction |
//! | `spectrum texture k` | copper | absorption coefficient |
//! | `float texture roughness` | 0.01 | roughness along both axes |
//! | `float texture uroughness` | `roughness` | roughness along u |
//! | `float texture vroughness` | `roughness` | roughness along v |
//! | `bool remaproughness` | true | roughness is perceptual, 0 to 1; false: α of the distribution |
//! | `float texture bumpmap` | – | displacement |

use crate::material::roughness::Roughness;
use crate::material::{Input, Inputs};
use crate::scatter::fresnel::Fresnel;
use crate::scatter::rough_reflection::RoughReflection;
use crate::scatter::{Bsdf, Bxdf};
use crate::spectrum::Rgb;
use crate::texture::SpectrumSource;

/// Inputs of the metal material.
#[derive(Clone, PartialEq, Debug)]
pub struct Metal {
    /// `"eta"`.
    pub eta: SpectrumSource,
    /// `"k"`.
    pub k: SpectrumSource,
    /// `"uroughness"` and `"vroughness"`.
    pub roughness: Roughness,
}

impl Metal {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        bsdf.add(Bxdf::RoughReflection(RoughReflection {
            r: Rgb::ONE,
            distribution: self.roughness.distribution(at),
            fresnel: Fresnel::Conductor {
                eta: at.spectrum(self.eta),
                k: at.spectrum(self.k),
            },
        }));
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let mut inputs = vec![self.eta.into(), self.k.into()];
        inputs.extend(self.roughness.inputs());
        inputs
    }
}
