//! Light that falls on one surface: the same however lights are sampled.

use std::f64::consts::PI;

use crate::common::probe::{Probe, assert_mean};
use crate::common::seen::{V, environment, seen_by};

const EYE: V = [0.4, 0.3, 0.5];
const TOWARD: V = [-0.1, 0.05, -0.5];
/// Head of a scene for each way of sampling lights.
pub(crate) const DIRECT: [&str; 3] = ["whitted", "directlighting all", "directlighting one"];

/// A scene for an integrator, which may be followed by its strategy.
pub(crate) fn direct(integrator: &str, max_depth: u32, eye: V, toward: V, world: &str) -> String {
    match integrator.split_once(' ') {
        None => seen_by(integrator, max_depth, eye, toward, world),
        Some((name, strategy)) => {
            let scene = seen_by(name, max_depth, eye, toward, world);
            let with = format!("Integrator \"{name}\" \"string strategy\" \"{strategy}\"");
            scene.replacen(&format!("Integrator \"{name}\""), &with, 1)
        }
    }
}

fn floor(material: &str, lights: &str) -> String {
    format!("AttributeBegin {material} Shape \"disk\" \"float radius\" 50 AttributeEnd\n{lights}")
}

fn lamp(parameters: &str, rest: &str) -> String {
    format!("AttributeBegin AreaLightSource \"diffuse\" {parameters} {rest} AttributeEnd\n")
}

/// Lights of all kinds, with sample counts of their own.
fn lights() -> String {
    [
        "LightSource \"point\" \"point from\" [1 2 4] \"rgb I\" [7 1 9]\n".to_owned(),
        "LightSource \"distant\" \"point from\" [1 2 5] \"rgb L\" [1 2 0.5]\n".to_owned(),
        environment([0.2, 0.3, 0.4]).replace("\"rgb L\"", "\"integer samples\" 3 \"rgb L\""),
        lamp(
            "\"rgb L\" [3 2 1] \"integer nsamples\" 4",
            "Translate 1 0 2 Shape \"sphere\" \"float radius\" 0.3",
        ),
        lamp(
            "\"rgb L\" [1 5 2] \"bool twosided\" \"true\"",
            "Translate 0 1 1.5 Shape \"disk\" \"float radius\" 0.4",
        ),
    ]
    .concat()
}

#[test]
fn of_a_lamp_and_a_sky_is_a_closed_form() {
    // Straight above the receiver a disk of radius 1 at distance 2 that fills a fifth of the projected hemisphere.
    let disk = lamp(
        "\"rgb L\" [6 3 1] \"integer samples\" 5",
        "Translate 0.3 0.35 2 Rotate 180 1 0 0 Shape \"disk\"",
    );
    let world = floor(
        "Material \"matte\" \"rgb Kd\" [0.5 0.5 0.5]",
        &(disk + &environment([1.0, 2.0, 0.5])),
    );
    for integrator in DIRECT {
        let scene = direct(integrator, 5, EYE, TOWARD, &world);
        let expected =
            [[6.0, 1.0], [3.0, 2.0], [1.0, 0.5]].map(|[l, sky]| 0.5 * (0.2 * l + 0.8 * sky));
        assert_mean(&scene, 40_000, expected, integrator);
    }
}

#[test]
fn is_the_same_however_lights_are_sampled() {
    for material in [
        "Material \"matte\" \"rgb Kd\" [0.5 0.4 0.3]",
        "Material \"plastic\" \"rgb Kd\" [0.3 0.3 0.3] \"rgb Ks\" [0.6 0.5 0.4] \"float roughness\" 0.2",
        "Material \"uber\" \"rgb Kd\" [0.3 0.3 0.3] \"rgb opacity\" [0.6 0.6 0.6] \"float roughness\" 0.3",
    ] {
        // Below an uber floor there is the sky, which the path tracer sees at depth 1.
        let depth = if material.contains("uber") { 2 } else { 1 };
        let world = floor(material, &lights());
        let path = Probe::new(&seen_by("path", 1, EYE, TOWARD, &world)).means(100_000);
        for integrator in DIRECT {
            let direct = Probe::new(&direct(integrator, depth, EYE, TOWARD, &world)).means(60_000);
            for (direct, path) in direct.iter().zip(&path) {
                direct
                    .agrees_with_mean(path)
                    .assert_accepted(&format!("{integrator}, {material}"));
            }
        }
    }
}

#[test]
fn more_samples_of_a_light_mean_less_noise_with_all_of_them() {
    let spread = |samples: u32| {
        let lamp = lamp(
            &format!("\"rgb L\" [1 1 1] \"integer samples\" {samples}"),
            "Translate 0.3 0.35 1 Rotate 180 1 0 0 Shape \"disk\"",
        );
        let world = floor("Material \"matte\"", &lamp);
        let scene = direct("directlighting all", 1, EYE, TOWARD, &world);
        Probe::new(&scene).means(4000)[0].standard_error
    };
    // Sixteen points of one stratified sequence: better than a quarter.
    assert!(
        spread(16) < 0.25 * spread(1),
        "{} {}",
        spread(16),
        spread(1)
    );
}

#[test]
fn null_surfaces_are_looked_through_and_block_light() {
    let sheet = "AttributeBegin Material \"\" Translate 0 0 0.4 Shape \"disk\" \"float radius\" 60 AttributeEnd\n";
    let sun = format!(
        "LightSource \"distant\" \"rgb L\" [{PI} {PI} {PI}] \"point from\" [0 0 1] \"point to\" [0 0 0]\n"
    );
    let ball = lamp(
        "\"rgb L\" [10 10 10]",
        "Translate 0 0 0.2 Shape \"sphere\" \"float radius\" 0.05",
    );
    let white = "Material \"matte\" \"rgb Kd\" [1 1 1]";
    for integrator in DIRECT {
        // The camera is above the sheet, and so is the sun.
        let scene = |lights: &str| direct(integrator, 2, EYE, TOWARD, &floor(white, lights));
        assert_mean(&scene(&sun), 4, [1.0; 3], integrator);
        assert_mean(&scene(&format!("{sun}{sheet}")), 4, [0.0; 3], integrator);
        let open = Probe::new(&scene(&ball)).means(40_000)[0];
        let below = Probe::new(&scene(&format!("{ball}{sheet}"))).means(40_000)[0];
        assert!(open.value > 0.01);
        open.agrees_with_mean(&below).assert_accepted(integrator);
    }
}

#[test]
fn emitters_without_material_give_light_and_are_not_seen() {
    // As in pbrt-v3, quirk and all.
    let glow = "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [5 5 5] Material \"\"\n\
        Translate 0.3 0.35 2 Rotate 180 1 0 0 Shape \"disk\" AttributeEnd\n";
    let world = floor("Material \"matte\" \"rgb Kd\" [0.5 0.5 0.5]", glow);
    for integrator in DIRECT {
        let lit = direct(integrator, 5, EYE, TOWARD, &world);
        assert_mean(&lit, 40_000, [0.5; 3], integrator);
        let up = direct(integrator, 5, [0.3, 0.35, 1.0], [0.0, 0.0, 1.0], &world);
        assert_mean(&up, 4, [0.0; 3], integrator);
    }
}
