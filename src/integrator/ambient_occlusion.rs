//! How open the hemisphere above each visible point is. Scene-file manual (`ambientocclusion`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer nsamples` | 64 | rays from each point |
//! | `bool cossample` | true | rays by cosine; false is all directions alike |
//! | `integer[4] pixelbounds` | film | pixels that are rendered |
//!
//! The value is the integral of the cosine over the directions that meet nothing, however far: π where nothing stands
//! in the way, as in pbrt-v3, and 0 where the camera sees no surface. Lights, materials and media do not matter; null
//! surfaces are looked through, but stand in the way of the rays from a point.

use std::f32::consts::PI;

use crate::integrator::Counters;
use crate::integrator::visible::nearest_visible;
use crate::math::{Frame, Ray, Vec3};
use crate::sampler::Sampler;
use crate::sampling::warp::{UNIFORM_HEMISPHERE_PDF, cosine_hemisphere, uniform_hemisphere};
use crate::spectrum::Rgb;
use crate::world::{World, spawn_ray};

/// Settings of ambient occlusion.
#[derive(Clone, Copy, Debug)]
pub struct AmbientOcclusion {
    /// Rays from each point, at least 1.
    pub n_samples: u32,
    /// Directions are drawn by cosine instead of uniformly.
    pub by_cosine: bool,
}

impl AmbientOcclusion {
    /// The integral of the cosine over what is open, in [0, π], on all channels.
    pub fn li(
        &self,
        world: &World,
        mut ray: Ray,
        sampler: &mut Sampler,
        counters: &mut Counters,
    ) -> Rgb {
        let Some(seen) = nearest_visible(world, &mut ray, counters) else {
            return Rgb::BLACK;
        };
        let surface = &seen.surface;
        let frame = Frame::from_z(Vec3::from(surface.ng).face_forward(-ray.d));
        let points = sampler.array(self.n_samples);
        let mut sum = 0.0;
        for i in 0..self.n_samples {
            let u = points.get_2d(i);
            // Cosine over density.
            let (local, value) = if self.by_cosine {
                (cosine_hemisphere(u), PI)
            } else {
                let local = uniform_hemisphere(u);
                (local, local.z() / UNIFORM_HEMISPHERE_PDF)
            };
            let wi = frame.to_world(local);
            let open = spawn_ray(surface.p, surface.p_err, surface.ng, wi, ray.time);
            counters.shadow.rays += 1;
            if !world.is_blocked(&open) {
                sum += f64::from(value);
            }
        }
        Rgb::splat((sum / f64::from(self.n_samples)) as f32)
    }
}
