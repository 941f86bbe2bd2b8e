//! Sample points: for every pixel, sample and dimension one number, and nothing else decides it. Scene-file manual
//! (`Sampler`):
//!
//! | plugin | points of a pixel |
//! |---|---|
//! | `02sequence`, `lowdiscrepancy` | a (0,2)-sequence for each number or pair drawn, Owen-scrambled and shuffled |
//! | `sobol` | Sobol' points in 4 dimensions, Owen-scrambled; the next 4 are shuffled anew (Burley 2020) |
//! | `halton` | Halton points in 5 dimensions (film, time, lens), scrambled by digits, then as `02sequence`; as `sobol` if their number is a power of two |
//! | `maxmindist` | the film positions keep the largest distance from each other; the rest as `02sequence` |
//! | `stratified` | one in each cell of a grid, or the centres of the cells with `jitter` off |
//! | `random` | independent |
//!
//! Each is a function of (seed, pixel, sample, dimension), or of the place in one sequence for a whole picture, so that neither crop window nor order matters, and none runs
//! out of samples or dimensions; the parameter `dimensions` has no effect.
//!
//! A [`Sampler`] is a small value on the stack of one path. Knows no film and no scene.

mod halton;
mod max_min_dist;
pub mod owen;
mod sobol;
mod stratified;

use crate::sampling::rng::{Rng, exponential_from_bits, mix_bits, unit_f32};

/// How the points of a pixel are laid out.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum SamplerKind {
    /// Padded pairs: each is a (0,2)-sequence in base 2, Owen-scrambled and shuffled by hashing (Burley 2020, JCGT
    /// 9:4). Any prefix whose length is a power of two is stratified.
    #[default]
    ZeroTwo,
    /// Sobol' points, in blocks of 4 dimensions.
    Sobol,
    /// Halton points in the first 5 dimensions, padded pairs beyond.
    Halton,
    /// The first pair of dimensions is a net of 2^`log2` points that are far from each other, the others are padded.
    MaxMinDist {
        /// At most 16.
        log2: u32,
    },
    /// One point in each cell of a grid; the one-dimensional grid has as many cells.
    Stratified {
        /// Cells along the first dimension of a pair, positive.
        nx: u32,
        /// Cells along the second, positive; `nx` · `ny` is below 2³².
        ny: u32,
        /// A random point of the cell, instead of its centre.
        jitter: bool,
    },
    /// Independent points.
    Random,
}

impl SamplerKind {
    /// Nets of at least `spp` points that are far from each other, as far as there are any.
    pub fn max_min_dist(spp: u32) -> Self {
        let log2 = spp
            .checked_next_power_of_two()
            .map_or(32, u32::trailing_zeros);
        Self::MaxMinDist {
            log2: log2.min(max_min_dist::MAX_LOG2),
        }
    }

    /// A grid of at least `spp` cells, as square as can be.
    pub fn grid(spp: u32, jitter: bool) -> Self {
        let spp = spp.clamp(1, MAX_CELLS);
        let nx = f64::from(spp).sqrt().ceil() as u32;
        Self::Stratified {
            nx,
            ny: spp.div_ceil(nx),
            jitter,
        }
    }
}

/// Most cells of a grid that [`SamplerKind::grid`] makes.
const MAX_CELLS: u32 = 1 << 30;

/// The sample numbers of one path: a function of (seed, pixel, sample, dimension).
#[derive(Clone, Debug)]
pub struct Sampler {
    pixel_key: u64,
    sample: u32,
    /// `sample` with its bits in reverse, as scrambling begins.
    reversed: u32,
    /// Numbers and pairs drawn so far: each is a dimension of its own.
    dimension: u32,
    /// Coordinates of high-dimensional points drawn so far, where the kind has such.
    coordinate: u32,
    kind: SamplerKind,
}

impl Sampler {
    /// The sampler of one sample of the pixel (x, y), of the default kind.
    #[inline]
    pub fn new(seed: u64, pixel: [i32; 2], sample: u32) -> Self {
        Self::of_kind(SamplerKind::default(), seed, pixel, sample)
    }

    /// The sampler of one sample of the pixel (x, y).
    #[inline]
    pub fn of_kind(kind: SamplerKind, seed: u64, pixel: [i32; 2], sample: u32) -> Self {
        let pixel_bits = (pixel[0] as u32 as u64) << 32 | pixel[1] as u32 as u64;
        Self {
            pixel_key: mix_bits(mix_bits(seed ^ 0x6a09_e667_f3bc_c908) ^ pixel_bits),
            sample,
            reversed: sample.reverse_bits(),
            dimension: 0,
            coordinate: 0,
            kind,
        }
    }

    /// The sampler of point `index` of one sequence for a whole picture, for paths that may arrive in any pixel: laid
    /// out by Sobol', but for [`SamplerKind::Random`].
    pub fn of_picture(kind: SamplerKind, seed: u64, index: u64) -> Self {
        let kind = match kind {
            SamplerKind::Random => SamplerKind::Random,
            _ => SamplerKind::Sobol,
        };
        // A sequence has 2³² points: beyond them begins another.
        let turn = (index >> 32) as i32;
        Self::of_kind(kind, seed, [turn, 0], index as u32)
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

    /// The next dimension as an exponential variate of mean 1, in [0, 45.1): rounding makes one in 2²⁵ of them 0.
    #[inline]
    pub fn get_exponential(&mut self) -> f32 {
        let bits = (self.get_1d_fine() * (1u64 << 53) as f64) as u64;
        exponential_from_bits(bits << 11)
    }

    /// The next two dimensions, uniform in [0, 1)².
    #[inline]
    pub fn get_2d(&mut self) -> [f32; 2] {
        let key = self.next_key();
        self.fractions(key).map(unit_f32)
    }

    /// The sample's point of the one-dimensional sequence of a key.
    #[inline]
    fn fraction(&mut self, key: u64) -> u32 {
        if matches!(self.kind, SamplerKind::ZeroTwo) {
            let index = owen::scramble_reversed(self.reversed, key as u32);
            owen::scramble(owen::sobol_0(index), (key >> 32) as u32)
        } else {
            self.fraction_of_others(key)
        }
    }

    /// The sample's point of the two-dimensional sequence of a key.
    #[inline]
    fn fractions(&mut self, key: u64) -> [u32; 2] {
        if matches!(self.kind, SamplerKind::ZeroTwo) {
            self.zero_two(key)
        } else {
            self.fractions_of_others(key)
        }
    }

    #[inline]
    fn zero_two(&self, key: u64) -> [u32; 2] {
        zero_two(self.reversed, key)
    }

    /// Kept out of line, so that what most pictures need stays short.
    #[cold]
    #[inline(never)]
    fn fraction_of_others(&mut self, key: u64) -> u32 {
        match self.kind {
            SamplerKind::Sobol => self.sobol([key])[0],
            SamplerKind::Halton => match self.halton([key]) {
                Some([x]) => x,
                None => self.zero_two(key)[0],
            },
            SamplerKind::Stratified { nx, ny, jitter } => {
                let n = nx * ny;
                let key = mix_bits(key ^ u64::from(self.sample / n));
                let cell = stratified::permuted(self.sample % n, n, key);
                stratified::in_cell(cell, n, self.place_in_cell(key, jitter) as u32)
            }
            SamplerKind::Random => self.hash(key) as u32,
            SamplerKind::ZeroTwo | SamplerKind::MaxMinDist { .. } => self.zero_two(key)[0],
        }
    }

    #[cold]
    #[inline(never)]
    fn fractions_of_others(&mut self, key: u64) -> [u32; 2] {
        let low_high = |bits: u64| [bits as u32, (bits >> 32) as u32];
        let keys = [key, mix_bits(key)];
        match self.kind {
            SamplerKind::Sobol => self.sobol(keys),
            SamplerKind::Halton => self.halton(keys).unwrap_or_else(|| self.zero_two(key)),
            SamplerKind::MaxMinDist { log2 } if self.dimension == 1 => {
                max_min_dist::point(self.sample, log2, key)
            }
            SamplerKind::Stratified { nx, ny, jitter } => {
                let n = nx * ny;
                let key = mix_bits(key ^ u64::from(self.sample / n));
                let cell = stratified::permuted(self.sample % n, n, key);
                let [x, y] = low_high(self.place_in_cell(key, jitter));
                [
                    stratified::in_cell(cell % nx, nx, x),
                    stratified::in_cell(cell / nx, ny, y),
                ]
            }
            SamplerKind::Random => low_high(self.hash(key)),
            SamplerKind::ZeroTwo | SamplerKind::MaxMinDist { .. } => self.zero_two(key),
        }
    }

    /// The next coordinates of a Sobol' point, one for each key; those of one call are of one point.
    fn sobol<const N: usize>(&mut self, keys: [u64; N]) -> [u32; N] {
        const LENGTH: u32 = sobol::N_DIMENSIONS as u32;
        let mut first = self.coordinate;
        if first % LENGTH + N as u32 > LENGTH {
            first = (first / LENGTH).wrapping_add(1).wrapping_mul(LENGTH);
        }
        self.coordinate = first.wrapping_add(N as u32);
        let shuffle = mix_bits(self.pixel_key ^ mix_bits(!u64::from(first / LENGTH))) as u32;
        let index = owen::scramble_reversed(self.reversed, shuffle);
        let mut point = [0; N];
        for (k, (x, key)) in point.iter_mut().zip(keys).enumerate() {
            let coordinate = sobol::coordinate(index, (first % LENGTH) as usize + k);
            *x = owen::scramble(coordinate, (key >> 32) as u32);
        }
        point
    }

    /// The next coordinates of a Halton point, one for each key, as long as there are any.
    fn halton<const N: usize>(&mut self, keys: [u64; N]) -> Option<[u32; N]> {
        let first = self.coordinate as usize;
        let bases = halton::PRIMES.get(first..first + N)?;
        self.coordinate += N as u32;
        Some(std::array::from_fn(|k| {
            halton::scrambled_inverse(self.sample, bases[k], keys[k])
        }))
    }

    /// Two 32-bit fractions that say where in its cell a point is.
    fn place_in_cell(&self, key: u64, jitter: bool) -> u64 {
        const CENTER: u64 = 0x8000_0000_8000_0000;
        if jitter { self.hash(key) } else { CENTER }
    }

    /// Random bits of a key and the sample.
    fn hash(&self, key: u64) -> u64 {
        mix_bits(key ^ mix_bits(u64::from(self.sample) ^ 0xa54f_f53a_5f1d_36f1))
    }

    /// `n` points of each sample in one dimension, one or two numbers each; takes one dimension. Points that are laid
    /// out in cells fill a grid for each sample; otherwise the points of all samples are one sequence, of which each
    /// sample has its own stretch.
    #[inline]
    pub fn array(&mut self, n: u32) -> SampleArray {
        let mut start = self.clone();
        self.dimension = self.dimension.wrapping_add(1);
        let sample = u64::from(start.sample);
        let mut first = sample * u64::from(n);
        start.kind = match start.kind {
            SamplerKind::Stratified { .. } => {
                start.pixel_key ^= mix_bits(sample ^ 0x510e_527f_ade6_82d1);
                first = 0;
                SamplerKind::grid(n, true)
            }
            SamplerKind::Random => SamplerKind::Random,
            // A stretch of several points is no point of a sequence that others share.
            _ => SamplerKind::ZeroTwo,
        };
        let mut array = SampleArray {
            start,
            first,
            key: 0,
        };
        array.key = array.at(0).next_key();
        array
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

/// The point of the (0,2)-sequence of a key whose index, its bits in reverse, is `reversed`.
#[inline]
fn zero_two(reversed: u32, key: u64) -> [u32; 2] {
    let index = owen::scramble_reversed(reversed, key as u32);
    let key = mix_bits(key);
    [
        owen::scramble(owen::sobol_0(index), key as u32),
        owen::scramble(owen::sobol_1(index), (key >> 32) as u32),
    ]
}

/// Several points of one sample in one dimension.
#[derive(Clone, Debug)]
pub struct SampleArray {
    start: Sampler,
    first: u64,
    /// Of the first point and all that share its sequence.
    key: u64,
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
        let index = self.first + u64::from(i);
        let is_in_first_sequence = index >> 32 == self.first >> 32;
        if matches!(self.start.kind, SamplerKind::ZeroTwo) && is_in_first_sequence {
            return zero_two((index as u32).reverse_bits(), self.key).map(unit_f32);
        }
        self.at(i).get_2d()
    }

    #[inline]
    fn at(&self, i: u32) -> Sampler {
        let index = self.first + u64::from(i);
        // A sequence has 2³² points: beyond them begins another.
        let turn = mix_bits(index >> 32);
        Sampler {
            pixel_key: self.start.pixel_key ^ turn,
            sample: index as u32,
            reversed: (index as u32).reverse_bits(),
            ..self.start.clone()
        }
    }
}

#[cfg(test)]
mod tests;
