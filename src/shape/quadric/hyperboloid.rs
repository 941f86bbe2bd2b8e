//! Hyperboloid: a quadric about the z axis, parametrised by a segment that turns about it. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `point3 p1`, `p2` | (0, 0, 0), (1, 1, 1) | ends of the segment; the defaults sweep a cone |
//! | `float phimax` | 360 | part swept, degrees |
//!
//! u runs with the sweep, v from `p1` to `p2`, or the other way if the z of `p2` is 0.
//!
//! The surface is the one pbrt-v3 intersects: ρ² = a + b z² through `p2` and through a point beyond it on the line of
//! the segment, so that its waist is at z = 0 whatever the segment, cut at the z of both ends. Where that is what the
//! segment sweeps, or where pbrt-v3 finds no such surface, it is the swept one ([`Sweep`]). The shading normal is that
//! of the parametrisation, ∂p/∂u × ∂p/∂v, which the surface follows only where both are the same.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3, Vec3Swizzles};

use crate::math::error::EPSILON;
use crate::math::transform::{image_of_box, power_of_two_near};
use crate::shape::quadric::revolution::{
    fraction_of_turn, middle_of_box, roots, solve_increasing, turn, within_box,
};
use crate::shape::quadric::{Form, FormPoint, Sweep};

/// Most points of the line that are tried for a second radius.
const MOST_TRIALS: usize = 1 << 10;

/// Relative difference of two surfaces that single precision does not tell apart.
const SAME: f64 = 1e-6;

/// Any two points; `phi_max` in radians, clamped to [0, 2π].
pub fn hyperboloid(p1: DVec3, p2: DVec3, phi_max: f64) -> Form {
    // As pbrt-v3, which thereby turns the normal around.
    let (start, end) = if p2.z == 0.0 { (p2, p1) } else { (p1, p2) };
    let sweep = Sweep::new(start, end, phi_max);
    match Hyperboloid::new(start, end, phi_max) {
        Some(bent) if !bent.is_swept() => Form::Hyperboloid(Box::new(bent)),
        _ => Form::Sweep(sweep),
    }
}

/// The surface ρ² = `profile`\[0\] + `profile`\[1\] z² in object space.
#[derive(Clone, Copy, Debug)]
pub struct Hyperboloid {
    /// Where the segment starts: v = 0.
    start: DVec3,
    /// From there to its end; its z is not 0.
    d: DVec3,
    phi_max: f64,
    profile: [f64; 2],
    /// The parts of the z range in which there is a surface; those without one run backward.
    pieces: [[f64; 2]; 2],
    /// See [`Hyperboloid::behind_window`].
    window: Option<Window>,
}

/// A box that a line must pass.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// From object space to that of the box.
    from_object: DAffine3,
    corners: [DVec3; 2],
}

/// The second point of the line by which pbrt-v3 finds the coefficients: the first of those `start` + 2 k (`end` −
/// `start`) with which they are finite. In single precision, as rounding there decides which one that is; scaled by a
/// power of two to about one unit, so that the unit of length decides nothing.
fn second_point(start: DVec3, end: DVec3) -> Option<DVec3> {
    let size = start.abs().max(end.abs()).max_element();
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let scale = 1.0 / power_of_two_near(size);
    let (p1, p2) = ((start * scale).as_vec3(), (end * scale).as_vec3());
    let mut at = p1;
    for k in 1..=MOST_TRIALS {
        at += 2.0 * (p2 - p1);
        let (rho1, rho2) = (at.xy().length_squared(), p2.xy().length_squared());
        let inverse_square = (1.0 / rho1 - (at.z * at.z) / (rho1 * p2.z * p2.z))
            / (1.0 - (rho2 * at.z * at.z) / (rho1 * p2.z * p2.z));
        if inverse_square.is_finite() {
            return Some(start + (end - start) * (2.0 * k as f64));
        }
    }
    None
}

impl Hyperboloid {
    /// `None` where pbrt-v3 finds no surface, or one that is a plane to single precision.
    fn new(start: DVec3, end: DVec3, phi_max: f64) -> Option<Self> {
        let d = end - start;
        if d.z.abs() <= f64::from(EPSILON) * d.xy().length() {
            return None;
        }
        let beyond = second_point(start, end)?;
        let (rho1, rho2) = (beyond.xy().length_squared(), end.xy().length_squared());
        let (z1, z2) = (beyond.z * beyond.z, end.z * end.z);
        let difference = z1 - z2;
        if difference.abs() <= SAME * z1.max(z2) && (rho1 - rho2).abs() > SAME * rho1.max(rho2) {
            return None;
        }
        let b = if rho1 == rho2 {
            0.0
        } else {
            (rho1 - rho2) / difference
        };
        let a = rho2 - b * z2;
        let z = [start.z.min(end.z), start.z.max(end.z)];
        const NOTHING: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];
        let at_axis = (-a / b).sqrt();
        let pieces = if a < 0.0 {
            [[z[0], z[1].min(-at_axis)], [z[0].max(at_axis), z[1]]]
        } else if b < 0.0 {
            [[z[0].max(-at_axis), z[1].min(at_axis)], NOTHING]
        } else {
            [z, NOTHING]
        };
        let bent = Self {
            start,
            d,
            phi_max: phi_max.clamp(0.0, TAU),
            profile: [a, b],
            pieces,
            window: None,
        };
        (a.is_finite() && b.is_finite() && bent.area().is_finite()).then_some(bent)
    }

    /// Whether the segment sweeps the same surface.
    fn is_swept(&self) -> bool {
        [0.0, 0.5, 1.0].into_iter().all(|v| {
            let at = self.on_segment(v);
            let swept = at.xy().length_squared();
            (self.rho2(at.z) - swept).abs() <= SAME * swept
        })
    }

    /// Lets only rays meet it that come to the box around both ends of the segment, turned about the axis, as long as
    /// the surface reaches beyond: so pbrt-v3 shows it. The box is along the axes of the space in which the shape was
    /// defined.
    pub(super) fn behind_window(&self, definition_from_object: &DAffine3) -> Self {
        let rho2 = [0.0, 1.0].map(|v| self.on_segment(v).xy().length_squared());
        let widest = rho2[0].max(rho2[1]);
        let [_, reaches] = self.rho2_range();
        if reaches <= widest * (1.0 + SAME) {
            return *self;
        }
        let rho = widest.sqrt();
        let [z0, z1] = [self.start.z, self.start.z + self.d.z];
        let around = [
            DVec3::new(-rho, -rho, z0.min(z1)),
            DVec3::new(rho, rho, z0.max(z1)),
        ];
        Self {
            window: Some(Window {
                from_object: *definition_from_object,
                corners: image_of_box(definition_from_object, around),
            }),
            ..*self
        }
    }

    fn rho2(&self, z: f64) -> f64 {
        let [a, b] = self.profile;
        (a + b * z * z).max(0.0)
    }

    /// The segment's point at `v`.
    fn on_segment(&self, v: f64) -> DVec3 {
        self.start + self.d * v
    }

    /// The segment's point at the height `z`, and its v.
    fn segment_at(&self, z: f64) -> (DVec3, f64) {
        let v = (z - self.start.z) / self.d.z;
        (self.on_segment(v), v)
    }

    /// Whether it goes all the way around.
    pub(super) fn is_whole(&self) -> bool {
        self.phi_max >= TAU
    }

    fn keeps(&self, p: DVec3) -> bool {
        let within = |[low, high]: [f64; 2]| p.z >= low && p.z <= high;
        self.pieces.into_iter().any(within)
            && (self.is_whole() || turn(self.segment_at(p.z).0.xy(), p.xy()) <= self.phi_max)
    }

    pub(super) fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        if let Some(window) = &self.window {
            let there = &window.from_object;
            let [_, far] = within_box(
                there.transform_point3(o),
                there.transform_vector3(d),
                window.corners,
            )?;
            if !(far > 0.0) {
                return None;
            }
        }
        // From a point within the box all terms of the equation are of the size of the box, whatever its proportions.
        let shift = middle_of_box(o, d, self.bounds())?;
        let o = o + d * shift;
        let b = self.profile[1];
        let [a, _] = self.profile;
        roots(o, d, [a + b * o.z * o.z, b * o.z, b])
            .into_iter()
            .find(|&t| t + shift > 0.0 && t + shift < t_max && self.keeps(o + d * t))
            .map(|t| t + shift)
    }

    /// Unit normal of the surface, on the side of that of the parametrisation.
    fn unit_normal(&self, p: DVec3) -> DVec3 {
        let outward = p.xy().extend(-self.profile[1] * p.z).normalize_or(DVec3::Z);
        outward * self.d.z.signum()
    }

    /// The normal of [`Self::point`] alone.
    pub(super) fn normal(&self, p: DVec3) -> DVec3 {
        self.unit_normal(self.on_surface(p))
    }

    /// The point moved onto the surface, along the axis of coordinates nearest the normal, so that rounding in it is
    /// not blown up.
    fn on_surface(&self, p: DVec3) -> DVec3 {
        let [a, b] = self.profile;
        let rho2 = p.xy().length_squared();
        let z = if b * b * p.z * p.z > rho2 {
            ((rho2 - a) / b).max(0.0).sqrt().copysign(p.z)
        } else {
            p.z
        };
        let distance = |[low, high]: [f64; 2]| (low - z).max(z - high);
        let [first, second] = self.pieces;
        let [low, high] = if distance(second) < distance(first) {
            second
        } else {
            first
        };
        let z = z.clamp(low, high.max(low));
        let (on_segment, _) = self.segment_at(z);
        let outward = p
            .xy()
            .try_normalize()
            .or_else(|| on_segment.xy().try_normalize())
            .unwrap_or(DVec2::X);
        (outward * self.rho2(z).sqrt()).extend(z)
    }

    pub(super) fn point(&self, p: DVec3) -> FormPoint {
        let p = self.on_surface(p);
        let (on_segment, v) = self.segment_at(p.z);
        let phi = turn(on_segment.xy(), p.xy());
        let dpdu = DVec3::new(-p.y, p.x, 0.0) * self.phi_max;
        let turned = DVec2::from_angle(phi).rotate(self.d.xy());
        let dpdv = turned.extend(self.d.z);
        let n = self.unit_normal(p);
        let ns = (p.xy() * self.d.z)
            .extend(-p.xy().dot(turned))
            .try_normalize()
            .unwrap_or(n);
        // The second fundamental form of the parametrisation (pbrt 3e §3.2.2), not that of the surface.
        let (e, f, g) = (dpdu.dot(dpdu), dpdu.dot(dpdv), dpdv.dot(dpdv));
        let by_uu = ns.dot((p.xy() * (-self.phi_max * self.phi_max)).extend(0.0));
        let by_uv = ns.dot((turned.perp() * self.phi_max).extend(0.0));
        let scale = 1.0 / (e * g - f * f);
        let derivative = |by_u: f64, by_v: f64| {
            let dn = (dpdu * by_u + dpdv * by_v) * scale;
            if dn.is_finite() { dn } else { DVec3::ZERO }
        };
        FormPoint {
            p,
            n,
            ns,
            uv: [fraction_of_turn(phi, self.phi_max), v],
            dpdu,
            dpdv,
            dndu: derivative(by_uv * f - by_uu * g, by_uu * f - by_uv * e),
            dndv: derivative(-by_uv * g, by_uv * f),
        }
    }

    /// Area per z and azimuth: √(a + b (1 + b) z²).
    fn density(&self, z: f64) -> f64 {
        let [a, b] = self.profile;
        (a + b * (1.0 + b) * z * z).max(0.0).sqrt()
    }

    /// Area per azimuth up to `z`, but for a constant that each piece has for itself.
    fn area_up_to(&self, z: f64) -> f64 {
        let [a, b] = self.profile;
        let c = b * (1.0 + b);
        let curved = if a > 0.0 {
            let k = (c.abs() / a).sqrt() * z;
            let of_k = if k == 0.0 {
                1.0
            } else if c > 0.0 {
                k.asinh() / k
            } else {
                k.clamp(-1.0, 1.0).asin() / k
            };
            a.sqrt() * z * of_k
        } else if a < 0.0 {
            let c = c.sqrt();
            z.signum() * (a / c) * (c * z.abs() + self.density(z)).ln()
        } else {
            0.0
        };
        0.5 * (z * self.density(z) + curved)
    }

    /// Areas per azimuth of both pieces.
    fn shares(&self) -> [f64; 2] {
        self.pieces.map(|[low, high]| {
            if high > low {
                (self.area_up_to(high) - self.area_up_to(low)).max(0.0)
            } else {
                0.0
            }
        })
    }

    pub(super) fn area(&self) -> f64 {
        self.phi_max * self.shares().iter().sum::<f64>()
    }

    /// Uniform by area.
    pub(super) fn sample_area(&self, u: [f64; 2]) -> (DVec3, DVec3) {
        let shares = self.shares();
        let mut target = u[0] * (shares[0] + shares[1]);
        let mut piece = self.pieces[0];
        if target >= shares[0] && shares[1] > 0.0 {
            target -= shares[0];
            piece = self.pieces[1];
        }
        let before = self.area_up_to(piece[0]);
        let z = solve_increasing(
            target,
            piece,
            0.5 * (piece[0] + piece[1]),
            |z| self.area_up_to(z) - before,
            |z| self.density(z),
        );
        let (on_segment, _) = self.segment_at(z);
        let outward = on_segment.xy().try_normalize().unwrap_or(DVec2::X);
        let at = DVec2::from_angle(u[1] * self.phi_max).rotate(outward);
        let p = (at * self.rho2(z).sqrt()).extend(z);
        (p, self.unit_normal(p))
    }

    /// Smallest and largest squared distance from the axis.
    fn rho2_range(&self) -> [f64; 2] {
        let mut range = [f64::INFINITY, 0.0];
        for [low, high] in self.pieces.into_iter().filter(|[low, high]| low <= high) {
            // Squared distances run one way on either side of z = 0.
            for z in [low, high, 0f64.clamp(low, high)] {
                let rho2 = self.rho2(z);
                range = [range[0].min(rho2), range[1].max(rho2)];
            }
        }
        range
    }

    /// The box around the full turn; empty without a surface.
    pub(super) fn bounds(&self) -> [DVec3; 2] {
        let rho = self.rho2_range()[1].sqrt();
        let (low, high) = self
            .pieces
            .into_iter()
            .filter(|[low, high]| low <= high)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), piece| {
                (low.min(piece[0]), high.max(piece[1]))
            });
        [DVec3::new(-rho, -rho, low), DVec3::new(rho, rho, high)]
    }
}
