//! Lights that make no sense, beside one that does.

use tyndall::compile::{CompileOptions, NoAssets, compile};
use tyndall::describe::describe;
use tyndall::world::World;
use tyndall_parser::source::Sources;
use tyndall_parser::{NoIncludes, parse};
use tyndall_test_support::assert_close;

use crate::lights::setup::{FIRST, intensity_toward, picture, text, world_of};

/// A world, whatever is wrong with the scene, and what that is.
fn world_and_codes(lights: &str) -> (World, Vec<String>) {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", text("spatial", lights));
    let (file, _) = parse(&mut sources, root, &NoIncludes);
    let (scene, _) = describe(file);
    let frame = scene.frames.into_iter().next().expect("a frame");
    let (compiled, findings) = compile(frame, &CompileOptions::default(), &NoAssets);
    let codes = findings.list.iter().map(|f| f.code.to_owned()).collect();
    (compiled.expect("a job").job.world, codes)
}

#[test]
fn n15_a_bad_light_leaves_the_others_alone() {
    let good = "LightSource \"point\" \"rgb I\" [2 2 2] \"point from\" [0 0 0.5]\n";
    for bad in [
        "LightSource \"point\" \"blackbody I\" [0 1]",
        "LightSource \"point\" \"blackbody I\" [-5000 1]",
        "LightSource \"point\" \"rgb I\" [nan nan nan]",
        "LightSource \"point\" \"rgb I\" [1e39 1 1]",
        "LightSource \"point\" \"rgb I\" [1e30 1 1] \"rgb scale\" [1e30 1 1]",
        "LightSource \"spot\" \"point from\" [1 2 3] \"point to\" [1 2 3]",
        "LightSource \"spot\" \"rgb I\" [nan 0 0]",
        "LightSource \"projection\" \"float fov\" 180",
        "LightSource \"distant\" \"point from\" [0 0 0] \"point to\" [0 0 0]",
        "LightSource \"infinite\" \"rgb L\" [inf 1 1]",
    ] {
        for lights in [format!("{good}{bad}"), format!("{bad}\n{good}")] {
            let (world, codes) = world_and_codes(&lights);
            assert!(!codes.is_empty(), "{bad}");
            let actual = intensity_toward(&world, [0.0, 0.0, 0.5], [0.3, 0.2, 1.0]);
            assert!(actual.is_finite(), "{bad}");
            if world.n_lights() == 1 {
                assert_close(actual.g().into(), 2.0, 1e-5);
            }
        }
    }
}

#[test]
fn a_missing_map_is_an_error_and_a_plain_light() {
    for (light, expected) in [("projection", 2.0), ("goniometric", 2.0)] {
        let (world, codes) = world_and_codes(&format!(
            "LightSource \"{light}\" \"rgb I\" [2 2 2] \"string mapname\" \"nowhere.png\""
        ));
        assert!(codes.contains(&"missing-file".to_owned()), "{codes:?}");
        let actual = intensity_toward(&world, [0.0; 3], [0.1, 0.1, 1.0]);
        assert_close(actual.g().into(), expected, 1e-5);
    }
}

#[test]
fn n12_a_bright_texel_of_a_lamp_is_found() {
    let map = picture(16, 8, |x, y| if [x, y] == [5, 2] { 1e6 } else { 1e-3 });
    // Texels are chosen by what a projection shows in them on average: some of its rays start in their dark parts.
    for (light, least) in [("goniometric", 950), ("projection", 700)] {
        let text = format!("LightSource \"{light}\" \"string mapname\" \"lamp.pfm\"");
        let world = world_of("spatial", &text, Some(&map));
        let mut n_bright = 0;
        for k in 0..1000 {
            let u = [0.618 * k as f32 % 1.0, (k as f32 + 0.5) / 1000.0];
            let ray = world
                .sample_emission(FIRST, [0.5; 2], u, 0.0)
                .expect("a ray");
            assert!(ray.radiance.is_finite() && ray.pdf_dir.is_finite());
            n_bright += usize::from(ray.radiance.g() > 1.0);
        }
        assert!(n_bright > least, "{light}: {n_bright}");
    }
}
