//! The sRGB transfer curve, in the two directions the scene format uses it.

use crate::image::Image;

/// Stored value to linear: `v/12.92` up to 0.04045, `((v+0.055)/1.055)^2.4` above.
pub fn to_linear(stored: f32) -> f32 {
    if stored <= 0.04045 {
        stored / 12.92
    } else {
        ((stored + 0.055) / 1.055).powf(2.4)
    }
}

/// Linear to stored value: `12.92 v` up to 0.0031308, `1.055 v^(1/2.4) - 0.055` above.
pub fn from_linear(linear: f32) -> f32 {
    if linear <= 0.0031308 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

/// Linear to an 8-bit code, rounded and clamped; NaN becomes 0.
pub fn to_byte(linear: f32) -> u8 {
    // A float to integer cast saturates and sends NaN to 0.
    (255.0 * from_linear(linear) + 0.5) as u8
}

/// Every sample of an image to linear, in place.
pub fn linearize(image: &mut Image) {
    for sample in image.data_mut() {
        *sample = to_linear(*sample);
    }
}
