//! The judges are judged: wrong samplers, means and images must be rejected, right ones accepted at the stated rate.

use std::f64::consts::PI;

use tyndall_test_support::chi2::{self, Chi2, Hemisphere, Line, Sphere, Square};
use tyndall_test_support::image_z::ImageZTest;
use tyndall_test_support::z_test::Mean;
use tyndall_test_support::{Uniform, Verdict, assert_close, sidak};

fn uniform_hemisphere(u: [f32; 2]) -> [f32; 3] {
    polar(u[0], u[1])
}

fn cosine_hemisphere(u: [f32; 2]) -> [f32; 3] {
    polar(u[0], (1.0 - u[1]).sqrt())
}

/// The unit vector at a turn in [0, 1) and a height.
fn polar(turn: f32, z: f32) -> [f32; 3] {
    let r = (1.0 - z * z).max(0.0).sqrt();
    let phi = turn * std::f32::consts::TAU;
    [r * phi.cos(), r * phi.sin(), z]
}

fn cosine_pdf(w: [f32; 3]) -> f64 {
    f64::from(w[2].max(0.0)) / PI
}

/// A point of density 2x on the unit square.
fn ramp_along_x(u: [f32; 2]) -> [f32; 2] {
    [u[0].sqrt().min(1.0 - f32::EPSILON), u[1]]
}

fn ramp_pdf(p: [f32; 2]) -> f64 {
    2.0 * f64::from(p[0])
}

/// Verdicts over many seeds: right samplers fail at the stated rate, no more and no less.
fn assert_false_alarms_at_stated_rate(judge: impl Fn(u64) -> Verdict) {
    const N: usize = 400;
    let p_values: Vec<f64> = (0..N as u64).map(|seed| judge(seed).p_value).collect();
    for level in [0.01, 0.1, 0.5] {
        let n_below = p_values.iter().filter(|&&p| p < level).count() as f64;
        let expected = level * N as f64;
        let deviation = (expected * (1.0 - level)).sqrt();
        assert!(
            (n_below - expected).abs() <= 4.0 * deviation,
            "{n_below} of {N} p-values are below {level}"
        );
    }
}

fn seeded(seed: u64) -> Chi2 {
    Chi2 {
        n_samples: 50_000,
        seed,
        ..Chi2::default()
    }
}

#[test]
fn right_samplers_pass_at_the_stated_rate() {
    assert_false_alarms_at_stated_rate(|seed| {
        seeded(seed).check(
            Hemisphere,
            |u| Some(cosine_hemisphere(u.unit2())),
            cosine_pdf,
        )
    });
    assert_false_alarms_at_stated_rate(|seed| {
        seeded(seed).check(Square, |u| Some(ramp_along_x(u.unit2())), ramp_pdf)
    });
}

#[test]
fn right_samplers_pass_on_every_domain() {
    chi2::check(Sphere, |u| Some(cosine_hemisphere(u.unit2())), cosine_pdf)
        .assert_accepted("half of a sphere");
    let whole = |u: &mut Uniform| Some(polar(u.unit(), 2.0 * u.unit() - 1.0));
    chi2::check(Sphere, whole, |_| 0.25 / PI).assert_accepted("uniform sphere");
    let hemisphere = |u: &mut Uniform| Some(uniform_hemisphere(u.unit2()));
    chi2::check(Hemisphere, hemisphere, |_| 0.5 / PI).assert_accepted("uniform hemisphere");
    let line = |u: &mut Uniform| Some(u.unit().cbrt().min(1.0 - f32::EPSILON));
    chi2::check(Line, line, |x| 3.0 * f64::from(x * x)).assert_accepted("quadratic density");
}

#[test]
fn narrow_lobes_pass_and_those_of_another_width_do_not() {
    // Phong's lobe about z: density (n + 1)/(2 pi) z^n.
    let lobe = |n: f32| {
        move |u: &mut Uniform| Some(polar(u.unit(), (1.0 - u.unit()).powf(1.0 / (n + 1.0))))
    };
    let pdf = |n: f64| move |w: [f32; 3]| (n + 1.0) / (2.0 * PI) * f64::from(w[2].max(0.0)).powf(n);
    for n in [10.0, 300.0, 3000.0f32] {
        chi2::check(Sphere, lobe(n), pdf(n.into())).assert_accepted("narrow lobe");
        assert!(
            !chi2::check(Sphere, lobe(n), pdf(1.1 * f64::from(n))).accepted(),
            "{n}"
        );
    }
}

#[test]
fn uniform_posing_as_cosine_is_rejected() {
    for seed in 0..20 {
        let verdict = seeded(seed).check(
            Hemisphere,
            |u| Some(uniform_hemisphere(u.unit2())),
            cosine_pdf,
        );
        assert!(!verdict.accepted(), "{verdict:?}");
    }
}

#[test]
fn swapped_axes_are_rejected() {
    let swapped = |u: &mut Uniform| {
        let [x, y] = ramp_along_x(u.unit2());
        Some([y, x])
    };
    assert!(!chi2::check(Square, swapped, ramp_pdf).accepted());
}

#[test]
fn a_density_that_is_two_percent_off_in_one_half_is_rejected() {
    let tilted = |x: f32| if x < 0.5 { 1.02 } else { 0.98 };
    let patient = Chi2 {
        n_samples: 1_000_000,
        ..Chi2::default()
    };
    assert!(!patient.check(Line, |u| Some(u.unit()), tilted).accepted());
    patient
        .check(Line, |u| Some(u.unit()), |_| 1.0)
        .assert_accepted("uniform");
}

#[test]
fn densities_that_do_not_integrate_to_one_are_rejected() {
    assert!(
        !chi2::check(Line, |u| Some(u.unit()), |_| 1.01).accepted(),
        "too much"
    );
    assert!(
        !chi2::check(Line, |u| Some(u.unit()), |_| 0.99).accepted(),
        "too little, and no sample fails"
    );
}

#[test]
fn failed_samples_need_missing_density() {
    let one_in_four_fails = |u: &mut Uniform| Some(u.unit()).filter(|_| u.unit() >= 0.25);
    chi2::check(Line, one_in_four_fails, |_| 0.75)
        .assert_accepted("a quarter is missing and a quarter fails");
    assert!(
        !chi2::check(Line, one_in_four_fails, |_| 1.0).accepted(),
        "nothing is missing"
    );
    assert!(
        !chi2::check(Line, one_in_four_fails, |_| 0.72).accepted(),
        "more is missing than fails"
    );
}

#[test]
fn samples_where_nothing_can_be_are_rejected() {
    assert!(
        !chi2::check(Hemisphere, |_| Some([0.0, 0.0, -1.0]), cosine_pdf).accepted(),
        "outside the domain"
    );
    assert!(
        !chi2::check(Sphere, |_| Some([0.0, 0.0, 0.5]), cosine_pdf).accepted(),
        "not a direction"
    );
    assert!(
        !chi2::check(Line, |_| Some(1.0), |_| 1.0).accepted(),
        "1 is not in [0, 1)"
    );
    let upper_half = |x: f32| if x >= 0.5 { 2.0 } else { 0.0 };
    let mut n = 0;
    let one_stray = |u: &mut Uniform| {
        n += 1;
        Some(if n == 1000 { 0.1 } else { 0.5 + 0.5 * u.unit() })
    };
    assert!(
        !chi2::check(Line, one_stray, upper_half).accepted(),
        "one sample of density 0"
    );
}

#[test]
fn densities_that_are_no_numbers_are_rejected() {
    for bad in [f64::NAN, f64::INFINITY, -0.1] {
        assert!(
            !chi2::check(
                Line,
                |u| Some(u.unit()),
                |x| if x > 0.9 { bad } else { 1.0 }
            )
            .accepted(),
            "{bad}"
        );
    }
}

#[test]
fn many_tests_keep_one_error_rate() {
    assert_close(sidak(0.01, 1), 0.01, 1e-12);
    assert_close(1.0 - (1.0 - sidak(0.01, 50)).powi(50), 0.01, 1e-9);
    let family = Chi2 {
        n_tests: 50,
        ..seeded(3)
    };
    let verdict = family.check(Line, |u| Some(u.unit()), |_| 1.0);
    assert_close(verdict.threshold, sidak(0.01, 50), 1e-12);
}

fn mean_of_uniform(seed: u64, n_samples: usize, gain: f64) -> Mean {
    let mut random = Uniform::new(seed);
    Mean::of(n_samples, || gain * f64::from(random.unit()))
}

#[test]
fn standard_errors_are_those_of_the_uniform_density() {
    let mean = mean_of_uniform(5, 100_000, 1.0);
    assert_close(
        mean.standard_error,
        (1.0f64 / 12.0 / 100_000.0).sqrt(),
        0.01,
    );
}

#[test]
fn right_means_pass_at_the_stated_rate() {
    assert_false_alarms_at_stated_rate(|seed| mean_of_uniform(seed, 1000, 1.0).agrees_with(0.5));
    assert_false_alarms_at_stated_rate(|seed| {
        mean_of_uniform(seed, 1000, 1.0).agrees_with_mean(&mean_of_uniform(
            seed + 10_000,
            3000,
            1.0,
        ))
    });
}

#[test]
fn a_mean_two_percent_off_is_rejected() {
    for seed in 0..50 {
        assert!(
            !mean_of_uniform(seed, 40_000, 1.02)
                .agrees_with(0.5)
                .accepted()
        );
        assert!(
            mean_of_uniform(seed, 40_000, 1.0)
                .agrees_with(0.5)
                .accepted()
        );
        let reference = mean_of_uniform(seed + 100, 40_000, 0.96);
        assert!(
            !mean_of_uniform(seed, 40_000, 1.0)
                .agrees_with_mean(&reference)
                .accepted()
        );
    }
}

#[test]
fn means_without_noise_must_agree_to_rounding() {
    let exact = |value: f64| Mean::of(10, || value);
    exact(0.1)
        .agrees_with(0.1 * (1.0 + 5e-7))
        .assert_accepted("f32 rounding");
    assert!(!exact(0.1).agrees_with(0.1 * (1.0 + 5e-6)).accepted());
    assert!(!exact(f64::NAN).agrees_with(0.1).accepted());
    assert!(!exact(0.1).agrees_with(f64::NAN).accepted());
}

/// A noisy image of a slope, its reference and variance; `bias` is added to every sample of columns in `biased`.
fn noisy(seed: u64, bias: f32, biased: std::ops::Range<usize>) -> [Vec<f32>; 3] {
    let mut random = Uniform::new(seed);
    let reference: Vec<f32> = (0..32 * 24 * 3)
        .map(|i| 1.0 + (i % 96) as f32 / 96.0)
        .collect();
    // Twelve uniform numbers make a variable of variance 1.
    let mut normal = || (0..12).map(|_| random.unit() - 0.5).sum::<f32>();
    let image = reference.iter().enumerate().map(|(i, r)| {
        let bias = if biased.contains(&(i / 3 % 32)) {
            bias
        } else {
            0.0
        };
        r + 0.1 * normal() + bias
    });
    [image.collect(), reference, vec![0.01; 32 * 24 * 3]]
}

fn image_test(block: usize) -> ImageZTest {
    ImageZTest {
        width: 32,
        channels: 3,
        block,
        alpha: 0.01,
    }
}

#[test]
fn right_images_pass_at_no_more_than_the_stated_rate() {
    for block in [1, 5, 8] {
        let rejected = |&seed: &u64| {
            let [image, reference, variance] = noisy(seed, 0.0, 0..0);
            !image_test(block)
                .check(&image, &reference, &variance)
                .accepted()
        };
        let n_rejected = (0..200).filter(rejected).count();
        assert!(
            n_rejected <= 8,
            "{n_rejected} of 200 right images rejected, 2 expected"
        );
    }
}

#[test]
fn wrong_images_are_rejected() {
    for seed in 0..20 {
        let [image, reference, variance] = noisy(seed, 0.02, 0..32);
        assert!(
            !image_test(1)
                .check(&image, &reference, &variance)
                .accepted(),
            "a faint bias everywhere"
        );
        let [image, reference, variance] = noisy(seed, 0.1, 8..16);
        assert!(
            !image_test(8)
                .check(&image, &reference, &variance)
                .accepted(),
            "a bias in some blocks"
        );
        let [mut image, reference, variance] = noisy(seed, 0.0, 0..0);
        image[777] += 1.0;
        assert!(
            !image_test(1)
                .check(&image, &reference, &variance)
                .accepted(),
            "one firefly"
        );
        image[777] = f32::NAN;
        assert!(
            !image_test(1)
                .check(&image, &reference, &variance)
                .accepted(),
            "one NaN"
        );
    }
}

#[test]
fn images_without_noise_must_agree_to_rounding() {
    let reference = vec![0.5; 12];
    let mut image = reference.clone();
    let test = ImageZTest {
        width: 4,
        channels: 1,
        block: 1,
        alpha: 0.01,
    };
    test.check(&image, &reference, &[0.0; 12])
        .assert_accepted("equal images");
    image[3] += 1e-5;
    assert!(!test.check(&image, &reference, &[0.0; 12]).accepted());
}

#[test]
#[should_panic(expected = "1.01 is not 1")]
fn numbers_that_are_not_close_are_told_apart() {
    assert_close(1.005, 1.0, 0.01);
    assert_close(1.01, 1.0, 0.001);
}
