//! Cameras: from a point of the film to a ray and its weight. Knows no scene and no file.
//!
//! Raster space: x right, y down, the origin is the top left corner of the full frame, one unit is one pixel.
//! Camera space: +x right, +y up, +z forward, f64; a projection lives there, and only [`Camera`] knows where that is.

pub mod environment;
pub mod importance;
pub mod lens;
pub mod orthographic;
pub mod perspective;
pub mod pupil;
pub mod realistic;
pub mod screen;
pub mod thin_lens;

use glam::DVec3;

use crate::math::{Motion, Point3, Ray, Transform, Vec3};
pub use environment::Environment;
pub use importance::Arrival;
pub use orthographic::Orthographic;
pub use perspective::Perspective;
pub use realistic::Realistic;
pub use screen::Screen;
pub use thin_lens::ThinLens;

/// Pixels between the rays from which the change along the film is found where it is not the same all over.
const DIFFERENCE: f64 = 0.05;

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
    /// What a lens system lets through.
    Realistic(Box<Realistic>),
}

impl Projection {
    /// The ray from a point of the film through the middle of the lens, where rays are straight from there on.
    pub fn chief_ray(&self, raster: [f64; 2]) -> Option<LocalRay> {
        let sample = CameraSample {
            raster,
            time: 0.0,
            lens: [0.5; 2],
        };
        match self {
            Self::Perspective(perspective) => Some(perspective.ray(&sample)),
            Self::Orthographic(orthographic) => Some(orthographic.ray(&sample)),
            Self::Environment(_) | Self::Realistic(_) => None,
        }
    }
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
            Projection::Realistic(realistic) => {
                let (ray, weight) = realistic.ray(sample)?;
                (ray, weight as f32)
            }
        };
        let time = self.time(sample);
        let ray = into_render_space(&self.placed_at(time), local, time);
        Some(CameraRay { ray, weight })
    }

    /// The rays `step` pixels to the right and below, through the same point of the lens. Where lines of the film
    /// are no lines of the scene, they are extrapolated from the sample's nearest surroundings. `None` if the lens
    /// blocks those.
    pub fn differential(&self, sample: &CameraSample, step: f64) -> Option<RayDifferential> {
        self.differential_at(sample.raster, sample.lens, self.time(sample), step)
    }

    /// The same for a ray through the point `lens` of the lens at `time`.
    pub fn differential_at(
        &self,
        raster: [f64; 2],
        lens: [f32; 2],
        time: f32,
        step: f64,
    ) -> Option<RayDifferential> {
        // A sample's own time is the camera's alone.
        let sample = CameraSample {
            raster,
            time: 0.0,
            lens,
        };
        let local = |axis: usize| {
            let shifted = |by: f64| {
                let mut raster = raster;
                raster[axis] += by;
                CameraSample { raster, ..sample }
            };
            match &self.projection {
                Projection::Perspective(perspective) => Some(perspective.ray(&shifted(step))),
                Projection::Orthographic(orthographic) => Some(orthographic.ray(&shifted(step))),
                Projection::Environment(environment) => {
                    extrapolated(step, |by| Some(environment.ray(shifted(by).raster)))
                }
                Projection::Realistic(realistic) => extrapolated(step, |by| {
                    realistic.shifted_ray(&sample, shifted(by).raster)
                }),
            }
        };
        let [right, below] = [local(0)?, local(1)?];
        let render_from_camera = self.placed_at(time);
        Some(RayDifferential {
            right: into_render_space(&render_from_camera, right, time),
            below: into_render_space(&render_from_camera, below, time),
        })
    }

    /// Whether the point of the lens makes a difference.
    #[inline]
    pub fn has_lens(&self) -> bool {
        match &self.projection {
            Projection::Perspective(perspective) => perspective.has_lens(),
            Projection::Orthographic(orthographic) => orthographic.has_lens(),
            Projection::Environment(_) => false,
            Projection::Realistic(_) => true,
        }
    }

    /// Whether it stands still while the shutter is open.
    #[inline]
    pub fn is_still(&self) -> bool {
        let shutter = self.shutter.map(f64::from);
        self.render_from_camera.is_still_within(shutter)
    }

    /// When the shutter opens and closes.
    pub fn shutter(&self) -> [f32; 2] {
        self.shutter
    }

    /// The time of a sample.
    pub fn time(&self, sample: &CameraSample) -> f32 {
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

/// The ray `step` pixels on, from one `DIFFERENCE` on or, if there is none, back.
fn extrapolated(step: f64, ray: impl Fn(f64) -> Option<LocalRay>) -> Option<LocalRay> {
    let here = ray(0.0)?;
    let from = |by: f64| {
        let there = ray(by)?;
        Some(LocalRay {
            o: here.o + (there.o - here.o) * (step / by),
            d: here.d + (there.d - here.d) * (step / by),
        })
    };
    from(DIFFERENCE).or_else(|| from(-DIFFERENCE))
}

#[inline]
fn into_render_space(render_from_camera: &Transform, local: LocalRay, time: f32) -> Ray {
    Ray {
        o: Point3::from_f64(render_from_camera.point(local.o)),
        d: Vec3::from_f64(render_from_camera.vector(local.d).normalize()),
        time,
    }
}
