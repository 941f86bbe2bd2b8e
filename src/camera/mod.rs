//! Cameras: from a point of the film to a ray and its weight. Knows no scene and no file.
//!
//! Raster space: x right, y down, the origin is the top left corner of the full frame, one unit is one pixel.
//! Camera space: +x right, +y up, +z forward, f64; a projection lives there, and only [`Camera`] knows where that is.

pub mod environment;
pub mod orthographic;
pub mod perspective;
pub mod screen;
pub mod thin_lens;

use glam::DVec3;

use crate::math::{Motion, Point3, Ray, Transform, Vec3};
pub use environment::Environment;
pub use orthographic::Orthographic;
pub use perspective::Perspective;
pub use screen::Screen;
pub use thin_lens::ThinLens;

/// A camera: a projection at a place, for as long as the shutter is open.
#[derive(Clone, Debug)]
pub struct Camera {
    projection: Projection,
    render_from_camera: Motion,
    shutter: [f32; 2],
}

/// From film to rays in camera space.
#[derive(Clone, Debug)]
pub enum Projection {
    /// All rays through one point, or through a thin lens.
    Perspective(Perspective),
    /// Parallel rays, or what a thin lens makes of them.
    Orthographic(Orthographic),
    /// All directions.
    Environment(Environment),
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

/// A ray in camera space.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LocalRay {
    /// Origin.
    pub o: DVec3,
    /// Direction, of any length.
    pub d: DVec3,
}

/// A ray in render space, and what the radiance along it counts.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CameraRay {
    /// The ray.
    pub ray: Ray,
    /// Multiplies the radiance; the film does not divide by it.
    pub weight: f32,
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
    /// Puts a projection at its place. `render_from_camera` need not keep lengths: rays are normalised. `shutter` is
    /// when the shutter opens and closes.
    pub fn new(projection: Projection, render_from_camera: Motion, shutter: [f32; 2]) -> Self {
        Self {
            projection,
            render_from_camera,
            shutter,
        }
    }

    /// The ray of a sample, or `None` if nothing reaches the film there: such a sample is black.
    #[inline]
    pub fn ray(&self, sample: &CameraSample) -> Option<CameraRay> {
        let (local, weight) = match &self.projection {
            Projection::Perspective(perspective) => (perspective.ray(sample), 1.0),
            Projection::Orthographic(orthographic) => (orthographic.ray(sample), 1.0),
            Projection::Environment(environment) => (environment.ray(sample.raster), 1.0),
        };
        let time = self.time(sample);
        let ray = into_render_space(&self.placed_at(time), local, time);
        Some(CameraRay { ray, weight })
    }

    /// The rays `step` pixels to the right and below.
    pub fn differential(&self, sample: &CameraSample, step: f64) -> Option<RayDifferential> {
        let shifted = |dx: f64, dy: f64| CameraSample {
            raster: [sample.raster[0] + dx, sample.raster[1] + dy],
            ..*sample
        };
        let neighbours = [shifted(step, 0.0), shifted(0.0, step)];
        let [right, below] = match &self.projection {
            Projection::Perspective(perspective) => neighbours.map(|s| perspective.ray(&s)),
            Projection::Orthographic(orthographic) => neighbours.map(|s| orthographic.ray(&s)),
            Projection::Environment(environment) => neighbours.map(|s| environment.ray(s.raster)),
        };
        let time = self.time(sample);
        let render_from_camera = self.placed_at(time);
        Some(RayDifferential {
            right: into_render_space(&render_from_camera, right, time),
            below: into_render_space(&render_from_camera, below, time),
        })
    }

    fn time(&self, sample: &CameraSample) -> f32 {
        let [open, close] = self.shutter;
        open + (close - open) * sample.time
    }

    /// Where the camera is. A motion that is singular for a moment shows what it shows at its start.
    #[inline]
    fn placed_at(&self, time: f32) -> Transform {
        let moved = self.render_from_camera.at(time);
        let placed = moved.or_else(|| self.render_from_camera.at(f32::NEG_INFINITY));
        placed.unwrap_or(Transform::IDENTITY)
    }
}

#[inline]
fn into_render_space(render_from_camera: &Transform, local: LocalRay, time: f32) -> Ray {
    Ray {
        o: Point3::from_f64(render_from_camera.point(local.o)),
        d: Vec3::from_f64(render_from_camera.vector(local.d).normalize()),
        time,
    }
}
