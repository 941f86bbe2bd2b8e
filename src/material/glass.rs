//! Dielectric. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kr`, `Kt` | 1, 1 | tints of reflection and transmission |
//! | `float texture eta` (or `index`) | 1.5 | index of refraction on the inside |

use crate::material::Inputs;
use crate::scatter::specular::SmoothDielectric;
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::{FloatSource, SpectrumSource};

/// Inputs of the glass material.
#[derive(Clone, Debug)]
pub struct Glass {
    /// `"Kr"`, clamped to ≥ 0 where it is evaluated.
    pub kr: SpectrumSource,
    /// `"Kt"`, clamped to ≥ 0 where it is evaluated.
    pub kt: SpectrumSource,
    /// `"eta"`, positive.
    pub eta: FloatSource,
}

impl Glass {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        // A texture can say anything; without a possible index there is no interface.
        let eta = Some(at.float(self.eta)).filter(|eta| *eta > 0.0 && eta.is_finite());
        let eta = eta.unwrap_or(1.0);
        bsdf.set_eta(eta);
        let (kr, kt) = (at.reflectance(self.kr), at.reflectance(self.kt));
        if !(kr.is_black() && kt.is_black()) {
            bsdf.add(Bxdf::SmoothDielectric(SmoothDielectric { kr, kt, eta }));
        }
    }
}
