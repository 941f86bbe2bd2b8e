//! Blocks of a picture by bidirectional path tracing: every camera sample has a light path beside it, which may
//! arrive in any pixel.
//!
//! A crop window needs the light paths of the full frame: outside it only they are followed, so that a pixel is the
//! same bits with or without it.

use std::sync::atomic::AtomicBool;

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::camera::{Camera, CameraRay};
use crate::film::{Film, FilmBlock};
use crate::image::PixelRect;
use crate::integrator::bdpt::{EmissionGuide, Emitters, GuideTraining, Tracer};
use crate::integrator::{Bdpt, Counters};
use crate::math::{Normal3, Point3};
use crate::render::strategies::{StrategyBlocks, StrategyFilms};
use crate::render::{
    BlockResult, Job, Judgement, RenderReport, SAMPLES_PER_PASS, Task, camera_sample,
};
use crate::sampler::Sampler;
use crate::spectrum::Rgb;
use crate::stop;

/// Tells the numbers of light paths from those of camera paths.
const LIGHT_SEED: u64 = 0x5851_f42d_4c95_7f2d;
/// The same of light paths that look where light should be sent.
const TRAINING_SEED: u64 = 0x1405_7b7e_f767_814f;
/// Light paths of the picture for each of those, how many there are at most, and at least if they are to know anything.
const PATHS_PER_TRAINING_PATH: u64 = 16;
const MAX_TRAINING_PATHS: u64 = 1 << 17;
const MIN_TRAINING_PATHS: u64 = 1 << 7;
/// Training paths that one worker follows at a time.
const TRAINING_CHUNK: u64 = 256;
/// Filters of a smaller radius leave parts of the frame without camera samples.
const HALF_PIXEL: f64 = 0.5;

/// What the blocks of a picture share.
pub(super) struct Bidirectional<'a> {
    job: &'a Job,
    max_depth: u32,
    emitters: Emitters,
    /// The camera, if light is followed to it.
    film: Option<&'a Camera>,
    /// Pixels that camera samples are taken in.
    sampled: PixelRect,
    /// If single strategies are shown.
    strategies: Option<StrategyFilms>,
    /// What happened while it was learnt where to send light.
    training: Counters,
}

/// A block of the picture in the making.
struct Canvas<'a> {
    film: FilmBlock,
    strategies: Option<StrategyBlocks<'a>>,
}

impl<'a> Bidirectional<'a> {
    pub(super) fn new(job: &'a Job, bdpt: &Bdpt, sampled: PixelRect, cancel: &AtomicBool) -> Self {
        // Both kinds of samples must cover the frame alike for their weights to fit together.
        let is_covered = !job.pixel_centers
            && job.film.filter.radius().iter().all(|&r| r >= HALF_PIXEL)
            && job.camera.receives_light();
        let mut shared = Self {
            job,
            max_depth: bdpt.max_depth,
            emitters: Emitters::new(&job.world, bdpt.light_strategy),
            film: is_covered.then_some(&job.camera),
            sampled,
            strategies: bdpt.visualized.map(|shown| StrategyFilms::new(job, shown)),
            training: Counters::default(),
        };
        if shared.film.is_some() {
            let guides = shared.guides(cancel);
            shared.emitters = shared.emitters.guided(guides);
        }
        shared
    }

    /// Where light from points should be sent: what some light paths tell that are no part of the picture.
    fn guides(&mut self, cancel: &AtomicBool) -> Vec<Option<EmissionGuide>> {
        let (job, world): (&Job, _) = (self.job, &self.job.world);
        let mut trainings = Emitters::trainings(world);
        let n_pixels: u64 = job.film.resolution.map(u64::from).iter().product();
        let n_paths = (n_pixels.saturating_mul(job.spp.into()) / PATHS_PER_TRAINING_PATH)
            .min(MAX_TRAINING_PATHS);
        if trainings.is_empty() || n_paths < MIN_TRAINING_PATHS {
            return Vec::new();
        }
        let starts: Vec<u64> = (0..n_paths).step_by(TRAINING_CHUNK as usize).collect();
        let follow_chunk = |&start: &u64| {
            let mut tracer = self.tracer();
            let mut seen = Vec::new();
            for index in start..n_paths.min(start + TRAINING_CHUNK) {
                // Nothing is rendered any more, so that nobody needs to know where.
                if stop::is_requested() {
                    break;
                }
                let mut sampler = Sampler::of_picture(job.sampler, job.seed ^ TRAINING_SEED, index);
                let [open, close] = job.camera.shutter();
                let time = open + (close - open) * sampler.get_1d();
                tracer.start(time, sampler.stream().next_u64());
                tracer.trace_light(&mut sampler);
                let mut sum = 0.0;
                tracer.splats(&mut sampler, |_, _, found| {
                    sum += found.weighted().luminance();
                });
                if sum > 0.0
                    && sum.is_finite()
                    && let Some((light, d)) = tracer.light_start()
                {
                    seen.push((light, d, sum));
                }
            }
            (seen, *tracer.counters())
        };
        let follow = |start: &u64| stop::heeding(cancel, || follow_chunk(start));
        let found: Vec<_> = starts.par_iter().map(follow).collect();
        for (_, counters) in &found {
            self.training.add(counters);
        }
        for (light, d, contribution) in found.into_iter().flat_map(|(seen, _)| seen) {
            if let Some(training) = &mut trainings[light.index()] {
                let (_, pdf_dir) = world.pdf_emission(light, Point3::ZERO, Normal3::ZERO, d);
                training.see(d, pdf_dir, contribution);
            }
        }
        let learnt = |training: &Option<GuideTraining>| training.as_ref()?.guide();
        trainings.iter().map(learnt).collect()
    }

    fn tracer(&self) -> Tracer<'_> {
        let n_pixels = self.job.film.resolution.map(u64::from).iter().product();
        Tracer::new(&self.job.world, &self.emitters, self.film, self.max_depth)
            .over_pixels(n_pixels)
            .with_footprints(self.job.spp)
    }

    /// What happened before the first block.
    pub(super) fn training(&self) -> &Counters {
        &self.training
    }

    /// Films for pictures of single strategies: none unless wanted.
    pub(super) fn strategy_films(&self) -> Vec<Film> {
        let films = self.strategies.as_ref();
        films.map_or(Vec::new(), StrategyFilms::start)
    }

    /// Whether light paths outside the crop window bring light into it.
    pub(super) fn needs_full_frame(&self) -> bool {
        self.film.is_some()
    }

    pub(super) fn render_block(&self, task: &Task) -> BlockResult {
        let strategies = self.strategies.as_ref();
        let mut canvas = Canvas {
            film: self.job.film.start_block(task.block),
            strategies: strategies.map(|films| films.start_block(task.block)),
        };
        let mut report = RenderReport::default();
        let mut tracer = self.tracer();
        let block = task.block;
        'samples: for y in block.y0..block.y0 + block.height as i32 {
            for x in block.x0..block.x0 + block.width as i32 {
                for sample in task.first_sample..task.first_sample + task.n_samples {
                    let is_sampled = self.is_wanted([x, y]) && self.sampled.holds([x, y]);
                    match self.render_sample([x, y], sample, is_sampled, &mut tracer, &mut canvas) {
                        Judgement::Good => {}
                        Judgement::Bad => report.leave_out([x, y], sample),
                        Judgement::Unfinished => {
                            report.cancelled = true;
                            break 'samples;
                        }
                    }
                    report.samples += u64::from(is_sampled);
                }
            }
        }
        report.counters.add(tracer.counters());
        let strategies = canvas.strategies.map(StrategyBlocks::into_blocks);
        BlockResult {
            film: canvas.film,
            strategies: strategies.unwrap_or_default(),
            report,
        }
    }

    fn is_wanted(&self, pixel: [i32; 2]) -> bool {
        self.job
            .pixel_bounds
            .is_none_or(|bounds| bounds.holds(pixel))
    }

    /// The numbers of a light path. Those that belong to the pixels of the frame are one sequence together: light is
    /// spread evenly over all of them, wherever it arrives.
    fn light_sampler(&self, pixel: [i32; 2], sample: u32) -> Sampler {
        let (job, seed) = (self.job, self.job.seed ^ LIGHT_SEED);
        match index_in_picture(job.film.resolution, job.spp, pixel, sample) {
            Some(index) => Sampler::of_picture(job.sampler, seed, index),
            None => Sampler::of_kind(job.sampler, seed, pixel, sample),
        }
    }

    /// Takes one sample. What is no radiance is left out of it.
    fn render_sample(
        &self,
        pixel: [i32; 2],
        sample: u32,
        is_sampled: bool,
        tracer: &mut Tracer,
        canvas: &mut Canvas,
    ) -> Judgement {
        let job = self.job;
        let Canvas { film, strategies } = canvas;
        let [width, height] = job.film.resolution.map(|side| side as usize);
        let is_in_frame = self.film.is_some() && PixelRect::from_size(width, height).holds(pixel);
        if !is_in_frame && !is_sampled {
            return Judgement::Good;
        }
        let mut sampler = Sampler::of_kind(job.sampler, job.seed, pixel, sample);
        let mut light_sampler = self.light_sampler(pixel, sample);
        let camera_sample = camera_sample(job, pixel, &mut sampler);
        let mut is_good = true;
        tracer.start(
            job.camera.time(&camera_sample),
            light_sampler.stream().next_u64(),
        );
        tracer.trace_light(&mut light_sampler);
        if stop::is_requested() {
            return Judgement::Unfinished;
        }
        if is_in_frame {
            film.count_light_path();
            if let Some(strategies) = strategies {
                strategies.count_light_path();
            }
            tracer.splats(&mut light_sampler, |strategy, raster, found| {
                let rgb = found.weighted();
                if !job.can_be(rgb) {
                    is_good = false;
                } else if self.is_wanted(raster.map(|r| r.floor() as i32)) {
                    film.add_splat(&job.film, raster, rgb);
                    if let Some(strategies) = strategies {
                        is_good &= strategies.add_splat(strategy, raster, found);
                    }
                }
            });
        }
        if !is_sampled {
            return Judgement::new(is_good);
        }
        let (radiance, weight) = match job.camera.ray(&camera_sample) {
            Some(CameraRay { ray, weight }) => {
                let differential = tracer.differential(&job.camera, &camera_sample);
                let tell = |strategy, found: &_| {
                    if let Some(strategies) = strategies {
                        strategies.note(strategy, found);
                    }
                };
                let radiance = tracer.radiance(ray, differential.as_ref(), &mut sampler, tell);
                (radiance, weight)
            }
            None => (Rgb::BLACK, 1.0),
        };
        // The light path counts by itself.
        if stop::is_requested() {
            if let Some(strategies) = strategies {
                strategies.leave_out_sample();
            }
            return Judgement::Unfinished;
        }
        if job.can_be(radiance) {
            film.add_sample(&job.film, camera_sample.raster, radiance, weight);
            if let Some(strategies) = strategies {
                is_good &= strategies.add_sample(camera_sample.raster, weight);
            }
        } else {
            is_good = false;
            if let Some(strategies) = strategies {
                strategies.leave_out_sample();
            }
        }
        Judgement::new(is_good)
    }
}

/// The place of a light path in the sequence of the picture; `None` for those of pixels beside the frame. The sequence goes
/// from pixel to pixel in runs that are as long as a power of two can be of which the samples are made up, and no longer
/// than a pass: so those of a pixel are spread evenly as well, and those of finished passes leave no gaps.
fn index_in_picture(resolution: [u32; 2], spp: u32, pixel: [i32; 2], sample: u32) -> Option<u64> {
    let [width, height] = resolution;
    if !PixelRect::from_size(width as usize, height as usize).holds(pixel) {
        return None;
    }
    let run = 1 << spp.trailing_zeros().min(SAMPLES_PER_PASS.ilog2());
    let n_pixels = u64::from(width) * u64::from(height);
    let rank = pixel[1] as u64 * u64::from(width) + pixel[0] as u64;
    let first = (u64::from(sample / run) * n_pixels + rank) * u64::from(run);
    Some(first + u64::from(sample % run))
}

#[cfg(test)]
mod tests {
    use super::index_in_picture;

    #[test]
    fn light_paths_of_a_picture_are_a_sequence_without_gaps() {
        let [width, height] = [5, 3];
        for spp in [1, 2, 12, 16, 17, 24, 48] {
            let index = |x, y, sample| index_in_picture([width, height], spp, [x, y], sample);
            let mut seen = vec![false; (width * height * spp) as usize];
            for y in 0..height as i32 {
                for x in 0..width as i32 {
                    for sample in 0..spp {
                        let index = index(x, y, sample).expect("in the frame") as usize;
                        assert!(!std::mem::replace(&mut seen[index], true), "{spp}: {index}");
                    }
                }
            }
            assert!(!seen.contains(&false));
            // What is finished after a pass has no gaps either.
            let n_first = spp.min(16) as u64 * u64::from(width * height);
            if spp <= 16 || spp % 16 == 0 {
                assert!((0..16.min(spp)).all(|sample| index(4, 2, sample) < Some(n_first)));
            }
            assert_eq!(index(-1, 0, 0), None);
            assert_eq!(index(5, 0, 0), None);
        }
    }
}
