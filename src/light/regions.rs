//! Regions of a map, and how much each counts for a receiver: by the light in it and, for a surface, by the cosines under
//! which that light falls or, in a medium, by how much of it comes through.
//!
//! The cosine of a region is roughly the mean of those of its directions, and never 0. It is known beforehand for 24²
//! normals, of which the nearest is taken: a receiver costs a look into a table. What comes through is known for the
//! blocks that media are cut into.

use glam::Vec3A;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::ids::BlockId;
use crate::math::octahedron;
use crate::sampling::cumulative;

/// Regions side by side, and on top of each other.
pub(super) const COLUMNS: usize = 16;
/// See [`COLUMNS`].
pub(super) const ROWS: usize = 8;
/// Normals along an edge of the square that the sphere is unfolded to.
const NORMALS: usize = 24;
/// What a cosine counts at least: shading normals and means are not all there is to a surface.
const LEAST_COSINE: f32 = 0.03;
/// What a region counts at least within a medium. Beyond that it counts by the root of its transmittance, as places in a block
/// see more or less of it than the middle does. Measured in clouds: squared errors are 2 to 7 % above this by the
/// transmittance itself, and alike for 0.01.
const LEAST_SEEN: f32 = 0.03;

/// What a direction is sampled for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Purpose {
    /// All light alike.
    Whole,
    /// What falls on a surface of this normal, map space, that scatters to this side only and finds light by itself as
    /// well: more of what is bright, less of what is not. Nowhere is the density 0 for that.
    Facing(Vec3A),
    /// What comes through to a place in this block of a medium.
    Within(BlockId),
}

/// A number for each region, row by row.
type ForRegions<T> = [[T; COLUMNS]; ROWS];

/// How much each region counts, for every receiver of a kind.
#[derive(Clone, Debug)]
pub(super) struct Regions {
    /// Light in each region; the sum is 1.
    weights: ForRegions<f32>,
    /// For each normal or block; at last for all light alike.
    shares: Vec<Shares>,
}

/// Light in each region.
#[derive(Clone, Debug)]
pub(super) struct LightByRegion {
    /// The sum is 1.
    weights: ForRegions<f32>,
    directions: ForRegions<Directions>,
}

/// How much each region counts for a receiver: as a table, see [`cumulative::find`].
#[derive(Clone, Debug)]
struct Shares {
    /// Where each row begins.
    rows: [u32; ROWS],
    /// Where the regions of each row begin.
    columns: ForRegions<u32>,
}

/// What was drawn for a receiver: a region, what is left of the random numbers, and the region's gain.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrawnRegion {
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) u: [f32; 2],
    pub(super) gain: f32,
}

impl Shares {
    /// By a factor beside the light for each region, of row and column.
    fn new(weights: &ForRegions<f32>, factor: impl Fn(usize, usize) -> f32) -> Self {
        let mut sums = [0.0; ROWS];
        let columns = std::array::from_fn(|row| {
            let products = std::array::from_fn::<_, COLUMNS, _>(|column| {
                f64::from(weights[row][column]) * f64::from(factor(row, column))
            });
            sums[row] = products.iter().sum();
            starts(&products)
        });
        Self {
            rows: starts(&sums),
            columns,
        }
    }

    /// The part of all that a region is.
    #[inline]
    fn share(&self, row: usize, column: usize) -> f32 {
        cumulative::share(&self.rows, row) * cumulative::share(&self.columns[row], column)
    }
}

fn starts<const N: usize>(weights: &[f64; N]) -> [u32; N] {
    let mut starts = [0; N];
    for (start, of_weight) in starts.iter_mut().zip(cumulative::starts(weights)) {
        *start = of_weight;
    }
    starts
}

/// The directions in a region.
#[derive(Clone, Copy, Debug, Default)]
struct Directions {
    /// Mean by weight.
    mean: Vec3A,
    /// How far they are from it, roughly, in (0, 1].
    spread: f32,
}

impl Directions {
    /// Roughly the mean of max(cos θ, 0), rounded where the horizon crosses the region.
    fn cosine(&self, n: Vec3A) -> f32 {
        let (cos, spread) = (self.mean.dot(n), self.spread);
        let bend = (cos + spread).clamp(0.0, 2.0 * spread);
        let clamped = bend * bend / (4.0 * spread) + (cos - spread).max(0.0);
        clamped.max(LEAST_COSINE)
    }
}

impl LightByRegion {
    /// Of parts of the map, given by row and column of their region, unit direction, and weight; the weights sum to 1.
    pub(super) fn new(parts: impl Iterator<Item = ([usize; 2], Vec3A, f32)>) -> Self {
        let mut weights = [[0.0; COLUMNS]; ROWS];
        let mut sums = [[Vec3A::ZERO; COLUMNS]; ROWS];
        for ([row, column], direction, weight) in parts {
            weights[row][column] += weight;
            sums[row][column] += direction * weight;
        }
        let directions = std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let weight = weights[row][column];
                let mean = if weight > 0.0 {
                    sums[row][column] / weight
                } else {
                    Vec3A::ZERO
                };
                // The root of the mean squared distance of unit vectors from their mean.
                let length = mean.length();
                let spread = ((1.0 - length) * (1.0 + length)).max(1e-4).sqrt();
                Directions { mean, spread }
            })
        });
        Self {
            weights,
            directions,
        }
    }
}

impl Regions {
    /// For surfaces, by their normals.
    pub(super) fn by_normal(light: LightByRegion) -> Self {
        let shares = (0..NORMALS * NORMALS).map(normal_of_index).map(|n| {
            Shares::new(&light.weights, |row, column| {
                light.directions[row][column].cosine(n)
            })
        });
        Self::with_shares(shares.collect(), light.weights)
    }

    /// For blocks of media: `transmittances` of a unit direction are in [0, 1], one for each block.
    pub(super) fn by_block(
        light: LightByRegion,
        transmittances: impl Fn(Vec3A) -> Vec<f32> + Sync,
    ) -> Self {
        let (weights, directions) = (&light.weights, &light.directions);
        let of_regions: Vec<Vec<f32>> = (0..ROWS * COLUMNS)
            .into_par_iter()
            .map(|region| {
                let (row, column) = (region / COLUMNS, region % COLUMNS);
                if weights[row][column] > 0.0 {
                    transmittances(directions[row][column].mean.normalize_or(Vec3A::Z))
                } else {
                    Vec::new()
                }
            })
            .collect();
        let n_blocks = of_regions.iter().map(Vec::len).max().unwrap_or(0);
        let shares = (0..n_blocks).into_par_iter().map(|block| {
            Shares::new(weights, |row, column| {
                let transmittance = of_regions[row * COLUMNS + column].get(block);
                LEAST_SEEN + transmittance.map_or(0.0, |t| t.sqrt())
            })
        });
        Self::with_shares(shares.collect(), light.weights)
    }

    fn with_shares(mut shares: Vec<Shares>, weights: ForRegions<f32>) -> Self {
        shares.push(Shares::new(&weights, |_, _| 1.0));
        Self { weights, shares }
    }

    #[inline]
    fn shares(&self, purpose: Purpose) -> &Shares {
        let index = match purpose {
            Purpose::Facing(normal) => index_of_normal(normal),
            Purpose::Within(block) => block.index(),
            Purpose::Whole => self.shares.len() - 1,
        };
        &self.shares[index]
    }

    /// Factor by which a region counts more than its light does; 0 where there is no light.
    #[inline]
    pub(super) fn gain(&self, [row, column]: [usize; 2], purpose: Purpose) -> f32 {
        self.gain_among(self.shares(purpose), row, column)
    }

    #[inline]
    fn gain_among(&self, shares: &Shares, row: usize, column: usize) -> f32 {
        let weight = self.weights[row][column];
        // Of less, the ratio may not be a number.
        if weight >= f32::MIN_POSITIVE {
            shares.share(row, column) / weight
        } else {
            0.0
        }
    }

    /// Draws a region.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], purpose: Purpose) -> DrawnRegion {
        let shares = self.shares(purpose);
        let (row, v) = cumulative::find(&shares.rows, u[1]);
        let (column, u) = cumulative::find(&shares.columns[row], u[0]);
        DrawnRegion {
            row,
            column,
            u: [u, v],
            gain: self.gain_among(shares, row, column),
        }
    }
}

/// The index of the normal nearest to `n`, or nearly so, among those on an unfolded octahedron.
#[inline]
fn index_of_normal(n: Vec3A) -> usize {
    let [x, y] = octahedron::unfold(n).map(|c| {
        let place = (0.5 * c + 0.5) * NORMALS as f32;
        (place as usize).min(NORMALS - 1)
    });
    y * NORMALS + x
}

/// The normal of an index.
fn normal_of_index(index: usize) -> Vec3A {
    let place = [index % NORMALS, index / NORMALS];
    octahedron::fold(place.map(|i| 2.0 * (i as f32 + 0.5) / NORMALS as f32 - 1.0))
}
