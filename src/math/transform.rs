//! Affine transforms in double precision. Names put the destination first: `render_from_object.point(p_object)`.

use glam::{DAffine3, DMat3, DMat4, DVec3};

/// An affine transform with its inverse.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Transform {
    forward: DAffine3,
    inverse: DAffine3,
}

impl Transform {
    /// Leaves everything where it is.
    pub const IDENTITY: Self = Self {
        forward: DAffine3::IDENTITY,
        inverse: DAffine3::IDENTITY,
    };

    /// From an affine matrix. `None` if the matrix is singular, not finite, or its bottom row is not (0, 0, 0, w).
    pub fn from_matrix(m: DMat4) -> Option<Self> {
        let bottom = m.row(3);
        if !m.is_finite() || bottom.truncate() != DVec3::ZERO || bottom.w == 0.0 {
            return None;
        }
        Self::from_affine(DAffine3::from_mat4(m * (1.0 / bottom.w)))
    }

    /// From an affine map; `None` if it has no finite inverse.
    pub fn from_affine(forward: DAffine3) -> Option<Self> {
        // Scaling by a power of two keeps the determinant of tiny and huge scenes in range, exactly.
        let m = forward.matrix3;
        let largest = m
            .x_axis
            .abs()
            .max(m.y_axis.abs())
            .max(m.z_axis.abs())
            .max_element();
        if !(largest > 0.0 && largest.is_finite() && forward.translation.is_finite()) {
            return None;
        }
        let scale = power_of_two_near(largest);
        let inverse3 = (m * (1.0 / scale)).inverse() * (1.0 / scale);
        let inverse = DAffine3 {
            matrix3: inverse3,
            translation: -(inverse3 * forward.translation),
        };
        (inverse3.is_finite() && inverse.translation.is_finite())
            .then_some(Self { forward, inverse })
    }

    /// Whether [`Transform::from_affine`] succeeds.
    pub fn is_invertible(map: &DAffine3) -> bool {
        is_tame(map) || Self::from_affine(*map).is_some()
    }

    /// A uniform scale followed by a translation.
    pub fn scale_translate(scale: f64, translation: DVec3) -> Self {
        let forward = DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::splat(scale)),
            translation,
        };
        let inverse = DAffine3 {
            matrix3: DMat3::from_diagonal(DVec3::splat(1.0 / scale)),
            translation: -translation / scale,
        };
        Self { forward, inverse }
    }

    /// First `other`, then this: `a_from_b.then_from(b_from_c)` is `a_from_c`.
    ///
    /// The inverse is that of the rounded product, not the rounded product of the inverses. Those would undo each
    /// other only to the size of the terms that cancelled, and a point put on a surface by one of them would lie
    /// beside it by the other, by more than the error bound of its coordinates.
    pub fn compose(&self, other: &Self) -> Self {
        let forward = self.forward * other.forward;
        Self::from_affine(forward).unwrap_or(Self {
            forward,
            inverse: other.inverse * self.inverse,
        })
    }

    /// The same transform the other way round.
    pub fn inverse(&self) -> Self {
        Self {
            forward: self.inverse,
            inverse: self.forward,
        }
    }

    /// Transforms a position.
    #[inline]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.forward.transform_point3(p)
    }

    /// Transforms a direction or displacement; lengths change with the scale.
    #[inline]
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.forward.transform_vector3(v)
    }

    /// Transforms a normal by the inverse transpose; not normalised.
    #[inline]
    pub fn normal(&self, n: DVec3) -> DVec3 {
        self.inverse.matrix3.transpose() * n
    }

    /// The map itself.
    pub fn affine(&self) -> &DAffine3 {
        &self.forward
    }

    /// Determinant of the linear part: the factor by which volumes grow, negative for a mirror.
    pub fn determinant(&self) -> f64 {
        self.forward.matrix3.determinant()
    }

    /// Whether it turns right-handed frames into left-handed ones.
    pub fn swaps_handedness(&self) -> bool {
        let m = self.forward.matrix3;
        m.x_axis
            .normalize_or_zero()
            .cross(m.y_axis.normalize_or_zero())
            .dot(m.z_axis)
            < 0.0
    }

    /// The scale factor if it is a similarity (rotation, uniform scale, translation, mirror) within `tolerance`.
    pub fn uniform_scale(&self, tolerance: f64) -> Option<f64> {
        let m = self.forward.matrix3;
        let lengths = [m.x_axis.length(), m.y_axis.length(), m.z_axis.length()];
        let mean = (lengths[0] + lengths[1] + lengths[2]) / 3.0;
        let skew = [
            m.x_axis.dot(m.y_axis),
            m.y_axis.dot(m.z_axis),
            m.z_axis.dot(m.x_axis),
        ];
        let similar = lengths.iter().all(|l| (l - mean).abs() <= tolerance * mean)
            && skew.iter().all(|s| s.abs() <= tolerance * mean * mean);
        similar.then_some(mean)
    }
}

/// Whether the linear part is so far from singular, and the whole so near to 1, that no doubt is left about the inverse
/// and nothing overflows. Most transforms are, and it takes little to know.
pub fn is_tame(map: &DAffine3) -> bool {
    const MODERATE: f64 = 1e9;
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
    let largest = [x, y, z]
        .iter()
        .fold(map.translation.abs(), |a, c| a.max(c.abs()));
    let determinant = x.cross(y).dot(z).abs();
    let squares = x.length_squared() * y.length_squared() * z.length_squared();
    map.is_finite()
        && largest.max_element() <= MODERATE
        && determinant >= 1.0 / MODERATE
        && determinant * determinant >= squares / (MODERATE * MODERATE)
}

/// The box around the image of a box, smallest and largest corner: to the last bit that of the images of its eight
/// corners, as rounded sums grow with their terms, wherever these are finite.
#[inline]
pub fn image_of_box(map: &DAffine3, [lo, hi]: [DVec3; 2]) -> [DVec3; 2] {
    let ends = |axis: DVec3, lo: f64, hi: f64| {
        let (a, b) = (axis * lo, axis * hi);
        [a.min(b), a.max(b)]
    };
    let m = &map.matrix3;
    let x = ends(m.x_axis, lo.x, hi.x);
    let y = ends(m.y_axis, lo.y, hi.y);
    let z = ends(m.z_axis, lo.z, hi.z);
    // In the order in which a point is transformed.
    [0, 1].map(|end| x[end] + y[end] + z[end] + map.translation)
}

/// The largest power of two not above `x`, for finite positive `x`.
pub fn power_of_two_near(x: f64) -> f64 {
    debug_assert!(x > 0.0 && x.is_finite());
    let bits = x.to_bits();
    if bits >> 52 == 0 {
        return f64::MIN_POSITIVE; // Subnormal input: the smallest normal power serves as well.
    }
    f64::from_bits(bits & (0x7ff << 52))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::animated::corners_of;

    #[test]
    fn inverse_undoes_tiny_and_huge_scales() {
        for k in [-300, -120, 0, 120, 300] {
            let s = 2f64.powi(k);
            let t =
                Transform::from_affine(DAffine3::from_scale(DVec3::splat(s))).expect("invertible");
            assert_eq!(
                t.inverse().point(t.point(DVec3::new(1.0, 2.0, 3.0))),
                DVec3::new(1.0, 2.0, 3.0)
            );
        }
    }

    /// Numbers in [-1/2, 1/2) without order; those of `sampling` are in a room above.
    fn numbers() -> impl FnMut() -> f64 {
        let mut k = 0u64;
        move || {
            k += 1;
            let bits = (k * k).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11;
            bits as f64 / (1u64 << 53) as f64 - 0.5
        }
    }

    #[test]
    fn the_image_of_a_box_is_bounded_by_those_of_its_corners_to_the_last_bit() {
        let mut next = numbers();
        let mut number = |scale: f64| next() * scale;
        for _ in 0..10_000 {
            let map = DAffine3::from_cols_array(&[0; 12].map(|_| number(3.0)));
            let [a, b] = [0; 2].map(|_| DVec3::new(number(1.0), number(7.0), number(100.0)));
            let [lo, hi] = [a.min(b), a.max(b)];
            let images = corners_of([lo, hi]).map(|p| map.transform_point3(p));
            let around = images
                .into_iter()
                .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lo, hi], p| {
                    [lo.min(p), hi.max(p)]
                });
            assert_eq!(image_of_box(&map, [lo, hi]), around);
        }
    }

    #[test]
    fn what_is_tame_has_an_inverse() {
        let mut next = numbers();
        let mut n_tame = 0;
        for k in 0..100_000 {
            let size = 10f64.powi(k % 23 - 11);
            let mut number = |scale: f64| next() * scale;
            let mut map = DAffine3::from_cols_array(&[0; 12].map(|_| number(size)));
            if k % 3 == 0 {
                // Nearly flat.
                map.matrix3.z_axis = map.matrix3.x_axis + map.matrix3.y_axis * number(1e-8);
            }
            n_tame += usize::from(is_tame(&map));
            assert!(
                !is_tame(&map) || Transform::from_affine(map).is_some(),
                "{map:?}"
            );
            assert_eq!(
                Transform::is_invertible(&map),
                Transform::from_affine(map).is_some()
            );
        }
        assert!(n_tame > 10_000, "{n_tame}");
    }

    #[test]
    fn singular_and_projective_matrices_are_refused() {
        assert!(Transform::from_matrix(DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0))).is_none());
        assert!(Transform::from_matrix(DMat4::from_cols_array(&[f64::NAN; 16])).is_none());
        let mut projective = DMat4::IDENTITY;
        projective.z_axis.w = 1.0;
        assert!(Transform::from_matrix(projective).is_none());
    }

    #[test]
    fn mirrors_are_recognised() {
        let mirror = |x, y, z| {
            Transform::from_affine(DAffine3::from_scale(DVec3::new(x, y, z)))
                .expect("invertible")
                .swaps_handedness()
        };
        assert!(mirror(-1.0, 1.0, 1.0) && mirror(-1.0, -1.0, -1e-20));
        assert!(!mirror(-1.0, -1.0, 1.0));
    }
}
