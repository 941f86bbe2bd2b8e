//! The density of light sampling in pbrt-v3 toward a sky. No direction is sampled with it here: MIS weights depend on it
//! where they change the picture (see [`crate::world::skies`]).
//!
//! It is constant in cells, two by two for each texel, in proportion to the luminance that a filtered look-up finds in the
//! middle of the cell, times the sine of the polar angle there.

use std::f32::consts::{PI, TAU};

use glam::Vec2;
use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};
use rayon::slice::ParallelSlice;

use crate::image::Image;
use crate::image::mip::{MipMap, Wrap};
use crate::light::placed_map::Placement;
use crate::math::Vec3;

/// A density of directions toward a sky.
#[derive(Clone, Debug)]
pub(super) struct PbrtDensity {
    placement: Placement,
    /// `None` for a sky that is even.
    cells: Option<Cells>,
}

#[derive(Clone, Debug)]
struct Cells {
    luminances: MipMap,
    n: [usize; 2],
    /// Side of the filter.
    width: f32,
    /// Over the mean of all cells.
    scale: f32,
}

impl PbrtDensity {
    /// For an even sky.
    pub(super) fn even(placement: Placement) -> Self {
        Self {
            placement,
            cells: None,
        }
    }

    /// For a map with these luminances, grey, of powers of two and not black everywhere, top row first.
    pub(super) fn of_map(luminances: Image, placement: Placement) -> Self {
        let n = [2 * luminances.width(), 2 * luminances.height()];
        let row_means = row_means(&luminances);
        let mut cells = Cells {
            luminances: MipMap::new(luminances, Wrap::Repeat),
            n,
            width: 0.5 / n[0].min(n[1]) as f32,
            scale: 1.0,
        };
        // A filter of half a cell reaches the second level of maps alone that are four times as long as wide.
        let mean = if n[0].max(n[1]) < 4 * n[0].min(n[1]) {
            mean_of_rows(&row_means)
        } else {
            cells.mean()
        };
        cells.scale = (1.0 / mean) as f32;
        Self {
            placement,
            cells: Some(cells),
        }
    }

    /// In sr⁻¹, of the unit direction `w` of render space.
    pub(super) fn pdf_w(&self, w: Vec3) -> f32 {
        let in_light = self.placement.light_direction(w);
        let sin_theta = (in_light.x * in_light.x + in_light.y * in_light.y).sqrt();
        if sin_theta == 0.0 {
            return 0.0;
        }
        let in_square = match &self.cells {
            None => 1.0,
            Some(cells) => {
                let turn = in_light.y.atan2(in_light.x) / TAU;
                let s = if turn < 0.0 { turn + 1.0 } else { turn };
                let t = sin_theta.atan2(in_light.z) / PI;
                let place = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
                let [columns, rows] = cells.n;
                cells.value(place(s, columns), place(t, rows)) * cells.scale
            }
        };
        in_square * self.placement.jacobian(in_light) / (TAU * PI * sin_theta)
    }
}

/// The mean of each row.
fn row_means(luminances: &Image) -> Vec<f64> {
    let width = luminances.width();
    let rows = luminances.data().par_chunks(width);
    rows.map(|row| row.iter().map(|&l| f64::from(l)).sum::<f64>() / width as f64)
        .collect()
}

/// Mean of all cells by those of the rows of texels, between which cells are interpolated: along a row, each texel counts
/// as much as any.
fn mean_of_rows(rows: &[f64]) -> f64 {
    let n = rows.len();
    let sum: f64 = (0..2 * n)
        .map(|row| {
            let (near, other) = (row / 2, if row % 2 == 0 { n - 1 } else { 1 });
            let value = 0.75 * rows[near] + 0.25 * rows[(near + other) % n];
            let theta = std::f64::consts::PI * (row as f64 + 0.5) / (2 * n) as f64;
            value * theta.sin()
        })
        .sum();
    sum / (2 * n) as f64
}

impl Cells {
    /// Mean of all.
    fn mean(&self) -> f64 {
        let [columns, rows] = self.n;
        let of_row = |row| {
            (0..columns)
                .map(|column| f64::from(self.value(column, row)))
                .sum::<f64>()
        };
        let mut sums = Vec::new();
        (0..rows)
            .into_par_iter()
            .map(of_row)
            .collect_into_vec(&mut sums);
        sums.iter().sum::<f64>() / (columns * rows) as f64
    }

    fn value(&self, column: usize, row: usize) -> f32 {
        let middle = |i: usize, n: usize| (i as f32 + 0.5) / n as f32;
        let st = Vec2::new(middle(column, self.n[0]), middle(row, self.n[1]));
        self.luminances.trilinear::<f32>(st, self.width) * (PI * st.y).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    #[test]
    fn it_is_what_the_cells_say_over_the_sine() {
        let placement = Placement::new(DMat3::IDENTITY);
        // A map of two by one texels: in the cells' middles, a quarter of the neighbour is mixed in.
        let map = Image::new(2, 1, 1, vec![1.0, 5.0]).expect("a picture");
        let density = PbrtDensity::of_map(map, placement.clone());
        let at = |turn: f32, theta: f32| {
            let (sin, cos) = (TAU * turn).sin_cos();
            Vec3::new(theta.sin() * cos, theta.sin() * sin, theta.cos())
        };
        for (turn, cell) in [(0.1, 2.0), (0.3, 2.0), (0.6, 4.0), (0.9, 4.0)] {
            for theta in [0.2f32, 1.3, 2.0] {
                let expected = cell / 3.0 / (2.0 * PI * PI * theta.sin());
                let found = density.pdf_w(at(turn, theta));
                assert!(
                    (found / expected - 1.0).abs() < 1e-5,
                    "{turn} {theta}: {found}"
                );
            }
        }
        let even = PbrtDensity::even(placement).pdf_w(at(0.7, 0.5));
        assert!((even * (2.0 * PI * PI * 0.5f32.sin()) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn means_by_rows_and_by_cells_are_the_same() {
        for size in [[1, 1], [2, 1], [1, 2], [4, 4], [16, 8], [8, 16]] {
            let n = size[0] * size[1];
            let texels = (0..n).map(|i| ((i * 37 + 5) % 11) as f32).collect();
            let map = Image::new(size[0], size[1], 1, texels).expect("a picture");
            let by_rows = mean_of_rows(&row_means(&map));
            let density = PbrtDensity::of_map(map, Placement::new(DMat3::IDENTITY));
            let by_cells = density.cells.expect("cells").mean();
            assert!(
                (by_rows / by_cells - 1.0).abs() < 1e-6,
                "{size:?}: {by_rows}, {by_cells}"
            );
        }
    }

    #[test]
    fn it_integrates_to_one() {
        let texels = (0..64 * 2).map(|i| ((i * 37) % 11) as f32).collect();
        // So wide that the filter blurs it.
        let map = Image::new(64, 2, 1, texels).expect("a picture");
        let turned = DMat3::from_rotation_x(0.7) * 3.0;
        let density = PbrtDensity::of_map(map, Placement::new(turned));
        let n = 1200u32;
        let middle = |i: u32| (i as f32 + 0.5) / n as f32;
        let mut sum = 0.0;
        for i in 0..n {
            for j in 0..n {
                let z = 2.0 * middle(i) - 1.0;
                let (sin, cos) = (TAU * middle(j)).sin_cos();
                let r = (1.0 - z * z).sqrt();
                sum += f64::from(density.pdf_w(Vec3::new(r * cos, r * sin, z)));
            }
        }
        let mean = sum / f64::from(n * n) * 4.0 * std::f64::consts::PI;
        assert!((mean - 1.0).abs() < 0.01, "{mean}");
    }
}
