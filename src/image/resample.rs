//! Up-sampling to powers of two, the way textures of the scene format expect it.
//!
//! Four taps of a Lanczos-windowed sinc, radius 2 and τ = 2 (pbrt 3e §10.4.3). Up-sampling only: the filter is as wide
//! as the old texels. It rings and blurs a little; published scenes were made with it.

use std::f32::consts::PI;

use rayon::iter::{IndexedParallelIterator, ParallelIterator};
use rayon::slice::{ParallelSlice, ParallelSliceMut};

use crate::image::Image;
use crate::image::mip::Wrap;

const RADIUS: f32 = 2.0;
const TAU: f32 = 2.0;
const N_TAPS: usize = 4;
/// New rows that are made one after the other, from old ones that are widened once for them.
const BAND: usize = 64;

/// The old texels that make one new one.
struct Taps {
    /// Where the first of them would be if the image went on: four that follow one another, wherever they wrap to.
    first: i64,
    /// Index of each old texel; `None` where black lies.
    texels: [Option<usize>; N_TAPS],
    /// Their weights, with sum 1 over all four.
    weights: [f32; N_TAPS],
}

/// Brings every side that is not a power of two up to the next one; samples below 0 become 0.
///
/// An image with two powers of two passes untouched.
pub fn to_powers_of_two(image: Image, wrap: Wrap) -> Image {
    let (width, height) = (
        image.width().next_power_of_two(),
        image.height().next_power_of_two(),
    );
    if (width, height) == (image.width(), image.height()) {
        return image;
    }
    let columns = taps(image.width(), width, wrap);
    let rows = taps(image.height(), height, wrap);
    let data = match image.channels() {
        1 => resampled::<1>(&image, &columns, &rows),
        _ => resampled::<3>(&image, &columns, &rows),
    };
    Image::new(width, height, image.channels(), data).expect("sides and samples agree")
}

/// Samples of new pixels, `N` for each.
fn resampled<const N: usize>(image: &Image, columns: &[Taps], rows: &[Taps]) -> Vec<f32> {
    let (old, _) = image.data().as_chunks::<N>();
    let row_length = columns.len() * N;
    let mut data = vec![0.0; rows.len() * row_length];
    data.par_chunks_mut(BAND * row_length)
        .zip_eq(rows.par_chunks(BAND))
        .for_each(|(band, rows)| {
            // The last few old rows at the new width.
            let mut wide: [(Option<i64>, Vec<f32>); N_TAPS] = Default::default();
            let slot = |place: i64| place.rem_euclid(N_TAPS as i64) as usize;
            for (row, taps) in band.chunks_exact_mut(row_length).zip(rows) {
                for (place, texel) in (taps.first..).zip(taps.texels) {
                    let (kept, wide) = &mut wide[slot(place)];
                    if kept.replace(place) == Some(place) {
                        continue;
                    }
                    match texel {
                        Some(y) => {
                            let old = &old[y * image.width()..][..image.width()];
                            widen::<N>(old, columns, wide);
                        }
                        None => *wide = vec![0.0; row_length],
                    }
                }
                let [a, b, c, d] = [0, 1, 2, 3].map(|tap| &wide[slot(taps.first + tap)].1);
                let [of_a, of_b, of_c, of_d] = taps.weights;
                let old = a.iter().zip(b).zip(c).zip(d);
                for (sample, (((a, b), c), d)) in row.iter_mut().zip(old) {
                    let sum = of_a * a + of_b * b + of_c * c + of_d * d;
                    *sample = sum.max(0.0);
                }
            }
        });
    data
}

/// A row at the new width.
fn widen<const N: usize>(row: &[[f32; N]], columns: &[Taps], wide: &mut Vec<f32>) {
    wide.resize(columns.len() * N, 0.0);
    for (wide, taps) in wide.as_chunks_mut::<N>().0.iter_mut().zip(columns) {
        let mut pixel = [0.0; N];
        for (texel, weight) in taps.texels.iter().zip(taps.weights) {
            let Some(x) = *texel else { continue };
            for (sample, old) in pixel.iter_mut().zip(row[x]) {
                *sample += weight * old;
            }
        }
        *wide = pixel;
    }
}

fn taps(old: usize, new: usize, wrap: Wrap) -> Vec<Taps> {
    let taps_of = |i: usize| {
        let center = (i as f32 + 0.5) * old as f32 / new as f32;
        let first = (center - RADIUS + 0.5).floor();
        let positions: [f32; N_TAPS] = std::array::from_fn(|tap| first + tap as f32);
        let weights = positions.map(|texel| lanczos((texel + 0.5 - center) / RADIUS));
        let sum: f32 = weights.iter().sum();
        Taps {
            first: first as i64,
            texels: positions.map(|texel| wrap.index(texel as i64, old)),
            weights: weights.map(|w| w / sum),
        }
    };
    (0..new).map(taps_of).collect()
}

/// Windowed sinc over [-1, 1].
fn lanczos(x: f32) -> f32 {
    let x = x.abs() * PI;
    if x > PI {
        0.0
    } else if x < 1e-5 * PI {
        // The limit; both quotients lose their digits here.
        1.0
    } else {
        (x * TAU).sin() / (x * TAU) * (x.sin() / x)
    }
}
