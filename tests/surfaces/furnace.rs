//! Energy: uniform light stays uniform, sums of bounces are geometric, closed rooms are dark.

use crate::probe::{Probe, assert_exact, assert_mean};
use crate::solids::{V, box_shape, environment, seen_by};

const EYE: V = [0.13, 0.21, -5.0];
const AHEAD: V = [0.02, -0.03, 1.0];
const ONE: V = [1.0; 3];
const UNLIMITED: u32 = 100_000;

fn furnace(material: &str, shape: &str) -> String {
    let world = environment(ONE) + &format!("Material {material}\n{shape}");
    seen_by("path", UNLIMITED, EYE, AHEAD, &world)
}

#[test]
fn white_matte_bodies_vanish_in_a_uniform_sky() {
    let white = "\"matte\" \"rgb Kd\" [1 1 1]";
    let hollow = box_shape([-1.0, -1.0, 0.0], [1.0, 1.0, 2.0]).replace("0 6 4", "");
    for (shape, what) in [
        ("Shape \"sphere\"".to_owned(), "sphere"),
        (box_shape([-1.0; 3], ONE), "box"),
        (hollow, "box with a hole"),
        (
            "Shape \"sphere\" \"float zmin\" 0 Shape \"disk\"".to_owned(),
            "cup",
        ),
    ] {
        assert_mean(&furnace(white, &shape), 20_000, ONE, what);
    }
}

#[test]
fn rough_matte_bodies_reflect_no_more_than_they_receive() {
    let rough = "\"matte\" \"rgb Kd\" [1 1 1] \"float sigma\" 40";
    let mean = Probe::new(&furnace(rough, "Shape \"sphere\"")).means(20_000)[0].value;
    assert!((0.7..1.01).contains(&mean), "{mean}");
}

#[test]
fn mirrors_and_glass_vanish_in_a_uniform_sky() {
    let mirror = "\"mirror\" \"rgb Kr\" [1 1 1]";
    assert_exact(&furnace(mirror, "Shape \"sphere\""), ONE, "mirror ball");
    assert_exact(
        &furnace(mirror, "Shape \"sphere\" \"float phimax\" 200"),
        ONE,
        "mirror bowl",
    );
    for eta in [1.0, 1.0001, 1.33, 1.5, 2.4, 0.7] {
        let glass = format!("\"glass\" \"float eta\" {eta}");
        let nested = "Shape \"sphere\" Shape \"sphere\" \"float radius\" 0.5\n".to_owned()
            + &box_shape([-0.2; 3], [0.2; 3]);
        assert_mean(
            &furnace(&glass, "Shape \"sphere\""),
            5000,
            ONE,
            &format!("ball of {eta}"),
        );
        assert_mean(
            &furnace(&glass, &box_shape([-1.0; 3], ONE)),
            5000,
            ONE,
            &format!("box of {eta}"),
        );
        assert_mean(
            &furnace(&glass, &nested),
            20_000,
            ONE,
            &format!("nested {eta}"),
        );
    }
}

#[test]
fn bounces_in_a_glowing_ball_are_a_geometric_series() {
    // Seen from within, every wall point receives what every other sends out.
    let albedo = [0.5, 0.9, 0.2];
    let world = format!(
        "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] Material \"matte\" \"rgb Kd\" {albedo:?}\n\
         ReverseOrientation Shape \"sphere\" \"float radius\" 2\n"
    )
    .replace(',', "");
    let emitted = [1.0, 2.0, 3.0];
    for depth in [0, 1, 2, 5, UNLIMITED] {
        let expected = [0, 1, 2].map(|k| {
            let rho: f64 = albedo[k];
            emitted[k] * (1.0 - rho.powf(f64::from(depth) + 1.0)) / (1.0 - rho)
        });
        for integrator in ["path", "volpath"] {
            let scene = seen_by(integrator, depth, [0.3, 0.2, -0.7], AHEAD, &world);
            assert_mean(&scene, 50_000, expected, &format!("{depth} bounces"));
        }
    }
}

/// Mean radiance within a sealed white room under a bright sky.
fn leak(far: f64) -> f64 {
    let world = environment(ONE)
        + &format!("Material \"matte\" \"rgb Kd\" [1 1 1] Translate {far} {far} {far}\n")
        + &box_shape([-1.0; 3], ONE);
    let eye = [far + 0.125, far - 0.25, far];
    let scene = seen_by("path", 20, eye, AHEAD, &world);
    Probe::new(&scene).means(100_000)[0].value
}

#[test]
fn g04_no_light_enters_a_sealed_room() {
    for far in [0.0, 1e3, 1e4] {
        assert_eq!(leak(far), 0.0, "at {far}");
    }
}
