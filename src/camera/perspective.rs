//! Perspective camera. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `float fov` | 90 | full angle in degrees over screen half extent 1, the shorter axis by default |
//! | `float halffov` | −1 | if positive, half of `fov` |
//! | `float frameaspectratio` | xres / yres | shapes the default screen window |
//! | `float[4] screenwindow` | by aspect | x0 x1 y0 y1 |
//! | `float lensradius` | 0 | thin lens; 0 is a pinhole |
//! | `float focaldistance` | 10⁶ | distance of the plane in focus |
//! | `float shutteropen`, `shutterclose` | 0, 1 | interval of ray times |

use glam::DVec3;

use crate::camera::{CameraSample, LocalRay, Screen, ThinLens};

/// All rays through one point, or through a thin lens around it.
#[derive(Clone, Copy, Debug)]
pub struct Perspective {
    /// On the plane z = 1.
    screen: Screen,
    lens: ThinLens,
}

impl Perspective {
    /// A camera with a full field of view of `fov` radians, in (0, π), over the part of `window` (x0, x1, y0, y1)
    /// from −1 to 1.
    pub fn new(fov: f64, window: [f64; 4], resolution: [u32; 2], lens: ThinLens) -> Self {
        let tan = (fov * 0.5).tan();
        Self {
            screen: Screen::new(window.map(|s| s * tan), resolution),
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
            o: DVec3::ZERO,
            d: self.screen.at(sample.raster).extend(1.0),
        };
        self.lens.bend(chief, sample.lens)
    }

    /// Density in sr⁻¹ of a ray of unit direction `d` from any point of the lens, for film positions uniform over the
    /// full frame. `d` is in front of the camera.
    #[inline]
    pub fn pdf_w(&self, d: DVec3) -> f64 {
        // Through any point of the lens directions map to the film as through its centre, moved.
        1.0 / (self.screen.area() * d.z * d.z * d.z)
    }

    /// Whether a raster position is in the full frame.
    #[inline]
    pub fn frames(&self, raster: [f64; 2]) -> bool {
        self.screen.holds(raster)
    }

    /// The point of the lens that `u_lens` chooses, and where on the film or beside it light from `p` that falls on
    /// it arrives. `None` behind the camera.
    #[inline]
    pub fn arrival(&self, p: DVec3, u_lens: [f32; 2]) -> Option<(DVec3, [f64; 2])> {
        if !(p.z > 0.0) {
            return None;
        }
        let on_lens = self.lens.at(u_lens);
        let mut on_screen = (p.truncate() - on_lens) / p.z;
        if self.lens.radius > 0.0 {
            on_screen += on_lens / self.lens.focal_distance;
        }
        Some((on_lens.extend(0.0), self.screen.raster(on_screen)))
    }
}
