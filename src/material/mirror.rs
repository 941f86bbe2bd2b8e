//! Perfect mirror. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kr` | 0.9 | reflectance, the same at every angle |

use crate::math::{Frame, Normal3};
use crate::scatter::{Bsdf, Bxdf, specular};
use crate::texture::{SpectrumSource, TextureContext, Textures};

/// Inputs of the mirror material.
#[derive(Clone, Debug)]
pub struct Mirror {
    /// `"Kr"`, clamped to ≥ 0 where it is evaluated.
    pub kr: SpectrumSource,
}

impl Mirror {
    pub(super) fn bsdf(
        &self,
        frame: Frame,
        ng: Normal3,
        ctx: &TextureContext,
        textures: &Textures,
    ) -> Bsdf {
        let mut bsdf = Bsdf::new(frame, ng, 1.0);
        let kr = textures.spectrum(self.kr, ctx).clamp_negative();
        if !kr.is_black() {
            bsdf.add(Bxdf::Mirror(specular::Mirror { kr }));
        }
        bsdf
    }
}
