//! Orthographic camera. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float frameaspectratio` | xres / yres | shapes the default screen window |
//! | `float[4] screenwindow` | by aspect | x0 x1 y0 y1, in camera space |
//! | `float lensradius` | 0 | thin lens; 0 is none |
//! | `float focaldistance` | 10⁶ | distance of the plane in focus |
//! | `float shutteropen`, `shutterclose` | 0, 1 | interval of ray times |
//!
//! Every point of the screen window has a lens of its own around it.

use glam::DVec3;

use crate::camera::{CameraSample, LocalRay, Screen, ThinLens};

/// Parallel rays along +z that start in the plane z = 0.
#[derive(Clone, Copy, Debug)]
pub struct Orthographic {
    screen: Screen,
    lens: ThinLens,
}

impl Orthographic {
    /// A camera that shows `window` (x0, x1, y0, y1) of the plane z = 0.
    pub fn new(window: [f64; 4], resolution: [u32; 2], lens: ThinLens) -> Self {
        Self {
            screen: Screen::new(window, resolution),
            lens,
        }
    }

    /// Whether the point of the lens makes a difference.
    #[inline]
    pub fn has_lens(&self) -> bool {
        self.lens.radius > 0.0
    }

    /// The ray of a sample.
    #[inline]
    pub fn ray(&self, sample: &CameraSample) -> LocalRay {
        let chief = LocalRay {
            o: self.screen.at(sample.raster).extend(0.0),
            d: DVec3::Z,
        };
        self.lens.bend(chief, sample.lens)
    }
}
