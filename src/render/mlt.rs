//! A picture by Metropolis light transport: chains are the units of work, merged in their order.
//!
//! Chains cover the full frame whatever the crop window, so that a pixel is the same bits with or without it.

use std::sync::atomic::AtomicBool;

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use crate::film::Film;
use crate::image::PixelRect;
use crate::integrator::Mlt;
use crate::integrator::bdpt::{Emitters, Tracer};
use crate::integrator::mlt::{Found, PrimarySample, evaluate};
use crate::render::{BlockResult, Job, RenderReport, Tally};
use crate::sampling::alias::AliasTable;
use crate::sampling::rng::{Rng, mix_bits};
use crate::spectrum::Rgb;
use crate::stop;

/// Tells the numbers of chains from those of the paths they start at.
const CHAIN_SEED: u64 = 0x9d39_247e_3377_6d41;
/// Chains that may wait, per thread, for an earlier one to be merged: they hold two splats for each mutation.
pub(super) const PENDING_PER_THREAD: usize = 2;
/// Bootstrap paths that one worker follows at a time.
const BOOTSTRAP_CHUNK: usize = 256;
/// Mutations after which a chain tells how far it is.
const MUTATIONS_PER_NEWS: u64 = 1024;
/// What a bootstrap path takes while the table of starts is built: its weight, a sum and a slot with its list.
const BYTES_PER_BOOTSTRAP_PATH: u128 = 32;

/// What the chains of a picture share.
pub(super) struct Metropolis<'a> {
    job: &'a Job,
    settings: Mlt,
    emitters: Emitters,
    /// Over the bootstrap paths, by luminance; `None` if all are black.
    starts: Option<AliasTable>,
    /// Mean luminance of the frame.
    brightness: f64,
    /// What happened while light was looked for.
    search: RenderReport,
}

/// Paths that are followed before the first chain.
pub(super) fn n_bootstrap_paths(settings: &Mlt) -> u64 {
    u64::from(settings.n_bootstrap) * (u64::from(settings.max_depth) + 1)
}

/// Mutations of all chains.
pub(super) fn n_mutations(job: &Job, settings: &Mlt) -> u64 {
    let [width, height] = job.film.resolution.map(u64::from);
    (width * height).saturating_mul(settings.mutations_per_pixel.into())
}

/// Bytes for the bootstrap, or for the splats of chains that wait to be merged, whatever is more. Splats are taken to
/// be spread evenly over the frame.
pub(super) fn bytes_needed(job: &Job, settings: &Mlt, n_threads: usize) -> u128 {
    let bootstrap = u128::from(n_bootstrap_paths(settings)) * BYTES_PER_BOOTSTRAP_PATH;
    let n_chains = u128::from(settings.n_chains.max(1));
    let n_waiting = n_chains.min((n_threads * PENDING_PER_THREAD) as u128);
    let [width, height] = job.film.resolution.map(u128::from);
    let n_pixels = job.film.crop.width as u128 * job.film.crop.height as u128;
    let n_splats = 2 * u128::from(n_mutations(job, settings)) * n_pixels / (width * height);
    let splats = n_splats * n_waiting / n_chains * Film::BYTES_PER_SPLAT as u128;
    bootstrap.max(splats)
}

impl<'a> Metropolis<'a> {
    /// Looks for paths that carry light. `None` if that was cancelled.
    pub(super) fn new(
        job: &'a Job,
        settings: &Mlt,
        tally: &Tally,
        cancel: &AtomicBool,
    ) -> Option<Self> {
        let mut metropolis = Self {
            job,
            settings: *settings,
            emitters: Emitters::new(&job.world, Mlt::LIGHT_STRATEGY),
            starts: None,
            brightness: 0.0,
            search: RenderReport::default(),
        };
        let n_paths = n_bootstrap_paths(settings) as usize;
        let starts: Vec<usize> = (0..n_paths).step_by(BOOTSTRAP_CHUNK).collect();
        let follow_chunk = |start: usize| {
            let mut tracer = metropolis.tracer();
            let paths = start..n_paths.min(start + BOOTSTRAP_CHUNK);
            let n_paths = paths.len() as u64;
            let mut report = RenderReport::default();
            let weights: Option<Vec<f32>> = paths
                .map(|index| {
                    let (mut sample, depth) = metropolis.bootstrap(index);
                    let (_, rgb) = metropolis.found(&mut tracer, depth, &mut sample);
                    report.bad_samples += u64::from(!job.can_be(rgb));
                    (!stop::is_requested()).then(|| brightness(rgb))
                })
                .collect();
            tally.add(n_paths);
            report.counters.add(tracer.counters());
            Some((weights?, report))
        };
        let follow = |&start: &usize| stop::heeding(cancel, || follow_chunk(start));
        let chunks: Option<Vec<_>> = starts.par_iter().map(follow).collect();
        let mut weights = Vec::with_capacity(n_paths);
        for (chunk, report) in chunks? {
            weights.extend(chunk);
            metropolis.search.add(&report);
        }
        let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
        metropolis.brightness = sum / f64::from(settings.n_bootstrap);
        metropolis.starts = AliasTable::new(&weights);
        Some(metropolis)
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
        .with_footprints(self.settings.mutations_per_pixel)
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

    /// What happened while light was looked for.
    pub(super) fn search(&self) -> &RenderReport {
        &self.search
    }

    /// Chains to run: none if no light was found.
    pub(super) fn n_chains(&self) -> usize {
        match self.starts {
            Some(_) => self.settings.n_chains as usize,
            None => 0,
        }
    }

    /// Follows a chain to its end, or to where it is cancelled: its mean is what it is good for either way.
    pub(super) fn run_chain(&self, chain: usize, tally: &Tally) -> BlockResult {
        let job = self.job;
        let mut result = BlockResult {
            film: job.film.start_block(PixelRect::from_size(0, 0)),
            strategies: Vec::new(),
            report: RenderReport::default(),
        };
        let BlockResult { film, report, .. } = &mut result;
        let Some(starts) = &self.starts else {
            return result;
        };
        let mut tracer = self.tracer();
        let mut rng = Rng::new(mix_bits(job.seed ^ CHAIN_SEED) ^ mix_bits(chain as u64));
        let u = rng.uniform_fine();
        let (mut sample, depth) = self.bootstrap(starts.sample(u).index);
        let mut current = self.found(&mut tracer, depth, &mut sample);
        sample.part(rng.next_u64());
        let share = |chain: usize| {
            let n_mutations = n_mutations(job, &self.settings);
            let (all, n) = (u128::from(n_mutations), self.n_chains() as u128);
            (all * chain as u128 / n) as u64
        };
        for _ in share(chain)..share(chain + 1) {
            sample.mutate();
            let proposed = self.found(&mut tracer, depth, &mut sample);
            // The path may have been cut short, and so may the one the chain starts at.
            if stop::is_requested() {
                report.cancelled = true;
                break;
            }
            film.count_light_path();
            report.samples += 1;
            if report.samples.is_multiple_of(MUTATIONS_PER_NEWS) {
                tally.add(MUTATIONS_PER_NEWS);
            }
            let (old, new) = (brightness(current.1), brightness(proposed.1));
            // No pixel and sample number lead back to a mutation.
            report.bad_samples += u64::from(!job.can_be(proposed.1));
            let acceptance = if new > 0.0 { (new / old).min(1.0) } else { 0.0 };
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
        tally.add(report.samples % MUTATIONS_PER_NEWS);
        report.counters.add(tracer.counters());
        result
    }
}

/// What chains visit places in proportion to, where light is taken away as well; 0 for what is no radiance.
fn brightness(rgb: Rgb) -> f32 {
    if rgb.is_finite() {
        rgb.map(f32::abs).luminance()
    } else {
        0.0
    }
}
