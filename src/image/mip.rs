//! Mip pyramids and filtered look-ups (pbrt 3e §10.4.3).
//!
//! Texture coordinates `st` lie in [0, 1)²; t = 0 is the image's first row. Texel `i` of `n` has its centre at
//! `(i + 0.5)/n`. Sides are powers of two, up-sampled if need be.

use std::ops::{Add, Mul};
use std::sync::LazyLock;

use glam::Vec2;
use rayon::prelude::{IndexedParallelIterator, ParallelIterator, ParallelSliceMut};

use crate::image::{Image, resample, rgb_of};
use crate::spectrum::Rgb;

/// What lies beyond the border of an image.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// Zero.
    Black,
    /// The nearest texel of the border.
    Clamp,
}

/// An image at all powers of two of its size, each level averaged from the one below.
#[derive(Clone, Debug)]
pub struct MipMap {
    /// Finest first; the last one is a single texel.
    levels: Vec<Image>,
    wrap: Wrap,
}

/// What a look-up returns: `f32` takes luminance from RGB images, [`Rgb`] takes grey for all channels.
pub trait Texel: Copy + Add<Output = Self> + Mul<f32, Output = Self> {
    /// The sum of nothing.
    const ZERO: Self;
    /// From one or three samples.
    fn from_samples(samples: &[f32]) -> Self;
}

impl Texel for f32 {
    const ZERO: Self = 0.0;
    fn from_samples(samples: &[f32]) -> Self {
        if let [grey] = *samples {
            grey
        } else {
            rgb_of(samples).luminance()
        }
    }
}

impl Texel for Rgb {
    const ZERO: Self = Self::BLACK;
    fn from_samples(samples: &[f32]) -> Self {
        rgb_of(samples)
    }
}

/// Largest ratio of the axes of a filter ellipse. It bounds the work of one look-up.
pub const MAX_ANISOTROPY: f32 = 1024.0;

/// Number of entries of the Gaussian of [`MipMap::ewa`].
const N_WEIGHTS: usize = 128;

/// `exp(-2r²) - exp(-2)` over r² in [0, 1].
static WEIGHTS: LazyLock<[f32; N_WEIGHTS]> = LazyLock::new(|| {
    const ALPHA: f32 = 2.0;
    std::array::from_fn(|i| (-ALPHA * i as f32 / (N_WEIGHTS - 1) as f32).exp() - (-ALPHA).exp())
});

impl Wrap {
    /// The texel that stands at index `i` of `n`. `None` is black.
    pub(super) fn index(self, i: i64, n: usize) -> Option<usize> {
        match self {
            // A mask where it will do: pyramids ask four times per look-up, and a division costs more than the rest.
            Self::Repeat if n.is_power_of_two() => Some(i as usize & (n - 1)),
            Self::Repeat => Some(i.rem_euclid(n as i64) as usize),
            Self::Black => usize::try_from(i).ok().filter(|&i| i < n),
            Self::Clamp => Some(i.clamp(0, n as i64 - 1) as usize),
        }
    }
}

impl MipMap {
    /// Builds the pyramid: a third more memory than the image, up-sampled to powers of two.
    pub fn new(image: Image, wrap: Wrap) -> Self {
        let base = resample::to_powers_of_two(image, wrap);
        let n_levels = 1 + base.width().max(base.height()).ilog2() as usize;
        let mut levels = Vec::with_capacity(n_levels);
        levels.push(base);
        while levels.len() < n_levels {
            levels.push(halve(&levels[levels.len() - 1], wrap));
        }
        Self { levels, wrap }
    }

    /// What lies beyond the border.
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// Number of levels; 1 for a single texel.
    pub fn n_levels(&self) -> usize {
        self.levels.len()
    }

    /// One level of the pyramid, 0 the finest. Panics beyond the last.
    pub fn level(&self, level: usize) -> &Image {
        &self.levels[level]
    }

    /// One texel, wrapped. Panics beyond the last level.
    pub fn texel<T: Texel>(&self, level: usize, x: i64, y: i64) -> T {
        let image = &self.levels[level];
        match (
            self.wrap.index(x, image.width()),
            self.wrap.index(y, image.height()),
        ) {
            (Some(x), Some(y)) => T::from_samples(image.pixel(x, y)),
            _ => T::ZERO,
        }
    }

    /// Interpolates between the four texels around `st`. Levels beyond the last count as the last.
    pub fn bilinear<T: Texel>(&self, level: usize, st: Vec2) -> T {
        let level = level.min(self.levels.len() - 1);
        let p = st * self.size(level) - 0.5;
        let corner = p.floor();
        let d = p - corner;
        let (x, y) = (corner.x as i64, corner.y as i64);
        // Casts saturate, so an absurd coordinate has no neighbour to add.
        let (x1, y1) = (x.saturating_add(1), y.saturating_add(1));
        self.texel::<T>(level, x, y) * ((1.0 - d.x) * (1.0 - d.y))
            + self.texel::<T>(level, x, y1) * ((1.0 - d.x) * d.y)
            + self.texel::<T>(level, x1, y) * (d.x * (1.0 - d.y))
            + self.texel::<T>(level, x1, y1) * (d.x * d.y)
    }

    /// Averages a square of side `width` (in st) around `st`, blending two levels. Width 0 is [`Self::bilinear`].
    pub fn trilinear<T: Texel>(&self, st: Vec2, width: f32) -> T {
        let last = self.levels.len() - 1;
        let level = last as f32 + width.max(1e-8).log2();
        if level < 0.0 {
            self.bilinear(0, st)
        } else if level >= last as f32 {
            self.texel(last, 0, 0)
        } else {
            self.between(level, |level| self.bilinear(level, st))
        }
    }

    /// [`Self::trilinear`] over the largest component of the two screen-space derivatives of `st`.
    pub fn trilinear_footprint<T: Texel>(&self, st: Vec2, dst0: Vec2, dst1: Vec2) -> T {
        self.trilinear(st, dst0.abs().max(dst1.abs()).max_element())
    }

    /// Averages the ellipse spanned by the two screen-space derivatives of `st` with Gaussian weights (Heckbert 1989).
    ///
    /// The shorter axis is lengthened until the ratio is at most `max_anisotropy`, itself kept in
    /// [1, [`MAX_ANISOTROPY`]].
    pub fn ewa<T: Texel>(&self, st: Vec2, dst0: Vec2, dst1: Vec2, max_anisotropy: f32) -> T {
        let (major, mut minor) = if dst0.length_squared() < dst1.length_squared() {
            (dst1, dst0)
        } else {
            (dst0, dst1)
        };
        // Not `clamp`, which would let NaN through.
        let max_anisotropy = if max_anisotropy > 1.0 {
            max_anisotropy.min(MAX_ANISOTROPY)
        } else {
            1.0
        };
        let major_length = major.length();
        let mut minor_length = minor.length();
        if minor_length * max_anisotropy < major_length && minor_length > 0.0 {
            let scale = major_length / (minor_length * max_anisotropy);
            minor *= scale;
            minor_length *= scale;
        }
        if !(minor_length > 0.0 && minor_length.is_finite()) {
            return self.bilinear(0, st);
        }
        let last = self.levels.len() - 1;
        let level = (last as f32 + minor_length.log2()).max(0.0);
        self.between(level, |level| {
            if level > last {
                self.texel(last, 0, 0)
            } else {
                self.ellipse(level, st, major, minor)
            }
        })
    }

    /// The weighted mean of one level's texels inside the ellipse.
    fn ellipse<T: Texel>(&self, level: usize, st: Vec2, dst0: Vec2, dst1: Vec2) -> T {
        let size = self.size(level);
        let center = st * size - 0.5;
        let (d0, d1) = (dst0 * size, dst1 * size);

        // A x² + B xy + C y² < 1, at least one texel wide.
        let a = d0.y * d0.y + d1.y * d1.y + 1.0;
        let b = -2.0 * (d0.x * d0.y + d1.x * d1.y);
        let c = d0.x * d0.x + d1.x * d1.x + 1.0;
        let inv_f = 1.0 / (a * c - b * b * 0.25);
        let (a, b, c) = (a * inv_f, b * inv_f, c * inv_f);

        let det = 4.0 * a * c - b * b;
        let reach = Vec2::new((det * c).sqrt(), (a * det).sqrt()) * (2.0 / det);
        let (low, high) = ((center - reach).ceil(), (center + reach).floor());
        let mut sum = T::ZERO;
        let mut sum_of_weights = 0.0;
        for y in low.y as i64..=high.y as i64 {
            let dy = y as f32 - center.y;
            for x in low.x as i64..=high.x as i64 {
                let dx = x as f32 - center.x;
                let r2 = a * dx * dx + b * dx * dy + c * dy * dy;
                if r2 < 1.0 {
                    let weight = WEIGHTS[((r2 * N_WEIGHTS as f32) as usize).min(N_WEIGHTS - 1)];
                    sum = sum + self.texel::<T>(level, x, y) * weight;
                    sum_of_weights += weight;
                }
            }
        }
        // Every ellipse holds a texel centre; only a centre too far out for f32 to tell texels apart has none.
        if sum_of_weights > 0.0 {
            sum * (1.0 / sum_of_weights)
        } else {
            self.bilinear(level, st)
        }
    }

    /// Blends the levels below and above `level`.
    fn between<T: Texel>(&self, level: f32, look_up: impl Fn(usize) -> T) -> T {
        let finer = level.floor();
        let t = level - finer;
        look_up(finer as usize) * (1.0 - t) + look_up(finer as usize + 1) * t
    }

    fn size(&self, level: usize) -> Vec2 {
        let image = &self.levels[level];
        Vec2::new(image.width() as f32, image.height() as f32)
    }
}

/// A row of means of 2×2 texels of `N` channels.
fn halve_row<const N: usize>(above: &[f32], below: &[f32], row: &mut [f32]) {
    let pairs = |row| <[f32]>::as_chunks::<N>(row).0.as_chunks::<2>().0;
    let squares = pairs(above).iter().zip(pairs(below));
    for (texel, (a, b)) in row.as_chunks_mut::<N>().0.iter_mut().zip(squares) {
        *texel = std::array::from_fn(|c| {
            0.25 * a[0][c] + 0.25 * a[1][c] + 0.25 * b[0][c] + 0.25 * b[1][c]
        });
    }
}

/// The next coarser level: means of 2×2 texels, wrapped where a side is already 1.
fn halve(fine: &Image, wrap: Wrap) -> Image {
    let (width, height) = ((fine.width() / 2).max(1), (fine.height() / 2).max(1));
    let channels = fine.channels();
    let mut data = vec![0.0; width * height * channels];
    data.par_chunks_exact_mut(width * channels)
        .enumerate()
        .for_each(|(y, row)| {
            if fine.width() > 1 && fine.height() > 1 {
                let length = fine.width() * channels;
                let (above, below) = fine.data()[2 * y * length..][..2 * length].split_at(length);
                return match channels {
                    1 => halve_row::<1>(above, below, row),
                    _ => halve_row::<3>(above, below, row),
                };
            }
            for (x, pixel) in row.chunks_exact_mut(channels).enumerate() {
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let fine_x = wrap.index((2 * x + dx) as i64, fine.width());
                    let fine_y = wrap.index((2 * y + dy) as i64, fine.height());
                    let (Some(fine_x), Some(fine_y)) = (fine_x, fine_y) else {
                        continue;
                    };
                    for (sample, &part) in pixel.iter_mut().zip(fine.pixel(fine_x, fine_y)) {
                        *sample += 0.25 * part;
                    }
                }
            }
        });
    Image::new(width, height, channels, data).expect("sides and samples agree")
}
