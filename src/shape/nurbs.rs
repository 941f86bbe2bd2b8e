//! NURBS patches, diced into triangles. Scene-file manual:
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer nu`, `nv` | required | control points along u and v |
//! | `integer uorder`, `vorder` | required | degree + 1 |
//! | `float uknots`, `vknots` | required | n + order knots, not descending |
//! | `float u0`, `u1`, `v0`, `v1` | knot `order − 1`, knot `n` | part of the patch |
//! | `point3 P` | — | nu · nv control points, u fastest |
//! | `float Pw` | — | the same as homogeneous x y z w, used as they are |
//!
//! The patch becomes 30 × 30 vertices with analytic normals; (u, v) are the parameters as they are.
//!
//! Bases and their derivatives follow Piegl and Tiller (1997, *The NURBS Book*, algorithm A2.2 and equation 2.7).

use std::fmt;

use glam::{DVec3, DVec4, Vec4Swizzles};

use crate::shape::Mesh;
use crate::shape::heightfield::grid_triangles;

/// Vertices along each side of a diced patch.
pub const N_DICED: usize = 30;

/// One direction of a patch.
#[derive(Clone, Debug)]
pub struct KnotVector {
    knots: Vec<f64>,
    order: usize,
    n_points: usize,
}

/// Why a knot vector makes no patch.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum KnotError {
    /// There are fewer control points than the order, or the order is below 2.
    Order,
    /// There should be this many knots.
    Count(usize),
    /// This knot is not finite, or less than the one before.
    Descending(usize),
    /// The patch has no extent.
    Empty,
}

impl fmt::Display for KnotError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Order => write!(
                f,
                "the order must be at least 2 and at most the number of control points"
            ),
            Self::Count(count) => write!(f, "control points and order need {count} knots"),
            Self::Descending(index) => {
                write!(f, "knot {index} is not finite or less than the one before")
            }
            Self::Empty => write!(f, "all knots of the patch are equal"),
        }
    }
}

impl KnotVector {
    /// Checks the knots for `n_points` control points of a curve of degree `order` − 1.
    ///
    /// # Errors
    ///
    /// See [`KnotError`].
    pub fn new(knots: &[f32], order: usize, n_points: usize) -> Result<Self, KnotError> {
        if order < 2 || order > n_points {
            return Err(KnotError::Order);
        }
        if knots.len() != n_points + order {
            return Err(KnotError::Count(n_points + order));
        }
        if !knots[0].is_finite() {
            return Err(KnotError::Descending(0));
        }
        if let Some(index) = knots
            .windows(2)
            .position(|k| !(k[1] >= k[0] && k[1].is_finite()))
        {
            return Err(KnotError::Descending(index + 1));
        }
        let vector = Self {
            knots: knots.iter().map(|&k| f64::from(k)).collect(),
            order,
            n_points,
        };
        let [start, end] = vector.range();
        if start < end {
            Ok(vector)
        } else {
            Err(KnotError::Empty)
        }
    }

    /// Where the patch starts and ends.
    pub fn range(&self) -> [f64; 2] {
        [self.knots[self.order - 1], self.knots[self.n_points]]
    }

    /// Index of the last knot of the patch that starts an interval and is not above `x`.
    fn span(&self, x: f64) -> usize {
        let candidates = self.order - 1..self.n_points;
        let starts = |&k: &usize| self.knots[k] < self.knots[k + 1];
        let first = candidates
            .clone()
            .find(starts)
            .expect("the range is not empty");
        candidates
            .rev()
            .find(|k| self.knots[*k] <= x && starts(k))
            .unwrap_or(first)
    }

    /// The values at `x` of the bases of a degree that are not 0 in a span.
    fn bases(&self, degree: usize, span: usize, x: f64) -> Vec<f64> {
        let mut bases = vec![1.0];
        for d in 1..=degree {
            let mut carried = 0.0;
            for (r, basis) in bases.iter_mut().enumerate() {
                let (left, right) = (self.knots[span + r + 1 - d], self.knots[span + r + 1]);
                let share = *basis / (right - left);
                *basis = carried + (right - x) * share;
                carried = (x - left) * share;
            }
            bases.push(carried);
        }
        bases
    }

    /// The first control point that counts at `x`, and for each the weight and its derivative.
    fn weights(&self, x: f64) -> (usize, Vec<[f64; 2]>) {
        let degree = self.order - 1;
        let span = self.span(x);
        let first = span - degree;
        let lower = self.bases(degree - 1, span, x);
        let slope = |j: usize| {
            let i = first + j;
            lower[j - 1] / (self.knots[i + degree] - self.knots[i])
        };
        let bases = self.bases(degree, span, x).into_iter().enumerate();
        let weights = bases.map(|(j, basis)| {
            let rising = if j > 0 { slope(j) } else { 0.0 };
            let falling = if j < degree { slope(j + 1) } else { 0.0 };
            [basis, degree as f64 * (rising - falling)]
        });
        (first, weights.collect())
    }
}

/// A patch: homogeneous control points, u fastest.
#[derive(Clone, Debug)]
pub struct Patch {
    /// Along u.
    pub u: KnotVector,
    /// Along v.
    pub v: KnotVector,
    /// As many as the product of the numbers of points along u and v.
    pub points: Vec<DVec4>,
}

impl Patch {
    /// The mesh of the part between `from` and `to` in (u, v), in object space.
    pub fn diced(&self, from: [f64; 2], to: [f64; 2]) -> Mesh {
        let parameters = |k: usize| {
            let share = |i: usize| i as f64 / (N_DICED - 1) as f64;
            (0..N_DICED).map(move |i| from[k] * (1.0 - share(i)) + to[k] * share(i))
        };
        let along_u: Vec<_> = parameters(0).map(|u| (u, self.u.weights(u))).collect();
        let mut mesh = Mesh {
            triangles: grid_triangles(N_DICED, N_DICED),
            ..Mesh::default()
        };
        for v in parameters(1) {
            let v_weights = self.v.weights(v);
            for (u, u_weights) in &along_u {
                let (p, n) = self.evaluate(u_weights, &v_weights);
                mesh.positions.push(p.as_vec3().to_array());
                mesh.normals.push(n.as_vec3().to_array());
                mesh.uvs.push([*u as f32, v as f32]);
            }
        }
        mesh
    }

    /// Point and unit normal; a normal of 0 where there is none.
    fn evaluate(
        &self,
        (first_u, u_weights): &(usize, Vec<[f64; 2]>),
        (first_v, v_weights): &(usize, Vec<[f64; 2]>),
    ) -> (DVec3, DVec3) {
        let [mut h, mut by_u, mut by_v] = [DVec4::ZERO; 3];
        for (j, [b, b_slope]) in v_weights.iter().enumerate() {
            let row = (first_v + j) * self.u.n_points + first_u;
            for (point, [a, a_slope]) in self.points[row..].iter().zip(u_weights) {
                h += *point * (a * b);
                by_u += *point * (a_slope * b);
                by_v += *point * (a * b_slope);
            }
        }
        let p = h.xyz() / h.w;
        let [dpdu, dpdv] = [by_u, by_v].map(|d| (d.xyz() - p * d.w) / h.w);
        (p, dpdu.cross(dpdv).normalize_or_zero())
    }
}
