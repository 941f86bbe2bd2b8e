//! Rays.

use crate::math::vector::{Point3, Vec3};

/// A half-line. `d` has unit length, so distances along it are lengths in render space.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ray {
    /// Origin.
    pub o: Point3,
    /// Unit direction.
    pub d: Vec3,
    /// Time, in the units of the shutter.
    pub time: f32,
}

impl Ray {
    /// The point at distance `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Point3 {
        self.o + self.d * t
    }
}
