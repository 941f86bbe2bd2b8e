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

    #[test]
    fn folding_undoes_unfolding() {
        // A lattice with points on all axes, planes and diagonals.
        let lattice = |i: usize| Vec3A::from([i % 9, i / 9 % 9, i / 81].map(|c| c as f32 - 4.0));
        for w in (0..729).map(lattice).filter(|w| *w != Vec3A::ZERO) {
            for w in [w, -w] {
                let w = w.normalize();
                let place = unfold(w);
                assert!(place.iter().all(|c| (-1.0..=1.0).contains(c)));
                assert!(fold(place).abs_diff_eq(w, 1e-6), "{w} at {place:?}");
            }
        }
    }
}
