//! Translucent solid under a dielectric boundary, by its colour. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kd` | 0.5 | part of the light that comes back: diffuse reflectance |
//! | `spectrum texture mfp` | 1 | mean free path, world units; 0 is a diffuse surface |
//! | `float scale` | 1 | multiplies `mfp` |
//! | `float g`, `eta` | 0, 1.33 | mean cosine of scattering; index of refraction inside |
//! | `spectrum texture Kr`, `Kt` | 1, 1 | tints of the boundary's reflection and transmission |
//! | `float texture uroughness`, `vroughness` | 0, 0 | roughness of the boundary |
//! | `bool remaproughness` | true | roughness is perceptual |

use crate::ids::DiffusionTableId;
use crate::material::{Glass, Input, Inputs};
use crate::scatter::Bssrdf;
use crate::scatter::diffusion::DiffusionTable;
use crate::texture::SpectrumSource;

/// Inputs of the kdsubsurface material.
#[derive(Clone, PartialEq, Debug)]
pub struct KdSubsurface {
    /// The boundary; its index is constant.
    pub boundary: Glass,
    /// `"Kd"`, clamped to ≥ 0 where it is evaluated; what is more than possible is the most that is.
    pub kd: SpectrumSource,
    /// `"mfp"`, clamped to ≥ 0 where it is evaluated.
    pub mfp: SpectrumSource,
    /// `"scale"`, in lengths of render space.
    pub scale: f32,
    /// Index of refraction of the table and the boundary.
    pub eta: f32,
    /// The profiles for `"g"` and `"eta"`.
    pub table: DiffusionTableId,
}

impl KdSubsurface {
    /// The spread of light below the surface. `max_sigma_t` is the extinction beyond which it cannot be told from a
    /// point.
    pub(super) fn bssrdf<'a>(
        &self,
        at: &Inputs,
        table: &'a DiffusionTable,
        max_sigma_t: f32,
    ) -> Bssrdf<'a> {
        let mfp = at.reflectance(self.mfp) * self.scale;
        let sigma_t = mfp.map(|mfp| (1.0 / mfp).min(max_sigma_t));
        let kd = at.reflectance(self.kd);
        let albedo = kd.map(|kd| table.albedo_of(f64::from(kd)) as f32);
        Bssrdf::tabulated(table, self.eta, sigma_t, albedo)
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let mut inputs = self.boundary.inputs();
        inputs.extend([Input::from(self.kd), self.mfp.into()]);
        inputs
    }
}
