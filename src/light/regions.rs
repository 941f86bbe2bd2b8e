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
use crate::sampling::rng::ONE_MINUS_EPSILON;

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

/// How much each region counts for a receiver.
#[derive(Clone, Debug)]
struct Shares {
    /// Factor by which each counts more than its light does; together with the light, the sum is 1.
    gains: ForRegions<f32>,
    /// Sums of both over rows.
    rows: [f32; ROWS],
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
    /// By a factor for each region, of row and column.
    fn new(weights: &ForRegions<f32>, factor: impl Fn(usize, usize) -> f32) -> Self {
        let mut gains: ForRegions<f32> =
            std::array::from_fn(|row| std::array::from_fn(|column| factor(row, column)));
        let both = weights.as_flattened().iter().zip(gains.as_flattened());
        let total: f32 = both.map(|(weight, factor)| weight * factor).sum();
        for gain in gains.as_flattened_mut() {
            *gain /= total;
        }
        let products = |row: usize| weights[row].iter().zip(&gains[row]).map(|(a, b)| a * b);
        Self {
            rows: std::array::from_fn(|row| products(row).sum()),
            gains,
        }
    }
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

    /// Factor by which a region counts more than its light does.
    #[inline]
    pub(super) fn gain(&self, [row, column]: [usize; 2], purpose: Purpose) -> f32 {
        self.shares(purpose).gains[row][column]
    }

    /// Draws a region.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], purpose: Purpose) -> DrawnRegion {
        let shares = self.shares(purpose);
        let (row, v) = pick(shares.rows, u[1]);
        let (weights, gains) = (&self.weights[row], &shares.gains[row]);
        let products = weights
            .iter()
            .zip(gains)
            .map(|(weight, gain)| weight * gain);
        let (column, u) = pick(products, u[0]);
        DrawnRegion {
            row,
            column,
            u: [u, v],
            gain: gains[column],
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

/// One of a few weights in proportion, by `u` in [0, 1): its index, and what is left of `u`, in [0, 1). Where there are
/// positive weights, one of them.
#[inline]
pub(super) fn pick(
    weights: impl IntoIterator<Item = f32, IntoIter: Clone>,
    u: f32,
) -> (usize, f32) {
    let weights = weights.into_iter();
    let total: f32 = weights.clone().sum();
    let mut place = u * total;
    let mut last = 0;
    for (index, weight) in weights.enumerate() {
        if weight > 0.0 {
            if place < weight {
                return (index, (place / weight).min(ONE_MINUS_EPSILON));
            }
            last = index;
        }
        place -= weight;
    }
    // Rounding has carried it past the end.
    (last, ONE_MINUS_EPSILON)
}
