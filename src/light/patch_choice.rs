//! Choosing a patch of a map in proportion to its weight, or to that and to the cosine with a normal, with little memory
//! to look through.
//!
//! The patches are gathered in square *cells*, about 64 side by side. Where a cell is even, as most of a sky is, it is
//! one constant of the density, and a point is anywhere in it; where it is not, a patch of it is chosen exactly. Light
//! over density then exceeds its mean in an even cell by at most a factor of [`EVEN`], and the tables that are read stay
//! in the caches nearest to the core.
//!
//! The cells are gathered in *regions*, 16 × 8 of them. For a receiver with a normal each region also counts by roughly
//! the mean cosine of its directions with that normal, which is never 0. That is known beforehand for 24² normals, of
//! which the nearest is taken.

use glam::Vec3A;
use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::math::octahedron;
use crate::sampling::cumulative::Cumulative;
use crate::sampling::rng::ONE_MINUS_EPSILON;

/// Cells side by side in a map, at most.
const CELLS: usize = 64;
/// Largest weight of any point over the mean of its cell, if the cell is to be even.
const EVEN: f64 = 1.25;
/// Regions side by side, and on top of each other, at most.
const COLUMNS: usize = 16;
const ROWS: usize = 8;
/// Normals along an edge of the square that the sphere is unfolded to.
const NORMALS: usize = 24;
/// What a cosine counts at least: shading normals and bounds are not all there is to a surface.
const LEAST_COSINE: f32 = 0.03;

/// A discrete distribution over the patches of a map, whose density over the map is known everywhere.
#[derive(Clone, Debug)]
pub(super) struct PatchChoice {
    width: usize,
    height: usize,
    /// Patches along the side of a cell.
    side: usize,
    /// Cells side by side, and on top of each other.
    n_cells: [usize; 2],
    /// Cells side by side in a region, and on top of each other.
    span: [usize; 2],
    /// Regions where no normal matters.
    regions: Box<Regions>,
    /// Regions for each normal; none if normals do not matter.
    facing: Vec<Regions>,
    /// Sums of weights, relative to that of all, row by row.
    cell_weights: Vec<f32>,
    /// Row by row.
    cells: Vec<Cell>,
    /// Of the cells that are not even.
    tables: Vec<Table>,
    /// Mean weight of a patch.
    mean: f64,
}

/// A number for each region, row by row.
type ForRegions = [[f32; COLUMNS]; ROWS];

/// How much each region counts.
#[derive(Clone, Debug)]
struct Regions {
    /// Weights, which sum to 1; regions that do not exist weigh nothing.
    weights: ForRegions,
    /// Sums of those over rows.
    rows: [f32; ROWS],
    /// Factor by which each weighs more than without a normal.
    gains: ForRegions,
}

impl Regions {
    fn new(weights: &ForRegions, cosine: impl Fn(usize, usize) -> f32) -> Self {
        let cosines: ForRegions =
            std::array::from_fn(|row| std::array::from_fn(|column| cosine(row, column)));
        let both = || weights.as_flattened().iter().zip(cosines.as_flattened());
        let total: f32 = both().map(|(weight, cosine)| weight * cosine).sum();
        let gains = cosines.map(|row| row.map(|cosine| cosine / total));
        let weights: ForRegions = std::array::from_fn(|row| {
            std::array::from_fn(|column| weights[row][column] * gains[row][column])
        });
        Self {
            rows: weights.map(|row| row.iter().sum()),
            weights,
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

/// Weights and directions of regions, from those of cells: `region_of` gives row and column.
fn gather(
    cell_weights: &[f32],
    region_of: impl Fn(usize) -> [usize; 2],
    direction: impl Fn(usize) -> Vec3A,
) -> (ForRegions, [[Directions; COLUMNS]; ROWS]) {
    let mut weights = [[0.0; COLUMNS]; ROWS];
    let mut sums = [[Vec3A::ZERO; COLUMNS]; ROWS];
    for (cell, &weight) in cell_weights.iter().enumerate() {
        let [row, column] = region_of(cell);
        weights[row][column] += weight;
        sums[row][column] += direction(cell) * weight;
    }
    let directions = std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let weight: f32 = weights[row][column];
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
    (weights, directions)
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
    octahedron::fold(
        [index % NORMALS, index / NORMALS].map(|i| 2.0 * (i as f32 + 0.5) / NORMALS as f32 - 1.0),
    )
}

#[derive(Clone, Copy, Debug)]
enum Cell {
    /// Density of its points relative to that of uniform ones.
    Even(f32),
    /// Index of its table.
    Uneven(u32),
}

#[derive(Clone, Debug)]
struct Table {
    rows: Cumulative,
    columns: Vec<Cumulative>,
}

/// What a patch weighs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Weight {
    /// On average, finite and not negative.
    pub(super) mean: f64,
    /// At most, anywhere in it.
    pub(super) peak: f64,
}

/// A place that was drawn.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Drawn {
    /// A point of an even cell: the patch and the place in it, in [0, 1)².
    Point {
        column: usize,
        row: usize,
        at: [f32; 2],
    },
    /// A patch, chosen in proportion to its weight; `u` is left for a point in it, uniform in [0, 1)².
    Patch {
        column: usize,
        row: usize,
        u: [f32; 2],
    },
}

/// What is known of a cell before the whole is.
struct Summed {
    sum: f64,
    largest: f64,
    n_patches: usize,
}

impl PatchChoice {
    /// Over `width` × `height` patches. `direction` is the unit direction of a place of the map, in patches.  `None` if all
    /// weigh nothing.
    pub(super) fn new(
        width: usize,
        height: usize,
        weight: impl Fn(usize, usize) -> Weight + Sync,
        direction: impl Fn([f64; 2]) -> Vec3A,
        heeds_normals: bool,
    ) -> Option<Self> {
        let side = width.max(height).div_ceil(CELLS);
        let n_cells = [width, height].map(|n| n.div_ceil(side));
        let [n_columns, n_rows] = n_cells;
        let span = |cell: usize, n: usize| cell * side..n.min((cell + 1) * side);
        let weight = &weight;
        // The rows of a cell, as iterators over weights.
        let weights_of = |cell: usize| {
            let (columns, rows) = (
                span(cell % n_columns, width),
                span(cell / n_columns, height),
            );
            rows.map(move |y| columns.clone().map(move |x| weight(x, y)))
        };
        let summed: Vec<Summed> = (0..n_columns * n_rows)
            .into_par_iter()
            .map(|cell| {
                let mut summed = Summed {
                    sum: 0.0,
                    largest: 0.0,
                    n_patches: 0,
                };
                for weight in weights_of(cell).flatten() {
                    summed.sum += weight.mean;
                    summed.largest = summed.largest.max(weight.peak);
                    summed.n_patches += 1;
                }
                summed
            })
            .collect();
        let total: f64 = summed.iter().map(|cell| cell.sum).sum();
        if !(total > 0.0) {
            return None;
        }
        let mean = total / (width * height) as f64;
        let is_even = |cell: &Summed| cell.largest * cell.n_patches as f64 <= EVEN * cell.sum;
        let uneven: Vec<usize> = (0..summed.len())
            .filter(|&i| !is_even(&summed[i]))
            .collect();
        let tables = uneven
            .into_par_iter()
            .map(|cell| {
                let rows: Vec<Vec<f64>> = weights_of(cell)
                    .map(|row| row.map(|weight| weight.mean).collect())
                    .collect();
                let sums: Vec<f64> = rows.iter().map(|row| row.iter().sum()).collect();
                Table {
                    rows: Cumulative::new(&sums),
                    columns: rows.iter().map(|row| Cumulative::new(row)).collect(),
                }
            })
            .collect();
        let mut n_tables = 0;
        let cells = summed
            .iter()
            .map(|cell| {
                if is_even(cell) {
                    return Cell::Even((cell.sum / cell.n_patches as f64 / mean) as f32);
                }
                n_tables += 1;
                Cell::Uneven(n_tables - 1)
            })
            .collect();
        let span = [n_columns.div_ceil(COLUMNS), n_rows.div_ceil(ROWS)];
        let middle = |cell: usize| {
            let place =
                [cell % n_columns, cell / n_columns].map(|i| (i as f64 + 0.5) * side as f64);
            direction([place[0].min(width as f64), place[1].min(height as f64)])
        };
        let cell_weights: Vec<f32> = summed
            .iter()
            .map(|cell| (cell.sum / total) as f32)
            .collect();
        let region_of = |cell: usize| [cell / n_columns / span[1], cell % n_columns / span[0]];
        let (weights, directions) = gather(&cell_weights, region_of, middle);
        let regions = Box::new(Regions::new(&weights, |_, _| 1.0));
        let facing = (0..NORMALS * NORMALS)
            .filter(|_| heeds_normals)
            .map(normal_of_index)
            .map(|n| Regions::new(&weights, |row, column| directions[row][column].cosine(n)))
            .collect();
        Some(Self {
            width,
            height,
            side,
            n_cells,
            span,
            regions,
            facing,
            cell_weights,
            cells,
            tables,
            mean,
        })
    }

    /// Mean weight of a patch: what weights are divided by for the density of points in uneven cells.
    pub(super) fn mean(&self) -> f64 {
        self.mean
    }

    /// Density of points, relative to that of uniform ones, in the cell of a patch if the cell is even. Otherwise it is
    /// what the patch's weight says. Without a normal.
    #[inline]
    pub(super) fn even_density(&self, column: usize, row: usize) -> Option<f32> {
        match self.cells[row / self.side * self.n_cells[0] + column / self.side] {
            Cell::Even(density) => Some(density),
            Cell::Uneven(_) => None,
        }
    }

    /// The regions for a receiver of this normal. The choice must heed normals.
    #[inline]
    fn regions(&self, normal: Option<Vec3A>) -> &Regions {
        match normal {
            None => &self.regions,
            Some(n) => &self.facing[index_of_normal(n)],
        }
    }

    /// Factor by which a normal changes the density in a patch.
    #[inline]
    pub(super) fn gain(&self, column: usize, row: usize, normal: Option<Vec3A>) -> f32 {
        let [x, y] = [column, row].map(|i| i / self.side);
        self.regions(normal).gains[y / self.span[1]][x / self.span[0]]
    }

    /// Draws a place, with the factor by which the normal changes its density.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], normal: Option<Vec3A>) -> (Drawn, f32) {
        let regions = self.regions(normal);
        let (region_row, v) = pick(regions.rows, u[1]);
        let (region_column, u) = pick(regions.weights[region_row], u[0]);
        let gain = regions.gains[region_row][region_column];
        // Within the region: a row of cells, then a cell of it.
        let [first_column, first_row] = [region_column * self.span[0], region_row * self.span[1]];
        let columns = first_column..(first_column + self.span[0]).min(self.n_cells[0]);
        let rows = first_row..(first_row + self.span[1]).min(self.n_cells[1]);
        let line = |row: usize| {
            let start = row * self.n_cells[0];
            &self.cell_weights[start + columns.start..start + columns.end]
        };
        let (row, v) = pick(rows.map(|row| line(row).iter().sum()), v);
        let cell_row = first_row + row;
        let (column, u) = pick(line(cell_row).iter().copied(), u);
        let cell_column = first_column + column;

        let (left, top) = (cell_column * self.side, cell_row * self.side);
        let drawn = match self.cells[cell_row * self.n_cells[0] + cell_column] {
            Cell::Even(_) => {
                let along = |u: f32, first: usize, n: usize| {
                    let length = self.side.min(n - first);
                    let place = u * length as f32;
                    let patch = (place as usize).min(length - 1);
                    (first + patch, place - patch as f32)
                };
                let (column, x) = along(u, left, self.width);
                let (row, y) = along(v, top, self.height);
                let at = [x, y];
                Drawn::Point { column, row, at }
            }
            Cell::Uneven(table) => {
                let table = &self.tables[table as usize];
                let (row, v) = table.rows.sample(v);
                let (column, u) = table.columns[row].sample(u);
                Drawn::Patch {
                    column: left + column,
                    row: top + row,
                    u: [u, v],
                }
            }
        };
        (drawn, gain)
    }
}

/// One of a few weights in proportion, by `u` in [0, 1): its index, and what is left of `u`, in [0, 1). Where there are
/// positive weights, one of them.
#[inline]
fn pick(weights: impl IntoIterator<Item = f32, IntoIter: Clone>, u: f32) -> (usize, f32) {
    let weights = weights.into_iter();
    let total: f32 = weights.clone().sum();
    let mut place = u * total;
    let mut last = (0, 1.0);
    for (index, weight) in weights.enumerate() {
        if weight > 0.0 {
            if place < weight {
                return (index, (place / weight).min(ONE_MINUS_EPSILON));
            }
            last = (index, weight);
        }
        place -= weight;
    }
    // Rounding has carried it past the end.
    (last.0, ONE_MINUS_EPSILON)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    /// A sky with a sun, an edge and nothing below.
    fn weight(x: usize, y: usize) -> f64 {
        let sky = 1.0 + 0.1 * (x as f64 * 0.02).sin();
        match (x, y) {
            (_, 150..) => 0.0,
            (40, 17) => 5000.0,
            (200.., _) => 3.0 * sky,
            _ => sky,
        }
    }

    fn flat(x: usize, y: usize) -> Weight {
        let mean = weight(x, y);
        Weight { mean, peak: mean }
    }

    /// Directions of a map in latitude and longitude.
    fn around([column, row]: [f64; 2]) -> Vec3A {
        let (sin, cos) = (row / HEIGHT as f64 * std::f64::consts::PI).sin_cos();
        let (sin_phi, cos_phi) = (column / WIDTH as f64 * std::f64::consts::TAU).sin_cos();
        glam::DVec3::new(sin * cos_phi, sin * sin_phi, cos).as_vec3a()
    }

    const WIDTH: usize = 300;
    const HEIGHT: usize = 170;

    #[test]
    fn places_are_drawn_by_their_density() {
        let choice = PatchChoice::new(WIDTH, HEIGHT, flat, around, true).expect("it is not black");
        let mean = (0..WIDTH * HEIGHT)
            .map(|i| weight(i % WIDTH, i / WIDTH))
            .sum::<f64>()
            / (WIDTH * HEIGHT) as f64;
        assert!((choice.mean() / mean - 1.0).abs() < 1e-12);
        let density = |x: usize, y: usize| {
            choice
                .even_density(x, y)
                .map_or(weight(x, y) / mean, f64::from)
        };
        for normal in [None, Some(Vec3A::Z), Some(Vec3A::new(-0.6, 0.0, -0.8))] {
            places_follow(&choice, normal, |x, y| {
                density(x, y) * f64::from(choice.gain(x, y, normal))
            });
        }
    }

    /// Fails unless `density` is that of the places drawn, relative to uniform ones.
    fn places_follow(
        choice: &PatchChoice,
        normal: Option<Vec3A>,
        density: impl Fn(usize, usize) -> f64,
    ) {
        let total: f64 = (0..WIDTH * HEIGHT)
            .map(|i| density(i % WIDTH, i / WIDTH))
            .sum();
        assert!(
            (total / (WIDTH * HEIGHT) as f64 - 1.0).abs() < 1e-6,
            "{total}"
        );
        // In blocks of 10 × 10 patches: counts by their expectation.
        let n = 1 << 20;
        let mut counts = vec![0u32; WIDTH / 10 * (HEIGHT / 10)];
        let mut rng = Rng::new(3);
        for _ in 0..n {
            let (drawn, gain) = choice.sample(rng.uniform2(), normal);
            let (column, row, u) = match drawn {
                Drawn::Point { column, row, at } => (column, row, at),
                Drawn::Patch { column, row, u } => (column, row, u),
            };
            assert_eq!(gain, choice.gain(column, row, normal));
            assert!(u.iter().all(|u| (0.0..=1.0).contains(u)));
            assert!(weight(column, row) > 0.0 || choice.even_density(column, row).is_some());
            counts[row / 10 * (WIDTH / 10) + column / 10] += 1;
        }
        for (i, &count) in counts.iter().enumerate() {
            let (left, top) = (i % (WIDTH / 10) * 10, i / (WIDTH / 10) * 10);
            let patches = (0..100).map(|k| density(left + k % 10, top + k / 10));
            let expected = patches.sum::<f64>() / (WIDTH * HEIGHT) as f64 * f64::from(n);
            let off = (f64::from(count) - expected).abs();
            assert!(
                off <= 5.0 * expected.sqrt() + 1e-3,
                "{i}: {count} for {expected}"
            );
        }
    }

    #[test]
    fn light_over_density_is_bounded() {
        let choice = PatchChoice::new(WIDTH, HEIGHT, flat, around, true).expect("it is not black");
        let mut n_even = 0;
        for (x, y) in (0..WIDTH * HEIGHT).map(|i| (i % WIDTH, i / WIDTH)) {
            if let Some(density) = choice.even_density(x, y) {
                n_even += 1;
                let ratio = (weight(x, y) / choice.mean()) / f64::from(density).max(1e-30);
                assert!(ratio <= EVEN * (1.0 + 1e-6), "({x}, {y}): {ratio}");
            }
        }
        assert!(
            n_even > WIDTH * HEIGHT / 2,
            "{n_even} patches are in even cells"
        );
    }

    #[test]
    fn a_normal_asks_for_what_is_before_it() {
        let flat = |_, _| Weight {
            mean: 1.0,
            peak: 1.0,
        };
        let choice = PatchChoice::new(WIDTH, HEIGHT, flat, around, true).expect("not black");
        let mut rng = Rng::new(9);
        for normal in [Vec3A::X, Vec3A::NEG_Y, Vec3A::new(0.0, 0.6, 0.8)] {
            let n = 10_000;
            let n_before = (0..n)
                .filter(|_| {
                    let (Drawn::Point { column, row, .. } | Drawn::Patch { column, row, .. }, _) =
                        choice.sample(rng.uniform2(), Some(normal));
                    around([column as f64, row as f64]).dot(normal) > 0.0
                })
                .count();
            assert!(n_before > n * 85 / 100, "{normal}: {n_before} of {n}");
        }
    }

    #[test]
    fn a_patch_that_varies_within_is_no_even_cell() {
        let slope = |_, _| Weight {
            mean: 0.5,
            peak: 1.0,
        };
        let choice = PatchChoice::new(8, 4, slope, around, false).expect("it is not black");
        assert_eq!(choice.even_density(3, 2), None);
    }

    #[test]
    fn a_black_map_has_no_choice() {
        assert!(
            PatchChoice::new(
                8,
                4,
                |_, _| Weight {
                    mean: 0.0,
                    peak: 0.0
                },
                around,
                true
            )
            .is_none()
        );
    }
}
