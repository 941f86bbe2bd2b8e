//! The watertight ray/triangle test.

use crate::math::Ray;
use crate::math::error::gamma;
use crate::shape::ElementHit;

/// A ray prepared for triangle tests: the shear that turns it into the z axis.
#[derive(Clone, Copy, Debug)]
pub struct RayShear {
    o: [f32; 3],
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

    /// The ray's meeting with a triangle in (0, `t_max`): no crack between triangles that share an edge, and no
    /// hit nearer than its own rounding error (pbrt 3rd ed., section 3.9.6).
    ///
    /// Woop, Benthin, Wald 2013 (JCGT 2:1); the edge values are redone in f64 where one is exactly 0.
    #[inline]
    pub fn intersect(&self, p: [[f32; 3]; 3], t_max: f32) -> Option<ElementHit> {
        let [mut p0, mut p1, mut p2] = p.map(|p| self.vertex(p));
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
        if det < 0.0 && (t_scaled >= 0.0 || t_scaled < t_max * det)
            || det > 0.0 && (t_scaled <= 0.0 || t_scaled > t_max * det)
        {
            return None;
        }
        let inverse_det = 1.0 / det;
        let t = t_scaled * inverse_det;
        // A distance below its error bound may be the surface the ray has just left.
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
        (t > delta_t && t < t_max).then_some(ElementHit {
            t,
            barycentric: [e0 * inverse_det, e1 * inverse_det],
        })
    }
}
