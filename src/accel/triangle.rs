//! The watertight ray/triangle test.

use glam::DVec3;

use crate::math::Ray;
use crate::math::error::gamma;

/// A ray's meeting with a triangle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TriangleHit {
    /// Distance along the ray, positive.
    pub t: f32,
    /// Weights of the first two vertices.
    pub barycentric: [f32; 2],
}

/// A ray prepared for triangle tests: the shear that turns it into the z axis.
#[derive(Clone, Copy, Debug)]
pub struct RayShear {
    /// Origin and direction, turned.
    o: [f32; 3],
    d: [f32; 3],
    /// The axes that become x, y and z.
    axes: [usize; 3],
    shear: [f32; 3],
}

impl RayShear {
    /// Prepares a ray.
    #[inline]
    pub fn new(ray: &Ray) -> Self {
        let d = ray.d.0.to_array();
        let a = d.map(f32::abs);
        let z = if a[0] > a[1] {
            if a[0] > a[2] { 0 } else { 2 }
        } else if a[1] > a[2] {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        let o = ray.o.0.to_array();
        Self {
            o: [o[x], o[y], o[z]],
            d: [d[x], d[y], d[z]],
            axes: [x, y, z],
            shear: [-d[x] / d[z], -d[y] / d[z], 1.0 / d[z]],
        }
    }

    /// Where the ray starts, turned.
    #[inline]
    pub(super) fn origin(&self) -> [f32; 3] {
        self.o
    }

    /// The axes that become x, y and z.
    #[inline]
    pub(super) fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// The shear in x and y.
    #[inline]
    pub(super) fn xy_shear(&self) -> [f32; 2] {
        [self.shear[0], self.shear[1]]
    }

    /// A point with the axis nearest to the ray last.
    #[inline(always)]
    fn turned(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.axes;
        [p[x], p[y], p[z]]
    }

    /// Turned vertex relative to the ray, sheared in x and y; z still unscaled.
    #[inline(always)]
    fn vertex(&self, p: [f32; 3]) -> [f32; 3] {
        let pz = p[2] - self.o[2];
        [
            p[0] - self.o[0] + self.shear[0] * pz,
            p[1] - self.o[1] + self.shear[1] * pz,
            pz,
        ]
    }

    /// The ray's meeting with a triangle in (0, `t_max`): no crack between triangles that share an edge.
    ///
    /// Woop, Benthin, Wald 2013 (JCGT 2:1); the edge values are redone in f64 where one is exactly 0, and the distance
    /// where it is smaller than its rounding error (pbrt 3rd ed., section 3.9.6). A ray that starts beyond the error
    /// box of a surface point is then never sent back to that surface, and one that starts in a corner never misses
    /// the other wall.
    #[inline]
    pub fn intersect(&self, corners: [[f32; 3]; 3], t_max: f32) -> Option<TriangleHit> {
        let [p0, p1, p2] = corners;
        self.intersect_turned([self.turned(p0), self.turned(p1), self.turned(p2)], t_max)
    }

    /// See [`RayShear::intersect`]; the corners have the coordinates in the order of [`RayShear::axes`].
    #[inline(always)]
    pub(super) fn intersect_turned(
        &self,
        corners: [[f32; 3]; 3],
        t_max: f32,
    ) -> Option<TriangleHit> {
        let mut p0 = self.vertex(corners[0]);
        let mut p1 = self.vertex(corners[1]);
        let mut p2 = self.vertex(corners[2]);
        let mut e0 = p1[0] * p2[1] - p1[1] * p2[0];
        let mut e1 = p2[0] * p0[1] - p2[1] * p0[0];
        let mut e2 = p0[0] * p1[1] - p0[1] * p1[0];
        if e0 == 0.0 || e1 == 0.0 || e2 == 0.0 {
            let edge = |a: [f32; 3], b: [f32; 3]| {
                (a[0] as f64 * b[1] as f64 - a[1] as f64 * b[0] as f64) as f32
            };
            (e0, e1, e2) = (edge(p1, p2), edge(p2, p0), edge(p0, p1));
        }
        if (e0 < 0.0 || e1 < 0.0 || e2 < 0.0) && (e0 > 0.0 || e1 > 0.0 || e2 > 0.0) {
            return None;
        }
        let det = e0 + e1 + e2;
        if det == 0.0 {
            return None;
        }
        p0[2] *= self.shear[2];
        p1[2] *= self.shear[2];
        p2[2] *= self.shear[2];
        let t_scaled = e0 * p0[2] + e1 * p1[2] + e2 * p2[2];
        let inverse_det = 1.0 / det;
        let mut t = t_scaled * inverse_det;
        if t >= t_max {
            return None;
        }
        let max_x = largest(p0[0], p1[0], p2[0]);
        let max_y = largest(p0[1], p1[1], p2[1]);
        let max_z = largest(p0[2], p1[2], p2[2]);
        let delta_z = gamma(3) * max_z;
        let delta_x = gamma(5) * (max_x + max_z);
        let delta_y = gamma(5) * (max_y + max_z);
        let delta_e = 2.0 * (gamma(2) * max_x * max_y + delta_y * max_x + delta_x * max_y);
        let max_e = largest(e0, e1, e2);
        let delta_t = 3.0
            * (gamma(3) * max_e * max_z + delta_e * max_z + delta_z * max_e)
            * inverse_det.abs();
        if t <= delta_t {
            if t < -delta_t {
                return None;
            }
            t = self.distance_to_plane(corners);
        }
        (t > 0.0 && t < t_max).then_some(TriangleHit {
            t,
            barycentric: [e0 * inverse_det, e1 * inverse_det],
        })
    }

    /// Distance along the ray to the plane of a triangle, in f64: its sign is exact for all but the last bits of f32
    /// input.
    #[cold]
    fn distance_to_plane(&self, corners: [[f32; 3]; 3]) -> f32 {
        let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
        let [p0, p1, p2] = corners.map(wide);
        let n = (p1 - p0).cross(p2 - p0);
        (n.dot(p0 - wide(self.o)) / n.dot(wide(self.d))) as f32
    }
}

/// The largest absolute value.
#[inline(always)]
fn largest(a: f32, b: f32, c: f32) -> f32 {
    a.abs().max(b.abs()).max(c.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Point3, Vec3};
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::uniform_sphere;

    #[test]
    fn g04_a_wall_is_met_from_the_smallest_distance() {
        let wall = [[0.0, -0.6, -0.5], [0.0, 0.9, -0.4], [0.0, 0.1, 0.7]];
        let mut rng = Rng::new(2);
        for k in 0..10_000 {
            let x = 10f32.powi(-(k % 30));
            let d = uniform_sphere(rng.uniform2());
            let d = Vec3::new(d.x().abs().max(0.1), d.y(), d.z()).normalize();
            let target = Point3::new(0.0, 0.1 * rng.uniform(), 0.1 * rng.uniform());
            let mut o = target - d * (x / d.x());
            o.0.x = -x;
            let ray = Ray { o, d, time: 0.0 };
            let hit = RayShear::new(&ray).intersect(wall, f32::INFINITY);
            assert!(hit.is_some_and(|hit| hit.t > 0.0), "{ray:?}");
        }
    }
}
