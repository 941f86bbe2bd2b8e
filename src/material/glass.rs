//! Dielectric. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kr`, `Kt` | 1, 1 | tints of reflection and transmission |
//! | `float texture eta` (or `index`) | 1.5 | index of refraction on the inside |
//! | `float texture uroughness`, `vroughness` | 0, 0 | roughness along u and v; both exactly 0: perfectly smooth |
//! | `bool remaproughness` | true | roughness is perceptual, 0 to 1; false: α of the distribution |
//! | `float texture bumpmap` | – | displacement |

use crate::material::roughness::Roughness;
use crate::material::{Input, Inputs};
use crate::scatter::rough_dielectric::RoughDielectric;
use crate::scatter::specular::SmoothDielectric;
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::{FloatSource, SpectrumSource};

/// Inputs of the glass material.
#[derive(Clone, PartialEq, Debug)]
pub struct Glass {
    /// `"Kr"`, clamped to ≥ 0 where it is evaluated.
    pub kr: SpectrumSource,
    /// `"Kt"`, clamped to ≥ 0 where it is evaluated.
    pub kt: SpectrumSource,
    /// `"eta"`, positive.
    pub eta: FloatSource,
    /// `"uroughness"` and `"vroughness"`.
    pub roughness: Roughness,
}

impl Glass {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        let eta = at.index_of_refraction(self.eta);
        bsdf.set_eta(eta);
        let (kr, kt) = (at.reflectance(self.kr), at.reflectance(self.kt));
        if kr.is_black() && kt.is_black() {
            return;
        }
        bsdf.add(match self.roughness.distribution_unless_smooth(at) {
            Some(distribution) => RoughDielectric::lobe(kr, kt, distribution, eta),
            None => Bxdf::SmoothDielectric(SmoothDielectric { kr, kt, eta }),
        });
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let mut inputs = vec![self.kr.into(), self.kt.into(), self.eta.into()];
        inputs.extend(self.roughness.inputs());
        inputs
    }
}
