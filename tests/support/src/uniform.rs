//! Random numbers for tests.

/// A stream of uniform numbers (SplitMix64; Steele, Lea, Flood 2014), the same for the same seed.
#[derive(Clone, Debug)]
pub struct Uniform {
    state: u64,
}

impl Uniform {
    /// A stream of its own for every seed.
    pub fn new(seed: u64) -> Self {
        // Without the mix, the streams of neighbouring seeds would be each other's, shifted.
        Self {
            state: mix(seed.wrapping_add(0x9e37_79b9_7f4a_7c15)),
        }
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.state)
    }

    /// A multiple of 2⁻²⁴ in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// Two of them.
    pub fn unit2(&mut self) -> [f32; 2] {
        [self.unit(), self.unit()]
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
