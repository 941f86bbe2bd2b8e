//! Where light is worth sending from far away, and from points (see [`super::guide`]).
//!
//! Whatever light path brings anything to the picture meets its first surface where a camera path could have ended. Some
//! camera paths that are no part of the picture are followed before it is begun, and most light is sent to a sphere around
//! the places they get to: what is out of sight does not make it wider. All other lines keep a density, so that pictures
//! converge to the same whatever was found.

use glam::DVec3;

use crate::camera::{Camera, CameraSample};
use crate::ids::LightId;
use crate::integrator::bdpt::{Emitters, Numbers, Tracer};
use crate::light::Light;
use crate::sampling::rng::Rng;
use crate::world::{LightStrategy, World};

/// Camera paths along either side of the frame.
const SIDE: u32 = 64;
/// Scattering events after which a path has been where light is wanted the most.
const MAX_DEPTH: u32 = 4;
/// Places that must lie around their middle before others are given up, and how many times as far away those are.
const CENTRAL: f64 = 0.998;
const MARGIN: f64 = 1.5;
/// How much wider than what some paths get to the sphere is, for what others will.
const ROOM: f64 = 1.05;

impl Numbers for Rng {
    fn get_1d(&mut self) -> f32 {
        self.uniform()
    }
    fn get_1d_fine(&mut self) -> f64 {
        self.uniform_fine()
    }
    fn get_2d(&mut self) -> [f32; 2] {
        [self.uniform(), self.uniform()]
    }
}

/// Lets a world send light from far away to where paths of up to `max_depth` scattering events from the camera get to, in a
/// frame of `resolution` pixels.
pub fn aim_light(world: &mut World, camera: &Camera, resolution: [u32; 2], max_depth: u32) {
    let is_aimed = |i| {
        let light = world.light(LightId::new(i));
        matches!(light, Light::Distant(_) | Light::Infinite(_)) || light.position().is_some()
    };
    if !(0..world.n_lights()).any(is_aimed) {
        return;
    }
    if let Some((center, radius)) = sphere_around(&places(world, camera, resolution, max_depth)) {
        world.aim_far_light(center, radius);
    }
}

/// Where camera paths scatter.
fn places(world: &World, camera: &Camera, resolution: [u32; 2], max_depth: u32) -> Vec<DVec3> {
    let emitters = Emitters::new(world, LightStrategy::Uniform);
    let mut tracer = Tracer::new(world, &emitters, None, max_depth.min(MAX_DEPTH));
    let mut places = Vec::new();
    for i in 0..SIDE * SIDE {
        let mut rng = Rng::new(i.into());
        let cell = [i % SIDE, i / SIDE];
        let sample = CameraSample {
            raster: [0, 1].map(|axis| {
                let place = (f64::from(cell[axis]) + rng.uniform_fine()) / f64::from(SIDE);
                place * f64::from(resolution[axis])
            }),
            time: rng.uniform(),
            lens: rng.get_2d(),
        };
        if let Some(seen) = camera.ray(&sample) {
            tracer.start(seen.ray.time, rng.next_u64());
            tracer.trace_camera_to(tracer.max_depth + 1, false, seen.ray, None, &mut rng);
            places.extend(
                tracer
                    .camera_path
                    .iter()
                    .skip(1)
                    .map(|vertex| vertex.p.to_f64()),
            );
        }
    }
    places
}

/// A sphere around all places but a few that are far from the others. `None` if there are no places.
fn sphere_around(places: &[DVec3]) -> Option<(DVec3, f64)> {
    if places.is_empty() {
        return None;
    }
    let quantile = |mut values: Vec<f64>, share: f64| {
        let index = (share * (values.len() - 1) as f64) as usize;
        *values.select_nth_unstable_by(index, f64::total_cmp).1
    };
    let median = |axis: usize| quantile(places.iter().map(|p| p[axis]).collect(), 0.5);
    let middle = DVec3::new(median(0), median(1), median(2));
    let distances = places.iter().map(|p| p.distance(middle)).collect();
    let limit = MARGIN * quantile(distances, CENTRAL);
    let kept = || places.iter().filter(|p| p.distance(middle) <= limit);
    let (min, max) = kept().fold((middle, middle), |(min, max), &p| (min.min(p), max.max(p)));
    let center = 0.5 * (min + max);
    let radius = kept().map(|p| p.distance(center)).fold(0.0, f64::max);
    Some((center, ROOM * radius))
}
