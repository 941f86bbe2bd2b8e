//! Points of a square that keep the largest distance from each other that a (0,m,2)-net in base 2 allows
//! (Grünschloß, Hanika, Schwede and Keller 2008, "(t,m,s)-Nets and Maximized Minimum Distance").
//!
//! Distances are those of a torus, and shifting all points alike on it keeps them.

use crate::sampler::owen;
use crate::sampling::rng::mix_bits;

/// Most points of one net, as a power of two.
pub(super) const MAX_LOG2: u32 = 16;

/// Columns of the generator matrices of the second coordinate, as 16-bit fractions, for nets of 2² points and more:
/// the authors' figures, as pbrt 3rd ed., section 7.6, tabulates them.
static COLUMNS: [&[u16]; 15] = [
    &[0xc000, 0x8000],
    &[0xa000, 0x4000, 0x8000],
    &[0xc000, 0x5000, 0x2000, 0x3000],
    &[0x8800, 0x5800, 0x2000, 0x4000, 0x8000],
    &[0xe000, 0x6000, 0x2800, 0x1000, 0x1800, 0x0400],
    &[0x8200, 0x4400, 0x2c00, 0x1000, 0x2000, 0x4000, 0x8000],
    &[
        0x8000, 0x7000, 0x3000, 0x1400, 0x0800, 0x0c00, 0x0200, 0x0100,
    ],
    &[
        0xc000, 0x4100, 0x2200, 0x1600, 0x0800, 0x1000, 0x2000, 0x4080, 0x8000,
    ],
    &[
        0x8000, 0x4000, 0x2000, 0x1800, 0x0800, 0x1c00, 0x1e00, 0x0300, 0x0080, 0x0040,
    ],
    &[
        0x8000, 0x6040, 0x2080, 0x1100, 0x0b00, 0x0400, 0x0800, 0x1000, 0x2000, 0x4000, 0x0020,
    ],
    &[
        0x8000, 0x4000, 0x2000, 0x1c00, 0x0c00, 0x0500, 0x0200, 0x0300, 0x0080, 0x0040, 0x0020,
        0x0010,
    ],
    &[
        0x8000, 0x4000, 0x3020, 0x1040, 0x0880, 0x0580, 0x0200, 0x0400, 0x0800, 0x1000, 0x2000,
        0x0010, 0x0008,
    ],
    &[
        0x8000, 0x4000, 0x2000, 0x1000, 0x0e00, 0x0600, 0x0280, 0x0100, 0x0180, 0x0040, 0x0020,
        0x0010, 0x0008, 0x0004,
    ],
    &[
        0x8000, 0x4000, 0x2000, 0x1810, 0x0820, 0x0440, 0x02c0, 0x0100, 0x0200, 0x0400, 0x0800,
        0x1000, 0x0008, 0x0004, 0x0002,
    ],
    &[
        0x8000, 0x4000, 0x2000, 0x1000, 0x0800, 0x0700, 0x0300, 0x0140, 0x0080, 0x00c0, 0x0020,
        0x0010, 0x0008, 0x0004, 0x0002, 0x0001,
    ],
];

/// Point `sample` of nets of 2^`log2` points each, one net after the other, shuffled and shifted by `key`.
pub(super) fn point(sample: u32, log2: u32, key: u64) -> [u32; 2] {
    let key = mix_bits(key ^ u64::from(sample >> log2));
    let place = owen::scramble(sample, key as u32) & ((1 << log2) - 1);
    let x = if log2 == 0 { 0 } else { place << (32 - log2) };
    let y = match log2 {
        0 => 0,
        1 => place << 31,
        _ => {
            let columns = COLUMNS[log2 as usize - 2].iter().enumerate();
            let chosen = columns.filter(|(k, _)| place >> k & 1 == 1);
            u32::from(chosen.fold(0, |y, (_, column)| y ^ column)) << 16
        }
    };
    let shift = mix_bits(key);
    [
        x.wrapping_add(shift as u32),
        y.wrapping_add((shift >> 32) as u32),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Least distance on the torus between any two points, in units of 1/√n.
    fn least_distance(points: &[[f64; 2]]) -> f64 {
        let torus = |a: f64, b: f64| {
            let d = (a - b).abs();
            d.min(1.0 - d)
        };
        let mut least = f64::INFINITY;
        for (i, a) in points.iter().enumerate() {
            for b in &points[..i] {
                least = least.min(torus(a[0], b[0]).hypot(torus(a[1], b[1])));
            }
        }
        least * (points.len() as f64).sqrt()
    }

    #[test]
    fn points_keep_their_distance() {
        for log2 in 2..=10 {
            for round in 0..3 {
                let points: Vec<[f64; 2]> = (0..1u32 << log2)
                    .map(|i| point(round << log2 | i, log2, 0x1234_5678_9abc))
                    .map(|p| p.map(|x| f64::from(x) / 4_294_967_296.0))
                    .collect();
                // A Sobol' net of as many points comes down to 0.35 and less.
                let least = least_distance(&points);
                assert!(least > 0.7, "2^{log2} points: {least}");
            }
        }
    }
}
