//! Hashes and a small counter-based generator: randomness as a function of its key.

/// Mixes 64 bits so that every input bit changes every output bit with probability one half
/// (the finaliser of MurmurHash3 with the constants of Stafford's variant 13).
#[inline]
pub fn mix_bits(mut v: u64) -> u64 {
    v ^= v >> 30;
    v = v.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    v ^= v >> 27;
    v = v.wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}

/// The largest f32 below 1.
pub const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON * 0.5;

/// A uniform number in [0, 1) from the upper 24 bits.
#[inline]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// A stream of random numbers that depends only on its key: SplitMix64 (Steele, Lea, Flood 2014).
///
/// For loops of unknown length, such as tracking through a medium, where a low-discrepancy point has no meaning.
#[derive(Clone, Debug)]
pub struct Rng {
    state: u64,
}

impl Rng {
    /// The stream of a key.
    #[inline]
    pub fn new(key: u64) -> Self {
        Self {
            state: mix_bits(key),
        }
    }

    /// 64 random bits.
    #[inline]
    pub fn next_u64(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix_bits(self.state)
    }

    /// 32 random bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        (self.next_u64() >> 32) as u32
    }

    /// Uniform in [0, 1).
    #[inline]
    pub fn uniform(&mut self) -> f32 {
        unit_f32(self.next_u32())
    }

    /// Two uniform numbers in [0, 1).
    #[inline]
    pub fn uniform2(&mut self) -> [f32; 2] {
        let bits = self.next_u64();
        [unit_f32((bits >> 32) as u32), unit_f32(bits as u32)]
    }

    /// Uniform in [0, 1), of 53 bits.
    #[inline]
    pub fn uniform_fine(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (0.5 / (1u64 << 52) as f64)
    }

    /// An exponential variate of mean 1: the optical depth of a free flight, in (0, ∞).
    ///
    /// The uniform number behind it has the full exponent range, so that arbitrarily long flights occur with
    /// their right probability (a 24-bit uniform number ends at 16.6 mean free paths).
    #[inline]
    pub fn exponential(&mut self) -> f32 {
        exponential_from_bits(self.next_u64())
    }
}

/// Maps 64 uniform bits to an exponential variate of mean 1.
#[inline]
pub fn exponential_from_bits(bits: u64) -> f32 {
    // (bits + ½) 2⁻⁶⁴ in (0, 1): as f32 this keeps 24 significant bits down to 2⁻⁶⁵.
    let u = (bits as f32 + 0.5) * (1.0 / 18_446_744_073_709_551_616.0);
    // The rounding of `bits as f32` can reach 1, whose logarithm is 0: a flight of no length.
    -u.ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn n02_exponential_variates_reach_beyond_sixteen_mean_free_paths_and_stay_finite() {
        assert!(exponential_from_bits(0) > 40.0 && exponential_from_bits(0).is_finite());
        assert!(exponential_from_bits(u64::MAX) >= 0.0);
        let mut rng = Rng::new(7);
        let n = 1_000_000;
        let mean = (0..n).map(|_| rng.exponential() as f64).sum::<f64>() / n as f64;
        assert!((mean - 1.0).abs() < 4.0 / (n as f64).sqrt(), "{mean}");
    }

    #[test]
    fn uniform_numbers_stay_below_one() {
        assert_eq!(unit_f32(u32::MAX), ONE_MINUS_EPSILON);
        assert_eq!(unit_f32(0), 0.0);
    }
}
