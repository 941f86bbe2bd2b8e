//! Skies beyond media without end.
//!
//! A homogeneous medium that no surface closes goes on for ever. Light sampling in pbrt-v3 ends it two radii of the scene
//! away, where its rays toward light at infinity end; BSDF sampling goes through all of it, which lets nothing of a channel pass
//! unless it is clear. As with [asymmetric lamps](crate::world::lamps), the two strategies see different light then, and
//! pbrt-v3's MIS weights are part of the picture: from a direction, a vertex receives L (T_l w + T_b (1 − w)) with the
//! transmittances T_l of light sampling and T_b of BSDF sampling, and w = p_l² / (p_l² + p_b²) with pbrt-v3's densities p_l of
//! light sampling, without the probability of the light, and p_b of the lobes at the vertex, or of the phase function there.
//!
//! The rule holds for rays that leave the scene in such a medium, and for no others: in vacuum, and in a grid, which ends by
//! itself, both strategies see the same light, and are weighed by the densities that they sample with.

use crate::ids::{LightId, MediumId};
use crate::light::Light;
use crate::math::Vec3;
use crate::medium::Medium;
use crate::sampling::mis::Heuristic;
use crate::spectrum::Rgb;
use crate::world::{Receiver, World, WorldParts};

/// How skies are weighed where both strategies see the same light. Samples of skies make up for what directions miss (see
/// `light/environment.rs`), by densities that add up.
pub(super) const HEURISTIC: Heuristic = Heuristic::Balance;

/// Whether rays may leave the scene in a medium without end, toward a light at infinity: some homogeneous medium is on the
/// outer side of a surface, or around the camera.
pub(super) fn may_be_endless(parts: &WorldParts, bounded_media: &[bool]) -> bool {
    let is_far = |light: &Light| matches!(light, Light::Infinite(_) | Light::Distant(_));
    let mut media = bounded_media.iter().zip(&parts.media);
    media.any(|(is_bounded, medium)| !is_bounded && is_homogeneous(medium))
        && parts.lights.iter().any(is_far)
}

fn is_homogeneous(medium: &Medium) -> bool {
    matches!(medium, Medium::Homogeneous(_))
}

impl World {
    /// Whether a ray toward a light at infinity that leaves the scene in `medium` goes through that without end.
    #[inline]
    pub fn is_endless(&self, medium: MediumId) -> bool {
        self.facts.has_endless_media && medium.is_some() && is_homogeneous(self.medium(medium))
    }

    /// MIS weights of light sampling and of BSDF sampling for the unit direction `w` toward a sky, through a medium without
    /// end: those of pbrt-v3, where BSDF sampling has density `pdf_scattering` in sr⁻¹. `None` for lights that are no
    /// skies.
    pub fn endless_weights(
        &self,
        light: LightId,
        w: Vec3,
        pdf_scattering: impl FnOnce() -> f32,
    ) -> Option<[f32; 2]> {
        let Light::Infinite(sky) = self.light(light) else {
            return None;
        };
        let of_light = Heuristic::Power.weight(sky.pdf_in_pbrt(w), pdf_scattering());
        Some([of_light, 1.0 - of_light])
    }

    /// Radiance from the skies that a ray from a receiver finds, which leaves the scene in `medium` in the unit direction `w`,
    /// beside samples of the lights by [`World::sample_light`]: times its MIS weight. `pdf_w` is the density of the direction,
    /// and `pdf_scattering` that of BSDF sampling in pbrt-v3, where pictures depend on it, both in sr⁻¹.
    #[inline]
    pub fn environment_onto(
        &self,
        at: &Receiver,
        (pdf_w, pdf_scattering): (f32, f32),
        medium: MediumId,
        w: Vec3,
    ) -> Rgb {
        let is_endless = self.is_endless(medium);
        self.infinite_lights()
            .map(|(id, light)| {
                let (le, pdf_light) = light.le_and_pdf(w, at.wanted);
                let in_pbrt = || self.endless_weights(id, w, || pdf_scattering);
                let weight = match is_endless.then(in_pbrt).flatten() {
                    Some([_, of_scattering]) => of_scattering,
                    None => HEURISTIC.weight(pdf_w, pdf_light * self.light_pmf(at, id)),
                };
                le * weight
            })
            .sum()
    }

    /// Whether light is followed from a light through media. What a light at infinity sends through a medium without end is
    /// what the two strategies of its [module](self) make of it.
    pub fn sends_light_paths(&self, light: LightId) -> bool {
        let is_far = matches!(self.light(light), Light::Infinite(_) | Light::Distant(_));
        !(is_far && self.facts.has_endless_media)
    }
}
