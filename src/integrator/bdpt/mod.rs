//! Bidirectional path tracing (Lafortune and Willems 1993; Veach and Guibas 1994; pbrt 3rd ed., section 16.3).
//! Scene-file manual (`bdpt`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer maxdepth` | 5 | scattering events; 0 shows emitters only |
//! | `string lightsamplestrategy` | `power` | how a light is chosen |
//! | `integer[4] pixelbounds` | film | pixels that are rendered |
//! | `bool visualizestrategies` | false | also show what each strategy finds, as if it were the only one |
//! | `bool visualizeweights` | false | also show what each strategy adds to the picture; goes before the former |
//!
//! Either of the last two clamps `maxdepth` to 5. Strategy (s, t) takes s vertices from a light and t from the camera;
//! its picture is `bdpt_dDD_sSS_tTT.exr`, where D = s + t − 2 is the number of scattering events. All are made along
//! with the picture, from the same paths.
//!
//! Every prefix of a path from the camera is joined with every prefix of a path from a light, media and null surfaces
//! included, and each of these strategies is weighed against all others that could have found the same path. Light
//! paths that see the camera itself ([`Tracer::splats`]) arrive in pixels of their own.
//!
//! What the camera sees directly has the footprint of its pixel, whichever end the path comes from; all other vertices
//! have none. So a path is the same to all strategies that can find it. Light below surfaces is left out, as in pbrt-v3.
//!
//! Under bent normals, some directions scatter light and are drawn by no lobe. Camera paths look for a light there, and do
//! not go on. The picture is that of `path`: no strategy passes such a direction but next to the light.

mod connect;
mod guide;
mod reach;
mod steadiness;
mod strategy;
mod subpath;
mod vertex;
pub mod weights;

use crate::camera::{Camera, CameraSample, RayDifferential};
use crate::ids::LightId;
use crate::integrator::Counters;
use crate::light::{Light, LightChoice};
use crate::math::{Normal3, Point3, Ray, Vec3};
use crate::sampler::Sampler;
use crate::sampling::rng::Rng;
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::world::{EmissionSample, LightStrategy, World};
pub use guide::{EmissionGuide, GuideTraining};
pub use reach::aim_light;
pub use strategy::{Contribution, Strategy};
use subpath::End;
use vertex::{Kind, Vertex};
use weights::Density;

/// Settings of the bidirectional path tracer.
#[derive(Clone, Copy, Debug)]
pub struct Bdpt {
    /// Scattering events.
    pub max_depth: u32,
    /// How the lights are chosen at which paths start.
    pub light_strategy: LightStrategy,
    /// What is shown of single strategies; `None` for nothing.
    pub visualized: Option<Visualized>,
}

/// What is shown of single strategies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Visualized {
    /// What each finds, as if there were no other.
    Strategies,
    /// What each adds to the picture.
    Weights,
}

impl Visualized {
    /// What is shown of a contribution.
    pub fn of(self, found: &Contribution) -> Rgb {
        match self {
            Self::Strategies => found.unweighted(),
            Self::Weights => found.weighted(),
        }
    }
}

/// Random numbers for one path from one end.
pub trait Numbers {
    /// Uniform in [0, 1).
    fn get_1d(&mut self) -> f32;
    /// Uniform in [0, 1), of 53 bits.
    fn get_1d_fine(&mut self) -> f64;
    /// Uniform in [0, 1)².
    fn get_2d(&mut self) -> [f32; 2];
}

impl Numbers for Sampler {
    fn get_1d(&mut self) -> f32 {
        self.get_1d()
    }
    fn get_1d_fine(&mut self) -> f64 {
        self.get_1d_fine()
    }
    fn get_2d(&mut self) -> [f32; 2] {
        self.get_2d()
    }
}

/// What is the same for all paths of a picture.
#[derive(Clone, Debug)]
pub struct Emitters {
    choice: LightChoice,
    infinite: Vec<LightId>,
    /// Some light has an extent: paths may meet it by chance.
    any_met: bool,
    /// Where light from points is sent, by light; without a guide by its intensity. Empty if there are no guides.
    guides: Vec<Option<EmissionGuide>>,
}

/// Most lights that are taught where to send light: each takes as much memory as a few thousand pixels.
const MAX_GUIDED: usize = 16;

impl Emitters {
    /// The lights of a world.
    pub fn new(world: &World, strategy: LightStrategy) -> Self {
        let is_infinite = |id: &LightId| matches!(world.light(*id), Light::Infinite(_));
        let has_extent = |light: &Light| matches!(light, Light::Area(_) | Light::Infinite(_));
        Self {
            any_met: (0..world.n_lights()).any(|i| has_extent(world.light(LightId::new(i)))),
            choice: world.emitter_choice(strategy, |light| world.sends_light_paths(light)),
            infinite: (0..world.n_lights())
                .map(LightId::new)
                .filter(is_infinite)
                .collect(),
            guides: Vec::new(),
        }
    }

    /// Guides that have learnt nothing yet, by light: for lights that are points, if there are few of them.
    pub fn trainings(world: &World) -> Vec<Option<GuideTraining>> {
        let lights = || (0..world.n_lights()).map(|i| world.light(LightId::new(i)));
        let n_points = lights().filter(|light| light.position().is_some()).count();
        if n_points == 0 || n_points > MAX_GUIDED {
            return Vec::new();
        }
        lights()
            .map(|light| GuideTraining::of(light, world))
            .collect()
    }

    /// Light is sent as `guides` say.
    pub fn guided(self, guides: Vec<Option<EmissionGuide>>) -> Self {
        Self { guides, ..self }
    }

    fn guide(&self, light: LightId) -> Option<&EmissionGuide> {
        self.guides.get(light.index())?.as_ref()
    }

    /// Draws a ray that leaves a light: [`World::sample_emission`], or as its guide says.
    fn sample_emission(
        &self,
        world: &World,
        light: LightId,
        u_pos: [f32; 2],
        u_dir: [f32; 2],
        time: f32,
    ) -> Option<EmissionSample> {
        let Some(guide) = self.guide(light) else {
            return world.sample_emission(light, u_pos, u_dir, time);
        };
        match guide.sample(u_dir) {
            Ok(d) => {
                let d = d?;
                let (_, own) = world.pdf_emission(light, Point3::ZERO, Normal3::ZERO, d);
                world.emission_toward(light, d, guide.pdf(d, own), time)
            }
            Err(u_dir) => {
                let mut sample = world.sample_emission(light, u_pos, u_dir, time)?;
                sample.pdf_dir = guide.pdf(sample.d, sample.pdf_dir);
                Some(sample)
            }
        }
    }

    /// Densities, of position and of direction, with which a ray that leaves a light is drawn.
    fn pdf_emission(
        &self,
        world: &World,
        light: LightId,
        p: Point3,
        ng: Normal3,
        d: Vec3,
    ) -> (f32, f32) {
        let (pdf_pos, own) = world.pdf_emission(light, p, ng, d);
        let guide = self.guide(light);
        (pdf_pos, guide.map_or(own, |guide| guide.pdf(d, own)))
    }
}

/// Follows paths from both ends and joins them. Keeps the storage of one pair of paths after the other.
#[derive(Debug)]
pub struct Tracer<'a> {
    world: &'a World,
    emitters: &'a Emitters,
    /// The camera, if light can be followed to it.
    film: Option<&'a Camera>,
    max_depth: usize,
    /// Pixels that have camera paths of their own each; 1 where film positions are drawn freely.
    n_pixels: f64,
    camera_path: Vec<Vertex<'a>>,
    /// Lights that the camera path meets.
    ends: Vec<End>,
    light_path: Vec<Vertex<'a>>,
    /// Where the light path met surfaces, by number of the vertex: for the footprints they have if the camera sees them.
    /// Empty if there are none.
    light_surfaces: Vec<(usize, SurfacePoint)>,
    /// Pixels between the rays whose distance is the footprint. `None` where nothing looks at it.
    footprint_step: Option<f64>,
    /// For the light path: density of its first point if drawn for its second.
    light_direct: f64,
    /// Its first point is in a hole of a lamp.
    starts_in_hole: bool,
    densities: Vec<Density>,
    time: f32,
    /// For tracking through media.
    rng: Rng,
    counters: Counters,
}

impl<'a> Tracer<'a> {
    /// `film` is the camera if light paths are followed to it as well; the weights of all strategies heed that.
    pub fn new(
        world: &'a World,
        emitters: &'a Emitters,
        film: Option<&'a Camera>,
        max_depth: u32,
    ) -> Self {
        Self {
            world,
            emitters,
            film: film.filter(|camera| camera.receives_light()),
            max_depth: max_depth as usize,
            n_pixels: 1.0,
            camera_path: Vec::new(),
            ends: Vec::new(),
            light_path: Vec::new(),
            light_surfaces: Vec::new(),
            footprint_step: None,
            light_direct: 0.0,
            starts_in_hole: false,
            densities: Vec::new(),
            time: 0.0,
            rng: Rng::new(0),
            counters: Counters::default(),
        }
    }

    /// For pixels of so many samples, whose footprints shrink accordingly, as in pbrt-v3.
    pub fn with_footprints(self, spp: u32) -> Self {
        let is_needed = self.world.facts().needs_footprint;
        Self {
            footprint_step: is_needed.then(|| 1.0 / f64::from(spp).sqrt()),
            ..self
        }
    }

    /// The neighbours of a camera ray, if anything looks at them.
    pub fn differential(&self, camera: &Camera, sample: &CameraSample) -> Option<RayDifferential> {
        camera.differential(sample, self.footprint_step?)
    }

    /// For camera paths that are shared out evenly among so many pixels of the full frame.
    pub fn over_pixels(self, n_pixels: u64) -> Self {
        Self {
            n_pixels: n_pixels as f64,
            ..self
        }
    }

    /// The light at which the light path starts, and its direction there.
    pub fn light_start(&self) -> Option<(LightId, Vec3)> {
        let start = self.light_path.first()?;
        match start.kind {
            Kind::Light(light) | Kind::FarLight(light) => Some((light, -start.wo)),
            Kind::Camera | Kind::Surface(_) | Kind::Medium(_) => None,
        }
    }

    /// What happened so far.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Forgets the paths; those that follow exist at `time` and pass media by the stream of `key`.
    pub fn start(&mut self, time: f32, key: u64) {
        self.camera_path.clear();
        self.ends.clear();
        self.light_path.clear();
        self.light_surfaces.clear();
        self.time = time;
        self.rng = Rng::new(key);
    }

    /// Follows light from a source.
    pub fn trace_light(&mut self, numbers: &mut impl Numbers) {
        self.trace_light_to(self.max_depth + 1, numbers);
    }

    /// The light that the light path brings to the film, as means over the full frame: calls `add` with strategies,
    /// raster positions and what is found. For `n` light paths in all, a pixel's radiance is their sum there times the
    /// number of pixels of the frame over `n`.
    pub fn splats(
        &mut self,
        numbers: &mut impl Numbers,
        mut add: impl FnMut(Strategy, [f64; 2], &Contribution),
    ) {
        for s in 2..=self.light_path.len() {
            if let Some((raster, found)) = self.splat(s, numbers) {
                add(Strategy { s, t: 1 }, raster, &found);
            }
        }
    }

    /// Radiance along a camera ray with its neighbours by all strategies but those of [`Tracer::splats`], and in calls of `tell` what each
    /// of them found. Beside the frame, where filters reach, paths are weighed as in it, although what light brings there
    /// is lost: for nothing that it brings to the frame is spread beyond its pixel.
    pub fn radiance(
        &mut self,
        ray: Ray,
        differential: Option<&RayDifferential>,
        numbers: &mut impl Numbers,
        mut tell: impl FnMut(Strategy, &Contribution),
    ) -> Rgb {
        self.trace_camera_to(self.max_depth + 1, true, ray, differential, numbers);
        let mut radiance = Rgb::BLACK;
        let mut add = |s: usize, t: usize, found: Contribution| {
            radiance += found.weighted();
            tell(Strategy { s, t }, &found);
        };
        for i in 0..self.ends.len() {
            add(0, self.ends[i].n_before + 1, self.end(i));
        }
        for t in 2..=self.camera_path.len() {
            add(1, t, self.direct(t, numbers));
            for s in 2..=self.light_path.len().min(self.max_depth + 2 - t) {
                add(s, t, self.connect(s, t));
            }
        }
        radiance
    }
}

/// One strategy at a time: `s` vertices from the light and `t` from the camera.
impl Tracer<'_> {
    /// Follows light as far as strategies with `s` vertices need it.
    pub fn trace_light_part(&mut self, s: usize, numbers: &mut impl Numbers) {
        if s >= 2 {
            self.trace_light_to(s, numbers);
        }
    }

    /// Follows a camera ray as far as the strategy needs it.
    pub fn trace_camera_part(
        &mut self,
        s: usize,
        t: usize,
        ray: Ray,
        differential: Option<&RayDifferential>,
        numbers: &mut impl Numbers,
    ) {
        let (limit, looks_for_light) = if s == 0 { (t - 1, true) } else { (t, false) };
        self.trace_camera_to(limit, looks_for_light, ray, differential, numbers);
    }

    /// Radiance by the strategy with `t` ≥ 2, whose parts have been followed from a film position in the frame.
    pub fn strategy(&mut self, s: usize, t: usize, numbers: &mut impl Numbers) -> Rgb {
        match s {
            0 => {
                let mut radiance = Rgb::BLACK;
                for i in 0..self.ends.len() {
                    if self.ends[i].n_before == t - 1 {
                        radiance += self.end(i).weighted();
                    }
                }
                radiance
            }
            _ if self.camera_path.len() < t => Rgb::BLACK,
            1 => self.direct(t, numbers).weighted(),
            _ if self.light_path.len() < s => Rgb::BLACK,
            _ => self.connect(s, t).weighted(),
        }
    }

    /// What the light path of `s` ≥ 2 vertices brings to the film.
    pub fn splat_of(&mut self, s: usize, numbers: &mut impl Numbers) -> Option<([f64; 2], Rgb)> {
        if self.light_path.len() < s {
            return None;
        }
        let (raster, found) = self.splat(s, numbers)?;
        Some((raster, found.weighted()))
    }
}

impl Bdpt {
    /// Radiance along a single ray, without light that is followed to the film.
    pub fn li(
        &self,
        world: &World,
        ray: Ray,
        differential: Option<&RayDifferential>,
        sampler: &mut Sampler,
        counters: &mut Counters,
    ) -> Rgb {
        let emitters = Emitters::new(world, self.light_strategy);
        let mut tracer = Tracer::new(world, &emitters, None, self.max_depth);
        tracer.start(ray.time, sampler.stream().next_u64());
        tracer.trace_light(sampler);
        let radiance = tracer.radiance(ray, differential, sampler, |_, _| ());
        counters.add(tracer.counters());
        radiance
    }
}
