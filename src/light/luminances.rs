//! Luminances of a map, gathered for the cells that directions are drawn from.
//!
//! What a cell weighs follows from sums over runs of texels, for any [`Emphasis`] unless its bend lies among the
//! luminances of a run: a map is gone through once for all that is drawn from it.

use std::ops::Range;

use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::{ParallelSlice, ParallelSliceMut};

use crate::light::patch_choice::{CellWeight, Weights, cell_side};
use crate::math::{greater, lesser};
use crate::spectrum::Rgb;

/// What a luminance counts: what exceeds `cut`, but never less than `least` of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Emphasis {
    pub(super) cut: f32,
    pub(super) least: f32,
}

impl Emphasis {
    /// Every luminance counts as what it is.
    pub(super) const NONE: Self = Self {
        cut: 0.0,
        least: 1.0,
    };

    #[inline]
    pub(super) fn of(self, luminance: f32) -> f32 {
        (luminance - self.cut).max(self.least * luminance)
    }

    /// Whether what exceeds the cut counts.
    fn is_bright(self, luminance: f32) -> bool {
        luminance - self.cut > self.least * luminance
    }
}

/// Luminances of a map that repeats in both directions.
pub(super) struct Luminances<'a> {
    texels: &'a [[f32; 3]],
    width: usize,
    /// Mean of sin θ over each row of patches.
    sines: &'a [f64],
    side: usize,
    /// For each row of texels, one for each cell across.
    runs: Vec<Run>,
    mean: Rgb,
}

/// Texels in a row of the map that are corners of the patches of one cell.
#[derive(Clone, Copy, Debug, Default)]
struct Run {
    /// Sum over the patches of the luminances at both of their ends.
    sum: f64,
    least: f32,
    largest: f32,
}

impl Run {
    /// Of the first texel of each patch, and what follows the last.
    fn new(firsts: &[f32], end: f32) -> Self {
        // In lanes, so that there are instructions for several.
        const LANES: usize = 4;
        let (chunks, rest) = firsts.as_chunks::<LANES>();
        let mut sums = [0f64; LANES];
        let (mut least, mut largest) = ([end; LANES], [end; LANES]);
        for chunk in chunks {
            for lane in 0..LANES {
                let luminance = chunk[lane];
                sums[lane] += f64::from(luminance);
                least[lane] = lesser(luminance, least[lane]);
                largest[lane] = greater(luminance, largest[lane]);
            }
        }
        let rest = || rest.iter().copied();
        let sum = sums.into_iter().chain(rest().map(f64::from)).sum::<f64>();
        Self {
            sum: sum + (sum - f64::from(firsts[0]) + f64::from(end)),
            least: least.into_iter().chain(rest()).fold(end, lesser),
            largest: largest.into_iter().chain(rest()).fold(end, greater),
        }
    }
}

impl<'a> Luminances<'a> {
    /// Of non-negative, finite texels, row by row, as many rows as `sines`.
    pub(super) fn new(texels: &'a [[f32; 3]], width: usize, sines: &'a [f64]) -> Self {
        let height = sines.len();
        let side = cell_side([width, height]);
        let n_across = width.div_ceil(side);
        let mut runs = vec![Run::default(); n_across * height];
        let sums: Vec<[f64; 3]> = runs
            .par_chunks_exact_mut(n_across)
            .zip_eq(texels.par_chunks_exact(width))
            .map_init(Vec::new, |line: &mut Vec<f32>, (runs, texels)| {
                line.clear();
                line.extend(texels.iter().map(|&texel| luminance(texel)));
                for (column, (run, firsts)) in runs.iter_mut().zip(line.chunks(side)).enumerate() {
                    let end = (column * side + firsts.len()) % width;
                    *run = Run::new(firsts, line[end]);
                }
                sum(texels)
            })
            .collect();
        Self {
            mean: mean_over_sphere(&sums, width, sines),
            texels,
            width,
            sines,
            side,
            runs,
        }
    }

    /// Mean of the map over the sphere.
    pub(super) fn mean(&self) -> Rgb {
        self.mean
    }

    /// Luminances at the corners of patches, along one row of texels.
    fn corners(&self, columns: Range<usize>, row: usize) -> impl Iterator<Item = f32> {
        let line = &self.texels[row * self.width..][..self.width];
        let end = line[columns.end % self.width];
        let firsts = line[columns].iter().copied();
        firsts.chain([end]).map(luminance)
    }
}

/// Luminances as they count.
pub(super) struct Emphasised<'a> {
    pub(super) luminances: &'a Luminances<'a>,
    pub(super) emphasis: Emphasis,
}

impl Emphasised<'_> {
    /// Along one row of texels: the sum of a [`Run`], and the largest.
    fn run(&self, columns: Range<usize>, row: usize) -> (f64, f32) {
        let Self {
            luminances,
            emphasis,
        } = self;
        let n_across = luminances.width.div_ceil(luminances.side);
        let run = luminances.runs[row * n_across + columns.start / luminances.side];
        let largest = emphasis.of(run.largest);
        if !emphasis.is_bright(run.largest) {
            return (f64::from(emphasis.least) * run.sum, largest);
        }
        let n_ends = 2 * columns.len();
        if emphasis.is_bright(run.least) {
            return (run.sum - n_ends as f64 * f64::from(emphasis.cut), largest);
        }
        let mut corners = luminances
            .corners(columns, row)
            .map(|luminance| f64::from(emphasis.of(luminance)));
        let first = corners.next().unwrap_or_default();
        let (sum, last) = corners.fold((first, first), |(sum, _), c| (sum + c, c));
        (sum + (sum - first - last), largest)
    }

    fn next(&self, row: usize) -> usize {
        (row + 1) % self.luminances.sines.len()
    }
}

impl Weights for Emphasised<'_> {
    fn of_cell(&self, columns: Range<usize>, rows: Range<usize>) -> CellWeight {
        let mut weight = CellWeight {
            sum: 0.0,
            peak: 0.0,
            n_patches: columns.len() * rows.len(),
        };
        let (mut above, mut largest_above) = self.run(columns.clone(), rows.start);
        for row in rows {
            let (below, largest_below) = self.run(columns.clone(), self.next(row));
            let sine = self.luminances.sines[row];
            let largest = f64::from(largest_above.max(largest_below));
            weight.sum += 0.25 * (above + below) * sine;
            weight.peak = weight.peak.max(largest * sine);
            (above, largest_above) = (below, largest_below);
        }
        weight
    }

    fn push_patches(&self, columns: Range<usize>, rows: Range<usize>, means: &mut Vec<f64>) {
        let (start, n_columns, n_rows) = (means.len(), columns.len(), rows.len());
        // First the sums of the two upper corners of each patch, of one row of patches too many.
        for row in rows.clone().chain([self.next(rows.end - 1)]) {
            let mut corners = self
                .luminances
                .corners(columns.clone(), row)
                .map(|luminance| f64::from(self.emphasis.of(luminance)));
            let mut left = corners.next().unwrap_or_default();
            means.extend(corners.map(|right| {
                let sum = left + right;
                left = right;
                sum
            }));
        }
        for (y, row) in rows.enumerate() {
            let sine = self.luminances.sines[row];
            let line = &mut means[start + y * n_columns..][..2 * n_columns];
            let (above, below) = line.split_at_mut(n_columns);
            for (above, below) in above.iter_mut().zip(below) {
                *above = (*above + *below) * sine;
            }
        }
        means.truncate(start + n_rows * n_columns);
    }
}

fn luminance(texel: [f32; 3]) -> f32 {
    Rgb::from_array(texel).luminance()
}

/// Sums over texels, channel by channel.
fn sum(texels: &[[f32; 3]]) -> [f64; 3] {
    // Four texels at a time.
    let (chunks, rest) = texels.as_flattened().as_chunks::<12>();
    let mut lanes = [0f64; 12];
    for chunk in chunks {
        for (lane, &sample) in lanes.iter_mut().zip(chunk) {
            *lane += f64::from(sample);
        }
    }
    for (lane, &sample) in lanes.iter_mut().zip(rest) {
        *lane += f64::from(sample);
    }
    std::array::from_fn(|channel| lanes.iter().skip(channel).step_by(3).sum())
}

/// From sums over the rows of texels, and the mean sine of each row of patches.
fn mean_over_sphere(sums: &[[f64; 3]], width: usize, sines: &[f64]) -> Rgb {
    let height = sums.len();
    let mut mean = [0.0; 3];
    for (y, row) in sums.iter().enumerate() {
        // A texel row has half of the patch rows above and below it.
        let sine = 0.5 * (sines[y] + sines[(y + height - 1) % height]);
        for (mean, sum) in mean.iter_mut().zip(row) {
            *mean += sum * sine;
        }
    }
    let norm = width as f64 * sines.iter().sum::<f64>();
    Rgb::from_array(mean.map(|c| (c / norm) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    #[test]
    fn cells_weigh_what_their_patches_do() {
        // No side is a multiple of that of a cell, and luminances lie on both sides of every cut.
        let (width, height) = (150, 70);
        let mut rng = Rng::new(11);
        let texels: Vec<[f32; 3]> = (0..width * height)
            .map(|i| {
                std::array::from_fn(|_| rng.uniform() * if i % 7000 < 3500 { 1.0 } else { 9.0 })
            })
            .collect();
        let sines: Vec<f64> = (0..height).map(|_| f64::from(rng.uniform())).collect();
        let luminances = Luminances::new(&texels, width, &sines);
        let side = cell_side([width, height]);
        let at = |x: usize, y: usize| luminance(texels[y % height * width + x % width]);
        let mut n_bent = 0;
        for emphasis in [
            Emphasis::NONE,
            Emphasis {
                cut: 0.6,
                least: 0.25,
            },
            Emphasis {
                cut: 0.0,
                least: 0.25,
            },
            Emphasis {
                cut: 100.0,
                least: 0.25,
            },
        ] {
            let emphasised = Emphasised {
                luminances: &luminances,
                emphasis,
            };
            for (top, left) in (0..height)
                .step_by(side)
                .flat_map(|top| (0..width).step_by(side).map(move |left| (top, left)))
            {
                let columns = left..(left + side).min(width);
                let rows = top..(top + side).min(height);
                let mut means = vec![-1.0];
                emphasised.push_patches(columns.clone(), rows.clone(), &mut means);
                let cell = emphasised.of_cell(columns.clone(), rows.clone());
                assert_eq!(cell.n_patches, columns.len() * rows.len());
                assert_eq!(means.len(), 1 + cell.n_patches);
                let (mut sum, mut peak, mut k) = (0.0, 0f64, 1);
                let mut n_bright = 0;
                for (y, x) in rows.flat_map(|y| columns.clone().map(move |x| (y, x))) {
                    let corners = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)]
                        .map(|l| f64::from(emphasis.of(l)));
                    let mean = 0.25 * corners.iter().sum::<f64>() * sines[y];
                    assert!((means[k] - 4.0 * mean).abs() <= 1e-12 * mean);
                    sum += mean;
                    peak = corners.into_iter().fold(peak, |a, b| a.max(b * sines[y]));
                    n_bright += usize::from(emphasis.is_bright(at(x, y)));
                    k += 1;
                }
                n_bent += usize::from(n_bright > 0 && n_bright < cell.n_patches);
                assert!(
                    (cell.sum - sum).abs() <= 1e-6 * sum,
                    "{} for {sum}",
                    cell.sum
                );
                assert!((cell.peak - peak).abs() <= 1e-6 * peak);
            }
        }
        assert!(n_bent > 0);
    }

    #[test]
    fn the_mean_over_the_sphere_counts_rows_by_their_sines() {
        // Rows of texels weigh half of the rows of patches on either side: 2, 3, 1 and 0 here.
        let texels = [
            [1.0, 0.0, 2.0],
            [2.0, 0.0, 2.0],
            [4.0, 3.0, 2.0],
            [90.0, 7.0, 2.0],
        ];
        let luminances = Luminances::new(&texels, 1, &[4.0, 2.0, 0.0, 0.0]);
        assert_eq!(luminances.mean(), Rgb::new(2.0, 0.5, 2.0));
    }
}
