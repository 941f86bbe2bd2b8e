//! What a judge says.

/// The outcome of a statistical test.
#[derive(Clone, PartialEq, Debug)]
#[must_use]
pub struct Verdict {
    /// How probable a result at least this extreme is if the hypothesis holds.
    pub p_value: f64,
    /// The hypothesis is rejected below this.
    pub threshold: f64,
    /// What was measured, for a human.
    pub explanation: String,
}

impl Verdict {
    /// A verdict that needs no statistics: something impossible was seen.
    pub(crate) fn impossible(explanation: String) -> Self {
        Self {
            p_value: 0.0,
            threshold: 1.0,
            explanation,
        }
    }

    /// True when the data do not contradict the hypothesis.
    pub fn accepted(&self) -> bool {
        self.p_value >= self.threshold
    }

    /// Panics with the explanation unless accepted.
    #[track_caller]
    pub fn assert_accepted(&self, what: &str) {
        assert!(
            self.accepted(),
            "{what}: {} (p = {:.3e}, rejected below {:.3e})",
            self.explanation,
            self.p_value,
            self.threshold
        );
    }
}

/// The level at which to judge each of `n_tests` so that all pass with probability `1 - alpha` if all are right (Šidák).
pub fn sidak(alpha: f64, n_tests: usize) -> f64 {
    // 1 - (1 - alpha)^(1/n) without cancellation.
    -((-alpha).ln_1p() / n_tests.max(1) as f64).exp_m1()
}
