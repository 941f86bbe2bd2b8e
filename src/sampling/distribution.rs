//! Choosing by weight: piecewise-constant densities in one and two dimensions, and discrete choice in constant time.
//!
//! One table serves drawing and density: a probability is the difference of two prefix sums, in f64, so that what is
//! drawn is what the density says. An entry of weight 0 is never returned, whatever the random number. A table without
//! any weight cannot be built: the constructors return `None`, which means "no sample".
//!
//! Weights that are negative, infinite or NaN count as 0. So do weights below 2⁻⁵² of the total: no prefix sum
//! resolves them, and a random number that hit one by its coarseness would return an absurd 1/pdf. Every other entry
//! has a positive probability.
//!
//! Random numbers lie in [0, 1); they may be `f32` or `f64`. Others are clamped into that range, NaN to its end.

use glam::Vec2;
use rayon::prelude::{IndexedParallelIterator, ParallelIterator, ParallelSlice, ParallelSliceMut};

/// A density over [0, 1), constant on cells of equal width; also a choice among those cells.
#[derive(Clone, Debug)]
pub struct Distribution1D {
    /// Prefix sums, from 0 to 1; one more than there are cells.
    cdf: Vec<f64>,
    mean_weight: f64,
}

/// A point drawn from a [`Distribution1D`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample1D {
    /// The point, in [0, 1), inside its cell.
    pub x: f32,
    /// Density with respect to length; above 0.
    pub pdf: f32,
    /// The cell.
    pub index: usize,
}

/// An entry chosen by weight.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct DiscreteSample {
    /// The entry.
    pub index: usize,
    /// Its probability; above 0.
    pub pmf: f32,
    /// What the choice left of the random number, uniform in [0, 1).
    pub u: f32,
}

impl Distribution1D {
    /// Cells weighted by `weights`. `None` without any weight.
    pub fn new<W: Copy + Into<f64>>(weights: &[W]) -> Option<Self> {
        let mut cdf = vec![0.0; weights.len() + 1];
        let total = fill_cdf(weights, &mut cdf);
        (total > 0.0).then(|| Self {
            cdf,
            mean_weight: total / weights.len() as f64,
        })
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.cdf.len() - 1
    }

    /// The integral over [0, 1) of the function whose value in each cell is its weight.
    pub fn mean_weight(&self) -> f64 {
        self.mean_weight
    }

    /// Draws a point.
    pub fn sample_continuous(&self, u: impl Into<f64>) -> Sample1D {
        let (index, rest) = draw(&self.cdf, u.into());
        Sample1D {
            x: point_in_cell(index, rest, self.n_cells()),
            pdf: cell_pdf(&self.cdf, index) as f32,
            index,
        }
    }

    /// Draws a cell.
    pub fn sample_discrete(&self, u: impl Into<f64>) -> DiscreteSample {
        let (index, rest) = draw(&self.cdf, u.into());
        DiscreteSample {
            index,
            pmf: self.pmf(index),
            u: below_one(rest),
        }
    }

    /// Density at `x` in [0, 1), with respect to length. Points outside count as the nearest cell.
    pub fn pdf(&self, x: f32) -> f32 {
        cell_pdf(&self.cdf, cell_of(x, self.n_cells())) as f32
    }

    /// Probability of a cell. Panics beyond the last.
    pub fn pmf(&self, index: usize) -> f32 {
        (self.cdf[index + 1] - self.cdf[index]) as f32
    }
}

/// A density over the unit square, constant on the cells of a grid.
#[derive(Clone, Debug)]
pub struct Distribution2D {
    /// Density of rows along v.
    rows: Distribution1D,
    /// Prefix sums within each row, one row after another; zeros for rows without weight.
    row_cdfs: Vec<f64>,
    width: usize,
}

/// A point drawn from a [`Distribution2D`].
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sample2D {
    /// The point, in [0, 1)², inside its cell.
    pub uv: Vec2,
    /// Density with respect to area; above 0.
    pub pdf: f32,
    /// Column of the cell.
    pub column: usize,
    /// Row of the cell.
    pub row: usize,
}

impl Distribution2D {
    /// A grid `width` cells wide, weighted row by row; row 0 lies at v = 0.
    ///
    /// `None` without any weight, or when the weights do not fill whole rows. Rows are summed in parallel, with the
    /// same result for any number of threads.
    pub fn new<W: Copy + Into<f64> + Sync>(weights: &[W], width: usize) -> Option<Self> {
        if width == 0 || !weights.len().is_multiple_of(width) {
            return None;
        }
        let height = weights.len() / width;
        let mut row_cdfs = vec![0.0; (width + 1) * height];
        let row_totals: Vec<f64> = row_cdfs
            .par_chunks_exact_mut(width + 1)
            .zip_eq(weights.par_chunks_exact(width))
            .map(|(cdf, weights)| fill_cdf(weights, cdf))
            .collect();
        Some(Self {
            rows: Distribution1D::new(&row_totals)?,
            row_cdfs,
            width,
        })
    }

    /// The integral over the unit square of the function whose value in each cell is its weight.
    pub fn mean_weight(&self) -> f64 {
        self.rows.mean_weight / self.width as f64
    }

    /// Draws a point: `u.y` chooses the row, `u.x` the place in it.
    pub fn sample(&self, u: Vec2) -> Sample2D {
        let row = self.rows.sample_continuous(u.y);
        let cdf = self.row_cdf(row.index);
        let (column, rest) = draw(cdf, u.x.into());
        let uv = Vec2::new(point_in_cell(column, rest, self.width), row.x);
        Sample2D {
            uv,
            pdf: self.cell_density(column, row.index),
            column,
            row: row.index,
        }
    }

    /// Density at `uv` in [0, 1)², with respect to area. Points outside count as the nearest cell.
    pub fn pdf(&self, uv: Vec2) -> f32 {
        self.cell_density(
            cell_of(uv.x, self.width),
            cell_of(uv.y, self.rows.n_cells()),
        )
    }

    fn cell_density(&self, column: usize, row: usize) -> f32 {
        (cell_pdf(&self.rows.cdf, row) * cell_pdf(self.row_cdf(row), column)) as f32
    }

    fn row_cdf(&self, row: usize) -> &[f64] {
        &self.row_cdfs[row * (self.width + 1)..][..self.width + 1]
    }
}

/// Discrete choice in constant time (Walker 1974, built by Vose 1991).
#[derive(Clone, Debug)]
pub struct AliasTable {
    slots: Vec<Slot>,
}

/// One of n equal shares of the unit interval, divided between two entries.
#[derive(Clone, Copy, Debug)]
struct Slot {
    /// The part of the share that is the entry's own; the rest is the alias's.
    own: f64,
    alias: u32,
    /// Probability of the entry, over all shares.
    pmf: f32,
}

impl AliasTable {
    /// Entries weighted by `weights`. `None` without any weight, or for more than 2³² entries.
    pub fn new<W: Copy + Into<f64>>(weights: &[W]) -> Option<Self> {
        let n = u32::try_from(weights.len()).ok()?;
        let cdf = Distribution1D::new(weights)?.cdf;
        let share = |index: u32| cdf[index as usize + 1] - cdf[index as usize];
        let slot = |index| Slot {
            own: share(index) * f64::from(n),
            alias: index,
            pmf: share(index) as f32,
        };
        let mut slots: Vec<Slot> = (0..n).map(slot).collect();

        // Entries with less than a full share give the rest of their slot to one with more.
        let (mut poor, mut rich): (Vec<u32>, Vec<u32>) =
            (0..n).partition(|&index| slots[index as usize].own < 1.0);
        while let (Some(taker), Some(&giver)) = (poor.pop(), rich.last()) {
            slots[taker as usize].alias = giver;
            let left = (slots[giver as usize].own + slots[taker as usize].own) - 1.0;
            slots[giver as usize].own = left;
            if left < 1.0 {
                rich.pop();
                poor.push(giver);
            }
        }
        // Rounding can leave poor entries without a giver: they keep their slot, unless they have no weight at all and
        // so must never be returned.
        let heaviest = (0..n).max_by(|&a, &b| share(a).total_cmp(&share(b)))?;
        for &index in &poor {
            let weightless = share(index) == 0.0;
            slots[index as usize].alias = if weightless { heaviest } else { index };
        }
        Some(Self { slots })
    }

    /// Chooses an entry.
    pub fn sample(&self, u: impl Into<f64>) -> DiscreteSample {
        let scaled = unit(u.into()) * self.slots.len() as f64;
        let index = (scaled as usize).min(self.slots.len() - 1);
        let Slot { own, alias, .. } = self.slots[index];
        let position = scaled - index as f64;
        let (index, rest) = if position < own {
            (index, position / own)
        } else {
            (alias as usize, (position - own) / (1.0 - own))
        };
        DiscreteSample {
            index,
            pmf: self.pmf(index),
            u: below_one(rest),
        }
    }

    /// Probability of an entry. Panics beyond the last.
    pub fn pmf(&self, index: usize) -> f32 {
        self.slots[index].pmf
    }
}

/// Largest f64 below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Writes prefix sums from 0 to 1, or zeros if there is no weight; returns the sum of the weights.
fn fill_cdf<W: Copy + Into<f64>>(weights: &[W], cdf: &mut [f64]) -> f64 {
    let usable = |weight: W| -> f64 {
        let weight = weight.into();
        if weight > 0.0 && weight.is_finite() {
            weight
        } else {
            0.0
        }
    };
    let largest = weights
        .iter()
        .map(|&weight| usable(weight))
        .fold(0.0, f64::max);
    if largest == 0.0 {
        return 0.0;
    }
    // Relative to the largest, nothing overflows.
    let relative_total: f64 = weights.iter().map(|&weight| usable(weight) / largest).sum();
    let negligible = relative_total * f64::EPSILON;
    let mut sum = 0.0;
    for (entry, &weight) in cdf[1..].iter_mut().zip(weights) {
        let weight = usable(weight) / largest;
        if weight >= negligible {
            sum += weight;
        }
        *entry = sum;
    }
    for entry in cdf {
        *entry /= sum;
    }
    // Only the caller's scale can overflow; infinity is as good as any number then, being above 0.
    relative_total * largest
}

/// The cell whose prefix sums enclose `u`, and where between them `u` lies, in [0, 1]. Its probability is above 0.
fn draw(cdf: &[f64], u: f64) -> (usize, f64) {
    let u = unit(u);
    // The first sum is 0 ≤ u and the last is 1 > u, and the chosen pair is the one that differs.
    let index = cdf.partition_point(|&sum| sum <= u) - 1;
    (index, (u - cdf[index]) / (cdf[index + 1] - cdf[index]))
}

fn cell_pdf(cdf: &[f64], index: usize) -> f64 {
    (cdf[index + 1] - cdf[index]) * (cdf.len() - 1) as f64
}

/// Into [0, 1), NaN to the end.
fn unit(u: f64) -> f64 {
    if u < BELOW_ONE { u.max(0.0) } else { BELOW_ONE }
}

/// To f32 without reaching 1.
fn below_one(x: f64) -> f32 {
    (x as f32).min(1.0 - f32::EPSILON / 2.0)
}

/// The cell that holds `x`. Exact: the product of an f32 and a count below 2²⁹ has no rounding in f64.
fn cell_of(x: f32, n_cells: usize) -> usize {
    ((f64::from(x) * n_cells as f64) as usize).min(n_cells - 1)
}

/// The point at `fraction` of a cell, moved by an ulp where rounding would put it into a neighbour of other density.
fn point_in_cell(index: usize, fraction: f64, n_cells: usize) -> f32 {
    let x = below_one((index as f64 + fraction) / n_cells as f64);
    match cell_of(x, n_cells).cmp(&index) {
        std::cmp::Ordering::Less => x.next_up(),
        std::cmp::Ordering::Equal => x,
        std::cmp::Ordering::Greater => x.next_down(),
    }
}
