//! Densities at the points of a lattice, interpolated trilinearly, and their integrals along rays.
//!
//! Between the planes through the lattice's points the density along a ray is a cubic polynomial: two points integrate
//! it exactly (Gauss and Legendre), and where its integral reaches a value is found to the last digits.

use glam::{Vec3A, Vec4, Vec4Swizzles};

use crate::math::greater;

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
    o: Vec4,
    d: Vec4,
    /// 1 along axes of no motion.
    inverse_d: Vec4,
    /// From the corner of a cube to the planes that the ray leaves it by; infinitely far along axes of no motion.
    to_exit: Vec4,
    /// The same for the next cube along each axis.
    to_next_exit: Vec4,
    /// From a cube to the next along each axis.
    step: Vec4,
    /// Distances beyond which there are no planes.
    last: Vec4,
    /// From the values of a cube to those of the next: for each set of axes, of which the first counts 1, the second 2 and
    /// the third 4, that along these.
    strides: [isize; 8],
    /// How the weights along x of [`Corners`] change with t, and those along y.
    by_x: Vec4,
    by_y: Vec4,
}

/// The values around a cube between lattice points, those on its near side along z and those on the far one, in the
/// order of (x, y) = (0, 0), (1, 0), (0, 1), (1, 1).
struct Corners {
    near: Vec4,
    far: Vec4,
}

/// How these weigh at x, y and z from the corner: `BELOW_X` + `ABOVE_X` x, `BELOW_Y` + `ABOVE_Y` y; 1 − z and z.
const BELOW_X: Vec4 = Vec4::new(1.0, 0.0, 1.0, 0.0);
const ABOVE_X: Vec4 = Vec4::new(-1.0, 1.0, -1.0, 1.0);
const BELOW_Y: Vec4 = Vec4::new(1.0, 1.0, 0.0, 0.0);
const ABOVE_Y: Vec4 = Vec4::new(-1.0, -1.0, 1.0, 1.0);

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
    pub(super) fn new(lattice: &Lattice, o: Vec3A, d: Vec3A) -> Self {
        let inverse_d = d.recip();
        let moves = inverse_d.abs().cmplt(Vec3A::INFINITY);
        let forward = d.cmpgt(Vec3A::ZERO);
        let step = Vec3A::select(forward, Vec3A::ONE, Vec3A::NEG_ONE);
        let step = Vec3A::select(moves, step, Vec3A::ZERO).extend(0.0);
        let to_exit = Vec3A::select(forward, Vec3A::ONE, Vec3A::ZERO);
        let to_exit = Vec3A::select(moves, to_exit, Vec3A::INFINITY).extend(f32::INFINITY);
        let inverse_d = Vec3A::select(moves, inverse_d, Vec3A::ONE);
        // It leaves the first cube but one by its near planes, or the last but one by its far ones.
        let last_plane = Vec3A::select(forward, lattice.n, Vec3A::ONE);
        let [row, plane] = lattice.strides.map(|stride| stride as isize);
        let [x, y, z, _] = step.to_array().map(|step| step as isize);
        let (y, z) = (y * row, z * plane);
        Self {
            o: o.extend(0.0),
            d: d.extend(0.0),
            inverse_d: inverse_d.extend(1.0),
            to_exit,
            to_next_exit: to_exit + step,
            step,
            last: ((last_plane - o) * inverse_d).extend(0.0),
            strides: [0, x, y, x + y, z, x + z, y + z, x + y + z],
            by_x: ABOVE_X * d.x,
            by_y: ABOVE_Y * d.y,
        }
    }

    /// Origin and direction.
    #[inline]
    pub(super) fn line(&self) -> [Vec3A; 2] {
        [self.o, self.d].map(Vec3A::from_vec4)
    }

    #[inline]
    fn at(&self, t: f32) -> Vec4 {
        self.o + self.d * t
    }

    /// Distances of the planes `to_plane` away from a corner, from the planes themselves: sums of steps would drift. None
    /// beyond the last, so that no walk meets more planes than there are.
    #[inline]
    fn planes(&self, corner: Vec4, to_plane: Vec4) -> Vec4 {
        let t = (corner + to_plane - self.o) * self.inverse_d;
        // As a maximum: a distance below 0 is as good as 0.
        t.max(Vec4::select(t.cmpgt(self.last), Vec4::INFINITY, Vec4::ZERO))
    }
}

impl Corners {
    /// Trilinear; coordinates from the corner.
    #[inline]
    fn interpolate(&self, [x, y, z]: [f32; 3]) -> f32 {
        let plane = self.near + (self.far - self.near) * z;
        let low = plane.x + x * (plane.y - plane.x);
        let high = plane.z + x * (plane.w - plane.z);
        low + y * (high - low)
    }

    /// Mean of what is interpolated on a ray `off` before and behind the place `middle`. Of products of weights, the sum
    /// of both keeps even powers of `off`.
    #[inline]
    fn mean_of_two(&self, ray: &LatticeRay, middle: Vec4, off: f32) -> f32 {
        let (x, y) = (
            BELOW_X + ABOVE_X * middle.xxxx(),
            BELOW_Y + ABOVE_Y * middle.yyyy(),
        );
        // Of the length of a voxel at most: neither d nor t alone need be, and their squares may be no numbers.
        let (off_x, off_y, off_z) = (ray.by_x * off, ray.by_y * off, ray.d.zzzz() * off);
        let even = x * y + off_x * off_y;
        let odd = (x * off_y + y * off_x) * off_z;
        let sum = self.near * even + (self.far - self.near) * (even * middle.zzzz() + odd);
        let pairs = sum + sum.zwxy();
        pairs.x + pairs.y
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

    /// Where the values around the cube at `corner` begin.
    #[inline]
    fn index(&self, corner: Vec3A) -> usize {
        let digits = corner + WHOLE;
        let whole = |c: f32| (c.to_bits() & WHOLE_DIGITS) as usize;
        let [row, plane] = self.strides;
        whole(digits.z) * plane + whole(digits.y) * row + whole(digits.x)
    }

    /// The values around the cube that begin at `index`, or 0 where there is none.
    #[inline]
    fn corners(&self, index: usize) -> Corners {
        // So small that the compiler knows of no sum that overflows.
        let [row, plane] = self.strides.map(|stride| stride & (usize::MAX >> 2));
        let from_here = self.padded.get(index..);
        let Some(values) = from_here.and_then(|values| values.get(..plane + row + 2)) else {
            return Corners {
                near: Vec4::ZERO,
                far: Vec4::ZERO,
            };
        };
        let pairs = |first: usize, second: usize| {
            Vec4::new(
                values[first],
                values[first + 1],
                values[second],
                values[second + 1],
            )
        };
        Corners {
            near: pairs(0, row),
            far: pairs(plane, plane + row),
        }
    }

    /// Interpolated density at a place inside the cells.
    #[inline]
    pub(super) fn density(&self, place: Vec3A) -> f32 {
        let q = place.clamp(Vec3A::splat(0.5), self.n + 0.5);
        let corner = whole_part(q);
        let corners = self.corners(self.index(corner));
        corners.interpolate((q - corner).to_array())
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
        march.border.w = t1;
        while march.t < t1 {
            // Distances may be too coarse to tell planes apart: then the stretch has no length.
            let nearest = march.nearest();
            let (begin, end) = (march.t, greater(nearest.x, march.t));
            let (middle, half) = (0.5 * (begin + end), 0.5 * (end - begin));
            // Rounding may put a place outside the cube.
            let place = (ray.at(middle) - march.corner).clamp(Vec4::ZERO, Vec4::ONE);
            let corners = self.corners(march.index);
            let mean = corners.mean_of_two(ray, place, POINT * half);
            let longer = *column + f64::from((end - begin) * greater(mean, 0.0));
            // Nothing is reached where there is nothing, not even 0. Infinity is not exceeded.
            if longer > limit {
                return Some(Piece {
                    t0: begin,
                    t1: end,
                    corner: march.corner.truncate().into(),
                });
            }
            *column = longer;
            march.t = end;
            march.cross(ray, nearest);
        }
        None
    }

    /// The distance in a stretch at which the integral of the density from its beginning reaches `column`, or its end.
    pub(super) fn reach(&self, ray: &LatticeRay, piece: &Piece, column: f64) -> f32 {
        let corners = self.corners(self.index(piece.corner));
        let [a, b] =
            [piece.t0, piece.t1].map(|t| (Vec3A::from_vec4(ray.at(t)) - piece.corner).to_array());
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
    corner: Vec4,
    /// Where its values begin.
    index: usize,
    /// Distances of the planes ahead, and at last of the end of the stretch.
    border: Vec4,
    /// Distances of the planes behind those: the next step need not wait for them.
    beyond: Vec4,
}

impl March {
    /// At the distance `t0`, where the ray is inside the cells.
    #[inline]
    pub(super) fn new(lattice: &Lattice, ray: &LatticeRay, t0: f32) -> Self {
        let start = Vec3A::from_vec4(ray.at(t0)).clamp(Vec3A::splat(0.5), lattice.n + 0.5);
        let corner = whole_part(start);
        let index = lattice.index(corner);
        let corner = corner.extend(0.0);
        Self {
            t: t0,
            corner,
            index,
            border: ray.planes(corner, ray.to_exit),
            beyond: ray.planes(corner, ray.to_next_exit),
        }
    }

    /// How far it has come.
    #[inline]
    pub(super) fn t(&self) -> f32 {
        self.t
    }

    /// The least of all distances ahead, in all lanes.
    #[inline]
    fn nearest(&self) -> Vec4 {
        let pairs = self.border.min(self.border.zwxy());
        pairs.min(pairs.yxwz())
    }

    /// Crosses the planes at the distance `nearest`.
    #[inline]
    fn cross(&mut self, ray: &LatticeRay, nearest: Vec4) {
        let crossed = self.border.cmple(nearest);
        self.border = Vec4::select(crossed, self.beyond, self.border);
        self.corner += Vec4::select(crossed, ray.step, Vec4::ZERO);
        self.beyond = ray.planes(self.corner, ray.to_next_exit);
        let axes = crossed.bitmask() as usize & 7;
        self.index = self.index.wrapping_add_signed(ray.strides[axes]);
    }
}
