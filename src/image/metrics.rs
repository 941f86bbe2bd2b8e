//! How far two images are apart. Sums run in f64 over all samples, in the order of the image.

use std::fmt;

use crate::image::Image;

/// The images differ in resolution or channels.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ShapeMismatch {
    /// Width, height and channels of the image under test.
    pub test: [usize; 3],
    /// Width, height and channels of the reference.
    pub reference: [usize; 3],
}

impl fmt::Display for ShapeMismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [test, reference] = [self.test, self.reference]
            .map(|[w, h, channels]| format!("{w}x{h} pixels of {channels} channels"));
        write!(f, "the image has {test}, the reference {reference}")
    }
}

impl std::error::Error for ShapeMismatch {}

/// Means of one block in both images, per channel.
#[derive(Clone, PartialEq, Debug)]
pub struct BlockMeans {
    /// Left edge of the block in pixels.
    pub x: usize,
    /// Top edge of the block in pixels.
    pub y: usize,
    /// Means of the image under test.
    pub test: Vec<f64>,
    /// Means of the reference.
    pub reference: Vec<f64>,
}

/// The mean of every channel.
pub fn mean(image: &Image) -> Vec<f64> {
    block_mean(image, 0..image.width(), 0..image.height())
}

/// Mean of the squared differences over all samples.
///
/// # Errors
/// Images of different shape; so for every measure here.
pub fn mse(test: &Image, reference: &Image) -> Result<f64, ShapeMismatch> {
    mean_over_samples(test, reference, |a, b| (a - b) * (a - b))
}

/// Mean of `(a - b)² / (b² + 0.01·m²)` over all samples, `m` the mean sample of the reference `b`.
///
/// The floor of a tenth of the mean keeps black pixels from ruling the sum. Tied to the mean, it leaves the measure
/// unchanged when both images are scaled. An all-black reference gives 0 for an all-black test and infinity otherwise.
pub fn rel_mse(test: &Image, reference: &Image) -> Result<f64, ShapeMismatch> {
    const FLOOR: f64 = 0.01;
    let level =
        reference.data().iter().map(|&b| f64::from(b)).sum::<f64>() / reference.data().len() as f64;
    let floor = FLOOR * level * level;
    mean_over_samples(test, reference, |a, b| {
        if a == b {
            0.0
        } else {
            (a - b) * (a - b) / (b * b + floor)
        }
    })
}

/// Means over square blocks of `side` pixels, row by row; blocks at the right and bottom edge may be smaller.
pub fn block_means(
    test: &Image,
    reference: &Image,
    side: usize,
) -> Result<Vec<BlockMeans>, ShapeMismatch> {
    same_shape(test, reference)?;
    let side = side.max(1);
    let (width, height) = (test.width(), test.height());
    let corners = (0..height)
        .step_by(side)
        .flat_map(|y| (0..width).step_by(side).map(move |x| (x, y)));
    let means = |image: &Image, x: usize, y: usize| {
        block_mean(image, x..width.min(x + side), y..height.min(y + side))
    };
    Ok(corners
        .map(|(x, y)| BlockMeans {
            x,
            y,
            test: means(test, x, y),
            reference: means(reference, x, y),
        })
        .collect())
}

fn block_mean(
    image: &Image,
    columns: std::ops::Range<usize>,
    rows: std::ops::Range<usize>,
) -> Vec<f64> {
    let mut sums = vec![0.0; image.channels()];
    for y in rows.clone() {
        for x in columns.clone() {
            for (sum, &sample) in sums.iter_mut().zip(image.pixel(x, y)) {
                *sum += f64::from(sample);
            }
        }
    }
    let n_pixels = (columns.len() * rows.len()) as f64;
    sums.into_iter().map(|sum| sum / n_pixels).collect()
}

fn mean_over_samples(
    test: &Image,
    reference: &Image,
    f: impl Fn(f64, f64) -> f64,
) -> Result<f64, ShapeMismatch> {
    same_shape(test, reference)?;
    let pairs = test.data().iter().zip(reference.data());
    let sum: f64 = pairs.map(|(&a, &b)| f(f64::from(a), f64::from(b))).sum();
    Ok(sum / test.data().len() as f64)
}

fn same_shape(test: &Image, reference: &Image) -> Result<(), ShapeMismatch> {
    let shape = |image: &Image| [image.width(), image.height(), image.channels()];
    if shape(test) == shape(reference) {
        Ok(())
    } else {
        Err(ShapeMismatch {
            test: shape(test),
            reference: shape(reference),
        })
    }
}
