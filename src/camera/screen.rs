//! The screen window: what part of the image plane the film shows.

use glam::DVec2;

/// The map from raster space to the screen window.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    /// Screen position of raster point (0, 0).
    corner: DVec2,
    /// Change per pixel.
    step: DVec2,
    /// Pixels of the full frame.
    resolution: DVec2,
}

impl Screen {
    /// The full frame of `resolution` pixels shows `window`: x0, x1 from left to right, y0, y1 from bottom to top.
    pub fn new(window: [f64; 4], resolution: [u32; 2]) -> Self {
        let [x0, x1, y0, y1] = window;
        let [width, height] = resolution.map(f64::from);
        Self {
            // Raster y runs down, screen y up.
            corner: DVec2::new(x0, y1),
            step: DVec2::new((x1 - x0) / width, (y0 - y1) / height),
            resolution: DVec2::new(width, height),
        }
    }

    /// The window whose shorter axis runs from −1 to 1, for a ratio of width to height.
    pub fn default_window(aspect: f64) -> [f64; 4] {
        if aspect > 1.0 {
            [-aspect, aspect, -1.0, 1.0]
        } else {
            [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect]
        }
    }

    /// Screen position of a raster position.
    #[inline]
    pub fn at(&self, raster: [f64; 2]) -> DVec2 {
        self.corner + self.step * DVec2::from(raster)
    }

    /// Raster position of a screen position, within the full frame or beyond.
    #[inline]
    pub fn raster(&self, at: DVec2) -> [f64; 2] {
        ((at - self.corner) / self.step).to_array()
    }

    /// Whether a raster position is in the full frame.
    #[inline]
    pub fn holds(&self, raster: [f64; 2]) -> bool {
        let raster = DVec2::from(raster);
        raster.cmpge(DVec2::ZERO).all() && raster.cmplt(self.resolution).all()
    }

    /// Area of the window.
    #[inline]
    pub fn area(&self) -> f64 {
        (self.step * self.resolution).element_product().abs()
    }
}
