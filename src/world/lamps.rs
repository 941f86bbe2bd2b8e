//! Lamps that light a scene otherwise than they show.
//!
//! Next-event estimation in pbrt-v3 has two halves, weighed by the power heuristic: a point that is drawn on the lamp, and a
//! direction drawn by the surface, which finds the lamp. For most lamps both find the same light, and what they share of
//! it does not matter. Not so where the normals of points that are drawn are not those that rays find, and where a
//! mask cuts holes into a lamp, which only rays heed: then a point of the lamp gives a surface one half, the other, or
//! both, and the weights decide how much that is. Published scenes are lit by such lamps, so that the weights are
//! part of the picture, and are pbrt-v3's here: functions of the model, whatever densities light is looked for with.
//!
//! A point y of such a lamp lights a point x that is no mirror, on the way to the point that x is seen from, with its
//! radiance times S w + H (1 − w). S is 1 if points that are drawn shine from y to x, H if rays from x find light at y,
//! and w = p_l² / (p_l² + p_b²) with pbrt-v3's densities p_l of the direction on the lamp and p_b of the lobes at x, or of the
//! phase function there. This factor is the same for all ways in which the path may be found. Cameras and mirrors see H
//! alone.

use crate::ids::LightId;
use crate::light::{AreaLight, Light};
use crate::math::{Normal3, Point3, Vec3};
use crate::sampling::mis::Heuristic;
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::world::{Hit, Receiver, World};

/// Which halves of pbrt-v3's estimator see a point of a lamp from another point, and how they share its light.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Halves {
    /// Points drawn on the lamp shine there.
    pub drawn: bool,
    /// Rays find light there.
    pub found: bool,
    /// pbrt-v3's density of points drawn on the lamp, in sr⁻¹ at the other point.
    pub pdf_drawn: f32,
}

impl Halves {
    /// The part of its radiance with which the point lights the other one, where pbrt-v3 draws the direction to it with
    /// density `pdf_found` in sr⁻¹.
    #[inline]
    pub fn factor(&self, pdf_found: impl FnOnce() -> f32) -> f32 {
        match (self.drawn, self.found) {
            (true, true) => 1.0,
            (true, false) => Heuristic::Power.weight(self.pdf_drawn, pdf_found()),
            (false, true) => Heuristic::Power.weight(pdf_found(), self.pdf_drawn),
            (false, false) => 0.0,
        }
    }

    /// The part with which it shows in mirrors.
    #[inline]
    pub fn factor_in_mirrors(&self) -> f32 {
        f32::from(u8::from(self.found))
    }
}

/// A point of a lamp, if it is one that lights otherwise than it shows.
#[derive(Clone, Copy, Debug)]
pub struct LampPoint {
    /// The lamp.
    pub light: LightId,
    /// The point.
    pub p: Point3,
    /// The normal that rays find there.
    pub ng: Normal3,
    /// A mask cuts it out.
    pub is_hole: bool,
}

impl World {
    /// How a point of a lamp is seen from the point `from`, which lies in the unit direction `w`. `None` for lamps of which
    /// all that shows lights, and the other way round.
    #[inline]
    pub fn halves(&self, lamp: &LampPoint, from: Point3, w: Vec3) -> Option<Halves> {
        match self.light(lamp.light) {
            Light::Area(area) if area.lights_otherwise() => {
                Some(self.halves_of(area, lamp, from, w))
            }
            _ => None,
        }
    }

    /// The part of its radiance with which a point of a lamp lights the point `from`, which lies in the unit direction `w`
    /// and sends the light on as a mirror does, or in a direction from which pbrt-v3 draws that to the lamp with density
    /// `pdf_found` in sr⁻¹.
    #[inline]
    pub fn lamp_factor(
        &self,
        lamp: &LampPoint,
        from: Point3,
        w: Vec3,
        mirrors: bool,
        pdf_found: impl FnOnce() -> f32,
    ) -> f32 {
        match self.halves(lamp, from, w) {
            None => 1.0,
            Some(halves) if mirrors => halves.factor_in_mirrors(),
            Some(halves) => halves.factor(pdf_found),
        }
    }

    pub(super) fn halves_of(
        &self,
        area: &AreaLight,
        lamp: &LampPoint,
        from: Point3,
        w: Vec3,
    ) -> Halves {
        let faces = lamp.ng.dot(w) > 0.0;
        let shape = &self.geometry(area.geometry).shape;
        Halves {
            drawn: area.two_sided || faces != area.is_turned,
            found: !lamp.is_hole && (area.two_sided || faces),
            pdf_drawn: shape.pdf_in_pbrt(area.element, from, lamp.p, lamp.ng),
        }
    }

    /// Emission toward `wo` of the surface that was found from a receiver, in a direction that pbrt-v3 draws with
    /// density `pdf_found` in sr⁻¹, as it lights the receiver: the light and the radiance.
    #[inline]
    pub fn emitted_onto(
        &self,
        at: &Receiver,
        pdf_found: impl FnOnce() -> f32,
        hit: &Hit,
        surface: &SurfacePoint,
        wo: Vec3,
    ) -> Option<(LightId, Rgb)> {
        let first = self.geometry(hit.target.geometry).first_light;
        if !self.facts().has_odd_lamps || !first.is_some() {
            return self.emitted(hit, surface, wo);
        }
        let lamp = LampPoint {
            light: LightId(first.0 + hit.target.element),
            p: surface.p,
            ng: surface.ng,
            is_hole: false,
        };
        match (self.light(lamp.light), self.halves(&lamp, at.p, wo)) {
            (Light::Area(area), Some(halves)) => {
                Some((lamp.light, area.radiance * halves.factor(pdf_found)))
            }
            _ => self.emitted(hit, surface, wo),
        }
    }
}
