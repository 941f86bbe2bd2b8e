//! Whole pictures of published scenes against converged ones by pbrt-v3, made with at least `REFERENCE_SPP` samples per
//! pixel.

#![expect(
    clippy::print_stdout,
    reason = "a skipped test says so, and how close it was is worth reading"
)]

use std::path::{Path, PathBuf};

use crate::common::pictures::{BLOCK, Renders, read_reference, render_seeds};
use tyndall::compile::CompileOptions;
use tyndall::image::{Image, PixelRect};

/// Least number of samples per pixel of the references.
const REFERENCE_SPP: f64 = 256.0;

/// Of our samples in clouds, as many as vary like the references: pbrt-v3's vary up to 2.4 times as much there.
const CLOUD_REFERENCE_SPP: f64 = 100.0;

/// The directory with scenes and references beside the repository, if there is one.
fn shared() -> Option<PathBuf> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let is_there = directory.join("references").is_dir();
    if !is_there {
        println!("skipped: there are no references beside the repository");
    }
    is_there.then_some(directory)
}

fn with_spp(spp: u32) -> CompileOptions {
    CompileOptions {
        spp: Some(spp),
        ..CompileOptions::default()
    }
}

const SEEDS: u64 = 8;
const SPP: u32 = 8;

#[track_caller]
fn assert_small_scene_agrees(folder: &str, name: &str) {
    assert_small_scene_agrees_at(folder, name, SPP, REFERENCE_SPP);
}

#[track_caller]
fn assert_small_scene_agrees_at(folder: &str, name: &str, spp: u32, reference_spp: f64) {
    let Some(shared) = shared() else { return };
    let scene = shared.join(format!("scenes/{folder}/{name}.small.pbrt"));
    let renders = render_seeds(&scene, SEEDS, &with_spp(spp), None, reference_spp);
    let reference = read_reference(&shared.join(format!("references/small/{folder}-{name}.exr")));
    let found = renders.disagreements(&reference);
    assert!(found.is_empty(), "{name}:\n{}", found.join("\n"));
}

#[test]
fn small_cloud_agrees() {
    assert_small_scene_agrees_at("cloud", "cloud", SPP, CLOUD_REFERENCE_SPP);
}

#[test]
fn small_smoke_agrees() {
    assert_small_scene_agrees_at("cloud", "smoke", SPP, CLOUD_REFERENCE_SPP);
}

#[test]
fn small_f15_4a_agrees() {
    assert_small_scene_agrees_at("cloud", "f15-4a", SPP, CLOUD_REFERENCE_SPP);
}

#[test]
fn small_f15_4b_agrees() {
    assert_small_scene_agrees_at("cloud", "f15-4b", SPP, CLOUD_REFERENCE_SPP);
}

#[test]
fn small_f15_4c_agrees() {
    assert_small_scene_agrees_at("cloud", "f15-4c", SPP, CLOUD_REFERENCE_SPP);
}

/// A ball under elliptically filtered lines.
#[test]
fn small_f10_1b_agrees_in_filtered_lines() {
    assert_small_scene_agrees("figures", "f10-1b");
}

#[test]
fn small_curves_agree() {
    assert_small_scene_agrees("figures", "f3-18");
}

#[test]
fn small_subsurface_balls_agree() {
    assert_small_scene_agrees("figures", "f11-15");
}

#[test]
fn small_killeroo_agrees() {
    assert_small_scene_agrees("killeroo", "killeroo-simple");
}

#[test]
fn small_f8_22_agrees() {
    assert_small_scene_agrees("figures", "f8-22");
}

#[test]
fn small_f7_19a_agrees() {
    assert_small_scene_agrees("figures", "f7-19a");
}

/// Caustics by bidirectional path tracing, through glass with vertex normals. Evenly lit blocks of the reference are up
/// to one percent apart: it has the noise of two of our samples per pixel.
#[test]
fn small_glass_agrees_in_caustics() {
    assert_small_scene_agrees_at("caustic-glass", "glass", SPP, 2.0);
}

#[test]
#[ignore = "takes minutes"]
fn small_buddha_agrees() {
    assert_small_scene_agrees("buddha-fractal", "buddha-fractal");
}

#[test]
#[ignore = "takes minutes"]
fn small_breakfast_agrees() {
    // Lamps are found by chance: their noise shows only in many samples.
    assert_small_scene_agrees_at("breakfast", "f16-8a", 64, REFERENCE_SPP);
}

#[test]
fn small_splashes_agree() {
    // The tip of the spoon is seldom lit: its noise shows only in many samples.
    assert_small_scene_agrees_at("coffee-splash", "splash", 64, REFERENCE_SPP);
}

/// Windows of the large pictures: the edge of the cloud against the sky, its middle, and its dark underside.
const WINDOWS: [[i32; 2]; 3] = [[128, 96], [320, 288], [400, 480]];
const WINDOW_SIDE: usize = 96;

#[track_caller]
fn assert_windows_agree(name: &str) {
    let Some(shared) = shared() else { return };
    let scene = shared.join(format!("scenes/cloud/{name}.pbrt"));
    let reference = read_reference(&shared.join(format!("references/cloud/{name}.exr")));
    let mut found = Vec::new();
    for [x0, y0] in WINDOWS {
        let window = PixelRect {
            x0,
            y0,
            width: WINDOW_SIDE,
            height: WINDOW_SIDE,
        };
        let renders = render_seeds(&scene, SEEDS, &with_spp(16), Some(window), REFERENCE_SPP);
        let reference = reference.crop(window).expect("a window of the reference");
        found.extend(renders.disagreements(&reference));
    }
    assert!(found.is_empty(), "{name}:\n{}", found.join("\n"));
}

#[test]
#[ignore = "takes minutes"]
fn windows_of_the_large_cloud_agree() {
    assert_windows_agree("cloud");
}

#[test]
#[ignore = "takes minutes"]
fn windows_of_the_large_smoke_agree() {
    assert_windows_agree("smoke");
}

#[test]
#[ignore = "takes minutes"]
fn windows_of_the_large_f15_4c_agree() {
    assert_windows_agree("f15-4c");
}

#[test]
fn the_judge_rejects_pictures_that_are_one_percent_brighter_or_hold_a_shifted_block() {
    let Some(shared) = shared() else { return };
    let scene = shared.join("scenes/cloud/f15-4a.small.pbrt");
    let reference = read_reference(&shared.join("references/small/cloud-f15-4a.exr"));
    let renders = render_seeds(&scene, SEEDS, &with_spp(SPP), None, REFERENCE_SPP);
    let spoilt = |spoil: &dyn Fn(&mut Image)| {
        let mut pictures = renders.pictures.clone();
        pictures.iter_mut().for_each(spoil);
        Renders {
            pictures,
            ..renders
        }
        .disagreements(&reference)
    };
    assert!(spoilt(&|_| ()).is_empty(), "the right picture is accepted");
    let brighter = spoilt(&|picture| picture.data_mut().iter_mut().for_each(|c| *c *= 1.01));
    assert!(
        brighter.iter().any(|line| line.starts_with("mean")),
        "1 % brighter"
    );
    // One block in the cloud shows what lies right of it.
    let shifted = spoilt(&|picture| {
        let source = picture.clone();
        let width = source.width();
        for y in 96..112 {
            for x in 96..112 {
                let (to, from) = (3 * (y * width + x), 3 * (y * width + x + BLOCK));
                picture.data_mut()[to..to + 3].copy_from_slice(&source.data()[from..from + 3]);
            }
        }
    });
    let is_the_block = |line: &String| line.starts_with("block (96, 96)");
    assert!(shifted.iter().all(is_the_block), "{shifted:?}");
    assert!(!shifted.is_empty(), "a shifted block");
}
