//! Waves whose height gusts of wind decide (pbrt 3e §10.6.4). Scene-file manual (`Texture … "windy"`): no parameters.

use crate::texture::mapping::TexturePoint3;
use crate::texture::noise::Octaves;
use crate::texture::{Mapping3, TextureContext};

/// Inputs of the windy texture.
#[derive(Clone, Debug)]
pub struct Windy {
    /// From surface points to texture space.
    pub mapping: Mapping3,
}

/// Size of a wave relative to a gust.
const WAVES_PER_GUST: f64 = 10.0;

const GUSTS: Octaves = Octaves {
    count: 3,
    roughness: 0.5,
};

const WAVES: Octaves = Octaves {
    count: 6,
    roughness: 0.5,
};

impl Windy {
    pub(super) fn evaluate(&self, ctx: &TextureContext) -> f32 {
        let at = self.mapping.map(ctx);
        let gust = TexturePoint3 {
            p: at.p / WAVES_PER_GUST,
            dp_dx: at.dp_dx / WAVES_PER_GUST,
            dp_dy: at.dp_dy / WAVES_PER_GUST,
        };
        GUSTS.fbm(&gust).abs() * WAVES.fbm(&at)
    }
}
