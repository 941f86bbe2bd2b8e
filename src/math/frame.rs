//! Orthonormal frames.

use crate::math::vector::{Normal3, Vec3};

/// An orthonormal right-handed frame; local +z is `n`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Frame {
    /// Local +x.
    pub s: Vec3,
    /// Local +y.
    pub t: Vec3,
    /// Local +z.
    pub n: Vec3,
}

impl Frame {
    /// A frame around a unit vector, continuous except at −z (Duff et al. 2017, JCGT 6:1).
    pub fn from_z(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z());
        let a = -1.0 / (sign + n.z());
        let b = n.x() * n.y() * a;
        let s = Vec3::new(1.0 + sign * n.x() * n.x() * a, sign * b, -sign * n.x());
        let t = Vec3::new(b, sign + n.y() * n.y() * a, -n.y());
        Self { s, t, n }
    }

    /// A frame around the unit normal `n` whose `s` leans toward `tangent`, as pbrt-v3 builds its shading frame.
    /// Falls back to [`Frame::from_z`] where the tangent is degenerate.
    pub fn from_normal_tangent(n: Normal3, tangent: Vec3) -> Self {
        let n = Vec3::from(n);
        let t = n.cross(tangent);
        match t.try_normalize() {
            Some(t) => Self {
                s: t.cross(n),
                t,
                n,
            },
            None => Self::from_z(n),
        }
    }

    /// Frame coordinates of a vector.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// The vector that has these frame coordinates.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x() + self.t * v.y() + self.n * v.z()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn n29_frames_are_orthonormal_in_every_direction() {
        let mut directions = vec![Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.0, 0.0, 1.0)];
        for k in 0..100_000u32 {
            // A spiral over the sphere, and a tight cluster around −z.
            let z = 1.0 - 2.0 * (k as f64 + 0.5) / 100_000.0;
            let r = (1.0 - z * z).sqrt();
            let phi = k as f64 * 2.399_963;
            directions.push(Vec3::new(
                (r * phi.cos()) as f32,
                (r * phi.sin()) as f32,
                z as f32,
            ));
            let e = 1e-7 * (k as f32 / 50_000.0 - 1.0);
            directions.push(Vec3::new(e, -e, -1.0));
        }
        for n in directions {
            let n = n.normalize();
            let f = Frame::from_z(n);
            for v in [f.s.dot(f.t), f.s.dot(f.n), f.t.dot(f.n)] {
                assert!(v.abs() < 1e-6, "{n:?}: {v}");
            }
            for v in [f.s, f.t] {
                assert!((v.length() - 1.0).abs() < 1e-6, "{n:?}");
            }
        }
    }
}
