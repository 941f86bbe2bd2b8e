//! Light below surfaces against closed forms: what comes back over a plane, a ball and a stack of sheets.

use std::f64::consts::TAU;

use tyndall::math::Vec3;
use tyndall::scatter::diffusion::DiffusionTable;
use tyndall::scatter::{Bssrdf, TransportMode};
use tyndall::spectrum::Rgb;
use tyndall_test_support::z_test::Mean;

use crate::common::findings::findings;
use crate::common::probe::{Probe, assert_mean};
use crate::common::solids::{environment, seen_by};

const ONE: [f64; 3] = [1.0; 3];
const ETA: f32 = 1.33;

/// Reflectance head on.
fn head_on(eta: f64) -> f64 {
    ((eta - 1.0) / (eta + 1.0)).powi(2)
}

/// What the exit lobe makes of a uniform sky: 1 but for the fit of its normalisation.
fn exit_share(eta: f32) -> f64 {
    let exit = Bssrdf::exponential(eta, Rgb::ONE, Rgb::ONE).exit();
    let n = 20_000;
    let value = |k: i32| {
        let cos = (f64::from(k) + 0.5) / f64::from(n);
        let wi = Vec3::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
        f64::from(exit.f(wi, TransportMode::Importance)) * cos * TAU / f64::from(n)
    };
    (0..n).map(value).sum()
}

/// Radiance of a body of which the part `back` of what enters comes back, seen head on under a sky of radiance 1.
fn seen_head_on(back: [f64; 3]) -> [f64; 3] {
    let mirrored = head_on(ETA.into());
    back.map(|back| mirrored + (1.0 - mirrored) * back * exit_share(ETA))
}

/// A body of the material seen head on from −z.
fn body(material: &str, shape: &str, depth: u32) -> String {
    let world = environment(ONE) + &format!("Material {material}\n{shape}");
    seen_by("path", depth, [0.0, 0.0, -50.0], [0.0, 0.0, 1.0], &world)
}

#[test]
fn a_plane_sends_back_the_colour_asked_for() {
    let kd = [0.1, 0.5, 0.7];
    for mfp in ["0.01 0.02 0.005", "1e-7 0.02 0"] {
        let material = format!(
            "\"kdsubsurface\" \"rgb Kd\" [0.1 0.5 0.7] \"rgb mfp\" [{mfp}] \"float eta\" {ETA}"
        );
        for shape in [
            "ReverseOrientation Shape \"disk\" \"float radius\" 20",
            "Shape \"trianglemesh\" \"point P\" [-9 -9 0  9 -9 0  9 9 0  -9 9 0] \
             \"integer indices\" [0 2 1 0 3 2]",
        ] {
            let scene = body(&material, shape, 1);
            assert_mean(&scene, 40_000, seen_head_on(kd), &format!("{mfp}: {shape}"));
        }
    }
}

#[test]
fn a_ball_sends_back_its_profile_over_the_ball() {
    // The area of a ball between the distances d and d + δ from one of its points is 2πd δ, as on a plane.
    let (radius, sigma_a, sigma_s) = (0.5, [0.1, 0.4, 2.0], [1.0, 3.0, 20.0]);
    let material = format!(
        "\"subsurface\" \"rgb sigma_a\" [0.1 0.4 2] \"rgb sigma_s\" [1 3 20] \"float eta\" {ETA}"
    );
    let table = DiffusionTable::new(0.0, ETA.into());
    let [a, s] = [sigma_a, sigma_s].map(|v: [f32; 3]| Rgb::from_array(v));
    let medium = Bssrdf::tabulated(&table, ETA, a + s, s / (a + s));
    let n = 100_000;
    let back = [0, 1, 2].map(|c| {
        let h = 2.0 * radius / f64::from(n);
        let value = |k: i32| {
            let r = (f64::from(k) + 0.5) * h;
            f64::from(medium.sp(r as f32).to_array()[c]) * TAU * r * h
        };
        (0..n).map(value).sum()
    });
    let scene = body(
        &material,
        &format!("Shape \"sphere\" \"float radius\" {radius}"),
        1,
    );
    assert_mean(&scene, 60_000, seen_head_on(back), "ball");
    let by_path = Probe::new(&scene).means(2000);
    let by_volpath = Probe::new(&scene.replace("\"path\"", "\"volpath\"")).means(2000);
    assert_eq!(by_path[0].value, by_volpath[0].value);
}

#[test]
fn m08_a_stack_of_a_thousand_sheets_ends_and_adds_up() {
    // Below the first sheet all is dark: it alone sends light back, as if there were no other.
    let material =
        "\"kdsubsurface\" \"rgb Kd\" [.6 .6 .6] \"rgb mfp\" [.03 .03 .03] \"float eta\" 1.33";
    // A `height` of its own would give each sheet a material of its own.
    let sheet = "Shape \"disk\" \"float radius\" 30\nTranslate 0 0 0.001\n";
    let sheets = sheet.repeat(1000);
    let scene = body(material, &format!("ReverseOrientation\n{sheets}"), 1);
    assert_mean(&scene, 20_000, seen_head_on([0.6; 3]), "sheets");
}

#[test]
fn light_comes_back_from_surfaces_of_the_same_material_not_of_an_equal_one() {
    // Seen at the seam of two half planes: half of what enters comes back from either.
    let material = format!(
        "\"kdsubsurface\" \"rgb Kd\" [.6 .6 .6] \"rgb mfp\" [.03 .03 .03] \"float eta\" {ETA}"
    );
    let half = |side: i32, parameters: &str| {
        let (x0, x1) = ((9 * side).min(0), (9 * side).max(0));
        format!(
            "Shape \"trianglemesh\" \"point P\" [{x0} -9 0  {x1} -9 0  {x1} 9 0  {x0} 9 0] \
             \"integer indices\" [0 2 1 0 3 2] {parameters}\n"
        )
    };
    let (left, right) = (half(-1, ""), half(1, ""));
    let override_eta = format!("\"float eta\" {ETA}");
    let (private_left, private_right) = (half(-1, &override_eta), half(1, &override_eta));
    let parameters = material.trim_start_matches("\"kdsubsurface\"");
    let name =
        format!("MakeNamedMaterial \"skin\" \"string type\" \"kdsubsurface\" {parameters}\n");
    let named = |half: &str| format!("AttributeBegin NamedMaterial \"skin\" {half}AttributeEnd\n");
    for (shapes, back) in [
        (format!("{left}{right}"), 0.6),
        (name + &named(&left) + &named(&right), 0.6),
        (format!("{left}Material {material}\n{right}"), 0.3),
        (format!("{left}{private_right}"), 0.3),
        (format!("{private_left}{private_right}"), 0.3),
        (
            format!("ObjectBegin \"both\" {private_left}{right} ObjectEnd ObjectInstance \"both\""),
            0.3,
        ),
    ] {
        let scene = body(&material, &shapes, 1);
        assert_mean(&scene, 40_000, seen_head_on([back; 3]), &shapes);
    }
    let disney = "\"disney\" \"rgb color\" [.6 .6 .6] \"rgb scatterdistance\" [.1 .1 .1]";
    let override_color = "\"rgb color\" [.6 .6 .6]";
    let mean = |right: &str| Probe::new(&body(disney, &(left.clone() + right), 1)).means(40_000)[0];
    let (one, two) = (mean(&right), mean(&half(1, override_color)));
    assert!(two.value < 0.8 * one.value, "{one:?}, {two:?}");
}

#[test]
fn m07_extreme_coefficients_have_limits() {
    let plane = "ReverseOrientation Shape \"disk\" \"float radius\" 20";
    let black = seen_head_on([0.0; 3]);
    for material in [
        "\"kdsubsurface\" \"rgb Kd\" [0 0 0]",
        "\"kdsubsurface\" \"float scale\" 1e30",
        "\"subsurface\" \"float scale\" 1e-30",
    ] {
        assert_mean(&body(material, plane, 1), 2000, black, material);
    }
    for material in [
        "\"float scale\" 0",
        "\"float g\" 1",
        "\"rgb sigma_s\" [0 0 0]",
    ] {
        let scene = body(&format!("\"subsurface\" {material}"), plane, 1);
        let found = findings(&scene);
        assert!(
            found.iter().any(|(code, _)| code == "black-subsurface"),
            "{material}: {found:?}"
        );
    }
    for mfp in ["0", "1e-30"] {
        let material =
            format!("\"kdsubsurface\" \"rgb Kd\" [.5 .5 .5] \"rgb mfp\" [{mfp} {mfp} {mfp}]");
        assert_mean(
            &body(&material, plane, 1),
            20_000,
            seen_head_on([0.5; 3]),
            &material,
        );
    }
}

#[test]
fn how_far_light_wanders_below_a_plane_does_not_change_how_much_comes_back() {
    let plane = "ReverseOrientation Shape \"disk\" \"float radius\" 20";
    let mean = |distance: &str| {
        let material = format!(
            "\"disney\" \"rgb color\" [.4 .4 .4] \"rgb scatterdistance\" [{distance} {distance} {distance}]"
        );
        Probe::new(&body(&material, plane, 1)).means(100_000)[0]
    };
    let (near, far) = (mean("1e-6"), mean("0.1"));
    let noise = near.standard_error.hypot(far.standard_error);
    let difference = Mean {
        value: near.value - far.value,
        standard_error: noise,
    };
    difference.agrees_with(0.0).assert_accepted("disney plane");
    // What the diffuse part alone lets in and out.
    assert!(near.value > 0.3, "{}", near.value);
}
