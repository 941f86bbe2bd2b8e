//! Vectors in double precision, for expectations.

/// A vector in world space.
pub(crate) type V = [f64; 3];

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
