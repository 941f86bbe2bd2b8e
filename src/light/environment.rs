//! Environment maps: radiance by direction, and directions in proportion to it.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use glam::Vec3A;
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::{ParallelSlice, ParallelSliceMut};

use crate::image::Image;
use crate::light::patch_choice::{Drawn, PatchChoice, Weight};
use crate::spectrum::Rgb;

/// A latitude–longitude map, looked up bilinearly, with a sampler whose density is proportional to the luminance of
/// that look-up times the mean sine of the polar angle in each row, or nearly so where both hardly change.
///
/// The map is cut into *patches*: patch (i, j) lies between the centres of texels (i, j), (i+1, j), (i, j+1) and
/// (i+1, j+1), wrapping in both directions, so that in each the look-up is one bilinear function. Where the map is
/// uneven a patch is chosen by inverting cumulative sums, which keeps the strata of the random numbers, then a point in
/// it exactly; see [`PatchChoice`].
#[derive(Clone, Debug)]
pub(super) struct EnvironmentMap {
    /// Row by row, the top row first.
    texels: Vec<[f32; 3]>,
    width: usize,
    height: usize,
    choice: PatchChoice,
    /// Mean of sin θ over each row of patches.
    sines: Vec<f32>,
    /// 1 / mean over the unit square of luminance times sine.
    inverse_mean: f32,
    mean: Rgb,
}

/// A direction drawn from the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct MapSample {
    /// Unit direction, map space.
    pub(super) direction: Vec3A,
    pub(super) radiance: Rgb,
    /// Density in sr⁻¹.
    pub(super) pdf_w: f32,
}

/// The four corners of a patch and a place in it.
struct Patch {
    corners: [Rgb; 4],
    column: usize,
    row: usize,
}

impl Patch {
    #[inline]
    fn value(&self, x: f32, y: f32) -> Rgb {
        let [c00, c10, c01, c11] = self.corners;
        (c00 * (1.0 - x) + c10 * x) * (1.0 - y) + (c01 * (1.0 - x) + c11 * x) * y
    }

    /// A point in proportion to its luminance: first y, then x given y.
    #[inline]
    fn sample(&self, u: [f32; 2]) -> [f32; 2] {
        let [l00, l10, l01, l11] = self.corners.map(Rgb::luminance);
        let y = sample_linear(u[1], l00 + l10, l01 + l11);
        let x = sample_linear(u[0], l00 + y * (l01 - l00), l10 + y * (l11 - l10));
        [x, y]
    }
}

impl EnvironmentMap {
    /// From an image with non-negative, finite texels. `None` if all are black.
    pub(super) fn new(map: &Image) -> Option<Self> {
        let (width, height) = (map.width(), map.height());
        let texels = match map.channels() {
            3 => map.data().as_chunks().0.to_vec(),
            _ => map.data().iter().map(|&grey| [grey; 3]).collect(),
        };
        // Row j of patches spans polar angles (j + ½) π / h to (j + 3/2) π / h; the last one wraps over both poles.
        let step = std::f64::consts::PI / height as f64;
        let sines: Vec<f64> = (0..height)
            .map(|j| {
                if j + 1 == height {
                    4.0 * (step * 0.25).sin().powi(2) / step
                } else {
                    2.0 * ((j + 1) as f64 * step).sin() * (step * 0.5).sin() / step
                }
            })
            .collect();
        let mut luminances = vec![0.0f32; width * height];
        luminances
            .par_chunks_exact_mut(width)
            .zip(texels.par_chunks_exact(width))
            .for_each(|(line, texels)| {
                for (luminance, &texel) in line.iter_mut().zip(texels) {
                    *luminance = Rgb::from_array(texel).luminance();
                }
            });
        let choice = PatchChoice::new(width, height, |x, y| {
            let (x1, y1) = (next(x, width), next(y, height));
            let row = |y: usize| &luminances[y * width..][..width];
            let (above, below) = (row(y), row(y1));
            let corners = [above[x], above[x1], below[x], below[x1]];
            Weight {
                mean: 0.25 * corners.into_iter().map(f64::from).sum::<f64>() * sines[y],
                peak: f64::from(corners.into_iter().fold(0.0, f32::max)) * sines[y],
            }
        })?;
        let mean = mean_over_sphere(&texels, width, &sines);
        Some(Self {
            inverse_mean: (1.0 / choice.mean()) as f32,
            choice,
            sines: sines.iter().map(|&s| s as f32).collect(),
            texels,
            width,
            height,
            mean,
        })
    }

    /// Mean over the sphere.
    pub(super) fn mean(&self) -> Rgb {
        self.mean
    }

    #[inline]
    fn patch(&self, column: usize, row: usize) -> Patch {
        let (x1, y1) = (next(column, self.width), next(row, self.height));
        let texel = |x: usize, y: usize| Rgb::from_array(self.texels[y * self.width + x]);
        let corners = [
            texel(column, row),
            texel(x1, row),
            texel(column, y1),
            texel(x1, y1),
        ];
        Patch {
            corners,
            column,
            row,
        }
    }

    /// The patch a direction lies in, and where. At the poles the top and the bottom row of texels blend, as in
    /// pbrt-v3, whose maps repeat in both directions.
    #[inline]
    fn locate(&self, w: Vec3A) -> (Patch, f32, f32, f32) {
        let sin_theta = (w.x * w.x + w.y * w.y).sqrt();
        let s = w.y.atan2(w.x) * (0.5 * FRAC_1_PI);
        let t = sin_theta.atan2(w.z) * FRAC_1_PI;
        let place = |c: f32, n: usize| {
            // c in [−½, 1], so that the index lies in [−n/2 − 1, n].
            let x = c * n as f32 - 0.5;
            let floor = x.floor();
            let index = floor as isize;
            let wrapped = if index < 0 { index + n as isize } else { index };
            ((wrapped as usize).min(n - 1), x - floor)
        };
        let ((column, x), (row, y)) = (place(s, self.width), place(t, self.height));
        (self.patch(column, row), x, y, sin_theta)
    }

    /// Density in sr⁻¹ at a place of a patch.
    #[inline]
    fn pdf_w(&self, patch: &Patch, value: Rgb, sin_theta: f32) -> f32 {
        if sin_theta <= 0.0 {
            return 0.0; // A pole: no solid angle.
        }
        let pdf_st = match self.choice.even_density(patch.column, patch.row) {
            Some(density) => density,
            None => value.luminance() * self.sines[patch.row] * self.inverse_mean,
        };
        pdf_st / (2.0 * PI * PI * sin_theta)
    }

    /// Radiance from a unit direction of map space: z is up and the top row, +x is the left edge.
    #[inline]
    pub(super) fn radiance(&self, w: Vec3A) -> Rgb {
        let (patch, x, y, _) = self.locate(w);
        patch.value(x, y)
    }

    /// Radiance and sampling density in sr⁻¹ of a unit direction.
    #[inline]
    pub(super) fn radiance_and_pdf(&self, w: Vec3A) -> (Rgb, f32) {
        let (patch, x, y, sin_theta) = self.locate(w);
        let value = patch.value(x, y);
        (value, self.pdf_w(&patch, value, sin_theta))
    }

    /// Draws a direction.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> Option<MapSample> {
        let (patch, [x, y]) = match self.choice.sample(u) {
            Drawn::Point { column, row, at } => (self.patch(column, row), at),
            Drawn::Patch { column, row, u } => {
                let patch = self.patch(column, row);
                let at = patch.sample(u);
                (patch, at)
            }
        };
        let value = patch.value(x, y);
        let t = (patch.row as f32 + 0.5 + y) / self.height as f32;
        let t = if t > 1.0 { t - 1.0 } else { t };
        let s = (patch.column as f32 + 0.5 + x) / self.width as f32;
        let (sin_theta, cos_theta) = (t * PI).sin_cos();
        let (sin_phi, cos_phi) = (s * TAU).sin_cos();
        let pdf_w = self.pdf_w(&patch, value, sin_theta);
        (pdf_w > 0.0).then(|| MapSample {
            direction: Vec3A::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta),
            radiance: value,
            pdf_w,
        })
    }
}

/// The index after `i` of `n`, around the edge.
#[inline]
fn next(i: usize, n: usize) -> usize {
    if i + 1 == n { 0 } else { i + 1 }
}

/// Draws from a density on [0, 1] that runs linearly from `a` to `b`, both non-negative.
#[inline]
fn sample_linear(u: f32, a: f32, b: f32) -> f32 {
    let sum = a + b;
    if sum <= 0.0 {
        return u;
    }
    // Relative to the larger, so that squares neither over- nor underflow.
    let (a, b) = (a / sum, b / sum);
    (u / (a + (a * a + u * (b * b - a * a)).max(0.0).sqrt())).min(1.0)
}

fn mean_over_sphere(texels: &[[f32; 3]], width: usize, sines: &[f64]) -> Rgb {
    let height = texels.len() / width;
    let mut sum = [0.0; 3];
    for (y, line) in texels.chunks_exact(width).enumerate() {
        // A texel row has half of the patch rows above and below it.
        let sine = 0.5 * (sines[y] + sines[(y + height - 1) % height]);
        for texel in line {
            for (sum, &channel) in sum.iter_mut().zip(texel) {
                *sum += channel as f64 * sine;
            }
        }
    }
    let norm = width as f64 * sines.iter().sum::<f64>();
    Rgb::from_array(sum.map(|c| (c / norm) as f32))
}
