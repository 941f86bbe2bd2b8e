//! Random dots. Scene-file manual (`Texture … "dots"`), beside the parameters of the mapping:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `inside` | 1 | the ground: as in pbrt-v3 the two names are swapped |
//! | `outside` | 0 | the dots |
//!
//! About half of the unit cells around whole (s, t) hold a dot of radius 0.35, moved a little from the middle.

use glam::{DVec2, DVec3};

use crate::texture::noise::noise;
use crate::texture::{Mapping2, Source, TextureContext, Textures, Value};

/// Radius of a dot.
const RADIUS: f64 = 0.35;

/// Farthest that noise moves a dot's centre, so that it stays in its cell.
const MAX_SHIFT: f64 = 0.5 - RADIUS;

/// Inputs of the dots texture.
#[derive(Clone, Debug)]
pub struct Dots<V> {
    /// From surface points to (s, t).
    pub mapping: Mapping2,
    /// Between the dots: `"inside"`.
    pub ground: Source<V>,
    /// In the dots: `"outside"`.
    pub dot: Source<V>,
}

impl<V: Value> Dots<V> {
    pub(super) fn evaluate(&self, ctx: &TextureContext, textures: &Textures) -> V {
        let st = self.mapping.map(ctx).st;
        let source = if is_in_dot(st) { self.dot } else { self.ground };
        textures.evaluate(source, ctx)
    }
}

fn is_in_dot(st: DVec2) -> bool {
    let cell = (st + 0.5).floor();
    let random = |s: f64, t: f64| f64::from(noise(DVec3::new(cell.x + s, cell.y + t, 0.5)));
    if random(0.5, 0.5) <= 0.0 {
        return false;
    }
    let center = cell + DVec2::new(random(1.5, 2.8), random(4.5, 9.8)) * MAX_SHIFT;
    st.distance_squared(center) < RADIUS * RADIUS
}
