//! Where light that goes below a surface comes back (pbrt 3rd ed., section 15.4.1; King et al. 2013).
//!
//! A distance is drawn from the profile in the plane across one of three axes, and a line along that axis is searched
//! for surfaces of the same material. One of those found is kept, in proportion to what it contributes.

use std::f32::consts::TAU;

use crate::ids::MaterialId;
use crate::integrator::Counters;
use crate::math::{Frame, Ray, Vec3};
use crate::sampler::Sampler;
use crate::sampling::rng::Rng;
use crate::scatter::Bssrdf;
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::world::{Hit, World, spawn_ray};

/// Where light enters.
#[derive(Clone, Copy, Debug)]
pub struct Entry<'a> {
    /// The surface there.
    pub surface: &'a SurfacePoint,
    /// Its shading frame.
    pub frame: &'a Frame,
    /// Its material.
    pub material: MaterialId,
    /// The time.
    pub time: f32,
}

/// Where light comes back.
#[derive(Clone, Copy, Debug)]
pub struct Exit {
    /// The ray that found it, from either side.
    pub ray: Ray,
    /// The hit.
    pub hit: Hit,
    /// The surface there.
    pub surface: SurfacePoint,
    /// Throughput factor Sp / density.
    pub weight: Rgb,
}

/// Axes of the search, as (x, y, z) of the plane and the line, and their probabilities.
const AXES: [([usize; 3], f32); 3] = [([0, 1, 2], 0.5), ([1, 2, 0], 0.25), ([2, 0, 1], 0.25)];
/// Surfaces found on a line after which the search goes on with probability one half; and again after as many.
const ROULETTE_EVERY: usize = 32;

/// Draws an exit for a path of throughput `beta`. `None` where none is found.
pub fn sample_exit(
    world: &World,
    entry: &Entry,
    bssrdf: &Bssrdf,
    beta: Rgb,
    sampler: &mut Sampler,
    rng: &mut Rng,
    counters: &mut Counters,
) -> Option<Exit> {
    let channels = ChannelChoice::new(bssrdf, beta)?;
    let (u_axis, [u_radius, u_angle]) = (sampler.get_1d(), sampler.get_2d());
    let (axis, u_channel) = choose_axis(u_axis);
    let channel = channels.choose(u_channel);
    let r = bssrdf.sample_radius(channel, u_radius)?;
    let axes = [entry.frame.s, entry.frame.t, entry.frame.n];
    let [x, y, z] = AXES[axis].0.map(|k| axes[k]);

    // The line reaches as far as the profile of the channel does, or the scene.
    let bounds = world.bounds();
    let across = (bounds.max - bounds.min).length();
    let reach = bssrdf.max_radius(channel);
    if !(r < reach && r <= across) {
        return None;
    }
    let half = ((reach - r) * (reach + r)).sqrt().min(across);
    let (sin, cos) = (TAU * u_angle).sin_cos();
    let p = entry.surface.p;
    // From near the middle outward, so that what counts most is found first; not from the middle itself, which may
    // lie on the surface.
    let aside = r.min(half);
    let start = p + (x * cos + y * sin) * r - z * aside;

    let mut found = Reservoir::default();
    for (d, length) in [(z, half + aside), (-z, half - aside)] {
        let mut ray = Ray {
            o: start,
            d,
            time: entry.time,
        };
        let end = start + d * length;
        let (mut roulette, mut n_found) = (1.0, 0);
        loop {
            let left = (end - ray.o).dot(d);
            if left <= 0.0 {
                break;
            }
            if counters.next_ray() {
                return None;
            }
            let Some(hit) = world.closest_of_material(&ray, left, entry.material) else {
                break;
            };
            let surface = world.surface(&ray, &hit);
            let offset = surface.p - p;
            let pdf = density(bssrdf, &channels, &axes, offset, &surface);
            let weight = bssrdf.sp(offset.length()) * (roulette / pdf);
            let exit = Exit {
                ray,
                hit,
                surface,
                weight,
            };
            found.offer(exit, (weight * beta).max_component(), rng);
            n_found += 1;
            if n_found % ROULETTE_EVERY == 0 {
                if rng.uniform() < 0.5 {
                    break;
                }
                roulette *= 2.0;
            }
            ray = spawn_ray(surface.p, surface.p_err, surface.n_surface, d, ray.time);
        }
    }
    found.kept()
}

/// One of the exits offered, kept with a probability in proportion to its importance (weighted reservoir sampling).
#[derive(Default)]
struct Reservoir {
    chosen: Option<(Exit, f32)>,
    total: f32,
}

impl Reservoir {
    /// The importance is not a number where the entry itself is found.
    fn offer(&mut self, exit: Exit, importance: f32, rng: &mut Rng) {
        if importance > 0.0 && importance.is_finite() {
            self.total += importance;
            if rng.uniform() * self.total < importance {
                self.chosen = Some((exit, importance));
            }
        }
    }

    /// The exit, its weight divided by the probability with which it was kept.
    fn kept(self) -> Option<Exit> {
        let (mut exit, importance) = self.chosen?;
        exit.weight *= self.total / importance;
        Some(exit)
    }
}

/// The axis, and what is left of the random number.
fn choose_axis(mut u: f32) -> (usize, f32) {
    for (k, (_, probability)) in AXES.iter().enumerate() {
        if u < *probability || k + 1 == AXES.len() {
            return (k, (u / probability).min(1.0 - f32::EPSILON));
        }
        u -= probability;
    }
    (0, u)
}

/// Density per area of the surface with which a point at `offset` from the entry is found, over all axes and channels.
fn density(
    bssrdf: &Bssrdf,
    channels: &ChannelChoice,
    axes: &[Vec3; 3],
    offset: Vec3,
    surface: &SurfacePoint,
) -> f32 {
    let distance = offset.length();
    AXES.iter()
        .map(|([x, y, z], probability)| {
            let (a, b) = (offset.dot(axes[*x]), offset.dot(axes[*y]));
            let r = a.hypot(b);
            let in_plane: f32 = (0..3)
                .filter(|&c| distance < bssrdf.max_radius(c))
                .map(|c| channels.0[c] * bssrdf.pdf_area(c, r))
                .sum();
            probability * in_plane * surface.ng.abs_dot(axes[*z])
        })
        .sum()
}

/// Probabilities of the three channels: what each brings back of what the path carries.
struct ChannelChoice([f32; 3]);

impl ChannelChoice {
    fn new(bssrdf: &Bssrdf, beta: Rgb) -> Option<Self> {
        let albedo = bssrdf.effective_albedo();
        let carried = (albedo * beta).to_array();
        let sum: f32 = carried.iter().sum();
        (sum > 0.0 && sum.is_finite()).then(|| Self(carried.map(|c| c / sum)))
    }

    fn choose(&self, mut u: f32) -> usize {
        for c in 0..2 {
            if u < self.0[c] {
                return c;
            }
            u -= self.0[c];
        }
        // The last channel that carries anything, should rounding lead past it.
        (0..3).rev().find(|&c| self.0[c] > 0.0).unwrap_or(0)
    }
}
