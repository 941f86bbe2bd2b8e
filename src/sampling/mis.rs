//! Multiple importance sampling of two strategies (Veach 1997, section 9.2).

/// How light that two strategies find is shared between them.
///
/// Both are right for any pair of non-negative densities, infinities included: weights are in [0, 1], and those of the
/// two strategies sum to 1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Heuristic {
    /// In proportion to the densities: for strategies that are each good at a part of the light, such as the sky's
    /// bright parts and a surface that sees all of it.
    Balance,
    /// In proportion to their squares: for strategies of which one alone often does, such as a small lamp or a
    /// surface that nearly mirrors.
    Power,
}

impl Heuristic {
    /// Weight of a sample drawn with density `pdf_a` where the other strategy has density `pdf_b`.
    #[inline]
    pub fn weight(self, pdf_a: f32, pdf_b: f32) -> f32 {
        let term = |ratio: f32| match self {
            Self::Balance => ratio,
            Self::Power => ratio * ratio,
        };
        // The larger density is divided out before squaring.
        if pdf_a > pdf_b {
            1.0 / (1.0 + term(pdf_b / pdf_a)) // ∞ in `pdf_a` alone gives 0.
        } else if pdf_a < pdf_b {
            let term = term(pdf_a / pdf_b);
            term / (1.0 + term)
        } else if pdf_a > 0.0 {
            0.5
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn n06_weights_sum_to_one_for_any_pair_of_densities() {
        let densities = [1e-45, 1e-30, 0.5, 1.0, 3.0, 1e19, 3e38, f32::INFINITY];
        for heuristic in [Heuristic::Balance, Heuristic::Power] {
            for a in densities {
                for b in densities {
                    let (wa, wb) = (heuristic.weight(a, b), heuristic.weight(b, a));
                    assert!((0.0..=1.0).contains(&wa), "{a} {b}");
                    assert!((wa + wb - 1.0).abs() < 1e-6, "{a} {b}: {wa} + {wb}");
                }
                assert_eq!(heuristic.weight(a, 0.0), 1.0);
                assert_eq!(heuristic.weight(0.0, a), 0.0);
            }
        }
    }

    #[test]
    fn balance_goes_by_densities_and_power_by_their_squares() {
        assert_eq!(Heuristic::Balance.weight(3.0, 1.0), 0.75);
        assert_eq!(Heuristic::Power.weight(3.0, 1.0), 0.9);
        assert_eq!(Heuristic::Balance.weight(1e30, 3e30), 0.25);
        assert_eq!(Heuristic::Power.weight(1e30, 3e30), 0.1);
    }
}
