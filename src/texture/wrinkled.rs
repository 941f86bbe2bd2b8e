//! Layers of absolute noise. Scene-file manual (`Texture … "wrinkled"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer octaves` | 8 | layers; those that the footprint blurs count with their mean |
//! | `float roughness` | 0.5 | strength of a layer relative to the one before |

use crate::texture::noise::Octaves;
use crate::texture::{Mapping3, TextureContext};

/// Inputs of the wrinkled texture.
#[derive(Clone, Debug)]
pub struct Wrinkled {
    /// From surface points to texture space.
    pub mapping: Mapping3,
    /// The layers.
    pub octaves: Octaves,
}

impl Wrinkled {
    pub(super) fn evaluate(&self, ctx: &TextureContext) -> f32 {
        self.octaves.turbulence(&self.mapping.map(ctx))
    }
}
