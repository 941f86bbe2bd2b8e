//! Pixels: buffers, files as bytes, pyramids and comparisons.
//!
//! Owns: the pixel buffer ([`Image`]), the codecs ([`codec`] is their front door), the sRGB curve ([`srgb`]), texel
//! repair ([`repair`]), the mip pyramid with its filtered look-ups ([`mip`]), Ptex files ([`ptex`]) and measures of
//! difference ([`metrics`]).
//!
//! Refuses: paths and the file system, texture coordinates of surfaces, the film's sums, printing.
//!
//! Convention: the top row comes first, x to the right, y down, pixel (x, y) covers [x, x+1)×[y, y+1).

pub mod codec;
mod error;
mod hdr;
pub mod metrics;
pub mod mip;
mod openexr;
mod pfm;
pub mod ptex;
mod raster;
pub mod repair;
pub mod resample;
pub mod srgb;

pub use error::ImageError;

use crate::spectrum::Rgb;

/// A grid of grey or RGB pixels, 32-bit float, interleaved, top row first. Never empty.
#[derive(Clone, PartialEq, Debug)]
pub struct Image {
    width: usize,
    height: usize,
    channels: usize,
    data: Vec<f32>,
}

/// A rectangle of pixels: `x0 ≤ x < x0 + width`, `y0 ≤ y < y0 + height`.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct PixelRect {
    /// Left edge.
    pub x0: i32,
    /// Top edge.
    pub y0: i32,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl PixelRect {
    /// A rectangle with its corner at the origin.
    pub fn from_size(width: usize, height: usize) -> Self {
        Self {
            x0: 0,
            y0: 0,
            width,
            height,
        }
    }

    /// Whether a pixel lies inside.
    pub fn holds(&self, [x, y]: [i32; 2]) -> bool {
        let inside = |v: i32, start: i32, length: usize| {
            v >= start && (i64::from(v) - i64::from(start)) < length as i64
        };
        inside(x, self.x0, self.width) && inside(y, self.y0, self.height)
    }

    /// True when `other` lies inside.
    pub fn contains(&self, other: &Self) -> bool {
        let inside = |start: i32, length: usize, other_start: i32, other_length: usize| {
            let (start, other_start) = (i64::from(start), i64::from(other_start));
            other_start >= start && other_start + other_length as i64 <= start + length as i64
        };
        inside(self.x0, self.width, other.x0, other.width)
            && inside(self.y0, self.height, other.y0, other.height)
    }

    /// The pixels that lie in both. `None` when there are none.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let common = |start: i32, length: usize, other_start: i32, other_length: usize| {
            let end = |start: i32, length: usize| i64::from(start) + length as i64;
            let first = start.max(other_start);
            let end = end(start, length).min(end(other_start, other_length));
            let length = usize::try_from(end - i64::from(first)).ok()?;
            (length > 0).then_some((first, length))
        };
        let (x0, width) = common(self.x0, self.width, other.x0, other.width)?;
        let (y0, height) = common(self.y0, self.height, other.y0, other.height)?;
        Some(Self {
            x0,
            y0,
            width,
            height,
        })
    }
}

impl Image {
    /// Wraps interleaved samples; `channels` is 1 (grey) or 3 (RGB).
    ///
    /// # Errors
    /// [`ImageError::Invalid`] for a side of 0, another number of channels, or samples that do not fill the grid.
    pub fn new(
        width: usize,
        height: usize,
        channels: usize,
        data: Vec<f32>,
    ) -> Result<Self, ImageError> {
        let wanted = sample_count(width, height, channels);
        if width == 0 || height == 0 || !matches!(channels, 1 | 3) || wanted != Some(data.len()) {
            return Err(ImageError::Invalid(format!(
                "{} samples do not make an image of {width}x{height} pixels with {channels} channels",
                data.len()
            )));
        }
        Ok(Self {
            width,
            height,
            channels,
            data,
        })
    }

    /// A grey image of one pixel.
    pub fn constant(value: f32) -> Self {
        Self {
            width: 1,
            height: 1,
            channels: 1,
            data: vec![value],
        }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// 1 for grey, 3 for RGB.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// All samples, interleaved, top row first.
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// All samples, to change in place.
    pub fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// Gives the samples away.
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }

    /// The channels of one pixel. Panics outside the image.
    pub fn pixel(&self, x: usize, y: usize) -> &[f32] {
        assert!(x < self.width, "column {x} of {}", self.width);
        let start = (y * self.width + x) * self.channels;
        &self.data[start..start + self.channels]
    }

    /// One pixel as a colour; grey counts for all three channels. Panics outside the image.
    pub fn rgb(&self, x: usize, y: usize) -> Rgb {
        rgb_of(self.pixel(x, y))
    }

    /// Rows, top first, each `width · channels` samples.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, f32> {
        self.data.chunks_exact(self.width * self.channels)
    }

    /// Turns the image upside down: textures count t from the bottom row of a file.
    pub fn flip_vertical(&mut self) {
        let row = self.width * self.channels;
        let (top, bottom) = self.data.split_at_mut(self.height / 2 * row);
        for (a, b) in top
            .chunks_exact_mut(row)
            .zip(bottom.chunks_exact_mut(row).rev())
        {
            a.swap_with_slice(b);
        }
    }

    /// Grey by luminance; grey images pass unchanged.
    pub fn into_grey(self) -> Self {
        if self.channels == 1 {
            return self;
        }
        let data = self
            .data
            .chunks_exact(3)
            .map(|pixel| rgb_of(pixel).luminance())
            .collect();
        Self {
            channels: 1,
            data,
            ..self
        }
    }

    /// The part inside `rect`, whose corner counts from this image's top left pixel. `None` when it does not fit.
    pub fn crop(&self, rect: PixelRect) -> Option<Self> {
        if rect.width == 0 || rect.height == 0 || !Self::bounds(self).contains(&rect) {
            return None;
        }
        let (x0, y0) = (rect.x0 as usize, rect.y0 as usize);
        let columns = x0 * self.channels..(x0 + rect.width) * self.channels;
        let data = self
            .rows()
            .skip(y0)
            .take(rect.height)
            .flat_map(|row| &row[columns.clone()])
            .copied()
            .collect();
        Some(Self {
            width: rect.width,
            height: rect.height,
            channels: self.channels,
            data,
        })
    }

    /// All pixels, with the corner at the origin.
    pub fn bounds(&self) -> PixelRect {
        PixelRect::from_size(self.width, self.height)
    }
}

/// Grey or RGB samples of one pixel as a colour.
fn rgb_of(pixel: &[f32]) -> Rgb {
    match *pixel {
        [r, g, b] => Rgb::new(r, g, b),
        _ => Rgb::splat(pixel[0]),
    }
}

/// Number of samples of a grid, unless it overflows.
fn sample_count(width: usize, height: usize, channels: usize) -> Option<usize> {
    width.checked_mul(height)?.checked_mul(channels)
}
