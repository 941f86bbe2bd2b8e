//! Blend of two textures. Scene-file manual (`Texture … "mix"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `tex1`, `tex2` | 0, 1 | the ends |
//! | `float texture amount` | 0.5 | weight of `tex2`; beyond [0, 1] the line through both goes on |

use crate::texture::{FloatSource, Source, TextureContext, Textures, Value};

/// Inputs of the mix texture.
#[derive(Clone, Debug)]
pub struct Mix<V> {
    /// What amounts 0 and 1 show.
    pub ends: [Source<V>; 2],
    /// Weight of the second end.
    pub amount: FloatSource,
}

impl<V: Value> Mix<V> {
    pub(super) fn evaluate(&self, ctx: &TextureContext, textures: &Textures) -> V {
        let [first, second] = self.ends.map(|end| textures.evaluate(end, ctx));
        first.blend(second, textures.evaluate(self.amount, ctx))
    }
}
