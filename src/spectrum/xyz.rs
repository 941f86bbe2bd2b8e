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
    let [x, y, z] = xyz;
    Rgb::from_array(RGB_FROM_XYZ.map(|row| (row[0] * x + row[1] * y + row[2] * z) as f32))
}
