//! What arrives through media unscattered.

use crate::common::probe::{Probe, assert_exact, assert_mean, assert_within};
use crate::common::solids::{V, environment, homogeneous, null_box, null_sphere, volpath};
use crate::media::nebula::Nebula;

const WHITE: V = [1.0; 3];
const NOTHING: V = [0.0; 3];
/// Off the diagonals of the boxes' faces.
const EYE: V = [0.13, 0.21, -5.0];
const AHEAD: V = [0.0, 0.0, 1.0];

fn beer_lambert(sigma: V, distance: f64) -> V {
    sigma.map(|s| (-s * distance).exp())
}

fn times(a: V, b: V) -> V {
    [0, 1, 2].map(|k| a[k] * b[k])
}

/// A slab of `depth` along z that nothing passes by.
fn slab(medium: &str, depth: f64) -> String {
    null_box([-50.0, -50.0, 0.0], [50.0, 50.0, depth], medium, "")
}

#[test]
fn an_absorbing_slab_is_beer_lambert_without_noise() {
    let (sigma, sky) = ([0.3, 1.1, 2.5], [2.0, 3.0, 5.0]);
    let fog = homogeneous("fog", sigma, NOTHING, 0.0) + &environment(sky) + &slab("fog", 1.7);
    let expected = times(sky, beer_lambert(sigma, 1.7));
    assert_exact(&volpath(5, EYE, AHEAD, &fog), expected, "head on");
    // At an angle of arccos(0.6) the way is 1 / 0.6 as long.
    let expected = times(sky, beer_lambert(sigma, 1.7 / 0.6));
    let oblique = volpath(5, EYE, [0.8, 0.0, 0.6], &fog);
    assert_exact(&oblique, expected, "oblique");
}

#[test]
fn the_presets_and_scale_are_per_world_unit() {
    // Coca-Cola: coefficients of Narasimhan et al. 2006, in 1/mm, of a scene in centimetres.
    let (sigma_a, sigma_s) = ([0.10014, 0.16503, 0.2468], [8.9053e-05, 8.372e-05, 0.0]);
    let fog = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"string preset\" \"Coke\" \
               \"float scale\" 10\n"
        .to_owned()
        + &lamp_in_fog(2.0);
    let expected = [0, 1, 2].map(|k| (-10.0 * (sigma_a[k] + sigma_s[k]) * 2.0f64).exp());
    assert_mean(&volpath(0, [0.0; 3], AHEAD, &fog), 20_000, expected, "Coke");
}

/// A lamp that shines back at the camera from a distance, everything in fog. The directives at the world's end
/// decide the medium of the camera.
fn lamp_in_fog(distance: f64) -> String {
    format!(
        "MediumInterface \"\" \"fog\"\n\
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n\
         Translate 0 0 {distance} Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 3\nAttributeEnd\n"
    )
}

#[test]
fn a_scattering_medium_extinguishes_by_both_coefficients() {
    let (sigma_a, sigma_s) = ([0.1, 0.5, 0.9], [1.2, 0.4, 0.05]);
    let fog = homogeneous("fog", sigma_a, sigma_s, 0.5) + &lamp_in_fog(1.5);
    let sigma_t = [0, 1, 2].map(|k| sigma_a[k] + sigma_s[k]);
    let expected = beer_lambert(sigma_t, 1.5);
    let scene = volpath(0, [0.0; 3], AHEAD, &fog);
    assert_mean(&scene, 100_000, expected, "no bounces");
}

#[test]
fn a_scattering_grid_extinguishes_by_both_coefficients() {
    let (sigma_a, sigma_s) = ([0.1, 0.5, 0.9], [1.2, 0.4, 0.05]);
    let nebula = Nebula::ragged([5, 4, 6], [-2.0, -2.0, -1.0], [2.0, 2.0, 3.0]);
    let fog = nebula.medium("fog", sigma_a, sigma_s, 0.5) + &lamp_in_fog(2.5);
    // The column from the camera to the lamp: what lies ahead of the camera, less what lies behind the lamp.
    let column = nebula.column([0.0; 3], AHEAD) - nebula.column([0.0, 0.0, 2.5], AHEAD);
    let expected = [0, 1, 2].map(|k| (-(sigma_a[k] + sigma_s[k]) * column).exp());
    let scene = volpath(0, [0.0; 3], AHEAD, &fog);
    assert_mean(&scene, 200_000, expected, "no bounces");
}

#[test]
fn v10_grids_fade_over_the_outer_half_cell() {
    let (lo, hi) = ([-1.0; 3], [1.0; 3]);
    for n in [1, 2, 3, 8] {
        let nebula = Nebula::uniform([n; 3], 1.0, lo, hi);
        let world = nebula.medium("fog", [0.5, 1.0, 1.5], NOTHING, 0.0)
            + &environment(WHITE)
            + &null_box([-1.5; 3], [1.5; 3], "fog", "");
        for (eye, toward) in [
            ([0.0, 0.0, -5.0], AHEAD),
            ([0.13, 0.71, -5.0], AHEAD),
            ([0.9, 0.3, -5.0], [-0.2, 0.05, 1.0]),
        ] {
            let column = nebula.column(eye, toward);
            let expected = [0.5, 1.0, 1.5].map(|s| (-s * column).exp());
            let scene = volpath(5, eye, toward, &world);
            assert_mean(&scene, 100_000, expected, &format!("n = {n}"));
        }
    }
}

#[test]
fn v09_grids_take_coloured_extinction() {
    let nebula = Nebula::ragged([7, 3, 5], [-1.0, -0.5, 0.0], [1.0, 1.5, 3.0]);
    let sigma = [0.2, 1.0, 3.0];
    let world = nebula.medium("fog", sigma, NOTHING, 0.0)
        + &environment(WHITE)
        + &null_box([-1.2, -0.6, -0.1], [1.1, 1.6, 3.3], "fog", "");
    for toward in [AHEAD, [0.05, 0.1, 1.0], [-0.1, 0.02, 1.0]] {
        let column = nebula.column(EYE, toward);
        let expected = sigma.map(|s| (-s * column).exp());
        let scene = volpath(5, EYE, toward, &world);
        assert_mean(&scene, 200_000, expected, "ragged grid");
    }
}

#[test]
fn a_grid_under_a_transform_keeps_its_coefficients_per_world_unit() {
    // Twice as deep in the world: twice the optical depth.
    let nebula = Nebula::uniform([4, 4, 4], 1.0, [-1.0; 3], [1.0; 3]);
    let world = format!(
        "AttributeBegin Scale 3 3 2 {} AttributeEnd\n",
        nebula.medium("fog", [0.5, 1.0, 0.2], NOTHING, 0.0)
    ) + &environment(WHITE)
        + &null_box([-4.0, -4.0, -2.5], [4.0, 4.0, 2.5], "fog", "");
    let column = 2.0 * nebula.column([EYE[0] / 3.0, EYE[1] / 3.0, -5.0], AHEAD);
    let expected = [0.5, 1.0, 0.2].map(|s: f64| (-s * column).exp());
    let scene = volpath(5, EYE, AHEAD, &world);
    assert_mean(&scene, 100_000, expected, "stretched");
}

#[test]
fn n02_light_behind_twenty_optical_depths_arrives() {
    let fog = homogeneous("fog", [20.0, 20.0, 20.0], NOTHING, 0.0)
        + &environment([1e10; 3])
        + &slab("fog", 1.0);
    let expected = 1e10 * (-20f64).exp();
    assert!((expected - 20.6).abs() < 0.02);
    let scene = volpath(5, EYE, AHEAD, &fog);
    // Both ends of the slab are less than 8 units away, their distances known to a unit or so in the last place.
    let tolerance = 20.0 * 3.0 * 2f64.powi(-21);
    assert_within(&scene, [expected; 3], tolerance, "optical depth 20");
}

#[test]
fn v12_deep_media_are_dark_and_finite() {
    for (depth, sigma_s) in [
        (80.0, 0.0),
        (90.0, 0.0),
        (1e3, 0.0),
        (1e5, 0.0),
        (90.0, 0.5),
    ] {
        let absorbing = [depth * (1.0 - sigma_s); 3];
        let scattering = [depth * sigma_s, 0.0, depth * sigma_s * 0.1];
        let world = homogeneous("fog", absorbing, scattering, 0.3)
            + &environment(WHITE)
            + &slab("fog", 1.0);
        let samples = Probe::new(&volpath(3, EYE, AHEAD, &world)).samples(4000);
        for sample in samples {
            assert!(
                sample.iter().all(|c| c.is_finite() && *c >= 0.0),
                "optical depth {depth}: {sample:?}"
            );
            if sigma_s == 0.0 {
                let expected = (-depth).exp();
                let error = (f64::from(sample[1]) - expected).abs();
                assert!(error <= 1e-4 * expected || expected < 1e-37, "{sample:?}");
            }
        }
    }
}

#[test]
fn v03_a_camera_in_a_declared_medium_is_in_it() {
    let world = homogeneous("fog", [0.2, 0.1, 0.4], NOTHING, 0.0)
        + &environment(WHITE)
        + "MediumInterface \"\" \"fog\"\n"
        + &null_sphere([0.0, 0.0, 5.0], 10.0, "fog", "");
    let expected = [0.2, 0.1, 0.4].map(|s: f64| (-s * 15.0).exp());
    let scene = volpath(5, [0.0; 3], AHEAD, &world);
    assert_exact(&scene, expected, "15 units to the far wall");
}

#[test]
fn v02_light_sampling_meets_the_sky_behind_two_radii_of_boundless_fog_and_nothing_else_does() {
    // The rule of fidelity comes first here: published scenes are lit that way, so that what is unseen counts.
    let sigma = 1e-3;
    let fog = homogeneous("fog", [sigma; 3], NOTHING, 0.0) + "MediumInterface \"\" \"fog\"\n";
    let floor = "Translate 0 0 4 Shape \"disk\" \"float radius\" 2 Translate 0 0 -4\n";
    let unseen = "Translate 0 1000 0 Shape \"sphere\"\n";
    let sun = "LightSource \"distant\" \"rgb L\" [1 1 1] \"point to\" [0 0 1]\n";
    let alone = 2f64.hypot(2.0);
    let together = 2f64.hypot(501.5).hypot(2.5);
    for (extra, radius) in [("", alone), (unseen, together)] {
        let world = fog.clone() + sun + "MediumInterface \"fog\" \"fog\"\n" + floor + extra;
        let lit = 0.5 / std::f64::consts::PI * (-sigma * (4.0 + 2.0 * radius)).exp();
        let scene = volpath(5, [0.0; 3], AHEAD, &world);
        assert_exact(&scene, [lit; 3], "a floor in the sun");
    }
    let world = fog + &environment(WHITE) + "MediumInterface \"fog\" \"fog\"\n" + floor;
    let scene = volpath(5, [0.0; 3], [0.0, 1.0, 0.0], &world);
    assert_exact(&scene, [0.0; 3], "the sky itself");
}

#[test]
fn lamps_beyond_the_horizon_of_boundless_fog_shine_through_all_of_it() {
    // Fog ends for the sky, not for a lamp that stands farther away than the surfaces reach.
    let sigma = 1e-2;
    let distance = 100.0;
    let world = homogeneous("fog", [sigma; 3], NOTHING, 0.0)
        + "MediumInterface \"\" \"fog\"\n\
           LightSource \"point\" \"rgb I\" [1e4 1e4 1e4] \"point from\" [0 0 -96]\n\
           MediumInterface \"fog\" \"fog\"\n\
           Translate 0 0 4 Shape \"disk\" \"float radius\" 2\n";
    let lit = 1e4 / (distance * distance) * 0.5 / std::f64::consts::PI
        * (-sigma * (4.0 + distance)).exp();
    let scene = volpath(5, [0.0; 3], AHEAD, &world);
    assert_exact(&scene, [lit; 3], "a lamp far away");
}
