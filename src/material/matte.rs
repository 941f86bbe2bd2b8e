//! Diffuse material. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kd` | 0.5 | diffuse reflectance |
//! | `float texture sigma` | 0 | roughness of the Oren–Nayar model, degrees |

use crate::math::{Frame, Normal3};
use crate::scatter::diffuse::Diffuse;
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::{FloatSource, SpectrumSource, TextureContext, Textures};

/// Inputs of the matte material.
#[derive(Clone, Debug)]
pub struct Matte {
    /// `"Kd"`, clamped to ≥ 0 where it is evaluated.
    pub kd: SpectrumSource,
    /// `"sigma"`, in degrees.
    pub sigma: FloatSource,
}

impl Matte {
    pub(super) fn bsdf(
        &self,
        frame: Frame,
        ng: Normal3,
        ctx: &TextureContext,
        textures: &Textures,
    ) -> Bsdf {
        let mut bsdf = Bsdf::new(frame, ng, 1.0);
        let kd = textures.spectrum(self.kd, ctx).clamp_negative();
        if !kd.is_black() {
            bsdf.add(Bxdf::Diffuse(Diffuse::new(
                kd,
                textures.float(self.sigma, ctx),
            )));
        }
        bsdf
    }
}
