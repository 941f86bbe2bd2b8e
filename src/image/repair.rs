//! Texels no light or reflectance can have.

use crate::image::Image;

/// What samples may be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Samples {
    /// Light and reflectances.
    NonNegative,
    /// Heights too, which have two sides.
    Finite,
}

/// What [`repair`] changed, in samples (a pixel has one or three).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Repairs {
    /// NaN, now 0.
    pub nan: usize,
    /// Minus infinity, or below 0 where that may not be; now 0.
    pub negative: usize,
    /// Plus infinity, now the largest finite sample of the image, or 0 when there is none.
    pub infinite: usize,
}

impl Repairs {
    /// Number of samples changed.
    pub fn total(&self) -> usize {
        self.nan + self.negative + self.infinite
    }
}

/// Makes every sample what `samples` says.
pub fn repair(image: &mut Image, samples: Samples) -> Repairs {
    let lowest = match samples {
        Samples::NonNegative => 0.0,
        Samples::Finite => f32::MIN,
    };
    // Nearly every image is sound, and a pass that only looks runs as fast as memory does.
    let is_sound = |ok: bool, sample: &f32| ok & (*sample >= lowest) & (*sample <= f32::MAX);
    if image.data().iter().fold(true, is_sound) {
        return Repairs::default();
    }
    let largest = image
        .data()
        .iter()
        .copied()
        .filter(|sample| sample.is_finite())
        .fold(0.0, f32::max);
    let mut repairs = Repairs::default();
    for sample in image.data_mut() {
        let (count, value) = if sample.is_nan() {
            (&mut repairs.nan, 0.0)
        } else if *sample < lowest {
            (&mut repairs.negative, 0.0)
        } else if sample.is_infinite() {
            (&mut repairs.infinite, largest)
        } else {
            continue;
        };
        *count += 1;
        *sample = value;
    }
    repairs
}
