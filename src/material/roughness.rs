//! Roughness along the two axes of the surface, which several materials have.

use crate::material::{Input, Inputs};
use crate::scatter::microfacet::{TrowbridgeReitz, alpha_from_roughness};
use crate::texture::FloatSource;

/// Roughness of a microfacet surface.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Roughness {
    /// Along u.
    pub u: FloatSource,
    /// Along v.
    pub v: FloatSource,
    /// `"remaproughness"`: the values are perceptual, 0 to 1; otherwise they are α of the distribution.
    pub remap: bool,
}

impl Roughness {
    /// The distribution of normals; `None` where both values are exactly 0.
    pub(super) fn distribution_unless_smooth(&self, at: &Inputs) -> Option<TrowbridgeReitz> {
        let (u, v) = (at.float(self.u), at.float(self.v));
        (u != 0.0 || v != 0.0).then(|| self.distribution_of(u, v))
    }

    /// The distribution of normals.
    pub(super) fn distribution(&self, at: &Inputs) -> TrowbridgeReitz {
        self.distribution_of(at.float(self.u), at.float(self.v))
    }

    fn distribution_of(&self, u: f32, v: f32) -> TrowbridgeReitz {
        if self.remap {
            TrowbridgeReitz::new(alpha_from_roughness(u), alpha_from_roughness(v))
        } else {
            TrowbridgeReitz::new(u, v)
        }
    }

    pub(super) fn inputs(&self) -> [Input; 2] {
        [self.u.into(), self.v.into()]
    }
}
