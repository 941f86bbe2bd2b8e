//! Hair fibre, for curves. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture sigma_a` | - | absorption per fibre diameter; wins over the others |
//! | `spectrum texture color` | - | colour of dense hair; wins over the pigments |
//! | `float texture eumelanin`, `pheomelanin` | 1.3 and 0 if nothing is given | concentrations of pigments |
//! | `float texture eta` | 1.55 | index of refraction |
//! | `float texture beta_m`, `beta_n` | 0.3, 0.3 | roughness along and around the fibre, 0 to 1 |
//! | `float texture alpha` | 2 | tilt of the scales, degrees |
//!
//! The place across the fibre is the surface parameter v, as on curves. There is no `bumpmap`.

use crate::material::{Input, Inputs};
use crate::scatter::hair::{self, sigma_a_from_color, sigma_a_from_melanin};
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::{FloatSource, SpectrumSource};

/// What a fibre absorbs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Pigment {
    /// `"sigma_a"`, per fibre diameter.
    Absorption(SpectrumSource),
    /// `"color"` of dense hair.
    Color(SpectrumSource),
    /// `"eumelanin"` and `"pheomelanin"`, concentrations.
    Melanin(FloatSource, FloatSource),
}

/// Inputs of the hair material.
#[derive(Clone, PartialEq, Debug)]
pub struct Hair {
    /// What it absorbs.
    pub pigment: Pigment,
    /// `"eta"`, positive.
    pub eta: FloatSource,
    /// `"beta_m"`, in [0, 1].
    pub beta_m: FloatSource,
    /// `"beta_n"`, in [0, 1].
    pub beta_n: FloatSource,
    /// `"alpha"`, in degrees.
    pub alpha: FloatSource,
}

impl Hair {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        let eta = at.index_of_refraction(self.eta);
        let beta_n = at.float(self.beta_n).clamp(0.0, 1.0);
        let sigma_a = match self.pigment {
            Pigment::Absorption(sigma_a) => at.reflectance(sigma_a),
            Pigment::Color(color) => sigma_a_from_color(at.reflectance(color), beta_n),
            Pigment::Melanin(eumelanin, pheomelanin) => {
                sigma_a_from_melanin(at.float(eumelanin), at.float(pheomelanin))
            }
        };
        let h = 2.0 * at.ctx.uv[1] - 1.0;
        bsdf.set_eta(eta);
        bsdf.add(Bxdf::Hair(hair::Hair::new(
            h,
            eta,
            sigma_a,
            at.float(self.beta_m),
            beta_n,
            at.float(self.alpha),
        )));
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let mut inputs = match self.pigment {
            Pigment::Absorption(source) | Pigment::Color(source) => vec![source.into()],
            Pigment::Melanin(eumelanin, pheomelanin) => vec![eumelanin.into(), pheomelanin.into()],
        };
        inputs.extend([self.eta, self.beta_m, self.beta_n, self.alpha].map(Input::from));
        inputs
    }
}
