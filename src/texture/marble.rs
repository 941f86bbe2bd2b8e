//! Veins of marble (pbrt 3e §10.6.5). Scene-file manual (`Texture … "marble"`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer octaves` | 8 | most layers of noise |
//! | `float roughness` | 0.5 | strength of a layer relative to the one before |
//! | `float scale` | 1 | multiplies the position |
//! | `float variation` | 0.2 | how far noise bends the veins |
//!
//! As in pbrt-v3, only the first two of six segments of the colour curve are used, the second one far beyond its end:
//! values reach 40, and pictures are made with them.

use glam::Vec3A;

use crate::spectrum::Rgb;
use crate::texture::mapping::TexturePoint3;
use crate::texture::noise::Octaves;
use crate::texture::{Mapping3, TextureContext};

/// Inputs of the marble texture.
#[derive(Clone, Debug)]
pub struct Marble {
    /// From surface points to texture space.
    pub mapping: Mapping3,
    /// The layers of noise.
    pub octaves: Octaves,
    /// Multiplies the position.
    pub scale: f32,
    /// How far noise bends the veins.
    pub variation: f32,
}

/// Control points of the colour curve (figures from pbrt-v3's `marble` texture). Of nine, these are in use.
const COLORS: [Vec3A; 5] = [
    Vec3A::new(0.58, 0.58, 0.6),
    Vec3A::new(0.58, 0.58, 0.6),
    Vec3A::new(0.58, 0.58, 0.6),
    Vec3A::new(0.5, 0.5, 0.5),
    Vec3A::new(0.6, 0.59, 0.58),
];

/// Number of segments between nine control points.
const N_SEGMENTS: f32 = 6.0;

/// Brightens the curve.
const GAIN: f32 = 1.5;

impl Marble {
    pub(super) fn evaluate(&self, ctx: &TextureContext) -> Rgb {
        let at = self.mapping.map(ctx);
        let scale = f64::from(self.scale);
        let scaled = TexturePoint3 {
            p: at.p * scale,
            dp_dx: at.dp_dx * scale,
            dp_dy: at.dp_dy * scale,
        };
        let bend = f64::from(self.variation) * f64::from(self.octaves.fbm(&scaled));
        color((0.5 + 0.5 * (scaled.p.y + bend).sin()) as f32)
    }
}

/// A cubic Bézier curve over four consecutive control points, by repeated interpolation.
fn color(position: f32) -> Rgb {
    let position = position * N_SEGMENTS;
    let first = if position < 1.0 { 0 } else { 1 };
    let t = position - first as f32;
    let mut points: [Vec3A; 4] = std::array::from_fn(|i| COLORS[first + i]);
    for degree in (1..points.len()).rev() {
        for i in 0..degree {
            points[i] = points[i] * (1.0 - t) + points[i + 1] * t;
        }
    }
    Rgb::from_array((points[0] * GAIN).to_array())
}
