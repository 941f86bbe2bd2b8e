//! Points, vectors, normals, rays, boxes, frames, transforms, rounding-error bounds, sines of turns, and spheres unfolded.
//!
//! Values of the inner loop are f32 on SIMD registers; transforms are f64. Knows nothing of shapes or scenes.

pub mod animated;
pub mod bounds;
pub mod error;
pub mod frame;
pub mod octahedron;
pub mod ray;
pub mod spline;
pub mod transform;
pub mod turns;
pub mod vector;

pub use animated::{AnimatedTransform, Motion, MotionChain};
pub use bounds::Bounds3;
pub use frame::Frame;
pub use ray::Ray;
pub use transform::Transform;
pub use turns::sin_cos_of_turns;
pub use vector::{Normal3, Point3, Vec3};

/// The lesser of two numbers, for which there is one instruction; `b` where one of them is none.
#[inline(always)]
pub(crate) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers; `b` where one of them is none.
#[inline(always)]
pub(crate) fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
