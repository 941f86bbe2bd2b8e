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
    // Most samples are 8-bit codes.
    let stored: [f32; 256] = std::array::from_fn(|code| code as f32 / 255.0);
    let linear = stored.map(to_linear);
    for sample in image.data_mut() {
        let code = usize::from((*sample * 255.0 + 0.5) as u8);
        *sample = if stored[code] == *sample {
            linear[code]
        } else {
            to_linear(*sample)
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_become_linear_as_single_samples_do() {
        let codes = (0..=255u8).map(|code| f32::from(code) / 255.0);
        let others = [0.5, 0.1, 1.5, -0.25, 1e-9, 1e30, f32::INFINITY];
        let stored: Vec<f32> = codes.chain(others).collect();
        let mut image = Image::new(stored.len(), 1, 1, stored.clone()).expect("a picture");
        linearize(&mut image);
        let expected: Vec<f32> = stored.into_iter().map(to_linear).collect();
        assert_eq!(image.data(), expected);
    }
}
