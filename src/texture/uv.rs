//! Texture coordinates as colours. Scene-file manual (`Texture … "uv"`): the parameters of the mapping only. Red is the
//! fraction of s, green that of t.

use crate::spectrum::Rgb;
use crate::texture::{Mapping2, TextureContext};

/// Inputs of the uv texture.
#[derive(Clone, Debug)]
pub struct Uv {
    /// From surface points to (s, t).
    pub mapping: Mapping2,
}

impl Uv {
    pub(super) fn evaluate(&self, ctx: &TextureContext) -> Rgb {
        let st = self.mapping.map(ctx).st;
        let [s, t] = (st - st.floor()).as_vec2().to_array();
        Rgb::new(s, t, 0.0)
    }
}
