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

use crate::camera::CameraSample;
use crate::math::{Motion, Point3, Ray, Transform, Vec3};
use crate::sampling::warp::concentric_disk;

/// What shapes a perspective camera, in camera space: +x right, +y up, +z forward.
#[derive(Clone, Debug)]
pub struct PerspectiveDesc {
    /// Camera to render space. Need not keep lengths: rays are normalised.
    pub render_from_camera: Motion,
    /// Full frame in pixels.
    pub resolution: [u32; 2],
    /// x0, x1, y0, y1 on the plane z = 1 / tan(fov / 2).
    pub screen_window: [f64; 4],
    /// Full field of view in radians, in (0, π).
    pub fov: f64,
    /// Radius of the lens in camera space; 0 is a pinhole.
    pub lens_radius: f64,
    /// Distance of the plane in focus.
    pub focal_distance: f64,
    /// Opening and closing time of the shutter.
    pub shutter: [f32; 2],
}

/// A perspective camera.
#[derive(Clone, Debug)]
pub struct Perspective {
    render_from_camera: Motion,
    /// Direction in camera space (z = 1) of raster point (0, 0), and its change per pixel in x and in y.
    corner: DVec3,
    dx: f64,
    dy: f64,
    lens_radius: f64,
    focal_distance: f64,
    shutter: [f32; 2],
}

impl Perspective {
    /// Sets up the camera.
    pub fn new(desc: PerspectiveDesc) -> Self {
        let tan = (desc.fov * 0.5).tan();
        let [x0, x1, y0, y1] = desc.screen_window.map(|s| s * tan);
        let [width, height] = desc.resolution.map(f64::from);
        Self {
            render_from_camera: desc.render_from_camera,
            // Raster y runs down, screen y up.
            corner: DVec3::new(x0, y1, 1.0),
            dx: (x1 - x0) / width,
            dy: (y0 - y1) / height,
            lens_radius: desc.lens_radius,
            focal_distance: desc.focal_distance,
            shutter: desc.shutter,
        }
    }

    /// The ray of a sample (pbrt 3rd ed., section 6.2.3 for the lens).
    #[inline]
    pub fn ray(&self, sample: &CameraSample) -> Ray {
        let [x, y] = sample.raster;
        let mut d = self.corner + DVec3::new(self.dx * x, self.dy * y, 0.0);
        let mut o = DVec3::ZERO;
        if self.lens_radius > 0.0 {
            let lens = concentric_disk(sample.lens).map(|c| c as f64 * self.lens_radius);
            o = DVec3::new(lens[0], lens[1], 0.0);
            d = d * self.focal_distance - o;
        }
        let [open, close] = self.shutter;
        let time = open + (close - open) * sample.time;
        // A motion that is singular for a moment shows what it shows at its start.
        let moved = self.render_from_camera.at(time);
        let placed = moved.or_else(|| self.render_from_camera.at(f32::NEG_INFINITY));
        let render_from_camera = placed.unwrap_or(Transform::IDENTITY);
        Ray {
            o: Point3::from_f64(render_from_camera.point(o)),
            d: Vec3::from_f64(render_from_camera.vector(d).normalize()),
            time,
        }
    }
}
