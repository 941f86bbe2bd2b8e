//! The watertight ray/triangle test.

use glam::DVec3;

use crate::accel::lanes::{Numbers, Single};
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

    /// The shear in x and y, and the scale of z.
    #[inline]
    pub(super) fn shear(&self) -> [f32; 3] {
        self.shear
    }

    /// A point with the axis nearest to the ray last.
    #[inline(always)]
    fn turned(&self, p: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.axes;
        [p[x], p[y], p[z]]
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
        let n = Single;
        let [p0, p1, p2] = corners.map(|corner| sheared(n, corner, self.o, self.shear));
        let mut e = edges(n, [p0, p1, p2]);
        if e.contains(&0.0) {
            let edge = |a: [f32; 3], b: [f32; 3]| {
                (a[0] as f64 * b[1] as f64 - a[1] as f64 * b[0] as f64) as f32
            };
            e = [edge(p1, p2), edge(p2, p0), edge(p0, p1)];
        }
        if e.iter().any(|&e| e < 0.0) && e.iter().any(|&e| e > 0.0) {
            return None;
        }
        if e[0] + e[1] + e[2] == 0.0 {
            return None;
        }
        let Meeting {
            mut t,
            error,
            inverse_det,
        } = Meeting::new(n, [p0, p1, p2], e);
        if t >= t_max {
            return None;
        }
        if t <= error {
            if t < -error {
                return None;
            }
            t = self.distance_to_plane(corners);
        }
        (t > 0.0 && t < t_max).then_some(TriangleHit {
            t,
            barycentric: [e[0] * inverse_det, e[1] * inverse_det],
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

/// A corner with the axis nearest to the ray last, relative to the ray that starts in `o`, sheared.
#[inline(always)]
pub(super) fn sheared<N: Numbers>(
    n: N,
    corner: [N::Floats; 3],
    o: [N::Floats; 3],
    shear: [N::Floats; 3],
) -> [N::Floats; 3] {
    let [x, y, z] = [
        n.sub(corner[0], o[0]),
        n.sub(corner[1], o[1]),
        n.sub(corner[2], o[2]),
    ];
    [
        n.add(x, n.mul(shear[0], z)),
        n.add(y, n.mul(shear[1], z)),
        n.mul(shear[2], z),
    ]
}

/// The edge values of a triangle of sheared corners: all of one sign where the ray passes through it.
#[inline(always)]
pub(super) fn edges<N: Numbers>(n: N, [p0, p1, p2]: [[N::Floats; 3]; 3]) -> [N::Floats; 3] {
    [edge(n, p1, p2), edge(n, p2, p0), edge(n, p0, p1)]
}

#[inline(always)]
fn edge<N: Numbers>(n: N, a: [N::Floats; 3], b: [N::Floats; 3]) -> N::Floats {
    n.sub(n.mul(a[0], b[1]), n.mul(a[1], b[0]))
}

/// Where a ray meets the plane of a triangle.
pub(super) struct Meeting<F> {
    /// Distance along the ray.
    pub(super) t: F,
    /// The most by which it is wrong.
    pub(super) error: F,
    /// What turns edge values into weights of the vertices.
    pub(super) inverse_det: F,
}

impl<F: Copy> Meeting<F> {
    /// From sheared corners and edge values.
    #[inline(always)]
    pub(super) fn new<N: Numbers<Floats = F>>(n: N, [p0, p1, p2]: [[F; 3]; 3], e: [F; 3]) -> Self {
        let det = n.add(n.add(e[0], e[1]), e[2]);
        let t_scaled = n.add(
            n.add(n.mul(e[0], p0[2]), n.mul(e[1], p1[2])),
            n.mul(e[2], p2[2]),
        );
        let inverse_det = n.div(n.splat(1.0), det);
        let max_x = largest(n, p0[0], p1[0], p2[0]);
        let max_y = largest(n, p0[1], p1[1], p2[1]);
        let max_z = largest(n, p0[2], p1[2], p2[2]);
        let max_e = largest(n, e[0], e[1], e[2]);
        let gamma2 = n.splat(gamma(2));
        let gamma3 = n.splat(gamma(3));
        let gamma5 = n.splat(gamma(5));
        let delta_z = n.mul(gamma3, max_z);
        let delta_x = n.mul(gamma5, n.add(max_x, max_z));
        let delta_y = n.mul(gamma5, n.add(max_y, max_z));
        let delta_xy = n.add(
            n.add(n.mul(n.mul(gamma2, max_x), max_y), n.mul(delta_y, max_x)),
            n.mul(delta_x, max_y),
        );
        let delta_e = n.mul(n.splat(2.0), delta_xy);
        let delta = n.add(
            n.add(n.mul(n.mul(gamma3, max_e), max_z), n.mul(delta_e, max_z)),
            n.mul(delta_z, max_e),
        );
        Self {
            t: n.mul(t_scaled, inverse_det),
            error: n.mul(n.mul(n.splat(3.0), delta), n.abs(inverse_det)),
            inverse_det,
        }
    }
}

/// The largest absolute value.
#[inline(always)]
fn largest<N: Numbers>(n: N, a: N::Floats, b: N::Floats, c: N::Floats) -> N::Floats {
    n.max(n.max(n.abs(a), n.abs(b)), n.abs(c))
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
