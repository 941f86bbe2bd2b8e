//! Henyey–Greenstein phase function.

use std::f32::consts::PI;

use crate::math::{Frame, Vec3, sin_cos_of_turns};

/// Henyey and Greenstein 1941. `g` is the mean cosine between the directions of travel before and after; positive
/// scatters forward. In [−1, 1], where ±1 goes straight on or straight back.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct HenyeyGreenstein {
    /// Mean cosine.
    pub g: f32,
}

impl HenyeyGreenstein {
    /// Whether it is a delta: every path goes straight on, or straight back.
    #[inline]
    pub fn is_delta(&self) -> bool {
        self.g.abs() >= 1.0
    }

    /// Density in sr⁻¹ of scattering toward `wi` seen from `wo`; its integral over the sphere is 1. Not for a delta.
    #[inline]
    pub fn p(&self, wo: Vec3, wi: Vec3) -> f32 {
        // 1 + g² − 2 g cos, cos = −wo·wi, in a form that cancels nowhere: (1 − a)² + 2 a (1 − cos toward the peak).
        let a = self.g.abs();
        let peak = if self.g < 0.0 { wo } else { -wo };
        let one_minus_cos = 0.5 * (peak - wi).length_squared();
        self.density(a, one_minus_cos)
    }

    #[inline]
    fn density(&self, a: f32, one_minus_cos: f32) -> f32 {
        let d = (1.0 - a) * (1.0 - a) + 2.0 * a * one_minus_cos;
        (1.0 - a) * (1.0 + a) / (4.0 * PI * d * d.sqrt())
    }

    /// Draws `wi` with density [`HenyeyGreenstein::p`], which it returns with it. For a delta the density is 0.
    ///
    /// The inversion is factored so that neither g → 0 nor |g| → 1 loses digits:
    /// 1 − cos = 2u (1−a)² (1 + a(1−u)) / ((1−a) + 2a(1−u))², a = |g|.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2]) -> (Vec3, f32) {
        let a = self.g.abs();
        let peak = if self.g < 0.0 { wo } else { -wo };
        if self.is_delta() {
            return (peak, 0.0);
        }
        let rest = 1.0 - u[0];
        let ratio = (1.0 - a) / ((1.0 - a) + 2.0 * a * rest);
        let one_minus_cos = (2.0 * u[0] * ratio * ratio * (1.0 + a * rest)).min(2.0);
        let sin = (one_minus_cos * (2.0 - one_minus_cos)).sqrt();
        let (sin_phi, cos_phi) = sin_cos_of_turns(u[1]);
        let frame = Frame::from_z(peak);
        let wi =
            frame.s * (sin * cos_phi) + frame.t * (sin * sin_phi) + peak * (1.0 - one_minus_cos);
        (wi.normalize(), self.density(a, one_minus_cos))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::rng::Rng;

    #[test]
    fn n27_n28_mean_cosine_is_g_from_isotropic_to_the_peak() {
        let wo = Vec3::new(0.6, 0.0, 0.8);
        let limits = [1e-4, 1e-3, 1e-2, 0.5, 0.9, 0.99999, 1.0 - 1e-7];
        for g in limits.into_iter().flat_map(|g| [g, -g]).chain([0.0]) {
            let phase = HenyeyGreenstein { g };
            let mut rng = Rng::new(3);
            let n = 200_000;
            let (mut sum, mut sum2) = (0f64, 0f64);
            for _ in 0..n {
                let (wi, pdf) = phase.sample(wo, rng.uniform2());
                assert!(
                    (wi.length() - 1.0).abs() < 1e-5 && pdf.is_finite() && pdf > 0.0,
                    "g {g}"
                );
                let cos = -wo.dot(wi) as f64;
                sum += cos;
                sum2 += cos * cos;
            }
            let mean = sum / n as f64;
            let sigma = ((sum2 / n as f64 - mean * mean).max(0.0) / n as f64).sqrt();
            assert!(
                (mean - g as f64).abs() < 4.0 * sigma + 1e-6,
                "g {g}: mean {mean} ± {sigma}"
            );
        }
    }

    #[test]
    fn n28_density_of_a_sample_is_the_density_of_its_direction() {
        let wo = Vec3::new(0.0, -1.0, 0.0);
        let mut rng = Rng::new(4);
        for g in [0.0, 1e-4, 1e-3 + 1e-6, -0.3, 0.9, -0.95] {
            let phase = HenyeyGreenstein { g };
            for _ in 0..1000 {
                let (wi, pdf) = phase.sample(wo, rng.uniform2());
                assert!(
                    (phase.p(wo, wi) / pdf - 1.0).abs() < 2e-4,
                    "g {g}: {} {pdf}",
                    phase.p(wo, wi)
                );
            }
        }
    }

    #[test]
    fn n27_unit_g_goes_straight_on_or_straight_back() {
        let wo = Vec3::new(0.0, 0.0, 1.0);
        assert_eq!(HenyeyGreenstein { g: 1.0 }.sample(wo, [0.9, 0.3]).0, -wo);
        assert_eq!(HenyeyGreenstein { g: -1.0 }.sample(wo, [0.9, 0.3]).0, wo);
    }
}
