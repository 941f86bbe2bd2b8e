//! Environment maps: radiance by direction, and directions in proportion to it.

use std::f32::consts::{FRAC_1_PI, PI};

use glam::Vec3A;

use crate::image::Image;
use crate::light::luminances::{Emphasis, Emphasised, Luminances};
use crate::light::outline::{Outline, Outlined};
use crate::light::patch_choice::{Drawn, PatchChoice};
use crate::light::regions::Purpose;
use crate::math::sin_cos_of_turns;
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
    /// Three samples for each texel, row by row, the top row first.
    samples: Vec<f32>,
    width: usize,
    height: usize,
    outline: Outline,
    /// Mean of sin θ over each row of patches.
    sines: Vec<f32>,
    mean: Rgb,
    /// Serves places in media as well.
    whole: Distribution,
    /// `None` if normals are not heeded: `whole` then serves surfaces as well.
    facing: Option<Distribution>,
}

/// How directions are drawn.
#[derive(Clone, Debug)]
struct Distribution {
    choice: PatchChoice,
    emphasis: Emphasis,
    /// Mean over the unit square of emphasised luminance times sine.
    mean: f64,
}

/// Part of the mean luminance that counts little where surfaces find light by themselves (after Karlík et al. 2019, *MIS
/// Compensation*), and how little.
const CUT: f32 = 0.5;
const LEAST: f32 = 0.25;

/// A direction drawn from the map.
#[derive(Clone, Copy, Debug)]
pub(super) struct MapSample {
    /// Unit direction, map space.
    pub(super) direction: Vec3A,
    /// An estimate, see [`Outline`].
    pub(super) radiance: Rgb,
    /// Density in sr⁻¹.
    pub(super) pdf_w: f32,
}

/// The four corners of a patch.
struct Patch {
    corners: [Rgb; 4],
}

/// A place in a patch.
struct Place {
    column: usize,
    row: usize,
    /// In [0, 1]².
    at: [f32; 2],
    sin_theta: f32,
}

impl Patch {
    #[inline]
    fn value(&self, x: f32, y: f32) -> Rgb {
        let [c00, c10, c01, c11] = self.corners;
        (c00 * (1.0 - x) + c10 * x) * (1.0 - y) + (c01 * (1.0 - x) + c11 * x) * y
    }

    /// Bilinear between the emphasised luminances of the corners.
    #[inline]
    fn emphasised(&self, x: f32, y: f32, emphasis: Emphasis) -> f32 {
        let [l00, l10, l01, l11] = self.corners.map(|c| emphasis.of(c.luminance()));
        (l00 * (1.0 - x) + l10 * x) * (1.0 - y) + (l01 * (1.0 - x) + l11 * x) * y
    }

    /// A point in proportion to that: first y, then x given y.
    #[inline]
    fn sample(&self, u: [f32; 2], emphasis: Emphasis) -> [f32; 2] {
        let [l00, l10, l01, l11] = self.corners.map(|c| emphasis.of(c.luminance()));
        let y = sample_linear(u[1], l00 + l10, l01 + l11);
        let x = sample_linear(u[0], l00 + y * (l01 - l00), l10 + y * (l11 - l10));
        [x, y]
    }
}

impl EnvironmentMap {
    /// From an image with non-negative, finite texels. `None` if all are black. Whether surfaces will ask by their
    /// normals costs time and memory.
    pub(super) fn new(map: Image, heeds_normals: bool) -> Option<Self> {
        let (width, height, channels) = (map.width(), map.height(), map.channels());
        let samples = match (channels, map.into_data()) {
            (3, samples) => samples,
            (_, grey) => grey.iter().flat_map(|&value| [value; 3]).collect(),
        };
        let texels = texels(&samples);
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
        let luminances = Luminances::new(texels, width, &sines);
        let mean = luminances.mean();
        let distribution = |emphasis: Emphasis, heeds_normals: bool| {
            let weights = Emphasised {
                luminances: &luminances,
                emphasis,
            };
            let direction = direction_of([width, height]);
            let choice = PatchChoice::new([width, height], &weights, direction, heeds_normals)?;
            Some(Distribution {
                mean: choice.mean(),
                choice,
                emphasis,
            })
        };
        let bright = Emphasis {
            cut: CUT * mean.luminance(),
            least: LEAST,
        };
        Some(Self {
            whole: distribution(Emphasis::NONE, false)?,
            facing: if heeds_normals {
                Some(distribution(bright, true)?)
            } else {
                None
            },
            outline: Outline::new(width, height, texels),
            sines: sines.iter().map(|&s| s as f32).collect(),
            samples,
            width,
            height,
            mean,
        })
    }

    /// Draws for blocks of media from now on: `transmittances` of a unit direction are in [0, 1], one for each block.
    pub(super) fn heed_blocks(&mut self, transmittances: impl Fn(Vec3A) -> Vec<f32> + Sync) {
        let direction = direction_of([self.width, self.height]);
        self.whole.choice.heed_blocks(direction, transmittances);
    }

    /// Luminances of the texels times `strength`.
    pub(super) fn luminances(&self, strength: Rgb) -> Image {
        let texels = texels(&self.samples);
        let luminance = |texel: &[f32; 3]| (strength * Rgb::from_array(*texel)).luminance();
        let data = texels.iter().map(luminance).collect();
        Image::new(self.width, self.height, 1, data).expect("as many as there are texels")
    }

    /// Mean over the sphere.
    pub(super) fn mean(&self) -> Rgb {
        self.mean
    }

    #[inline]
    fn patch(&self, column: usize, row: usize) -> Patch {
        let (x1, y1) = (next(column, self.width), next(row, self.height));
        let texels = texels(&self.samples);
        let texel = |x: usize, y: usize| Rgb::from_array(texels[y * self.width + x]);
        let corners = [
            texel(column, row),
            texel(x1, row),
            texel(column, y1),
            texel(x1, y1),
        ];
        Patch { corners }
    }

    /// The patch a direction lies in, and where. At the poles the top and the bottom row of texels blend, as in
    /// pbrt-v3, whose maps repeat in both directions.
    #[inline]
    fn locate(&self, w: Vec3A) -> Place {
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
        Place {
            column,
            row,
            at: [x, y],
            sin_theta,
        }
    }

    /// The look-up.
    #[inline]
    fn exact(&self, place: &Place) -> Rgb {
        let [x, y] = place.at;
        self.patch(place.column, place.row).value(x, y)
    }

    #[inline]
    fn distribution(&self, purpose: Purpose) -> (&Distribution, Purpose) {
        match (purpose, &self.facing) {
            (Purpose::Facing(_), Some(facing)) => (facing, purpose),
            (Purpose::Facing(_), None) => (&self.whole, Purpose::Whole),
            (Purpose::Whole | Purpose::Within(_), _) => (&self.whole, purpose),
        }
    }

    /// The look-up on average over `bits`, and density in sr⁻¹ but for what a receiver changes.
    #[inline]
    fn value_and_pdf(&self, place: &Place, bits: u64, distribution: &Distribution) -> (Rgb, f32) {
        let (value, pdf_st) = match distribution.choice.even_density(place.column, place.row) {
            Some(density) => (self.outlined(place, bits), density),
            None => {
                let [x, y] = place.at;
                let patch = self.patch(place.column, place.row);
                let emphasised = patch.emphasised(x, y, distribution.emphasis);
                // Wide enough for maps so dark that 1 / mean is not a number of f32.
                let weight = f64::from(emphasised) * f64::from(self.sines[place.row]);
                let density = (weight / distribution.mean) as f32;
                (patch.value(x, y), density)
            }
        };
        if place.sin_theta <= 0.0 {
            return (value, 0.0); // A pole: no solid angle.
        }
        (value, pdf_st / (2.0 * PI * PI * place.sin_theta))
    }

    /// The look-up on average over `bits`.
    #[inline]
    fn outlined(&self, place: &Place, bits: u64) -> Rgb {
        match self.outline.value(place.column, place.row, place.at, bits) {
            Outlined::Certain(value) => value,
            Outlined::Ask { outline, chance } => {
                outline + (self.exact(place) - outline) * (1.0 / chance)
            }
        }
    }

    /// Radiance from a unit direction of map space: z is up and the top row, +x is the left edge.
    #[inline]
    pub(super) fn radiance(&self, w: Vec3A) -> Rgb {
        self.exact(&self.locate(w))
    }

    /// An estimate of the radiance from a unit direction, see [`Outline`], and the sampling density in sr⁻¹.
    #[inline]
    pub(super) fn radiance_and_pdf(&self, w: Vec3A, purpose: Purpose) -> (Rgb, f32) {
        let bits = u64::from(w.x.to_bits()) << 32 | u64::from(w.y.to_bits());
        let place = self.locate(w);
        let (distribution, purpose) = self.distribution(purpose);
        let (value, pdf_w) = self.value_and_pdf(&place, bits, distribution);
        let gain = distribution.choice.gain(place.column, place.row, purpose);
        (value, pdf_w * gain)
    }

    /// Draws a direction.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], purpose: Purpose) -> Option<MapSample> {
        let (distribution, purpose) = self.distribution(purpose);
        let (drawn, gain) = distribution.choice.sample(u, purpose);
        let (column, row, at) = match drawn {
            Drawn::Point { column, row, at } => (column, row, at),
            Drawn::Patch { column, row, u } => {
                let at = self.patch(column, row).sample(u, distribution.emphasis);
                (column, row, at)
            }
        };
        let [x, y] = at;
        let t = (row as f32 + 0.5 + y) / self.height as f32;
        let s = (column as f32 + 0.5 + x) / self.width as f32;
        let (direction, sin_theta) = direction(s, t);
        let place = Place {
            column,
            row,
            at,
            sin_theta,
        };
        let bits = u64::from(u[0].to_bits()) << 32 | u64::from(u[1].to_bits());
        let (radiance, pdf_w) = self.value_and_pdf(&place, bits, distribution);
        let pdf_w = pdf_w * gain;
        (pdf_w > 0.0).then_some(MapSample {
            direction,
            radiance,
            pdf_w,
        })
    }
}

#[inline]
fn texels(samples: &[f32]) -> &[[f32; 3]] {
    samples.as_chunks().0
}

/// The unit direction of a place of a map of so many patches.
fn direction_of([width, height]: [usize; 2]) -> impl Fn([f64; 2]) -> Vec3A {
    move |[column, row]| {
        // Patches begin at the centres of texels.
        let (s, t) = ((column + 0.5) / width as f64, (row + 0.5) / height as f64);
        direction(s as f32, t as f32).0
    }
}

/// The unit direction at (`s`, `t`) of a map, which repeats downward, and the sine of its polar angle.
#[inline]
fn direction(s: f32, t: f32) -> (Vec3A, f32) {
    let t = if t > 1.0 { t - 1.0 } else { t };
    let (sin_theta, cos_theta) = sin_cos_of_turns(0.5 * t);
    let (sin_phi, cos_phi) = sin_cos_of_turns(s);
    let w = Vec3A::new(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta);
    (w, sin_theta)
}

/// The index after `i` of `n` that repeat.
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
