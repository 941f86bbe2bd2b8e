//! Environment camera. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float lensradius`, `focaldistance` | 0, 10³⁰ | no effect |
//! | `float frameaspectratio`, `float[4] screenwindow` | | no effect |
//! | `float shutteropen`, `shutterclose` | 0, 1 | interval of ray times |
//!
//! The frame shows all directions: rows run from +y down to −y, columns from +x by way of +z (in the first quarter)
//! around to +x again.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::camera::LocalRay;

/// All directions from one point, in latitude and longitude.
#[derive(Clone, Copy, Debug)]
pub struct Environment {
    /// Radians per pixel: φ over x, θ over y.
    step: [f64; 2],
    /// Pixels of the full frame.
    resolution: [f64; 2],
}

impl Environment {
    /// A frame of `resolution` pixels.
    pub fn new(resolution: [u32; 2]) -> Self {
        let [width, height] = resolution.map(f64::from);
        Self {
            step: [TAU / width, PI / height],
            resolution: [width, height],
        }
    }

    /// Density in sr⁻¹ of a ray of unit direction `d` for film positions uniform over the full frame.
    #[inline]
    pub fn pdf_w(&self, d: DVec3) -> f64 {
        1.0 / (TAU * PI * d.x.hypot(d.z))
    }

    /// Where on the film light from `p` arrives; by rounding, on its right or lower edge.
    #[inline]
    pub fn arrival(&self, p: DVec3) -> [f64; 2] {
        let phi = p.z.atan2(p.x).rem_euclid(TAU);
        let theta = p.x.hypot(p.z).atan2(p.y);
        [phi / self.step[0], theta / self.step[1]]
    }

    /// Whether a raster position is in the full frame.
    #[inline]
    pub fn frames(&self, raster: [f64; 2]) -> bool {
        [0, 1]
            .iter()
            .all(|&axis| (0.0..self.resolution[axis]).contains(&raster[axis]))
    }

    /// The ray of a raster position. Beyond the frame the angles go on: over a pole, or once more around.
    #[inline]
    pub fn ray(&self, raster: [f64; 2]) -> LocalRay {
        let (sin_phi, cos_phi) = (self.step[0] * raster[0]).sin_cos();
        let (sin_theta, cos_theta) = (self.step[1] * raster[1]).sin_cos();
        LocalRay {
            o: DVec3::ZERO,
            d: DVec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi),
        }
    }
}
