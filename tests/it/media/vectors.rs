//! Vectors in double precision, for expectations.

use crate::common::solids::V;

/// a + b t.
pub(crate) fn along(a: V, b: V, t: f64) -> V {
    [0, 1, 2].map(|k| a[k] + b[k] * t)
}

/// Scalar product.
pub(crate) fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Unit vector.
pub(crate) fn unit(a: V) -> V {
    a.map(|x| x / dot(a, a).sqrt())
}

/// Two unit vectors perpendicular to the unit vector `n` and to each other.
pub(crate) fn tangents(n: V) -> [V; 2] {
    let helper = if n[0].abs() < 0.7 {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 1.0, 0.0]
    };
    let s = unit(cross(n, helper));
    [s, cross(n, s)]
}

/// Vector product.
pub(crate) fn cross(a: V, b: V) -> V {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The part [t0, t1] of the ray o + t d, t ≥ 0, inside a box; empty is [0, 0].
pub(crate) fn span_in_box(o: V, d: V, lo: V, hi: V) -> [f64; 2] {
    let (mut t0, mut t1) = (0f64, f64::INFINITY);
    for k in 0..3 {
        let (a, b) = ((lo[k] - o[k]) / d[k], (hi[k] - o[k]) / d[k]);
        if d[k] == 0.0 {
            if o[k] < lo[k] || o[k] > hi[k] {
                return [0.0; 2];
            }
            continue;
        }
        t0 = t0.max(a.min(b));
        t1 = t1.min(a.max(b));
    }
    if t0 < t1 { [t0, t1] } else { [0.0; 2] }
}
