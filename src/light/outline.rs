//! A map in outline: nearly its look-ups, from a table that stays in the caches nearest to the core.
//!
//! A large sky is tens of megabytes, and light samples fall anywhere in it: to fetch its texels takes longer than all
//! else that is done for a sample. Most of a sky is smooth. The outline is bilinear between the corners of square cells;
//! the difference to the map is looked up by chance, the rarer the smaller it can be, and divided by that chance. So the
//! value is right on average, and off each time by 1 to 2 % of itself (root mean square; 9 % at most).

use rayon::iter::{IndexedParallelIterator, IntoParallelIterator, ParallelIterator};

use crate::sampling::rng::{mix_bits, unit_f32};
use crate::spectrum::Rgb;

/// Cells side by side in a map, at most.
const CELLS: usize = 128;
/// Chance of looking up the difference, over the largest difference relative to the outline in the cell.
const CHANCE_PER_SPREAD: f32 = 8.0;
/// Chance above which the map is looked up each time.
const SMOOTH_BELOW: f32 = 0.5;
/// Smallest chance where there is a difference at all.
const LEAST_CHANCE: f32 = 1.0 / 64.0;

/// Corners of cells of a map, and how far the map may be off their bilinear function.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    width: usize,
    height: usize,
    /// Texels along the side of a cell.
    side: usize,
    /// Cells side by side.
    n_columns: usize,
    /// Row by row, one more in each direction than there are cells.
    corners: Vec<[f32; 3]>,
    /// For each cell: the chance of looking up the difference; 1 where the outline is of no use.
    chances: Vec<f32>,
}

/// A value in outline.
#[derive(Clone, Copy, Debug)]
pub(super) enum Outlined {
    /// The value.
    Certain(Rgb),
    /// The map is to be asked: its value is `outline` + (map − `outline`) / `chance`.
    Ask { outline: Rgb, chance: f32 },
}

impl Outline {
    /// Of a map of `width` × `height` non-negative texels that repeats in both directions.
    pub(super) fn new(width: usize, height: usize, texels: &[[f32; 3]]) -> Self {
        let side = width.div_ceil(CELLS);
        let [n_columns, n_rows] = [width, height].map(|n| n.div_ceil(side));
        let line = |y: usize| &texels[y % height * width..][..width];
        let corners = (0..=n_rows)
            .map(|row| line((row * side).min(height)))
            .flat_map(|line| {
                (0..=n_columns).map(move |column| line[(column * side).min(width) % width])
            })
            .collect();
        let mut outline = Self {
            width,
            height,
            side,
            n_columns,
            corners,
            chances: Vec::new(),
        };
        // Between texels both are bilinear: the difference is largest, relative to the outline, at one of them.
        let spread = |places: &mut Vec<f32>, cell: usize| {
            let (column, row) = (cell % n_columns, cell / n_columns);
            let (left, top) = (column * side, row * side);
            let right = (left + side).min(width);
            let corners = outline.corners_of(column, row);
            places.clear();
            places.extend((left..right).flat_map(|x| {
                let [u, _] = outline.place(left, top, (x - left) as f32, 0.0);
                [u; 3]
            }));
            let mut spread = [0.0; LANES];
            for y in top..=(top + side).min(height) {
                let line = line(y);
                let [_, v] = outline.place(left, top, 0.0, (y - top) as f32);
                let ends = across(corners, v).map(Rgb::to_array);
                spread_along(ends, places, line[left..right].as_flattened(), &mut spread);
                spread_along(ends, &[1.0; 3], &line[right % width], &mut spread);
                let is_rough = |off: f32| off * CHANCE_PER_SPREAD > SMOOTH_BELOW;
                if spread.iter().fold(false, |any, &off| any | is_rough(off)) {
                    return 1.0;
                }
            }
            spread.into_iter().fold(0.0, f32::max)
        };
        outline.chances = (0..n_columns * n_rows)
            .into_par_iter()
            .with_min_len(n_columns)
            .map_init(Vec::new, |places, cell| {
                match CHANCE_PER_SPREAD * spread(places, cell) {
                    0.0 => 0.0,
                    chance if chance <= SMOOTH_BELOW => chance.max(LEAST_CHANCE),
                    _ => 1.0,
                }
            })
            .collect();
        outline
    }

    /// Place in a cell, in [0, 1]², of one that is so many texels from its corner.
    #[inline]
    fn place(&self, left: usize, top: usize, x: f32, y: f32) -> [f32; 2] {
        [
            x / self.side.min(self.width - left) as f32,
            y / self.side.min(self.height - top) as f32,
        ]
    }

    /// The upper corners of a cell, then the lower ones.
    #[inline]
    fn corners_of(&self, column: usize, row: usize) -> [[Rgb; 2]; 2] {
        let above = row * (self.n_columns + 1) + column;
        let below = above + self.n_columns + 1;
        [above, below].map(|first| [0, 1].map(|i| Rgb::from_array(self.corners[first + i])))
    }

    /// The value at (`x`, `y`) in [0, 1]² between four texels, of which the first is (`column`, `row`). `bits` decide
    /// whether the map is asked.
    #[inline]
    pub(super) fn value(&self, column: usize, row: usize, [x, y]: [f32; 2], bits: u64) -> Outlined {
        let (cell_column, cell_row) = (column / self.side, row / self.side);
        let chance = self.chances[cell_row * self.n_columns + cell_column];
        if chance >= 1.0 {
            return Outlined::Ask {
                outline: Rgb::BLACK,
                chance,
            };
        }
        let (left, top) = (cell_column * self.side, cell_row * self.side);
        let [u, v] = self.place(
            left,
            top,
            (column - left) as f32 + x,
            (row - top) as f32 + y,
        );
        let [from, to] = across(self.corners_of(cell_column, cell_row), v);
        let outline = from * (1.0 - u) + to * u;
        if unit_f32((mix_bits(bits) >> 32) as u32) < chance {
            Outlined::Ask { outline, chance }
        } else {
            Outlined::Certain(outline)
        }
    }
}

/// The values at height `v` of a cell, at its left and its right edge.
#[inline]
fn across([above, below]: [[Rgb; 2]; 2], v: f32) -> [Rgb; 2] {
    [0, 1].map(|i| above[i] * (1.0 - v) + below[i] * v)
}

/// Samples that are looked at together: those of four texels, so that the same channel is in the same lane again.
const LANES: usize = 12;

/// Raises `spread` to the differences, relative to the line from one of `ends` to the other and at most 1, of samples at
/// `places` in [0, 1] on it. The samples are those of whole texels; each has its place.
fn spread_along(
    [from, to]: [[f32; 3]; 2],
    places: &[f32],
    samples: &[f32],
    spread: &mut [f32; LANES],
) {
    let mut raise = |lane: usize, place: f32, exact: f32| {
        let near = from[lane % 3] * (1.0 - place) + to[lane % 3] * place;
        // Infinite, or no number, where nothing is relative to anything.
        let off = (exact - near).abs() / near;
        let off = if off < 1.0 { off } else { 1.0 };
        let off = if near == exact { 0.0 } else { off };
        spread[lane] = if off > spread[lane] {
            off
        } else {
            spread[lane]
        };
    };
    let (place_chunks, last_places) = places.as_chunks::<LANES>();
    let (sample_chunks, last_samples) = samples.as_chunks::<LANES>();
    for (places, samples) in place_chunks.iter().zip(sample_chunks) {
        for lane in 0..LANES {
            raise(lane, places[lane], samples[lane]);
        }
    }
    for (lane, (&place, &exact)) in last_places.iter().zip(last_samples).enumerate() {
        raise(lane, place, exact);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    const WIDTH: usize = 500;
    const HEIGHT: usize = 260;

    /// A smooth sky with a sun, an edge, and nothing below.
    fn texel(x: usize, y: usize) -> [f32; 3] {
        let (s, t) = (x as f32 / WIDTH as f32, y as f32 / HEIGHT as f32);
        let sky = 1.0 + 0.5 * (s * std::f32::consts::TAU).sin() + t * t;
        match (x, y) {
            (_, 200..) => [0.0; 3],
            (40, 17) => [5000.0, 4000.0, 3000.0],
            (200.., _) => [3.0 * sky, sky, 0.0],
            _ => [sky, 2.0 * sky, 0.5],
        }
    }

    #[test]
    fn values_are_right_on_average_and_nearly_so_each_time() {
        let texels: Vec<_> = (0..WIDTH * HEIGHT)
            .map(|i| texel(i % WIDTH, i / WIDTH))
            .collect();
        let outline = Outline::new(WIDTH, HEIGHT, &texels);
        let mut rng = Rng::new(5);
        let mut n_certain = 0;
        let n = 2000;
        let n_looks = 4000;
        for _ in 0..n {
            let column = (rng.uniform() * WIDTH as f32) as usize;
            let row = (rng.uniform() * HEIGHT as f32) as usize;
            let [x, y] = rng.uniform2();
            let at = |dx: usize, dy: usize| {
                Rgb::from_array(texel((column + dx) % WIDTH, (row + dy) % HEIGHT))
            };
            let exact = (at(0, 0) * (1.0 - x) + at(1, 0) * x) * (1.0 - y)
                + (at(0, 1) * (1.0 - x) + at(1, 1) * x) * y;
            let (mut sum, mut sum2) = (Rgb::BLACK, Rgb::BLACK);
            for _ in 0..n_looks {
                let value = match outline.value(column, row, [x, y], rng.next_u64()) {
                    Outlined::Certain(value) => {
                        n_certain += 1;
                        value
                    }
                    Outlined::Ask { outline, chance } => {
                        outline + (exact - outline) * (1.0 / chance)
                    }
                };
                assert!(value.min_component() >= 0.0, "{value:?}");
                sum += value;
                sum2 += value * value;
            }
            let n = n_looks as f32;
            for channel in 0..3 {
                let (mean, exact) = (sum[channel] / n, exact[channel]);
                let variance = (sum2[channel] / n - mean * mean).max(0.0);
                let off = (mean - exact).abs();
                assert!(
                    off <= 5.0 * (variance / n).sqrt() + 2e-4 * exact,
                    "({column}, {row}): {mean} for {exact}"
                );
                assert!(variance.sqrt() <= 0.09 * exact, "({column}, {row})");
            }
        }
        assert!(n_certain > n * n_looks / 2, "{n_certain}");
    }
}
