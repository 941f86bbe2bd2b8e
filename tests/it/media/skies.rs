//! Grids under skies that are maps: directions are drawn by what comes through the grid to a place.

use tyndall::compile::CompileOptions;
use tyndall::ids::{LightId, MediumId};
use tyndall::light::Wanted;
use tyndall::math::Point3;
use tyndall::world::{LightStrategy, World};

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::scene::compile_scene;
use crate::common::solids::{V, homogeneous, null_box, null_sphere, seen_by};
use crate::media::nebula::Nebula;

const FILM: &str =
    "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\nPixelFilter \"box\"\n";
pub(crate) const SKY: &str = "AttributeBegin Rotate 40 1 2 3 LightSource \"infinite\" \"string mapname\" \"sky.pfm\" AttributeEnd\n";
const EYE: V = [0.13, 0.21, -5.0];
const AHEAD: V = [0.0, 0.0, 1.0];

/// A sky with a bright part, each half of it of its own colour.
pub(crate) fn map() -> Vec<u8> {
    let (width, height) = (32, 16);
    let mut file = format!("PF\n{width} {height}\n-1\n").into_bytes();
    for i in 0..width * height {
        let (x, y) = (i % width, i / width);
        let level = if (20..24).contains(&x) && (9..12).contains(&y) {
            40.0
        } else {
            0.3
        };
        let tint = if y < 8 {
            [0.5f32, 1.0, 2.0]
        } else {
            [1.5, 1.0, 0.2]
        };
        file.extend(tint.iter().flat_map(|c| (c * level).to_le_bytes()));
    }
    file
}

fn probe(scene: &str) -> Probe {
    let text = format!("{FILM}{scene}");
    let read = |name: &str| (name == "sky.pfm").then(map);
    Probe::of(compile_scene(text, &CompileOptions::default(), read).job)
}

fn cloud(sigma_s: V) -> String {
    Nebula::ragged([9, 8, 10], [-1.0; 3], [1.0; 3]).medium("cloud", [0.1; 3], sigma_s, 0.3)
}

#[test]
fn drawing_by_what_comes_through_changes_no_picture() {
    // Paths from both ends draw all of the sky alike.
    let wall = null_box([-1.0; 3], [1.0; 3], "cloud", "");
    let pane =
        "AttributeBegin Material \"glass\" Translate 0 0 -2.5 Shape \"sphere\" AttributeEnd\n";
    let other = homogeneous("other", [1.0; 3], [1.0; 3], 0.0)
        + &null_sphere([1.5, 0.0, -0.5], 0.4, "other", "");
    for (what, sigma_s, rest) in [
        ("thin", [1.0; 3], ""),
        ("thick, coloured", [4.0, 8.0, 3.0], ""),
        ("behind glass", [2.0; 3], pane),
        ("beside fog", [4.0; 3], &other),
    ] {
        let world = format!("{SKY}{}{wall}{rest}", cloud(sigma_s));
        let means =
            |integrator: &str| probe(&seen_by(integrator, 4, EYE, AHEAD, &world)).means(200_000);
        let (ours, others) = (means("volpath"), means("bdpt"));
        for (a, b) in ours.iter().zip(&others) {
            a.agrees_with_mean(b).assert_accepted(what);
        }
    }
}

/// A floor under an even sky, in an absorber without an end, and what of the sky it shows: light that is drawn comes through
/// two radii of the scene and counts w, light that is found comes through all of the absorber. The axis of the sky is
/// the normal of the floor, or lies across it.
fn floor_in_absorber(turn: &str) -> String {
    let absorber = "MakeNamedMedium \"dark\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [.1 .3 0] \
                    \"rgb sigma_s\" [0 0 0]\n";
    let floor =
        "AttributeBegin Material \"matte\" \"rgb Kd\" [.5 .5 .5] Shape \"disk\" AttributeEnd\n";
    let sky =
        format!("AttributeBegin {turn} LightSource \"infinite\" \"rgb L\" [2 2 2] AttributeEnd\n");
    format!("{absorber}{sky}{floor}MediumInterface \"\" \"dark\"")
}

#[test]
fn a_sky_that_is_drawn_comes_through_two_radii_of_an_endless_medium() {
    use std::f64::consts::{PI, TAU};
    let n = 2000;
    let middle = |i: usize| (i as f64 + 0.5) / n as f64;
    for (turn, is_across) in [("", false), ("Rotate 90 1 0 0", true)] {
        let mut drawn = 0.0;
        for i in 0..n {
            for j in 0..n {
                let cos = middle(i);
                let sin = (1.0 - cos * cos).sqrt();
                // Of the angle to the axis of the sky.
                let sin_axis = if is_across {
                    let along = sin * (TAU * middle(j)).cos();
                    (1.0 - along * along).sqrt()
                } else {
                    sin
                };
                let (light, lobe) = (1.0 / (2.0 * PI * PI * sin_axis), cos / PI);
                let w = 1.0 / (1.0 + (lobe / light).powi(2));
                drawn += 2.0 * cos * w / (n * n) as f64;
            }
        }
        let (all, distance, diameter) = (1.0, 0.5, 8f64.sqrt());
        let expected = [0.1, 0.3, 0.0].map(|sigma: f64| {
            let found = if sigma > 0.0 { 0.0 } else { 1.0 - drawn };
            all * (drawn * (-sigma * diameter).exp() + found) * (-sigma * distance).exp()
        });
        let world = floor_in_absorber(turn);
        for integrator in ["volpath", "bdpt", "mlt"] {
            let scene = seen_by(integrator, 1, [0.1, 0.2, 0.5], [0.0, 0.0, -1.0], &world);
            assert_mean(&scene, 60_000, expected, &format!("{integrator}, {turn}"));
        }
    }
}

/// A floor in vacuum under an even sky, and above a point of it a null disk beyond which an absorber begins and does not end.
const BEHIND_A_PANE: &str = "MakeNamedMedium \"dark\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [.1 .3 0] \"rgb sigma_s\" [0 0 0]\n\
     LightSource \"infinite\" \"rgb L\" [2 2 2]\n\
     AttributeBegin Material \"matte\" \"rgb Kd\" [.5 .5 .5] Shape \"disk\" \"float radius\" 4 AttributeEnd\n\
     AttributeBegin MediumInterface \"\" \"dark\" Material \"\" Translate 0 0 1 Shape \"disk\" AttributeEnd\n";

#[test]
fn skies_are_weighed_by_where_rays_leave_the_scene() {
    use std::f64::consts::PI;
    let n = 100_000;
    let (mut clear, mut dimmed) = (0.0, [0.0; 3]);
    for i in 0..n {
        let cos: f64 = (f64::from(i) + 0.5) / f64::from(n);
        let value = 2.0 * cos / f64::from(n);
        if cos * cos < 0.5 {
            clear += value;
            continue;
        }
        let (light, lobe) = (1.0 / (2.0 * PI * PI * (1.0 - cos * cos).sqrt()), cos / PI);
        let w = 1.0 / (1.0 + (lobe / light).powi(2));
        // Two radii of the scene, less the way to the disk.
        let length = 129f64.sqrt() - 1.0 / cos;
        for (sum, sigma) in dimmed.iter_mut().zip([0.1, 0.3, 0.0f64]) {
            let found = if sigma > 0.0 { 0.0 } else { 1.0 - w };
            *sum += value * (w * (-sigma * length).exp() + found);
        }
    }
    let expected = dimmed.map(|dimmed| clear + dimmed);
    for integrator in ["volpath", "bdpt", "mlt"] {
        let scene = seen_by(
            integrator,
            1,
            [0.1, 0.2, 0.5],
            [-0.1, -0.2, -0.5],
            BEHIND_A_PANE,
        );
        assert_mean(&scene, 60_000, expected, integrator);
    }
}

#[test]
fn an_endless_medium_elsewhere_changes_no_sample() {
    let beside = |media: &str| {
        let dark = homogeneous("dark", [0.3; 3], [0.5; 3], 0.0);
        let floor =
            "AttributeBegin Material \"plastic\" Shape \"disk\" \"float radius\" 4 AttributeEnd\n";
        let ball = format!(
            "AttributeBegin MediumInterface {media} Translate 1 0 .5 Shape \"sphere\" \"float radius\" .3 AttributeEnd\n"
        );
        // Most boundaries say that the camera is in vacuum: those of a large ball below the floor.
        let below = "AttributeBegin MediumInterface \"dark\" \"\" Translate 0 0 -3 Shape \"sphere\" \"float radius\" 2 AttributeEnd\n";
        let scene = seen_by(
            "volpath",
            1,
            [0.1, 0.2, 0.5],
            [0.0, 0.0, -1.0],
            &format!("{SKY}{dark}{floor}{ball}{below}MediumInterface \"\" \"\""),
        );
        probe(&scene).samples(200)
    };
    assert_eq!(beside("\"\" \"dark\""), beside("\"dark\" \"\""));
}

#[test]
fn distant_lights_come_through_two_radii_of_an_endless_medium() {
    // The light is declared in vacuum or in the medium, which makes no difference.
    let dark = "MakeNamedMedium \"dark\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [.1 .3 0] \"rgb sigma_s\" [0 0 0]\n";
    let sun =
        "LightSource \"distant\" \"point from\" [1 0 1] \"point to\" [0 0 0] \"rgb L\" [2 2 2]\n";
    let floor = "Material \"matte\" \"rgb Kd\" [.5 .5 .5] Shape \"disk\"\n";
    let around = "MediumInterface \"\" \"dark\"\n";
    let expected = [0.1, 0.3, 0.0].map(|sigma: f64| {
        let reflected = 2.0 * 0.5f64.sqrt() * 0.5 / std::f64::consts::PI;
        reflected * (-sigma * (8f64.sqrt() + 0.5)).exp()
    });
    for world in [
        format!("{dark}{sun}{floor}{around}"),
        format!("{dark}{around}{sun}{floor}"),
    ] {
        for integrator in ["volpath", "bdpt", "mlt"] {
            let scene = seen_by(integrator, 1, [0.1, 0.2, 0.5], [0.0, 0.0, -1.0], &world);
            assert_exact(&scene, expected, integrator);
        }
    }
}

#[test]
fn suns_in_endless_fog_are_alike_from_both_ends() {
    let fog = homogeneous("fog", [0.1, 0.3, 0.0], [0.3, 0.2, 0.4], 0.0);
    let sun = "LightSource \"distant\" \"point from\" [1 1 2] \"rgb L\" [2 2 2]\n";
    let floor = "AttributeBegin MediumInterface \"fog\" \"fog\" Material \"matte\" Shape \"disk\" AttributeEnd\n";
    let around = "MediumInterface \"\" \"fog\"\n";
    for world in [
        format!("{fog}{sun}{floor}{around}"),
        format!("{fog}{around}{sun}{floor}"),
    ] {
        let scene = |integrator| seen_by(integrator, 2, [0.1, 0.2, 0.5], [0.0, 0.0, -1.0], &world);
        let means = |integrator| probe(&scene(integrator)).means(100_000);
        let (ours, others) = (means("volpath"), means("bdpt"));
        for (a, b) in ours.iter().zip(&others) {
            a.agrees_with_mean(b).assert_accepted("under a sun");
        }
    }
}

#[test]
fn no_light_paths_start_at_skies_around_endless_media() {
    let fog = homogeneous("fog", [0.1; 3], [0.1; 3], 0.0);
    let lamp = "LightSource \"point\" \"point from\" [0 3 0]\n";
    let ball = "Shape \"sphere\"\n";
    for (around, share_of_lamp) in [("MediumInterface \"\" \"fog\"", Some(1.0)), ("", None)] {
        let world = format!("{SKY}{lamp}{fog}{ball}{around}");
        let text = format!("{FILM}{}", seen_by("bdpt", 4, EYE, AHEAD, &world));
        let read = |name: &str| (name == "sky.pfm").then(map);
        let world = compile_scene(text, &CompileOptions::default(), read)
            .job
            .world;
        let choice =
            world.emitter_choice(LightStrategy::Power, |light| world.sends_light_paths(light));
        let is_point = |&id: &LightId| world.light(id).position().is_some();
        let point = (0..world.n_lights()).map(LightId::new).find(is_point);
        let pmf = choice.pmf(point.expect("a lamp").index());
        match share_of_lamp {
            Some(share) => assert_eq!(pmf, share),
            None => assert!((0.001..0.999).contains(&pmf), "{pmf}"),
        }
    }
}

#[test]
fn skies_around_endless_fog_are_alike_from_both_ends() {
    let fog = homogeneous("fog", [0.05; 3], [0.3, 0.2, 0.1], 0.5);
    let things = "AttributeBegin Material \"plastic\" Translate .4 0 0 Shape \"sphere\" \"float radius\" .5 AttributeEnd\n\
                  AttributeBegin Material \"glass\" Translate -.6 .2 -.5 Shape \"sphere\" \"float radius\" .4 AttributeEnd\n\
                  AttributeBegin Material \"matte\" Translate 0 -.6 0 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 2 AttributeEnd\n";
    let sun = "LightSource \"distant\" \"point from\" [1 3 -2] \"rgb L\" [.5 .5 .5]\n";
    let world = format!("{SKY}{sun}{fog}{things}MediumInterface \"\" \"fog\"");
    for eye in [[0.4, 0.1, -3.0], [-0.6, 0.2, -3.0], [0.0, -0.3, -3.0]] {
        let toward = [0.0, -0.02, 1.0];
        let means =
            |integrator: &str| probe(&seen_by(integrator, 3, eye, toward, &world)).means(100_000);
        let (ours, others) = (means("volpath"), means("bdpt"));
        for (a, b) in ours.iter().zip(&others) {
            a.agrees_with_mean(b).assert_accepted(&format!("{eye:?}"));
        }
    }
}

#[test]
fn blocks_are_told_apart_for_volpath_and_where_media_have_ends() {
    let wanted = |integrator: &str, around: &str| {
        // What is in force at the end is what the camera is in.
        let fog = homogeneous("fog", [0.1; 3], [0.1; 3], 0.0);
        let wall = null_box([-1.0; 3], [1.0; 3], "cloud", around);
        let end = format!("MediumInterface \"\" \"{around}\"");
        let world = format!("{SKY}{}{fog}{wall}{end}", cloud([1.0; 3]));
        let text = format!("{FILM}{}", seen_by(integrator, 4, EYE, AHEAD, &world));
        let read = |name: &str| (name == "sky.pfm").then(map);
        let compiled = compile_scene(text, &CompileOptions::default(), read);
        let scale = compiled.world_from_render;
        let world: World = compiled.job.world;
        let in_cloud = |x: f64| {
            let p = scale.inverse().point(glam::DVec3::new(x, 0.0, 0.0));
            world.wanted_in(MediumId::new(0), Point3::from_f64(p))
        };
        [in_cloud(-0.8), in_cloud(0.8)]
    };
    let [left, right] = wanted("volpath", "");
    assert!(matches!((left, right), (Wanted::Within(a), Wanted::Within(b)) if a != b));
    for integrator in ["path", "bdpt", "sppm"] {
        assert_eq!(wanted(integrator, ""), [Wanted::All; 2], "{integrator}");
    }
    // Pictures in fog without an end depend on pbrt-v3's densities, not on those that directions are drawn with.
    let [left, right] = wanted("volpath", "fog");
    assert!(matches!((left, right), (Wanted::Within(a), Wanted::Within(b)) if a != b));
}
