//! Halton points: radical inverses in prime bases, scrambled digit by digit.

use crate::sampling::rng::mix_bits;

/// Bases, one for each dimension: those of film, time and lens. Points in larger bases need hundreds of samples before
/// two dimensions of them are any better than chance.
pub(super) const PRIMES: [u32; 5] = [2, 3, 5, 7, 11];

/// Intervals this small hold one point at most until there are that many points.
const FINEST: f64 = 1.0 / 65536.0;

/// The radical inverse of `index` in a prime base, as a 32-bit fraction. Each digit is mapped to a·digit + b modulo the
/// base, where a > 0 and b are a hash of `key` and of the digits before: a nested scrambling as good as Owen's
/// (Matoušek 1998, "On the L₂-discrepancy for anchored boxes").
pub(super) fn scrambled_inverse(index: u32, base: u32, key: u64) -> u32 {
    let step = 1.0 / f64::from(base);
    let (mut rest, mut prefix) = (index, key);
    let (mut value, mut scale) = (0.0, 1.0);
    while rest > 0 || scale > FINEST {
        let digit = rest % base;
        rest /= base;
        let hash = mix_bits(prefix);
        let below = |bits: u64, n: u32| (((bits & 0xffff_ffff) * u64::from(n)) >> 32) as u32;
        let (a, b) = (1 + below(hash, base - 1), below(hash >> 32, base));
        scale *= step;
        value += f64::from((a * digit + b) % base) * scale;
        prefix = hash ^ u64::from(digit + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }
    // What remains is below all digits that tell points apart.
    let remainder = mix_bits(prefix) as u32;
    let value = (value + scale * f64::from(remainder) / 4_294_967_296.0) * 4_294_967_296.0;
    // Rounding may reach 1; the cast stays below.
    value as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_one_in_each_interval_of_the_base() {
        for base in PRIMES {
            for n in [base, base * base] {
                for key in 0..20 {
                    let mut seen = vec![false; n as usize];
                    for index in 0..n {
                        let x = f64::from(scrambled_inverse(index, base, key)) / 4_294_967_296.0;
                        let cell = (x * f64::from(n)) as usize;
                        assert!(!seen[cell], "base {base}, key {key}, point {index} of {n}");
                        seen[cell] = true;
                    }
                }
            }
        }
    }
}
