//! Blocks of a picture by bidirectional path tracing: every camera sample has a light path beside it, which may
//! arrive in any pixel.
//!
//! A crop window needs the light paths of the full frame: outside it only they are followed, so that a pixel is the
//! same bits with or without it.

use crate::camera::{Camera, CameraRay};
use crate::film::{Film, FilmBlock};
use crate::image::PixelRect;
use crate::integrator::Bdpt;
use crate::integrator::bdpt::{Emitters, Tracer};
use crate::render::strategies::{StrategyBlocks, StrategyFilms};
use crate::render::{BlockResult, Job, RenderReport, Task, camera_sample, is_radiance};
use crate::sampler::Sampler;
use crate::spectrum::Rgb;

/// Tells the numbers of light paths from those of camera paths.
const LIGHT_SEED: u64 = 0x5851_f42d_4c95_7f2d;
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
}

/// A block of the picture in the making.
struct Canvas<'a> {
    film: FilmBlock,
    strategies: Option<StrategyBlocks<'a>>,
}

impl<'a> Bidirectional<'a> {
    pub(super) fn new(job: &'a Job, bdpt: &Bdpt, sampled: PixelRect) -> Self {
        // Both kinds of samples must cover the frame alike for their weights to fit together.
        let is_covered = !job.pixel_centers
            && job.film.filter.radius().iter().all(|&r| r >= HALF_PIXEL)
            && job.camera.receives_light();
        Self {
            job,
            max_depth: bdpt.max_depth,
            emitters: Emitters::new(&job.world, bdpt.light_strategy),
            film: is_covered.then_some(&job.camera),
            sampled,
            strategies: bdpt.visualized.map(|shown| StrategyFilms::new(job, shown)),
        }
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
        let n_pixels = self.job.film.resolution.map(u64::from).iter().product();
        let mut tracer = Tracer::new(&self.job.world, &self.emitters, self.film, self.max_depth)
            .over_pixels(n_pixels);
        let block = task.block;
        for y in block.y0..block.y0 + block.height as i32 {
            for x in block.x0..block.x0 + block.width as i32 {
                for sample in task.first_sample..task.first_sample + task.n_samples {
                    let is_sampled = self.is_wanted([x, y]) && self.sampled.holds([x, y]);
                    report.samples += u64::from(is_sampled);
                    if !self.render_sample([x, y], sample, is_sampled, &mut tracer, &mut canvas) {
                        report.bad_samples += 1;
                        report.first_bad_sample.get_or_insert(([x, y], sample));
                    }
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

    /// False if something found is no radiance; it is then left out.
    fn render_sample(
        &self,
        pixel: [i32; 2],
        sample: u32,
        is_sampled: bool,
        tracer: &mut Tracer<'a>,
        canvas: &mut Canvas,
    ) -> bool {
        let job = self.job;
        let Canvas { film, strategies } = canvas;
        let [width, height] = job.film.resolution.map(|side| side as usize);
        let is_in_frame = self.film.is_some() && PixelRect::from_size(width, height).holds(pixel);
        if !is_in_frame && !is_sampled {
            return true;
        }
        let mut sampler = Sampler::of_kind(job.sampler, job.seed, pixel, sample);
        let mut light_sampler = Sampler::of_kind(job.sampler, job.seed ^ LIGHT_SEED, pixel, sample);
        let camera_sample = camera_sample(job, pixel, &mut sampler);
        let mut is_good = true;
        tracer.start(
            job.camera.time(&camera_sample),
            light_sampler.stream().next_u64(),
        );
        tracer.trace_light(&mut light_sampler);
        if is_in_frame {
            film.count_light_path();
            if let Some(strategies) = strategies {
                strategies.count_light_path();
            }
            tracer.splats(&mut light_sampler, |strategy, raster, found| {
                let rgb = found.weighted();
                if !is_radiance(rgb) {
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
            return is_good;
        }
        let (radiance, weight) = match job.camera.ray(&camera_sample) {
            Some(CameraRay { ray, weight }) => {
                let radiance = tracer.radiance(ray, &mut sampler, |strategy, found| {
                    if let Some(strategies) = strategies {
                        strategies.note(strategy, found);
                    }
                });
                (radiance, weight)
            }
            None => (Rgb::BLACK, 1.0),
        };
        if is_radiance(radiance) {
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
        is_good
    }
}
