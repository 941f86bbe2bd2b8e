//! Does a sampler draw what its density says? Pearson's χ² test.
//!
//! The domain is cut into cells, finer where the density is high, so that a narrow lobe shows its shape. The observed
//! count of each is compared to the density integrated over it. Samples that fail (`None`) are a cell of their own,
//! whose probability is what the density lacks to 1. Cells that expect fewer than five samples are pooled.

use std::cell;

use crate::{Uniform, Verdict, gamma, sidak};

/// A space with a measure, unrolled onto the unit square so that equal areas have equal measure.
pub trait Domain {
    /// A point of the space.
    type Point: Copy;
    /// Columns and rows of cells, before any is split. A side of one cell stays whole.
    const CELLS: [usize; 2];
    /// The measure of the whole space.
    const MEASURE: f64;
    /// The point at a place of the unit square.
    fn point(square: [f64; 2]) -> Self::Point;
    /// The place of a point. `None` when it is not in the space.
    fn place(point: Self::Point) -> Option<[f64; 2]>;
}

/// Unit vectors; densities per steradian.
#[derive(Clone, Copy, Debug)]
pub struct Sphere;

/// Unit vectors with z ≥ 0; densities per steradian.
#[derive(Clone, Copy, Debug)]
pub struct Hemisphere;

/// [0, 1)²; densities per area.
#[derive(Clone, Copy, Debug)]
pub struct Square;

/// [0, 1); densities per length.
#[derive(Clone, Copy, Debug)]
pub struct Line;

impl Domain for Sphere {
    type Point = [f32; 3];
    const CELLS: [usize; 2] = [32, 32];
    const MEASURE: f64 = 4.0 * std::f64::consts::PI;

    fn point([a, b]: [f64; 2]) -> [f32; 3] {
        direction(a, 2.0 * b - 1.0)
    }

    fn place(point: [f32; 3]) -> Option<[f64; 2]> {
        let (a, z) = cylindrical(point)?;
        Some([a, 0.5 * (z + 1.0)])
    }
}

impl Domain for Hemisphere {
    type Point = [f32; 3];
    const CELLS: [usize; 2] = [32, 16];
    const MEASURE: f64 = 2.0 * std::f64::consts::PI;

    fn point([a, b]: [f64; 2]) -> [f32; 3] {
        direction(a, b)
    }

    fn place(point: [f32; 3]) -> Option<[f64; 2]> {
        let (a, z) = cylindrical(point)?;
        (z >= 0.0).then_some([a, z])
    }
}

impl Domain for Square {
    type Point = [f32; 2];
    const CELLS: [usize; 2] = [32, 32];
    const MEASURE: f64 = 1.0;

    fn point(square: [f64; 2]) -> [f32; 2] {
        square.map(|x| x as f32)
    }

    fn place(point: [f32; 2]) -> Option<[f64; 2]> {
        point
            .iter()
            .all(|x| (0.0..1.0).contains(x))
            .then_some(point.map(f64::from))
    }
}

impl Domain for Line {
    type Point = f32;
    const CELLS: [usize; 2] = [512, 1];
    const MEASURE: f64 = 1.0;

    fn point([x, _]: [f64; 2]) -> f32 {
        x as f32
    }

    fn place(x: f32) -> Option<[f64; 2]> {
        (0.0..1.0).contains(&x).then_some([x.into(), 0.5])
    }
}

fn direction(turn: f64, z: f64) -> [f32; 3] {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = turn * std::f64::consts::TAU;
    [r * phi.cos(), r * phi.sin(), z].map(|x| x as f32)
}

/// Turn in [0, 1) and height; `None` unless the vector has unit length.
fn cylindrical(point: [f32; 3]) -> Option<(f64, f64)> {
    let [x, y, z] = point.map(f64::from);
    let is_unit = ((x * x + y * y + z * z) - 1.0).abs() < 1e-3;
    is_unit.then(|| {
        (
            (y.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0),
            z.clamp(-1.0, 1.0),
        )
    })
}

/// How to test. [`check`] uses the default.
#[derive(Clone, Copy, Debug)]
pub struct Chi2 {
    /// Samples to draw.
    pub n_samples: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Probability of rejecting a right sampler, over all tests of the family.
    pub alpha: f64,
    /// Number of tests in the family: when twenty parameter values are tested, say so here (Šidák's correction).
    pub n_tests: usize,
}

impl Default for Chi2 {
    fn default() -> Self {
        Self {
            n_samples: 200_000,
            seed: 1,
            alpha: 0.01,
            n_tests: 1,
        }
    }
}

/// Tests one sampler with the default settings. See [`Chi2::check`].
pub fn check<D: Domain>(
    domain: D,
    sample: impl FnMut(&mut Uniform) -> Option<D::Point>,
    pdf: impl Fn(D::Point) -> f64,
) -> Verdict {
    Chi2::default().check(domain, sample, pdf)
}

impl Chi2 {
    /// Draws samples and compares them to the density, which is taken with respect to the measure of the domain.
    ///
    /// Rejected outright: a sample outside the domain or where the density is 0 all around, a density that is negative
    /// or not finite, and one that integrates to more than 1.001.
    pub fn check<D: Domain>(
        &self,
        _domain: D,
        mut sample: impl FnMut(&mut Uniform) -> Option<D::Point>,
        pdf: impl Fn(D::Point) -> f64,
    ) -> Verdict {
        let grid = match Grid::over::<D>(&pdf) {
            Ok(grid) => grid,
            Err(explanation) => return Verdict::impossible(explanation),
        };
        let mass: f64 = grid.probabilities.iter().sum();
        if mass > 1.001 {
            return Verdict::impossible(format!("the density integrates to {mass}"));
        }

        let mut random = Uniform::new(self.seed);
        let mut observed = vec![0usize; grid.probabilities.len()];
        let mut n_failed = 0u32;
        for _ in 0..self.n_samples {
            let Some(point) = sample(&mut random) else {
                n_failed += 1;
                continue;
            };
            let Some(place) = D::place(point) else {
                return Verdict::impossible("a sample lies outside the domain".into());
            };
            observed[grid.cell_at(place)] += 1;
        }

        let n = self.n_samples as f64;
        let cells = observed.into_iter().zip(grid.probabilities);
        let mut cells: Vec<Cell> = cells
            .map(|(observed, p)| Cell {
                observed: observed as f64,
                expected: p * n,
            })
            .collect();
        if let Some(cell) = cells
            .iter()
            .find(|cell| cell.expected == 0.0 && cell.observed > 0.0)
        {
            return Verdict::impossible(format!(
                "{} samples lie in a cell of density 0",
                cell.observed
            ));
        }
        // Quadrature is good to a part in 10⁴ of the whole; less missing mass than that is none, and as few samples
        // may fail.
        let missing = if mass < 1.0 - QUADRATURE {
            1.0 - mass
        } else {
            0.0
        };
        if missing == 0.0 && f64::from(n_failed) > QUADRATURE * n {
            return Verdict::impossible(format!(
                "{n_failed} samples failed although the density integrates to {mass}"
            ));
        }
        if missing > 0.0 {
            cells.push(Cell {
                observed: f64::from(n_failed),
                expected: missing * n,
            });
        }
        self.pearson(pool(cells))
    }

    fn pearson(&self, cells: Vec<Cell>) -> Verdict {
        let statistic: f64 = cells
            .iter()
            .map(|cell| (cell.observed - cell.expected).powi(2) / cell.expected)
            .sum();
        let threshold = sidak(self.alpha, self.n_tests);
        if cells.len() < 2 {
            return Verdict {
                p_value: 1.0,
                threshold,
                explanation: "all samples share one cell".into(),
            };
        }
        let degrees = (cells.len() - 1) as f64;
        let p_value = if statistic > 0.0 {
            gamma::regularized_upper(0.5 * degrees, 0.5 * statistic)
        } else {
            1.0
        };
        Verdict {
            p_value,
            threshold,
            explanation: format!("chi2 = {statistic:.1} with {degrees} degrees of freedom"),
        }
    }
}

#[derive(Clone, Copy)]
struct Cell {
    observed: f64,
    expected: f64,
}

/// Merges cells, from the least expected upwards, until each expects at least five samples.
fn pool(mut cells: Vec<Cell>) -> Vec<Cell> {
    const LEAST: f64 = 5.0;
    cells.sort_by(|a, b| a.expected.total_cmp(&b.expected));
    let mut pooled: Vec<Cell> = Vec::with_capacity(cells.len());
    let mut open = Cell {
        observed: 0.0,
        expected: 0.0,
    };
    for cell in cells {
        open.observed += cell.observed;
        open.expected += cell.expected;
        if open.expected >= LEAST {
            pooled.push(std::mem::replace(
                &mut open,
                Cell {
                    observed: 0.0,
                    expected: 0.0,
                },
            ));
        }
    }
    // What is left over is poorer than any cell before it, and joins the last.
    if let Some(last) = pooled.last_mut() {
        last.observed += open.observed;
        last.expected += open.expected;
    }
    pooled
}

/// A rectangle of the unit square.
#[derive(Clone, Copy)]
struct Rect {
    corner: [f64; 2],
    side: [f64; 2],
}

impl Rect {
    fn halves(self, axis: usize) -> [Self; 2] {
        let mut lower = self;
        lower.side[axis] *= 0.5;
        let mut upper = lower;
        upper.corner[axis] += lower.side[axis];
        [lower, upper]
    }

    fn quarters(self) -> [Self; 4] {
        let [a, b] = self.halves(0).map(|half| half.halves(1));
        [a[0], a[1], b[0], b[1]]
    }
}

/// The cells of a domain: a regular grid, each of whose cells is the root of a binary tree.
struct Grid {
    n_columns: usize,
    n_rows: usize,
    nodes: Vec<Node>,
    /// Of every leaf.
    probabilities: Vec<f64>,
}

enum Node {
    /// Index of a probability.
    Leaf(usize),
    /// Cut across `axis` at `at`; the halves are nodes `first` and `first + 1`.
    Split { axis: usize, at: f64, first: usize },
}

impl Grid {
    /// Cells stay wider than this. Finer ones would feel the spacing of f32.
    const LEAST_SIDE: f64 = 1.0 / 32768.0;

    fn over<D: Domain>(pdf: &impl Fn(D::Point) -> f64) -> Result<Self, String> {
        let bad = cell::Cell::new(None);
        let density = |square: [f64; 2]| {
            let value = pdf(D::point(square));
            if value >= 0.0 && value.is_finite() {
                return value * D::MEASURE;
            }
            bad.set(Some(value));
            0.0
        };
        let [n_columns, n_rows] = D::CELLS;
        let mut grid = Self {
            n_columns,
            n_rows,
            nodes: Vec::new(),
            probabilities: Vec::new(),
        };
        let side = [1.0 / n_columns as f64, 1.0 / n_rows as f64];
        let at = |column: usize, row: usize| Rect {
            corner: [column as f64 * side[0], row as f64 * side[1]],
            side,
        };
        let roots = (0..n_rows).flat_map(|row| (0..n_columns).map(move |column| (column, row)));
        let roots: Vec<Rect> = roots.map(|(column, row)| at(column, row)).collect();
        grid.add(&roots, &density);
        match bad.get() {
            Some(value) => Err(format!("the density is {value} somewhere")),
            None => Ok(grid),
        }
    }

    /// Appends nodes for the rectangles, next to each other, and below them the halves of those that hold more than
    /// their share.
    fn add(&mut self, rects: &[Rect], density: &impl Fn([f64; 2]) -> f64) {
        let share = 1.0 / (self.n_columns * self.n_rows) as f64;
        let first = self.nodes.len();
        self.nodes
            .extend(rects.iter().map(|_| Node::Leaf(usize::MAX)));
        for (i, &rect) in rects.iter().enumerate() {
            // A cell may be wrong by a ten-thousandth of a regular cell's share.
            let tolerance = 1e-4 * share;
            let probability =
                integral(density, rect, gauss(density, rect), tolerance, MAX_HALVINGS);
            let axis = if probability > 2.0 * share {
                self.axis_to_split(rect, density, tolerance)
            } else {
                None
            };
            self.nodes[first + i] = if let Some(axis) = axis {
                let halves = rect.halves(axis);
                let split = Node::Split {
                    axis,
                    at: halves[1].corner[axis],
                    first: self.nodes.len(),
                };
                self.add(&halves, density);
                split
            } else {
                self.probabilities.push(probability);
                Node::Leaf(self.probabilities.len() - 1)
            };
        }
    }

    /// The axis whose halves differ most.
    fn axis_to_split(
        &self,
        rect: Rect,
        density: &impl Fn([f64; 2]) -> f64,
        tolerance: f64,
    ) -> Option<usize> {
        let cells = [self.n_columns, self.n_rows];
        let contrast = |axis: usize| {
            let [lower, upper] = rect
                .halves(axis)
                .map(|half| integral(density, half, gauss(density, half), tolerance, MAX_HALVINGS));
            (lower - upper).abs()
        };
        let can_split = |&axis: &usize| cells[axis] > 1 && rect.side[axis] > Self::LEAST_SIDE;
        let contrasts = (0..2).filter(can_split).map(|axis| (axis, contrast(axis)));
        contrasts
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(axis, _)| axis)
    }

    /// The leaf that holds a place.
    fn cell_at(&self, place: [f64; 2]) -> usize {
        let index = |t: f64, n: usize| ((t * n as f64) as usize).min(n - 1);
        let mut node =
            index(place[1], self.n_rows) * self.n_columns + index(place[0], self.n_columns);
        loop {
            match self.nodes[node] {
                Node::Leaf(leaf) => return leaf,
                Node::Split { axis, at, first } => node = first + usize::from(place[axis] >= at),
            }
        }
    }
}

/// Error of the integral of a density over the whole domain.
const QUADRATURE: f64 = 1e-4;

/// Halvings of a rectangle's sides for the sake of accuracy, at most.
const MAX_HALVINGS: u32 = 6;

/// The integral over a rectangle, whose rough value is known: split in four until the parts agree with the whole.
fn integral(
    density: &impl Fn([f64; 2]) -> f64,
    rect: Rect,
    rough: f64,
    tolerance: f64,
    halvings: u32,
) -> f64 {
    let parts = rect.quarters().map(|part| (part, gauss(density, part)));
    let fine: f64 = parts.iter().map(|part| part.1).sum();
    // The first parts agree with the whole by luck where a lobe falls between the nodes: they are always cut again.
    let may_end = halvings < MAX_HALVINGS && (fine - rough).abs() <= tolerance;
    if halvings == 0 || may_end {
        return fine;
    }
    parts
        .map(|(part, rough)| integral(density, part, rough, 0.25 * tolerance, halvings - 1))
        .iter()
        .sum()
}

/// Gauss-Legendre with three nodes along each side: exact to degree five.
fn gauss(
    density: &impl Fn([f64; 2]) -> f64,
    Rect {
        corner: [x, y],
        side: [w, h],
    }: Rect,
) -> f64 {
    let offset = 0.5 * 0.6f64.sqrt();
    let nodes = [
        (0.5 - offset, 5.0 / 18.0),
        (0.5, 8.0 / 18.0),
        (0.5 + offset, 5.0 / 18.0),
    ];
    let along = |(u, weight_u): (f64, f64)| {
        nodes
            .iter()
            .map(|&(v, weight_v)| weight_u * weight_v * density([x + u * w, y + v * h]))
            .sum::<f64>()
    };
    nodes.into_iter().map(along).sum::<f64>() * w * h
}
