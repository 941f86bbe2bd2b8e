//! Product of two textures. Scene-file manual (`Texture … "scale"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `tex1`, `tex2` | 1, 1 | the factors |

use crate::texture::{Source, TextureContext, Textures, Value};

/// Inputs of the scale texture.
#[derive(Clone, Debug)]
pub struct Scale<V> {
    /// The factors.
    pub factors: [Source<V>; 2],
}

impl<V: Value> Scale<V> {
    pub(super) fn evaluate(&self, ctx: &TextureContext, textures: &Textures) -> V {
        let [a, b] = self.factors;
        textures.evaluate(a, ctx) * textures.evaluate(b, ctx)
    }
}
