//! Sample points: for every pixel, sample and dimension one number, and nothing else decides it.
//!
//! A [`Sampler`] is a small value on the stack of one path. Knows no film and no scene.

pub mod owen;

use crate::sampling::rng::{Rng, mix_bits, unit_f32};

/// The sample numbers of one path: a function of (seed, pixel, sample, dimension).
///
/// Dimensions are padded pairs: each pair is a (0,2)-sequence in base 2, Owen-scrambled and shuffled by hashing
/// (Burley 2020, JCGT 9:4). Any prefix whose length is a power of two is stratified; the sequence never ends, in
/// samples up to 2³² or in dimensions.
#[derive(Clone, Debug)]
pub struct Sampler {
    pixel_key: u64,
    sample: u32,
    dimension: u32,
}

impl Sampler {
    /// The sampler of one sample of the pixel (x, y).
    #[inline]
    pub fn new(seed: u64, pixel: [i32; 2], sample: u32) -> Self {
        let pixel_bits = (pixel[0] as u32 as u64) << 32 | pixel[1] as u32 as u64;
        Self {
            pixel_key: mix_bits(mix_bits(seed ^ 0x6a09_e667_f3bc_c908) ^ pixel_bits),
            sample,
            dimension: 0,
        }
    }

    /// The next dimension, uniform in [0, 1).
    #[inline]
    pub fn get_1d(&mut self) -> f32 {
        let key = self.next_key();
        unit_f32(self.fraction(key))
    }

    /// The next dimension, uniform in [0, 1) with 53 bits, for choosing among very many: 24 bits leave the entries of
    /// a table of a million only sixteen places each to be told apart by.
    #[inline]
    pub fn get_1d_fine(&mut self) -> f64 {
        let key = self.next_key();
        // The sequence gives 32 bits; what they leave open is filled up at random.
        let rest = mix_bits(key ^ mix_bits(self.sample as u64)) >> 43;
        let bits = u64::from(self.fraction(key)) << 21 | rest;
        bits as f64 * (0.5 / (1u64 << 52) as f64)
    }

    /// The sample's point of the one-dimensional sequence of a key.
    #[inline]
    fn fraction(&self, key: u64) -> u32 {
        let index = owen::scramble(self.sample, key as u32);
        owen::scramble(owen::sobol_0(index), (key >> 32) as u32)
    }

    /// The next two dimensions, uniform in [0, 1)².
    #[inline]
    pub fn get_2d(&mut self) -> [f32; 2] {
        let key = self.next_key();
        let index = owen::scramble(self.sample, key as u32);
        let key = mix_bits(key);
        [
            unit_f32(owen::scramble(owen::sobol_0(index), key as u32)),
            unit_f32(owen::scramble(owen::sobol_1(index), (key >> 32) as u32)),
        ]
    }

    /// `n` points of each sample in one dimension, one or two numbers each; takes one dimension. Together the points of
    /// all samples are one sequence, of which each sample has its own stretch.
    #[inline]
    pub fn array(&mut self, n: u32) -> SampleArray {
        let start = self.clone();
        self.dimension = self.dimension.wrapping_add(1);
        SampleArray { start, n }
    }

    /// A stream of its own for a loop of unknown length; takes one dimension.
    #[inline]
    pub fn stream(&mut self) -> Rng {
        let key = self.next_key();
        Rng::new(key ^ mix_bits(self.sample as u64 ^ 0xbb67_ae85_84ca_a73b))
    }

    #[inline]
    fn next_key(&mut self) -> u64 {
        self.dimension = self.dimension.wrapping_add(1);
        mix_bits(self.pixel_key ^ (self.dimension as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }
}

/// Several points of one sample in one dimension.
#[derive(Clone, Debug)]
pub struct SampleArray {
    start: Sampler,
    n: u32,
}

impl SampleArray {
    /// A number of point `i`.
    #[inline]
    pub fn get_1d(&self, i: u32) -> f32 {
        self.at(i).get_1d()
    }

    /// Both numbers of point `i`.
    #[inline]
    pub fn get_2d(&self, i: u32) -> [f32; 2] {
        self.at(i).get_2d()
    }

    #[inline]
    fn at(&self, i: u32) -> Sampler {
        let index = u64::from(self.start.sample) * u64::from(self.n) + u64::from(i);
        // A sequence has 2³² points: beyond them begins another.
        let turn = mix_bits(index >> 32);
        Sampler {
            pixel_key: self.start.pixel_key ^ turn,
            sample: index as u32,
            ..self.start.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn fine_numbers_refine_the_coarse_ones() {
        for sample in 0..1000 {
            let sampler = Sampler::new(3, [5, 6], sample);
            let (coarse, fine) = (sampler.clone().get_1d(), sampler.clone().get_1d_fine());
            assert!((0.0..1.0).contains(&fine));
            let scale = (1 << 24) as f64;
            assert_eq!((fine * scale).floor(), coarse as f64 * scale);
        }
    }

    #[test]
    fn pairs_of_dimensions_are_uncorrelated() {
        // Mean of (x − ½)(x' − ½) between dimension pairs over many pixels: standard error 1/(12 √n).
        let n = 200_000;
        let mut sum = [0.0; 2];
        for i in 0..n {
            let mut sampler = Sampler::new(9, [i, i / 7], (i % 16) as u32);
            let (a, b) = (sampler.get_2d(), sampler.get_2d());
            sum[0] += (a[0] as f64 - 0.5) * (b[0] as f64 - 0.5);
            sum[1] += (a[0] as f64 - 0.5) * (a[1] as f64 - 0.5);
        }
        for s in sum {
            assert!(
                (s / n as f64).abs() < 4.0 / (12.0 * (n as f64).sqrt()),
                "{s}"
            );
        }
    }

    #[test]
    fn every_sample_is_uniform_over_pixels() {
        // Whatever the sample's index, over pixels it takes every place alike: no pixel's estimate is biased.
        const N: usize = 1 << 18;
        const BINS: usize = 16;
        for sample in [0, 1, 5, 15, 63] {
            for skip in [0, 2, 9] {
                let mut counts = vec![0f64; BINS * BINS * BINS];
                for pixel in 0..N as i32 {
                    let mut sampler = Sampler::new(0, [pixel % 512, pixel / 512], sample);
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
                    "sample {sample}, dimension {skip}: {z} sigma"
                );
            }
        }
    }
}
