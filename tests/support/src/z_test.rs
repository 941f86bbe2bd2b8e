//! Does a Monte Carlo mean agree with a known value, or with another one?

use libm::erfc;

use crate::Verdict;

/// Standard errors within which two means agree.
pub const SIGMAS: f64 = 4.0;

/// Rounding allowed on top, relative to the expected value: the inner loop computes in f32.
const ROUNDING: f64 = 1e-6;

/// A mean with its uncertainty.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mean {
    /// The mean of the samples.
    pub value: f64,
    /// Its standard error, from the variance of the samples.
    pub standard_error: f64,
}

impl Mean {
    /// The mean of `n_samples` calls of `sample` (at least two).
    pub fn of(n_samples: usize, mut sample: impl FnMut() -> f64) -> Self {
        assert!(n_samples >= 2, "a standard error needs two samples");
        // Welford's recurrence: no difference of large sums.
        let (mut value, mut squares) = (0.0, 0.0);
        for i in 1..=n_samples {
            let x = sample();
            let delta = x - value;
            value += delta / i as f64;
            squares += delta * (x - value);
        }
        let n = n_samples as f64;
        Self {
            value,
            standard_error: (squares / (n - 1.0) / n).sqrt(),
        }
    }

    /// Within four standard errors of a known value?
    pub fn agrees_with(&self, expected: f64) -> Verdict {
        self.agrees_with_mean(&Self {
            value: expected,
            standard_error: 0.0,
        })
    }

    /// Within four standard errors of another mean, the two independent?
    pub fn agrees_with_mean(&self, other: &Self) -> Verdict {
        let error = self.standard_error.hypot(other.standard_error);
        let distance = ((self.value - other.value).abs() - ROUNDING * other.value.abs()).max(0.0);
        let explanation = format!("{} ± {error:.2e} is not {}", self.value, other.value);
        if !(self.value.is_finite() && other.value.is_finite()) {
            return Verdict::impossible(explanation);
        }
        let z = if distance == 0.0 {
            0.0
        } else {
            distance / error
        };
        Verdict {
            p_value: two_sided(z),
            threshold: two_sided(SIGMAS),
            explanation,
        }
    }
}

/// Probability that a normal variable is at least `z` standard deviations from its mean.
pub(crate) fn two_sided(z: f64) -> f64 {
    erfc(z.abs() / std::f64::consts::SQRT_2)
}
