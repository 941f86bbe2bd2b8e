//! Sphere, whole or clipped. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float radius` | 1 | radius; centre at the origin, poles on ±z |
//! | `float zmin`, `zmax` | −radius, radius | part kept in z |
//! | `float phimax` | 360 | part kept in azimuth, degrees from +x |
//!
//! u runs with azimuth, v from the zmin to the zmax end; the normal points outward.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::math::error::EPSILON;
use crate::shape::quadric::FormPoint;
use crate::shape::quadric::revolution::Ring;

/// A sphere around the origin of object space.
#[derive(Clone, Copy, Debug)]
pub struct Sphere {
    radius: f64,
    z_min: f64,
    z_max: f64,
    phi_max: f64,
    /// Polar angles of the ends: where v is 0, and how far it is to where v is 1.
    theta_min: f64,
    theta_range: f64,
}

impl Sphere {
    /// `radius` ≥ 0; the z range is sorted and clamped to the sphere; `phi_max` in radians, clamped to [0, 2π].
    pub fn new(radius: f64, z_min: f64, z_max: f64, phi_max: f64) -> Self {
        let ends = [z_min.min(z_max), z_min.max(z_max)].map(|z| z.clamp(-radius, radius));
        let [theta_min, theta_max] = ends.map(|z| (z / radius).clamp(-1.0, 1.0).acos());
        Self {
            radius,
            z_min: ends[0],
            z_max: ends[1],
            phi_max: phi_max.clamp(0.0, TAU),
            theta_min,
            theta_range: theta_max - theta_min,
        }
    }

    /// Radius in object space.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Whether nothing is clipped away.
    pub fn is_whole(&self) -> bool {
        self.z_min == -self.radius && self.z_max == self.radius && self.phi_max >= TAU
    }

    fn keeps(&self, p: DVec3) -> bool {
        self.is_whole() || (p.z >= self.z_min && p.z <= self.z_max && azimuth(p) <= self.phi_max)
    }

    /// Both roots relative to the point of the ray nearest the centre, so that a distant or giant sphere keeps
    /// its digits (Haines, Günther, Akenine-Möller 2019, *Ray Tracing Gems*, chapter 7).
    pub(super) fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        let inverse_a = 1.0 / d.length_squared();
        let b = -o.dot(d);
        let nearest = o + d * (b * inverse_a);
        let r = self.radius;
        let closest = nearest.length();
        if closest > r {
            return None;
        }
        let root = ((r - closest) * (r + closest) * d.length_squared()).sqrt();
        let q = if b >= 0.0 { b + root } else { b - root };
        let distance = o.length();
        let c = (distance - r) * (distance + r);
        let (t0, t1) = (c / q, q * inverse_a);
        let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
        [near, far]
            .into_iter()
            .find(|&t| t > 0.0 && t < t_max && self.keeps(o + d * t))
    }

    /// The unit normal at the point nearest to `p`.
    pub(super) fn normal(p: DVec3) -> DVec3 {
        p.try_normalize().unwrap_or(DVec3::Z)
    }

    pub(super) fn point(&self, p: DVec3) -> FormPoint {
        let n = Self::normal(p);
        let p = n * self.radius;
        let rho = DVec2::new(n.x, n.y).length();
        let (cos_phi, sin_phi) = if rho > 0.0 {
            (n.x / rho, n.y / rho)
        } else {
            (1.0, 0.0)
        };
        // θ from both sine and cosine: exact near the poles too.
        let theta = rho.atan2(n.z);
        let uv = [
            azimuth(p) / self.phi_max,
            (theta - self.theta_min) / self.theta_range,
        ];
        let dpdu = DVec3::new(-p.y, p.x, 0.0) * self.phi_max;
        let dpdv = DVec3::new(p.z * cos_phi, p.z * sin_phi, -self.radius * rho) * self.theta_range;
        // On a sphere the unit normal is p / r.
        FormPoint {
            p,
            n,
            ns: n,
            uv,
            dpdu,
            dpdv,
            dndu: dpdu / self.radius,
            dndv: dpdv / self.radius,
        }
    }

    pub(super) fn area(&self) -> f64 {
        self.phi_max * self.radius * (self.z_max - self.z_min)
    }

    /// Uniform by area: uniform in z and azimuth (Archimedes).
    pub(super) fn sample_area(&self, u: [f64; 2]) -> (DVec3, DVec3) {
        let z = self.z_min + u[0] * (self.z_max - self.z_min);
        let rho = ((self.radius - z) * (self.radius + z)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (u[1] * self.phi_max).sin_cos();
        let p = DVec3::new(rho * cos_phi, rho * sin_phi, z);
        (p, p / self.radius)
    }

    pub(super) fn bounds(&self) -> [DVec3; 2] {
        let r = self.radius;
        let [bottom, top] = [self.z_min, self.z_max].map(|z| ((r - z) * (r + z)).max(0.0).sqrt());
        let spans_equator = self.z_min <= 0.0 && self.z_max >= 0.0;
        let widest = if spans_equator { r } else { bottom.max(top) };
        let ring = Ring {
            rho: [bottom.min(top), widest],
            z: [self.z_min, self.z_max],
            phi: [0.0, self.phi_max],
        };
        ring.bounds()
    }
}

/// Azimuth in [0, 2π).
pub(super) fn azimuth(p: DVec3) -> f64 {
    let phi = p.y.atan2(p.x);
    if phi < 0.0 {
        (phi + TAU).min(TAU.next_down())
    } else {
        phi
    }
}

/// The cone of directions in which a receiver outside sees a whole sphere.
pub(super) struct Cone {
    /// Unit vector from the centre to the receiver.
    axis: DVec3,
    sin_max: f64,
    /// 1 − cos of the half angle, from sin² so that nothing cancels for a far or tiny sphere.
    one_minus_cos_max: f64,
}

impl Cone {
    /// `None` if the receiver is not outside by more than the rounding of its single-precision coordinates: a point
    /// of the sphere itself may lie on either side.
    pub(super) fn new(center: DVec3, radius: f64, from: DVec3) -> Option<Self> {
        let to_receiver = from - center;
        let distance = to_receiver.length();
        let rounding = 4.0 * EPSILON as f64 * (from.abs() + center.abs()).max_element();
        if distance <= radius + rounding {
            return None;
        }
        let sin_max = radius / distance;
        let cos_max = ((1.0 - sin_max) * (1.0 + sin_max)).sqrt();
        let one_minus_cos_max = sin_max * sin_max / (1.0 + cos_max);
        Some(Self {
            axis: to_receiver / distance,
            sin_max,
            one_minus_cos_max,
        })
    }

    /// Density per solid angle.
    pub(super) fn pdf_w(&self) -> f64 {
        1.0 / (TAU * self.one_minus_cos_max)
    }

    /// The normal of a point of the sphere, drawn uniformly in solid angle as seen from the receiver.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        let one_minus_cos = u[0] * self.one_minus_cos_max;
        let sin2 = one_minus_cos * (2.0 - one_minus_cos);
        let cos = 1.0 - one_minus_cos;
        // Angle at the centre between the receiver and the point (pbrt 4th ed., section 6.2.4).
        let sin2_max = self.sin_max * self.sin_max;
        let cos_alpha = sin2 / self.sin_max + cos * (1.0 - sin2 / sin2_max).max(0.0).sqrt();
        let sin_alpha = ((1.0 - cos_alpha) * (1.0 + cos_alpha)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (2.0 * PI * u[1]).sin_cos();
        let s = self.axis.any_orthonormal_vector();
        let t = self.axis.cross(s);
        (s * (sin_alpha * cos_phi) + t * (sin_alpha * sin_phi) + self.axis * cos_alpha).normalize()
    }
}
