//! Paths in a cloud that share what they find.
//!
//! Where two paths from the camera scatter close to each other, either could have gone on to where the other scatters
//! next. So each path gets a part of what all paths beside it find from their second collisions on: that of path *i*,
//! which scatters first at xᵢ and then at yᵢ, counts for path *k* in proportion to the density, transmittance over squared
//! distance, with which yᵢ would have been drawn from xₖ. These parts are the balance heuristic among all who might have
//! drawn yᵢ, and sum to 1 over k (Bekaert, Sbert and Halton 2002, *Accelerating Path Tracing by Re-Using Paths*). No
//! picture changes by that but for its noise: a pixel sees the mean of many more walks than start in it.
//!
//! Who shares with whom depends on first collisions alone. Groups reach across the pixels of a tile, further than along
//! the view: what paths of one pixel find is averaged there anyway. Tiles are aligned to raster (0, 0) and always
//! followed as a whole, so that a crop window changes nothing.

use crate::film::{Film, FilmBlock};
use crate::image::PixelRect;
use crate::integrator::Counters;
use crate::integrator::path::{Found, Path};
use crate::integrator::trace::Unobserved;
use crate::math::{Frame, Point3, Ray, Vec3};
use crate::medium::GridMedium;
use crate::render::{Job, RenderReport, Task, overlap, trace_camera_ray};
use crate::spectrum::Rgb;
use crate::stop;

/// Edge length of a tile in pixels.
const TILE: i32 = 8;
/// Most paths in a group.
const GROUP: usize = 8;
/// How much shorter groups are along the view than across it.
const FLATTENING: f32 = 2.0;

/// The scene's cloud, and the integrator, if paths are to share.
pub(super) struct Sharing<'a> {
    job: &'a Job,
    path: &'a Path,
    cloud: &'a GridMedium,
    /// Pixels that samples are taken in without a crop window.
    frame: PixelRect,
}

/// A sample whose path has been followed.
struct Followed {
    pixel: [i32; 2],
    sample: u32,
    raster: [f64; 2],
    /// What the camera multiplies it by.
    weight: f32,
    found: Found,
    /// The part of what others and itself have found beyond their second collisions.
    shared: Rgb,
}

/// A first collision.
#[derive(Clone, Copy)]
struct Member {
    /// Index of the sample.
    index: usize,
    p: Point3,
    /// Where it counts for groups: along the view it is further away from others.
    place: [f32; 3],
}

impl<'a> Sharing<'a> {
    /// `None` if there is nothing to share.
    pub(super) fn new(job: &'a Job, film: &Film) -> Option<Self> {
        let path = job.integrator.volumetric()?;
        let cloud = job.world.shared_cloud()?;
        // Light that is cut off for each sample is not the same when samples share.
        let is_whole = job.film.max_sample_luminance == f32::INFINITY;
        (is_whole && path.max_depth >= 2).then(|| Self {
            job,
            path,
            cloud,
            frame: film.full_sample_bounds(),
        })
    }

    /// Adds the samples of a task.
    pub(super) fn render(&self, task: &Task, film: &mut FilmBlock, report: &mut RenderReport) {
        let block = task.block;
        let ends = [
            block.x0 + block.width as i32,
            block.y0 + block.height as i32,
        ];
        let starts = |from: i32, to: i32| {
            (from.div_euclid(TILE)..=(to - 1).div_euclid(TILE)).map(|tile| tile * TILE)
        };
        let mut samples = Vec::new();
        let mut members = Vec::new();
        for y in starts(block.y0, ends[1]) {
            for x in starts(block.x0, ends[0]) {
                if !self.is_asked_for([x, y]) {
                    continue;
                }
                samples.clear();
                members.clear();
                self.follow(
                    [x, y],
                    task,
                    &mut samples,
                    &mut members,
                    &mut report.counters,
                );
                // What an unfinished tile would share is not known.
                if stop::is_requested() {
                    report.cancelled = true;
                    return;
                }
                self.share(&mut members, &mut samples);
                for sample in samples
                    .iter()
                    .filter(|sample| self.is_wanted(sample, &block))
                {
                    self.add(sample, film, report);
                }
            }
        }
    }

    /// Whether any pixel of the tile is to be rendered, as far as pixel bounds go.
    fn is_asked_for(&self, [x0, y0]: [i32; 2]) -> bool {
        let (width, height) = (TILE as usize, TILE as usize);
        let tile = PixelRect {
            x0,
            y0,
            width,
            height,
        };
        self.job.pixel_bounds.is_none_or(|bounds| {
            let (width, height) = overlap(&tile, &bounds);
            width > 0 && height > 0
        })
    }

    fn is_wanted(&self, sample: &Followed, block: &PixelRect) -> bool {
        let bounds = self.job.pixel_bounds;
        block.holds(sample.pixel) && bounds.is_none_or(|bounds| bounds.holds(sample.pixel))
    }

    fn add(&self, sample: &Followed, film: &mut FilmBlock, report: &mut RenderReport) {
        report.samples += 1;
        let radiance = sample.found.radiance + sample.shared;
        if self.job.can_be(sample.found.total()) && self.job.can_be(radiance) {
            film.add_sample(&self.job.film, sample.raster, radiance, sample.weight);
        } else {
            report.leave_out(sample.pixel, sample.sample);
        }
    }

    /// Follows the paths of a tile.
    fn follow(
        &self,
        [x0, y0]: [i32; 2],
        task: &Task,
        samples: &mut Vec<Followed>,
        members: &mut Vec<Member>,
        counters: &mut Counters,
    ) {
        let mut view: Option<Frame> = None;
        let pixels = (y0..y0 + TILE).flat_map(|y| (x0..x0 + TILE).map(move |x| [x, y]));
        for pixel in pixels.filter(|&pixel| self.frame.holds(pixel)) {
            for sample in task.first_sample..task.first_sample + task.n_samples {
                let follow = |ray: Ray, differential: Option<&_>, sampler: &mut _| {
                    let found = self.path.find::<true, _>(
                        &self.job.world,
                        ray,
                        differential,
                        sampler,
                        counters,
                        &mut Unobserved,
                    );
                    (ray, found)
                };
                let (raster, followed) = trace_camera_ray(self.job, pixel, sample, follow);
                if stop::is_requested() {
                    return;
                }
                let mut followed_sample = Followed {
                    pixel,
                    sample,
                    raster,
                    weight: 1.0,
                    found: Found::NOTHING,
                    shared: Rgb::BLACK,
                };
                if let Some((weight, (ray, found))) = followed {
                    (followed_sample.weight, followed_sample.found) = (weight, found);
                    if let Some(junction) = found.junction {
                        let view = view.get_or_insert_with(|| Frame::from_z(ray.d));
                        let place = view.to_local(Vec3(junction.first.0));
                        members.push(Member {
                            index: samples.len(),
                            p: junction.first,
                            place: [place.x(), place.y(), place.z() * FLATTENING],
                        });
                    }
                }
                samples.push(followed_sample);
            }
        }
    }

    /// Gives each of some paths its part of what they all find.
    fn share(&self, members: &mut [Member], samples: &mut [Followed]) {
        if members.len() > GROUP {
            let middle = halve(members);
            let (near, far) = members.split_at_mut(middle);
            self.share(near, samples);
            self.share(far, samples);
            return;
        }
        let mut densities = [0.0; GROUP];
        for member in members.iter() {
            let junction = samples[member.index].found.junction;
            let Some((second, beyond)) = junction.and_then(|junction| junction.second) else {
                continue;
            };
            if beyond.is_black() {
                continue;
            }
            let mut total = 0.0;
            for (density, from) in densities.iter_mut().zip(members.iter()) {
                *density = self.density(from.p, second);
                total += *density;
            }
            // Places that cannot be told apart have no densities: then each keeps its own.
            let can_share = total > 0.0 && total < f64::INFINITY && self.job.can_be(beyond);
            if !can_share {
                samples[member.index].shared += beyond;
                continue;
            }
            for (density, to) in densities.iter().zip(members.iter()) {
                samples[to.index].shared += beyond * (density / total) as f32;
            }
        }
    }

    /// Density, up to a factor and the extinction at `second`, with which a path that scatters at `first` scatters next at
    /// `second`.
    fn density(&self, first: Point3, second: Point3) -> f64 {
        let depth = self.cloud.depth_between(first, second);
        (-depth).exp() / (second.0 - first.0).as_dvec3().length_squared()
    }
}

/// Brings the half of members that is low along the axis they are farthest apart on to the front: its length.
fn halve(members: &mut [Member]) -> usize {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for member in members.iter() {
        for axis in 0..3 {
            low[axis] = low[axis].min(member.place[axis]);
            high[axis] = high[axis].max(member.place[axis]);
        }
    }
    let extent = |axis: &usize| high[*axis] - low[*axis];
    let axis = (0..3)
        .max_by(|a, b| extent(a).total_cmp(&extent(b)))
        .unwrap_or(0);
    let middle = members.len() / 2;
    members.select_nth_unstable_by(middle, |a, b| {
        (a.place[axis].total_cmp(&b.place[axis])).then(a.index.cmp(&b.index))
    });
    middle
}
