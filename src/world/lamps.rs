//! Asymmetric lamps: those that light sampling and rays see differently in pbrt-v3.
//!
//! Direct light in pbrt-v3 combines two strategies by the power heuristic: light sampling draws a point on the lamp, BSDF
//! sampling a direction at the surface, whose ray may meet the lamp. For most lamps both see the same light, and the MIS
//! weights change noise alone. They change the picture where the normals of sampled points are not those of hits, and where
//! an alpha mask cuts holes into a lamp, which only rays heed: a point of the lamp is then seen by one strategy and not by the
//! other, and brings its part of the weight alone. Published scenes are lit by such lamps, so that the weights are
//! pbrt-v3's here: functions of the model, whatever densities our estimators sample with.
//!
//! A point y of such a lamp lights a non-specular vertex x, on the way to the vertex before it, with its radiance times
//! S w + H (1 − w). S is 1 if y, sampled, emits toward x, and H if a ray from x that meets y finds it emitting;
//! w = p_l² / (p_l² + p_b²) with pbrt-v3's densities p_l of light sampling and p_b of the lobes at x, or of the
//! phase function there. This factor is the same for all strategies that find the path. Cameras and specular vertices see H
//! alone.

use crate::ids::LightId;
use crate::light::{AreaLight, Light};
use crate::math::{Normal3, Point3, Vec3};
use crate::sampling::mis::Heuristic;
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::world::{Hit, Receiver, World};

/// Which strategies of pbrt-v3's direct lighting see a point of a lamp from another point, and the density that decides
/// their MIS weights.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LampVisibility {
    /// Light sampling does: S of the module.
    pub to_light_sampling: bool,
    /// Rays do: H of the module.
    pub to_rays: bool,
    /// pbrt-v3's density of light sampling, in sr⁻¹ at the other point; without the probability of the light.
    pub pdf_light: f32,
}

impl LampVisibility {
    /// The part of its radiance with which the point lights the other one, where BSDF sampling in pbrt-v3 draws the direction
    /// to it with density `pdf_scattering` in sr⁻¹.
    #[inline]
    pub fn radiance_factor(&self, pdf_scattering: impl FnOnce() -> f32) -> f32 {
        match (self.to_light_sampling, self.to_rays) {
            (true, true) => 1.0,
            (true, false) => Heuristic::Power.weight(self.pdf_light, pdf_scattering()),
            (false, true) => Heuristic::Power.weight(pdf_scattering(), self.pdf_light),
            (false, false) => 0.0,
        }
    }

    /// The same where the other one is specular.
    #[inline]
    pub fn specular_radiance_factor(&self) -> f32 {
        f32::from(u8::from(self.to_rays))
    }
}

/// A point of a lamp, which may be asymmetric.
#[derive(Clone, Copy, Debug)]
pub struct LampPoint {
    /// The lamp.
    pub light: LightId,
    /// The point.
    pub p: Point3,
    /// The normal of hits there.
    pub ng: Normal3,
    /// A mask cuts it out.
    pub is_hole: bool,
}

impl World {
    /// How a point of a lamp is seen from the point `from`, which lies in the unit direction `w`. `None` for lamps that are not
    /// asymmetric.
    #[inline]
    pub fn lamp_visibility(
        &self,
        lamp: &LampPoint,
        from: Point3,
        w: Vec3,
    ) -> Option<LampVisibility> {
        match self.light(lamp.light) {
            Light::Area(area) if area.is_asymmetric() => {
                Some(self.visibility_of(area, lamp, from, w))
            }
            _ => None,
        }
    }

    /// The part of its radiance with which a point of a lamp lights the vertex at `from`, which lies in the unit direction
    /// `w`: a specular one, or one where BSDF sampling in pbrt-v3 draws the direction to the lamp with density `pdf_scattering` in
    /// sr⁻¹.
    #[inline]
    pub fn lamp_factor(
        &self,
        lamp: &LampPoint,
        from: Point3,
        w: Vec3,
        specular: bool,
        pdf_scattering: impl FnOnce() -> f32,
    ) -> f32 {
        match self.lamp_visibility(lamp, from, w) {
            None => 1.0,
            Some(visibility) if specular => visibility.specular_radiance_factor(),
            Some(visibility) => visibility.radiance_factor(pdf_scattering),
        }
    }

    pub(super) fn visibility_of(
        &self,
        area: &AreaLight,
        lamp: &LampPoint,
        from: Point3,
        w: Vec3,
    ) -> LampVisibility {
        let faces = lamp.ng.dot(w) > 0.0;
        let shape = &self.geometry(area.geometry).shape;
        LampVisibility {
            to_light_sampling: area.two_sided || faces != area.is_turned,
            to_rays: !lamp.is_hole && (area.two_sided || faces),
            pdf_light: shape.pdf_in_pbrt(area.element, from, lamp.p, lamp.ng),
        }
    }

    /// Emission toward `wo` of the surface that a ray from a receiver has met, in a direction that BSDF sampling in pbrt-v3
    /// draws with density `pdf_scattering` in sr⁻¹, as it lights the receiver: the light and the radiance.
    #[inline]
    pub fn emitted_onto(
        &self,
        at: &Receiver,
        pdf_scattering: impl FnOnce() -> f32,
        hit: &Hit,
        surface: &SurfacePoint,
        wo: Vec3,
    ) -> Option<(LightId, Rgb)> {
        let first = self.geometry(hit.target.geometry).first_light;
        if !self.facts().has_asymmetric_lamps || !first.is_some() {
            return self.emitted(hit, surface, wo);
        }
        let lamp = LampPoint {
            light: LightId(first.0 + hit.target.element),
            p: surface.p,
            ng: surface.n_surface,
            is_hole: false,
        };
        match (
            self.light(lamp.light),
            self.lamp_visibility(&lamp, at.p, wo),
        ) {
            (Light::Area(area), Some(visibility)) => Some((
                lamp.light,
                area.radiance * visibility.radiance_factor(pdf_scattering),
            )),
            _ => self.emitted(hit, surface, wo),
        }
    }
}
