//! Rendering a picture: blocks of pixels on all threads, merged in one fixed order, with progress and cancellation.
//!
//! The picture is a function of the job alone: thread count and schedule never change a bit.

mod bidirectional;
mod memory;
mod mlt;
mod sharing;
mod silhouettes;
mod sppm;
mod strategies;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use crate::camera::{Camera, CameraRay, CameraSample, RayDifferential};
use crate::film::{Film, FilmBlock, FilmDesc};
use crate::image::{Image, PixelRect};
use crate::integrator::bdpt::Strategy;
use crate::integrator::trace::{Observer, Unobserved};
use crate::integrator::{Counters, Integrator, Mlt};
use crate::math::Ray;
use crate::sampler::{Sampler, SamplerKind};
use crate::spectrum::Rgb;
use crate::stop;
use crate::world::World;
use bidirectional::Bidirectional;
use mlt::Metropolis;
use sharing::Sharing;
use silhouettes::Silhouettes;

/// Samples of a pixel taken in one pass over the picture. Part of the order of addition: changing it changes the
/// last bits of every picture.
pub const SAMPLES_PER_PASS: u32 = 16;

/// Blocks that may wait, per thread, for an earlier one to be merged.
const PENDING_PER_THREAD: usize = 64;

/// Everything a picture needs.
#[derive(Debug)]
pub struct Job {
    /// The scene.
    pub world: World,
    /// The camera.
    pub camera: Camera,
    /// The film.
    pub film: FilmDesc,
    /// The algorithm.
    pub integrator: Integrator,
    /// Samples per pixel, at least 1; of photon mapping, the iterations.
    pub spp: u32,
    /// Seed of all random numbers.
    pub seed: u64,
    /// How the samples of a pixel are laid out.
    pub sampler: SamplerKind,
    /// Draw film positions at pixel centres only.
    pub pixel_centers: bool,
    /// Pixels that receive samples; `None` for all.
    pub pixel_bounds: Option<PixelRect>,
}

/// A finished or cancelled picture.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// The picture of the crop window.
    pub image: Image,
    /// One more for each of [`Job::visualized_strategies`], of the same pixels. Negative values are not cut.
    pub strategies: Vec<Image>,
    /// What happened.
    pub report: RenderReport,
    /// Whole samples that the picture holds, as a mean over the pixels that are sampled; of Metropolis light transport,
    /// mutations.
    pub samples_per_pixel: f64,
}

/// What happened during rendering.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RenderReport {
    /// Camera samples taken.
    pub samples: u64,
    /// Samples whose radiance was not finite or negative; they were left out.
    pub bad_samples: u64,
    /// Pixel and sample number of the first of them, in merge order.
    pub first_bad_sample: Option<([i32; 2], u32)>,
    /// Events of the inner loop; with those of paths that were followed for others to share.
    pub counters: Counters,
    /// The search for paths that carry light, before anything was rendered, found none.
    pub found_no_light: bool,
    /// Rendering was stopped early.
    pub cancelled: bool,
}

impl Rendered {
    /// Spreads the samples that count over so many pixels.
    fn count_samples(&mut self, n_pixels: usize) {
        let held = self.report.samples.saturating_sub(self.report.bad_samples);
        self.samples_per_pixel = held as f64 / n_pixels.max(1) as f64;
    }
}

/// Someone who watches a picture grow.
pub trait Progress: Sync {
    /// `done` of `total` samples are taken: camera samples, or paths of Metropolis light transport, those of its
    /// bootstrap included. Called by all threads; numbers may come out of order.
    fn samples_done(&self, done: u64, total: u64);
}

/// Nobody watches.
pub struct Unwatched;

impl Progress for Unwatched {
    fn samples_done(&self, _done: u64, _total: u64) {}
}

/// One unit of work: the samples `first_sample..` of one pass in one block.
struct Task {
    block: PixelRect,
    first_sample: u32,
    n_samples: u32,
}

struct BlockResult {
    film: FilmBlock,
    /// One for each picture of a strategy.
    strategies: Vec<FilmBlock>,
    report: RenderReport,
}

/// How much is done, for whoever watches.
struct Tally<'a> {
    progress: &'a dyn Progress,
    done: AtomicU64,
    total: u64,
}

impl<'a> Tally<'a> {
    fn new(progress: &'a dyn Progress, total: u64) -> Self {
        Self {
            progress,
            done: AtomicU64::new(0),
            total,
        }
    }

    fn add(&self, n_samples: u64) {
        let before = self.done.fetch_add(n_samples, Ordering::Relaxed);
        self.progress.samples_done(before + n_samples, self.total);
    }
}

impl Job {
    /// Whether a radiance is one that this scene can have.
    fn can_be(&self, radiance: Rgb) -> bool {
        let may_be_negative = self.world.facts().has_negative_light;
        radiance.is_finite() && (may_be_negative || radiance.luminance() >= 0.0)
    }

    /// Strategies that get pictures of their own.
    pub fn visualized_strategies(&self) -> Vec<Strategy> {
        match &self.integrator {
            Integrator::Bdpt(bdpt) if bdpt.visualized.is_some() => {
                Strategy::all(bdpt.max_depth).collect()
            }
            Integrator::Bdpt(_)
            | Integrator::Path(_)
            | Integrator::VolPath(_)
            | Integrator::Sppm(_)
            | Integrator::Direct(_)
            | Integrator::AmbientOcclusion(_)
            | Integrator::Mlt(_) => Vec::new(),
        }
    }
}

/// Hands out tasks and merges their results in the order of the tasks.
struct Schedule {
    next: usize,
    merged: usize,
    pending: BTreeMap<usize, BlockResult>,
    film: Film,
    strategies: Vec<Film>,
    report: RenderReport,
}

/// Renders on the current rayon thread pool. `cancel` stops it at once, amid a path if need be, and a bad sample where the
/// feature `nan-trap` is built in between two blocks; what is finished then is returned. It consists of whole samples: one
/// whose path was cut short does not count.
pub fn render(job: &Job, progress: &dyn Progress, cancel: &AtomicBool) -> Rendered {
    if let Integrator::Sppm(sppm) = &job.integrator {
        return sppm::render(job, sppm, progress, cancel);
    }
    let film = Film::new(job.film.clone());
    let bounds = film.sample_bounds();
    let bidirectional = match &job.integrator {
        Integrator::Mlt(settings) => return render_chains(job, settings, film, progress, cancel),
        Integrator::Bdpt(bdpt) => Some(Bidirectional::new(job, bdpt, bounds, cancel)),
        Integrator::Path(_)
        | Integrator::VolPath(_)
        | Integrator::Direct(_)
        | Integrator::AmbientOcclusion(_)
        | Integrator::Sppm(_) => None,
    };
    let blocks = match &bidirectional {
        Some(shared) if shared.needs_full_frame() => Film::blocks_of(film.full_sample_bounds()),
        _ => Film::blocks_of(bounds),
    };
    let sharing = Sharing::new(job, &film);
    let n_passes = job.spp.div_ceil(SAMPLES_PER_PASS) as usize;
    let task = |index: usize| {
        let first_sample = (index / blocks.len()) as u32 * SAMPLES_PER_PASS;
        let n_samples = (job.spp - first_sample).min(SAMPLES_PER_PASS);
        Task {
            block: blocks[index % blocks.len()],
            first_sample,
            n_samples,
        }
    };
    let (width, height) = job
        .pixel_bounds
        .map_or((bounds.width, bounds.height), |pixels| {
            overlap(&bounds, &pixels)
        });
    let tally = Tally::new(progress, width as u64 * height as u64 * job.spp as u64);
    let work = Work {
        n_tasks: blocks.len() * n_passes,
        pending_per_thread: PENDING_PER_THREAD,
        run: |index| {
            let result = match &bidirectional {
                Some(shared) => shared.render_block(&task(index)),
                None => render_block(job, sharing.as_ref(), &task(index)),
            };
            tally.add(result.report.samples);
            result
        },
    };
    let strategies = match &bidirectional {
        Some(shared) => shared.strategy_films(),
        None => Vec::new(),
    };
    let mut rendered = work.render(film, strategies, cancel);
    if let Some(shared) = &bidirectional {
        rendered.report.counters.add(shared.training());
    }
    rendered.count_samples(width * height);
    rendered
}

/// Metropolis light transport: chains in place of blocks.
fn render_chains(
    job: &Job,
    settings: &Mlt,
    film: Film,
    progress: &dyn Progress,
    cancel: &AtomicBool,
) -> Rendered {
    let n_mutations = mlt::n_mutations(job, settings);
    let n_paths = n_mutations.saturating_add(mlt::n_bootstrap_paths(settings));
    let tally = Tally::new(progress, n_paths);
    let Some(metropolis) = Metropolis::new(job, settings, &tally, cancel) else {
        return Rendered {
            image: film.develop(),
            strategies: Vec::new(),
            report: RenderReport {
                cancelled: true,
                ..RenderReport::default()
            },
            samples_per_pixel: 0.0,
        };
    };
    let n_chains = metropolis.n_chains();
    let work = Work {
        n_tasks: n_chains,
        pending_per_thread: mlt::PENDING_PER_THREAD,
        run: |chain| metropolis.run_chain(chain, &tally),
    };
    let mut rendered = work.render(film, Vec::new(), cancel);
    let [width, height] = job.film.resolution.map(|side| side as usize);
    rendered.count_samples(width * height);
    rendered.report.add(metropolis.search());
    rendered.report.found_no_light = n_chains == 0;
    rendered
}

/// Tasks whose results are added in their order.
struct Work<R> {
    n_tasks: usize,
    /// Results that may wait, per thread, for an earlier one.
    pending_per_thread: usize,
    run: R,
}

impl<R: Fn(usize) -> BlockResult + Sync> Work<R> {
    fn render(&self, film: Film, strategies: Vec<Film>, cancel: &AtomicBool) -> Rendered {
        let n_tasks = self.n_tasks;
        let report = RenderReport::default();
        let schedule = Mutex::new(Schedule {
            next: 0,
            merged: 0,
            pending: BTreeMap::new(),
            film,
            strategies,
            report,
        });
        let merged_some = Condvar::new();
        // Set by the first bad sample where the feature `nan-trap` is built in.
        let trap = AtomicBool::new(false);
        let n_threads = rayon::current_num_threads();
        let max_pending = n_threads * self.pending_per_thread;

        let work = || {
            loop {
                let index = {
                    let mut schedule = lock(&schedule);
                    while schedule.next >= schedule.merged + max_pending && schedule.next < n_tasks
                    {
                        schedule = merged_some
                            .wait(schedule)
                            .unwrap_or_else(PoisonError::into_inner);
                    }
                    let stop = cancel.load(Ordering::Relaxed) || trap.load(Ordering::Relaxed);
                    if schedule.next >= n_tasks || stop {
                        // Nobody may go on waiting for a merge that will not come.
                        merged_some.notify_all();
                        return;
                    }
                    schedule.next += 1;
                    schedule.next - 1
                };
                let release = ReleaseWaiting {
                    schedule: &schedule,
                    merged_some: &merged_some,
                    n_tasks,
                };
                let result = stop::heeding(cancel, || (self.run)(index));
                drop(release);
                if cfg!(feature = "nan-trap") && result.report.bad_samples > 0 {
                    trap.store(true, Ordering::Relaxed);
                }
                let mut schedule = lock(&schedule);
                schedule.pending.insert(index, result);
                schedule.merge_ready();
                merged_some.notify_all();
            }
        };
        rayon::scope(|scope| {
            for _ in 0..n_threads {
                scope.spawn(|_| work());
            }
        });

        let mut schedule = schedule
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        schedule.report.cancelled |= schedule.merged < n_tasks;
        Rendered {
            image: schedule.film.develop(),
            // One after the other: sums take more than pictures.
            strategies: schedule
                .strategies
                .into_iter()
                .map(|film| film.develop_part())
                .collect(),
            report: schedule.report,
            samples_per_pixel: 0.0,
        }
    }
}

/// Sends everyone home if its thread panics: the task it holds will never be merged, and others may wait for that.
struct ReleaseWaiting<'a> {
    schedule: &'a Mutex<Schedule>,
    merged_some: &'a Condvar,
    n_tasks: usize,
}

impl Drop for ReleaseWaiting<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            lock(self.schedule).next = self.n_tasks;
            self.merged_some.notify_all();
        }
    }
}

fn lock(schedule: &Mutex<Schedule>) -> MutexGuard<'_, Schedule> {
    schedule.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Schedule {
    fn merge_ready(&mut self) {
        while let Some(result) = self.pending.remove(&self.merged) {
            self.merged += 1;
            self.film.merge(&result.film);
            for (film, block) in self.strategies.iter_mut().zip(&result.strategies) {
                film.merge(block);
            }
            self.report.add(&result.report);
        }
    }
}

impl RenderReport {
    /// Counts a sample whose radiance is none.
    fn leave_out(&mut self, pixel: [i32; 2], sample: u32) {
        self.bad_samples += 1;
        self.first_bad_sample.get_or_insert((pixel, sample));
    }

    fn add(&mut self, other: &Self) {
        self.samples += other.samples;
        self.bad_samples += other.bad_samples;
        self.first_bad_sample = self.first_bad_sample.or(other.first_bad_sample);
        self.counters.add(&other.counters);
        self.cancelled |= other.cancelled;
    }
}

fn render_block(job: &Job, sharing: Option<&Sharing>, task: &Task) -> BlockResult {
    let mut film = job.film.start_block(task.block);
    let mut report = RenderReport::default();
    match sharing {
        Some(sharing) => sharing.render(task, &mut film, &mut report),
        None => take_samples(job, task, &mut film, &mut report),
    }
    BlockResult {
        film,
        strategies: Vec::new(),
        report,
    }
}

fn take_samples(job: &Job, task: &Task, film: &mut FilmBlock, report: &mut RenderReport) {
    let block = task.block;
    let silhouettes = Silhouettes::find(job, block, &mut report.counters);
    for y in block.y0..block.y0 + block.height as i32 {
        for x in block.x0..block.x0 + block.width as i32 {
            if job.pixel_bounds.is_some_and(|bounds| !bounds.holds([x, y])) {
                continue;
            }
            let pixel = [x, y];
            let is_split = silhouettes
                .as_ref()
                .is_some_and(|silhouettes| silhouettes.are_near(pixel));
            for sample in task.first_sample..task.first_sample + task.n_samples {
                match render_sample(job, pixel, sample, is_split, film, &mut report.counters) {
                    Judgement::Good => {}
                    Judgement::Bad => report.leave_out(pixel, sample),
                    Judgement::Unfinished => {
                        report.cancelled = true;
                        return;
                    }
                }
                report.samples += 1;
            }
        }
    }
}

/// Width and height of what two rectangles share.
fn overlap(a: &PixelRect, b: &PixelRect) -> (usize, usize) {
    let shared = |a0: i32, a_length: usize, b0: i32, b_length: usize| {
        let end = (a0 as i64 + a_length as i64).min(b0 as i64 + b_length as i64);
        (end - a0.max(b0) as i64).max(0) as usize
    };
    (
        shared(a.x0, a.width, b.x0, b.width),
        shared(a.y0, a.height, b.y0, b.height),
    )
}

/// The first numbers of a sample: where, when, and through which point of the lens. What makes no difference takes no
/// number: the first are the best laid out.
fn camera_sample(job: &Job, pixel: [i32; 2], sampler: &mut Sampler) -> CameraSample {
    let mut u = sampler.get_2d();
    if job.pixel_centers {
        u = [0.5; 2];
    }
    let stands_still = job.camera.is_still() && !job.world.facts().has_motion;
    let time = if stands_still { 0.5 } else { sampler.get_1d() };
    let has_lens = job.camera.has_lens();
    let lens = if has_lens { sampler.get_2d() } else { [0.5; 2] };
    CameraSample {
        raster: job.film.position(pixel, u),
        time,
        lens,
    }
}

/// What is to be said of a sample.
enum Judgement {
    /// It counts.
    Good,
    /// Its radiance is no radiance: it is left out.
    Bad,
    /// It was given up, and is as good as never begun.
    Unfinished,
}

impl Judgement {
    fn new(is_good: bool) -> Self {
        if is_good { Self::Good } else { Self::Bad }
    }
}

/// Takes one sample. One that is split sees the light directly by rays of its own.
fn render_sample(
    job: &Job,
    pixel: [i32; 2],
    sample: u32,
    is_split: bool,
    film: &mut FilmBlock,
    counters: &mut Counters,
) -> Judgement {
    let taken = take_sample(job, pixel, sample, counters, &mut Unobserved);
    // Its path may have been cut short.
    if stop::is_requested() {
        return Judgement::Unfinished;
    }
    if !taken.is_good(job) {
        return Judgement::Bad;
    }
    if is_split {
        let is_good = silhouettes::add_split(job, pixel, sample, &taken, film, counters);
        return Judgement::new(is_good);
    }
    film.add_sample(&job.film, taken.raster, taken.radiance, taken.weight);
    Judgement::Good
}

/// A sample of a picture.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Taken {
    /// Where on the film.
    pub raster: [f64; 2],
    /// Radiance; black if nothing passes the lens.
    pub radiance: Rgb,
    /// What the camera multiplies it by.
    pub weight: f32,
    /// Where it was looked for; `None` if nothing passes the lens.
    pub ray: Option<Ray>,
}

impl Taken {
    /// Whether the radiance is one. If not, the sample is left out of the picture.
    pub fn is_good(&self, job: &Job) -> bool {
        job.can_be(self.radiance)
    }
}

/// Takes one sample of a pixel again, as [`render`] does, and tells the observer how it comes about. Where paths in a cloud
/// share what they find, this one keeps its own.
pub fn retake(job: &Job, pixel: [i32; 2], sample: u32, observer: &mut impl Observer) -> Taken {
    take_sample(job, pixel, sample, &mut Counters::default(), observer)
}

/// Draws the camera ray of a sample and hands it to `follow`, with its footprint and the numbers that are left. Where the
/// sample is on the film and, unless nothing passes the lens, what the camera multiplies it by and what was found.
fn trace_camera_ray<T>(
    job: &Job,
    pixel: [i32; 2],
    sample: u32,
    follow: impl FnOnce(Ray, Option<&RayDifferential>, &mut Sampler) -> T,
) -> ([f64; 2], Option<(f32, T)>) {
    let mut sampler = Sampler::of_kind(job.sampler, job.seed, pixel, sample);
    let camera_sample = camera_sample(job, pixel, &mut sampler);
    let followed = job
        .camera
        .ray(&camera_sample)
        .map(|CameraRay { ray, weight }| {
            let differential = job.world.facts().needs_footprint.then(|| {
                // The footprint shrinks with the number of samples, as in pbrt-v3.
                job.camera
                    .differential(&camera_sample, 1.0 / f64::from(job.spp).sqrt())
            });
            let found = follow(ray, differential.flatten().as_ref(), &mut sampler);
            (weight, found)
        });
    (camera_sample.raster, followed)
}

fn take_sample(
    job: &Job,
    pixel: [i32; 2],
    sample: u32,
    counters: &mut Counters,
    observer: &mut impl Observer,
) -> Taken {
    let (raster, followed) = trace_camera_ray(job, pixel, sample, |ray, differential, sampler| {
        let (world, integrator) = (&job.world, &job.integrator);
        let radiance = integrator.li(world, ray, differential, sampler, counters, observer);
        (ray, radiance)
    });
    match followed {
        Some((weight, (ray, radiance))) => Taken {
            raster,
            radiance,
            weight,
            ray: Some(ray),
        },
        // Nothing passes the lens here: black, and as much a sample as any other.
        None => Taken {
            raster,
            radiance: Rgb::BLACK,
            weight: 1.0,
            ray: None,
        },
    }
}
