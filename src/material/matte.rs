//! Diffuse material. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kd` | 0.5 | diffuse reflectance |
//! | `float texture sigma` | 0 | roughness of the Oren–Nayar model, degrees |
//! | `float texture bumpmap` | – | displacement |

use crate::material::{Input, Inputs};
use crate::scatter::diffuse::Diffuse;
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::{FloatSource, SpectrumSource};

/// Inputs of the matte material.
#[derive(Clone, PartialEq, Debug)]
pub struct Matte {
    /// `"Kd"`, clamped to ≥ 0 where it is evaluated.
    pub kd: SpectrumSource,
    /// `"sigma"`, in degrees.
    pub sigma: FloatSource,
}

impl Matte {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        let kd = at.reflectance(self.kd);
        if !kd.is_black() {
            bsdf.add(Bxdf::Diffuse(Diffuse::new(kd, at.float(self.sigma))));
        }
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        vec![self.kd.into(), self.sigma.into()]
    }
}
