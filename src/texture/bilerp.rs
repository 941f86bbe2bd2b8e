//! Bilinear blend of corner values. Scene-file manual (`Texture … "bilerp"`), beside the parameters of the mapping:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float`/`spectrum v00`, `v01`, `v10`, `v11` | 0, 1, 0, 1 | value at (s, t); beyond the unit square it goes on linearly |

use crate::texture::{Mapping2, TextureContext, Value};

/// Inputs of the bilerp texture.
#[derive(Clone, Debug)]
pub struct Bilerp<V> {
    /// From surface points to (s, t).
    pub mapping: Mapping2,
    /// Values at (0, 0), (0, 1), (1, 0), (1, 1).
    pub corners: [V; 4],
}

impl<V: Value> Bilerp<V> {
    pub(super) fn evaluate(&self, ctx: &TextureContext) -> V {
        let [s, t] = self.mapping.map(ctx).st.to_array();
        let [v00, v01, v10, v11] = self.corners;
        v00 * ((1.0 - s) * (1.0 - t)) as f32
            + v01 * ((1.0 - s) * t) as f32
            + v10 * (s * (1.0 - t)) as f32
            + v11 * (s * t) as f32
    }
}
