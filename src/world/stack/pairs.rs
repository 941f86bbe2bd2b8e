//! Whether two elements may be met in one place.

use glam::DVec3;

use crate::math::Bounds3;

/// An element where it is.
#[derive(Clone, Copy)]
pub(super) struct Piece {
    /// Everything it reaches; a little more by rounding.
    pub(super) bounds: Bounds3,
    /// What is known of its form.
    pub(super) form: Form,
    /// By how much any of its points may be wrong, in any coordinate.
    pub(super) error: f64,
}

/// The form of an element, as far as it is known.
#[derive(Clone, Copy)]
pub(super) enum Form {
    /// A triangle that stands still.
    Triangle([DVec3; 3]),
    /// A sphere that stands still: its centre and radius.
    Sphere(DVec3, f64),
    /// Any other.
    Other,
}

/// Whether boxes touch.
pub(super) fn boxes_touch(a: &Bounds3, b: &Bounds3) -> bool {
    (a.min.0.cmple(b.max.0) & b.min.0.cmple(a.max.0)).all()
}

/// Whether two elements may have places in common, but for corners and edges that are the same: there rays meet one of
/// them or both.
pub(super) fn may_meet(a: &Piece, b: &Piece) -> bool {
    let error = 3.0 * (a.error + b.error);
    match (a.form, b.form) {
        (Form::Triangle(p), Form::Triangle(q)) => triangles_meet(p, q, error),
        (Form::Sphere(c, r), Form::Triangle(p)) | (Form::Triangle(p), Form::Sphere(c, r)) => {
            let farthest = p.iter().map(|p| p.distance(c)).fold(0.0, f64::max);
            let n = (p[1] - p[0]).cross(p[2] - p[0]).normalize_or_zero();
            let is_within = farthest < r - error;
            let is_beyond = n.dot(p[0] - c).abs() > r + error;
            !is_within && !is_beyond
        }
        (Form::Sphere(c, r), Form::Sphere(d, s)) => {
            let apart = c.distance(d);
            apart <= r + s + error && apart >= (r - s).abs() - error
        }
        (Form::Other, _) | (_, Form::Other) => true,
    }
}

/// By separating axes: normals, pairs of edges, and directions across edges.
fn triangles_meet(p: [DVec3; 3], q: [DVec3; 3], error: f64) -> bool {
    let edges = |t: [DVec3; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let (of_p, of_q) = (edges(p), edges(q));
    let normals = [of_p[0].cross(of_p[1]), of_q[0].cross(of_q[1])];
    let share_corner = p.iter().any(|corner| q.contains(corner));
    let is_between = |axis: DVec3| {
        let Some(axis) = axis.try_normalize() else {
            return false;
        };
        let extent = |t: [DVec3; 3]| {
            let x = t.map(|corner| axis.dot(corner));
            [x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2])]
        };
        let ([p0, p1], [q0, q1]) = (extent(p), extent(q));
        let gap = (p0 - q1).max(q0 - p1);
        if share_corner {
            // They touch. What lies in one plane is told apart within it.
            let spread = p1.max(q1) - p0.min(q0);
            let rounding = 64.0 * f64::EPSILON * p1.abs().max(q1.abs()).max(p0.abs()).max(q0.abs());
            gap >= -rounding && spread > error
        } else {
            gap > error
        }
    };
    let across = of_p
        .iter()
        .map(|edge| normals[0].cross(*edge))
        .chain(of_q.iter().map(|edge| normals[1].cross(*edge)));
    let pairs = of_p
        .iter()
        .flat_map(|a| of_q.iter().map(move |b| a.cross(*b)));
    !normals
        .into_iter()
        .chain(across)
        .chain(pairs)
        .any(is_between)
}

/// Whether triangles in one plane have more than a seam in common.
pub(super) fn flat_overlap(p: [DVec3; 3], q: [DVec3; 3], error: f64) -> bool {
    let n = (p[1] - p[0]).cross(p[2] - p[0]);
    let is_between = |[a, b]: [DVec3; 2]| {
        let Some(axis) = n.cross(b - a).try_normalize() else {
            return true;
        };
        let extent = |t: [DVec3; 3]| {
            let x = t.map(|corner| axis.dot(corner));
            [x[0].min(x[1]).min(x[2]), x[0].max(x[1]).max(x[2])]
        };
        let ([p0, p1], [q0, q1]) = (extent(p), extent(q));
        (p0 - q1).max(q0 - p1) >= -error
    };
    let edges = |t: [DVec3; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    !edges(p).into_iter().chain(edges(q)).any(is_between)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(corners: [[f64; 3]; 3]) -> [DVec3; 3] {
        corners.map(DVec3::from)
    }

    #[test]
    fn triangles_in_one_place_are_told_from_neighbours() {
        let first = triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let meets = |other: [[f64; 3]; 3]| {
            let (a, b) = (
                triangles_meet(first, triangle(other), 1e-6),
                triangles_meet(triangle(other), first, 1e-6),
            );
            assert_eq!(a, b);
            a
        };
        // The same, a part of it, one beside it that shares two corners and lies above it, one that pierces it.
        assert!(meets([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
        assert!(meets([[0.1, 0.1, 1e-7], [0.2, 0.1, 0.0], [0.1, 0.2, 0.0]]));
        assert!(meets([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]));
        assert!(meets([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [3.0, 3.0, 0.0]]));
        // The other half of a square, at any angle; one that shares a corner; one above.
        assert!(!meets([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]));
        assert!(!meets([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]));
        assert!(!meets([
            [0.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, -1.0, 0.0]
        ]));
        assert!(!meets([
            [0.0, 0.0, 1e-4],
            [1.0, 0.0, 1e-4],
            [0.0, 1.0, 1e-4]
        ]));
    }
}
