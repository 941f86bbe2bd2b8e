//! Densities at the points of a lattice, interpolated trilinearly, and their integrals along rays.
//!
//! Between the planes through the lattice's points the density along a ray is a cubic polynomial: two points integrate
//! it exactly (Gauss and Legendre), and where its integral reaches a value is found to the last digits.

use glam::{BVec3A, Vec3A, Vec3Swizzles, Vec4};

use crate::math::{greater, lesser};

/// Values at the centres of cells, and 0 around them. Places are *padded coordinates*, in which cell (i, j, k) has its
/// centre at (i+1, j+1, k+1): the cells reach from ½ to n + ½ along each axis.
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

/// Largest density: rounding in bounds and interpolation does not overflow.
const LARGEST: f32 = f32::MAX * (1.0 - 32.0 * f32::EPSILON);

/// Part of the way to the next lattice points that bounds reach beyond what they are for.
const MARGIN: f32 = 0.25;

/// From here to twice as much, numbers of f32 are whole, and their last digits count them.
const WHOLE: f32 = 8_388_608.0;
const WHOLE_DIGITS: u32 = (1 << 23) - 1;

/// Distance of the points of Gauss and Legendre from the middle, over half the length.
const POINT: f32 = 0.577_350_26;

/// The greatest whole number not above a place that is not negative or, where the place is whole, perhaps the one before.
#[inline]
fn whole_part(q: Vec3A) -> Vec3A {
    (q + (WHOLE - 0.5)) - WHOLE
}

/// A ray in the lattice.
#[derive(Clone, Copy, Debug)]
pub(super) struct LatticeRay {
    pub(super) o: Vec3A,
    pub(super) d: Vec3A,
    inverse_d: Vec3A,
    /// Axes along which it meets planes.
    moves: BVec3A,
    /// From the corner of a cube to the planes that the ray leaves it by.
    to_exit: Vec3A,
    /// From a cube to the next along each axis.
    step: Vec3A,
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
    t0: f32,
    t1: f32,
    /// The lattice point that all coordinates in the cube are above.
    corner: Vec3A,
}

impl LatticeRay {
    /// The ray o + t d.
    #[inline]
    pub(super) fn new(o: Vec3A, d: Vec3A) -> Self {
        let inverse_d = d.recip();
        let moves = inverse_d.abs().cmplt(Vec3A::INFINITY);
        let forward = d.cmpgt(Vec3A::ZERO);
        let step = Vec3A::select(forward, Vec3A::ONE, Vec3A::NEG_ONE);
        Self {
            o,
            d,
            inverse_d,
            moves,
            to_exit: Vec3A::select(forward, Vec3A::ONE, Vec3A::ZERO),
            step: Vec3A::select(moves, step, Vec3A::ZERO),
        }
    }

    #[inline]
    fn at(&self, t: f32) -> Vec3A {
        self.o + self.d * t
    }

    /// Distances at which it leaves the cube at `corner` along each axis, from the planes themselves: sums of steps would
    /// drift. None beyond the lattice, so that no walk meets more planes than there are.
    #[inline]
    fn exits(&self, corner: Vec3A, last_corner: Vec3A) -> Vec3A {
        let is_inside = corner.cmpge(Vec3A::ZERO) & corner.cmple(last_corner);
        let distances = (corner + self.to_exit - self.o) * self.inverse_d;
        Vec3A::select(self.moves & is_inside, distances, Vec3A::INFINITY)
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

    /// Mean of what is interpolated at `middle` + `off` and `middle` − `off`.
    #[inline]
    fn mean_of_two(&self, middle: Vec3A, off: Vec3A) -> f32 {
        // How the four lines weigh: (1 − y or y) (1 − z or z). Of products, the sum keeps even powers of `off`.
        const ABOVE_Y: Vec4 = Vec4::new(-1.0, 1.0, -1.0, 1.0);
        const ABOVE_Z: Vec4 = Vec4::new(-1.0, -1.0, 1.0, 1.0);
        const BELOW_Y: Vec4 = Vec4::new(1.0, 0.0, 1.0, 0.0);
        const BELOW_Z: Vec4 = Vec4::new(1.0, 1.0, 0.0, 0.0);
        let (by_y, by_z) = (BELOW_Y + ABOVE_Y * middle.y, BELOW_Z + ABOVE_Z * middle.z);
        let (off_y, off_z) = (ABOVE_Y * off.y, ABOVE_Z * off.z);
        let even = by_y * by_z + off_y * off_z;
        let odd = by_y * off_z + by_z * off_y;
        let sum = self.near * even + (self.far - self.near) * (even * middle.x + odd * off.x);
        (sum.x + sum.z) + (sum.y + sum.w)
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
            for (padded, &value) in padded[start..start + n[0]].iter_mut().zip(line) {
                *padded = value.min(LARGEST);
            }
        }
        Self {
            padded,
            strides: [px, px * py],
            n: Vec3A::from(n.map(|n| n as f32)),
        }
    }

    /// Number of values along each axis.
    pub(super) fn size(&self) -> Vec3A {
        self.n
    }

    /// A row of values along x.
    pub(super) fn row(&self, y: usize, z: usize) -> &[f32] {
        let [row, plane] = self.strides;
        let first = (z + 1) * plane + (y + 1) * row + 1;
        &self.padded[first..first + self.n.x as usize]
    }

    /// Corners of the cells' box.
    pub(super) fn extent(&self) -> [Vec3A; 2] {
        [Vec3A::splat(0.5), self.n + 0.5]
    }

    /// An upper bound of the density between the lattice points `lo..=hi`, and nearly so up to a quarter of a cube beyond,
    /// more than any rounding along a ray.
    pub(super) fn bound(&self, lo: [usize; 3], hi: [usize; 3]) -> f32 {
        let own = self.largest(lo, hi);
        let last = self.n.to_array().map(|n| n as usize + 1);
        let around = self.largest(
            lo.map(|lo| lo.saturating_sub(1)),
            [0, 1, 2].map(|axis| (hi[axis] + 1).min(last[axis])),
        );
        // Interpolation may round up.
        (own + MARGIN * (around - own)) * (1.0 + 8.0 * f32::EPSILON)
    }

    /// Largest of the values at the lattice points `lo..=hi`.
    fn largest(&self, lo: [usize; 3], hi: [usize; 3]) -> f32 {
        let [row, plane] = self.strides;
        let mut largest = 0f32;
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                let line = z * plane + y * row;
                largest = self.padded[line + lo[0]..=line + hi[0]]
                    .iter()
                    .copied()
                    .fold(largest, f32::max);
            }
        }
        largest
    }

    #[inline]
    fn corners(&self, corner: Vec3A) -> Corners {
        let digits = corner + WHOLE;
        let whole = |c: f32| (c.to_bits() & WHOLE_DIGITS) as usize;
        let (x, y, z) = (whole(digits.x), whole(digits.y), whole(digits.z));
        let [row, plane] = self.strides;
        let base = z * plane + y * row + x;
        let line = |offset: usize| &self.padded[base + offset..][..2];
        let (v0, v1, v2, v3) = (line(0), line(row), line(plane), line(plane + row));
        Corners {
            near: Vec4::new(v0[0], v1[0], v2[0], v3[0]),
            far: Vec4::new(v0[1], v1[1], v2[1], v3[1]),
        }
    }

    /// Interpolated density at a place inside the cells.
    #[inline]
    pub(super) fn density(&self, place: Vec3A) -> f32 {
        let q = place.clamp(Vec3A::splat(0.5), self.n + 0.5);
        let corner = whole_part(q);
        self.corners(corner).interpolate((q - corner).to_array())
    }

    /// Integral of the density over a stretch.
    #[inline]
    fn column(&self, ray: &LatticeRay, piece: &Piece) -> f64 {
        let (middle, half) = (0.5 * (piece.t0 + piece.t1), 0.5 * (piece.t1 - piece.t0));
        // Rounding may put a place outside the cube.
        let place = (ray.at(middle) - piece.corner).clamp(Vec3A::ZERO, Vec3A::ONE);
        let mean = self
            .corners(piece.corner)
            .mean_of_two(place, ray.d * (POINT * half));
        f64::from(2.0 * half * greater(mean, 0.0))
    }

    /// Goes on to `t1`, adding the density to `column`, but no further than to the stretch in which that exceeds `limit`:
    /// the stretch, which is not added, if it does.
    #[inline]
    pub(super) fn integrate(
        &self,
        ray: &LatticeRay,
        march: &mut March,
        t1: f32,
        column: &mut f64,
        limit: f64,
    ) -> Option<Piece> {
        while march.t < t1 {
            let piece = march.next(ray, self.n, t1);
            let longer = *column + self.column(ray, &piece);
            // Nothing is reached where there is nothing, not even 0. Infinity is not exceeded.
            if longer > limit {
                return Some(piece);
            }
            *column = longer;
        }
        None
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
pub(super) fn solve_integral(density: [f64; 4], target: f64) -> f64 {
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

/// A walk along a ray from cube to cube (Amanatides and Woo 1987).
#[derive(Clone, Debug)]
pub(super) struct March {
    t: f32,
    corner: Vec3A,
    /// Distances of the planes ahead.
    border: Vec3A,
    /// Distances of the planes behind those: the next step need not wait for them.
    beyond: Vec3A,
}

impl March {
    /// At the distance `t0`, where the ray is inside the cells.
    #[inline]
    pub(super) fn new(lattice: &Lattice, ray: &LatticeRay, t0: f32) -> Self {
        let start = ray.at(t0).clamp(Vec3A::splat(0.5), lattice.n + 0.5);
        let corner = whole_part(start);
        Self {
            t: t0,
            corner,
            border: ray.exits(corner, lattice.n),
            beyond: ray.exits(corner + ray.step, lattice.n),
        }
    }

    /// How far it has come.
    #[inline]
    pub(super) fn t(&self) -> f32 {
        self.t
    }

    /// The next stretch before `t1`, perhaps of no length; `t1` is ahead. Corners are up to `last_corner`.
    #[inline]
    fn next(&mut self, ray: &LatticeRay, last_corner: Vec3A, t1: f32) -> Piece {
        let nearest = self.border.min(self.border.yzx()).min(self.border.zxy());
        // Distances may be too coarse to tell planes apart: then the stretch has no length.
        let end = greater(lesser(nearest.x, t1), self.t);
        let piece = Piece {
            t0: self.t,
            t1: end,
            corner: self.corner.clamp(Vec3A::ZERO, last_corner),
        };
        let crossed = self.border.cmple(nearest) & self.border.cmple(Vec3A::splat(t1));
        self.border = Vec3A::select(crossed, self.beyond, self.border);
        self.corner += Vec3A::select(crossed, ray.step, Vec3A::ZERO);
        self.beyond = ray.exits(self.corner + ray.step, last_corner);
        self.t = end;
        piece
    }
}
