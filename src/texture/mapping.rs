//! From a surface point to texture coordinates.

use glam::Vec2;

use crate::texture::TextureContext;

/// Scaled and shifted surface parameters. Scene-file manual: `"string mapping" "uv"`, `float uscale`, `vscale` (1),
/// `udelta`, `vdelta` (0).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UvMapping {
    /// Factors of u and v.
    pub scale: Vec2,
    /// Added after scaling.
    pub delta: Vec2,
}

/// Texture coordinates with their change per pixel.
#[derive(Clone, Copy, Debug)]
pub struct TexturePoint {
    /// Coordinates.
    pub st: Vec2,
    /// Change to the next pixel on the right.
    pub dst_dx: Vec2,
    /// Change to the next pixel below.
    pub dst_dy: Vec2,
}

impl UvMapping {
    /// Maps a surface point.
    #[inline]
    pub fn map(&self, ctx: &TextureContext) -> TexturePoint {
        TexturePoint {
            st: Vec2::from(ctx.uv) * self.scale + self.delta,
            dst_dx: Vec2::from(ctx.duv_dx) * self.scale,
            dst_dy: Vec2::from(ctx.duv_dy) * self.scale,
        }
    }
}
