//! Metropolis light transport on the random numbers of bidirectional paths (Kelemen et al. 2002; Hachisuka, Kaplanyan
//! and Dachsbacher 2014; pbrt 3rd ed., section 16.4). Scene-file manual (`mlt`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer maxdepth` | 5 | scattering events; 0 shows emitters only |
//! | `integer bootstrapsamples` | 100000 | paths of each length that estimate the picture's brightness |
//! | `integer chains` | 1000 | independent Markov chains |
//! | `integer mutationsperpixel` | 100 | mutations, as a mean over the full frame |
//! | `float largestepprobability` | 0.3 | chance of a mutation that forgets the current path |
//! | `float sigma` | 0.01 | standard deviation of small mutations |
//!
//! A chain keeps to one path length; its numbers choose one strategy of that length and everything along it. The
//! pixel filter has no effect.

use std::f32::consts::TAU;

use crate::camera::{Camera, CameraRay, CameraSample};
use crate::integrator::bdpt::{Bdpt, Numbers, Tracer};
use crate::sampling::rng::{ONE_MINUS_EPSILON, Rng};
use crate::spectrum::Rgb;
use crate::world::LightStrategy;

/// Settings of Metropolis light transport.
#[derive(Clone, Copy, Debug)]
pub struct Mlt {
    /// Scattering events.
    pub max_depth: u32,
    /// Paths of each length that estimate the brightness.
    pub n_bootstrap: u32,
    /// Markov chains.
    pub n_chains: u32,
    /// Mutations, as a mean over the pixels of the full frame.
    pub mutations_per_pixel: u32,
    /// Probability of a mutation that forgets the path.
    pub large_step: f32,
    /// Standard deviation of the others.
    pub sigma: f32,
}

impl Mlt {
    /// How chains draw the light that paths start from.
    pub const LIGHT_STRATEGY: LightStrategy = LightStrategy::Power;

    /// The same light by independent paths.
    pub fn without_chains(&self) -> Bdpt {
        Bdpt {
            max_depth: self.max_depth,
            light_strategy: Self::LIGHT_STRATEGY,
            visualized: None,
        }
    }
}

/// A coordinate of primary sample space, with what a rejected mutation restores.
#[derive(Clone, Copy, Debug, Default)]
struct Coordinate {
    value: f64,
    changed_at: u64,
    before: (f64, u64),
}

/// A point of primary sample space that mutates. Coordinates come into being, and catch up with the mutations they
/// slept through, when they are asked for.
#[derive(Clone, Debug)]
pub struct PrimarySample {
    rng: Rng,
    /// Of the camera path, the light path, and what joins them.
    streams: [Vec<Coordinate>; 3],
    iteration: u64,
    is_large: bool,
    last_large: u64,
    /// Stream of the paths through media, which only large steps change, and the one before.
    media: (u64, u64),
    large_step: f32,
    sigma: f32,
}

impl PrimarySample {
    /// A random point that depends on `key` alone.
    pub fn new(key: u64, settings: &Mlt) -> Self {
        let mut rng = Rng::new(key);
        let media = rng.next_u64();
        Self {
            rng,
            streams: Default::default(),
            iteration: 0,
            is_large: true,
            last_large: 0,
            media: (media, media),
            large_step: settings.large_step,
            sigma: settings.sigma,
        }
    }

    /// Lets mutations from here on depend on `key`: chains that start at one point go different ways.
    pub fn part(&mut self, key: u64) {
        self.rng = Rng::new(key);
    }

    /// Begins a mutation.
    pub fn mutate(&mut self) {
        self.iteration += 1;
        self.is_large = self.rng.uniform() < self.large_step;
        self.media.1 = self.media.0;
        if self.is_large {
            self.media.0 = self.rng.next_u64();
        }
    }

    /// Keeps the mutation.
    pub fn accept(&mut self) {
        if self.is_large {
            self.last_large = self.iteration;
        }
    }

    /// Takes the mutation back.
    pub fn reject(&mut self) {
        for coordinate in self.streams.iter_mut().flatten() {
            if coordinate.changed_at == self.iteration {
                (coordinate.value, coordinate.changed_at) = coordinate.before;
            }
        }
        self.media.0 = self.media.1;
        self.iteration -= 1;
    }

    fn coordinate(&mut self, stream: usize, index: usize) -> f64 {
        if index >= self.streams[stream].len() {
            let fresh = Coordinate {
                value: self.rng.uniform_fine(),
                changed_at: self.last_large,
                ..Coordinate::default()
            };
            self.streams[stream].push(fresh);
        }
        let coordinate = &mut self.streams[stream][index];
        if coordinate.changed_at < self.last_large {
            coordinate.value = self.rng.uniform_fine();
            coordinate.changed_at = self.last_large;
        }
        if coordinate.changed_at == self.iteration {
            return coordinate.value;
        }
        coordinate.before = (coordinate.value, coordinate.changed_at);
        if self.is_large {
            coordinate.value = self.rng.uniform_fine();
        } else {
            // Small steps add up like their variances.
            let n_steps = (self.iteration - coordinate.changed_at) as f32;
            let (sin, _) = (TAU * self.rng.uniform()).sin_cos();
            let normal = (2.0 * self.rng.exponential()).sqrt() * sin;
            let moved = coordinate.value + f64::from(normal * self.sigma * n_steps.sqrt());
            let wrapped = moved - moved.floor();
            coordinate.value = if wrapped < 1.0 { wrapped } else { 0.0 };
        }
        coordinate.changed_at = self.iteration;
        coordinate.value
    }

    fn stream(&mut self, stream: usize) -> Stream<'_> {
        Stream {
            sample: self,
            stream,
            index: 0,
        }
    }
}

/// The numbers of one part of a path.
struct Stream<'a> {
    sample: &'a mut PrimarySample,
    stream: usize,
    index: usize,
}

impl Numbers for Stream<'_> {
    fn get_1d(&mut self) -> f32 {
        (self.get_1d_fine() as f32).min(ONE_MINUS_EPSILON)
    }
    fn get_1d_fine(&mut self) -> f64 {
        self.index += 1;
        self.sample.coordinate(self.stream, self.index - 1)
    }
    fn get_2d(&mut self) -> [f32; 2] {
        [self.get_1d(), self.get_1d()]
    }
}

/// What a point of primary sample space stands for: a place on the film and its part of the mean over the frame.
pub type Found = ([f64; 2], Rgb);

/// Evaluates a point for paths of `depth` scattering events on a full frame of `resolution` pixels.
pub fn evaluate(
    tracer: &mut Tracer,
    camera: &Camera,
    resolution: [u32; 2],
    depth: u32,
    sample: &mut PrimarySample,
) -> Found {
    let mut numbers = sample.stream(0);
    // Light tracing is the last strategy; not every camera knows it.
    let n_strategies = match depth {
        0 => 1,
        _ => depth as usize + 1 + usize::from(camera.receives_light()),
    };
    let u_strategy = numbers.get_1d_fine();
    let s = ((u_strategy * n_strategies as f64) as usize).min(n_strategies - 1);
    let t = depth as usize + 2 - s;
    let on_film = [numbers.get_1d_fine(), numbers.get_1d_fine()];
    let camera_sample = CameraSample {
        raster: [0, 1].map(|axis| on_film[axis] * f64::from(resolution[axis])),
        time: numbers.get_1d(),
        lens: numbers.get_2d(),
    };
    tracer.start(camera.time(&camera_sample), sample.media.0);
    tracer.trace_light_part(s, &mut sample.stream(1));
    if t == 1 {
        let found = tracer.splat_of(s, &mut sample.stream(2));
        let (raster, rgb) = found.unwrap_or((camera_sample.raster, Rgb::BLACK));
        return (raster, rgb * n_strategies as f32);
    }
    let radiance = match camera.ray(&camera_sample) {
        Some(CameraRay { ray, weight }) => {
            let mut numbers = sample.stream(0);
            // Behind those of the camera sample.
            numbers.index = 6;
            let differential = tracer.differential(camera, &camera_sample);
            tracer.trace_camera_part(s, t, ray, differential.as_ref(), &mut numbers);
            tracer.strategy(s, t, &mut sample.stream(2)) * weight
        }
        None => Rgb::BLACK,
    };
    (camera_sample.raster, radiance * n_strategies as f32)
}
