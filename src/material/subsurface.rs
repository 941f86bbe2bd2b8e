//! Translucent solid under a dielectric boundary, by its coefficients. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string name` | – | a measured substance; its scattering is reduced, which sets `g` to 0 |
//! | `spectrum texture sigma_a`, `sigma_s` | (0.0011, 0.0024, 0.014), (2.55, 3.21, 3.77) | absorption and scattering per world unit |
//! | `float scale` | 1 | multiplies both |
//! | `float g`, `eta` | 0, 1.33 | mean cosine of scattering; index of refraction inside |
//! | `spectrum texture Kr`, `Kt` | 1, 1 | tints of the boundary's reflection and transmission |
//! | `float texture uroughness`, `vroughness` | 0, 0 | roughness of the boundary |
//! | `bool remaproughness` | true | roughness is perceptual |

use crate::ids::DiffusionTableId;
use crate::material::{Glass, Input, Inputs};
use crate::scatter::Bssrdf;
use crate::scatter::diffusion::DiffusionTable;
use crate::spectrum::Rgb;
use crate::texture::SpectrumSource;

/// Inputs of the subsurface material.
#[derive(Clone, PartialEq, Debug)]
pub struct Subsurface {
    /// The boundary; its index is constant.
    pub boundary: Glass,
    /// `"sigma_a"`, clamped to ≥ 0 where it is evaluated.
    pub sigma_a: SpectrumSource,
    /// `"sigma_s"`, clamped to ≥ 0 where it is evaluated.
    pub sigma_s: SpectrumSource,
    /// `"scale"`, per length of render space.
    pub scale: f32,
    /// Index of refraction of the table and the boundary.
    pub eta: f32,
    /// The profiles for `"g"` and `"eta"`.
    pub table: DiffusionTableId,
}

impl Subsurface {
    /// The spread of light below the surface. `max_sigma_t` is the extinction beyond which it cannot be told from a
    /// point.
    pub(super) fn bssrdf<'a>(
        &self,
        at: &Inputs,
        table: &'a DiffusionTable,
        max_sigma_t: f32,
    ) -> Bssrdf<'a> {
        let sigma_a = at.reflectance(self.sigma_a) * self.scale;
        let sigma_s = at.reflectance(self.sigma_s) * self.scale;
        let sigma_t = sigma_a + sigma_s;
        let (s, t) = (sigma_s.to_array(), sigma_t.to_array());
        let albedo = [0, 1, 2].map(|c| if t[c] > 0.0 { s[c] / t[c] } else { 0.0 });
        let sigma_t = sigma_t.min(Rgb::splat(max_sigma_t));
        Bssrdf::tabulated(table, self.eta, sigma_t, Rgb::from_array(albedo))
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let mut inputs = self.boundary.inputs();
        inputs.extend([Input::from(self.sigma_a), self.sigma_s.into()]);
        inputs
    }
}
