//! Chains of mirrors and glass.

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::seen::{environment, seen_by};
use crate::direct_lighting::lights::{DIRECT, direct};

const EYE: [f64; 3] = [0.1, 0.2, 0.0];
const AHEAD: [f64; 3] = [0.0, 0.0, 1.0];

fn disk(z: f64, what: &str) -> String {
    format!(
        "AttributeBegin {what} Translate 0 0 {z} Shape \"disk\" \"float radius\" 9 AttributeEnd\n"
    )
}

#[test]
fn mirrors_face_to_face_show_each_level_that_counts() {
    // Both mirrors glow toward each other: level k adds k + 1 reflectances.
    let mirror = |z: f64, turn: &str| {
        disk(
            z,
            &format!(
                "AreaLightSource \"diffuse\" \"rgb L\" [1 2 4] \"bool twosided\" \"true\"\n\
                 Material \"mirror\" \"rgb Kr\" [0.5 0.25 0.75] {turn}"
            ),
        )
    };
    let world = mirror(1.0, "") + &mirror(-1.0, "");
    for integrator in DIRECT {
        for depth in [0, 1, 2, 5] {
            let sum = |kr: f64| (0..depth.max(1)).map(|k| kr.powi(k as i32)).sum::<f64>();
            let expected = [sum(0.5), 2.0 * sum(0.25), 4.0 * sum(0.75)];
            let scene = direct(integrator, depth, EYE, AHEAD, &world);
            assert_exact(&scene, expected, &format!("{integrator} {depth}"));
        }
        // Without end: 1 / (1 - Kr), by chance beyond the levels that are followed for certain.
        let scene = direct(integrator, 1000, EYE, AHEAD, &world);
        let expected = [2.0, 2.0 / 0.75, 16.0];
        assert_mean(&scene, 20_000, expected, &format!("{integrator} deep"));
    }
}

#[test]
fn a_pane_shows_both_what_it_reflects_and_what_is_behind() {
    // A sheet seen head on from its vacuum side: reflectance ((η-1)/(η+1))², the rest compressed by 1/η².
    let pane = disk(
        -1.0,
        "Material \"glass\" \"float eta\" 1.5 Rotate 180 1 0 0",
    );
    let front = disk(-1.0, "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3]");
    let behind = disk(
        2.0,
        "AreaLightSource \"diffuse\" \"rgb L\" [5 7 11] \"bool twosided\" \"true\"",
    );
    let world = pane + &front + &behind;
    for integrator in DIRECT {
        let scene = direct(integrator, 2, EYE, AHEAD, &world);
        let (r, t) = (0.04, 0.96 / 2.25);
        let expected = [r + 5.0 * t, 2.0 * r + 7.0 * t, 3.0 * r + 11.0 * t];
        assert_exact(&scene, expected, integrator);
    }
}

#[test]
fn n02_glass_in_glass_is_transparent_to_a_furnace() {
    // Nothing absorbs: whatever way light goes, it is 1; compression undoes itself on the way out.
    let balls: String = [1.0, 0.8, 0.6]
        .map(|radius| {
            format!(
                "Material \"glass\" \"float eta\" 1.3 Shape \"sphere\" \"float radius\" {radius}\n"
            )
        })
        .concat();
    let world = environment([1.0; 3]) + &balls;
    for integrator in ["directlighting one", "whitted"] {
        let scene = direct(integrator, 400, [0.1, 0.35, -3.0], AHEAD, &world);
        assert_mean(&scene, 3000, [1.0; 3], integrator);
    }
}

#[test]
fn chains_agree_with_paths_where_these_can_do_nothing_else() {
    // Glass and mirrors around emitters: without diffuse surfaces a path is a chain.
    let world = environment([0.3, 0.4, 0.5])
        + "Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\"\n"
            .replace("Material \"mix\"", "MakeNamedMaterial \"a\" \"string type\" \"glass\" \"float eta\" 1.4 \"rgb Kt\" [0.9 0.6 0.3]\nMakeNamedMaterial \"b\" \"string type\" \"uber\" \"rgb Kd\" [0 0 0] \"rgb Ks\" [0 0 0] \"rgb opacity\" [0.5 0.5 0.5] \"rgb Kr\" [0.4 0.4 0.4] \"rgb Kt\" [0.2 0.2 0.2]\nMaterial \"mix\"")
            .as_str()
        + "Shape \"sphere\" \"float radius\" 0.7\n"
        + &disk(3.0, "AreaLightSource \"diffuse\" \"rgb L\" [5 7 11] \"bool twosided\" \"true\" Material \"mirror\"");
    let depth = 7;
    let eye = [0.1, 0.25, -3.0];
    let paths = Probe::new(&seen_by("path", depth, eye, AHEAD, &world)).means(200_000);
    for integrator in DIRECT {
        let scene = direct(integrator, depth + 1, eye, AHEAD, &world);
        let chains = Probe::new(&scene).means(2000);
        for (chains, paths) in chains.iter().zip(&paths) {
            chains.agrees_with_mean(paths).assert_accepted(integrator);
            // Chains that split show far less noise, sample for sample.
            assert!(
                chains.standard_error < 3.0 * paths.standard_error,
                "{chains:?} {paths:?}"
            );
        }
    }
}
