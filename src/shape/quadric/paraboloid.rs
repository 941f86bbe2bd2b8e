//! Paraboloid, open at its wide end. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float radius` | 1 | radius at z = `zmax`; the tip is at the origin |
//! | `float zmin`, `zmax` | 0, 1 | part kept in z |
//! | `float phimax` | 360 | part kept in azimuth, degrees from +x |
//!
//! u runs with azimuth, v with z from `zmin` to `zmax`; the normal points outward.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, Vec3Swizzles};

use crate::shape::quadric::FormPoint;
use crate::shape::quadric::revolution::{
    Ring, fraction_of_turn, middle_of_box, roots, turn, unit_derivative,
};

/// The surface ρ² = k z in object space.
#[derive(Clone, Copy, Debug)]
pub struct Paraboloid {
    /// Squared radius at z = 1; of the sign of `z_max`.
    k: f64,
    z_min: f64,
    z_max: f64,
    phi_max: f64,
}

impl Paraboloid {
    /// `radius` ≥ 0 at the larger end of the z range, which is sorted; `phi_max` in radians, clamped to [0, 2π].
    pub fn new(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> Self {
        let [z_min, z_max] = [z_min.min(z_max), z_min.max(z_max)];
        let k = radius * radius / z_max;
        Self {
            // An end at 0 leaves nothing but the tip.
            k: if k.is_finite() { k } else { 0.0 },
            z_min,
            z_max,
            phi_max: phi_max.clamp(0.0, TAU),
        }
    }

    /// The range of z in which there is a surface.
    fn z_range(&self) -> [f64; 2] {
        if self.z_max > 0.0 {
            [self.z_min.max(0.0), self.z_max]
        } else {
            [self.z_min, self.z_max]
        }
    }

    /// Whether it goes all the way around.
    pub(super) fn is_whole(&self) -> bool {
        self.phi_max >= TAU
    }

    fn keeps(&self, p: DVec3) -> bool {
        p.z >= self.z_min
            && p.z <= self.z_max
            && (self.is_whole() || turn(DVec2::X, p.xy()) <= self.phi_max)
    }

    pub(super) fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        // From a point within the box all terms of the equation are of the size of the box, whatever its proportions.
        let shift = middle_of_box(o, d, self.turned_box())?;
        let o = o + d * shift;
        roots(o, d, [self.k * o.z, 0.5 * self.k, 0.0])
            .into_iter()
            .find(|&t| t + shift > 0.0 && t + shift < t_max && self.keeps(o + d * t))
            .map(|t| t + shift)
    }

    /// A vector along the normal.
    fn normal(&self, p: DVec2) -> DVec3 {
        p.extend(-0.5 * self.k)
    }

    pub(super) fn point(&self, p: DVec3) -> FormPoint {
        let [low, high] = self.z_range();
        let phi = turn(DVec2::X, p.xy());
        let axis = DVec2::from_angle(phi);
        // Along the axis of coordinates nearest the normal, so that rounding in p is not blown up.
        let rho = p.xy().length();
        let z = if rho > 0.5 * self.k.abs() {
            p.z
        } else {
            rho * rho / self.k
        };
        let z = z.clamp(low, high);
        let rho = (self.k * z).sqrt();
        let p = (axis * rho).extend(z);
        let height = self.z_max - self.z_min;
        let normal = self.normal(p.xy());
        let rho_by_z = 0.5 * self.k / rho;
        let (dpdv, normal_by_v) = if rho_by_z.is_finite() {
            let radial = axis * (rho_by_z * height);
            (radial.extend(height), radial.extend(0.0))
        } else {
            // At the tip v has no derivative: any tangent does.
            ((axis * height).extend(0.0), DVec3::ZERO)
        };
        let dpdu = DVec3::new(-p.y, p.x, 0.0) * self.phi_max;
        let n = normal.normalize_or(DVec3::Z);
        FormPoint {
            p,
            n,
            ns: n,
            uv: [
                fraction_of_turn(phi, self.phi_max),
                (z - self.z_min) / height,
            ],
            dpdu,
            dpdv,
            dndu: unit_derivative(normal, dpdu),
            dndv: unit_derivative(normal, normal_by_v),
        }
    }

    /// Length of [`Self::normal`] at the ends: the area per z and azimuth.
    fn densities(&self) -> [f64; 2] {
        self.z_range()
            .map(|z| ((self.k * z).max(0.0) + 0.25 * self.k * self.k).sqrt())
    }

    pub(super) fn area(&self) -> f64 {
        let [low, high] = self.z_range();
        let [a, b] = self.densities();
        if a + b == 0.0 || high < low {
            return 0.0;
        }
        // (b³ − a³) / (b² − a²), the mean density up to a factor, without the differences.
        self.phi_max * (high - low) * (2.0 / 3.0) * (a * a + a * b + b * b) / (a + b)
    }

    /// Uniform by area: uniform in the cube of the density, a polynomial in z.
    pub(super) fn sample_area(&self, u: [f64; 2]) -> (DVec3, DVec3) {
        let [low, high] = self.z_range();
        let [a, b] = self.densities();
        // All differences by their factors, so that nothing cancels on a shallow bowl.
        let b_minus_a = self.k * (high - low) / (a + b);
        let cubes = b_minus_a * (a * a + a * b + b * b) * u[0];
        let density = (a * a * a + cubes).max(0.0).cbrt();
        let moved = cubes / (density * density + density * a + a * a);
        let z = (low + moved * (density + a) / self.k).clamp(low, high);
        let p = DVec2::from_angle(u[1] * self.phi_max) * (self.k * z).sqrt();
        (p.extend(z), self.normal(p).normalize_or(DVec3::Z))
    }

    fn rho_range(&self) -> [f64; 2] {
        let [a, b] = self.z_range().map(|z| (self.k * z).max(0.0).sqrt());
        [a.min(b), a.max(b)]
    }

    /// The box around the full turn.
    fn turned_box(&self) -> [DVec3; 2] {
        let [_, rho] = self.rho_range();
        let [low, high] = self.z_range();
        [DVec3::new(-rho, -rho, low), DVec3::new(rho, rho, high)]
    }

    pub(super) fn bounds(&self) -> [DVec3; 2] {
        let ring = Ring {
            rho: self.rho_range(),
            z: self.z_range(),
            phi: [0.0, self.phi_max],
        };
        ring.bounds()
    }
}
