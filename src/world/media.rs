//! Which medium a path is in, and how much light passes through media and invisible boundaries.

use glam::DVec3;

use crate::ids::MediumId;
use crate::math::{Normal3, Point3, Ray, Vec3};
use crate::sampling::rng::Rng;
use crate::shape::ElementHit;
use crate::spectrum::Rgb;
use crate::stop;
use crate::world::{ElementRef, Hit, Segment, World, spawn_ray};

/// Directions in which the surroundings of a point are looked at.
const N_LOOKS: u32 = 64;

/// What was met on the way to lights, counted by whoever traces.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ShadowTally {
    /// Rays traced.
    pub rays: u64,
    /// Segments given up, and counted as black, because they crossed more null surfaces than a straight ray can meet.
    pub stuck: u64,
    /// Null surfaces that were crossed from a medium they do not border on.
    pub mismatched: u64,
}

impl ShadowTally {
    /// Adds the counts of another worker.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        self.stuck += other.stuck;
        self.mismatched += other.mismatched;
    }
}

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
        medium.is_some() && self.bounded_media[medium.index()]
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

    /// Whether a surface of normal `ng`, met by a ray in direction `d`, is no boundary, or borders on the medium
    /// `current` on the near side. It does not where media overlap, the medium around the camera is declared wrongly,
    /// or a boundary is open.
    #[inline]
    pub fn borders_on(&self, target: ElementRef, ng: Normal3, d: Vec3, current: MediumId) -> bool {
        self.geometry(target.geometry)
            .media
            .as_ref()
            .is_none_or(|interface| interface.toward(ng, -d) == current)
    }

    /// The medium that the boundaries around a point say it is in: what most of the rays from there that meet a
    /// boundary meet it from. `None` if they meet none, or say nothing with one voice.
    pub fn surroundings(&self, p: Point3, time: f32) -> Option<MediumId> {
        let mut said: Vec<MediumId> = self.said_around(p, time).into_iter().flatten().collect();
        let n_said = said.len();
        said.sort_unstable();
        said.chunk_by(|a, b| a == b)
            .find(|votes| 2 * votes.len() > n_said)
            .map(|votes| votes[0])
    }

    /// The medium that each of some rays from a point meets its first boundary from; `None` for one that meets none.
    pub(super) fn said_around(&self, p: Point3, time: f32) -> Vec<Option<MediumId>> {
        (0..N_LOOKS)
            .map(|i| {
                // A spiral of even density (Swinbank and Purser 2006).
                let golden_angle = std::f64::consts::PI * (3.0 - 5f64.sqrt());
                let z = (2.0 * f64::from(i) + 1.0) / f64::from(N_LOOKS) - 1.0;
                let (sin, cos) = (f64::from(i) * golden_angle).sin_cos();
                let r = (1.0 - z * z).sqrt();
                let d = Vec3::from_f64(DVec3::new(r * cos, r * sin, z));
                self.medium_before_boundary(Ray { o: p, d, time })
            })
            .collect()
    }

    /// The medium on the near side of the first boundary that a ray meets, past all other surfaces.
    fn medium_before_boundary(&self, ray: Ray) -> Option<MediumId> {
        let media = |hit: &Hit| self.geometry(hit.target.geometry).media;
        let hit = self.closest_where(&ray, f32::INFINITY, |hit| media(hit).is_some())?;
        let place = self.place(&ray, &hit);
        if self.may_be_stacked(hit.target) {
            return self.medium_before_stack(&ray, &hit);
        }
        media(&hit).map(|interface| interface.toward(place.ng, -ray.d))
    }

    /// Unbiased estimate of the light that passes along a segment that starts in `medium`: through media and null
    /// surfaces, not through anything else. Afterwards `medium` is that at its end, if light passes. What it met is added to
    /// `tally`.
    pub fn transmittance_along(
        &self,
        segment: &Segment,
        medium: &mut MediumId,
        rng: &mut Rng,
        tally: &mut ShadowTally,
    ) -> Rgb {
        if let Some(cloud) = self.cloud_around(segment.ray.o, *medium) {
            return self.dimmed_past_walls(segment, cloud, rng, tally);
        }
        let Segment {
            mut ray, mut t_max, ..
        } = *segment;
        let mut tr = Rgb::ONE;
        let mut travelled = 0.0;
        let target = t_max.is_finite().then(|| ray.at(t_max));
        let counts = |travelled: f32, hit: &Hit| {
            let t = travelled + hit.at.t;
            let from_start = Hit {
                at: ElementHit { t, ..hit.at },
                ..*hit
            };
            self.stands_between(segment, &from_start)
        };
        // Every crossing leaves a surface behind; a ray that meets more of them than there are is stuck.
        for _ in 0..=self.max_crossings() {
            tally.rays += 1;
            if stop::is_requested_after(tally.rays) {
                return Rgb::BLACK;
            }
            let hit = self.closest_where(&ray, t_max, |hit| counts(travelled, hit));
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
                tr *= self.medium(*medium).transmittance(&ray, end, rng);
                if tr.is_black() {
                    return tr;
                }
            }
            let Some(hit) = hit else { return tr };
            let place = self.place(&ray, &hit);
            if self.may_be_stacked(hit.target)
                && self.is_stopped_in_stack(&ray, &hit, &place, |hit| counts(travelled, hit))
            {
                return Rgb::BLACK;
            }
            let (behind, n_mismatched) = self.medium_behind_null(&ray, &hit, &place, *medium);
            tally.mismatched += n_mismatched;
            *medium = behind;
            let met = ray.at(hit.at.t);
            ray = spawn_ray(place.p, place.p_err, place.n_surface, ray.d, ray.time);
            travelled += hit.at.t;
            // A point of a large surface may lie beside the ray by its rounding error. Aimed anew, the ray still
            // ends where it should; parallel to itself it could meet a small light elsewhere, or miss it.
            if let Some(target) = target {
                let to_target = target - ray.o;
                if to_target.dot(ray.d) <= 0.0 {
                    return tr;
                }
                t_max = to_target.length();
                // What is nearer than the ray was moved lies in the same place as what it passed.
                if self.may_be_stacked(hit.target) && t_max <= (ray.o - met).length() {
                    return tr;
                }
                ray.d = to_target / t_max;
            }
        }
        tally.stuck += 1;
        Rgb::BLACK
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{LightId, MaterialId, ObjectId};
    use crate::light::Wanted;
    use crate::math::Transform;
    use crate::shape::quadric::{Form, Sphere};
    use crate::shape::{Quadric, Shape};
    use crate::world::{Cutout, Geometry, Receiver, WorldParts};

    #[test]
    fn v19_shadow_rays_that_cross_more_than_there_is_are_black_and_counted() {
        let sphere = Sphere::new(1.0, -1.0, 1.0, std::f64::consts::TAU);
        let shell = Geometry {
            shape: Shape::Quadric(Quadric::new(
                Form::Sphere(sphere),
                Transform::IDENTITY,
                false,
            )),
            material: MaterialId::NONE,
            media: None,
            cutout: Cutout::default(),
            first_light: LightId::NONE,
            object: ObjectId::NONE,
        };
        let mut world = World::new(WorldParts {
            geometries: vec![shell],
            ..WorldParts::default()
        });
        let eye = Receiver {
            p: Point3::new(0.0, 0.1, -3.0),
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wanted: Wanted::All,
            time: 0.0,
        };
        let segment = Segment::to_infinity(&eye, Vec3::new(0.0, 0.0, 1.0));
        let mut rng = Rng::new(0);
        let mut tally = ShadowTally::default();
        let mut tr = |world: &World, tally: &mut ShadowTally| {
            let mut medium = MediumId::NONE;
            world.transmittance_along(&segment, &mut medium, &mut rng, tally)
        };
        assert_eq!(tr(&world, &mut tally), Rgb::ONE);
        assert_eq!((tally.rays, tally.stuck), (3, 0));
        // No straight ray meets more surfaces than there are; so the world has to be wrong about their number.
        world.n_elements = 0;
        assert_eq!(tr(&world, &mut tally), Rgb::BLACK);
        assert_eq!((tally.rays, tally.stuck), (4, 1));
    }
}
