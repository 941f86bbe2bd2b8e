//! What a segment sweeps as it turns about the z axis: cylinders, cones, hyperboloids of one sheet and flat rings.
//!
//! A point of the surface is the segment's point at v, turned by the azimuth u · φ_max. Distances from the axis along
//! the segment are ρ² = waist² + |d_xy|² s², where s = v − v_waist counts from the point nearest the axis, the waist.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, Vec3Swizzles};

use crate::math::error::EPSILON;
use crate::shape::quadric::FormPoint;
use crate::shape::quadric::revolution::{
    Ring, fraction_of_turn, middle_of_box, roots, solve_increasing, turn, unit_derivative,
};

/// A swept segment.
#[derive(Clone, Copy, Debug)]
pub struct Sweep {
    /// Where the segment starts: v = 0.
    start: DVec3,
    /// From there to its end. Its z is 0 if the surface is flat.
    d: DVec3,
    phi_max: f64,
    /// The part of the segment that counts: all of it, unless it is flat and folds back over itself.
    v_range: [f64; 2],
    v_waist: f64,
    waist: f64,
}

impl Sweep {
    /// Sweeps the segment from `start` to `end` by `phi_max` radians, clamped to [0, 2π].
    ///
    /// A surface that is flat to single precision is taken as a ring in a plane. If the segment of a ring passes its
    /// waist, both of its ends sweep the same places: the longer one counts.
    pub fn new(mut start: DVec3, end: DVec3, phi_max: f64) -> Self {
        let mut d = end - start;
        let length2 = d.xy().length_squared();
        let (v_waist, waist) = if length2 > 0.0 {
            let along = -start.xy().dot(d.xy()) / length2;
            (along, start.xy().perp_dot(d.xy()).abs() / length2.sqrt())
        } else {
            (0.0, start.xy().length())
        };
        let mut v_range = [0.0, 1.0];
        if d.z.abs() <= f64::from(EPSILON) * length2.sqrt() {
            start.z = 0.5 * (start.z + end.z);
            d.z = 0.0;
            if v_waist > 0.0 && v_waist < 1.0 {
                v_range[usize::from(v_waist > 0.5)] = v_waist;
            }
        }
        Self {
            start,
            d,
            phi_max: phi_max.clamp(0.0, TAU),
            v_range,
            v_waist,
            waist,
        }
    }

    fn is_flat(&self) -> bool {
        self.d.z == 0.0
    }

    /// The segment's point at `v`.
    fn on_segment(&self, v: f64) -> DVec3 {
        self.start + self.d * v
    }

    /// Where along the segment the circle through `p` starts.
    fn v_of(&self, p: DVec3) -> f64 {
        if self.is_flat() {
            self.v_by_rho(p.xy().length(), f64::NAN)
        } else {
            (p.z - self.start.z) / self.d.z
        }
    }

    /// The v of a point at distance `rho` from the axis. If the segment has two, the one on the side of `v_hint`.
    fn v_by_rho(&self, rho: f64, v_hint: f64) -> f64 {
        let s = self.excess(rho) / self.d.xy().length();
        let [first, last] = self.v_range;
        if last <= self.v_waist || (first < self.v_waist && v_hint < self.v_waist) {
            self.v_waist - s
        } else {
            self.v_waist + s
        }
    }

    /// √(ρ² − waist²).
    fn excess(&self, rho: f64) -> f64 {
        ((rho - self.waist) * (rho + self.waist)).max(0.0).sqrt()
    }

    /// Whether it goes all the way around.
    pub(super) fn is_whole(&self) -> bool {
        self.phi_max >= TAU
    }

    fn keeps(&self, p: DVec3) -> bool {
        let v = self.v_of(p);
        v >= self.v_range[0]
            && v <= self.v_range[1]
            && (self.is_whole() || turn(self.on_segment(v).xy(), p.xy()) <= self.phi_max)
    }

    pub(super) fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        let counts = |t: f64, p: DVec3| t > 0.0 && t < t_max && self.keeps(p);
        if self.is_flat() {
            let t = (self.start.z - o.z) / d.z;
            return counts(t, o + d * t).then_some(t);
        }
        // From a point within the box all terms of the equation are of the size of the box, whatever its proportions.
        let shift = middle_of_box(o, d, self.turned_box())?;
        let o = o + d * shift;
        let slope = self.d.xy() / self.d.z;
        let at = self.start.xy() + slope * (o.z - self.start.z);
        let profile = [at.length_squared(), at.dot(slope), slope.length_squared()];
        roots(o, d, profile)
            .into_iter()
            .find(|&t| counts(t + shift, o + d * t))
            .map(|t| t + shift)
    }

    /// A vector along the normal for the point at `v` of a circle through `p`: ∂p/∂φ × ∂p/∂v.
    fn normal(&self, v: f64, p: DVec2) -> DVec3 {
        let radial = self.on_segment(v).xy().dot(self.d.xy());
        (p * self.d.z).extend(-radial)
    }

    /// The unit normal, also at a tip, where it is that of the generator itself.
    fn unit_normal(&self, v: f64, p: DVec2) -> DVec3 {
        let at_tip = || {
            let toward_axis = (self.d.xy() * -self.d.z).extend(self.d.xy().length_squared());
            toward_axis.normalize_or(DVec3::Z)
        };
        self.normal(v, p).try_normalize().unwrap_or_else(at_tip)
    }

    pub(super) fn point(&self, p: DVec3) -> FormPoint {
        let mut v = self.v_of(p);
        // By ρ or by z, whichever is nearer the normal, so that rounding in p is not blown up.
        let rho = p.xy().length();
        if self.d.xy().length() * self.excess(rho) > rho * self.d.z.abs() {
            v = self.v_by_rho(rho, v);
        }
        let v = v.clamp(self.v_range[0], self.v_range[1]);
        let at = self.on_segment(v);
        let phi = turn(at.xy(), p.xy());
        let (sin, cos) = phi.sin_cos();
        let rotation = DVec2::new(cos, sin);
        let p = rotation.rotate(at.xy()).extend(at.z);
        let dpdu = DVec3::new(-p.y, p.x, 0.0) * self.phi_max;
        let dpdv = rotation.rotate(self.d.xy()).extend(self.d.z);
        let normal = self.normal(v, p.xy());
        let normal_by_u = DVec3::new(-normal.y, normal.x, 0.0) * self.phi_max;
        let normal_by_v = (dpdv.xy() * self.d.z).extend(-self.d.xy().length_squared());
        let n = self.unit_normal(v, p.xy());
        FormPoint {
            p,
            n,
            ns: n,
            uv: [fraction_of_turn(phi, self.phi_max), v],
            dpdu,
            dpdv,
            dndu: unit_derivative(normal, normal_by_u),
            dndv: unit_derivative(normal, normal_by_v),
        }
    }

    /// The area per v and azimuth is √(a² s² + b²): returns a and b.
    fn density_terms(&self) -> (f64, f64) {
        (
            self.d.xy().length() * self.d.length(),
            self.d.z.abs() * self.waist,
        )
    }

    /// Area per azimuth from the waist to s, negative for negative s.
    fn area_from_waist(&self, s: f64) -> f64 {
        let (a, b) = self.density_terms();
        let k = a * s / b;
        let curved = if b == 0.0 {
            0.0
        } else if k == 0.0 {
            b * s
        } else {
            b * s * (k.asinh() / k)
        };
        0.5 * (s * (a * s).hypot(b) + curved)
    }

    fn s_range(&self) -> [f64; 2] {
        self.v_range.map(|v| v - self.v_waist)
    }

    pub(super) fn area(&self) -> f64 {
        let [from, to] = self.s_range().map(|s| self.area_from_waist(s));
        self.phi_max * (to - from)
    }

    /// The v up to which a share `u` of the area lies.
    fn v_of_area_share(&self, u: f64) -> f64 {
        let (a, b) = self.density_terms();
        let [low, high] = self.s_range();
        let [from, to] = [low, high].map(|s| self.area_from_waist(s));
        let target = from + u * (to - from);
        let s = if a == 0.0 {
            low + u * (high - low)
        } else if b == 0.0 {
            (2.0 * target.abs() / a).sqrt().copysign(target)
        } else {
            // The integrand has no inflection on either side of the waist.
            solve_increasing(
                target,
                [low, high],
                low + u * (high - low),
                |s| self.area_from_waist(s),
                |s| (a * s).hypot(b),
            )
        };
        (self.v_waist + s).clamp(self.v_range[0], self.v_range[1])
    }

    /// Uniform by area.
    pub(super) fn sample_area(&self, u: [f64; 2]) -> (DVec3, DVec3) {
        let v = self.v_of_area_share(u[0]);
        let at = self.on_segment(v);
        let (sin, cos) = (u[1] * self.phi_max).sin_cos();
        let p = DVec2::new(cos, sin).rotate(at.xy());
        (p.extend(at.z), self.unit_normal(v, p))
    }

    /// Smallest and largest distance from the axis.
    fn rho_range(&self) -> [f64; 2] {
        let [v0, v1] = self.v_range;
        let [rho0, rho1] = [v0, v1].map(|v| self.on_segment(v).xy().length());
        let smallest = if v0 <= self.v_waist && self.v_waist <= v1 {
            self.waist
        } else {
            rho0.min(rho1)
        };
        [smallest, rho0.max(rho1)]
    }

    fn z_range(&self) -> [f64; 2] {
        let [z0, z1] = [self.start.z, self.start.z + self.d.z];
        [z0.min(z1), z0.max(z1)]
    }

    /// The box around the full turn.
    fn turned_box(&self) -> [DVec3; 2] {
        let [_, rho] = self.rho_range();
        let [low, high] = self.z_range();
        [DVec3::new(-rho, -rho, low), DVec3::new(rho, rho, high)]
    }

    pub(super) fn bounds(&self) -> [DVec3; 2] {
        let [a, b] = self.v_range.map(|v| self.on_segment(v).xy());
        let through_axis = a.perp_dot(b) == 0.0 && a.dot(b) < 0.0;
        // The azimuth of the segment: from that of one end to that of the other, either of which may lie on the axis.
        let first = if a == DVec2::ZERO { b } else { a };
        let start = first.y.atan2(first.x);
        let twist = a.perp_dot(b).atan2(a.dot(b));
        let ring = Ring {
            rho: self.rho_range(),
            z: self.z_range(),
            phi: if through_axis {
                [0.0, TAU]
            } else {
                [
                    start + twist.min(0.0),
                    start + twist.max(0.0) + self.phi_max,
                ]
            },
        };
        ring.bounds()
    }
}
