//! One point in each cell of a grid, in an order of its own for every dimension.

use crate::sampling::rng::mix_bits;

/// A place of a permutation of 0..`n`; over the keys every place is as likely as any other.
pub(super) fn permuted(i: u32, n: u32, key: u64) -> u32 {
    let mask = n.next_power_of_two().wrapping_sub(1);
    let half = 32 - mask.leading_zeros().min(31);
    let shift = half.div_ceil(2);
    let [a, b] = [mix_bits(key), mix_bits(key ^ 0x3c6e_f372_fe94_f82b)];
    // Each step maps the numbers up to `mask` one to one; what lands beyond `n` goes round again.
    let mut v = i;
    loop {
        for bits in [a, b, a >> 32, b >> 32] {
            let bits = bits as u32;
            v ^= bits & mask;
            v = v.wrapping_mul(bits >> 7 | 1) & mask;
            v ^= v >> shift;
        }
        if v < n {
            break;
        }
    }
    let turn = ((mix_bits(a ^ b) >> 32) * u64::from(n)) >> 32;
    ((u64::from(v) + turn) % u64::from(n)) as u32
}

/// A point in cell `cell` of `n`, as a 32-bit fraction; `place` is where in the cell.
pub(super) fn in_cell(cell: u32, n: u32, place: u32) -> u32 {
    let place = u64::from(cell) << 32 | u64::from(place);
    (place / u64::from(n)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn permutations_take_every_place_once_and_alike() {
        for n in [1, 2, 3, 5, 16, 17, 100] {
            let n_keys = 40_000;
            let mut counts = vec![0f64; (n * n) as usize];
            for key in 0..n_keys {
                let mut seen = vec![false; n as usize];
                for i in 0..n {
                    let place = permuted(i, n, key) as usize;
                    assert!(!seen[place], "{i} of {n}, key {key}");
                    seen[place] = true;
                    counts[i as usize * n as usize + place] += 1.0;
                }
            }
            let expected = n_keys as f64 / f64::from(n);
            for count in counts {
                let sigma = expected.sqrt() * (1.0 - 1.0 / f64::from(n)).sqrt();
                assert!(
                    (count - expected).abs() <= 5.5 * sigma,
                    "{n}: {count} of {expected}"
                );
            }
        }
    }

    #[test]
    fn cells_are_where_they_are_said_to_be() {
        for n in [1, 3, 10, 1 << 20] {
            for cell in [0, n / 2, n - 1] {
                for place in [0, 1 << 31, u32::MAX] {
                    let x = f64::from(in_cell(cell, n, place)) / 4_294_967_296.0;
                    let exact =
                        (f64::from(cell) + f64::from(place) / 4_294_967_296.0) / f64::from(n);
                    assert!((x - exact).abs() < 1e-9);
                }
            }
        }
    }
}
