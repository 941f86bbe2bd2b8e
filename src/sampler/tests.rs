//! What the points of every kind are like.

use super::*;

const CENTERED: SamplerKind = SamplerKind::Stratified {
    nx: 5,
    ny: 8,
    jitter: false,
};
const KINDS: [SamplerKind; 7] = [
    SamplerKind::ZeroTwo,
    SamplerKind::Sobol,
    SamplerKind::Halton,
    SamplerKind::MaxMinDist { log2: 5 },
    SamplerKind::Stratified {
        nx: 5,
        ny: 8,
        jitter: true,
    },
    CENTERED,
    SamplerKind::Random,
];

fn points(seed: u64, n: u32, skip: u32) -> Vec<[f32; 2]> {
    (0..n)
        .map(|i| {
            let mut sampler = Sampler::new(seed, [3, -4], i);
            for _ in 0..skip {
                sampler.get_1d();
            }
            sampler.get_2d()
        })
        .collect()
}

#[test]
fn sixteen_points_lie_one_in_each_elementary_interval() {
    for seed in 0..50 {
        for skip in [0, 1, 7, 5000] {
            let points = points(seed, 16, skip);
            for log_x in 0..=4 {
                let (nx, ny) = (1 << log_x, 16 >> log_x);
                let mut seen = [false; 16];
                for [x, y] in &points {
                    let cell = (x * nx as f32) as usize * ny + (y * ny as f32) as usize;
                    assert!(!seen[cell], "seed {seed}, skip {skip}, {nx}x{ny}");
                    seen[cell] = true;
                }
            }
        }
    }
}

#[test]
fn depths_are_exponential_and_as_even_as_the_numbers_behind_them() {
    for seed in 0..50 {
        let mut seen = [false; 16];
        for sample in 0..16 {
            let depth = Sampler::new(seed, [3, -4], sample).get_exponential();
            let stratum = (16.0 * (-depth).exp()) as usize;
            assert!(depth > 0.0 && !seen[stratum], "seed {seed}: {depth}");
            seen[stratum] = true;
        }
    }
}

#[test]
fn depths_are_at_least_nothing_and_end_at_45() {
    // The first and the last of the 53-bit numbers, and what is next to them.
    let last = (1u64 << 53) - 1;
    let depth = |fine: u64| exponential_from_bits(fine << 11);
    assert_eq!(depth(last), 0.0);
    assert!((45.0..45.1).contains(&depth(0)) && depth(1) < 36.8);
    // What rounds to a whole: one in 2²⁵.
    let first = (1u64 << 53) - (1 << 28);
    assert!(depth(first) == 0.0 && depth(first - 1) > 0.0);
}

#[test]
fn fine_numbers_refine_the_coarse_ones() {
    for (sample, kind) in (0..1000).zip(KINDS.iter().cycle()) {
        let sampler = Sampler::of_kind(*kind, 3, [5, 6], sample);
        let (coarse, fine) = (sampler.clone().get_1d(), sampler.clone().get_1d_fine());
        assert!((0.0..1.0).contains(&fine));
        let scale = (1 << 24) as f64;
        assert_eq!((fine * scale).floor(), coarse as f64 * scale);
    }
}

#[test]
fn pairs_of_dimensions_are_uncorrelated() {
    // Mean of (x − ½)(x' − ½) between any two of 40 numbers over many pixels: standard error 1/(12 √n).
    const N_NUMBERS: usize = 40;
    let n = 40_000;
    for kind in KINDS {
        let mut sums = [[0.0; N_NUMBERS]; N_NUMBERS];
        for i in 0..n {
            let mut sampler = Sampler::of_kind(kind, 9, [i, i / 7], (i % 37) as u32);
            let mut numbers = Vec::new();
            while numbers.len() < N_NUMBERS {
                numbers.extend(sampler.get_2d());
                numbers.extend([sampler.get_1d(), sampler.get_1d_fine() as f32]);
                numbers.extend(sampler.array(3).get_2d(2));
            }
            let numbers: Vec<f64> = numbers.iter().map(|&x| f64::from(x) - 0.5).collect();
            for a in 0..N_NUMBERS {
                for b in 0..a {
                    sums[a][b] += numbers[a] * numbers[b];
                }
            }
        }
        let bound = 5.0 / (12.0 * f64::from(n).sqrt());
        for (a, b) in (0..N_NUMBERS).flat_map(|a| (0..a).map(move |b| (a, b))) {
            let mean: f64 = sums[a][b] / f64::from(n);
            assert!(mean.abs() < bound, "{kind:?}, {a} and {b}: {mean}");
        }
    }
}

/// Mean of a function of the first samples of one pixel.
fn mean(kind: SamplerKind, seed: u64, n: u32, f: impl Fn(&mut Sampler) -> f64) -> f64 {
    let values = (0..n).map(|i| f(&mut Sampler::of_kind(kind, seed, [3, 4], i)));
    values.sum::<f64>() / f64::from(n)
}

#[test]
fn pairs_fill_the_square_the_longer_they_run() {
    // Every two dimensions that path tracing draws from, jointly: a shared pattern would leave an error for good.
    let draw = |sampler: &mut Sampler, k: usize| {
        let numbers: Vec<f64> = (0..12).map(|_| f64::from(sampler.get_1d())).collect();
        f64::from(numbers[k] < 0.4 && numbers[(k + 5) % 12] < 0.4)
    };
    for kind in KINDS.into_iter().filter(|kind| *kind != CENTERED) {
        for k in 0..12 {
            for seed in 0..3 {
                let n = 1 << 14;
                let area = mean(kind, seed, n, |sampler| draw(sampler, k));
                let sigma = (0.16 * 0.84 / f64::from(n)).sqrt();
                assert!((area - 0.16).abs() < 4.5 * sigma, "{kind:?}, {k}: {area}");
            }
        }
    }
}

#[test]
fn n20_no_kind_runs_out_of_dimensions() {
    for kind in KINDS {
        let mut sum = 0.0;
        let n = 16 * 5000;
        for sample in 0..16 {
            let mut sampler = Sampler::of_kind(kind, 1, [7, 8], sample);
            for _ in 0..4000 {
                sampler.get_2d();
            }
            for _ in 0..5000 {
                let x = sampler.get_1d();
                assert!((0.0..1.0).contains(&x));
                sum += f64::from(x) - 0.5;
            }
        }
        let sigma = (f64::from(n) / 12.0).sqrt();
        assert!(sum.abs() < 4.0 * sigma, "{kind:?}: {sum}");
    }
}

#[test]
fn n21_counts_beyond_any_table_are_fine() {
    for spp in [1, 2, 3, 1 << 17, 1_000_000, 3_000_000_000, u32::MAX] {
        for kind in [
            SamplerKind::max_min_dist(spp),
            SamplerKind::grid(spp, true),
            SamplerKind::Halton,
            SamplerKind::Sobol,
        ] {
            for sample in [0, 1, spp / 2, spp - 1] {
                let mut sampler = Sampler::of_kind(kind, 1, [7, 8], sample);
                let points = [sampler.get_2d(), sampler.array(spp).get_2d(spp - 1)];
                for x in points.as_flattened() {
                    assert!((0.0..1.0).contains(x), "{kind:?}, {sample}: {x}");
                }
            }
        }
    }
}

#[test]
fn every_kind_but_chance_beats_chance() {
    // Variance of the estimate of a smooth integral over the film pair, over seeds.
    let f = |sampler: &mut Sampler| {
        let [x, y] = sampler.get_2d().map(f64::from);
        (3.0 * x).sin() * (2.0 * y + x).cos()
    };
    let variance = |kind: SamplerKind, n: u32| {
        let values: Vec<f64> = (0..400).map(|seed| mean(kind, seed, n, f)).collect();
        let mean = values.iter().sum::<f64>() / 400.0;
        values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 400.0
    };
    for n in [16, 64] {
        let chance = variance(SamplerKind::Random, n);
        for kind in [
            SamplerKind::ZeroTwo,
            SamplerKind::Sobol,
            SamplerKind::Halton,
            SamplerKind::max_min_dist(n),
            SamplerKind::grid(n, true),
        ] {
            let ratio = variance(kind, n) / chance;
            assert!(ratio < 0.25, "{kind:?}, {n} samples: {ratio}");
        }
    }
}

#[test]
fn stratified_points_lie_one_in_each_cell_and_centres_are_centres() {
    for (nx, ny) in [(4, 4), (5, 3), (1, 7)] {
        for jitter in [true, false] {
            let kind = SamplerKind::Stratified { nx, ny, jitter };
            for round in 0..2 {
                let mut seen = vec![0; (nx * ny) as usize];
                let mut seen_1d = seen.clone();
                for i in 0..nx * ny {
                    let sample = round * nx * ny + i;
                    let mut sampler = Sampler::of_kind(kind, 5, [1, 2], sample);
                    let ([x, y], z) = (sampler.get_2d(), sampler.get_1d());
                    let (cx, cy) = ((x * nx as f32) as u32, (y * ny as f32) as u32);
                    seen[(cy * nx + cx) as usize] += 1;
                    seen_1d[(z * (nx * ny) as f32) as usize] += 1;
                    if !jitter {
                        assert!((x * nx as f32 - cx as f32 - 0.5).abs() < 1e-5);
                        assert!((y * ny as f32 - cy as f32 - 0.5).abs() < 1e-5);
                    }
                }
                assert!(seen.iter().chain(&seen_1d).all(|&n| n == 1), "{kind:?}");
            }
        }
    }
}

#[test]
fn arrays_are_stratified_within_each_sample() {
    for kind in KINDS
        .into_iter()
        .filter(|kind| *kind != SamplerKind::Random)
    {
        for sample in 0..20 {
            let points = Sampler::of_kind(kind, 2, [0, 0], sample).array(16);
            let mut seen = [0; 16];
            for i in 0..16 {
                let [x, y] = points.get_2d(i);
                seen[(x * 4.0) as usize * 4 + (y * 4.0) as usize] += 1;
            }
            assert_eq!(seen, [1; 16], "{kind:?}, sample {sample}");
        }
    }
}

#[test]
fn every_sample_is_uniform_over_pixels() {
    // Whatever the sample's index, over pixels it takes every place alike: no pixel's estimate is biased.
    const N: usize = 1 << 17;
    const BINS: usize = 16;
    for kind in KINDS.into_iter().filter(|kind| *kind != CENTERED) {
        for sample in [0, 1, 15, 63] {
            for skip in [0, 2, 9] {
                let mut counts = vec![0f64; BINS * BINS * BINS];
                for pixel in 0..N as i32 {
                    let pixel = [pixel % 512, pixel / 512];
                    let mut sampler = Sampler::of_kind(kind, 0, pixel, sample);
                    for _ in 0..skip {
                        sampler.get_2d();
                    }
                    let ([x, y], z) = (sampler.get_2d(), sampler.get_1d());
                    let bin = |u: f32| (u * BINS as f32) as usize;
                    counts[(bin(x) * BINS + bin(y)) * BINS + bin(z)] += 1.0;
                }
                let expected = N as f64 / counts.len() as f64;
                let chi2: f64 = counts
                    .iter()
                    .map(|c| (c - expected).powi(2) / expected)
                    .sum();
                let freedom = (counts.len() - 1) as f64;
                let z = (chi2 - freedom) / (2.0 * freedom).sqrt();
                assert!(
                    z.abs() < 5.0,
                    "{kind:?}, sample {sample}, dimension {skip}: {z} sigma"
                );
            }
        }
    }
}
