//! Light of points on segments of paths through fog.
//!
//! The light of a point grows with the inverse square of the distance from it. Distances drawn by extinction alone ignore
//! that, and the variance is infinite. So a second distance is drawn by the angle under which a point sees the segment
//! (Kulla and Fajardo, *Importance Sampling Techniques for Path Tracing in Participating Media*, 2012), and either finds
//! light by the power heuristic of both.
//!
//! What is weighed are pairs of a light and a distance. By extinction, the distance comes first and the light is chosen for
//! a receiver there; by angle, the light comes first. With both probabilities in the densities, the weights of a pair sum
//! to 1 whatever either choice prefers.

use crate::ids::LightId;
use crate::light::Wanted;
use crate::math::{Normal3, Point3, Ray, Vec3};
use crate::medium::{Homogeneous, Medium};
use crate::sampling::equiangular::Equiangular;
use crate::sampling::mis::Heuristic;
use crate::spectrum::Rgb;
use crate::world::{LightSample, Receiver, World};

/// Mean free paths up to which distances are drawn by angle: 10⁻⁷ of the light comes from beyond.
const REACH: f32 = 16.0;

/// A segment of a path through fog, in a world with lights that are points.
#[derive(Clone, Copy)]
pub(super) struct FogSegment<'a> {
    world: &'a World,
    fog: &'a Homogeneous,
    ray: Ray,
    /// Up to where distances are drawn by angle.
    end: f32,
    /// Throughput at its start.
    beta: Rgb,
}

/// Light of a point that may be scattered on a segment.
pub(super) struct FogLight {
    /// Distance along the segment.
    pub t: f32,
    /// The light as it arrives there; its density is that of the distance as well.
    pub sample: LightSample,
    /// What is scattered toward the start of the segment and arrives there.
    pub f: Rgb,
    /// Weight against the distance that is drawn by extinction.
    pub weight: f32,
}

impl<'a> FogSegment<'a> {
    /// The segment (0, `t_max`) of a ray for a path of throughput `beta` in a medium. `None` where distances are drawn
    /// by extinction alone.
    #[inline]
    pub(super) fn new(
        world: &'a World,
        medium: &'a Medium,
        ray: &Ray,
        t_max: f32,
        beta: Rgb,
    ) -> Option<Self> {
        if !world.facts().has_points_in_fog {
            return None;
        }
        let Medium::Homogeneous(fog) = medium else {
            return None;
        };
        (fog.scatters() && !fog.phase.is_delta()).then(|| Self {
            world,
            fog,
            ray: *ray,
            end: t_max.min(REACH * fog.mean_free_path),
            beta,
        })
    }

    /// The segment as a light at `position` sees it; `None` where its distances are drawn by extinction alone.
    ///
    /// That is where the light is more than a mean free path away from a segment which is longer than that: its
    /// inverse square varies little where paths scatter, and another ray toward it does not pay (measured: a fifth less
    /// efficient in thick fog). On shorter segments it does however far the light is, since most paths pass without
    /// scattering.
    #[inline]
    fn seen_from(&self, position: Point3) -> Option<Equiangular> {
        let line = Equiangular::new(self.ray.d, self.end, position - self.ray.o)?;
        (self.end.min(line.nearest()) < self.fog.mean_free_path).then_some(line)
    }

    /// Density of a light and a distance by extinction, where `pmf` is the probability with which the receiver there
    /// chooses the light.
    #[inline]
    fn pdf_by_extinction(&self, t: f32, pmf: f32) -> f32 {
        self.fog.pdf(t, self.beta) * pmf
    }

    /// Weight of light that was found at a distance drawn by extinction, by a receiver that chose the light with
    /// probability `pmf`.
    pub(super) fn weight_by_extinction(&self, t: f32, at: Point3, light: LightId, pmf: f32) -> f32 {
        let by_angle = self.world.light(light).position().and_then(|position| {
            let line = self.seen_from(position)?;
            Some(line.pdf(t, (position - at).length_squared()))
        });
        match by_angle {
            Some(pdf) => Heuristic::Power.weight(
                self.pdf_by_extinction(t, pmf),
                pdf * self.world.point_light_pmf(light),
            ),
            None => 1.0,
        }
    }

    /// Chooses a light by `u_light` and draws a distance by `u`, which `place` may move. `None` where nothing arrives.
    pub(super) fn sample(
        &self,
        u_light: f64,
        u: f32,
        place: impl FnOnce(f32) -> f32,
    ) -> Option<FogLight> {
        let (light, pmf) = self.world.choose_point_light(u_light)?;
        let position = self.world.light(light).position()?;
        let line = self.seen_from(position)?;
        let t = place(line.sample(u));
        let at = Receiver {
            p: self.ray.at(t),
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wanted: Wanted::All,
            time: self.ray.time,
        };
        let pdf = pmf * line.pdf(t, (position - at.p).length_squared());
        // Nothing of a point is left to be drawn on it.
        let sample = self.world.sample_on_light(light, pdf, &at, [0.0; 2])?;
        let f = self.fog.scattered_at(t) * self.fog.phase.p(-self.ray.d, sample.wi);
        let by_extinction = self.pdf_by_extinction(t, self.world.light_pmf(&at, light));
        Some(FogLight {
            t,
            sample,
            f,
            weight: Heuristic::Power.weight(pdf, by_extinction),
        })
    }
}
