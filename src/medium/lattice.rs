//! Densities at the points of a lattice, interpolated trilinearly, and their integrals along rays.
//!
//! Between the planes through the lattice's points the density along a ray is a cubic polynomial: two points integrate
//! it exactly (Gauss and Legendre), and where its integral reaches a value is found to the last digits.

use glam::{Vec3A, Vec4};

/// Values in *voxel space*, in which cell (i, j, k) covers [i, i+1) × [j, j+1) × [k, k+1) and has its value at the
/// centre; 0 beyond the cells.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    /// Values with a border of zeros, x fastest.
    padded: Vec<f32>,
    /// From a value to the next along y and along z.
    strides: [usize; 2],
    /// Number of values along each axis, without the border.
    n: Vec3A,
}

/// Most values along an axis: places between them are numbers of f32.
pub const MAX_VOXELS: usize = 1 << 22;

/// From here to twice as much, numbers of f32 are whole, and their last digits count them.
const WHOLE: f32 = 8_388_608.0;
const WHOLE_DIGITS: u32 = (1 << 23) - 1;

/// Planes between lattice points that a ray meets, at most, for each unit of its longest way along an axis.
const PLANES: f32 = 3.0;

/// Distance of the points of Gauss and Legendre from the middle, over half the length.
const POINT: f32 = 0.577_350_26;

/// The greatest whole number not above a place that is not negative or, where the place is whole, perhaps the one before.
#[inline]
fn whole_part(q: Vec3A) -> Vec3A {
    (q + (WHOLE - 0.5)) - WHOLE
}

/// A ray in the lattice: places are padded coordinates, in which value i sits at i + 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct LatticeRay {
    o: Vec3A,
    d: Vec3A,
}

/// The values around a cube between lattice points, those on its near side along x and those on the far one, in the
/// order of (y, z) = (0, 0), (1, 0), (0, 1), (1, 1).
struct Corners {
    near: Vec4,
    far: Vec4,
}

/// A stretch of a ray within a cube between lattice points.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Where it begins.
    pub(super) t0: f32,
    /// Where it ends, behind `t0`.
    pub(super) t1: f32,
    /// The lattice point that all coordinates in the cube are above.
    corner: Vec3A,
}

impl LatticeRay {
    /// The ray o + t d of voxel space.
    #[inline]
    pub(super) fn new(o: Vec3A, d: Vec3A) -> Self {
        Self { o: o + 0.5, d }
    }

    #[inline]
    fn at(&self, t: f32) -> Vec3A {
        self.o + self.d * t
    }
}

impl Corners {
    /// Trilinear; coordinates from the corner.
    #[inline]
    fn interpolate(&self, [x, y, z]: [f32; 3]) -> f32 {
        let rows = self.near + (self.far - self.near) * x;
        let low = rows.x + y * (rows.y - rows.x);
        let high = rows.z + y * (rows.w - rows.z);
        low + z * (high - low)
    }
}

impl Lattice {
    /// `values` are nx·ny·nz numbers, x fastest, none of n above [`MAX_VOXELS`].
    pub(super) fn new(n: [usize; 3], values: &[f32]) -> Self {
        assert_eq!(values.len(), n[0] * n[1] * n[2], "loading checks the count");
        assert!(n.into_iter().all(|n| n <= MAX_VOXELS), "and the sizes");
        let [px, py, pz] = n.map(|n| n + 2);
        let mut padded = vec![0.0; px * py * pz];
        for (row, line) in values.chunks_exact(n[0]).enumerate() {
            let (y, z) = (row % n[1], row / n[1]);
            let start = ((z + 1) * py + y + 1) * px + 1;
            padded[start..start + n[0]].copy_from_slice(line);
        }
        Self {
            padded,
            strides: [px, px * py],
            n: Vec3A::from(n.map(|n| n as f32)),
        }
    }

    /// Largest of the values that interpolation reads within the box `lo..=hi` of voxel space and up to half a voxel
    /// beyond, more than any rounding along a ray.
    pub(super) fn largest_within(&self, lo: [usize; 3], hi: [usize; 3]) -> f32 {
        // Those around lo − ½ … hi + ½.
        let [row, plane] = self.strides;
        let mut largest = 0f32;
        for z in lo[2]..=hi[2] + 1 {
            for y in lo[1]..=hi[1] + 1 {
                let line = z * plane + y * row;
                largest = self.padded[line + lo[0]..=line + hi[0] + 1]
                    .iter()
                    .copied()
                    .fold(largest, f32::max);
            }
        }
        largest
    }

    #[inline]
    fn corners(&self, corner: Vec3A) -> Corners {
        let [x, y, z] = (corner + WHOLE)
            .to_array()
            .map(|c| (c.to_bits() & WHOLE_DIGITS) as usize);
        let [row, plane] = self.strides;
        let base = z * plane + y * row + x;
        let [v0, v1, v2, v3] = [0, row, plane, plane + row].map(|offset| {
            let v = &self.padded[base + offset..][..2];
            [v[0], v[1]]
        });
        Corners {
            near: Vec4::new(v0[0], v1[0], v2[0], v3[0]),
            far: Vec4::new(v0[1], v1[1], v2[1], v3[1]),
        }
    }

    /// Interpolated density at a point of voxel space inside the cells.
    #[inline]
    pub(super) fn density(&self, p: Vec3A) -> f32 {
        let q = (p + 0.5).clamp(Vec3A::splat(0.5), self.n + 0.5);
        let corner = whole_part(q);
        self.corners(corner).interpolate((q - corner).to_array())
    }

    /// The stretches between `t0` and `t1` of a ray, which is inside the cells there.
    #[inline]
    pub(super) fn pieces(&self, ray: &LatticeRay, t0: f32, t1: f32) -> Pieces {
        let inverse_d = ray.d.recip();
        let moves = inverse_d.abs().cmplt(Vec3A::INFINITY);
        let forward = ray.d.cmpgt(Vec3A::ZERO);
        let start = ray.at(t0).clamp(Vec3A::splat(0.5), self.n + 0.5);
        let corner = whole_part(start);
        let next = corner + Vec3A::select(forward, Vec3A::ONE, Vec3A::ZERO);
        let step = Vec3A::select(forward, Vec3A::ONE, Vec3A::NEG_ONE);
        let length = (ray.d.abs() * (t1 - t0)).max_element();
        Pieces {
            t: t0,
            t1,
            corner,
            last_corner: self.n,
            border: Vec3A::select(moves, (next - ray.o) * inverse_d, Vec3A::INFINITY),
            step: Vec3A::select(moves, step, Vec3A::ZERO),
            t_step: Vec3A::select(moves, inverse_d.abs(), Vec3A::ZERO),
            n_left: (length * PLANES) as u32 + 8,
        }
    }

    /// Integral of the density over a stretch.
    #[inline]
    pub(super) fn column(&self, ray: &LatticeRay, piece: &Piece) -> f32 {
        let (middle, half) = (0.5 * (piece.t0 + piece.t1), 0.5 * (piece.t1 - piece.t0));
        let corners = self.corners(piece.corner);
        let at = |t: f32| corners.interpolate((ray.at(t) - piece.corner).to_array());
        let sum = at(middle - POINT * half) + at(middle + POINT * half);
        // Rounding may put a place outside the cube.
        (half * sum).max(0.0)
    }

    /// The distance in a stretch at which the integral of the density from its beginning reaches `column`, or its end.
    pub(super) fn reach(&self, ray: &LatticeRay, piece: &Piece, column: f64) -> f32 {
        let corners = self.corners(piece.corner);
        let [a, b] = [piece.t0, piece.t1].map(|t| (ray.at(t) - piece.corner).to_array());
        let at = |x: f32, y: f32, z: f32| f64::from(corners.interpolate([x, y, z]).max(0.0));
        // The density along the stretch in Bernstein form: the means of its polar form.
        let third = 1.0 / 3.0;
        let density = [
            at(a[0], a[1], a[2]),
            (at(b[0], a[1], a[2]) + at(a[0], b[1], a[2]) + at(a[0], a[1], b[2])) * third,
            (at(a[0], b[1], b[2]) + at(b[0], a[1], b[2]) + at(b[0], b[1], a[2])) * third,
            at(b[0], b[1], b[2]),
        ];
        let length = f64::from(piece.t1 - piece.t0);
        let s = solve_integral(density, column / length);
        piece
            .t0
            .max((f64::from(piece.t0) + s * length) as f32)
            .min(piece.t1)
    }
}

/// The place in [0, 1] at which the integral of a polynomial of degree 3 reaches `target`. The polynomial is given by its
/// Bernstein coefficients, none of which is negative: the integral rises.
fn solve_integral(density: [f64; 4], target: f64) -> f64 {
    let mut sums = [0.0; 5];
    for (k, density) in density.into_iter().enumerate() {
        sums[k + 1] = sums[k] + 0.25 * density;
    }
    if target >= sums[4] {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    let mut s = target / sums[4];
    // Newton's method, and halving where it would leave what is known to hold the place.
    for _ in 0..40 {
        // De Casteljau's scheme: the value, and from the last but one level the slope.
        let mut level = sums;
        for n in (2..=4).rev() {
            for k in 0..n {
                level[k] += s * (level[k + 1] - level[k]);
            }
        }
        let slope = 4.0 * (level[1] - level[0]);
        let value = level[0] + s * (level[1] - level[0]);
        if value > target {
            high = s
        } else {
            low = s
        }
        let next = s - (value - target) / slope;
        let next = if next > low && next < high {
            next
        } else {
            0.5 * (low + high)
        };
        if (next - s).abs() <= f64::from(f32::EPSILON) * 0.25 {
            return next;
        }
        s = next;
    }
    s
}

/// Iterator over the stretches of a ray (Amanatides and Woo 1987).
#[derive(Clone, Debug)]
pub(super) struct Pieces {
    t: f32,
    t1: f32,
    corner: Vec3A,
    /// Largest corner there is.
    last_corner: Vec3A,
    border: Vec3A,
    step: Vec3A,
    t_step: Vec3A,
    /// Planes that may still be met. Far from the origin distances may be too coarse to tell them apart.
    n_left: u32,
}

impl Iterator for Pieces {
    type Item = Piece;

    #[inline]
    fn next(&mut self) -> Option<Piece> {
        while self.t < self.t1 {
            let end = if self.n_left == 0 {
                self.t1
            } else {
                self.n_left -= 1;
                self.border.min_element().min(self.t1)
            };
            let piece = Piece {
                t0: self.t,
                t1: end,
                corner: self.corner.clamp(Vec3A::ZERO, self.last_corner),
            };
            let crossed = self.border.cmple(Vec3A::splat(end));
            self.corner += Vec3A::select(crossed, self.step, Vec3A::ZERO);
            self.border += Vec3A::select(crossed, self.t_step, Vec3A::ZERO);
            if end > self.t {
                self.t = end;
                return Some(piece);
            }
        }
        None
    }
}
