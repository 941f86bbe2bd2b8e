//! Path tracing with next-event estimation, on surfaces and in media. Scene-file manual (`path`, `volpath`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer maxdepth` | 5 | scattering events; 0 shows emitters only |
//! | `float rrthreshold` | 1 | Russian roulette below 0.2 of this throughput, in media below 0.5; 0 never |
//! | `string lightsamplestrategy` | `spatial` | how a light is chosen |
//! | `integer[4] pixelbounds` | film | pixels that are rendered |
//!
//! The integrand is pbrt-v3's. The estimator differs: the continuation of the path serves as the second half of
//! multiple importance sampling, so that each vertex costs one shadow ray, but for the first in a cloud.
//! Russian roulette waits until that half has found its light; from the second scattering on it is played when little is
//! left, whatever the number of bounces. Where surfaces send on more than they receive, paths are split.

mod forks;
mod junction;
mod state;

use arrayvec::ArrayVec;

use crate::camera::RayDifferential;
use crate::ids::MediumId;
use crate::integrator::Counters;
use crate::integrator::fog::FogSegment;
use crate::integrator::footprint::texture_context;
use crate::integrator::trace::{Event, Observer};
use crate::math::Ray;
use crate::medium::MediumEvent;
use crate::sampler::Sampler;
use crate::scatter::Bsdf;
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::world::{Hit, World};
use forks::MAX_ADDED_WAYS;
pub use junction::{Found, Junction};
pub(super) use state::stay_inside;
use state::{Origin, State};

/// Settings of the path tracers.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// Scattering events.
    pub max_depth: u32,
    /// Russian roulette begins below this throughput.
    pub rr_threshold: f32,
}

/// In media Russian roulette begins below this part of the threshold. Measured: at 1 and after four bounces, as in
/// pbrt-v3, paths in clouds of albedo 0.9 end too early (a quarter more squared error for a fifth less time), and those in
/// smoke of albedo 0.1 go on for nothing (half more time). Within a few percent the same between 0.4 and 0.6.
const ROULETTE_IN_MEDIA: f32 = 0.5;
/// The same at surfaces. Phase functions find light that is nearly even; lobes find suns and lamps by chance, and where
/// roulette has added to the weight of such paths, they are spots in dark places. Measured at 0.25 and 0.15 against 0.5: an
/// eighth to a quarter less relative squared error in four scenes, for 2 to 9 % and 3 to 16 % more rays.
const ROULETTE_AT_SURFACES: f32 = 0.2;
/// The same where a surface is a mirror or smooth glass: a path that goes on costs one ray, without light samples, and no
/// other finds its light.
const ROULETTE_AT_MIRRORS: f32 = 0.02;
/// Why a path of no throughput ends.
const NOTHING_LEFT: &str = "nothing is left of it";
/// Why a path ends that has been followed far enough.
const AT_MAX_DEPTH: &str = "it has scattered as often as it may";

/// Whether a path has scattered at a place before.
#[derive(Clone, Copy)]
enum Arrival {
    /// Not yet; it may end there, or fork if there is anything to find behind the next vertex.
    First { may_fork: bool },
    /// It follows another of its ways.
    Again,
}

/// What became of a path in a medium.
enum Flight {
    Scattered,
    Passed,
    Ended,
}

impl Path {
    /// Radiance along a camera ray: all that [`Path::find`] does.
    pub fn li<const VOLUMETRIC: bool, O: Observer>(
        &self,
        world: &World,
        ray: Ray,
        differential: Option<&RayDifferential>,
        sampler: &mut Sampler,
        counters: &mut Counters,
        observer: &mut O,
    ) -> Rgb {
        self.find::<VOLUMETRIC, _>(world, ray, differential, sampler, counters, observer)
            .total()
    }

    /// What a path along a camera ray finds. `VOLUMETRIC` heeds media and lets light sampling pass null surfaces; without it
    /// both are as in pbrt-v3's `path`: media do not exist, null surfaces block light sampling. `observer` is told
    /// what happens.
    pub fn find<const VOLUMETRIC: bool, O: Observer>(
        &self,
        world: &World,
        ray: Ray,
        differential: Option<&RayDifferential>,
        sampler: &mut Sampler,
        counters: &mut Counters,
        observer: &mut O,
    ) -> Found {
        let rng = sampler.stream();
        let declared = world.camera_medium();
        let cloud = VOLUMETRIC
            .then(|| world.cloud_around(ray.o, declared))
            .flatten();
        let mut state = State {
            world,
            sampler,
            counters,
            observer,
            rng,
            ray,
            medium: if VOLUMETRIC {
                cloud.unwrap_or(declared)
            } else {
                MediumId::NONE
            },
            is_misled: false,
            past_walls: cloud.is_some(),
            is_clear: false,
            origin: Origin::Certain,
            radiance: Rgb::BLACK,
            may_be_joined: cloud.is_some() && world.shared_cloud().is_some(),
            junction: None,
            radiance_before: Rgb::BLACK,
            beta: Rgb::ONE,
            eta_scale: 1.0,
            bounces: 0,
            sent_first: None,
            forks: ArrayVec::new(),
            ways_left: MAX_ADDED_WAYS,
        };
        // The first flight in a medium that scatters is drawn by the sampler, at the same place among its numbers for all paths.
        let has_media = VOLUMETRIC && world.facts().has_media;
        let mut first_depth = has_media.then(|| state.sampler.get_exponential());
        self.follow::<VOLUMETRIC, _>(&mut state, differential, &mut first_depth);
        while let Some(hit) = state.take_waiting() {
            let surface = world.surface(&state.ray, &hit);
            if self.scatter::<VOLUMETRIC, _>(&mut state, &hit, &surface, None, Arrival::Again) {
                self.follow::<VOLUMETRIC, _>(&mut state, None, &mut first_depth);
            }
        }
        state.found()
    }

    /// Follows a path along its ray until it ends. `first_depth` is the optical depth of its first flight in a medium
    /// that scatters, if that is still to come.
    fn follow<const VOLUMETRIC: bool, O: Observer>(
        &self,
        state: &mut State<'_, O>,
        mut differential: Option<&RayDifferential>,
        first_depth: &mut Option<f32>,
    ) {
        let world = state.world;
        let mut crossings = 0;
        loop {
            if state.counters.next_ray() {
                break;
            }
            state.see(|state| Event::Segment {
                ray: state.ray,
                medium: state.medium,
                beta: state.beta,
            });
            // What a path meets amid a cloud is known only when it has left it.
            let is_clear = VOLUMETRIC && std::mem::take(&mut state.is_clear);
            if is_clear {
                match self.fly(state, None, None) {
                    Flight::Scattered => {
                        (differential, crossings) = (None, 0);
                        continue;
                    }
                    Flight::Passed => {}
                    Flight::Ended => break,
                }
            }
            // A last ray that light sampling does not vouch for ends at a wall, as at any null surface.
            let is_last = state.bounces >= self.max_depth;
            let ends_at_walls = is_last && matches!(state.origin, Origin::Certain);
            let hit = if VOLUMETRIC && state.past_walls && !ends_at_walls {
                world.closest_past_walls(&state.ray)
            } else {
                world.closest(&state.ray, f32::INFINITY)
            };

            if VOLUMETRIC && hit.is_none() && !state.past_walls && world.is_bounded(state.medium) {
                state.counters.leaked_paths += 1;
            }
            // In a medium the path may scatter before it meets a surface.
            if VOLUMETRIC && state.medium.is_some() && !is_clear {
                match self.fly(state, hit.as_ref(), Some(first_depth)) {
                    Flight::Scattered => {
                        (differential, crossings) = (None, 0);
                        continue;
                    }
                    Flight::Passed => {}
                    Flight::Ended => break,
                }
            }

            let Some(hit) = hit else {
                state.see(|_| Event::Left);
                state.add_environment();
                break;
            };
            let geometry = world.geometry(hit.target.geometry);
            let material = geometry.material;
            // A null surface only changes the medium. At the last bounce there is nothing behind it to find, except
            // for the continuation that stands for the second half of the light sampling at the vertex before.
            let is_crossed = !material.is_some()
                && (!is_last || VOLUMETRIC && matches!(state.origin, Origin::Drawn { .. }));
            if is_crossed {
                let place = world.place(&state.ray, &hit);
                state.see(|_| Event::met(&hit, &place, material));
                if geometry.first_light.is_some() {
                    let surface = world.surface(&state.ray, &hit);
                    state.add_emission(&hit, &surface);
                }
                crossings += 1;
                if crossings > world.max_crossings() {
                    state.counters.stuck_paths += 1;
                    state.end("it is stuck between null surfaces");
                    break;
                }
                state.cross::<VOLUMETRIC>(&hit, &place);
                differential = None;
                continue;
            }
            let surface = world.surface(&state.ray, &hit);
            state.see(|_| Event::met(&hit, &surface.into(), material));
            state.add_emission(&hit, &surface);
            if is_last {
                state.end(AT_MAX_DEPTH);
                break;
            }
            crossings = 0;

            // Footprints are not known behind null surfaces, as in pbrt-v3.
            let passes_wall = || state.past_walls && world.passes_wall(&state.ray, hit.at.t);
            let footprint = differential.take().filter(|_| !passes_wall());
            let arrival = Arrival::First {
                may_fork: state.bounces + 1 < self.max_depth,
            };
            if !self.scatter::<VOLUMETRIC, _>(state, &hit, &surface, footprint, arrival) {
                break;
            }
        }
    }

    /// Scatters at a surface that was met. False where the path ends.
    fn scatter<const VOLUMETRIC: bool, O: Observer>(
        &self,
        state: &mut State<'_, O>,
        hit: &Hit,
        surface: &SurfacePoint,
        footprint: Option<&RayDifferential>,
        arrival: Arrival,
    ) -> bool {
        let world = state.world;
        let material = world.geometry(hit.target.geometry).material;
        let ctx = texture_context(surface, footprint);
        let (materials, textures) = (world.materials(), world.textures());
        let frame = materials.shading_frame(material, surface, &ctx, textures);
        let mut bsdf = Bsdf::new(frame, surface.ng);
        materials.add_lobes(material, &ctx, textures, &mut bsdf);
        if let Arrival::First { may_fork } = arrival {
            let below = if bsdf.has_non_specular() {
                ROULETTE_AT_SURFACES
            } else {
                ROULETTE_AT_MIRRORS
            };
            if !self.survives(state, below) {
                return false;
            }
            if may_fork {
                state.fork(hit, &bsdf);
            }
        }
        if !state.scatter_at_surface::<VOLUMETRIC>(material, hit, surface, &ctx, &bsdf) {
            state.end("nothing is scattered any further");
            return false;
        }
        if !VOLUMETRIC && world.facts().has_shadow_holes {
            state.look_for_light();
        }
        true
    }

    /// Flies on in the current medium, to the surface at `hit` if there is one.
    #[inline(always)]
    fn fly<O: Observer>(
        &self,
        state: &mut State<'_, O>,
        hit: Option<&Hit>,
        first_depth: Option<&mut Option<f32>>,
    ) -> Flight {
        let world = state.world;
        let t_max = hit.map_or(f32::INFINITY, |hit| hit.at.t);
        let medium = world.medium(state.medium);
        let fog = FogSegment::new(world, medium, &state.ray, t_max, state.beta);
        if let Some(fog) = &fog
            && state.bounces < self.max_depth
        {
            state.light_fog(fog, hit);
        }
        let depth = first_depth.and_then(|depth| depth.take_if(|_| medium.scatters()));
        // Where it will not scatter any more, there is nothing to throw dice for.
        let event = if state.bounces >= self.max_depth {
            let weight = medium.transmittance(&state.ray, t_max, &mut state.rng);
            MediumEvent::Pass { weight }
        } else {
            medium.sample(&state.ray, t_max, state.beta, depth, &mut state.rng)
        };
        match event {
            MediumEvent::Pass { weight } => {
                state.beta *= weight;
                state.see(|_| Event::Passed { weight });
                if state.beta.is_black() {
                    state.end(NOTHING_LEFT);
                    return Flight::Ended;
                }
                Flight::Passed
            }
            MediumEvent::Scatter { t, weight } => {
                // Roulette is about what arrives: the albedo is still to come, as at surfaces.
                if !self.survives(state, ROULETTE_IN_MEDIA) {
                    return Flight::Ended;
                }
                state.beta *= weight;
                if state.beta.is_black() {
                    state.end(NOTHING_LEFT);
                    return Flight::Ended;
                }
                state.counters.medium_scatterings += 1;
                let t = hit.map_or(t, |hit| stay_inside(world, &state.ray, t, hit));
                state.see(|_| Event::Collided { t, weight });
                state.scatter_in_medium(t, medium.phase(), fog.as_ref());
                Flight::Scattered
            }
        }
    }

    /// Russian roulette before the path scatters once more; survivors carry the energy of the others. What the camera sees
    /// through an absorber is dark as a whole: it is not what other paths leave over. Roulette begins `below` that part of
    /// the threshold.
    #[inline]
    fn survives<O: Observer>(&self, state: &mut State<'_, O>, below: f32) -> bool {
        if state.bounces == 0 {
            return true;
        }
        let level = below * self.rr_threshold;
        let carried = state.carried();
        if !(carried < level) {
            return true;
        }
        let p_survive = carried / level;
        // Not a number of the sampler: where paths end is nothing to be stratified.
        if !(state.rng.uniform() < p_survive) {
            state.end("Russian roulette");
            return false;
        }
        state.beta *= 1.0 / p_survive;
        state.see(|_| Event::Survived {
            p_end: 1.0 - p_survive,
        });
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{LightId, MaterialId, ObjectId};
    use crate::integrator::trace::Unobserved;
    use crate::light::{InfiniteLight, Light};
    use crate::math::{Point3, Transform, Vec3};
    use crate::medium::{Homogeneous, Medium};
    use crate::scatter::HenyeyGreenstein;
    use crate::shape::quadric::{Form, Sphere};
    use crate::shape::{Quadric, Shape};
    use crate::world::{Cutout, Geometry, MediumInterface, WorldParts};

    #[test]
    fn v19_nested_null_surfaces_are_passed_as_often_as_they_are_met() {
        let shell = |radius: f64| {
            let sphere = Sphere::new(radius, -radius, radius, std::f64::consts::TAU);
            Geometry {
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
            }
        };
        let world = World::new(WorldParts {
            geometries: [1.0, 0.75, 0.5, 0.5].map(shell).into(),
            lights: vec![Light::Infinite(Box::new(InfiniteLight::constant(Rgb::ONE)))],
            ..WorldParts::default()
        });
        let path = Path {
            max_depth: 1,
            rr_threshold: 1.0,
        };
        let ray = Ray {
            o: Point3::new(0.0, 0.1, -3.0),
            d: Vec3::new(0.0, 0.0, 1.0),
            time: 0.0,
        };
        let mut counters = Counters::default();
        let mut sampler = Sampler::new(0, [0, 0], 0);
        let radiance = path.li::<true, _>(
            &world,
            ray,
            None,
            &mut sampler,
            &mut counters,
            &mut Unobserved,
        );
        assert_eq!((radiance, counters.stuck_paths), (Rgb::ONE, 0));
    }

    #[test]
    fn flights_behind_what_only_absorbs_are_as_even_as_first_ones() {
        let (absorber, scatterer) = (MediumId::new(0), MediumId::new(1));
        let sphere = Sphere::new(1.0, -1.0, 1.0, std::f64::consts::TAU);
        let homogeneous = |sigma_a: f32, sigma_s: f32| {
            Medium::Homogeneous(Homogeneous::new(
                Rgb::splat(sigma_a),
                Rgb::splat(sigma_s),
                HenyeyGreenstein { g: 0.0 },
            ))
        };
        let world = World::new(WorldParts {
            geometries: vec![Geometry {
                shape: Shape::Quadric(Quadric::new(
                    Form::Sphere(sphere),
                    Transform::IDENTITY,
                    false,
                )),
                material: MaterialId::NONE,
                media: Some(MediumInterface {
                    inside: scatterer,
                    outside: absorber,
                }),
                cutout: Cutout::default(),
                first_light: LightId::NONE,
                object: ObjectId::NONE,
            }],
            media: vec![homogeneous(0.1, 0.0), homogeneous(0.0, 0.5)],
            camera_medium: absorber,
            ..WorldParts::default()
        });
        let path = Path {
            max_depth: 1,
            rr_threshold: 0.0,
        };
        let ray = Ray {
            o: Point3::new(0.0, 0.0, -3.0),
            d: Vec3::new(0.0, 0.0, 1.0),
            time: 0.0,
        };
        let n = 1024;
        let expected = n as f64 * (1.0 - (-1f64).exp());
        for pixel in 0..8 {
            let mut counters = Counters::default();
            for sample in 0..n {
                let mut sampler = Sampler::new(0, [pixel, 0], sample);
                path.li::<true, _>(
                    &world,
                    ray,
                    None,
                    &mut sampler,
                    &mut counters,
                    &mut Unobserved,
                );
            }
            // By chance it would be 15 off.
            let off = (counters.medium_scatterings as f64 - expected).abs();
            assert!(off <= 2.0, "pixel {pixel}: {off} off");
        }
    }
}
