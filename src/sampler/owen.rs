//! Sobol' points in two dimensions and hash-based Owen scrambling.

/// The first Sobol' dimension, the van der Corput sequence, as a 32-bit fraction.
#[inline]
pub fn sobol_0(index: u32) -> u32 {
    index.reverse_bits()
}

/// The second Sobol' dimension as a 32-bit fraction.
///
/// Its generator matrix is Pascal's triangle modulo 2, applied here as a butterfly over the bits: stage s adds
/// each bit to the one 2ˢ places above.
#[inline]
pub fn sobol_1(index: u32) -> u32 {
    let mut v = index.reverse_bits();
    v ^= (v & 0x5555_5555) << 1;
    v ^= (v & 0x3333_3333) << 2;
    v ^= (v & 0x0f0f_0f0f) << 4;
    v ^= (v & 0x00ff_00ff) << 8;
    v ^= (v & 0x0000_ffff) << 16;
    v
}

/// Owen-scrambles a 32-bit fraction: each bit is flipped by a hash of the bits above it.
///
/// Laine and Karras 2011 with the improved constants of Vegdahl 2021, on reversed bits (Burley 2020, JCGT 9:4).
#[inline]
pub fn scramble(v: u32, seed: u32) -> u32 {
    scramble_reversed(v.reverse_bits(), seed)
}

/// The same for a fraction whose bits come in reverse.
#[inline]
pub fn scramble_reversed(mut v: u32, seed: u32) -> u32 {
    v ^= v.wrapping_mul(0x3d20_adea);
    v = v.wrapping_add(seed);
    v = v.wrapping_mul((seed >> 16) | 1);
    v ^= v.wrapping_mul(0x0552_6c56);
    v ^= v.wrapping_mul(0x53a2_2864);
    v.reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_dimension_follows_the_generator_matrix() {
        // Column k of the matrix: v₀ = ½, v_k = v_{k−1} ^ (v_{k−1} >> 1) (primitive polynomial x + 1).
        let mut columns = [1u32 << 31; 32];
        for k in 1..32 {
            columns[k] = columns[k - 1] ^ (columns[k - 1] >> 1);
        }
        for index in (0..1000).chain([u32::MAX, 0x8000_0001, 0xdead_beef]) {
            let expected = (0..32)
                .filter(|k| index >> k & 1 == 1)
                .fold(0, |v, k| v ^ columns[k]);
            assert_eq!(sobol_1(index), expected, "index {index}");
        }
    }

    #[test]
    fn scrambling_keeps_prefixes_together() {
        for seed in [0, 1, 0x1234_5678, u32::MAX] {
            for v in [0u32, 0x8000_0000, 0x1234_5678, 0xffff_ffff] {
                for bits in 1..32 {
                    // Values that agree in the upper `bits` bits still do, and those that differ first there still differ there.
                    let other = v ^ (1 << (31 - bits)) ^ (v >> 3 & ((1 << (31 - bits)) - 1));
                    let diff = scramble(v, seed) ^ scramble(other, seed);
                    assert_eq!(diff.leading_zeros(), bits, "{v:x} {seed:x}");
                }
            }
        }
    }
}
