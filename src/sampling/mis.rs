//! Multiple importance sampling of two strategies (Veach 1997, section 9.2).

/// Weight of a sample drawn with density `pdf_a` where the other strategy has density `pdf_b`, by the power
/// heuristic with exponent 2. In [0, 1] for any pair of non-negative densities, infinities included, and the
/// weights of the two strategies sum to 1: the larger density is divided out before squaring.
#[inline]
pub fn power_heuristic(pdf_a: f32, pdf_b: f32) -> f32 {
    if pdf_a > pdf_b {
        let r = pdf_b / pdf_a; // ∞ in `pdf_a` alone gives 0.
        1.0 / (1.0 + r * r)
    } else if pdf_a < pdf_b {
        let r = pdf_a / pdf_b;
        r * r / (1.0 + r * r)
    } else if pdf_a > 0.0 {
        0.5
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn n06_weights_sum_to_one_for_any_pair_of_densities() {
        let densities = [1e-45, 1e-30, 0.5, 1.0, 3.0, 1e19, 3e38, f32::INFINITY];
        for a in densities {
            for b in densities {
                let (wa, wb) = (power_heuristic(a, b), power_heuristic(b, a));
                assert!((0.0..=1.0).contains(&wa), "{a} {b}");
                assert!((wa + wb - 1.0).abs() < 1e-6, "{a} {b}: {wa} + {wb}");
            }
            assert_eq!(power_heuristic(a, 0.0), 1.0);
            assert_eq!(power_heuristic(0.0, a), 0.0);
        }
    }
}
