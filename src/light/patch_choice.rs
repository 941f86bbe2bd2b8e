//! Choosing a patch of a map in proportion to its weight, with little memory to look through.
//!
//! The patches are gathered in square *cells*, about 64 side by side. Where a cell is even, as most of a sky is, it is
//! one constant of the density, and a point is anywhere in it; where it is not, a patch of it is chosen exactly. Light
//! over density then exceeds its mean in an even cell by at most a factor of [`EVEN`], and the tables that are read stay
//! in the caches nearest to the core.

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::sampling::cumulative::Cumulative;

/// Cells side by side in a map, at most.
const CELLS: usize = 64;
/// Largest weight of any point over the mean of its cell, if the cell is to be even.
const EVEN: f64 = 1.25;

/// A discrete distribution over the patches of a map, whose density over the map is known everywhere.
#[derive(Clone, Debug)]
pub(super) struct PatchChoice {
    grid: Grid,
    /// Over the cells, by the sums of their weights.
    choice: Table,
    /// Row by row.
    cells: Vec<Cell>,
    /// Over the patches of the cells that are not even.
    tables: Vec<Table>,
    /// Mean weight of a patch.
    mean: f64,
}

#[derive(Clone, Copy, Debug)]
enum Cell {
    /// Density of its points relative to that of uniform ones.
    Even(f32),
    /// Index of its table.
    Uneven(u32),
}

/// How patches are gathered in cells.
#[derive(Clone, Copy, Debug)]
struct Grid {
    width: usize,
    height: usize,
    /// Patches along the side of a cell.
    side: usize,
    /// Cells side by side.
    n_columns: usize,
}

/// A discrete distribution over rows and the columns of each.
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

impl Grid {
    fn new(width: usize, height: usize) -> Self {
        let side = width.div_ceil(CELLS);
        Self {
            width,
            height,
            side,
            n_columns: width.div_ceil(side),
        }
    }

    fn n_cells(&self) -> usize {
        self.n_columns * self.height.div_ceil(self.side)
    }

    #[inline]
    fn cell_of(&self, column: usize, row: usize) -> usize {
        row / self.side * self.n_columns + column / self.side
    }

    /// What the patches of a cell weigh, row by row.
    fn weights(
        &self,
        cell: usize,
        weight: impl Fn(usize, usize) -> Weight,
    ) -> impl Iterator<Item = Vec<Weight>> {
        let span = |cell: usize, n: usize| cell * self.side..n.min((cell + 1) * self.side);
        let columns = span(cell % self.n_columns, self.width);
        let rows = span(cell / self.n_columns, self.height);
        rows.map(move |y| columns.clone().map(|x| weight(x, y)).collect())
    }
}

impl Table {
    fn new(weights: &[Vec<f64>]) -> Self {
        let sums: Vec<f64> = weights.iter().map(|row| row.iter().sum()).collect();
        Self {
            rows: Cumulative::new(&sums),
            columns: weights.iter().map(|row| Cumulative::new(row)).collect(),
        }
    }

    /// Column, row, and what is left of `u`.
    #[inline]
    fn sample(&self, u: [f32; 2]) -> (usize, usize, [f32; 2]) {
        let (row, v) = self.rows.sample(u[1]);
        let (column, u) = self.columns[row].sample(u[0]);
        (column, row, [u, v])
    }
}

impl Summed {
    fn new(weights: impl Iterator<Item = Vec<Weight>>) -> Self {
        let mut summed = Self {
            sum: 0.0,
            largest: 0.0,
            n_patches: 0,
        };
        for weight in weights.flatten() {
            summed.sum += weight.mean;
            summed.largest = summed.largest.max(weight.peak);
            summed.n_patches += 1;
        }
        summed
    }

    fn mean(&self) -> f64 {
        self.sum / self.n_patches as f64
    }

    fn is_even(&self) -> bool {
        self.largest * self.n_patches as f64 <= EVEN * self.sum
    }
}

impl PatchChoice {
    /// Over `width` × `height` patches. `None` if all weigh nothing.
    pub(super) fn new(
        width: usize,
        height: usize,
        weight: impl Fn(usize, usize) -> Weight + Sync,
    ) -> Option<Self> {
        let grid = Grid::new(width, height);
        let summed: Vec<Summed> = (0..grid.n_cells())
            .into_par_iter()
            .map(|cell| Summed::new(grid.weights(cell, &weight)))
            .collect();
        let total: f64 = summed.iter().map(|cell| cell.sum).sum();
        if !(total > 0.0) {
            return None;
        }
        let mean = total / (width * height) as f64;
        let uneven: Vec<usize> = (0..summed.len())
            .filter(|&cell| !summed[cell].is_even())
            .collect();
        let tables = uneven
            .into_par_iter()
            .map(|cell| {
                let means = |row: Vec<Weight>| row.iter().map(|weight| weight.mean).collect();
                let rows: Vec<Vec<f64>> = grid.weights(cell, &weight).map(means).collect();
                Table::new(&rows)
            })
            .collect();
        let mut n_tables = 0;
        let cells = summed
            .iter()
            .map(|cell| {
                if cell.is_even() {
                    return Cell::Even((cell.mean() / mean) as f32);
                }
                n_tables += 1;
                Cell::Uneven(n_tables - 1)
            })
            .collect();
        let sums: Vec<Vec<f64>> = summed
            .chunks(grid.n_columns)
            .map(|row| row.iter().map(|cell| cell.sum).collect())
            .collect();
        Some(Self {
            grid,
            choice: Table::new(&sums),
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
    /// what the patch's weight says.
    #[inline]
    pub(super) fn even_density(&self, column: usize, row: usize) -> Option<f32> {
        match self.cells[self.grid.cell_of(column, row)] {
            Cell::Even(density) => Some(density),
            Cell::Uneven(_) => None,
        }
    }

    /// Draws a place.
    #[inline]
    pub(super) fn sample(&self, u: [f32; 2]) -> Drawn {
        let grid = &self.grid;
        let (cell_column, cell_row, [u, v]) = self.choice.sample(u);
        let (left, top) = (cell_column * grid.side, cell_row * grid.side);
        match self.cells[cell_row * grid.n_columns + cell_column] {
            Cell::Even(_) => {
                let along = |u: f32, first: usize, n: usize| {
                    let length = grid.side.min(n - first);
                    let place = u * length as f32;
                    let patch = (place as usize).min(length - 1);
                    (first + patch, place - patch as f32)
                };
                let (column, x) = along(u, left, grid.width);
                let (row, y) = along(v, top, grid.height);
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
        }
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

    fn flat(x: usize, y: usize) -> Weight {
        let mean = weight(x, y);
        Weight { mean, peak: mean }
    }

    const WIDTH: usize = 300;
    const HEIGHT: usize = 170;

    #[test]
    fn places_are_drawn_by_their_density() {
        let choice = PatchChoice::new(WIDTH, HEIGHT, flat).expect("it is not black");
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
            let (column, row, u) = match choice.sample(rng.uniform2()) {
                Drawn::Point { column, row, at } => (column, row, at),
                Drawn::Patch { column, row, u } => (column, row, u),
            };
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
        let choice = PatchChoice::new(WIDTH, HEIGHT, flat).expect("it is not black");
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
    fn a_patch_that_varies_within_is_no_even_cell() {
        let slope = |_, _| Weight {
            mean: 0.5,
            peak: 1.0,
        };
        let choice = PatchChoice::new(8, 4, slope).expect("it is not black");
        assert_eq!(choice.even_density(3, 2), None);
    }

    #[test]
    fn a_black_map_has_no_choice() {
        assert!(
            PatchChoice::new(8, 4, |_, _| Weight {
                mean: 0.0,
                peak: 0.0
            })
            .is_none()
        );
    }
}
