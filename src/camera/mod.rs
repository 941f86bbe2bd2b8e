//! Cameras: from a point of the film to a ray. Knows no scene and no file.
//!
//! Raster space: x right, y down, the origin is the top left corner of the full frame, one unit is one pixel.

pub mod perspective;

use crate::math::Ray;
pub use perspective::Perspective;

/// A camera.
#[derive(Clone, Debug)]
pub enum Camera {
    /// Pinhole or thin lens.
    Perspective(Perspective),
}

/// The numbers a camera turns into a ray.
#[derive(Clone, Copy, Debug)]
pub struct CameraSample {
    /// Position in raster space.
    pub raster: [f64; 2],
    /// Position in the shutter interval, in [0, 1).
    pub time: f32,
    /// Position on the lens.
    pub lens: [f32; 2],
}

/// The rays through the neighbouring samples, which give the footprint of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct RayDifferential {
    /// One step to the right.
    pub right: Ray,
    /// One step down.
    pub below: Ray,
}

impl Camera {
    /// The ray of a sample.
    #[inline]
    pub fn ray(&self, sample: &CameraSample) -> Ray {
        match self {
            Self::Perspective(camera) => camera.ray(sample),
        }
    }

    /// The rays `step` pixels to the right and below.
    pub fn differential(&self, sample: &CameraSample, step: f64) -> RayDifferential {
        let shifted = |dx: f64, dy: f64| {
            let raster = [sample.raster[0] + dx, sample.raster[1] + dy];
            self.ray(&CameraSample { raster, ..*sample })
        };
        RayDifferential {
            right: shifted(step, 0.0),
            below: shifted(0.0, step),
        }
    }
}
