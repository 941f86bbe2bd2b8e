//! Texels no light or reflectance can have.

use crate::image::Image;

/// What [`repair`] changed, in samples (a pixel has one or three).
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Repairs {
    /// NaN, now 0.
    pub nan: usize,
    /// Below 0 or minus infinity, now 0.
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

/// Makes every sample finite and not negative.
pub fn repair(image: &mut Image) -> Repairs {
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
        } else if *sample < 0.0 {
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
