//! Choosing a patch of a map in proportion to its weight, or to that and to what a receiver sees of it, with little memory
//! to look through.
//!
//! The patches are gathered in square *cells*, about 64 side by side. Where a cell is even, as most of a sky is, it is
//! one constant of the density, and a point is anywhere in it; where it is not, a patch of it is chosen exactly. Light
//! over density then exceeds its mean in an even cell by at most a factor of [`EVEN`], and the tables that are read stay
//! in the caches nearest to the core. The cells are gathered in [`Regions`], which is where receivers come in.

use std::ops::Range;

use glam::Vec3A;
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

use crate::light::regions::{COLUMNS, DrawnRegion, LightByRegion, Purpose, ROWS, Regions};
use crate::sampling::cumulative::{self, Cumulative};

/// Cells side by side in a map, and on top of each other, at most.
const CELLS: usize = 64;
/// Largest weight of any point over the mean of its cell, if the cell is to be even.
const EVEN: f64 = 1.25;

/// A discrete distribution over the patches of a map, whose density over the map is known everywhere.
#[derive(Clone, Debug)]
pub(super) struct PatchChoice {
    grid: Grid,
    choice: CellChoice,
    /// Of each cell, row by row; the sum is 1.
    weights: Vec<f32>,
    /// Row by row.
    cells: Vec<Cell>,
    /// Over the patches of the cells that are not even.
    tables: Vec<Table>,
    /// Mean weight of a patch.
    mean: f64,
}

/// How the patches of a map are gathered in cells, and these in regions.
#[derive(Clone, Copy, Debug)]
struct Grid {
    /// Patches side by side, and on top of each other.
    n_patches: [usize; 2],
    /// Patches along the side of a cell.
    side: usize,
    /// Cells side by side, and on top of each other.
    n_cells: [usize; 2],
    /// Cells side by side in a region, and on top of each other.
    span: [usize; 2],
}

/// How a cell is chosen.
#[derive(Clone, Debug)]
enum CellChoice {
    /// By its weight: a row, then a cell of it.
    Whole {
        rows: Cumulative,
        columns: Vec<Cumulative>,
    },
    /// By region and receiver, then by its weight: a table of the cells of each region, row by row.
    ByRegion(Box<Regions>, Vec<Table>),
}

#[derive(Clone, Copy, Debug)]
enum Cell {
    /// Density of its points relative to that of uniform ones.
    Even(f32),
    /// Index of its table.
    Uneven(u32),
}

/// Chooses a patch of a cell, or a cell of a region: a row, then one of it.
#[derive(Clone, Debug)]
struct Table {
    n_rows: usize,
    n_columns: usize,
    /// Where the rows begin, then where the entries of each do; see [`cumulative::find`].
    starts: Vec<u32>,
}

/// What patches weigh on average, finite and not negative.
pub(super) trait Weights: Sync {
    /// All patches of a cell, which begins at a multiple of [`cell_side`] in both directions.
    fn of_cell(&self, columns: Range<usize>, rows: Range<usize>) -> CellWeight;

    /// Each patch of a cell, up to a factor: row by row, at the end of `means`.
    fn push_patches(&self, columns: Range<usize>, rows: Range<usize>, means: &mut Vec<f64>);
}

/// What a cell weighs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct CellWeight {
    /// Sum of the mean weights of its patches.
    pub(super) sum: f64,
    /// Weight of a point, at most.
    pub(super) peak: f64,
    /// Number of its patches.
    pub(super) n_patches: usize,
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

/// Patches along the side of the cells of a map that has so many in each direction.
pub(super) fn cell_side(n_patches: [usize; 2]) -> usize {
    n_patches[0].max(n_patches[1]).div_ceil(CELLS)
}

impl Grid {
    fn new(n_patches: [usize; 2]) -> Self {
        let side = cell_side(n_patches);
        let n_cells = n_patches.map(|n| n.div_ceil(side));
        Self {
            n_patches,
            side,
            n_cells,
            span: [n_cells[0].div_ceil(COLUMNS), n_cells[1].div_ceil(ROWS)],
        }
    }

    /// The patches of a cell along an axis, by the place of the cell along it.
    #[inline]
    fn patches(&self, axis: usize, place: usize) -> Range<usize> {
        let first = place * self.side;
        first..(first + self.side).min(self.n_patches[axis])
    }

    #[inline]
    fn cell_of(&self, column: usize, row: usize) -> usize {
        row / self.side * self.n_cells[0] + column / self.side
    }

    /// Row and column of the region of a patch.
    #[inline]
    fn region_of(&self, column: usize, row: usize) -> [usize; 2] {
        [
            row / (self.side * self.span[1]),
            column / (self.side * self.span[0]),
        ]
    }

    /// Columns and rows of the cells of a region; none beyond the map.
    fn cells_of(&self, region: usize) -> [Range<usize>; 2] {
        let along = |axis: usize, place: usize| {
            let end_of = |place: usize| (place * self.span[axis]).min(self.n_cells[axis]);
            end_of(place)..end_of(place + 1)
        };
        [along(0, region % COLUMNS), along(1, region / COLUMNS)]
    }

    /// Columns and rows of the patches of a cell.
    fn extent(&self, cell: usize) -> [Range<usize>; 2] {
        [
            self.patches(0, cell % self.n_cells[0]),
            self.patches(1, cell / self.n_cells[0]),
        ]
    }

    /// The light in each region, by the weights of cells. `direction` is the unit direction of a place of the map, in patches.
    fn light(&self, weights: &[f32], direction: impl Fn([f64; 2]) -> Vec3A) -> LightByRegion {
        LightByRegion::new(weights.iter().enumerate().map(|(cell, &weight)| {
            let [columns, rows] = self.extent(cell);
            let region = self.region_of(columns.start, rows.start);
            (region, direction(self.middle(cell)), weight)
        }))
    }

    /// The middle of a cell, in patches.
    fn middle(&self, cell: usize) -> [f64; 2] {
        self.extent(cell)
            .map(|patches| 0.5 * (patches.start + patches.end) as f64)
    }
}

impl Table {
    /// Of weights row by row; without any it is not to be asked.
    fn new(weights: &[f64], n_columns: usize) -> Self {
        let rows = weights.chunks_exact(n_columns.max(1));
        let n_rows = rows.len();
        let mut starts = Vec::with_capacity(n_rows + weights.len());
        let sums: Vec<f64> = rows.clone().map(|row| row.iter().sum()).collect();
        starts.extend(cumulative::starts(&sums));
        for row in rows {
            starts.extend(cumulative::starts(row));
        }
        Self {
            n_rows,
            n_columns,
            starts,
        }
    }

    /// Column, row, and what is left of `u`.
    #[inline]
    fn sample(&self, u: [f32; 2]) -> (usize, usize, [f32; 2]) {
        let (rows, columns) = self.starts.split_at(self.n_rows);
        let (row, v) = cumulative::find(rows, u[1]);
        let columns = &columns[row * self.n_columns..][..self.n_columns];
        let (column, u) = cumulative::find(columns, u[0]);
        (column, row, [u, v])
    }
}

impl CellChoice {
    /// By region; `weights` are those of cells.
    fn by_region(regions: Regions, grid: &Grid, weights: &[f32]) -> Self {
        let table = |region: usize| {
            let [columns, rows] = grid.cells_of(region);
            let line = |row: usize| &weights[row * grid.n_cells[0]..][columns.clone()];
            let weights: Vec<f64> = rows.flat_map(line).map(|&w| f64::from(w)).collect();
            Table::new(&weights, columns.len())
        };
        Self::ByRegion(Box::new(regions), (0..ROWS * COLUMNS).map(table).collect())
    }
}

impl CellWeight {
    fn mean(&self) -> f64 {
        self.sum / self.n_patches as f64
    }

    fn is_even(&self) -> bool {
        self.peak * self.n_patches as f64 <= EVEN * self.sum
    }
}

impl PatchChoice {
    /// Over patches side by side and on top of each other. `direction` is the unit direction of a place of the map, in
    /// patches. `None` if all weigh nothing.
    pub(super) fn new(
        n_patches: [usize; 2],
        weights: &impl Weights,
        direction: impl Fn([f64; 2]) -> Vec3A,
        heeds_normals: bool,
    ) -> Option<Self> {
        let grid = Grid::new(n_patches);
        let weighed: Vec<CellWeight> = (0..grid.n_cells[0] * grid.n_cells[1])
            .into_par_iter()
            .with_min_len(grid.n_cells[0])
            .map(|cell| {
                let [columns, rows] = grid.extent(cell);
                weights.of_cell(columns, rows)
            })
            .collect();
        let total: f64 = weighed.iter().map(|cell| cell.sum).sum();
        if !(total > 0.0) {
            return None;
        }
        let mean = total / (n_patches[0] * n_patches[1]) as f64;
        let uneven: Vec<usize> = (0..weighed.len())
            .filter(|&i| !weighed[i].is_even())
            .collect();
        let tables = uneven
            .into_par_iter()
            .map_init(Vec::new, |means, cell| {
                let [columns, rows] = grid.extent(cell);
                means.clear();
                weights.push_patches(columns.clone(), rows, means);
                Table::new(means, columns.len())
            })
            .collect();
        let mut n_tables = 0;
        let cells = weighed
            .iter()
            .map(|cell| {
                if cell.is_even() {
                    return Cell::Even((cell.mean() / mean) as f32);
                }
                n_tables += 1;
                Cell::Uneven(n_tables - 1)
            })
            .collect();
        let weights: Vec<f32> = weighed
            .iter()
            .map(|cell| (cell.sum / total) as f32)
            .collect();
        let choice = if heeds_normals {
            CellChoice::by_region(
                Regions::by_normal(grid.light(&weights, direction)),
                &grid,
                &weights,
            )
        } else {
            let sums: Vec<f64> = weighed.iter().map(|cell| cell.sum).collect();
            let rows = sums.chunks(grid.n_cells[0]);
            CellChoice::Whole {
                rows: Cumulative::new(
                    &rows.clone().map(|row| row.iter().sum()).collect::<Vec<_>>(),
                ),
                columns: rows.map(Cumulative::new).collect(),
            }
        };
        Some(Self {
            choice,
            weights,
            grid,
            cells,
            tables,
            mean,
        })
    }

    /// Draws for blocks of media from now on, by what comes through to them: see [`Regions::by_block`].
    pub(super) fn heed_blocks(
        &mut self,
        direction: impl Fn([f64; 2]) -> Vec3A,
        transmittances: impl Fn(Vec3A) -> Vec<f32> + Sync,
    ) {
        let light = self.grid.light(&self.weights, direction);
        let regions = Regions::by_block(light, transmittances);
        self.choice = CellChoice::by_region(regions, &self.grid, &self.weights);
    }

    /// Mean weight of a patch: what weights are divided by for the density of points in uneven cells.
    pub(super) fn mean(&self) -> f64 {
        self.mean
    }

    /// Density of points, relative to that of uniform ones, in the cell of a patch if the cell is even. Otherwise it is
    /// what the patch's weight says. Without a receiver.
    #[inline]
    pub(super) fn even_density(&self, column: usize, row: usize) -> Option<f32> {
        match self.cells[self.grid.cell_of(column, row)] {
            Cell::Even(density) => Some(density),
            Cell::Uneven(_) => None,
        }
    }

    /// Factor by which a purpose changes the density in a patch; 1 if the choice heeds none.
    #[inline]
    pub(super) fn gain(&self, column: usize, row: usize, purpose: Purpose) -> f32 {
        match &self.choice {
            CellChoice::Whole { .. } => 1.0,
            CellChoice::ByRegion(regions, _) => {
                regions.gain(self.grid.region_of(column, row), purpose)
            }
        }
    }

    /// Draws a cell: column, row, what is left of `u`, and the factor by which the purpose changes its density.
    #[inline]
    fn sample_cell(&self, u: [f32; 2], purpose: Purpose) -> (usize, usize, [f32; 2], f32) {
        let (regions, tables) = match &self.choice {
            CellChoice::Whole { rows, columns } => {
                let (row, v) = rows.sample(u[1]);
                let (column, u) = columns[row].sample(u[0]);
                return (column, row, [u, v], 1.0);
            }
            CellChoice::ByRegion(regions, tables) => (regions, tables),
        };
        let DrawnRegion {
            row,
            column,
            u,
            gain,
        } = regions.sample(u, purpose);
        let (column_within, row_within, u) = tables[row * COLUMNS + column].sample(u);
        let [width, height] = self.grid.span;
        let (column, row) = (column * width + column_within, row * height + row_within);
        (column, row, u, gain)
    }

    /// Draws a place, with the factor by which the purpose changes its density.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2], purpose: Purpose) -> (Drawn, f32) {
        let grid = &self.grid;
        let (cell_column, cell_row, [u, v], gain) = self.sample_cell(u, purpose);
        let (left, top) = (cell_column * grid.side, cell_row * grid.side);
        let drawn = match self.cells[cell_row * grid.n_cells[0] + cell_column] {
            Cell::Even(_) => {
                let along = |u: f32, patches: Range<usize>| {
                    let place = u * patches.len() as f32;
                    let patch = (place as usize).min(patches.len() - 1);
                    (patches.start + patch, place - patch as f32)
                };
                let (column, x) = along(u, grid.patches(0, cell_column));
                let (row, y) = along(v, grid.patches(1, cell_row));
                let at = [x, y];
                Drawn::Point { column, row, at }
            }
            Cell::Uneven(table) => {
                let (column, row, u) = self.tables[table as usize].sample([u, v]);
                Drawn::Patch {
                    column: left + column,
                    row: top + row,
                    u,
                }
            }
        };
        (drawn, gain)
    }
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

    /// Means by place, and how much larger patches get.
    struct Flat<F>(F, f64);

    impl<F: Fn(usize, usize) -> f64 + Sync> Weights for Flat<F> {
        fn of_cell(&self, columns: Range<usize>, rows: Range<usize>) -> CellWeight {
            let mut means = Vec::new();
            self.push_patches(columns, rows, &mut means);
            CellWeight {
                sum: means.iter().sum(),
                peak: means.iter().fold(0.0, |a: f64, &b| a.max(b)) * self.1,
                n_patches: means.len(),
            }
        }

        fn push_patches(&self, columns: Range<usize>, rows: Range<usize>, means: &mut Vec<f64>) {
            means.extend(rows.flat_map(|y| columns.clone().map(move |x| (self.0)(x, y))));
        }
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
        let flat = Flat(weight, 1.0);
        let mean = (0..WIDTH * HEIGHT)
            .map(|i| weight(i % WIDTH, i / WIDTH))
            .sum::<f64>()
            / (WIDTH * HEIGHT) as f64;
        let normals = [Vec3A::Z, Vec3A::new(-0.6, 0.0, -0.8)];
        for (heeds_normals, normals) in [(false, &normals[..1]), (true, &normals[..])] {
            let choice = PatchChoice::new([WIDTH, HEIGHT], &flat, around, heeds_normals)
                .expect("it is not black");
            assert!((choice.mean() / mean - 1.0).abs() < 1e-12);
            let density = |x: usize, y: usize| {
                choice
                    .even_density(x, y)
                    .map_or(weight(x, y) / mean, f64::from)
            };
            for &normal in normals {
                let purpose = Purpose::Facing(normal);
                places_follow(&choice, purpose, |x, y| {
                    density(x, y) * f64::from(choice.gain(x, y, purpose))
                });
            }
        }
    }

    /// Fails unless `density` is that of the places drawn, relative to uniform ones.
    fn places_follow(
        choice: &PatchChoice,
        purpose: Purpose,
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
            let (drawn, gain) = choice.sample(rng.uniform2(), purpose);
            let (column, row, u) = match drawn {
                Drawn::Point { column, row, at } => (column, row, at),
                Drawn::Patch { column, row, u } => (column, row, u),
            };
            assert_eq!(gain, choice.gain(column, row, purpose));
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
        let flat = Flat(weight, 1.0);
        let choice = PatchChoice::new([WIDTH, HEIGHT], &flat, around, true).expect("not black");
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
        let flat = Flat(|_, _| 1.0, 1.0);
        let choice = PatchChoice::new([WIDTH, HEIGHT], &flat, around, true).expect("not black");
        let mut rng = Rng::new(9);
        for normal in [Vec3A::X, Vec3A::NEG_Y, Vec3A::new(0.0, 0.6, 0.8)] {
            let n = 10_000;
            let n_before = (0..n)
                .filter(|_| {
                    let (Drawn::Point { column, row, .. } | Drawn::Patch { column, row, .. }, _) =
                        choice.sample(rng.uniform2(), Purpose::Facing(normal));
                    around([column as f64, row as f64]).dot(normal) > 0.0
                })
                .count();
            assert!(n_before > n * 85 / 100, "{normal}: {n_before} of {n}");
        }
    }

    #[test]
    fn a_patch_that_varies_within_is_no_even_cell() {
        let slope = Flat(|_, _| 0.5, 2.0);
        let choice = PatchChoice::new([8, 4], &slope, around, false).expect("it is not black");
        assert_eq!(choice.even_density(3, 2), None);
    }

    #[test]
    fn a_black_map_has_no_choice() {
        let black = Flat(|_, _| 0.0, 1.0);
        assert!(PatchChoice::new([8, 4], &black, around, true).is_none());
    }
}
