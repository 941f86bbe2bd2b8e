//! Tables: they give back what they were made from, are sampled by their density, and no file breaks the reader.

use std::f32::consts::PI;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use proptest::prelude::*;
use tyndall::compile::CompileOptions;
use tyndall::math::Vec3;
use tyndall::sampling::warp::uniform_sphere;
use tyndall::scatter::fourier::{FourierTable, decode};
use tyndall::scatter::microfacet::TrowbridgeReitz;
use tyndall::scatter::rough_dielectric::RoughDielectric;
use tyndall::scatter::{Bxdf, TransportMode};
use tyndall::spectrum::Rgb;
use tyndall_test_support::Uniform;
use tyndall_test_support::chi2::{Chi2, Sphere};
use tyndall_test_support::z_test::Mean;

use crate::common::findings::findings;
use crate::common::probe::{Probe, assert_exact};
use crate::common::scene::compile_scene;
use crate::scatter_measured::lit;

use TransportMode::{Importance, Radiance};

/// Coefficients of every channel for one pair of nodes; each channel has as many.
type Channels = Vec<Vec<f32>>;

/// A file of nodes at `mu`. `series` gives the coefficients for the indices of μi and μo.
fn encode(mu: &[f32], eta: f32, series: impl Fn(usize, usize) -> Channels) -> Vec<u8> {
    let n = mu.len();
    let (mut places, mut coefficients) = (Vec::<i32>::new(), Vec::<f32>::new());
    let (mut longest, mut n_channels) = (0, 1);
    for o in 0..n {
        for i in 0..n {
            let channels = series(i, o);
            let len = channels.first().map_or(0, Vec::len);
            places.extend([coefficients.len() as i32, len as i32]);
            longest = longest.max(len);
            n_channels = n_channels.max(channels.len());
            coefficients.extend(channels.iter().flatten());
        }
    }
    let mut bytes = b"SCATFUN\x01".to_vec();
    let counts = [1, n, coefficients.len(), longest, n_channels, 1, 0, 0, 0];
    bytes.extend(counts.iter().flat_map(|&x| (x as i32).to_le_bytes()));
    let floats = |values: &[f32]| -> Vec<u8> {
        let words = values.iter().map(|x| x.to_le_bytes());
        words.flatten().collect()
    };
    bytes.extend(floats(&[eta, 0.0, 0.0, 0.0, 0.0]));
    bytes.extend(floats(mu));
    bytes.extend(floats(&vec![0.0; n * n]));
    bytes.extend(places.iter().flat_map(|x| x.to_le_bytes()));
    bytes.extend(floats(&coefficients));
    bytes
}

/// Nodes below and above, dense at the horizon and at the poles; both sides have one at 0.
fn nodes(n_per_side: usize) -> Vec<f32> {
    let up = |k: usize| 0.5 * (1.0 - (PI * k as f32 / (n_per_side - 1) as f32).cos());
    let down = (0..n_per_side).rev().map(|k| -up(k));
    down.chain((0..n_per_side).map(up)).collect()
}

/// The cosine of a node, moved off the horizon to its side.
fn off_horizon(mu: &[f32], k: usize) -> f32 {
    let side = if k < mu.len() / 2 { -1.0 } else { 1.0 };
    side * mu[k].abs().max(1e-4)
}

fn lambert(n_per_side: usize, kd: [f32; 2]) -> Vec<u8> {
    let mu = nodes(n_per_side);
    encode(&mu.clone(), 1.0, move |i, o| {
        let (mu_i, mu_o) = (off_horizon(&mu, i), off_horizon(&mu, o));
        if mu_i * mu_o > 0.0 {
            return vec![];
        }
        let kd = if mu_o > 0.0 { kd[0] } else { kd[1] };
        vec![vec![kd / PI * mu_i.abs()]]
    })
}

/// The direction of polar cosine `mu` and azimuth `phi`.
fn direction(mu: f32, phi: f32) -> Vec3 {
    let sin = ((1.0 - mu) * (1.0 + mu)).max(0.0).sqrt();
    Vec3::new(sin * phi.cos(), sin * phi.sin(), mu)
}

fn glass(alpha: f32, eta: f32) -> Bxdf<'static> {
    RoughDielectric::lobe(Rgb::ONE, Rgb::ONE, TrowbridgeReitz::new(alpha, alpha), eta)
}

/// Any isotropic lobe, projected.
fn project(lobe: Bxdf<'static>, eta: f32, n_per_side: usize, n_coefficients: usize) -> Vec<u8> {
    let mu = nodes(n_per_side);
    encode(&mu.clone(), eta, move |i, o| {
        let (mu_i, mu_o) = (off_horizon(&mu, i), off_horizon(&mu, o));
        let n_steps = 8 * n_coefficients;
        let values: Vec<f32> = (0..n_steps)
            .map(|k| PI * (k as f32 + 0.5) / n_steps as f32)
            .map(|phi| lobe.f(direction(mu_o, 0.0), -direction(mu_i, phi), Importance))
            .map(|f| f.r() * mu_i.abs())
            .collect();
        let coefficient = |k: usize| {
            let terms = values.iter().enumerate();
            let cos = |step: usize| (PI * k as f32 * (step as f32 + 0.5) / n_steps as f32).cos();
            let sum: f32 = terms.map(|(step, value)| value * cos(step)).sum();
            sum / n_steps as f32 * if k == 0 { 1.0 } else { 2.0 }
        };
        vec![(0..n_coefficients).map(coefficient).collect()]
    })
}

fn table(bytes: &[u8]) -> FourierTable {
    decode(bytes).expect("the table is sound")
}

/// From above, from below, grazing, along the normal.
fn viewers() -> [Vec3; 6] {
    [
        direction(0.8, 1.0),
        direction(0.3, -2.0),
        direction(-0.6, 0.4),
        direction(0.01, 3.0),
        Vec3::new(0.0, 0.0, 1.0),
        Vec3::new(0.0, 0.0, -1.0),
    ]
}

/// The published tables beside the repository, if there are any.
fn published() -> Vec<(&'static str, FourierTable)> {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    let files = ["breakfast/bsdfs/paint.bsdf", "bmw-m6/bsdfs/leather.bsdf"];
    let found = files.into_iter().filter_map(|name| {
        let bytes = std::fs::read(scenes.join(name)).ok()?;
        Some((name, table(&bytes)))
    });
    let found: Vec<_> = found.collect();
    if found.is_empty() {
        println!("skipped: there are no published tables beside the repository");
    }
    found
}

/// Every table of these tests.
fn tables() -> Vec<(&'static str, FourierTable)> {
    let mut tables = vec![
        ("lambert", table(&lambert(6, [0.7, 0.2]))),
        ("glass", table(&project(glass(0.5, 1.5), 1.5, 16, 24))),
        ("glossy", table(&project(glass(0.15, 1.3), 1.3, 24, 64))),
    ];
    tables.extend(published());
    tables
}

#[test]
fn a_lambertian_table_is_lambertian() {
    let table = table(&lambert(12, [0.7, 0.2]));
    let mut random = Uniform::new(3);
    for _ in 0..10_000 {
        let (wo, wi) = (
            uniform_sphere(random.unit2()),
            uniform_sphere(random.unit2()),
        );
        // Between the two nodes of the horizon and the next, slopes reach across the surface.
        if wo.z().abs() < 0.1 || wi.z().abs() < 0.1 {
            continue;
        }
        let expected = match (wo.z() > 0.0, wi.z() > 0.0) {
            (true, true) => 0.7 / PI,
            (false, false) => 0.2 / PI,
            _ => 0.0,
        };
        let f = table.f(wo, wi, Radiance);
        assert!((f.g() - expected).abs() < 1e-4, "{wo:?} {wi:?}: {f:?}");
    }
}

#[test]
fn colours_are_made_of_luminance_red_and_blue() {
    let mu = nodes(6);
    let channels = [0.3f32, 0.5, 0.1];
    let bytes = encode(&mu.clone(), 1.0, |i, _| {
        channels
            .map(|c| vec![c * off_horizon(&mu, i).abs()])
            .to_vec()
    });
    let (wo, wi) = (direction(0.7, 0.0), direction(0.5, 2.0));
    let f = table(&bytes).f(wo, wi, Radiance).to_array();
    let green = 1.39829 * 0.3 - 0.100913 * 0.1 - 0.297375 * 0.5;
    for (actual, expected) in f.into_iter().zip([0.5, green, 0.1]) {
        assert!((actual - expected).abs() < 1e-4, "{f:?}");
    }
}

#[test]
fn a_projected_interface_is_that_interface_in_both_modes() {
    let (alpha, eta) = (0.5, 1.5);
    let (lobe, table) = (
        glass(alpha, eta),
        table(&project(glass(alpha, eta), eta, 32, 32)),
    );
    for mode in [Radiance, Importance] {
        for transmit in [false, true] {
            let mut random = Uniform::new(5);
            let (mut error, mut square) = (0f64, 0f64);
            for _ in 0..20_000 {
                let (wo, wi) = (
                    uniform_sphere(random.unit2()),
                    uniform_sphere(random.unit2()),
                );
                // Near the horizon, and where total reflection from inside sets in, it is sharper than such a table.
                let grazing = wo.z().abs().min(wi.z().abs()) < 0.1;
                if grazing || (!transmit && wo.z() < 0.0) || (wo.z() * wi.z() < 0.0) != transmit {
                    continue;
                }
                let cos = wi.z().abs();
                let expected = f64::from(lobe.f(wo, wi, mode).r() * cos);
                error += (f64::from(table.f(wo, wi, mode).r() * cos) - expected).powi(2);
                square += expected.powi(2);
            }
            let relative = (error / square).sqrt();
            assert!(
                relative < 0.04,
                "{mode:?}, transmitted {transmit}: {relative}"
            );
        }
    }
}

#[test]
fn samples_follow_their_density() {
    let tables: Vec<_> = tables()
        .into_iter()
        .filter(|(name, _)| !["glossy", "bmw-m6/bsdfs/leather.bsdf"].contains(name))
        .collect();
    let n_tests = tables.len() * viewers().len();
    for (k, (name, table)) in tables.iter().enumerate() {
        for (j, wo) in viewers().into_iter().enumerate() {
            // Tables of opaque surfaces are empty on the other side.
            if table.sample(wo, 0.5, [0.5, 0.5]).is_none() {
                continue;
            }
            let chi2 = Chi2 {
                n_samples: 50_000,
                seed: (k * 10 + j) as u64,
                n_tests,
                ..Chi2::default()
            };
            let draw = |u: &mut Uniform| table.sample(wo, u.unit(), u.unit2()).map(Into::into);
            let pdf = |wi: [f32; 3]| f64::from(table.pdf(wo, wi.into()));
            chi2.check(Sphere, draw, pdf)
                .assert_accepted(&format!("{name} from {wo:?}"));
            if j == 1 {
                let mirrored = |wi: [f32; 3]| pdf([wi[1], wi[0], wi[2]]);
                assert!(name == &"lambert" || !chi2.check(Sphere, draw, mirrored).accepted());
            }
        }
    }
}

#[test]
fn what_scatters_can_be_drawn() {
    let mut random = Uniform::new(9);
    for (name, table) in tables() {
        for _ in 0..50_000 {
            let (wo, wi) = (
                uniform_sphere(random.unit2()),
                uniform_sphere(random.unit2()),
            );
            let (f, pdf) = (table.f(wo, wi, Radiance), table.pdf(wo, wi));
            assert!(f.is_finite() && f.min_component() >= 0.0 && pdf.is_finite());
            assert!(pdf > 0.0 || f.is_black(), "{name} {wo:?} {wi:?}: {f:?}");
        }
    }
}

#[test]
fn n03_extreme_random_numbers_give_sound_samples() {
    let extremes = [0.0, 2f32.powi(-32), 0.5, 1.0 - 2f32.powi(-24)];
    for (name, table) in tables() {
        for wo in viewers() {
            for a in extremes {
                for b in extremes {
                    for c in extremes {
                        let Some(wi) = table.sample(wo, a, [b, c]) else {
                            continue;
                        };
                        let (f, pdf) = (table.f(wo, wi, Radiance), table.pdf(wo, wi));
                        assert!(wi.is_finite() && f.is_finite() && pdf.is_finite());
                        assert!(pdf > 0.0 || f.is_black(), "{name}: {wo:?} {wi:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn energy_by_sampling_is_energy_by_uniform_directions() {
    for (name, table) in tables() {
        for wo in viewers() {
            let mut random = Uniform::new(13);
            let sampled = Mean::of(50_000, || {
                let (u_part, u) = (random.unit(), random.unit2());
                let Some(wi) = table.sample(wo, u_part, u) else {
                    return 0.0;
                };
                let weight = table.f(wo, wi, Importance) * (wi.z().abs() / table.pdf(wo, wi));
                assert!(weight.is_finite());
                weight.luminance().into()
            });
            let mut random = Uniform::new(17);
            let uniform = Mean::of(200_000, || {
                let wi = uniform_sphere(random.unit2());
                let f = table.f(wo, wi, Importance) * (wi.z().abs() * 4.0 * PI);
                f.luminance().into()
            });
            let error = sampled.standard_error.hypot(uniform.standard_error);
            let difference = sampled.value - uniform.value;
            assert!(
                difference.abs() < 4.5 * error + 1e-4,
                "{name} from {wo:?}: {sampled:?}, {uniform:?}"
            );
            // Made by others, or by us from what is smooth: they create no energy.
            let sound = !["glass", "glossy"].contains(&name);
            assert!(!sound || sampled.value < 1.01, "{name}: {sampled:?}");
            // Sampling is worth its while.
            assert!(
                sampled.value < 0.01 || sampled.standard_error < uniform.standard_error,
                "{name} from {wo:?}: {sampled:?}, {uniform:?}"
            );
        }
    }
}

const FOURIER: &str = "Material \"fourier\" \"string bsdffile\" \"a.bsdf\"\n";

#[test]
fn m09_a_missing_table_is_an_error_and_its_surface_black() {
    let scene = lit(&format!("{FOURIER}Shape \"sphere\""));
    let found = findings(&scene);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].0, "missing-file");
    assert!(found[0].1.contains("a.bsdf"), "{found:?}");
    let unnamed = findings(&lit("Material \"fourier\" Shape \"sphere\""));
    assert_eq!(unnamed[0].0, "missing-parameter");
}

/// Compiles a scene whose only file is the table; how often it was read.
fn reads_of(world: &str) -> (Probe, usize) {
    let n_reads = AtomicUsize::new(0);
    let bytes = lambert(6, [0.5, 0.5]);
    let film = "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\n\
                PixelFilter \"box\"\n";
    let scene = film.to_owned() + &lit(world);
    let compiled = compile_scene(scene, &CompileOptions::default(), |name| {
        assert_eq!(name, "a.bsdf");
        n_reads.fetch_add(1, Ordering::Relaxed);
        Some(bytes.clone())
    });
    (Probe::of(compiled.job), n_reads.into_inner())
}

#[test]
fn a_table_is_read_once_and_only_if_something_shows_it() {
    let two = format!("{FOURIER}Shape \"sphere\"\n{FOURIER}Shape \"disk\"\n");
    assert_eq!(reads_of(&two).1, 1);
    let none = format!("{FOURIER}Material \"matte\"\nShape \"sphere\"\n");
    assert_eq!(reads_of(&none).1, 0);
}

#[test]
fn a_lambertian_table_shades_like_matte() {
    // A ball reflects half of a uniform sky. Slopes across the horizon add a little.
    let (probe, _) = reads_of(&format!("{FOURIER}Shape \"sphere\"\n"));
    let mean = probe.means(20_000)[0];
    assert!((mean.value - 0.5).abs() < 0.005, "{mean:?}");
    let black = lit("Material \"matte\" \"rgb Kd\" [0 0 0] Shape \"sphere\"");
    assert_exact(&black, [0.0; 3], "black");
}

#[test]
fn m09_every_truncated_table_is_an_error() {
    let bytes = lambert(3, [0.5, 0.5]);
    for length in 0..bytes.len() {
        assert!(decode(&bytes[..length]).is_err(), "{length}");
    }
    let mut longer = bytes;
    longer.extend(b"descriptions may follow");
    assert!(decode(&longer).is_ok());
}

#[test]
fn m09_contradictions_are_told() {
    let told = |at: usize, word: u32| {
        let mut bytes = lambert(3, [0.5, 0.5]);
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        decode(&bytes).expect_err("it is broken").to_string()
    };
    let (mu, places) = (64, 64 + 4 * 6 + 4 * 36);
    let coefficients = places + 8 * 36;
    for (at, word, expected) in [
        (0, 0, "does not start with"),
        (8, 3, "flags are 3"),
        (12, 1, "1 nodes"),
        (12, u32::MAX, "negative"),
        (12, i32::MAX as u32, "bytes follow"),
        (16, i32::MAX as u32, "bytes follow"),
        (20, 0, "out of bounds"),
        (24, 2, "2 channels"),
        (28, 4, "4 bases"),
        (44, f32::NAN.to_bits(), "index of refraction is NaN"),
        (44, 0, "index of refraction is 0"),
        (mu, 2f32.to_bits(), "node 0 is 2"),
        (mu, 1f32.to_bits(), "do not ascend"),
        (places + 4, u32::MAX, "out of bounds"),
        (
            coefficients,
            f32::INFINITY.to_bits(),
            "coefficient 0 is inf",
        ),
    ] {
        let text = told(at, word);
        assert!(text.contains(expected), "{at}: {text}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn m09_no_garbled_table_breaks_reading_or_sampling(
        hits in prop::collection::vec((0usize..800, any::<u8>()), 1..12),
        cut in 0usize..200,
        u in [0f32..1.0, 0f32..1.0, 0f32..1.0, 0f32..1.0, 0f32..1.0],
    ) {
        let mut bytes = lambert(3, [0.5, 0.2]);
        for (at, byte) in hits {
            let at = at % bytes.len();
            bytes[at] = byte;
        }
        bytes.truncate(bytes.len() - cut.saturating_sub(100));
        if let Ok(table) = decode(&bytes) {
            let wo = uniform_sphere([u[0], u[1]]);
            if let Some(wi) = table.sample(wo, u[2], [u[3], u[4]]) {
                prop_assert!(wi.is_finite());
                let (f, pdf) = (table.f(wo, wi, Radiance), table.pdf(wo, wi));
                prop_assert!(f.is_finite() && f.min_component() >= 0.0);
                prop_assert!(pdf.is_finite() && pdf >= 0.0, "{pdf}");
            }
        }
    }
}
