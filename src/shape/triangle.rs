//! The watertight ray/triangle test.

use glam::DVec3;

use crate::math::Ray;
use crate::math::error::gamma;
use crate::shape::ElementHit;

/// A ray prepared for triangle tests: the shear that turns it into the z axis.
#[derive(Clone, Copy, Debug)]
pub struct RayShear {
    o: [f32; 3],
    d: [f32; 3],
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
        Self {
            o: ray.o.0.to_array(),
            d,
            axes: [x, y, z],
            shear: [-d[x] / d[z], -d[y] / d[z], 1.0 / d[z]],
        }
    }

    /// Vertex relative to the ray, sheared in x and y; z still unscaled.
    #[inline]
    fn vertex(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.axes;
        let pz = p[z] - self.o[z];
        [
            p[x] - self.o[x] + self.shear[0] * pz,
            p[y] - self.o[y] + self.shear[1] * pz,
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
    pub fn intersect(&self, corners: [[f32; 3]; 3], t_max: f32) -> Option<ElementHit> {
        let [mut p0, mut p1, mut p2] = corners.map(|p| self.vertex(p));
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
        let largest = |k: usize| p0[k].abs().max(p1[k].abs()).max(p2[k].abs());
        let (max_x, max_y, max_z) = (largest(0), largest(1), largest(2));
        let delta_z = gamma(3) * max_z;
        let delta_x = gamma(5) * (max_x + max_z);
        let delta_y = gamma(5) * (max_y + max_z);
        let delta_e = 2.0 * (gamma(2) * max_x * max_y + delta_y * max_x + delta_x * max_y);
        let max_e = e0.abs().max(e1.abs()).max(e2.abs());
        let delta_t = 3.0
            * (gamma(3) * max_e * max_z + delta_e * max_z + delta_z * max_e)
            * inverse_det.abs();
        if t <= delta_t {
            if t < -delta_t {
                return None;
            }
            t = self.distance_to_plane(corners);
        }
        (t > 0.0 && t < t_max).then_some(ElementHit {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::error::offset_origin;
    use crate::math::{Point3, Vec3};
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::{uniform_sphere, uniform_triangle};
    use crate::shape::Mesh;

    #[test]
    fn rays_that_leave_a_triangle_do_not_meet_it_again() {
        let mut rng = Rng::new(1);
        for k in 0..200_000 {
            let (size, distance) = (10f32.powi(k % 7 - 3), 10f32.powi(k / 7 % 7 - 3));
            let at = uniform_sphere(rng.uniform2()) * distance;
            let positions = [0, 1, 2].map(|_| {
                let mut p = (at + uniform_sphere(rng.uniform2()) * size).0.to_array();
                if k % 4 == 0 {
                    p[k as usize % 3] = if k % 8 == 0 { 0.0 } else { distance };
                }
                p
            });
            let mesh = Mesh {
                positions: positions.to_vec(),
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            };
            if mesh.bounds(0).is_empty() {
                continue;
            }
            let surface = mesh.surface(0, uniform_triangle(rng.uniform2()));
            let d = uniform_sphere(rng.uniform2());
            let ray = Ray {
                o: offset_origin(surface.p, surface.p_err, surface.ng, d),
                d,
                time: 0.0,
            };
            let hit = mesh.intersect(0, &RayShear::new(&ray), f32::INFINITY);
            assert_eq!(hit, None, "{positions:?} {ray:?}");
        }
    }

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
