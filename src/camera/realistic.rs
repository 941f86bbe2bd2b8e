//! Realistic camera. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string lensfile` | required | lens table: radius, thickness, index, aperture diameter of each interface, in mm, scene side first |
//! | `float aperturediameter` | 1 | diameter of the stop in mm, at most the table's |
//! | `float focusdistance` | 10 | distance from film to plane in focus, in units of camera space taken as metres |
//! | `bool simpleweighting` | true | weights relative to the middle of the film; false: exposure |
//! | `float shutteropen`, `shutterclose` | 0, 1 | interval of ray times |
//!
//! The film's `diagonal` (mm) is the size of the sensor. `screenwindow` and `frameaspectratio` are not read.

use glam::DVec2;

use crate::camera::lens::{Lens, LensError};
use crate::camera::pupil::ExitPupil;
use crate::camera::{CameraSample, LocalRay};

/// What the radiance along a ray counts, besides cos⁴ θ and the area it was chosen from.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Weighting {
    /// Relative to the area of the pupil's bounds in the middle of the film.
    Simple,
    /// The exposure: proportional to irradiance and to the time the shutter is open, given in seconds.
    Exposure(f64),
}

/// A sensor behind a lens system.
#[derive(Clone, Debug)]
pub struct Realistic {
    lens: Lens,
    pupil: ExitPupil,
    /// Sensor position of raster point (0, 0), and its change per pixel.
    corner: DVec2,
    step: DVec2,
    /// Multiplies cos⁴ θ times the area.
    gain: f64,
}

impl Realistic {
    /// A camera with a focused lens and a sensor with the given diagonal in metres.
    ///
    /// # Errors
    /// No light gets through the lens, or its size is out of this world.
    pub fn new(
        lens: Lens,
        diagonal: f64,
        resolution: [u32; 2],
        weighting: Weighting,
    ) -> Result<Self, LensError> {
        let pupil = ExitPupil::new(&lens, diagonal * 0.5).ok_or(LensError::Opaque)?;
        let [width, height] = resolution.map(f64::from);
        let pixel = diagonal / width.hypot(height);
        let gain = match weighting {
            Weighting::Simple => 1.0 / pupil.reference_area(),
            Weighting::Exposure(time) => time / lens.rear_z().powi(2),
        };
        if !((pupil.greatest_area() * gain) as f32).is_finite() {
            return Err(LensError::OutOfRange);
        }
        Ok(Self {
            lens,
            pupil,
            // The lens turns the picture upside down: the frame's top left corner is at the bottom right, seen from
            // behind the camera.
            corner: DVec2::new(width, -height) * (0.5 * pixel),
            step: DVec2::new(-pixel, pixel),
            gain,
        })
    }

    /// The ray of a sample and its weight, or `None` if the lens blocks it.
    #[inline]
    pub fn ray(&self, sample: &CameraSample) -> Option<(LocalRay, f64)> {
        let film = self.film_point(sample.raster);
        let (rear, area) = self.rear_point(film, sample.lens);
        let ray = self.lens.trace(self.through(film, rear))?;
        // The film faces the lens: the angle to its normal is the angle to the axis.
        let z = self.lens.rear_z();
        let cos2 = z * z / (z * z + rear.distance_squared(film));
        Some((ray, cos2 * cos2 * area * self.gain))
    }

    /// The ray from another point of the film to the point of the rear plane that a sample chooses.
    pub fn shifted_ray(&self, sample: &CameraSample, raster: [f64; 2]) -> Option<LocalRay> {
        let (rear, _) = self.rear_point(self.film_point(sample.raster), sample.lens);
        self.lens.trace(self.through(self.film_point(raster), rear))
    }

    /// From a point of the film to one of the rear plane.
    fn through(&self, film: DVec2, rear: DVec2) -> LocalRay {
        LocalRay {
            o: film.extend(0.0),
            d: (rear - film).extend(self.lens.rear_z()),
        }
    }

    fn film_point(&self, raster: [f64; 2]) -> DVec2 {
        self.corner + self.step * DVec2::from(raster)
    }

    /// A point of the pupil's bounds for a film point, and their area.
    #[inline]
    fn rear_point(&self, film: DVec2, u: [f32; 2]) -> (DVec2, f64) {
        let radius = film.length();
        let bounds = self.pupil.bounds(&self.lens, radius);
        let direction = if radius > 0.0 {
            film / radius
        } else {
            DVec2::X
        };
        (direction.rotate(bounds.at(u)), bounds.area())
    }
}
