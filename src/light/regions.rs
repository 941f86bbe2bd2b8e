//! Regions of a map, and how much each counts for a receiver: by the light in it and, for a surface, by the cosines under
//! which that light falls.
//!
//! The cosine of a region is roughly the mean of those of its directions, and never 0. It is known beforehand for 24²
//! normals, of which the nearest is taken: a receiver costs a look into a table.

use glam::Vec3A;

use crate::math::octahedron;

/// Regions side by side, and on top of each other.
pub(super) const COLUMNS: usize = 16;
/// See [`COLUMNS`].
pub(super) const ROWS: usize = 8;
/// Normals along an edge of the square that the sphere is unfolded to.
const NORMALS: usize = 24;
/// What a cosine counts at least: shading normals and means are not all there is to a surface.
const LEAST_COSINE: f32 = 0.03;

/// A number for each region, row by row.
type ForRegions<T> = [[T; COLUMNS]; ROWS];

/// Shares of the regions in light, for every receiver.
#[derive(Clone, Debug)]
pub(super) struct Regions {
    /// For each normal.
    facing: Vec<Shares>,
}

/// How much each region counts.
#[derive(Clone, Debug)]
pub(super) struct Shares {
    /// What each counts; the sum is 1. Regions without light count nothing.
    pub(super) regions: ForRegions<f32>,
    /// Sums of those over rows.
    pub(super) rows: [f32; ROWS],
    /// Factor by which each counts more than without a normal.
    pub(super) gains: ForRegions<f32>,
}

impl Shares {
    fn new(weights: &ForRegions<f32>, cosine: impl Fn(usize, usize) -> f32) -> Self {
        let mut gains: ForRegions<f32> =
            std::array::from_fn(|row| std::array::from_fn(|column| cosine(row, column)));
        let both = weights.as_flattened().iter().zip(gains.as_flattened());
        let total: f32 = both.map(|(weight, cosine)| weight * cosine).sum();
        for gain in gains.as_flattened_mut() {
            *gain /= total;
        }
        let regions: ForRegions<f32> = std::array::from_fn(|row| {
            std::array::from_fn(|column| weights[row][column] * gains[row][column])
        });
        Self {
            rows: regions.map(|row| row.iter().sum()),
            regions,
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

impl Regions {
    /// Of parts of the map, given by row and column of their region, unit direction, and weight; the weights sum to 1.
    pub(super) fn new(parts: impl Iterator<Item = ([usize; 2], Vec3A, f32)>) -> Self {
        let mut weights = [[0.0; COLUMNS]; ROWS];
        let mut sums = [[Vec3A::ZERO; COLUMNS]; ROWS];
        for ([row, column], direction, weight) in parts {
            weights[row][column] += weight;
            sums[row][column] += direction * weight;
        }
        let directions: ForRegions<Directions> = std::array::from_fn(|row| {
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
            facing: (0..NORMALS * NORMALS)
                .map(normal_of_index)
                .map(|n| Shares::new(&weights, |row, column| directions[row][column].cosine(n)))
                .collect(),
        }
    }

    /// For a receiver of this unit normal.
    #[inline]
    pub(super) fn shares(&self, normal: Vec3A) -> &Shares {
        &self.facing[index_of_normal(normal)]
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
