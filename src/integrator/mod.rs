//! Light transport: the radiance along a camera ray. Knows the world; knows no film, no files, no threads.

pub mod ambient_occlusion;
pub mod bdpt;
pub mod direct;
mod direct_light;
pub mod footprint;
pub mod mlt;
pub mod path;
pub mod sppm;
pub mod subsurface;
mod visible;

use crate::camera::RayDifferential;
use crate::math::Ray;
use crate::sampler::Sampler;
use crate::spectrum::Rgb;
use crate::world::{LightStrategy, World};
pub use ambient_occlusion::AmbientOcclusion;
pub use bdpt::Bdpt;
pub use direct::{Direct, LightSampling};
pub use mlt::Mlt;
pub use path::Path;
pub use sppm::Sppm;

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
    /// Rays that looked for light.
    pub shadow_rays: u64,
    /// Collisions with a medium that scattered.
    pub medium_scatterings: u64,
    /// Paths given up because they crossed more null surfaces in a row than a straight ray can meet.
    pub stuck_paths: u64,
    /// Paths that left the scene in a medium that has walls all around: 0 unless a boundary is open.
    pub leaked_paths: u64,
}

impl Counters {
    /// Adds the counts of another worker.
    pub fn add(&mut self, other: &Self) {
        self.rays += other.rays;
        self.shadow_rays += other.shadow_rays;
        self.medium_scatterings += other.medium_scatterings;
        self.stuck_paths += other.stuck_paths;
        self.leaked_paths += other.leaked_paths;
    }
}

impl Integrator {
    /// Radiance that arrives along a camera ray; of photon mapping, the part that needs no photons.
    pub fn li(
        &self,
        world: &World,
        ray: Ray,
        differential: Option<&RayDifferential>,
        sampler: &mut Sampler,
        counters: &mut Counters,
    ) -> Rgb {
        match self {
            Self::Path(path) => path.li::<false>(world, ray, differential, sampler, counters),
            // Without media, null surfaces and shadow masks the two are the same, and the simpler one is faster.
            Self::VolPath(path)
                if !world.facts().has_media
                    && !world.facts().has_null_surfaces
                    && !world.facts().has_shadow_holes =>
            {
                path.li::<false>(world, ray, differential, sampler, counters)
            }
            Self::VolPath(path) => path.li::<true>(world, ray, differential, sampler, counters),
            Self::Sppm(sppm) => {
                let path = sppm.camera_path(world, ray, differential, sampler, counters);
                path.radiance
            }
            Self::Direct(direct) => direct.li(world, ray, differential, sampler, counters),
            Self::AmbientOcclusion(ambient) => ambient.li(world, ray, sampler, counters),
            Self::Bdpt(bdpt) => bdpt.li(world, ray, sampler, counters),
            // A single ray needs no chain: what chains estimate is what they visit.
            Self::Mlt(mlt) => {
                let light_strategy = LightStrategy::Power;
                let max_depth = mlt.max_depth;
                let bdpt = Bdpt {
                    max_depth,
                    light_strategy,
                    visualized: None,
                };
                bdpt.li(world, ray, sampler, counters)
            }
        }
    }
}
