//! How far two images are apart. Sums run in f64 over all samples, in the order of the image.

use std::fmt;

use crate::image::Image;
use crate::spectrum::xyz::XYZ_FROM_RGB;

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

/// All measures of two images at once, over the pixels that are finite in both.
///
/// Without such a pixel the measures are NaN.
#[derive(Clone, PartialEq, Debug)]
pub struct Comparison {
    /// Pixels whose samples are all finite in both images: those the measures are about.
    pub n_compared: usize,
    /// Pixels with a sample of the image under test that is not finite.
    pub n_non_finite_test: usize,
    /// Pixels with a sample of the reference that is not finite.
    pub n_non_finite_reference: usize,
    /// Mean of the squared differences over all samples.
    pub mse: f64,
    /// Mean of `(a - b)² / (b² + 0.01·m²)` over all samples, `m` the mean sample of the reference `b`.
    ///
    /// The floor of a tenth of the mean keeps black pixels from ruling the sum. Tied to the mean, it leaves the measure
    /// unchanged when both images are scaled. An all-black reference gives 0 for an all-black test and infinity
    /// otherwise.
    pub rel_mse: f64,
    /// Mean of the absolute differences over all samples.
    pub mae: f64,
    /// The largest sample of the reference.
    pub peak: f64,
    /// Means of the image under test, per channel.
    pub test_mean: Vec<f64>,
    /// Means of the reference, per channel.
    pub reference_mean: Vec<f64>,
}

impl Comparison {
    /// Compares.
    ///
    /// # Errors
    /// Images of different shape.
    pub fn new(test: &Image, reference: &Image) -> Result<Self, ShapeMismatch> {
        same_shape(test, reference)?;
        let channels = test.channels();
        let count = |image: &Image| {
            let pixels = image.data().chunks_exact(channels);
            pixels.filter(|pixel| !is_finite(pixel)).count()
        };
        let mut n_compared = 0;
        let mut peak = f64::NAN;
        let (mut test_mean, mut reference_mean) = (vec![0.0; channels], vec![0.0; channels]);
        for (a, b) in finite_pairs(test, reference) {
            n_compared += 1;
            for channel in 0..channels {
                let b = f64::from(b[channel]);
                test_mean[channel] += f64::from(a[channel]);
                reference_mean[channel] += b;
                // The larger one, and a number rather than none.
                peak = peak.max(b);
            }
        }
        for sum in test_mean.iter_mut().chain(&mut reference_mean) {
            *sum /= n_compared as f64;
        }
        let level = reference_mean.iter().sum::<f64>() / channels as f64;
        let (mut squared, mut relative, mut absolute) = (0.0, 0.0, 0.0);
        for (a, b) in finite_pairs(test, reference) {
            for (&a, &b) in a.iter().zip(b) {
                let (a, b) = (f64::from(a), f64::from(b));
                squared += squared_error(a, b);
                relative += relative_squared_error(a, b, level);
                absolute += (a - b).abs();
            }
        }
        let n_samples = (n_compared * channels) as f64;
        Ok(Self {
            n_compared,
            n_non_finite_test: count(test),
            n_non_finite_reference: count(reference),
            mse: squared / n_samples,
            rel_mse: relative / n_samples,
            mae: absolute / n_samples,
            peak,
            test_mean,
            reference_mean,
        })
    }

    /// Square root of [`mse`](Self::mse).
    pub fn rmse(&self) -> f64 {
        self.mse.sqrt()
    }

    /// `10·log10(peak² / mse)` in decibels: infinite for equal images, NaN unless `peak` is above 0.
    pub fn psnr(&self, peak: f64) -> f64 {
        if peak > 0.0 {
            10.0 * (peak * peak / self.mse).log10()
        } else {
            f64::NAN
        }
    }

    /// Mean of the image under test over that of the reference, per channel. Equal means have the ratio 1, also if
    /// they are 0.
    pub fn mean_ratios(&self) -> Vec<f64> {
        let means = self.test_mean.iter().zip(&self.reference_mean);
        means
            .map(|(a, b)| if a == b { 1.0 } else { a / b })
            .collect()
    }

    /// The largest `|ratio - 1|` of [`mean_ratios`](Self::mean_ratios); NaN when there are no means.
    pub fn mean_ratio_error(&self) -> f64 {
        let errors = self.mean_ratios().into_iter();
        errors
            .map(|ratio| (ratio - 1.0).abs())
            .max_by(f64::total_cmp)
            .unwrap_or(f64::NAN)
    }
}

/// Absolute difference of luminance of every pixel, rows from the top; `None` where a sample of either image is not
/// finite.
///
/// # Errors
/// Images of different shape.
pub fn luminance_errors(
    test: &Image,
    reference: &Image,
) -> Result<Vec<Option<f64>>, ShapeMismatch> {
    same_shape(test, reference)?;
    let error = |(a, b): (&[f32], &[f32])| {
        if !is_finite(a) || !is_finite(b) {
            return None;
        }
        let difference = |channel: usize| f64::from(a[channel]) - f64::from(b[channel]);
        let luminance: f64 = if a.len() == 1 {
            difference(0)
        } else {
            let weights = XYZ_FROM_RGB[1].iter().enumerate();
            weights.map(|(channel, w)| w * difference(channel)).sum()
        };
        Some(luminance.abs())
    };
    Ok(pixel_pairs(test, reference).map(error).collect())
}

/// Both images, pixel by pixel.
fn pixel_pairs<'a>(
    test: &'a Image,
    reference: &'a Image,
) -> impl Iterator<Item = (&'a [f32], &'a [f32])> {
    let pixels = |image: &'a Image| image.data().chunks_exact(image.channels());
    pixels(test).zip(pixels(reference))
}

/// The pixels that are finite in both images.
fn finite_pairs<'a>(
    test: &'a Image,
    reference: &'a Image,
) -> impl Iterator<Item = (&'a [f32], &'a [f32])> {
    pixel_pairs(test, reference).filter(|(a, b)| is_finite(a) && is_finite(b))
}

fn is_finite(pixel: &[f32]) -> bool {
    pixel.iter().all(|sample| sample.is_finite())
}

fn squared_error(a: f64, b: f64) -> f64 {
    (a - b) * (a - b)
}

/// See [`Comparison::rel_mse`]; `level` is the mean sample of the reference.
fn relative_squared_error(a: f64, b: f64, level: f64) -> f64 {
    const FLOOR: f64 = 0.01;
    if a == b {
        0.0
    } else {
        squared_error(a, b) / (b * b + FLOOR * level * level)
    }
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
