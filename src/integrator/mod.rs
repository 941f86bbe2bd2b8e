//! Light transport: the radiance along a camera ray. Knows the world; knows no film, no files, no threads.

pub mod ambient_occlusion;
pub mod bdpt;
pub mod direct;
mod direct_light;
mod fog;
pub mod footprint;
pub mod mlt;
pub mod path;
pub mod sppm;
pub mod subsurface;
pub mod trace;
mod visible;

use crate::camera::RayDifferential;
use crate::ids::{GeometryId, MediumId};
use crate::math::{Normal3, Ray, Vec3};
use crate::sampler::Sampler;
use crate::spectrum::Rgb;
use crate::stop;
use crate::world::{Hit, ShadowTally, World};
pub use ambient_occlusion::AmbientOcclusion;
pub use bdpt::Bdpt;
pub use direct::{Direct, LightSampling};
pub use mlt::Mlt;
pub use path::Path;
pub use sppm::Sppm;
use trace::Observer;

/// A light transport algorithm.
#[derive(Clone, Copy, Debug)]
pub enum Integrator {
    /// Surfaces only; media are ignored.
    Path(Path),
    /// Surfaces and media.
    VolPath(Path),
    /// Surfaces only, light from lights in photons; media are ignored.
    Sppm(Sppm),
    /// Direct light, seen in mirrors and through glass; media are ignored.
    Direct(Direct),
    /// How open the hemisphere is.
    AmbientOcclusion(AmbientOcclusion),
    /// Surfaces and media, from both ends.
    Bdpt(Bdpt),
    /// The same by Markov chains.
    Mlt(Mlt),
}

/// Events of the inner loop, counted by each worker and added up at the end.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counters {
    /// Rays that looked for the nearest surface.
    pub rays: u64,
    /// On the way to lights.
    pub shadow: ShadowTally,
    /// Collisions with a medium that scattered.
    pub medium_scatterings: u64,
    /// Paths given up because they crossed more null surfaces, or surfaces that cast no shadow, in a row than a straight
    /// ray can meet.
    pub stuck_paths: u64,
    /// Rays of paths that left the scene in a medium that has walls all around: 0 unless a boundary is open.
    pub leaked_paths: u64,
    /// Null surfaces that paths crossed from a medium they do not border on: 0 unless media overlap, the medium around
    /// the camera is declared wrongly, or a boundary is open.
    pub mismatched_media: u64,
    /// Paths that met a surface that scatters from a medium which it does not border on: they leave it into another one,
    /// as if there were a boundary. 0 unless media are declared on one side of surfaces only.
    pub one_sided: u64,
    /// The first of these in the order of the scene.
    pub first_one_sided: Option<GeometryId>,
}

impl Counters {
    /// Counts a ray that looks for the nearest surface. True if the path is to be given up, which is asked now and then;
    /// whoever follows it drops it then.
    #[inline]
    #[must_use]
    pub fn next_ray(&mut self) -> bool {
        self.rays += 1;
        stop::is_requested_after(self.rays)
    }

    /// Null surfaces that anything crossed from a medium they do not border on.
    pub fn mismatched(&self) -> u64 {
        self.mismatched_media + self.shadow.mismatched
    }

    /// Counts a surface that scatters and borders on another medium than the one a path is in that meets it along `d`.
    /// What the path meets from there on says nothing more: whether that was so before is `is_misled`.
    #[inline]
    pub(crate) fn meet(
        &mut self,
        world: &World,
        (hit, ng): (&Hit, Normal3),
        d: Vec3,
        medium: MediumId,
        is_misled: &mut bool,
    ) {
        if !*is_misled && !world.borders_on(hit.target, ng, d, medium) {
            *is_misled = true;
            self.one_sided += 1;
            self.note_one_sided(Some(hit.target.geometry));
        }
    }

    fn note_one_sided(&mut self, geometry: Option<GeometryId>) {
        let both = [self.first_one_sided, geometry];
        self.first_one_sided = both.into_iter().flatten().min();
    }

    /// Adds the counts of another worker.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        self.shadow.add(&other.shadow);
        self.medium_scatterings += other.medium_scatterings;
        self.stuck_paths += other.stuck_paths;
        self.leaked_paths += other.leaked_paths;
        self.mismatched_media += other.mismatched_media;
        self.one_sided += other.one_sided;
        self.note_one_sided(other.first_one_sided);
    }
}

impl Integrator {
    /// Whether an observer is told what happens along a path.
    pub fn is_observable(&self) -> bool {
        matches!(self, Self::Path(_) | Self::VolPath(_))
    }

    /// Whether the camera sees lights directly, as [`World::light_seen`] tells: a part of what [`Self::li`] finds.
    pub fn sees_lights_directly(&self, world: &World) -> bool {
        let facts = world.facts();
        match self {
            Self::VolPath(_) => !facts.has_media && !facts.has_null_surfaces,
            Self::Path(_) | Self::Direct(_) => !facts.has_null_surfaces,
            Self::Sppm(_) | Self::AmbientOcclusion(_) | Self::Bdpt(_) | Self::Mlt(_) => false,
        }
    }

    /// Most scattering events of paths that are followed from lights; `None` where none are.
    pub fn depth_of_light_paths(&self) -> Option<u32> {
        match self {
            Self::Bdpt(bdpt) => Some(bdpt.max_depth),
            Self::Mlt(mlt) => Some(mlt.max_depth),
            Self::Sppm(sppm) => Some(sppm.max_depth),
            Self::Path(_) | Self::VolPath(_) | Self::Direct(_) | Self::AmbientOcclusion(_) => None,
        }
    }

    /// Whether light is drawn for surfaces by their normals.
    pub fn asks_by_normals(&self) -> bool {
        matches!(
            self,
            Self::Path(_) | Self::VolPath(_) | Self::Sppm(_) | Self::Direct(_)
        )
    }

    /// Whether light is drawn for points in media, by what comes through to them.
    pub fn asks_within_media(&self) -> bool {
        matches!(self, Self::VolPath(_))
    }

    /// The path tracer that renders a scene with media.
    pub fn volumetric(&self) -> Option<&Path> {
        match self {
            Self::VolPath(path) => Some(path),
            _ => None,
        }
    }

    /// Radiance that arrives along a camera ray: of photon mapping, the part that needs no photons; of Markov chains,
    /// what they converge to. An observer changes no bit of it, and is told how it comes about if the integrator
    /// [can tell](Self::is_observable).
    pub fn li(
        &self,
        world: &World,
        ray: Ray,
        differential: Option<&RayDifferential>,
        sampler: &mut Sampler,
        counters: &mut Counters,
        observer: &mut impl Observer,
    ) -> Rgb {
        match self {
            Self::Path(path) => {
                path.li::<false, _>(world, ray, differential, sampler, counters, observer)
            }
            // Without media, null surfaces and shadow masks the two are the same, and the simpler one is faster.
            Self::VolPath(path)
                if !world.facts().has_media
                    && !world.facts().has_null_surfaces
                    && !world.facts().has_shadow_holes =>
            {
                path.li::<false, _>(world, ray, differential, sampler, counters, observer)
            }
            Self::VolPath(path) => {
                path.li::<true, _>(world, ray, differential, sampler, counters, observer)
            }
            Self::Sppm(sppm) => {
                let path = sppm.camera_path(world, ray, differential, sampler, counters);
                path.radiance
            }
            Self::Direct(direct) => direct.li(world, ray, differential, sampler, counters),
            Self::AmbientOcclusion(ambient) => ambient.li(world, ray, sampler, counters),
            Self::Bdpt(bdpt) => bdpt.li(world, ray, differential, sampler, counters),
            Self::Mlt(mlt) => {
                let bdpt = mlt.without_chains();
                bdpt.li(world, ray, differential, sampler, counters)
            }
        }
    }
}
