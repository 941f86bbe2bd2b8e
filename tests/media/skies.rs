//! Grids under skies that are maps: directions are drawn by what comes through the grid to a place.

use tyndall::compile::CompileOptions;
use tyndall::ids::MediumId;
use tyndall::light::Wanted;
use tyndall::math::Point3;
use tyndall::world::World;

use crate::nebula::Nebula;
use crate::probe::Probe;
use crate::scene::compile_scene;
use crate::solids::{V, homogeneous, null_box, null_sphere, seen_by};

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
    // Pictures in fog without an end depend on densities: they stay pbrt-v3's.
    assert_eq!(wanted("volpath", "fog"), [Wanted::All; 2]);
}
