//! Meshes with holes, and with parts that cast no shadow.

use std::f64::consts::PI;

use tyndall::compile::CompileOptions;
use tyndall_test_support::z_test::Mean;

use crate::common::probe::Probe;
use crate::common::scene::compile_scene;
use crate::common::solids::{V, environment, seen_by};

/// Eight texels in a row, the left half of them 0. Between the halves the value rises from texel to texel, so that
/// what is exactly 0 ends half a texel before the middle.
fn mask_file(name: &str) -> Option<Vec<u8>> {
    let texels = [0f32, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
    let mut file = b"Pf\n8 1\n-1.0\n".to_vec();
    file.extend(texels.iter().flat_map(|x| x.to_le_bytes()));
    (name == "mask.pfm").then_some(file)
}
/// Where the hole ends: u of the last texel of 0.
const HOLE: f64 = 3.5 / 8.0;

const MASK: &str = "Texture \"mask\" \"float\" \"imagemap\" \"string filename\" \"mask.pfm\" \"string wrap\" \"clamp\"\n";
const NOTHING: &str = "Texture \"nothing\" \"float\" \"constant\" \"float value\" 0\n";
const BLACK: &str = "Material \"matte\" \"rgb Kd\" [0 0 0]\n";
const LAMP: &str = "AreaLightSource \"diffuse\" \"rgb L\" [2 2 2] \"bool twosided\" \"true\"\n";

/// A square of side 2 at z = 0; u grows along x.
fn square(parameters: &str) -> String {
    format!(
        "Shape \"trianglemesh\" \"point P\" [-1 -1 0  1 -1 0  1 1 0  -1 1 0] \
         \"point2 uv\" [0 0  1 0  1 1  0 1] \"integer indices\" [0 1 2  0 2 3] {parameters}\n"
    )
}

/// A white floor at z = −1.
const FLOOR: &str = "AttributeBegin Material \"matte\" \"rgb Kd\" [1 1 1] Translate 0 0 -1 Shape \"disk\" \"float radius\" 50 AttributeEnd\n";

fn probe(integrator: &str, eye: V, toward: V, world: &str) -> Probe {
    let text = format!(
        "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\nPixelFilter \"box\"\n{}",
        seen_by(integrator, 1, eye, toward, world)
    );
    Probe::of(compile_scene(text, &CompileOptions::default(), mask_file).job)
}

/// What is seen of the point (x, 0) of the square from above, or of the floor below it from between.
fn seen(integrator: &str, x: f64, floor: bool, world: &str) -> f32 {
    let z = if floor { -0.5 } else { 0.5 };
    probe(integrator, [x, 0.01, z], [0.0, 0.0, -1.0], world).samples(1)[0][0]
}

/// Mean radiance of the floor below the middle of the square.
fn floor_mean(integrator: &str, world: &str) -> Mean {
    let world = format!("{FLOOR}{world}");
    probe(integrator, [0.0, 0.0, -0.5], [0.0, 0.0, -1.0], &world).means(60_000)[0]
}

#[track_caller]
fn assert_floor(integrator: &str, expected: f64, world: &str) {
    floor_mean(integrator, world)
        .agrees_with(expected)
        .assert_accepted(&format!("{integrator}: {world}"));
}

/// Form factor of a rectangle from a corner to (x, y), one unit above a parallel floor below that corner.
fn quadrant(x: f64, y: f64) -> f64 {
    let (p, q) = (1f64.hypot(x), 1f64.hypot(y));
    (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
}

#[test]
fn a_mesh_has_holes_where_its_mask_is_exactly_zero() {
    let world = format!(
        "{MASK}{}{BLACK}{}",
        environment([1.0; 3]),
        square("\"texture alpha\" \"mask\"")
    );
    for integrator in ["path", "volpath"] {
        for (u, radiance) in [
            (0.1, 1.0),
            (HOLE - 0.01, 1.0),
            (HOLE + 0.01, 0.0),
            (0.9, 0.0),
        ] {
            let x = 2.0 * u - 1.0;
            assert_eq!(
                seen(integrator, x, false, &world),
                radiance,
                "{integrator}, u {u}"
            );
        }
    }
}

#[test]
fn light_falls_through_holes() {
    let sun = format!(
        "LightSource \"distant\" \"point from\" [0 0 1] \"point to\" [0 0 0] \"rgb L\" [{PI} {PI} {PI}]\n"
    );
    let world = format!(
        "{MASK}{FLOOR}{sun}{BLACK}{}",
        square("\"texture alpha\" \"mask\"")
    );
    for integrator in ["path", "volpath"] {
        for (u, lit) in [
            (0.1, 1.0),
            (HOLE - 0.01, 1.0),
            (HOLE + 0.01, 0.0),
            (0.9, 0.0),
        ] {
            let radiance = seen(integrator, 2.0 * u - 1.0, true, &world);
            assert!(
                (radiance - lit).abs() < 1e-5,
                "{integrator}, u {u}: {radiance}"
            );
        }
    }
}

#[test]
fn masks_in_copies_are_those_of_the_object() {
    let one = format!("{BLACK}{}", square("\"texture alpha\" \"mask\""));
    let world = format!(
        "{MASK}{}ObjectBegin \"a\" {one} ObjectEnd ObjectInstance \"a\"\n\
         Translate 0 0 -0.2 ObjectInstance \"a\"\n",
        environment([1.0; 3])
    );
    assert_eq!(seen("path", -0.8, false, &world), 1.0);
    assert_eq!(seen("path", 0.8, false, &world), 0.0);
}

#[test]
fn a_mask_of_one_value_is_all_or_nothing() {
    for (parameters, radiance) in [
        ("\"float alpha\" 0.5", 0.0),
        ("\"float alpha\" 0", 1.0),
        ("\"texture alpha\" \"nothing\"", 1.0),
        ("\"float shadowalpha\" 0", 0.0),
    ] {
        let sky = environment([1.0; 3]);
        let world = format!("{NOTHING}{sky}{BLACK}{}", square(parameters));
        assert_eq!(seen("path", 0.3, false, &world), radiance, "{parameters}");
    }
}

#[test]
fn shadow_masks_are_for_the_shadows_of_integrators_that_ignore_media() {
    let sun = format!(
        "LightSource \"distant\" \"point from\" [0 0 1] \"point to\" [0 0 0] \"rgb L\" [{PI} {PI} {PI}]\n"
    );
    let world = format!(
        "{MASK}{FLOOR}{sun}{BLACK}{}",
        square("\"texture shadowalpha\" \"mask\"")
    );
    for (integrator, u, lit) in [
        ("path", 0.1, 1.0),
        ("path", 0.9, 0.0),
        ("directlighting", 0.1, 1.0),
        ("directlighting", 0.9, 0.0),
        ("whitted", 0.1, 1.0),
        ("sppm", 0.1, 1.0),
        ("volpath", 0.1, 0.0),
        ("bdpt", 0.1, 0.0),
    ] {
        let radiance = seen(integrator, 2.0 * u - 1.0, true, &world);
        assert!(
            (radiance - lit).abs() < 1e-5,
            "{integrator}, u {u}: {radiance}"
        );
        // The camera meets it.
        assert_eq!(seen(integrator, 2.0 * u - 1.0, false, &world), 0.0);
    }
}

#[test]
fn both_halves_of_light_sampling_pass_what_casts_no_shadow() {
    let full = 4.0 * quadrant(1.0, 1.0);
    let sky = environment([1.0; 3]);
    let shield = square("\"float shadowalpha\" 0");
    assert_floor("path", 1.0, &format!("{sky}{BLACK}{shield}"));
    assert_floor("volpath", 1.0 - full, &format!("{sky}{BLACK}{shield}"));
    // A lamp above the shield, and a lamp that is none to others.
    let above = format!(
        "AttributeBegin {LAMP}{BLACK}Scale 2 2 2 Translate 0 0 0.5 {} AttributeEnd\n",
        square("")
    );
    let twice = 4.0 * quadrant(1.0, 1.0);
    assert_floor("path", 2.0 * twice, &format!("{above}{BLACK}{shield}"));
    assert_floor(
        "path",
        1.0 + full,
        &format!("{sky}{LAMP}{BLACK}{}", square("")),
    );
    assert_floor(
        "path",
        1.0 + 2.0 * full,
        &format!("{sky}{LAMP}{BLACK}{shield}"),
    );
}

/// What the hole of the square, were it there, gives the floor by points that are drawn on it: of its form factor the part w
/// by which pbrt-v3 weighs those. Each of its two triangles is a lamp of area 2.
fn drawn_in_hole() -> f64 {
    let n = 1000;
    let middle = |i: usize| (i as f64 + 0.5) / n as f64;
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let (x, y) = (2.0 * HOLE * middle(i) - 1.0, 2.0 * middle(j) - 1.0);
            let squared = 1.0 + x * x + y * y;
            let cos = 1.0 / squared.sqrt();
            let w = 1.0 / (1.0 + (cos / PI * 2.0 * cos / squared).powi(2));
            sum += w / (PI * squared * squared);
        }
    }
    sum * 4.0 * HOLE / (n * n) as f64
}

#[test]
fn a_lamp_with_holes_shows_what_is_there_and_is_drawn_as_a_whole() {
    let gone = 1.0 - 2.0 * HOLE;
    let left = 2.0 * (quadrant(1.0, 1.0) + quadrant(gone, 1.0)) + drawn_in_hole();
    for integrator in ["path", "volpath"] {
        let world = format!(
            "{MASK}{LAMP}{BLACK}{}",
            square("\"texture alpha\" \"mask\"")
        );
        assert_floor(integrator, 2.0 * left, &world);
        let world = format!(
            "{MASK}{LAMP}Material \"\" {}",
            square("\"texture alpha\" \"mask\"")
        );
        assert_floor(integrator, 2.0 * left, &world);
    }
}
