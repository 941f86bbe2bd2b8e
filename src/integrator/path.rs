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
//! multiple importance sampling, so that each vertex costs one shadow ray, but for
//! the first in a cloud. Russian roulette waits until that half has
//! found its light; from the second scattering on it is played when little is left, whatever the number of bounces. Where
//! surfaces send on more than they receive, paths are split.

use arrayvec::ArrayVec;

use crate::camera::RayDifferential;
use crate::ids::{LightId, MaterialId, MediumId};
use crate::integrator::Counters;
use crate::integrator::fog::FogSegment;
use crate::integrator::footprint::texture_context;
use crate::integrator::subsurface::{Entry, sample_exit};
use crate::integrator::trace::{Event, Observer};
use crate::light::Wanted;
use crate::math::error::EPSILON;
use crate::math::{Frame, Normal3, Point3, Ray, Vec3};
use crate::medium::MediumEvent;
use crate::sampler::Sampler;
use crate::sampling::mis::Heuristic;
use crate::sampling::rng::Rng;
use crate::scatter::{Bsdf, Bxdf, HenyeyGreenstein, TransportMode};
use crate::shape::{Place, SurfacePoint};
use crate::spectrum::Rgb;
use crate::texture::TextureContext;
use crate::world::{Hit, LightSample, Receiver, World, spawn_ray};

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
/// Paths are split where they send on more than this many times what they did at first: at surfaces of impossible albedo,
/// as those of `marble`. What conserves energy stays below.
const SPLIT_ABOVE: f32 = 2.0;
/// Most ways in which a path goes on from one place. Measured: 4 are as efficient as 16.
const MAX_WAYS: u32 = 8;
/// Most ways that are added to one path of the camera, so that albedos above 1 at many places do not multiply.
const MAX_ADDED_WAYS: u32 = 64;
/// Most places with ways that wait.
const MAX_FORKS: usize = 8;
/// Part of a path's extent within which a collision may touch the wall ahead by rounding, down to grazing angles of
/// 10⁻⁵.
const NEAR_WALL: f32 = 1e-2;
/// Why a path of no throughput ends.
const NOTHING_LEFT: &str = "nothing is left of it";
/// Why a path ends that has been followed far enough.
const AT_MAX_DEPTH: &str = "it has scattered as often as it may";

/// How the current ray came about, for weighing the emission it finds.
#[derive(Clone, Copy)]
enum Origin {
    /// From the camera or a specular bounce: light sampling cannot find what it finds.
    Certain,
    /// Drawn at a point with a density that light sampling competes with.
    Drawn { at: Receiver, pdf_w: f32 },
    /// Light was looked for by other rays, or the model lets none through.
    Hidden,
}

/// What a path from the camera finds, and where it may be joined by others: if its first collision is in a cloud.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Found {
    /// Radiance it brings along, but for what it finds from a [`Junction::second`] collision on.
    pub radiance: Rgb,
    /// Its first collisions in a cloud that [can be shared](World::shared_cloud).
    pub junction: Option<Junction>,
}

/// Where a path scatters in a cloud, coming from the camera.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Junction {
    /// First.
    pub first: Point3,
    /// If again after that: where, and the radiance that it finds from there on.
    pub second: Option<(Point3, Rgb)>,
}

impl Found {
    /// Nothing.
    pub const NOTHING: Self = Self {
        radiance: Rgb::BLACK,
        junction: None,
    };

    /// All that the path finds.
    pub fn total(&self) -> Rgb {
        let beyond = self.junction.and_then(|junction| junction.second);
        self.radiance + beyond.map_or(Rgb::BLACK, |(_, radiance)| radiance)
    }
}

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

/// A surface from where more ways of a path wait to be followed.
#[derive(Clone, Copy)]
struct Fork {
    /// The ray that arrives.
    ray: Ray,
    /// What it meets.
    hit: Hit,
    medium: MediumId,
    /// Throughput of each way.
    beta: Rgb,
    eta_scale: f32,
    bounces: u32,
    /// Ways that wait, at least one.
    n_waiting: u32,
}

struct State<'a, O> {
    world: &'a World,
    sampler: &'a mut Sampler,
    counters: &'a mut Counters,
    observer: &'a mut O,
    /// For loops of unknown length.
    rng: Rng,
    ray: Ray,
    medium: MediumId,
    /// The medium is that of a cloud, wherever the path is, from beginning to end: it does not ask for walls.
    past_walls: bool,
    /// The ray comes from a collision, and meets no surface before the next.
    is_clear: bool,
    origin: Origin,
    radiance: Rgb,
    /// The cloud's paths can be shared.
    may_be_joined: bool,
    /// Where it has, so far. From the second collision on `radiance` is that of its own, not this.
    junction: Option<Junction>,
    radiance_before: Rgb,
    beta: Rgb,
    /// Undoes, for Russian roulette, the change of throughput by refraction.
    eta_scale: f32,
    bounces: u32,
    /// What the first vertex that is no mirror sends on: roughly how bright the path may be for its pixel. `None` before.
    sent_first: Option<f32>,
    forks: ArrayVec<Fork, MAX_FORKS>,
    /// Ways that may still be added.
    ways_left: u32,
}

impl Path {
    /// What a path along a camera ray finds. `VOLUMETRIC` heeds media and lets light sampling pass null surfaces; without it
    /// both are as in pbrt-v3's `path`: media do not exist, null surfaces block light sampling. `observer` is told
    /// what happens.
    pub fn li<const VOLUMETRIC: bool, O: Observer>(
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
            state.counters.rays += 1;
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

impl<O: Observer> State<'_, O> {
    /// Tells the observer.
    #[inline(always)]
    fn see(&mut self, event: impl FnOnce(&Self) -> Event) {
        if O::LOOKS {
            let event = event(self);
            self.observer.see(event);
        }
    }

    /// Notes that the path scatters in a cloud at `p`.
    #[inline]
    fn note_junction(&mut self, p: Point3) {
        match (self.bounces, &mut self.junction) {
            (0, junction) => {
                *junction = Some(Junction {
                    first: p,
                    second: None,
                });
            }
            (1, Some(junction)) => {
                junction.second = Some((p, Rgb::BLACK));
                self.radiance_before = std::mem::replace(&mut self.radiance, Rgb::BLACK);
            }
            _ => {}
        }
    }

    /// What the path has found.
    fn found(&self) -> Found {
        let mut found = Found {
            radiance: self.radiance,
            junction: self.junction,
        };
        if let Some(Junction {
            second: Some((_, beyond)),
            ..
        }) = &mut found.junction
        {
            *beyond = self.radiance;
            found.radiance = self.radiance_before;
        }
        found
    }

    /// Tells the observer why the path ends.
    #[inline(always)]
    fn end(&mut self, why: &'static str) {
        self.see(|_| Event::Ended { why });
    }

    /// What the path carries, but for the change of radiance by refraction, which is undone where it comes out again.
    #[inline]
    fn carried(&self) -> f32 {
        (self.beta * self.eta_scale).max_component()
    }

    /// Goes on in several ways from a surface that sends on far more than the first one did: few paths meet it, and of
    /// those each would count for as much. All ways scatter by themselves and share the throughput; the others wait.
    #[inline]
    fn fork(&mut self, hit: &Hit, bsdf: &Bsdf) {
        let Some(sent_first) = self.sent_first else {
            return;
        };
        let most = (MAX_WAYS - 1).min(self.ways_left);
        if most == 0 || self.forks.is_full() {
            return;
        }
        let sent = self.carried() * bsdf.importance(-self.ray.d);
        let ways = sent / (SPLIT_ABOVE * sent_first.max(1.0));
        if !(ways > 1.0) {
            return;
        }
        // Beyond the range of integers all of `most`.
        let n_waiting = (ways.ceil() as u32 - 1).min(most);
        self.ways_left -= n_waiting;
        self.beta *= 1.0 / (n_waiting + 1) as f32;
        self.forks.push(Fork {
            ray: self.ray,
            hit: *hit,
            medium: self.medium,
            beta: self.beta,
            eta_scale: self.eta_scale,
            bounces: self.bounces,
            n_waiting,
        });
        self.see(|_| Event::Forked {
            n_ways: n_waiting + 1,
        });
    }

    /// Goes back to where a way waits, the latest first: what was met there. `None` if there is none.
    fn take_waiting(&mut self) -> Option<Hit> {
        let fork = self.forks.last_mut()?;
        fork.n_waiting -= 1;
        let Fork {
            ray,
            hit,
            medium,
            beta,
            eta_scale,
            bounces,
            n_waiting,
        } = *fork;
        if n_waiting == 0 {
            self.forks.pop();
        }
        (self.ray, self.medium, self.bounces) = (ray, medium, bounces);
        (self.beta, self.eta_scale) = (beta, eta_scale);
        self.see(|state| Event::Returned {
            p: state.ray.at(hit.at.t),
            beta,
        });
        Some(hit)
    }

    /// Adds the light of the environment to a path that leaves the scene.
    fn add_environment(&mut self) {
        let w = self.ray.d;
        let le = match self.origin {
            Origin::Certain => self.world.environment(w),
            Origin::Drawn { at, pdf_w } => {
                let heuristic = self.world.environment_heuristic();
                self.world
                    .environment_weighted(&at, w, |pdf_light| heuristic.weight(pdf_w, pdf_light))
            }
            Origin::Hidden => return,
        };
        self.find(LightId::NONE, le, 1.0);
    }

    /// Adds light that the path has found.
    fn find(&mut self, light: LightId, le: Rgb, weight: f32) {
        let added = self.beta * le * weight;
        self.radiance += added;
        self.see(|_| Event::Found {
            light,
            radiance: le * weight,
            added,
        });
    }

    /// Adds the emission of the surface the path has met.
    fn add_emission(&mut self, hit: &Hit, surface: &SurfacePoint) {
        let Some((light, le)) = self.world.emitted(hit, surface, -self.ray.d) else {
            return;
        };
        if le.is_black() {
            return;
        }
        let weight = match self.origin {
            Origin::Certain => 1.0,
            Origin::Drawn { at, pdf_w } => {
                let pdf_light = self.world.pdf_of_hit(light, hit, surface, &at);
                Heuristic::Power.weight(pdf_w, pdf_light)
            }
            Origin::Hidden => return,
        };
        self.find(light, le, weight);
    }

    /// The second half of the light sampling at the vertex, where it passes surfaces that cast no shadow: the
    /// continuation of the path meets them, and counts no light then.
    fn look_for_light(&mut self) {
        let Origin::Drawn { .. } = self.origin else {
            return;
        };
        let ray = self.ray;
        let mut passed = 0;
        loop {
            self.counters.rays += 1;
            let Some(hit) = self.world.closest(&self.ray, f32::INFINITY) else {
                self.add_environment();
                break;
            };
            let surface = self.world.surface(&self.ray, &hit);
            self.add_emission(&hit, &surface);
            if !self.world.casts_no_shadow(hit.target, &hit.at, &self.ray) {
                break;
            }
            passed += 1;
            if passed > self.world.max_crossings() {
                self.counters.stuck_paths += 1;
                break;
            }
            self.ray = spawn_ray(surface.p, surface.p_err, surface.ng, ray.d, ray.time);
        }
        self.ray = ray;
        self.origin = Origin::Hidden;
    }

    /// Goes on behind a null surface.
    fn cross<const VOLUMETRIC: bool>(&mut self, hit: &Hit, place: &Place) {
        let &Place { p, p_err, ng, .. } = place;
        let Ray { d, time, .. } = self.ray;
        if VOLUMETRIC {
            let borders = self.world.borders_on(hit.target, ng, d, self.medium);
            self.counters.mismatched_media += u64::from(!borders);
            self.medium = self.world.medium_toward(hit.target, ng, d, self.medium);
        } else if let Origin::Drawn { .. } = self.origin {
            self.origin = Origin::Hidden;
        }
        self.ray = spawn_ray(p, p_err, ng, d, time);
        self.see(|state| Event::Crossed {
            medium: state.medium,
        });
    }

    /// Adds light of a point that is scattered on the segment before the path goes on, at a distance of its own.
    fn light_fog(&mut self, fog: &FogSegment<'_>, hit: Option<&Hit>) {
        let (u_light, u) = (self.rng.uniform_fine(), self.rng.uniform());
        let (world, ray, medium) = (self.world, self.ray, self.medium);
        let place = |t| hit.map_or(t, |hit| stay_inside(world, &ray, t, hit));
        if let Some(light) = fog.sample(u_light, u, place) {
            self.see(|_| Event::Lit { t: light.t });
            self.add_light::<true>(&light.sample, light.f, light.weight, medium);
        }
    }

    /// Scatters in the current medium at distance `t`; `fog` is the segment if light of points is looked for along it.
    fn scatter_in_medium(&mut self, t: f32, phase: HenyeyGreenstein, fog: Option<&FogSegment<'_>>) {
        let p = self.ray.at(t);
        let wo = -self.ray.d;
        if self.may_be_joined {
            self.note_junction(p);
        }
        let (u_light, u) = (self.sampler.get_1d_fine(), self.sampler.get_2d());
        let at = Receiver {
            p,
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wanted: self.world.wanted_in(self.medium, p),
            time: self.ray.time,
        };
        // What is found at first is no other path's to share: it is looked for twice, at places far apart.
        // That depends on the world alone, so that it makes no difference who follows the path.
        let n_lights = if self.may_be_joined && self.bounces == 0 {
            2
        } else {
            1
        };
        let per_light = 1.0 / n_lights as f32;
        for k in 0..n_lights {
            let shift = k as f32 * per_light;
            let u_light = (u_light + f64::from(shift)).fract();
            let u = u.map(|u| (u + shift).fract());
            let medium = self.medium;
            if !phase.is_delta()
                && let Some((light, pmf)) = self.world.choose_light(&at, u_light)
                && let Some(sample) = self.world.sample_on_light(light, pmf, &at, u)
            {
                let density = phase.p(wo, sample.wi);
                let weight = match fog {
                    Some(fog) if sample.is_delta => fog.weight_by_extinction(t, p, light, pmf),
                    _ => sample.weight(density * per_light),
                };
                let f = Rgb::splat(density);
                self.add_light::<true>(&sample, f, weight * per_light, medium);
            }
        }
        let (wi, pdf_w) = phase.sample(wo, self.sampler.get_2d());
        // The density is the phase function itself: throughput stays as it is.
        self.origin = if phase.is_delta() {
            Origin::Certain
        } else {
            // Beside so many samples of lights.
            let pdf_w = pdf_w * per_light;
            Origin::Drawn { at, pdf_w }
        };
        self.ray = Ray {
            o: p,
            d: wi,
            time: self.ray.time,
        };
        self.sent_first.get_or_insert(1.0);
        self.is_clear = self.past_walls && self.world.is_clear_within(self.medium);
        self.bounces += 1;
        self.see(|state| Event::Scattered {
            wi,
            pdf_w: (!phase.is_delta()).then_some(pdf_w),
            weight: Rgb::ONE,
            transmitted: None,
            medium: state.medium,
        });
    }

    /// Scatters at a surface, and below it where the material lets light in. False where the path ends.
    fn scatter_at_surface<const VOLUMETRIC: bool>(
        &mut self,
        material: MaterialId,
        hit: &Hit,
        surface: &SurfacePoint,
        ctx: &TextureContext,
        bsdf: &Bsdf,
    ) -> bool {
        let (wo, eta_scale) = (-self.ray.d, self.eta_scale);
        let Some(transmitted) = self.scatter_by::<VOLUMETRIC>(hit, surface, bsdf, wo) else {
            return false;
        };
        self.bounces += 1;
        if !transmitted {
            return true;
        }
        let (materials, textures) = (self.world.materials(), self.world.textures());
        let Some(bssrdf) = materials.bssrdf(material, surface, ctx, textures) else {
            return true;
        };
        let entry = Entry {
            surface,
            frame: bsdf.frame(),
            material,
            time: self.ray.time,
        };
        let exit = sample_exit(
            self.world,
            &entry,
            &bssrdf,
            self.beta,
            self.sampler,
            &mut self.rng,
            self.counters,
        );
        let Some(exit) = exit else {
            return false;
        };
        self.beta *= exit.weight;
        self.eta_scale = eta_scale;
        self.see(|_| Event::Surfaced {
            p: exit.surface.p,
            weight: exit.weight,
        });
        // Light leaves as from a diffuse surface, whatever way it came.
        let surface = &exit.surface;
        let frame = Frame::from_normal_tangent(surface.ns, surface.tangent);
        let mut bsdf = Bsdf::new(frame, surface.ng);
        bsdf.add(Bxdf::SubsurfaceExit(bssrdf.exit()));
        let wo = Vec3::from(surface.ns);
        self.scatter_by::<VOLUMETRIC>(&exit.hit, surface, &bsdf, wo)
            .is_some()
    }

    /// Adds direct light at a surface and draws the next direction: whether it was transmitted, or `None` where the
    /// path ends.
    fn scatter_by<const VOLUMETRIC: bool>(
        &mut self,
        hit: &Hit,
        surface: &SurfacePoint,
        bsdf: &Bsdf,
        wo: Vec3,
    ) -> Option<bool> {
        let world = self.world;
        let medium_toward = |w: Vec3, current: MediumId| {
            if VOLUMETRIC {
                world.medium_toward(hit.target, surface.ng, w, current)
            } else {
                MediumId::NONE
            }
        };
        // Where a medium may have no end, pictures depend on the densities of light: they are pbrt-v3's.
        let has_end = |medium: MediumId| !medium.is_some() || world.is_bounded(medium);
        let is_endless = VOLUMETRIC && !(has_end(self.medium) && has_end(world.camera_medium()));
        let (u_light, u) = (self.sampler.get_1d_fine(), self.sampler.get_2d());
        let at = Receiver {
            p: surface.p,
            p_err: surface.p_err,
            ng: surface.ng,
            wanted: match bsdf.facing(wo) {
                Some(normal) if !is_endless => Wanted::Facing(normal),
                _ => Wanted::All,
            },
            time: self.ray.time,
        };
        let seen = bsdf.seen_from(wo);
        if bsdf.has_non_specular()
            && let Some(sample) = self.world.sample_light(&at, u_light, u)
        {
            let f = seen.f(sample.wi, TransportMode::Radiance) * bsdf.abs_cos(sample.wi);
            if !f.is_black() {
                let weight = sample.weight(seen.pdf(sample.wi));
                let medium = medium_toward(sample.wi, self.medium);
                self.add_light::<VOLUMETRIC>(&sample, f, weight, medium);
            }
        }
        let (u_lobe, u) = (self.sampler.get_1d(), self.sampler.get_2d());
        let sample = seen.sample(u_lobe, u, TransportMode::Radiance)?;
        self.beta *= sample.weight;
        if self.beta.is_black() {
            return None;
        }
        self.origin = if sample.specular {
            Origin::Certain
        } else {
            let sent = self.carried();
            self.sent_first.get_or_insert(sent);
            Origin::Drawn {
                at,
                pdf_w: sample.pdf_w,
            }
        };
        self.eta_scale *= sample.eta_scale;
        self.medium = medium_toward(sample.wi, self.medium);
        self.ray = spawn_ray(
            surface.p,
            surface.p_err,
            surface.ng,
            sample.wi,
            self.ray.time,
        );
        self.see(|state| Event::Scattered {
            wi: sample.wi,
            pdf_w: (!sample.specular).then_some(sample.pdf_w),
            weight: sample.weight,
            transmitted: Some(sample.transmitted),
            medium: state.medium,
        });
        Some(sample.transmitted)
    }

    /// Adds light that was sampled, if it is seen; `f` includes the cosine.
    fn add_light<const VOLUMETRIC: bool>(
        &mut self,
        sample: &LightSample,
        f: Rgb,
        weight: f32,
        medium: MediumId,
    ) {
        // First what is near 1: the product of all but the density may overflow.
        let contribution = self.beta * f * (sample.radiance * (weight / sample.pdf));
        let mut transmittance = None;
        if !contribution.is_black() {
            let tr = self.transmittance::<VOLUMETRIC>(sample, medium);
            if !tr.is_black() {
                self.radiance += contribution * tr;
            }
            transmittance = Some(tr);
        }
        self.see(|_| Event::Sampled {
            wi: sample.wi,
            radiance: sample.radiance,
            pdf: sample.pdf,
            f,
            weight,
            transmittance,
            added: transmittance.map_or(Rgb::BLACK, |tr| contribution * tr),
        });
    }

    /// The part of light that was sampled which arrives.
    #[inline]
    fn transmittance<const VOLUMETRIC: bool>(
        &mut self,
        sample: &LightSample,
        medium: MediumId,
    ) -> Rgb {
        if VOLUMETRIC {
            let (world, rng) = (self.world, &mut self.rng);
            let tally = &mut self.counters.shadow;
            if self.past_walls {
                world.transmittance_past_walls(sample, medium, rng, tally)
            } else {
                world.transmittance(sample, medium, rng, tally)
            }
        } else {
            self.counters.shadow.rays += 1;
            if self.world.is_occluded(sample) {
                Rgb::BLACK
            } else {
                Rgb::ONE
            }
        }
    }
}

/// Distance `t` to a collision before the wall at `hit`, moved off the wall where rounding could carry the point
/// through it: the path would go on in a medium it has left.
pub(super) fn stay_inside(world: &World, ray: &Ray, t: f32, hit: &Hit) -> f32 {
    let end = hit.at.t;
    let size = ray.o.0.abs().max_element() + end;
    // Far from the wall at any angle that matters: most collisions end here.
    if end - t > NEAR_WALL * size {
        return t;
    }
    let Place { p, p_err, ng, .. } = world.place(ray, hit);
    let rounding = p_err.0 + p.0.abs() * (2.0 * EPSILON) + size * (2.0 * EPSILON);
    let reach = ng.0.abs().dot(rounding) / ng.abs_dot(ray.d);
    if end - t > reach {
        t
    } else {
        (end - 2.0 * reach).max(0.5 * end)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{LightId, MaterialId, ObjectId};
    use crate::integrator::trace::Unobserved;
    use crate::light::{InfiniteLight, Light};
    use crate::math::Transform;
    use crate::medium::{Homogeneous, Medium};
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
        let found = path.li::<true, _>(
            &world,
            ray,
            None,
            &mut sampler,
            &mut counters,
            &mut Unobserved,
        );
        assert_eq!((found.total(), counters.stuck_paths), (Rgb::ONE, 0));
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
