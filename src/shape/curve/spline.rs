//! From the control points of a file to cubic Bézier segments.

use glam::DVec3;

/// Segments of a Bézier spline of degree 2 or 3: each but the first starts where the one before ends. `None` for a
/// number of points that makes no whole segments.
pub fn bezier(points: &[DVec3], degree: usize) -> Option<Vec<[DVec3; 4]>> {
    if points.len() <= degree || !(points.len() - 1).is_multiple_of(degree) {
        return None;
    }
    let starts = (0..points.len() - 1).step_by(degree);
    Some(
        starts
            .map(|i| match degree {
                2 => elevated([points[i], points[i + 1], points[i + 2]]),
                _ => [points[i], points[i + 1], points[i + 2], points[i + 3]],
            })
            .collect(),
    )
}

/// Segments of a B-spline of degree 2 or 3 with uniform knots. `None` if there are too few points for one.
pub fn b_spline(points: &[DVec3], degree: usize) -> Option<Vec<[DVec3; 4]>> {
    if points.len() <= degree {
        return None;
    }
    Some(
        points
            .windows(degree + 1)
            .map(|p| match *p {
                [a, b, c] => elevated([(a + b) * 0.5, b, (b + c) * 0.5]),
                [a, b, c, d] => [
                    (a + b * 4.0 + c) / 6.0,
                    (b * 2.0 + c) / 3.0,
                    (b + c * 2.0) / 3.0,
                    (b + c * 4.0 + d) / 6.0,
                ],
                _ => unreachable!("the degree is 2 or 3"),
            })
            .collect(),
    )
}

/// A quadratic segment as a cubic one.
fn elevated([a, b, c]: [DVec3; 3]) -> [DVec3; 4] {
    [a, a.lerp(b, 2.0 / 3.0), b.lerp(c, 1.0 / 3.0), c]
}
