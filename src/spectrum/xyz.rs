//! CIE XYZ and linear RGB.
//!
//! The six-digit matrices of Rec. 709 with a D65 white, as the scene format fixes them. Rounded as they are, they are
//! inverse to each other to 2·10⁻⁶ only.

use crate::spectrum::Rgb;

/// Rows give R, G, B from X, Y, Z.
pub const RGB_FROM_XYZ: [[f64; 3]; 3] = [
    [3.240479, -1.537150, -0.498535],
    [-0.969256, 1.875991, 0.041556],
    [0.055648, -0.204043, 1.057311],
];

/// Rows give X, Y, Z from R, G, B.
pub const XYZ_FROM_RGB: [[f64; 3]; 3] = [
    [0.412453, 0.357580, 0.180423],
    [0.212671, 0.715160, 0.072169],
    [0.019334, 0.119193, 0.950227],
];

/// Linear RGB of a tristimulus value; outside the gamut some channel is negative.
pub fn rgb_from_xyz(xyz: [f64; 3]) -> Rgb {
    Rgb::from_array(transform(&RGB_FROM_XYZ, xyz).map(|channel| channel as f32))
}

/// Tristimulus value of linear RGB.
pub fn xyz_from_rgb(rgb: Rgb) -> [f64; 3] {
    transform(&XYZ_FROM_RGB, rgb.to_array().map(f64::from))
}

fn transform(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}
