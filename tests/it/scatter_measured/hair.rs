//! Hair: its lobes are densities, its samples follow them, and fibres that absorb nothing vanish in a uniform sky.

use crate::common::findings::findings;
use crate::common::probe::assert_mean;
use crate::scatter_measured::lit;
use tyndall::math::Vec3;
use tyndall::scatter::hair::{Hair, sigma_a_from_color, sigma_a_from_melanin};
use tyndall::spectrum::Rgb;
use tyndall_test_support::Uniform;
use tyndall_test_support::chi2::{Chi2, Sphere};
use tyndall_test_support::z_test::Mean;

/// Offsets across a fibre: both edges, the axis, and between.
const OFFSETS: [f32; 5] = [-1.0, -0.4, 0.0, 0.83, 1.0];

/// Toward the viewer: across the fibre, oblique, from below, grazing and nearly along it.
fn viewers() -> [Vec3; 5] {
    [
        Vec3::new(0.0, 0.0, 1.0),
        Vec3::new(0.4, -0.5, 0.7),
        Vec3::new(-0.8, 0.3, -0.5),
        Vec3::new(0.3, 1.0, 1e-4),
        Vec3::new(1.0, 1e-3, 2e-3),
    ]
    .map(Vec3::normalize)
}

fn draw(hair: &Hair, wo: Vec3, u: &mut Uniform) -> Option<Vec3> {
    let u_lobe = u.unit();
    hair.sample(wo, u_lobe, u.unit2())
}

#[test]
fn samples_follow_their_density() {
    // Lobes narrower than the cells of the test are compared by their energy, below.
    let roughnesses = [(0.3, 0.3), (1.0, 1.0), (0.15, 0.6)];
    let absorptions = [Rgb::BLACK, Rgb::new(0.2, 0.9, 3.0)];
    let n_tests = roughnesses.len() * OFFSETS.len() * viewers().len();
    let mut k = 0;
    for (beta_m, beta_n) in roughnesses {
        for h in OFFSETS {
            for wo in viewers() {
                k += 1;
                let hair = Hair::new(h, 1.55, absorptions[k % 2], beta_m, beta_n, 2.0);
                let chi2 = Chi2 {
                    n_samples: 50_000,
                    seed: k as u64,
                    n_tests,
                    ..Chi2::default()
                };
                chi2.check(
                    Sphere,
                    |u| draw(&hair, wo, u).map(Into::into),
                    |wi| hair.pdf(wo, wi.into()).into(),
                )
                .assert_accepted(&format!("beta {beta_m} {beta_n}, h {h}, from {wo:?}"));
            }
        }
    }
}

#[test]
fn a_density_of_another_tilt_or_roughness_is_rejected() {
    let wo = viewers()[1];
    let hair = Hair::new(0.3, 1.55, Rgb::BLACK, 0.3, 0.3, 2.0);
    for wrong in [
        Hair::new(0.3, 1.55, Rgb::BLACK, 0.3, 0.3, -2.0),
        Hair::new(0.3, 1.55, Rgb::BLACK, 0.33, 0.3, 2.0),
        Hair::new(0.3, 1.55, Rgb::BLACK, 0.3, 0.33, 2.0),
        Hair::new(0.35, 1.55, Rgb::BLACK, 0.3, 0.3, 2.0),
    ] {
        let verdict = Chi2::default().check(
            Sphere,
            |u| draw(&hair, wo, u).map(Into::into),
            |wi| wrong.pdf(wo, wi.into()).into(),
        );
        assert!(!verdict.accepted(), "{wrong:?}: {verdict:?}");
    }
}

/// The energy a fibre scatters toward `wo`, channel by channel, by sampling; each sample is judged.
#[track_caller]
fn albedo(hair: &Hair, wo: Vec3, n: usize) -> [Mean; 3] {
    let mut random = Uniform::new(7);
    let values: Vec<[f64; 3]> = (0..n)
        .map(|_| {
            let Some(wi) = draw(hair, wo, &mut random) else {
                return [0.0; 3];
            };
            let (f, pdf) = (hair.f(wo, wi), hair.pdf(wo, wi));
            let sound = f.is_finite() && f.min_component() >= 0.0 && pdf.is_finite() && pdf >= 0.0;
            assert!(sound, "{hair:?} {wo:?} {wi:?}: f {f:?}, pdf {pdf}");
            assert!((wi.length_squared() - 1.0).abs() < 1e-5, "{wi:?}");
            assert!(pdf > 0.0 || f.is_black(), "{wo:?} {wi:?}: f {f:?}, pdf 0");
            if pdf > 0.0 {
                (f * (wi.z().abs() / pdf)).to_array().map(f64::from)
            } else {
                [0.0; 3]
            }
        })
        .collect();
    [0, 1, 2].map(|channel| {
        let mut one = values.iter().map(|value| value[channel]);
        Mean::of(n, || one.next().expect("one value per call"))
    })
}

#[test]
fn m06_white_fibres_return_all_they_receive_at_every_roughness() {
    for beta_m in [0.0, 1e-4, 1e-3, 0.1, 0.3, 1.0] {
        for beta_n in [0.0, 1e-4, 1e-3, 0.1, 0.3, 1.0] {
            for h in OFFSETS {
                for wo in viewers() {
                    for eta in [1.0, 1.55, 0.8] {
                        let hair = Hair::new(h, eta, Rgb::BLACK, beta_m, beta_n, 2.0);
                        // Without absorption every sample weighs 1.
                        let mean = albedo(&hair, wo, 200)[0].value;
                        assert!(
                            (mean - 1.0).abs() < 0.01,
                            "beta {beta_m} {beta_n}, h {h}, eta {eta}, from {wo:?}: {mean}"
                        );
                    }
                }
            }
        }
    }
}

/// The published formulas as they stand (Chiang et al. 2016; pbrt-v3), in double precision and one channel, for
/// directions (θ, φ), times the cosine.
fn published(h: f64, sigma_a: f64, [m, n, alpha]: [f64; 3], o: [f64; 2], i: [f64; 2]) -> f64 {
    use std::f64::consts::PI;
    const ETA: f64 = 1.55;
    let gamma_o = h.asin();
    let gamma_t = (h * o[0].cos() / (ETA * ETA - o[0].sin().powi(2)).sqrt()).asin();
    let theta_t = (o[0].sin() / ETA).asin();
    let t = (-sigma_a * 2.0 * gamma_t.cos() / theta_t.cos()).exp();
    let f = {
        let cos_i: f64 = o[0].cos() * gamma_o.cos();
        let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (ETA * ETA)).sqrt();
        let parallel = (ETA * cos_i - cos_t) / (ETA * cos_i + cos_t);
        let perpendicular = (cos_i - ETA * cos_t) / (cos_i + ETA * cos_t);
        0.5 * (parallel.powi(2) + perpendicular.powi(2))
    };
    let v = (0.726 * m + 0.812 * m * m + 3.7 * m.powi(20)).powi(2);
    let s = (PI / 8.0).sqrt() * (0.265 * n + 1.194 * n * n + 5.372 * n.powi(22));
    let longitudinal = |theta_o: f64, v: f64| {
        let a = i[0].cos() * theta_o.cos().abs() / v;
        let (mut term, mut bessel) = (1.0, 1.0);
        for k in 1..300 {
            term *= a * a / 4.0 / f64::from(k * k);
            bessel += term;
        }
        (-i[0].sin() * theta_o.sin() / v).exp() * bessel / (2.0 * v * (1.0 / v).sinh())
    };
    let azimuthal = |p: f64| {
        let x = i[1] - o[1] - (2.0 * p * gamma_t - 2.0 * gamma_o + p * PI);
        let x = x - 2.0 * PI * (x / (2.0 * PI)).round();
        let cdf = |x: f64| 1.0 / (1.0 + (-x / s).exp());
        let e = (-x.abs() / s).exp();
        e / (s * (1.0 + e).powi(2)) / (cdf(PI) - cdf(-PI))
    };
    let passed = (1.0 - f).powi(2) * t;
    f * longitudinal(o[0] - 2.0 * alpha, v) * azimuthal(0.0)
        + passed * longitudinal(o[0] + alpha, v / 4.0) * azimuthal(1.0)
        + passed * t * f * longitudinal(o[0] + 4.0 * alpha, 4.0 * v) * azimuthal(2.0)
        + passed * (t * f).powi(2) / (1.0 - t * f) * longitudinal(o[0], 4.0 * v) / (2.0 * PI)
}

#[test]
fn values_are_those_of_the_published_formulas() {
    let mut random = Uniform::new(21);
    for _ in 0..20_000 {
        let mut between = |low: f64, high: f64| low + (high - low) * f64::from(random.unit());
        let (h, sigma_a) = (between(-1.0, 1.0), between(0.0, 2.0));
        let [m, n, alpha] = [between(0.2, 1.0), between(0.1, 1.0), between(-4.0, 4.0)];
        let [o, i] = [0, 1].map(|_| [between(-1.5, 1.5), between(-3.1, 3.1)]);
        let direction = |[theta, phi]: [f64; 2]| {
            let (x, across) = theta.sin_cos();
            Vec3::new(
                x as f32,
                (across * phi.cos()) as f32,
                (across * phi.sin()) as f32,
            )
        };
        let (wo, wi) = (direction(o), direction(i));
        let absorbed = Rgb::splat(sigma_a as f32);
        let hair = Hair::new(h as f32, 1.55, absorbed, m as f32, n as f32, alpha as f32);
        let actual = f64::from(hair.f(wo, wi).g() * wi.z().abs());
        let expected = published(h, sigma_a, [m, n, alpha.to_radians()], o, i);
        assert!(
            (actual / expected - 1.0).abs() < 2e-3 || (actual - expected).abs() < 1e-6,
            "h {h}, beta {m} {n}, {o:?} {i:?}: {actual} is not {expected}"
        );
    }
}

#[test]
fn m06_energy_by_uniform_directions_is_energy_by_sampling() {
    // Two estimators that share nothing but the value.
    for (beta_m, beta_n) in [(0.3, 0.3), (0.5, 0.2), (1.0, 1.0)] {
        for h in [-1.0, 0.2, 0.9] {
            let hair = Hair::new(h, 1.55, Rgb::new(0.0, 0.3, 2.0), beta_m, beta_n, 3.0);
            for wo in viewers() {
                let sampled = albedo(&hair, wo, 100_000);
                let mut random = Uniform::new(11);
                let n = 200_000;
                let values: Vec<[f64; 3]> = (0..n)
                    .map(|_| {
                        let [a, b] = random.unit2();
                        let wi = tyndall::sampling::warp::uniform_sphere([a, b]);
                        let f = hair.f(wo, wi) * (wi.z().abs() * 4.0 * std::f32::consts::PI);
                        f.to_array().map(f64::from)
                    })
                    .collect();
                for channel in 0..3 {
                    let mut one = values.iter().map(|value| value[channel]);
                    let uniform = Mean::of(n, || one.next().expect("one value per call"));
                    let error = sampled[channel]
                        .standard_error
                        .hypot(uniform.standard_error);
                    let difference = sampled[channel].value - uniform.value;
                    assert!(
                        difference.abs() < 4.5 * error + 1e-4,
                        "beta {beta_m} {beta_n}, h {h}, {wo:?}: {:?} and {uniform:?}",
                        sampled[channel]
                    );
                }
            }
        }
    }
}

#[test]
fn n03_extreme_random_numbers_give_sound_samples() {
    let extremes = [0.0, 2f32.powi(-32), 0.5, 1.0 - 2f32.powi(-24)];
    for beta in [0.0, 0.3, 1.0] {
        for h in OFFSETS {
            let hair = Hair::new(h, 1.55, Rgb::new(0.0, 1.0, f32::MAX), beta, beta, 2.0);
            for wo in viewers() {
                for a in extremes {
                    for b in extremes {
                        for c in extremes {
                            let wi = hair.sample(wo, a, [b, c]).expect("some light returns");
                            let (f, pdf) = (hair.f(wo, wi), hair.pdf(wo, wi));
                            assert!(wi.is_finite() && f.is_finite() && pdf.is_finite());
                            assert!(pdf > 0.0 || f.is_black());
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn colours_and_pigments_are_absorbed_as_published() {
    // Brown hair, 1.3 of eumelanin.
    let brown = sigma_a_from_melanin(1.3, 0.0).to_array();
    for (actual, expected) in brown.into_iter().zip([0.5447, 0.9061, 1.781]) {
        assert!((actual - expected).abs() < 1e-4, "{brown:?}");
    }
    // White absorbs nothing, black as much as can be said, at every roughness; darker is more.
    for beta_n in [0.0, 0.3, 1.0] {
        let sigma = |c| sigma_a_from_color(Rgb::splat(c), beta_n).r();
        assert_eq!(sigma(1.0), 0.0);
        assert!(sigma(0.5) > 0.0 && sigma(0.2) > sigma(0.5) && sigma(0.0) > 1e30);
        assert!(sigma(0.0).is_finite());
    }
    let expected = (0.5f32.ln() / 5.969).powi(2);
    assert!((sigma_a_from_color(Rgb::splat(0.5), 0.0).r() / expected - 1.0).abs() < 1e-5);
}

#[test]
fn m06_a_white_fibre_vanishes_in_a_uniform_sky() {
    for beta in ["0", "1e-4", "0.3", "1"] {
        let fibre = format!(
            "Material \"hair\" \"rgb sigma_a\" [0 0 0] \"float beta_m\" {beta} \"float beta_n\" {beta}\n\
             Shape \"cylinder\""
        );
        assert_mean(&lit(&fibre), 10_000, [1.0; 3], &format!("beta {beta}"));
    }
}

#[test]
fn absorption_wins_over_colour_and_colour_over_pigments() {
    let of = |parameters: &str| {
        findings(&lit(&format!(
            "Material \"hair\" {parameters}\nShape \"cylinder\""
        )))
    };
    let loser = |name: &str, winner: &str| {
        let message = format!("\"{name}\" has no effect beside \"{winner}\"");
        ("unused-parameter".to_owned(), message)
    };
    let all = "\"float eumelanin\" 1 \"rgb color\" [1 1 1] \"rgb sigma_a\" [1 1 1]";
    assert_eq!(
        of(all),
        [loser("color", "sigma_a"), loser("eumelanin", "sigma_a")]
    );
    assert_eq!(
        of("\"float pheomelanin\" 1 \"rgb color\" [1 1 1]"),
        [loser("pheomelanin", "color")]
    );
    assert_eq!(of("\"float pheomelanin\" 1 \"float eumelanin\" 1"), []);
}

#[test]
fn m06_roughness_outside_its_range_is_told_and_clamped() {
    let rough = "Material \"hair\" \"float beta_m\" 1.5 \"float beta_n\" -0.1\nShape \"cylinder\"";
    let found = findings(&lit(rough));
    let codes: Vec<&str> = found.iter().map(|(code, _)| code.as_str()).collect();
    assert_eq!(codes, ["out-of-range", "out-of-range"], "{found:?}");
}
