//! Diffuse base under a rough coat. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kd` | 0.5 | diffuse reflectance of the base |
//! | `spectrum texture Ks` | 0.5 | reflectance of the coat, seen straight on |
//! | `float texture uroughness` | 0.1 | roughness along u |
//! | `float texture vroughness` | 0.1 | roughness along v |
//! | `bool remaproughness` | true | roughness is perceptual, 0 to 1; false: α of the distribution |
//! | `float texture bumpmap` | – | displacement |

use crate::material::roughness::Roughness;
use crate::material::{Input, Inputs};
use crate::scatter::fresnel_blend::FresnelBlend;
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::SpectrumSource;

/// Inputs of the substrate material.
#[derive(Clone, PartialEq, Debug)]
pub struct Substrate {
    /// `"Kd"`, clamped to ≥ 0 where it is evaluated.
    pub kd: SpectrumSource,
    /// `"Ks"`, clamped to ≥ 0 where it is evaluated.
    pub ks: SpectrumSource,
    /// `"uroughness"` and `"vroughness"`.
    pub roughness: Roughness,
}

impl Substrate {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        let (rd, rs) = (at.reflectance(self.kd), at.reflectance(self.ks));
        if !(rd.is_black() && rs.is_black()) {
            let distribution = self.roughness.distribution(at);
            bsdf.add(Bxdf::FresnelBlend(FresnelBlend {
                rd,
                rs,
                distribution,
            }));
        }
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let mut inputs = vec![self.kd.into(), self.ks.into()];
        inputs.extend(self.roughness.inputs());
        inputs
    }
}
