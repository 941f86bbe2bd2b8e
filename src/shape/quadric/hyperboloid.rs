//! Hyperboloid of one sheet: a segment swept about the z axis. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `point3 p1`, `p2` | (0, 0, 0), (1, 1, 1) | ends of the segment; the defaults sweep a cone |
//! | `float phimax` | 360 | part swept, degrees |
//!
//! u runs with the sweep, v from `p1` to `p2`, or the other way if the z of `p2` is 0. The normal is along
//! ∂p/∂u × ∂p/∂v: it points away from the axis where v runs upward.

use glam::DVec3;

use crate::shape::quadric::Sweep;

/// Any two points; `phi_max` in radians, clamped to [0, 2π].
pub fn hyperboloid(p1: DVec3, p2: DVec3, phi_max: f64) -> Sweep {
    // As pbrt-v3, which thereby turns the normal around.
    let (start, end) = if p2.z == 0.0 { (p2, p1) } else { (p1, p2) };
    Sweep::new(start, end, phi_max)
}
