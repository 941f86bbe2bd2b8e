//! Which medium a path is in, and how much light passes through media and invisible boundaries.

use crate::ids::MediumId;
use crate::math::{Normal3, Vec3};
use crate::sampling::rng::Rng;
use crate::shape::ElementHit;
use crate::spectrum::Rgb;
use crate::world::{ElementRef, Hit, Segment, World, spawn_ray};

/// The media on the two sides of a surface.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct MediumInterface {
    /// On the side the normal points away from.
    pub inside: MediumId,
    /// On the side the normal points to.
    pub outside: MediumId,
}

impl MediumInterface {
    /// The medium a path is in after it left the surface of normal `ng` toward `w`.
    #[inline]
    pub fn toward(&self, ng: Normal3, w: Vec3) -> MediumId {
        if ng.dot(w) > 0.0 {
            self.outside
        } else {
            self.inside
        }
    }
}

impl World {
    /// Whether surfaces declare the medium only inside: then it ends everywhere.
    pub fn is_bounded(&self, medium: MediumId) -> bool {
        self.bounded_media[medium.index()]
    }

    /// The medium behind a surface of the given element toward `w`, for a path that came from `current`.
    #[inline]
    pub fn medium_toward(
        &self,
        target: ElementRef,
        ng: Normal3,
        w: Vec3,
        current: MediumId,
    ) -> MediumId {
        match &self.geometry(target.geometry).media {
            Some(interface) => interface.toward(ng, w),
            None => current,
        }
    }

    /// Unbiased estimate of the light that passes along a segment that starts in `medium`: through media and null
    /// surfaces, not through anything else. Adds the rays it traced to `n_rays`.
    pub fn transmittance_along(
        &self,
        segment: &Segment,
        mut medium: MediumId,
        rng: &mut Rng,
        n_rays: &mut u64,
    ) -> Rgb {
        let Segment {
            mut ray, mut t_max, ..
        } = *segment;
        let mut tr = Rgb::ONE;
        let mut travelled = 0.0;
        let target = t_max.is_finite().then(|| ray.at(t_max));
        // Every crossing leaves a surface behind; a ray that meets more of them than there are is stuck.
        for _ in 0..=self.max_crossings() {
            *n_rays += 1;
            let hit = self.closest_where(&ray, t_max, |hit| {
                let t = travelled + hit.at.t;
                let from_start = Hit {
                    at: ElementHit { t, ..hit.at },
                    ..*hit
                };
                self.stands_between(segment, &from_start)
            });
            if let Some(hit) = &hit
                && self.geometry(hit.target.geometry).material.is_some()
            {
                return Rgb::BLACK;
            }
            if medium.is_some() {
                let end = match &hit {
                    Some(hit) => hit.at.t,
                    None if target.is_some() => t_max,
                    None => (self.horizon - travelled).max(0.0),
                };
                tr *= self.medium(medium).transmittance(&ray, end, rng);
                if tr.is_black() {
                    return tr;
                }
            }
            let Some(hit) = hit else { return tr };
            let surface = self.surface(&ray, &hit);
            medium = self.medium_toward(hit.target, surface.ng, ray.d, medium);
            ray = spawn_ray(surface.p, surface.p_err, surface.ng, ray.d, ray.time);
            travelled += hit.at.t;
            // A point of a large surface may lie beside the ray by its rounding error. Aimed anew, the ray still
            // ends where it should; parallel to itself it could meet a small light elsewhere, or miss it.
            if let Some(target) = target {
                let to_target = target - ray.o;
                if to_target.dot(ray.d) <= 0.0 {
                    return tr;
                }
                t_max = to_target.length();
                ray.d = to_target / t_max;
            }
        }
        Rgb::BLACK
    }
}
