//! How the error falls with the number of samples: the slope of the log-log line, and a floor that no sample removes.

use serde::Serialize;

/// A floor counts as one if more samples than the greatest number taken would leave this share of the error.
const FLOOR_SHARE: f64 = 0.2;
/// The same where there are too few runs to tell how certain the floor is.
const UNCERTAIN_FLOOR_SHARE: f64 = 0.5;
/// Standard errors by which a floor has to be above 0.
const SIGNIFICANCE: f64 = 3.0;

/// What a run is off by.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Point {
    /// Samples per pixel.
    pub(super) spp: u32,
    /// From the reference.
    pub(super) mse: f64,
    /// From what other seeds make, if there was one before.
    pub(super) variance: Option<f64>,
}

/// A number and how far it may be off.
#[derive(Serialize, Clone, Copy, PartialEq, Debug)]
pub(super) struct Estimate {
    pub(super) value: f64,
    /// One standard error; `None` if there are no more points than parameters.
    pub(super) standard_error: Option<f64>,
}

/// What the runs of one renderer on one scene say about its convergence.
#[derive(Serialize, Clone, Copy, PartialEq, Debug)]
pub(super) struct Convergence {
    /// Of ln MSE over ln spp. Independent samples of the right picture have -1, stratified ones less.
    pub(super) slope: Estimate,
    /// The same of the variance between seeds, which the noise of the reference does not flatten; `None` without seeds.
    pub(super) slope_of_variance: Option<Estimate>,
    /// `b` of MSE = a / spp + b.
    pub(super) floor: Estimate,
    /// Part of the error at the greatest number of samples that is the floor: the curve's slope there is this less 1.
    pub(super) floor_share: f64,
    pub(super) verdict: Verdict,
}

/// Whether more samples make the picture right.
#[derive(Serialize, Clone, Copy, PartialEq, Eq, Debug)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Verdict {
    /// No floor is seen.
    Converges,
    /// A floor is seen, and the reference's stated noise is as large.
    ReferenceNoise,
    /// A floor is seen: the renderer converges to another picture than the reference.
    Flattens,
}

/// A line through points, by least squares.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Line {
    intercept: f64,
    slope: Estimate,
}

impl Convergence {
    /// From the runs at two sample counts or more; `None` if there are fewer, or an error of 0, which has no logarithm.
    pub(super) fn of(points: &[Point], reference_noise: Option<f64>) -> Option<Self> {
        if points.iter().any(|point| !(point.mse > 0.0)) {
            return None;
        }
        let slope = |value: fn(&Point) -> Option<f64>| {
            let logarithms = points
                .iter()
                .filter_map(|point| Some((f64::from(point.spp).ln(), value(point)?.ln())));
            Some(Line::through(logarithms)?.slope)
        };
        // The noise of MSE is proportional to it, hence to 1 / spp: that of spp · MSE = a + b · spp is the same at all
        // counts, as least squares wants it.
        let products = points
            .iter()
            .map(|point| (f64::from(point.spp), f64::from(point.spp) * point.mse));
        let line = Line::through(products)?;
        let floor = line.slope;
        let most = points.iter().map(|point| point.spp).max()?;
        let at_most = line.intercept / f64::from(most) + floor.value;
        let floor_share = floor.value / at_most;
        Some(Self {
            slope: slope(|point| Some(point.mse))?,
            slope_of_variance: slope(|point| point.variance),
            floor,
            floor_share,
            verdict: verdict(floor, floor_share, reference_noise),
        })
    }
}

fn verdict(floor: Estimate, share: f64, reference_noise: Option<f64>) -> Verdict {
    let is_seen = match floor.standard_error {
        Some(error) => share > FLOOR_SHARE && floor.value > SIGNIFICANCE * error,
        None => share > UNCERTAIN_FLOOR_SHARE,
    };
    if !is_seen {
        return Verdict::Converges;
    }
    let least = floor.value - SIGNIFICANCE * floor.standard_error.unwrap_or(0.0);
    if reference_noise.is_some_and(|noise| least <= noise) {
        Verdict::ReferenceNoise
    } else {
        Verdict::Flattens
    }
}

impl Line {
    /// `None` unless there are two different abscissas.
    fn through(points: impl Iterator<Item = (f64, f64)> + Clone) -> Option<Self> {
        let n = points.clone().count() as f64;
        let mean = |f: fn((f64, f64)) -> f64| points.clone().map(f).sum::<f64>() / n;
        let (mean_x, mean_y) = (mean(|(x, _)| x), mean(|(_, y)| y));
        let (mut xx, mut xy) = (0.0, 0.0);
        for (x, y) in points.clone() {
            xx += (x - mean_x) * (x - mean_x);
            xy += (x - mean_x) * (y - mean_y);
        }
        if !(xx > 0.0) {
            return None;
        }
        let slope = xy / xx;
        let residual = |(x, y): (f64, f64)| y - mean_y - slope * (x - mean_x);
        let squares: f64 = points.map(|point| residual(point).powi(2)).sum();
        let freedom = n - 2.0;
        Some(Self {
            intercept: mean_y - slope * mean_x,
            slope: Estimate {
                value: slope,
                standard_error: (freedom > 0.0).then(|| (squares / freedom / xx).sqrt()),
            },
        })
    }
}

/// The mean. `None` of nothing.
pub(super) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut n) = (0.0, 0.0);
    for value in values {
        sum += value;
        n += 1.0;
    }
    (n > 0.0).then(|| sum / n)
}

/// The geometric mean of numbers above 0. `None` of nothing.
pub(super) fn geometric_mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    mean(values.into_iter().map(f64::ln)).map(f64::exp)
}

/// The median, of an even number the mean of the middle two: what a busy machine spoils least. `None` of nothing.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let (low, high) = (values.get(n.checked_sub(1)? / 2)?, values.get(n / 2)?);
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::{Convergence, Line, Point, Verdict, geometric_mean, mean, median};

    const SPP: [u32; 4] = [4, 16, 64, 256];

    fn points(mse: impl Fn(f64) -> f64) -> Vec<Point> {
        let point = |&spp: &u32| Point {
            spp,
            mse: mse(spp.into()),
            variance: None,
        };
        SPP.iter().map(point).collect()
    }

    /// Two runs at each count, with errors off by a factor up and down.
    fn noisy(mse: impl Fn(f64) -> f64, factor: f64) -> Vec<Point> {
        let mut all = points(|n| mse(n) * factor);
        all.extend(points(|n| mse(n) / factor));
        all
    }

    #[track_caller]
    fn assert_near(actual: f64, expected: f64) {
        let error = (actual - expected).abs();
        assert!(
            error <= 1e-12 * expected.abs().max(1.0),
            "{actual} is not {expected}"
        );
    }

    #[test]
    fn a_line_is_recovered_with_its_error() {
        // y = 3 - 2x with residuals +1, -2, +1: their sum of squares is 6, that of the abscissas 2, one is free.
        let line = Line::through([(0.0, 4.0), (1.0, -1.0), (2.0, 0.0)].into_iter());
        let line = line.expect("three abscissas");
        assert_near(line.intercept, 3.0);
        assert_near(line.slope.value, -2.0);
        assert_near(
            line.slope.standard_error.expect("one degree of freedom"),
            3f64.sqrt(),
        );
        assert_eq!(Line::through([(1.0, 1.0), (1.0, 2.0)].into_iter()), None);
        assert_eq!(Line::through(std::iter::empty()), None);
    }

    #[test]
    fn errors_in_proportion_to_a_power_have_its_slope() {
        for exponent in [-1.0, -1.5, -0.5] {
            let fit = Convergence::of(&points(|n| 0.3 * n.powf(exponent)), None);
            assert_near(fit.expect("four counts").slope.value, exponent);
        }
        let unbiased = Convergence::of(&noisy(|n| 0.3 / n, 1.1), None).expect("four counts");
        assert_near(unbiased.slope.value, -1.0);
        assert_eq!(unbiased.verdict, Verdict::Converges);
    }

    #[test]
    fn the_slope_of_the_variance_knows_no_floor() {
        let mut runs = points(|n| 0.3 / n + 0.01);
        let fit = Convergence::of(&runs, None).expect("four counts");
        assert_eq!(fit.slope_of_variance, None);
        for run in &mut runs[1..] {
            run.variance = Some(0.3 / f64::from(run.spp));
        }
        let fit = Convergence::of(&runs, None).expect("four counts");
        assert_near(fit.slope_of_variance.expect("three counts").value, -1.0);
        assert!(fit.slope.value > -0.9, "{fit:?}");
    }

    #[test]
    fn a_floor_is_recovered_and_seen() {
        let fit = Convergence::of(&noisy(|n| 0.3 / n + 0.01, 1.02), None).expect("four counts");
        assert!((fit.floor.value / 0.01 - 1.0).abs() < 0.01, "{fit:?}");
        // 0.3 / 256 is little beside 0.01.
        assert!((fit.floor_share - 0.895).abs() < 0.01, "{fit:?}");
        assert!(fit.slope.value > -0.9, "{fit:?}");
        assert_eq!(fit.verdict, Verdict::Flattens);
        let exact = Convergence::of(&points(|n| 0.3 / n + 0.01), None).expect("four counts");
        assert_near(exact.floor.value, 0.01);
    }

    #[test]
    fn a_floor_as_large_as_the_stated_noise_is_explained_by_it() {
        let runs = noisy(|n| 0.3 / n + 0.01, 1.02);
        let verdict = |noise| Convergence::of(&runs, noise).expect("four counts").verdict;
        assert_eq!(verdict(Some(0.011)), Verdict::ReferenceNoise);
        assert_eq!(verdict(Some(0.001)), Verdict::Flattens);
    }

    #[test]
    fn a_floor_within_the_noise_is_not_seen() {
        let fit = Convergence::of(&noisy(|n| 0.3 / n + 0.0003, 1.3), None).expect("four counts");
        assert_eq!(fit.verdict, Verdict::Converges, "{fit:?}");
    }

    #[test]
    fn one_count_and_an_error_of_zero_have_no_fit() {
        assert_eq!(Convergence::of(&points(|n| 1.0 / n)[..1], None), None);
        assert_eq!(Convergence::of(&points(|_| 0.0), None), None);
    }

    #[test]
    fn means_of_few_numbers() {
        assert_eq!(mean([1.0, 2.0, 6.0]), Some(3.0));
        assert_near(geometric_mean([1.0, 10.0, 100.0]).expect("three"), 10.0);
        assert_eq!(median([9.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([9.0, 1.0, 2.0, 4.0]), Some(3.0));
        assert_eq!((mean([]), median([])), (None, None));
    }
}
