//! Layers of noise. Scene-file manual (`Texture … "fbm"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer octaves` | 8 | most layers; those that the footprint blurs are left out |
//! | `float roughness` | 0.5 | strength of a layer relative to the one before |

use crate::texture::noise::Octaves;
use crate::texture::{Mapping3, TextureContext};

/// Inputs of the fbm texture.
#[derive(Clone, Debug)]
pub struct Fbm {
    /// From surface points to texture space.
    pub mapping: Mapping3,
    /// The layers.
    pub octaves: Octaves,
}

impl Fbm {
    pub(super) fn evaluate(&self, ctx: &TextureContext) -> f32 {
        self.octaves.fbm(&self.mapping.map(ctx))
    }
}
