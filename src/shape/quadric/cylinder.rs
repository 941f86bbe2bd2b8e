//! Cylinder, open at both ends. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float radius` | 1 | radius, around the z axis |
//! | `float zmin`, `zmax` | −1, 1 | ends |
//! | `float phimax` | 360 | part kept in azimuth, degrees from +x |
//!
//! u runs with azimuth, v from the lower to the upper end; the normal points outward.

use glam::DVec3;

use crate::shape::quadric::Sweep;

/// `radius` ≥ 0; the z range is sorted; `phi_max` in radians, clamped to [0, 2π].
pub fn cylinder(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> Sweep {
    let [low, high] = [z_min.min(z_max), z_min.max(z_max)];
    let [start, end] = [low, high].map(|z| DVec3::new(radius, 0.0, z));
    Sweep::new(start, end, phi_max)
}
