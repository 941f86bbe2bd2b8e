//! Roughly how much light comes through a grid to places in it.
//!
//! The grid is cut into blocks of voxels, and each is as dense as its mean: directions are drawn by this, and what they
//! find is estimated without bias. From the middles of all blocks, rays of one direction pass the same blocks further on,
//! at the same distances: these are found once.

use glam::{Affine3A, Vec3A};
use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::ParallelSliceMut;

use crate::math::{Point3, Vec3};

/// Voxels along the edge of a block, at least, if the grid has as many.
const EDGE: usize = 4;
/// Most blocks along an axis: rays along a row of blocks pass each of them from each.
const LONGEST: usize = 64;
/// Extinction that lets nothing through, by far, and whose multiples are finite.
const OPAQUE: f64 = 1e30;

/// A grid cut into blocks of as many voxels.
#[derive(Clone, Debug)]
pub struct Blocks {
    /// Places in units of blocks.
    blocks_from_render: Affine3A,
    n: [usize; 3],
    /// Voxels along each edge.
    edges: [usize; 3],
}

/// A grid as it dims light, block by block.
#[derive(Clone, Debug)]
pub struct Veil {
    blocks: Blocks,
    /// Mean of each block per unit of render space, x fastest.
    extinction: Vec<f32>,
}

/// The blocks that rays of a direction pass, from the middle of any.
struct Passage {
    /// From the index of the first, and the length of the way through.
    blocks: Vec<(isize, f32)>,
    /// For each axis: how many are passed where none, one, two … are ahead along it.
    ends: [Vec<usize>; 3],
    is_forward: [bool; 3],
}

impl Blocks {
    /// Of a grid of so many voxels, whose units `voxels_from_render` gives places in: as large as need be for no more than
    /// `n_most` blocks, or one.
    fn new(n_voxels: [usize; 3], voxels_from_render: Affine3A, n_most: usize) -> Self {
        let along = |edge: usize| n_voxels.map(|n| n.div_ceil(edge));
        let mut edge = EDGE;
        while along(edge).into_iter().product::<usize>() > n_most.max(1)
            || along(edge).into_iter().any(|n| n > LONGEST)
        {
            edge += edge / EDGE;
        }
        // Those along an axis are as long as each other, or nearly so.
        let edges = [0, 1, 2].map(|axis| n_voxels[axis].div_ceil(along(edge)[axis]));
        let per_voxel = edges.map(|edge| 1.0 / edge as f32);
        Self {
            blocks_from_render: Affine3A::from_scale(per_voxel.into()) * voxels_from_render,
            n: [0, 1, 2].map(|axis| n_voxels[axis].div_ceil(edges[axis])),
            edges,
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.n.into_iter().product()
    }

    /// The block that a point lies in, or one of those nearest to it.
    #[inline]
    pub fn index_of(&self, p: Point3) -> usize {
        let place = self.blocks_from_render.transform_point3a(p.0);
        let along = |axis: usize| (place[axis] as usize).min(self.n[axis] - 1);
        (along(2) * self.n[1] + along(1)) * self.n[0] + along(0)
    }
}

impl Veil {
    /// Of a grid of so many voxels, as [`Blocks::new`]; `row(y, z)` are the densities of a row of voxels, `sigma` is
    /// extinction per unit of render space at density 1.
    pub(super) fn new<'a>(
        n_voxels: [usize; 3],
        voxels_from_render: Affine3A,
        n_most: usize,
        sigma: f64,
        row: impl Fn(usize, usize) -> &'a [f32] + Sync,
    ) -> Self {
        let blocks = Blocks::new(n_voxels, voxels_from_render, n_most);
        let (edges, [nx, ny, _]) = (blocks.edges, blocks.n);
        let voxels = |block: usize, axis: usize| {
            let edge = edges[axis];
            block * edge..((block + 1) * edge).min(n_voxels[axis])
        };
        let per_voxel = sigma / edges.into_iter().product::<usize>() as f64;
        let mut extinction = vec![0.0; blocks.count()];
        extinction
            .par_chunks_exact_mut(nx)
            .enumerate()
            .for_each_init(
                || vec![0.0; nx],
                |sums, (line, extinction)| {
                    sums.fill(0.0);
                    for z in voxels(line / ny, 2) {
                        for y in voxels(line % ny, 1) {
                            for (sum, densities) in sums.iter_mut().zip(row(y, z).chunks(edges[0]))
                            {
                                *sum += densities.iter().copied().map(f64::from).sum::<f64>();
                            }
                        }
                    }
                    for (extinction, sum) in extinction.iter_mut().zip(sums) {
                        *extinction = (*sum * per_voxel).min(OPAQUE) as f32;
                    }
                },
            );
        Self { blocks, extinction }
    }

    /// Transmittance toward a unit direction from the middle of each block, x fastest; 1 where nothing is.
    pub fn transmittances(&self, toward: Vec3) -> Vec<f32> {
        let stretched = self.blocks.blocks_from_render.transform_vector3a(toward.0);
        let per_unit = stretched.length();
        // Blocks so large or so small that no number is their size are no veil.
        if !(per_unit.is_normal() && per_unit.recip().is_normal()) {
            return vec![1.0; self.extinction.len()];
        }
        let n = self.blocks.n;
        let passage = Passage::new(stretched / per_unit, n);
        let mut transmittances = Vec::with_capacity(self.extinction.len());
        for z in 0..n[2] {
            for y in 0..n[1] {
                let end = passage.end(2, z, n[2]).min(passage.end(1, y, n[1]));
                for x in 0..n[0] {
                    let first = transmittances.len();
                    let depth: f32 = if self.extinction[first] > 0.0 {
                        passage.blocks[..end.min(passage.end(0, x, n[0]))]
                            .iter()
                            .map(|&(offset, length)| {
                                self.extinction[first.wrapping_add_signed(offset)] * length
                            })
                            .sum()
                    } else {
                        0.0
                    };
                    transmittances.push((-depth / per_unit).exp());
                }
            }
        }
        transmittances
    }

    /// The blocks alone.
    pub fn into_blocks(self) -> Blocks {
        self.blocks
    }
}

impl Passage {
    /// In direction `d`, of unit length in blocks, through at most all `n` along one axis.
    fn new(d: Vec3A, n: [usize; 3]) -> Self {
        let per_block = d.abs().recip();
        let is_forward = [0, 1, 2].map(|axis| d[axis] > 0.0);
        let strides = [1, n[0], n[0] * n[1]].map(usize::cast_signed);
        let mut passage = Self {
            blocks: Vec::new(),
            ends: [const { Vec::new() }; 3],
            is_forward,
        };
        let (mut offset, mut t) = (0, 0.0);
        loop {
            // The next border along each axis, by itself: sums would drift.
            let border =
                [0, 1, 2].map(|axis| (passage.ends[axis].len() as f32 + 0.5) * per_block[axis]);
            let axis = if border[0] < border[1].min(border[2]) {
                0
            } else if border[1] < border[2] {
                1
            } else {
                2
            };
            passage.blocks.push((offset, border[axis] - t));
            passage.ends[axis].push(passage.blocks.len());
            if passage.ends[axis].len() == n[axis] {
                return passage;
            }
            t = border[axis];
            offset += if is_forward[axis] {
                strides[axis]
            } else {
                -strides[axis]
            };
        }
    }

    /// How many blocks are passed until the borders across an axis, from the `at`-th of `n` along it.
    fn end(&self, axis: usize, at: usize, n: usize) -> usize {
        let n_ahead = if self.is_forward[axis] {
            n - 1 - at
        } else {
            at
        };
        let ends = &self.ends[axis];
        ends.get(n_ahead).copied().unwrap_or(self.blocks.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::uniform_sphere;

    /// A veil whose blocks have these extinctions.
    fn veil(n: [usize; 3], values: &[f32], blocks_from_render: Affine3A) -> Veil {
        Veil {
            blocks: Blocks {
                blocks_from_render,
                n,
                edges: [1; 3],
            },
            extinction: values.to_vec(),
        }
    }

    #[test]
    fn transmittances_are_those_from_the_middle_of_each_block() {
        let n = [5, 3, 4];
        let mut rng = Rng::new(3);
        let values: Vec<f32> = (0..60).map(|_| 0.1 + rng.uniform()).collect();
        let stretch = Affine3A::from_scale(glam::Vec3::new(2.0, 0.5, 1.0));
        let veil = veil(n, &values, stretch);
        let axes = [
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(0.0, -1.0, 0.0),
            Vec3::new(-0.0, 0.0, 1.0),
        ];
        let random = (0..40).map(|_| uniform_sphere(rng.uniform2()).0);
        for d in random.map(Vec3).chain(axes) {
            let found = veil.transmittances(d);
            for (index, transmittance) in found.into_iter().enumerate() {
                // By many steps.
                let mut p = Vec3A::new(
                    (index % 5) as f32,
                    (index / 5 % 3) as f32,
                    (index / 15) as f32,
                ) + 0.5;
                let step = 1e-3;
                let mut depth = 0.0;
                loop {
                    let [x, y, z] = p.to_array().map(|c| c.floor() as isize);
                    if !((0..5).contains(&x) && (0..3).contains(&y) && (0..4).contains(&z)) {
                        break;
                    }
                    depth += f64::from(values[((z * 3 + y) * 5 + x) as usize] * step);
                    p += stretch.transform_vector3a(d.0) * step;
                }
                let expected = (-depth).exp();
                assert!(
                    (f64::from(transmittance) - expected).abs() < 3e-3,
                    "{d:?} from {index}: {transmittance} for {expected}"
                );
            }
        }
    }

    #[test]
    fn blocks_are_as_dense_as_their_voxels_on_average_and_know_their_points() {
        let n = [10, 4, 5];
        let mut rng = Rng::new(4);
        let values: Vec<f32> = (0..200).map(|_| rng.uniform()).collect();
        let voxels_from_render = Affine3A::from_scale_rotation_translation(
            glam::Vec3::splat(8.0),
            glam::Quat::from_rotation_x(0.4),
            glam::Vec3::new(1.0, 2.0, 3.0),
        );
        let veil = Veil::new(n, voxels_from_render, 100, 2.0, |y, z| {
            &values[(z * 4 + y) * 10..][..10]
        });
        // Of 4, 4 and 3 voxels.
        assert_eq!(veil.blocks.n, [3, 1, 2]);
        let sums = {
            let mut sums = [0.0; 6];
            for (index, value) in values.iter().enumerate() {
                let [x, y, z] = [index % 10, index / 10 % 4, index / 40];
                let p = Vec3A::new(x as f32, y as f32, z as f32) + 0.5;
                let p = Point3(voxels_from_render.inverse().transform_point3a(p));
                sums[veil.blocks.index_of(p)] += value;
            }
            sums
        };
        for (extinction, sum) in veil.extinction.iter().zip(sums) {
            assert!((extinction - 2.0 * sum / 48.0).abs() < 1e-5);
        }
        assert_eq!(veil.into_blocks().count(), 6);
    }

    #[test]
    fn there_are_no_more_blocks_than_asked_for() {
        for n_voxels in [
            [1, 1, 1],
            [100, 40, 100],
            [4_000_000, 1, 1],
            [1000, 1000, 1],
        ] {
            for n_most in [0, 1, 50, 8192] {
                let blocks = Blocks::new(n_voxels, Affine3A::IDENTITY, n_most);
                assert!(blocks.count() <= n_most.max(1), "{n_voxels:?} {n_most}");
                assert!(blocks.n.into_iter().all(|n| n <= LONGEST));
                let sizes = blocks.n.into_iter().zip(blocks.edges).zip(n_voxels);
                for ((n, edge), n_voxels) in sizes {
                    assert!((n - 1) * edge < n_voxels && n_voxels <= n * edge);
                }
            }
        }
    }

    #[test]
    fn veils_of_any_size_and_density_let_through_from_nothing_to_all() {
        for scale in [0.0, 1e-38, 1e-20, 1.0, 1e20, 3e38, f32::INFINITY] {
            let matrix = Affine3A::from_scale(glam::Vec3::new(scale, 1.0, scale));
            for sigma in [0.0, 1e-45, 1.0, 3e38] {
                for value in [0.0, 1e-45, 1.0, 3e38] {
                    let values = [value; 64];
                    let veil = Veil::new([4, 4, 4], matrix, 10, sigma, |y, z| {
                        &values[16 * z + 4 * y..][..4]
                    });
                    for d in [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.6, 0.0, -0.8)] {
                        let all = veil.transmittances(d);
                        assert!(
                            all.iter().all(|t| (0.0..=1.0).contains(t)),
                            "{scale} {sigma} {value}: {all:?}"
                        );
                    }
                    assert_eq!(veil.blocks.index_of(Point3::new(f32::NAN, -1e38, 1e38)), 0);
                }
            }
        }
    }
}
