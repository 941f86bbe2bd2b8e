//! Perfect mirror. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kr` | 0.9 | reflectance, the same at every angle |
//! | `float texture bumpmap` | – | displacement |

use crate::material::{Input, Inputs};
use crate::scatter::{Bsdf, Bxdf, specular};
use crate::texture::SpectrumSource;

/// Inputs of the mirror material.
#[derive(Clone, PartialEq, Debug)]
pub struct Mirror {
    /// `"Kr"`, clamped to ≥ 0 where it is evaluated.
    pub kr: SpectrumSource,
}

impl Mirror {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        let kr = at.reflectance(self.kr);
        if !kr.is_black() {
            bsdf.add(Bxdf::Mirror(specular::Mirror { kr }));
        }
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        vec![self.kr.into()]
    }
}
