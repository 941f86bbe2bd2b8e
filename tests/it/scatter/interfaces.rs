//! Rough interfaces against the limits where they are smooth, or are none.

use tyndall::scatter::{Bxdf, TransportMode};
use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::seen::{environment, seen_by};
use crate::scatter::cases::{glass, surface, views};

const EYE: [f64; 3] = [0.1, 0.2, -5.0];
const AHEAD: [f64; 3] = [0.02, -0.03, 1.0];

fn furnace(material: &str, toward: [f64; 3]) -> String {
    let world = environment([1.0; 3]) + &format!("Material {material} Shape \"sphere\"");
    seen_by("path", 100, EYE, toward, &world)
}

fn rough_glass(eta: f64) -> String {
    format!("\"glass\" \"float eta\" {eta} \"float uroughness\" 0.1 \"float vroughness\" 0.1")
}

#[test]
fn m01_an_interface_between_equal_indices_is_transparent() {
    for toward in [AHEAD, [0.13, 0.1, 1.0], [0.17, 0.01, 1.0]] {
        assert_exact(
            &furnace(&rough_glass(1.0), toward),
            [1.0; 3],
            "equal indices",
        );
    }
    // Straight through, and not to the mirror image.
    let lobe = glass([0.5, 0.5], 1.0);
    let mut random = Uniform::new(1);
    for wo in views() {
        let (u_lobe, u) = (random.unit(), random.unit2());
        let sample = surface([lobe]).sample(wo, u_lobe, u, TransportMode::Radiance);
        let sample = sample.expect("a direction");
        assert!(sample.specular && sample.transmitted);
        assert!((sample.wi + wo).length_squared() < 1e-12, "{sample:?}");
    }
}

#[test]
fn m01_indices_that_are_nearly_equal_are_nearly_transparent() {
    // What is missing is what a microfacet model of single scattering loses.
    let mut last = 1.0;
    for eta in [1.0001, 1.001, 1.01, 1.03] {
        let mean = Probe::new(&furnace(&rough_glass(eta), AHEAD)).means(20_000)[0].value;
        assert!((0.98..1.0 + 1e-4).contains(&mean), "index {eta}: {mean}");
        assert!(mean <= last + 5e-3, "index {eta}: {mean} after {last}");
        last = mean;
    }
}

#[test]
fn a_lobe_that_directions_resolve_is_rough() {
    for (alpha, eta, is_rough) in [
        (0.5, 1.001, true),
        (0.5, 0.999, true),
        (1e-3, 1.5, true),
        (0.5, 1.0, false),
        (0.5, 1.00001, false),
        (1e-3, 1.001, false),
    ] {
        let lobe = glass([alpha, alpha], eta);
        assert_eq!(
            matches!(lobe, Bxdf::RoughDielectric(_)),
            is_rough,
            "{alpha}, {eta}"
        );
    }
}

#[test]
fn m03_unmapped_roughness_of_nothing_on_both_axes_is_perfectly_smooth() {
    let smooth =
        "\"glass\" \"float uroughness\" 0 \"float vroughness\" 0 \"bool remaproughness\" \"false\"";
    let world = |glass: &str| {
        let lamp = "LightSource \"distant\" Material \"matte\" Shape \"disk\" \"float height\" 3\n";
        seen_by(
            "path",
            20,
            EYE,
            AHEAD,
            &format!("{lamp}Material {glass} Shape \"sphere\""),
        )
    };
    let samples = |glass: &str| Probe::new(&world(glass)).samples(100);
    assert_eq!(samples(smooth), samples("\"glass\""));
    let mapped = smooth.replace("false", "true");
    assert_eq!(samples(smooth), samples(&mapped), "mapped or not");
}

#[test]
fn the_narrowest_glass_refracts_like_smooth_glass() {
    // Two half-spaces of different radiance, seen through a ball that turns the world upside down.
    let world = |glass: &str| {
        environment([0.2; 3])
            + &format!(
                "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] Translate 0 -12 0 \
                 Scale 30 1 30 Rotate -90 1 0 0 Shape \"disk\" AttributeEnd\n\
                 Material {glass} Shape \"sphere\""
            )
    };
    for toward in [AHEAD, [0.0, 0.1, 1.0], [0.02, -0.11, 1.0]] {
        let seen = |glass: &str| {
            Probe::new(&seen_by("path", 20, EYE, toward, &world(glass))).means(20_000)
        };
        let smooth = seen("\"glass\"");
        let narrow = seen(
            "\"glass\" \"float uroughness\" 0.001 \"float vroughness\" 0.001 \
             \"bool remaproughness\" \"false\"",
        );
        for (narrow, smooth) in narrow.iter().zip(&smooth) {
            let narrow = Mean {
                standard_error: narrow.standard_error.hypot(2e-3 * smooth.value),
                ..*narrow
            };
            narrow
                .agrees_with_mean(smooth)
                .assert_accepted(&format!("{toward:?}"));
        }
    }
}

#[test]
fn a_hole_lets_everything_pass() {
    let hole = "\"uber\" \"rgb opacity\" [0 0 0]";
    assert_exact(&furnace(hole, AHEAD), [1.0; 3], "no opacity");
    let half = "\"uber\" \"rgb Kd\" [0 0 0] \"rgb Ks\" [0 0 0] \"rgb opacity\" [.5 .25 0]";
    assert_mean(
        &furnace(half, AHEAD),
        20_000,
        [0.25, 0.5625, 1.0],
        "twice through",
    );
}
