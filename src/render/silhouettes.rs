//! Silhouettes of lamps. A lamp is often a thousand times brighter than what is around it: the error of a picture is then
//! that of the pixels its silhouette runs through, and there it is how evenly the samples cover a pixel. What the camera
//! sees directly costs one ray where a path costs ten. So there the light that a path sees directly is a control variate:
//! it is replaced by the mean of what several rays see (splitting; Arvo and Kirk 1990, *Particle Transport and Image
//! Synthesis*).
//!
//! Which pixels these are is asked of the corners of pixels, and by nothing that is random: whatever the answer, pictures
//! converge to the same.

use arrayvec::ArrayVec;

use super::{Job, Taken};
use crate::camera::{CameraRay, CameraSample};
use crate::film::{BLOCK, FilmBlock};
use crate::image::PixelRect;
use crate::integrator::Counters;
use crate::sampler::Sampler;
use crate::spectrum::Rgb;

/// Rays for each path. With 16 samples a pixel, 256 points cover it.
const RAYS: u32 = 16;
/// Keeps their places apart from the numbers of the path.
const SEED: u64 = 0x3c6e_f372_fe94_f82b;
/// Corners of a block's pixels and of those around it, along an edge.
const CORNERS: usize = BLOCK as usize + 3;

/// Pixels of one block that the silhouette of a lamp runs through or passes by: at least one corner of theirs, or of a
/// pixel beside them, sees other lamps than the rest.
pub(super) struct Silhouettes {
    origin: [i32; 2],
    /// Bit x of row y.
    near: [u16; BLOCK as usize],
}

// A row of a block is a number of 16 bits.
const _: () = assert!(BLOCK == 16);

impl Silhouettes {
    /// Looks for them; `None` where there are none, or where light that is seen directly cannot be told apart.
    pub(super) fn find(job: &Job, block: PixelRect, counters: &mut Counters) -> Option<Self> {
        if !Self::may_be_in(job) {
            return None;
        }
        let origin = [block.x0, block.y0];
        let mut seen = [[Rgb::BLACK; CORNERS]; CORNERS];
        for (y, row) in seen[..block.height + 3].iter_mut().enumerate() {
            for (x, seen) in row[..block.width + 3].iter_mut().enumerate() {
                let corner = [x, y].map(|i| i as f64 - 1.0);
                let sample = CameraSample {
                    raster: [0, 1].map(|axis| f64::from(origin[axis]) + corner[axis]),
                    time: 0.5,
                    lens: [0.5; 2],
                };
                if let Some(CameraRay { ray, .. }) = job.camera.ray(&sample) {
                    counters.rays += 1;
                    *seen = job.world.lamp_seen(&ray).unwrap_or_default();
                }
            }
        }
        let mut near = [0; BLOCK as usize];
        for (y, row) in near[..block.height].iter_mut().enumerate() {
            for x in 0..block.width {
                let mut corners = seen[y..y + 4].iter().flat_map(|row| &row[x..x + 4]);
                let is_near = corners.any(|corner| *corner != seen[y][x]);
                *row |= u16::from(is_near) << x;
            }
        }
        (near != [0; BLOCK as usize]).then_some(Self { origin, near })
    }

    /// Whether there is anything to look for. Samples that are limited in brightness are so as a whole.
    fn may_be_in(job: &Job) -> bool {
        let is_limited = job.film.max_sample_luminance < f32::INFINITY;
        // Where samples have weights, those of the two parts would differ.
        let is_even = job.film.filter.is_even_within_a_pixel();
        job.world.facts().has_lamps
            && job.integrator.sees_lights_directly(&job.world)
            && !job.pixel_centers
            && !is_limited
            && is_even
    }

    /// Whether a pixel is one of them.
    pub(super) fn are_near(&self, pixel: [i32; 2]) -> bool {
        let [x, y] = [0, 1].map(|axis| (pixel[axis] - self.origin[axis]) as usize);
        self.near[y] >> x & 1 == 1
    }
}

/// Adds a sample of a pixel near a silhouette: its path without the light that the camera sees directly, and that light
/// from rays of its own. False if some radiance is none; all of the sample is then left out.
pub(super) fn add_split(
    job: &Job,
    pixel: [i32; 2],
    sample: u32,
    taken: &Taken,
    film: &mut FilmBlock,
    counters: &mut Counters,
) -> bool {
    let mut sampler = Sampler::of_kind(job.sampler, job.seed ^ SEED, pixel, sample);
    let places = sampler.array(RAYS);
    let times = sampler.array(RAYS);
    let lenses = sampler.array(RAYS);
    let directly: ArrayVec<Part, { RAYS as usize }> = (0..RAYS)
        .map(|i| {
            let camera_sample = CameraSample {
                raster: job.film.position(pixel, places.get_2d(i)),
                time: times.get_1d(i),
                lens: lenses.get_2d(i),
            };
            let ray = job.camera.ray(&camera_sample);
            Part {
                raster: camera_sample.raster,
                radiance: ray.map_or(Rgb::BLACK, |seen| job.world.light_seen(&seen.ray)),
                weight: ray.map_or(1.0, |seen| seen.weight),
            }
        })
        .collect();
    if !directly.iter().all(|part| job.can_be(part.radiance)) {
        return false;
    }
    let seen = taken
        .ray
        .map_or(Rgb::BLACK, |ray| job.world.light_seen(&ray));
    counters.rays += u64::from(RAYS) + 1;
    let rest = taken.radiance - seen;
    film.add_part(&job.film, taken.raster, rest, taken.weight, 0.0);
    let share = 1.0 / f64::from(RAYS);
    for part in directly {
        let weight = part.weight * share as f32;
        film.add_part(&job.film, part.raster, part.radiance, weight, share);
    }
    true
}

/// What one of the rays sees.
struct Part {
    raster: [f64; 2],
    radiance: Rgb,
    weight: f32,
}
