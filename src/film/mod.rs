//! The film: pixel filters, sums over samples, and the finished picture.
//!
//! Sums are f64 and are added in one fixed order, that of *blocks*: squares of raster space that do not depend on
//! crop, thread count or schedule. A pixel is therefore the same bits however the picture was rendered.

pub mod filter;

use crate::image::{Image, PixelRect};
use crate::spectrum::Rgb;
pub use filter::{Filter, FilterTable};

/// Edge length of a block in pixels. Blocks are aligned to raster (0, 0).
pub const BLOCK: i32 = 16;

/// What the film is made for.
#[derive(Clone, Debug)]
pub struct FilmDesc {
    /// Full frame in pixels.
    pub resolution: [u32; 2],
    /// Pixels of the picture, within the frame.
    pub crop: PixelRect,
    /// Filter weights.
    pub filter: FilterTable,
    /// Multiplies every pixel.
    pub scale: f64,
    /// Samples of more luminance are scaled down to it; ∞ leaves them alone.
    pub max_sample_luminance: f32,
}

/// Sums of one pixel.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct PixelSum {
    rgb: [f64; 3],
    weight: f64,
    /// Sum of the absolute values of the weights.
    magnitude: f64,
}

/// Least part of the absolute weights of a pixel that it is divided by: where weights of both signs nearly cancel, by
/// chance and with few samples, what they multiply does not, and the pixel would be as bright as one likes.
const MIN_WEIGHT: f64 = 1e-3;

impl PixelSum {
    fn add(&mut self, other: &Self) {
        for (a, b) in self.rgb.iter_mut().zip(other.rgb) {
            *a += b;
        }
        self.weight += other.weight;
        self.magnitude += other.magnitude;
    }
}

/// A film in the making.
#[derive(Clone, Debug)]
pub struct Film {
    desc: FilmDesc,
    sums: Vec<PixelSum>,
    /// Sums of splats; empty until there are any.
    splats: Vec<[f64; 3]>,
    /// Light paths behind the splats.
    n_light_paths: u64,
}

/// Light that came to the film by itself, in the pixel it fell into.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Splat {
    pixel: [i32; 2],
    rgb: Rgb,
}

/// The part of the film that the samples of one block touch.
#[derive(Clone, Debug)]
pub struct FilmBlock {
    bounds: PixelRect,
    sums: Vec<PixelSum>,
    splats: Vec<Splat>,
    n_light_paths: u64,
}

impl FilmDesc {
    /// Raster position of the point `u` of a pixel. Where the filter is narrower than a pixel, positions keep to its
    /// support: no sample is wasted, no pixel stays without weight.
    #[inline]
    pub fn position(&self, pixel: [i32; 2], u: [f32; 2]) -> [f64; 2] {
        let radius = self.filter.radius();
        [0, 1].map(|axis| {
            let half_width = radius[axis].min(0.5);
            pixel[axis] as f64 + 0.5 + (2.0 * u[axis] as f64 - 1.0) * half_width
        })
    }

    /// Whether samples of a pixel count in the frame: those beyond it do as far as the filter reaches.
    pub fn is_sampled(&self, pixel: [i32; 2]) -> bool {
        let radius = self.filter.radius();
        (0..2).all(|axis| {
            let (middle, length) = (pixel[axis] as f64 + 0.5, f64::from(self.resolution[axis]));
            middle > -radius[axis] && middle < length + radius[axis]
        })
    }

    /// An empty block for samples taken within `block`.
    pub fn start_block(&self, block: PixelRect) -> FilmBlock {
        let [rx, ry] = self.filter.radius();
        let crop = self.crop;
        // A sample at p reaches pixels from ⌈p − ½ − r⌉ to ⌊p − ½ + r⌋.
        let range = |start: i32, length: usize, r: f64, lo: i32, n: usize| {
            let first = ((start as f64 - 0.5 - r).ceil() as i32).max(lo);
            let last =
                (((start + length as i32) as f64 - 0.5 + r).floor() as i32).min(lo + n as i32 - 1);
            (first, (last - first + 1).max(0) as usize)
        };
        let (x0, width) = range(block.x0, block.width, rx, crop.x0, crop.width);
        let (y0, height) = range(block.y0, block.height, ry, crop.y0, crop.height);
        FilmBlock {
            bounds: PixelRect {
                x0,
                y0,
                width,
                height,
            },
            sums: vec![PixelSum::default(); width * height],
            splats: Vec::new(),
            n_light_paths: 0,
        }
    }

    /// Radiance of more luminance than allowed, scaled down to it.
    #[inline]
    fn limited(&self, radiance: Rgb) -> Rgb {
        let luminance = radiance.luminance();
        if luminance > self.max_sample_luminance {
            radiance * (self.max_sample_luminance / luminance)
        } else {
            radiance
        }
    }
}

impl Film {
    /// What a pixel takes while it is made.
    pub const BYTES_PER_PIXEL: usize = size_of::<PixelSum>();
    /// What it takes beside that where light comes by itself.
    pub const SPLAT_BYTES_PER_PIXEL: usize = size_of::<[f64; 3]>();
    /// What a splat takes until it is merged.
    pub const BYTES_PER_SPLAT: usize = size_of::<Splat>();

    /// An empty film.
    pub fn new(desc: FilmDesc) -> Self {
        let n_pixels = desc.crop.width * desc.crop.height;
        Self {
            desc,
            sums: vec![PixelSum::default(); n_pixels],
            splats: Vec::new(),
            n_light_paths: 0,
        }
    }

    /// Pixels that samples are taken in: the crop window grown by the filter's radius, also beyond the frame.
    pub fn sample_bounds(&self) -> PixelRect {
        self.bounds_around(self.desc.crop)
    }

    /// Pixels that samples would be taken in without a crop window.
    pub fn full_sample_bounds(&self) -> PixelRect {
        let [width, height] = self.desc.resolution.map(|side| side as usize);
        self.bounds_around(PixelRect::from_size(width, height))
    }

    fn bounds_around(&self, crop: PixelRect) -> PixelRect {
        let [rx, ry] = self.desc.filter.radius();
        let range = |start: i32, length: usize, r: f64| {
            let lo = (start as f64 + 0.5 - r).floor() as i32;
            let hi = ((start + length as i32) as f64 - 0.5 + r).ceil() as i32;
            (lo, (hi - lo) as usize)
        };
        let (x0, width) = range(crop.x0, crop.width, rx);
        let (y0, height) = range(crop.y0, crop.height, ry);
        PixelRect {
            x0,
            y0,
            width,
            height,
        }
    }

    /// The blocks that make up a rectangle, row by row: the order of addition.
    pub fn blocks_of(bounds: PixelRect) -> Vec<PixelRect> {
        let (x1, y1) = (
            bounds.x0 + bounds.width as i32,
            bounds.y0 + bounds.height as i32,
        );
        let starts = |lo: i32, hi: i32| {
            (lo.div_euclid(BLOCK)..=(hi - 1).div_euclid(BLOCK)).map(|b| b * BLOCK)
        };
        let clip = |start: i32, lo: i32, hi: i32| {
            let (a, b) = (start.max(lo), (start + BLOCK).min(hi));
            (a, (b - a) as usize)
        };
        let mut blocks = Vec::new();
        for y in starts(bounds.y0, y1) {
            for x in starts(bounds.x0, x1) {
                let (x0, width) = clip(x, bounds.x0, x1);
                let (y0, height) = clip(y, bounds.y0, y1);
                blocks.push(PixelRect {
                    x0,
                    y0,
                    width,
                    height,
                });
            }
        }
        blocks
    }

    /// Adds a finished block. Blocks are added in the order of [`Film::blocks_of`], one pass after the other.
    pub fn merge(&mut self, block: &FilmBlock) {
        let crop = self.desc.crop;
        for (row, line) in block
            .sums
            .chunks_exact(block.bounds.width.max(1))
            .enumerate()
        {
            let y = (block.bounds.y0 - crop.y0) as usize + row;
            let x = (block.bounds.x0 - crop.x0) as usize;
            let start = y * crop.width + x;
            for (sum, add) in self.sums[start..start + line.len()].iter_mut().zip(line) {
                sum.add(add);
            }
        }
        self.n_light_paths += block.n_light_paths;
        if self.splats.is_empty() && !block.splats.is_empty() {
            self.splats = vec![[0.0; 3]; self.sums.len()];
        }
        for splat in &block.splats {
            let [x, y] = splat.pixel;
            let index = (y - crop.y0) as usize * crop.width + (x - crop.x0) as usize;
            for (sum, c) in self.splats[index].iter_mut().zip(splat.rgb.to_array()) {
                *sum += f64::from(c);
            }
        }
    }

    /// The picture so far: weighted means and what was splatted, negative values cut to 0, times the film's scale.
    pub fn develop(&self) -> Image {
        self.developed(|mean| mean.max(0.0))
    }

    /// The same of a film that holds parts of samples: negative values stay, so that the parts of a picture add up.
    pub fn develop_part(&self) -> Image {
        self.developed(|mean| mean)
    }

    fn developed(&self, limited: impl Fn(f64) -> f64) -> Image {
        let [width, height] = self.desc.resolution.map(f64::from);
        // Splats are parts of the mean over the frame; each light path stands for as much of it.
        let splat_scale = width * height / self.n_light_paths.max(1) as f64;
        let pixel = |(index, sum): (usize, &PixelSum)| {
            let least = MIN_WEIGHT * sum.magnitude;
            let weight = sum.weight.abs().max(least).copysign(sum.weight);
            let inverse = if weight != 0.0 { 1.0 / weight } else { 0.0 };
            let splat = self.splats.get(index).copied().unwrap_or_default();
            [0, 1, 2].map(|channel| {
                let mean = sum.rgb[channel] * inverse + splat[channel] * splat_scale;
                (limited(mean) * self.desc.scale) as f32
            })
        };
        let data = self.sums.iter().enumerate().flat_map(pixel).collect();
        Image::new(self.desc.crop.width, self.desc.crop.height, 3, data)
            .expect("a film has pixels, three channels each")
    }
}

impl FilmBlock {
    /// Counts a light path: what it adds is a sample of the mean over the full frame.
    pub fn count_light_path(&mut self) {
        self.n_light_paths += 1;
    }

    /// Adds what a light path brings to a raster position, as a part of the mean over the full frame. It stays in the
    /// pixel it falls into, as in pbrt-v3; outside the crop window it is lost.
    pub fn add_splat(&mut self, desc: &FilmDesc, raster: [f64; 2], rgb: Rgb) {
        let pixel = raster.map(|r| r.floor() as i32);
        if desc.crop.holds(pixel) {
            let rgb = desc.limited(rgb);
            self.splats.push(Splat { pixel, rgb });
        }
    }

    /// Adds a sample of finite radiance at a raster position. `weight` is the camera's; it does not enter the
    /// denominator.
    #[inline]
    pub fn add_sample(&mut self, desc: &FilmDesc, raster: [f64; 2], radiance: Rgb, weight: f32) {
        self.add_part(desc, raster, desc.limited(radiance), weight, 1.0);
    }

    /// Adds a part of a sample, which is not limited in brightness. `weight` multiplies it, and it counts as `share` of a
    /// sample: the shares of all parts should add up to 1.
    #[inline]
    pub fn add_part(
        &mut self,
        desc: &FilmDesc,
        raster: [f64; 2],
        radiance: Rgb,
        weight: f32,
        share: f64,
    ) {
        let rgb = radiance.to_array().map(|c| c as f64 * weight as f64);
        let [rx, ry] = desc.filter.radius();
        let (px, py) = (raster[0] - 0.5, raster[1] - 0.5);
        let range = |p: f64, r: f64, lo: i32, n: usize| {
            let first = ((p - r).ceil() as i32).max(lo);
            let last = ((p + r).floor() as i32).min(lo + n as i32 - 1);
            (
                first,
                (first - lo) as usize,
                (last + 1 - first).max(0) as usize,
            )
        };
        let PixelRect {
            x0,
            y0,
            width,
            height,
        } = self.bounds;
        let (first_x, n_left, n_columns) = range(px, rx, x0, width);
        let (first_y, n_above, n_rows) = range(py, ry, y0, height);
        let lines = self.sums.chunks_exact_mut(width.max(1));
        for (y, line) in (first_y..).zip(lines.skip(n_above).take(n_rows)) {
            let weights = desc.filter.row(y as f64 - py);
            for (x, sum) in (first_x..).zip(line.iter_mut().skip(n_left).take(n_columns)) {
                let w = weights.at(x as f64 - px);
                for (sum, c) in sum.rgb.iter_mut().zip(rgb) {
                    *sum += c * w;
                }
                sum.weight += w * share;
                sum.magnitude += w.abs() * share;
            }
        }
    }
}
