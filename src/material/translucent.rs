//! Thin sheet that reflects and transmits, diffuse and glossy. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `spectrum texture Kd` | 0.25 | diffuse colour |
//! | `spectrum texture Ks` | 0.25 | factor of the glossy parts |
//! | `spectrum texture reflect` | 0.5 | share that is reflected |
//! | `spectrum texture transmit` | 0.5 | share that is transmitted |
//! | `float texture roughness` | 0.1 | roughness of the glossy parts |
//! | `bool remaproughness` | true | roughness is perceptual, 0 to 1; false: α of the distribution |
//! | `float texture bumpmap` | – | displacement |
//!
//! The index of refraction is 1.5. Shares are not normalised: all ones send out twice what comes in.

use crate::material::roughness::Roughness;
use crate::material::{Input, Inputs};
use crate::scatter::diffuse::{Diffuse, DiffuseTransmission};
use crate::scatter::rough_dielectric::RoughDielectric;
use crate::scatter::{Bsdf, Bxdf};
use crate::texture::SpectrumSource;

const ETA: f32 = 1.5;

/// Inputs of the translucent material. Colours are clamped to ≥ 0 where they are evaluated.
#[derive(Clone, PartialEq, Debug)]
pub struct Translucent {
    /// `"Kd"`.
    pub kd: SpectrumSource,
    /// `"Ks"`.
    pub ks: SpectrumSource,
    /// `"reflect"`.
    pub reflect: SpectrumSource,
    /// `"transmit"`.
    pub transmit: SpectrumSource,
    /// `"roughness"` along both axes.
    pub roughness: Roughness,
}

impl Translucent {
    pub(super) fn scatter(&self, at: &Inputs, bsdf: &mut Bsdf) {
        bsdf.set_eta(ETA);
        let (kd, ks) = (at.reflectance(self.kd), at.reflectance(self.ks));
        let (r, t) = (at.reflectance(self.reflect), at.reflectance(self.transmit));
        if !(r * kd).is_black() {
            bsdf.add(Bxdf::Diffuse(Diffuse::new(r * kd, 0.0)));
        }
        if !(t * kd).is_black() {
            bsdf.add(Bxdf::DiffuseTransmission(DiffuseTransmission {
                kt: t * kd,
            }));
        }
        if !((r + t) * ks).is_black() {
            let distribution = self.roughness.distribution(at);
            bsdf.add(RoughDielectric::lobe(r * ks, t * ks, distribution, ETA));
        }
    }

    pub(super) fn inputs(&self) -> Vec<Input> {
        let colours = [self.kd, self.ks, self.reflect, self.transmit];
        let mut inputs: Vec<_> = colours.into_iter().map(Input::from).collect();
        inputs.extend(self.roughness.inputs());
        inputs
    }
}
