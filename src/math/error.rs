//! Bounds on rounding error (Pharr, Jakob, Humphreys, *Physically Based Rendering*, 3rd ed., section 3.9).

use crate::math::vector::{Normal3, Point3, Vec3};

/// Half the distance from 1 to the next larger f32.
pub const EPSILON: f32 = f32::EPSILON * 0.5;

/// Relative error bound of `n` chained roundings.
#[inline]
pub const fn gamma(n: u32) -> f32 {
    let e = n as f32 * EPSILON;
    e / (1.0 - e)
}

/// Moves `p`, known to within the box of half-extents `p_err`, off its surface along `ng` to the side of `w`, so
/// that the whole box lies behind it. Each coordinate is then rounded away from the surface.
#[inline]
pub fn offset_origin(p: Point3, p_err: Vec3, ng: Normal3, w: Vec3) -> Point3 {
    let d = ng.0.abs().dot(p_err.0);
    let n = if ng.dot(w) < 0.0 { -ng.0 } else { ng.0 };
    let offset = n * d;
    let q = p.0 + offset;
    let round = |q: f32, o: f32| {
        if o > 0.0 {
            q.next_up()
        } else if o < 0.0 {
            q.next_down()
        } else {
            q
        }
    };
    Point3::new(
        round(q.x, offset.x),
        round(q.y, offset.y),
        round(q.z, offset.z),
    )
}
