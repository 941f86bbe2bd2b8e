//! Disk, annulus or sector perpendicular to z. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float height` | 0 | position on the z axis |
//! | `float radius`, `innerradius` | 1, 0 | outer and inner radius |
//! | `float phimax` | 360 | part kept in azimuth, degrees from +x |
//!
//! u runs with azimuth, v from 0 at the rim to 1 at the inner radius; the normal is +z.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::shape::quadric::revolution::Ring;
use crate::shape::quadric::{FormPoint, sphere::azimuth};

/// A disk in object space.
#[derive(Clone, Copy, Debug)]
pub struct Disk {
    height: f64,
    radius: f64,
    inner_radius: f64,
    phi_max: f64,
}

impl Disk {
    /// Radii ≥ 0; `phi_max` in radians, clamped to [0, 2π].
    pub fn new(height: f64, radius: f64, inner_radius: f64, phi_max: f64) -> Self {
        Self {
            height,
            radius,
            inner_radius,
            phi_max: phi_max.clamp(0.0, TAU),
        }
    }

    /// Whether it is neither a ring nor a sector.
    pub(super) fn is_whole(&self) -> bool {
        self.inner_radius == 0.0 && self.phi_max >= TAU
    }

    pub(super) fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        if d.z == 0.0 {
            return None;
        }
        let t = (self.height - o.z) / d.z;
        if !(t > 0.0 && t < t_max) {
            return None;
        }
        let p = o + d * t;
        let r = DVec2::new(p.x, p.y).length();
        let kept = r <= self.radius
            && r >= self.inner_radius
            && (self.phi_max >= TAU || azimuth(p) <= self.phi_max);
        kept.then_some(t)
    }

    pub(super) fn point(&self, p: DVec3) -> FormPoint {
        let p = DVec3::new(p.x, p.y, self.height);
        let r = DVec2::new(p.x, p.y).length();
        let width = self.radius - self.inner_radius;
        let radial = if r > 0.0 {
            DVec3::new(p.x / r, p.y / r, 0.0)
        } else {
            DVec3::X
        };
        FormPoint {
            p,
            n: DVec3::Z,
            ns: DVec3::Z,
            uv: [azimuth(p) / self.phi_max, (self.radius - r) / width],
            dpdu: DVec3::new(-p.y, p.x, 0.0) * self.phi_max,
            dpdv: radial * -width,
            dndu: DVec3::ZERO,
            dndv: DVec3::ZERO,
        }
    }

    pub(super) fn area(&self) -> f64 {
        // Negative for an inner radius beyond the outer one: nothing is left, and nothing is drawn.
        0.5 * self.phi_max * (self.radius - self.inner_radius) * (self.radius + self.inner_radius)
    }

    /// Uniform by area: squared radius and azimuth are uniform.
    pub(super) fn sample_area(&self, u: [f64; 2]) -> (DVec3, DVec3) {
        let (outer, inner) = (
            self.radius * self.radius,
            self.inner_radius * self.inner_radius,
        );
        let r = (outer + u[0] * (inner - outer)).max(0.0).sqrt();
        let (sin, cos) = (u[1] * self.phi_max).sin_cos();
        (DVec3::new(r * cos, r * sin, self.height), DVec3::Z)
    }

    pub(super) fn bounds(&self) -> [DVec3; 2] {
        let ring = Ring {
            rho: [self.inner_radius, self.radius],
            z: [self.height; 2],
            phi: [0.0, self.phi_max],
        };
        ring.bounds()
    }
}
