//! Ambient occlusion in closed form.

use std::f64::consts::PI;

use crate::common::probe::{assert_exact, assert_mean};
use crate::common::seen::{V, seen_by};

const EYE: V = [0.2, 0.1, 0.5];
const DOWN: V = [0.0, 0.0, -1.0];

fn scene(parameters: &str, eye: V, toward: V, world: &str) -> String {
    let scene = seen_by("path", 1, eye, toward, world);
    let end = scene.find('\n').expect("the first line is the integrator");
    format!(
        "Integrator \"ambientocclusion\" {parameters}{}",
        &scene[end..]
    )
}

const FLOOR: &str = "Shape \"disk\" \"float radius\" 50\n";
const SAMPLINGS: [&str; 3] = [
    "\"integer nsamples\" 16",
    "\"integer nsamples\" 7 \"bool cossample\" \"false\"",
    "\"integer nsamples\" 1",
];

#[test]
fn of_an_open_floor_is_pi_and_of_nothing_0() {
    assert_exact(&scene(SAMPLINGS[0], EYE, DOWN, FLOOR), [PI; 3], "cosine");
    assert_exact(
        &scene(SAMPLINGS[0], EYE, [0.0, 0.0, 1.0], FLOOR),
        [0.0; 3],
        "sky",
    );
    // From below, by the side that is seen.
    let below = [0.2, 0.1, -0.5];
    assert_exact(
        &scene(SAMPLINGS[0], below, [0.0, 0.0, 1.0], FLOOR),
        [PI; 3],
        "from below",
    );
    let uniform = scene(SAMPLINGS[1], EYE, DOWN, FLOOR);
    assert_mean(&uniform, 20_000, [PI; 3], "uniform");
}

#[test]
fn below_a_ball_is_what_the_ball_leaves_open() {
    // A ball of radius r whose centre is at distance d above the point covers π (r / d)².
    let ball = "Translate 0.2 0.1 2 Shape \"sphere\" \"float radius\" 1\n";
    for sampling in SAMPLINGS {
        let scene = scene(sampling, EYE, DOWN, &format!("{FLOOR}{ball}"));
        assert_mean(&scene, 20_000, [PI * 0.75; 3], sampling);
    }
}

#[test]
fn in_a_corner_is_what_the_wall_leaves_open() {
    // An endless wall at distance a and of height h covers (π / 2) (1 - a / √(a² + h²)).
    let wall = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3]\n\
        \"point P\" [0.5 -9000 0  0.5 9000 0  0.5 9000 0.4  0.5 -9000 0.4]\n";
    let open = PI - 0.5 * PI * (1.0 - 0.3 / 0.5);
    for sampling in SAMPLINGS {
        let scene = scene(sampling, EYE, DOWN, &format!("{FLOOR}{wall}"));
        assert_mean(&scene, 20_000, [open; 3], sampling);
    }
}

#[test]
fn null_surfaces_are_looked_through_and_stand_in_the_way() {
    let sheet = "Material \"\" Translate 0 0 0.3 Shape \"disk\" \"float radius\" 0.4\n";
    // Off the axis of the sheet: the form factor of a disk parallel to the receiver.
    let (h2, r2, a2) = (0.09, 0.16, 0.05f64);
    let t = h2 + r2 + a2;
    let covered = 0.5 * PI * (1.0 - (h2 + a2 - r2) / (t * t - 4.0 * r2 * a2).sqrt());
    let scene = scene(SAMPLINGS[0], EYE, DOWN, &format!("{FLOOR}{sheet}"));
    assert_mean(&scene, 20_000, [PI - covered; 3], "below a null sheet");
}
