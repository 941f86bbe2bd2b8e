//! Local majorants: a coarse grid of upper bounds on density, walked cell by cell along a ray.
//!
//! One bright voxel then slows down only the rays that pass its neighbourhood, and empty cells cost one step. Places are
//! padded coordinates, see `medium/lattice.rs`: a cell is made of whole cubes between lattice points.

use glam::Vec3A;

use crate::math::{greater, lesser};

/// Upper bounds of a density field over the cells of a coarse grid.
#[derive(Clone, Debug)]
pub(super) struct MajorantGrid {
    /// Upper bound in each cell, x fastest.
    cells: Vec<f32>,
    n: [u32; 3],
    /// The domain.
    begin: Vec3A,
    end: Vec3A,
    /// Largest of `cells`.
    max: f32,
}

/// Edge length of a cell in cubes between lattice points.
const CELL: usize = 4;
/// Longest way through the domain.
const LONGEST: f32 = 0.5 * f32::MAX;
/// Where the domain begins, if it is not confined.
const BEGIN: f32 = 0.5;

impl MajorantGrid {
    /// `bound(lo, hi)` bounds the field between the lattice points `lo..=hi`, with a margin that covers rounding of
    /// positions along a ray; `n_voxels` is the number of values along each axis.
    pub(super) fn new(n_voxels: [usize; 3], bound: impl Fn([usize; 3], [usize; 3]) -> f32) -> Self {
        let n = n_voxels.map(|n| (n + 1).div_ceil(CELL));
        let mut cells = Vec::with_capacity(n[0] * n[1] * n[2]);
        for z in 0..n[2] {
            for y in 0..n[1] {
                for x in 0..n[0] {
                    let lo = [x * CELL, y * CELL, z * CELL];
                    let hi = [0, 1, 2].map(|axis| (lo[axis] + CELL).min(n_voxels[axis] + 1));
                    cells.push(bound(lo, hi));
                }
            }
        }
        let max = cells.iter().copied().fold(0.0, f32::max);
        Self {
            cells,
            n: n.map(|n| n as u32),
            begin: Vec3A::splat(BEGIN),
            end: Vec3A::from(n_voxels.map(|n| n as f32 + 0.5)),
            max,
        }
    }

    pub(super) fn max(&self) -> f32 {
        self.max
    }

    /// Leaves nothing outside of a box that shares some of the domain.
    pub(super) fn confine(&mut self, low: Vec3A, high: Vec3A) {
        self.begin = self.begin.max(low);
        self.end = self.end.min(high);
        debug_assert!(self.begin.cmple(self.end).all(), "they share something");
    }

    /// The part of (0, `t_max`) in which the ray o + t d is inside the domain; always finite.
    #[inline]
    fn clip(&self, o: Vec3A, inverse_d: Vec3A, t_max: f32) -> Option<[f32; 2]> {
        let begin = self.begin;
        let (t_lo, t_hi) = ((begin - o) * inverse_d, (self.end - o) * inverse_d);
        // Along an axis of no motion the ray is inside for ever or never.
        let moves = inverse_d.abs().cmplt(Vec3A::INFINITY);
        let stays = o.cmpge(begin) & o.cmple(self.end);
        let near = Vec3A::select(moves, t_lo.min(t_hi), Vec3A::ZERO);
        let far = Vec3A::select(moves, t_lo.max(t_hi), Vec3A::INFINITY);
        let t0 = greater(near.max_element(), 0.0);
        // Rays too slow to leave stay for a length of which places can be told.
        let t1 = lesser(far.min_element(), lesser(t_max, LONGEST));
        (t0 < t1 && (moves | stays).all()).then_some([t0, t1])
    }

    /// Walks the cells that the ray o + t d, t in (0, `t_max`), passes through.
    #[inline]
    pub(super) fn walk(&self, o: Vec3A, d: Vec3A, t_max: f32) -> Walk<'_> {
        let inverse_d = d.recip();
        let Some([t0, t1]) = self.clip(o, inverse_d, t_max) else {
            return Walk::nowhere(self);
        };
        let mut walk = Walk {
            t: t0,
            t_end: t1,
            done: false,
            o: o.to_array(),
            inverse_d: inverse_d.to_array(),
            ..Walk::nowhere(self)
        };
        let start = o + d * t0;
        let mut stride = 1i32;
        for axis in 0..3 {
            let n = self.n[axis];
            let cell = ((start[axis] * (1.0 / CELL as f32)) as i32).clamp(0, n as i32 - 1);
            let (step, first_border, steps_left) = if d[axis] > 0.0 {
                (1, (cell + 1) * CELL as i32, n as i32 - cell)
            } else {
                (-1, cell * CELL as i32, cell + 1)
            };
            walk.index += cell * stride;
            walk.stride[axis] = step * stride;
            walk.steps_left[axis] = steps_left;
            walk.t_border[axis] = f32::INFINITY;
            if inverse_d[axis].is_finite() {
                walk.border[axis] = first_border as f32;
                walk.step[axis] = (step * CELL as i32) as f32;
                walk.t_border[axis] = (walk.border[axis] - o[axis]) * inverse_d[axis];
            }
            stride *= n as i32;
        }
        walk
    }
}

/// A stretch of a ray with a bound on density.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    pub(super) t0: f32,
    pub(super) t1: f32,
    pub(super) majorant: f32,
}

/// Iterator over the cells along a ray (Amanatides and Woo 1987). Takes at most as many steps as the grid has
/// planes.
pub(super) struct Walk<'a> {
    grid: &'a MajorantGrid,
    t: f32,
    t_end: f32,
    index: i32,
    stride: [i32; 3],
    steps_left: [i32; 3],
    o: [f32; 3],
    inverse_d: [f32; 3],
    /// The planes ahead, from one to the next along an axis, and how far away they are: by themselves, as sums of
    /// distances would drift.
    border: [f32; 3],
    step: [f32; 3],
    t_border: [f32; 3],
    done: bool,
}

impl<'a> Walk<'a> {
    fn nowhere(grid: &'a MajorantGrid) -> Self {
        Self {
            grid,
            t: 0.0,
            t_end: 0.0,
            index: 0,
            stride: [0; 3],
            steps_left: [0; 3],
            o: [0.0; 3],
            inverse_d: [0.0; 3],
            border: [0.0; 3],
            step: [0.0; 3],
            t_border: [0.0; 3],
            done: true,
        }
    }
}

impl Iterator for Walk<'_> {
    type Item = Segment;

    /// The next stretch with density in it, longer than nothing.
    #[inline(always)]
    fn next(&mut self) -> Option<Segment> {
        while !self.done {
            let [bx, by, bz] = self.t_border;
            let axis = if bx < by {
                if bx < bz { 0 } else { 2 }
            } else if by < bz {
                1
            } else {
                2
            };
            let majorant = self.grid.cells[self.index as usize];
            let (t0, t1) = (self.t, lesser(self.t_border[axis], self.t_end));
            self.steps_left[axis] -= 1;
            if self.t_border[axis] >= self.t_end || self.steps_left[axis] == 0 {
                // The last cell lasts to the end, whatever rounding made of its border.
                self.done = true;
                if majorant > 0.0 && t0 < self.t_end {
                    return Some(Segment {
                        t0,
                        t1: self.t_end,
                        majorant,
                    });
                }
                return None;
            }
            self.index += self.stride[axis];
            self.border[axis] += self.step[axis];
            self.t_border[axis] = (self.border[axis] - self.o[axis]) * self.inverse_d[axis];
            if t1 > t0 {
                self.t = t1;
                if majorant > 0.0 {
                    return Some(Segment { t0, t1, majorant });
                }
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::uniform_sphere;

    #[test]
    fn segments_cover_the_ray_inside_the_grid_and_lie_in_their_cells() {
        // Each cell's majorant is its index + 1, so that a segment tells which cell it claims to be in.
        let n_voxels = [17, 9, 30];
        let n = n_voxels.map(|n: usize| (n + 1).div_ceil(CELL));
        let grid = MajorantGrid::new(n_voxels, |lo, _| {
            let [x, y, z] = lo.map(|v| v / CELL);
            ((z * n[1] + y) * n[0] + x + 1) as f32
        });
        let size = Vec3A::new(17.0, 9.0, 30.0);
        let mut rng = Rng::new(11);
        for k in 0..20_000 {
            let mut random = || Vec3A::new(rng.uniform(), rng.uniform(), rng.uniform());
            let (mut o, target) = (random() * 3.0 * size - size, random() * size + BEGIN);
            if k % 5 == 0 {
                o = (o / CELL as f32).round() * CELL as f32; // On the planes between cells.
            }
            let mut d = if k % 2 == 0 {
                target - o
            } else {
                uniform_sphere(rng.uniform2()).0
            };
            if k % 3 == 0 {
                d[k % 2] = if k % 6 == 0 { 0.0 } else { -0.0 };
            }
            let d = d.normalize_or(Vec3A::X);
            let t_max = if k % 7 == 0 {
                f32::INFINITY
            } else {
                40.0 * rng.uniform()
            };
            let (mut near, mut far) = (0f64, t_max as f64);
            for axis in 0..3 {
                let (o, d, s) = (o[axis] as f64, d[axis] as f64, size[axis] as f64);
                if d == 0.0 {
                    if o < 0.5 || o > s + 0.5 {
                        far = -1.0;
                    }
                    continue;
                }
                let (a, b) = ((0.5 - o) / d, (s + 0.5 - o) / d);
                near = near.max(a.min(b));
                far = far.min(a.max(b));
            }
            let mut length = 0.0;
            let mut last = f32::NEG_INFINITY;
            for segment in grid.walk(o, d, t_max) {
                assert!(segment.t1 > segment.t0 && segment.t0 >= last);
                last = segment.t1;
                length += (segment.t1 - segment.t0) as f64;
                let middle = o + d * (0.5 * (segment.t0 + segment.t1));
                let index = segment.majorant as usize - 1;
                let cell = [index % n[0], index / n[0] % n[1], index / (n[0] * n[1])];
                for axis in 0..3 {
                    let lo = (cell[axis] * CELL) as f32 - 1e-3;
                    let hi = ((cell[axis] + 1) * CELL) as f32 + 1e-3;
                    assert!(
                        (lo..=hi).contains(&middle[axis]),
                        "{o} {d}: {middle} not in {cell:?}"
                    );
                }
            }
            let expected = (far - near).max(0.0);
            assert!(
                (length - expected).abs() < 1e-3,
                "{o} {d} {t_max}: {length} for {expected}"
            );
        }
    }
}
