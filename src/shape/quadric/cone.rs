//! Cone, open at its base. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float radius` | 1 | radius of the base, at z = 0 |
//! | `float height` | 1 | place of the tip on the z axis |
//! | `float phimax` | 360 | part kept in azimuth, degrees from +x |
//!
//! u runs with azimuth, v from the base to the tip; the normal points outward. A cone of height 0 is a disk.

use glam::DVec3;

use crate::shape::quadric::Sweep;

/// `radius` and `height` ≥ 0; `phi_max` in radians, clamped to [0, 2π].
pub fn cone(radius: f64, height: f64, phi_max: f64) -> Sweep {
    let tip = DVec3::new(0.0, 0.0, height);
    Sweep::new(DVec3::new(radius, 0.0, 0.0), tip, phi_max)
}
