//! Axis-aligned boxes.

use glam::{DVec3, Vec3A};

use crate::math::vector::Point3;

/// An axis-aligned box; empty while `min > max` in some axis.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Bounds3 {
    /// Smallest corner.
    pub min: Point3,
    /// Largest corner.
    pub max: Point3,
}

impl Bounds3 {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self {
        min: Point3(Vec3A::splat(f32::INFINITY)),
        max: Point3(Vec3A::splat(f32::NEG_INFINITY)),
    };

    /// Whether it holds no point.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.min.0.cmpgt(self.max.0).any()
    }

    /// The smallest box that holds this one and `p`.
    #[inline]
    pub fn with_point(self, p: Point3) -> Self {
        Self {
            min: Point3(self.min.0.min(p.0)),
            max: Point3(self.max.0.max(p.0)),
        }
    }

    /// The smallest box that holds both.
    #[inline]
    pub fn union(self, other: Self) -> Self {
        Self {
            min: Point3(self.min.0.min(other.min.0)),
            max: Point3(self.max.0.max(other.max.0)),
        }
    }

    /// The smallest f32 box that holds a box given in f64.
    pub fn around(lo: DVec3, hi: DVec3) -> Self {
        let down = |x: f64| {
            let y = x as f32;
            if y as f64 > x { y.next_down() } else { y }
        };
        let up = |x: f64| {
            let y = x as f32;
            if (y as f64) < x { y.next_up() } else { y }
        };
        Self {
            min: Point3::new(down(lo.x), down(lo.y), down(lo.z)),
            max: Point3::new(up(hi.x), up(hi.y), up(hi.z)),
        }
    }

    /// The middle of the box.
    #[inline]
    pub fn center(&self) -> Point3 {
        Point3(self.min.0 * 0.5 + self.max.0 * 0.5)
    }

    /// Edge lengths; meaningless for an empty box.
    #[inline]
    pub fn extent(&self) -> Vec3A {
        self.max.0 - self.min.0
    }

    /// Half the surface area, the measure of the surface-area heuristic; 0 for an empty box.
    #[inline]
    pub fn half_area(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        let e = self.extent();
        e.x * e.y + e.y * e.z + e.z * e.x
    }
}
