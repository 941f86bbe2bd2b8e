//! The distribution function of χ².

/// The regularised upper incomplete gamma function Q(a, x), for a > 0 and x > 0: a χ² variable with 2a degrees of
/// freedom exceeds 2x with this probability.
///
/// The power series of P = 1 - Q below the mean, the continued fraction of Q above it (DLMF 8.11.4 and 8.9.2). Both
/// converge in about 10·√a steps near the mean, which is the slowest place.
pub(crate) fn regularized_upper(a: f64, x: f64) -> f64 {
    // x^a e^-x / Γ(a)
    let front = (a * x.ln() - x - libm::lgamma(a)).exp();
    if x < a + 1.0 {
        1.0 - front * lower_series(a, x)
    } else {
        front * upper_fraction(a, x)
    }
}

/// Σ x^n / (a (a+1) … (a+n)).
fn lower_series(a: f64, x: f64) -> f64 {
    let mut term = 1.0 / a;
    let mut sum = term;
    let mut n = a;
    while term > sum * f64::EPSILON {
        n += 1.0;
        term *= x / n;
        sum += term;
    }
    sum
}

/// 1/(x+1-a - 1(1-a)/(x+3-a - 2(2-a)/(x+5-a - …))), by the recurrence of its convergents' ratios (Lentz 1976). All
/// denominators are positive for x ≥ a + 1.
fn upper_fraction(a: f64, x: f64) -> f64 {
    let mut b = x + 1.0 - a;
    let mut c = f64::INFINITY;
    let mut d = 1.0 / b;
    let mut value = d;
    let mut n = 1.0;
    loop {
        let numerator = n * (a - n);
        b += 2.0;
        d = 1.0 / (b + numerator * d);
        c = b + numerator / c;
        let factor = c * d;
        value *= factor;
        n += 1.0;
        if (factor - 1.0).abs() < 4.0 * f64::EPSILON || n > 1e6 {
            return value;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::regularized_upper;
    use crate::assert_close;

    #[test]
    fn one_degree_more_is_a_known_step() {
        // Q(1, x) = e^-x and Q(a + 1, x) = Q(a, x) + x^a e^-x / Γ(a + 1).
        for x in [0.01, 0.5, 1.0, 3.0, 20.0, 60.0] {
            let (mut q, mut step) = ((-x as f64).exp(), (-x as f64).exp());
            for a in 1..=80 {
                assert_close(regularized_upper(f64::from(a), x), q, 1e-10);
                step *= x / f64::from(a);
                q += step;
            }
        }
    }

    #[test]
    fn half_a_degree_is_the_error_function() {
        for x in [1e-3, 0.1, 0.7, 2.0, 10.0, 100.0f64] {
            assert_close(regularized_upper(0.5, x), libm::erfc(x.sqrt()), 1e-10);
        }
    }

    #[test]
    fn many_degrees_of_freedom_approach_the_normal_law() {
        // Wilson and Hilferty 1931.
        for a in [200.0, 243.0, 255.5, 2000.0f64] {
            for sigmas in [-3.0, -0.1, 0.0, 0.1, 3.0] {
                let x = a * (1.0 - 1.0 / (9.0 * a) + sigmas / (9.0 * a).sqrt()).powi(3);
                let normal = 0.5 * libm::erfc(sigmas / std::f64::consts::SQRT_2);
                assert_close(regularized_upper(a, x), normal, 0.02);
            }
        }
    }
}
