//! The sphere unfolded to a square over an octahedron (Meyer et al. 2010, *On Floating-Point Normal Vectors*).

use glam::Vec3A;

/// The place in [−1, 1]² of a direction that is not zero.
#[inline]
pub fn unfold(w: Vec3A) -> [f32; 2] {
    let a = w.abs();
    let p = w / (a.x + a.y + a.z);
    if p.z >= 0.0 {
        [p.x, p.y]
    } else {
        [
            (1.0 - p.y.abs()).copysign(p.x),
            (1.0 - p.x.abs()).copysign(p.y),
        ]
    }
}

/// The unit direction at a place in [−1, 1]².
#[inline]
pub fn fold([x, y]: [f32; 2]) -> Vec3A {
    let z = 1.0 - x.abs() - y.abs();
    let p = if z >= 0.0 {
        Vec3A::new(x, y, z)
    } else {
        let below = |c: f32, other: f32| (1.0 - other.abs()).copysign(c);
        Vec3A::new(below(x, y), below(y, x), z)
    };
    p.normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::uniform_sphere;

    #[test]
    fn folding_undoes_unfolding() {
        let mut rng = Rng::new(4);
        for k in 0..10_000 {
            let mut w = uniform_sphere(rng.uniform2()).0;
            if k % 4 == 0 {
                w[k % 3] = if k % 8 == 0 { 0.0 } else { -0.0 };
                w = w.normalize();
            }
            let place = unfold(w);
            assert!(place.iter().all(|c| (-1.0..=1.0).contains(c)));
            assert!(fold(place).abs_diff_eq(w, 1e-6), "{w} at {place:?}");
        }
        for axis in [Vec3A::X, Vec3A::NEG_X, Vec3A::Y, Vec3A::NEG_Z, Vec3A::Z] {
            assert!(fold(unfold(axis)).abs_diff_eq(axis, 1e-6), "{axis}");
        }
    }
}
