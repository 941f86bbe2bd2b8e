//! The schedule of photon mapping: in every iteration photons fly, and each pixel looks for those near the end of a
//! camera path of its own.
//!
//! Photons are kept in batches of bounded size, whatever their number and that of the iterations. A batch that is not
//! the iteration's last makes the camera paths be followed once more, by the same random numbers.

use std::ops::Range;
use std::sync::atomic::AtomicBool;

use rayon::prelude::{
    IndexedParallelIterator, IntoParallelIterator, ParallelIterator, ParallelSliceMut,
};

use super::{Job, Progress, RenderReport, Rendered, Tally};
use crate::camera::{CameraRay, CameraSample};
use crate::image::Image;
use crate::integrator::sppm::{Gathered, Photon, PhotonMap, PhotonStatistics};
use crate::integrator::{Counters, Sppm};
use crate::light::LightChoice;
use crate::math::Point3;
use crate::sampler::Sampler;
use crate::sampling::rng::mix_bits;
use crate::spectrum::Rgb;
use crate::stop;
use crate::world::LightStrategy;

/// Photons that make a batch full. Part of the order of addition, as the next two are.
const FULL_BATCH: usize = 1 << 21;
/// Most photons that leave lights between two looks at the batch.
const WAVE: usize = 1 << 13;
/// What a photon of a batch takes while it is sorted: two copies of it, and two of its place with two numbers.
const BYTES_PER_PHOTON: usize = 2 * size_of::<Photon>() + 2 * size_of::<Point3>() + 8;
/// Parts of a wave that threads take.
const PARTS: usize = 64;
/// Pixels that a thread takes.
const RUN: usize = 256;
/// Most photons of an iteration that are chosen for the sake of the frame's size.
const MAX_DEFAULT_PHOTONS: u64 = 1 << 30;

/// A pixel in the making.
#[derive(Clone, Debug)]
struct Pixel {
    /// Iterations that count.
    n_samples: u32,
    /// Sum over them of what needs no photons.
    radiance: [f64; 3],
    photons: PhotonStatistics,
    /// What the batches of the current iteration brought.
    gathered: Gathered,
}

/// What all iterations share.
struct Pass<'a> {
    job: &'a Job,
    sppm: &'a Sppm,
    lights: LightChoice,
    /// Photons of an iteration.
    n_photons: u32,
    cancel: &'a AtomicBool,
}

/// Renders on the current rayon thread pool. `cancel` stops it between pixels, or amid a path; every pixel is then what
/// its own whole iterations made of it.
pub(super) fn render(
    job: &Job,
    sppm: &Sppm,
    progress: &dyn Progress,
    cancel: &AtomicBool,
) -> Rendered {
    let pass = Pass {
        job,
        sppm,
        lights: job.world.emitter_choice(LightStrategy::Power, |_| true),
        n_photons: n_photons(job, sppm),
        cancel,
    };
    let crop = job.film.crop;
    let pixel = Pixel {
        n_samples: 0,
        radiance: [0.0; 3],
        photons: PhotonStatistics::new(sppm.radius),
        gathered: Gathered::default(),
    };
    let mut pixels = vec![pixel; crop.width * crop.height];
    let mut report = RenderReport::default();
    let tally = Tally::new(progress, pixels.len() as u64 * u64::from(job.spp));
    let finished = (0..job.spp)
        .try_for_each(|iteration| pass.iterate(iteration, &mut pixels, &mut report, &tally));
    report.cancelled |= finished.is_none();
    let mut rendered = Rendered {
        image: pass.develop(&pixels),
        strategies: Vec::new(),
        report,
        samples_per_pixel: 0.0,
    };
    rendered.count_samples(pixels.len());
    rendered
}

/// Photons of an iteration: none without lights. Their number must not depend on the crop window.
fn n_photons(job: &Job, sppm: &Sppm) -> u32 {
    if job.world.n_lights() == 0 {
        return 0;
    }
    sppm.photons_per_iteration.unwrap_or_else(|| {
        let [width, height] = job.film.resolution.map(u64::from);
        (width * height).min(MAX_DEFAULT_PHOTONS) as u32
    })
}

/// Bytes for the pixels, the picture, and a batch of photons while it is sorted.
pub(super) fn bytes_needed(job: &Job, sppm: &Sppm) -> u128 {
    let crop = job.film.crop;
    let n_pixels = crop.width as u128 * crop.height as u128;
    let pixels = n_pixels * (size_of::<Pixel>() + size_of::<[f32; 3]>()) as u128;
    let n_stored = u128::from(n_photons(job, sppm)) * u128::from(sppm.max_depth.saturating_sub(1));
    pixels + n_stored.min(FULL_BATCH as u128) * BYTES_PER_PHOTON as u128
}

impl Pass<'_> {
    /// One iteration; `None` if it was cancelled.
    fn iterate(
        &self,
        iteration: u32,
        pixels: &mut [Pixel],
        report: &mut RenderReport,
        tally: &Tally,
    ) -> Option<()> {
        let mut next = 0;
        loop {
            let map = self.trace_batch(iteration, &mut next, &mut report.counters)?;
            let is_last = next == self.n_photons;
            let run = |(run, pixels): (usize, &mut [Pixel])| {
                let mut report = RenderReport::default();
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    self.gather(run * RUN + i, iteration, &map, is_last, pixel, &mut report);
                    if stop::is_requested() {
                        report.cancelled = true;
                        return report;
                    }
                }
                if is_last {
                    tally.add(pixels.len() as u64);
                }
                report
            };
            let runs: Vec<RenderReport> = pixels
                .par_chunks_mut(RUN)
                .enumerate()
                .map(|part| stop::heeding(self.cancel, || run(part)))
                .collect();
            runs.iter().for_each(|run| report.add(run));
            if report.cancelled {
                return None;
            }
            if is_last {
                return Some(());
            }
        }
    }

    /// Lets photons fly, from number `next` on, until there are enough.
    fn trace_batch(
        &self,
        iteration: u32,
        next: &mut u32,
        counters: &mut Counters,
    ) -> Option<PhotonMap> {
        let mut photons = Vec::new();
        // Long paths leave many photons.
        let wave = FULL_BATCH / (self.sppm.max_depth.max(1) as usize);
        let wave = wave.clamp(1, WAVE) as u32;
        let part = wave.div_ceil(PARTS as u32);
        while photons.len() < FULL_BATCH && *next < self.n_photons {
            let end = (*next + wave.min(self.n_photons - *next)) as usize;
            let trace = |numbers: Range<usize>| {
                let (mut photons, mut counters) = (Vec::new(), Counters::default());
                for photon in numbers {
                    self.sppm.trace_photon(
                        &self.job.world,
                        &self.lights,
                        self.job.camera.shutter(),
                        &mut photon_sampler(self.job.seed, iteration, photon as u32),
                        &mut photons,
                        &mut counters,
                    );
                    // Without all of its photons an iteration is none.
                    if stop::is_requested() {
                        return None;
                    }
                }
                Some((photons, counters))
            };
            let parts: Option<Vec<_>> = (*next as usize..end)
                .step_by(part as usize)
                .collect::<Vec<_>>()
                .into_par_iter()
                .map(|first| {
                    stop::heeding(self.cancel, || {
                        trace(first..(first + part as usize).min(end))
                    })
                })
                .collect();
            for (part, counted) in parts? {
                photons.extend(part);
                counters.add(&counted);
            }
            *next = end as u32;
        }
        Some(PhotonMap::new(&photons))
    }

    /// Follows the camera path of a pixel and gathers photons where it ends. The last batch of an iteration concludes
    /// it.
    fn gather(
        &self,
        index: usize,
        iteration: u32,
        map: &PhotonMap,
        is_last: bool,
        pixel: &mut Pixel,
        report: &mut RenderReport,
    ) {
        let (job, crop) = (self.job, self.job.film.crop);
        let [x, y] = [index % crop.width, index / crop.width];
        let place = [crop.x0 + x as i32, crop.y0 + y as i32];
        let mut sampler = Sampler::new(job.seed, place, iteration);
        let u = sampler.get_2d();
        let camera_sample = CameraSample {
            raster: [0, 1].map(|axis| f64::from(place[axis]) + f64::from(u[axis])),
            time: sampler.get_1d(),
            lens: sampler.get_2d(),
        };
        let Some(CameraRay { ray, weight }) = job.camera.ray(&camera_sample) else {
            // Nothing passes the lens here: black, and as much a sample as any other.
            pixel.n_samples += u32::from(is_last);
            report.samples += u64::from(is_last);
            return;
        };
        let differential = job.world.facts().needs_footprint.then(|| {
            let step = 1.0 / f64::from(job.spp).sqrt();
            job.camera.differential(&camera_sample, step)
        });
        let path = self.sppm.camera_path(
            &job.world,
            ray,
            differential.flatten().as_ref(),
            &mut sampler,
            &mut report.counters,
        );
        let mut beta = Rgb::BLACK;
        if let Some(point) = &path.visible_point {
            map.gather(point, pixel.photons.radius(), &mut pixel.gathered);
            beta = point.beta * weight;
        }
        if is_last && !stop::is_requested() {
            report.samples += 1;
            let is_good = pixel.conclude(job, path.radiance * weight, beta);
            if !is_good {
                report.leave_out(place, iteration);
            }
        }
    }

    /// The picture so far: box-filtered means, negative values cut to 0, times the film's scale.
    fn develop(&self, pixels: &[Pixel]) -> Image {
        let (crop, scale) = (self.job.film.crop, self.job.film.scale);
        let data = pixels
            .iter()
            .flat_map(|pixel| {
                pixel
                    .radiance(self.n_photons)
                    .map(|c| (c.max(0.0) * scale) as f32)
            })
            .collect();
        Image::new(crop.width, crop.height, 3, data)
            .expect("a film has pixels, three channels each")
    }
}

impl Pixel {
    /// Ends an iteration. False if what it found is no radiance; it is then left out.
    fn conclude(&mut self, job: &Job, radiance: Rgb, beta: Rgb) -> bool {
        let gathered = std::mem::take(&mut self.gathered);
        let phi = Rgb::from_array(gathered.phi.map(|c| c as f32)) * beta;
        if !job.can_be(radiance) || !job.can_be(phi) {
            return false;
        }
        self.n_samples += 1;
        for (sum, c) in self.radiance.iter_mut().zip(radiance.to_array()) {
            *sum += f64::from(c);
        }
        self.photons
            .update(&gathered, beta.to_array().map(f64::from));
        true
    }

    fn radiance(&self, n_photons: u32) -> [f64; 3] {
        if self.n_samples == 0 {
            return [0.0; 3];
        }
        let n_samples = f64::from(self.n_samples);
        let n_emitted = n_samples * f64::from(n_photons.max(1));
        let indirect = self.photons.radiance(n_emitted);
        [0, 1, 2].map(|c| self.radiance[c] / n_samples + indirect[c])
    }
}

/// The random numbers of a photon. The photons of an iteration share their sequences, as the samples of a pixel do.
fn photon_sampler(seed: u64, iteration: u32, photon: u32) -> Sampler {
    Sampler::new(
        mix_bits(seed ^ 0x3c6e_f372_fe94_f82b),
        [iteration as i32, 0],
        photon,
    )
}
