//! Chequers. Scene-file manual (`Texture … "checkerboard"`), beside the parameters of the mapping:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer dimension` | 2 | 2: squares of (s, t); 3: cubes of texture space |
//! | `tex1`, `tex2` | 1, 0 | even and odd fields; (0, 0) is even |
//! | `string aamode` | `closedform` | squares: averaged over the footprint; `none`: point sampled |
//!
//! Squares are averaged over a box of twice the longest extent of the footprint, exactly; wider than two fields they
//! count as their mean (pbrt 3e §10.5.2).

use crate::texture::{Mapping2, Mapping3, Source, TextureContext, Textures, Value};

/// What happens at the edges of squares.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Smoothing {
    /// Averaged over the footprint.
    ClosedForm,
    /// Point sampled.
    None,
}

/// Squares of (s, t), each 1 wide.
#[derive(Clone, Debug)]
pub struct Checkerboard2<V> {
    /// From surface points to (s, t).
    pub mapping: Mapping2,
    /// Even and odd fields.
    pub fields: [Source<V>; 2],
    /// What happens at edges.
    pub smoothing: Smoothing,
}

/// Cubes of texture space, each 1 wide.
#[derive(Clone, Debug)]
pub struct Checkerboard3<V> {
    /// From surface points to texture space.
    pub mapping: Mapping3,
    /// Even and odd fields.
    pub fields: [Source<V>; 2],
}

/// From here on the surface's own coordinates, in single precision, no longer tell in which field a point lies.
const UNRESOLVED: f64 = (1 << 24) as f64;

impl<V: Value> Checkerboard2<V> {
    pub(super) fn evaluate(&self, ctx: &TextureContext, textures: &Textures) -> V {
        let odd = self.share_of_odd(ctx);
        // Most points lie within one field, and the other may be dear.
        let [even_field, odd_field] = self.fields;
        if odd == 0.0 {
            textures.evaluate(even_field, ctx)
        } else if odd == 1.0 {
            textures.evaluate(odd_field, ctx)
        } else {
            let even = textures.evaluate(even_field, ctx);
            even.blend(textures.evaluate(odd_field, ctx), odd)
        }
    }

    fn share_of_odd(&self, ctx: &TextureContext) -> f32 {
        let at = self.mapping.map(ctx);
        if at.st.abs().max_element() >= UNRESOLVED {
            return 0.5;
        }
        let half_width = match self.smoothing {
            Smoothing::ClosedForm => at.dst_dx.abs().max(at.dst_dy.abs()).as_dvec2(),
            Smoothing::None => glam::DVec2::ZERO,
        };
        if half_width.max_element() > 1.0 {
            return 0.5;
        }
        let s = odd_share(at.st.x, half_width.x);
        let t = odd_share(at.st.y, half_width.y);
        // Odd in exactly one direction.
        (s + t - 2.0 * s * t) as f32
    }
}

/// Share of [x - half_width, x + half_width] in intervals [n, n + 1) with odd n.
fn odd_share(x: f64, half_width: f64) -> f64 {
    let (low, high) = (x - half_width, x + half_width);
    if low.floor() == high.floor() {
        return f64::from(is_odd(x.floor()));
    }
    (odd_length(high) - odd_length(low)) / (high - low)
}

/// Length of the odd intervals between 0 and `x`, negative below.
fn odd_length(x: f64) -> f64 {
    let pairs = (x / 2.0).floor();
    pairs + (x - 2.0 * pairs - 1.0).max(0.0)
}

fn is_odd(whole: f64) -> bool {
    whole.rem_euclid(2.0) == 1.0
}

impl<V: Value> Checkerboard3<V> {
    pub(super) fn evaluate(&self, ctx: &TextureContext, textures: &Textures) -> V {
        let cell = self.mapping.map(ctx).p.floor();
        let odd = is_odd(cell.element_sum());
        textures.evaluate(self.fields[usize::from(odd)], ctx)
    }
}
