//! A picture by Metropolis light transport: chains are the units of work, merged in their order.
//!
//! Chains cover the full frame whatever the crop window, so that a pixel is the same bits with or without it.

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::image::PixelRect;
use crate::integrator::Mlt;
use crate::integrator::bdpt::{Emitters, Tracer};
use crate::integrator::mlt::{Found, PrimarySample, evaluate};
use crate::render::{BlockResult, Job, RenderReport};
use crate::sampling::alias::AliasTable;
use crate::sampling::rng::{Rng, mix_bits};
use crate::spectrum::Rgb;
use crate::world::LightStrategy;

/// Tells the numbers of chains from those of the paths they start at.
const CHAIN_SEED: u64 = 0x9d39_247e_3377_6d41;
/// Chains that may wait, per thread, for an earlier one to be merged: they hold two splats for each mutation.
pub(super) const PENDING_PER_THREAD: usize = 2;
/// Bootstrap paths that one worker follows at a time.
const BOOTSTRAP_CHUNK: usize = 1024;

/// What the chains of a picture share.
pub(super) struct Metropolis<'a> {
    job: &'a Job,
    settings: Mlt,
    emitters: Emitters,
    /// Over the bootstrap paths, by luminance; `None` if all are black.
    starts: Option<AliasTable>,
    /// Mean luminance of the frame.
    brightness: f64,
}

impl<'a> Metropolis<'a> {
    pub(super) fn new(job: &'a Job, settings: &Mlt) -> Self {
        let mut metropolis = Self {
            job,
            settings: *settings,
            emitters: Emitters::new(&job.world, LightStrategy::Power),
            starts: None,
            brightness: 0.0,
        };
        let n_paths = settings.n_bootstrap as usize * metropolis.n_lengths();
        let starts: Vec<usize> = (0..n_paths).step_by(BOOTSTRAP_CHUNK).collect();
        let chunks: Vec<Vec<f32>> = starts
            .par_iter()
            .map(|&start| {
                let mut tracer = metropolis.tracer();
                (start..n_paths.min(start + BOOTSTRAP_CHUNK))
                    .map(|index| {
                        let (mut sample, depth) = metropolis.bootstrap(index);
                        let (_, rgb) = metropolis.found(&mut tracer, depth, &mut sample);
                        brightness(rgb)
                    })
                    .collect()
            })
            .collect();
        let weights = chunks.concat();
        let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        metropolis.brightness = sum / f64::from(settings.n_bootstrap);
        metropolis.starts = AliasTable::new(&weights);
        metropolis
    }

    /// Numbers of scattering events.
    fn n_lengths(&self) -> usize {
        self.settings.max_depth as usize + 1
    }

    fn tracer(&self) -> Tracer<'_> {
        let job = self.job;
        Tracer::new(
            &job.world,
            &self.emitters,
            Some(&job.camera),
            self.settings.max_depth,
        )
    }

    /// A bootstrap path and its number of scattering events.
    fn bootstrap(&self, index: usize) -> (PrimarySample, u32) {
        let key = mix_bits(self.job.seed) ^ mix_bits(index as u64);
        let depth = index % self.n_lengths();
        (PrimarySample::new(key, &self.settings), depth as u32)
    }

    fn found(&self, tracer: &mut Tracer, depth: u32, sample: &mut PrimarySample) -> Found {
        let job = self.job;
        evaluate(tracer, &job.camera, job.film.resolution, depth, sample)
    }

    /// Chains to run: none if no light was found.
    pub(super) fn n_chains(&self) -> usize {
        match self.starts {
            Some(_) => self.settings.n_chains as usize,
            None => 0,
        }
    }

    /// All mutations.
    pub(super) fn n_mutations(&self) -> u64 {
        let [width, height] = self.job.film.resolution.map(u64::from);
        width * height * u64::from(self.settings.mutations_per_pixel)
    }

    pub(super) fn run_chain(&self, chain: usize) -> BlockResult {
        let job = self.job;
        let mut film = job.film.start_block(PixelRect::from_size(0, 0));
        let mut report = RenderReport::default();
        let Some(starts) = &self.starts else {
            return BlockResult { film, report };
        };
        let mut tracer = self.tracer();
        let mut rng = Rng::new(mix_bits(job.seed ^ CHAIN_SEED) ^ mix_bits(chain as u64));
        let u = (rng.next_u64() >> 11) as f64 * (0.5 / (1u64 << 52) as f64);
        let (mut sample, depth) = self.bootstrap(starts.sample(u).index);
        let mut current = self.found(&mut tracer, depth, &mut sample);
        sample.part(rng.next_u64());
        let share = |chain: usize| {
            let (all, n) = (u128::from(self.n_mutations()), self.n_chains() as u128);
            (all * chain as u128 / n) as u64
        };
        for _ in share(chain)..share(chain + 1) {
            report.samples += 1;
            film.count_light_path();
            sample.mutate();
            let proposed = self.found(&mut tracer, depth, &mut sample);
            let (old, new) = (brightness(current.1), brightness(proposed.1));
            if !proposed.1.is_finite() {
                report.bad_samples += 1;
                let pixel = proposed.0.map(|r| r as i32);
                report.first_bad_sample.get_or_insert((pixel, 0));
            }
            let acceptance = (new / old).min(1.0);
            // Both states count by their probabilities, which the choice between them only samples.
            for ((raster, rgb), luminance, probability) in [
                (proposed, new, acceptance),
                (current, old, 1.0 - acceptance),
            ] {
                if probability > 0.0 {
                    let scale = self.brightness * f64::from(probability) / f64::from(luminance);
                    film.add_splat(&job.film, raster, rgb * scale as f32);
                }
            }
            if rng.uniform() < acceptance {
                sample.accept();
                current = proposed;
            } else {
                sample.reject();
            }
        }
        report.counters.add(tracer.counters());
        BlockResult { film, report }
    }
}

/// What chains visit places in proportion to; 0 for what is no radiance.
fn brightness(rgb: Rgb) -> f32 {
    let luminance = rgb.luminance();
    if rgb.is_finite() && luminance > 0.0 {
        luminance
    } else {
        0.0
    }
}
