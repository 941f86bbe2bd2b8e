//! The thin lens (pbrt 3rd ed., section 6.2.3).

use glam::DVec2;

use crate::camera::LocalRay;
use crate::sampling::warp::concentric_disk;

/// An ideal lens in the plane z = 0 that brings one plane into focus.
#[derive(Clone, Copy, Debug)]
pub struct ThinLens {
    /// Radius in camera space; 0 is a pinhole.
    pub radius: f64,
    /// Distance of the plane in focus, along z.
    pub focal_distance: f64,
}

impl ThinLens {
    /// A point of the lens.
    #[inline]
    pub fn at(&self, u: [f32; 2]) -> DVec2 {
        if self.radius > 0.0 {
            DVec2::from(concentric_disk(u).map(f64::from)) * self.radius
        } else {
            DVec2::ZERO
        }
    }

    /// The ray through a point of the lens in place of the one through its centre, `chief`, whose direction has
    /// z = 1: both meet where the chief ray crosses the plane in focus.
    #[inline]
    pub fn bend(&self, chief: LocalRay, u: [f32; 2]) -> LocalRay {
        if self.radius > 0.0 {
            let offset = self.at(u).extend(0.0);
            LocalRay {
                o: chief.o + offset,
                d: chief.d * self.focal_distance - offset,
            }
        } else {
            chief
        }
    }
}
