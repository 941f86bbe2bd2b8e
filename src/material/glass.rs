//! Dielectric. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kr`, `Kt` | 1, 1 | tints of reflection and transmission |
//! | `float texture eta` (or `index`) | 1.5 | index of refraction on the inside |

use crate::math::{Frame, Normal3};
use crate::scatter::specular::SmoothDielectric;
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::{FloatSource, SpectrumSource, TextureContext, Textures};

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
    pub(super) fn bsdf(
        &self,
        frame: Frame,
        ng: Normal3,
        ctx: &TextureContext,
        textures: &Textures,
    ) -> Bsdf {
        // A texture can say anything; without a possible index there is no interface.
        let eta = Some(textures.float(self.eta, ctx)).filter(|eta| *eta > 0.0 && eta.is_finite());
        let eta = eta.unwrap_or(1.0);
        let mut bsdf = Bsdf::new(frame, ng, eta);
        let kr = textures.spectrum(self.kr, ctx).clamp_negative();
        let kt = textures.spectrum(self.kt, ctx).clamp_negative();
        if !(kr.is_black() && kt.is_black()) {
            bsdf.add(Bxdf::SmoothDielectric(SmoothDielectric { kr, kt, eta }));
        }
        bsdf
    }
}
