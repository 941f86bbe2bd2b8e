//! Sine and cosine of parts of a turn: what maps of the sphere and warps of the unit square ask for.

/// Sine and cosine of `turns` · 2π, `turns` in [−2, 2], within 1.5·10⁻⁷ of themselves, zeros included: quarters of a turn
/// are taken off without rounding. Polynomials of Cephes' `sinf` and `cosf` (Moshier 1989).
#[inline]
pub fn sin_cos_of_turns(turns: f32) -> (f32, f32) {
    // Adding it rounds to whole numbers, which are then in the last digits.
    const WHOLE: f32 = 12_582_912.0;
    let shifted = 4.0 * turns + WHOLE;
    let quarter = shifted.to_bits();
    let x = (turns - 0.25 * (shifted - WHOLE)) * std::f32::consts::TAU;
    let x2 = x * x;
    let sin = x + x * x2 * (-1.666_665_5e-1 + x2 * (8.332_161e-3 - x2 * 1.951_529_6e-4));
    let cos =
        1.0 - 0.5 * x2 + x2 * x2 * (4.166_664_6e-2 + x2 * (-1.388_731_6e-3 + x2 * 2.443_315_7e-5));
    let (a, b) = if quarter & 1 == 0 {
        (sin, cos)
    } else {
        (cos, sin)
    };
    let sign = |value: f32, quarter: u32| f32::from_bits(value.to_bits() ^ (quarter & 2) << 30);
    (sign(a, quarter), sign(b, quarter.wrapping_add(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_and_cosines_are_those_of_the_whole_turn_to_the_last_digits_at_their_zeros_too() {
        let near_quarters = (-8..=8).flat_map(|quarter| {
            let at = quarter as f32 * 0.25;
            [
                at,
                at.next_up(),
                at.next_down(),
                at + 1e-4,
                at - 1e-4,
                at + 0.125,
            ]
        });
        let between = (-20_000..=20_000).map(|k| k as f32 * 1e-4);
        for turns in near_quarters.chain(between) {
            // Exact at quarters, where products with π are not.
            let quarters = (f64::from(turns) * 4.0).round();
            let x = (f64::from(turns) - quarters * 0.25) * std::f64::consts::TAU;
            let (sin, cos) = x.sin_cos();
            let expected = match (quarters as i64).rem_euclid(4) {
                0 => (sin, cos),
                1 => (cos, -sin),
                2 => (-sin, -cos),
                _ => (-cos, sin),
            };
            let (sin, cos) = sin_cos_of_turns(turns);
            for (ours, exact) in [(sin, expected.0), (cos, expected.1)] {
                let off = (f64::from(ours) - exact).abs();
                let digits = f64::from(f32::MIN_POSITIVE); // Below, there are fewer.
                let bound = 1.5e-7 * exact.abs().max(digits);
                assert!(off <= bound, "{turns}: {ours} for {exact}");
            }
        }
    }
}
