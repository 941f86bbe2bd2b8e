//! Whole pictures of published scenes against converged ones by pbrt-v3.
//!
//! The noise is measured, not assumed: a picture is rendered with several seeds, and the spread of a block's mean over
//! them gives its standard error s. The reference has noise too. It was made with at least `REFERENCE_SPP` samples per
//! pixel; if one of its samples varies as ours do, its variance is s² · (our samples per pixel) / `REFERENCE_SPP`. Its
//! samples are dearer and vary less, so that this errs on the side of caution. The two add up, and a block may be off by
//! `BLOCK_SIGMAS` of the sum's root plus `HALF_FLOAT` of its value, by which the reference is rounded. The whole
//! picture's mean may be off by `MEAN_TOLERANCE` plus four standard errors.

#![expect(
    clippy::print_stdout,
    reason = "a skipped test says so, and how close it was is worth reading"
)]

#[path = "common/scene.rs"]
mod scene;

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use scene::compile_scene;
use tyndall::compile::CompileOptions;
use tyndall::image::codec::decode;
use tyndall::image::{Image, PixelRect};
use tyndall::render::{Unwatched, render};

/// Least number of samples per pixel of the references.
const REFERENCE_SPP: f64 = 256.0;
/// Side of a block in pixels.
const BLOCK: usize = 16;
/// Standard errors within which a block agrees. The errors come from few seeds, whence more than the usual four.
const BLOCK_SIGMAS: f64 = 7.0;
/// Half of the spacing of 11-bit significands, and as much again for what the film rounds.
const HALF_FLOAT: f64 = 1e-3;
/// Relative difference of means that is accepted besides noise.
const MEAN_TOLERANCE: f64 = 0.003;

/// Pictures of one scene with different seeds.
struct Renders {
    pictures: Vec<Image>,
    /// Samples per pixel of all of them together.
    spp: f64,
}

/// The directory with scenes and references beside the repository, if there is one.
fn shared() -> Option<PathBuf> {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let is_there = directory.join("references").is_dir();
    if !is_there {
        println!("skipped: there are no references beside the repository");
    }
    is_there.then_some(directory)
}

/// Renders a scene with `n_seeds` seeds of `spp` samples per pixel; only what `window` needs, if there is one.
fn render_seeds(file: &Path, n_seeds: u64, spp: u32, window: Option<PixelRect>) -> Renders {
    let directory = file.parent().expect("a file is in a directory");
    let text = std::fs::read(file).expect("the scene is there");
    let read = |path: &str| std::fs::read(directory.join(path)).ok();
    let options = CompileOptions {
        spp: Some(spp),
        ..CompileOptions::default()
    };
    let mut job = compile_scene(text, &options, read).job;
    job.pixel_bounds = window.map(|window| grown(window, job.film.filter.radius()));
    let pictures = (0..n_seeds)
        .map(|seed| {
            job.seed = seed;
            let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
            assert_eq!(
                rendered.report.bad_samples, 0,
                "samples that are no numbers"
            );
            assert_eq!(rendered.report.counters.stuck_paths, 0, "stuck paths");
            match window {
                Some(window) => rendered
                    .image
                    .crop(window)
                    .expect("a window of the picture"),
                None => rendered.image,
            }
        })
        .collect();
    Renders {
        pictures,
        spp: (n_seeds * u64::from(spp)) as f64,
    }
}

/// The pixels whose samples reach a window.
fn grown(window: PixelRect, radius: [f64; 2]) -> PixelRect {
    let [rx, ry] = radius.map(|r| r.ceil() as usize);
    PixelRect {
        x0: window.x0 - rx as i32,
        y0: window.y0 - ry as i32,
        width: window.width + 2 * rx,
        height: window.height + 2 * ry,
    }
}

fn read_reference(file: &Path) -> Image {
    let bytes = std::fs::read(file).expect("the reference is there");
    decode(&bytes, "exr")
        .expect("the reference is an EXR")
        .image
}

/// Mean of a channel over a rectangle.
fn mean(image: &Image, rect: PixelRect, channel: usize) -> f64 {
    let mut sum = 0.0;
    for y in 0..rect.height {
        for x in 0..rect.width {
            let [x, y] = [rect.x0 as usize + x, rect.y0 as usize + y];
            sum += f64::from(image.pixel(x, y)[channel]);
        }
    }
    sum / (rect.width * rect.height) as f64
}

/// Mean of several numbers and its standard error.
fn spread(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0) / n).sqrt())
}

impl Renders {
    /// Every way in which the pictures disagree with the reference.
    fn disagreements(&self, reference: &Image) -> Vec<String> {
        let first = &self.pictures[0];
        assert_eq!(
            (first.width(), first.height()),
            (reference.width(), reference.height()),
            "pictures of one size"
        );
        let reference_share = (self.spp / REFERENCE_SPP).sqrt();
        let compare = |rect: PixelRect, channel: usize| {
            let means: Vec<f64> = self
                .pictures
                .iter()
                .map(|picture| mean(picture, rect, channel))
                .collect();
            let (ours, error) = spread(&means);
            let theirs = mean(reference, rect, channel);
            (ours, theirs, error * 1f64.hypot(reference_share))
        };
        let mut found = Vec::new();
        for channel in 0..3 {
            let (ours, theirs, error) = compare(first.bounds(), channel);
            println!("channel {channel}: {ours} ± {error:.1e}, reference {theirs}");
            if (ours - theirs).abs() > MEAN_TOLERANCE * theirs.abs() + 4.0 * error {
                found.push(format!(
                    "mean {channel}: {ours} ± {error:.1e} is not {theirs}"
                ));
            }
            let mut worst = 0f64;
            for y in (0..first.height()).step_by(BLOCK) {
                for x in (0..first.width()).step_by(BLOCK) {
                    let rect = PixelRect {
                        x0: x as i32,
                        y0: y as i32,
                        width: BLOCK.min(first.width() - x),
                        height: BLOCK.min(first.height() - y),
                    };
                    let (ours, theirs, error) = compare(rect, channel);
                    let excess = (ours - theirs).abs() - HALF_FLOAT * theirs.abs();
                    worst = worst.max(excess / error);
                    if excess.is_nan() || excess > BLOCK_SIGMAS * error {
                        found.push(format!(
                            "block ({x}, {y}), channel {channel}: {ours} ± {error:.1e} is not {theirs}"
                        ));
                    }
                }
            }
            println!("channel {channel}: the worst block is {worst:.1} sigma off");
        }
        found
    }
}

const SEEDS: u64 = 8;
const SPP: u32 = 8;

#[track_caller]
fn assert_small_scene_agrees(name: &str) {
    let Some(shared) = shared() else { return };
    let scene = shared.join(format!("scenes/cloud/{name}.small.pbrt"));
    let renders = render_seeds(&scene, SEEDS, SPP, None);
    let reference = read_reference(&shared.join(format!("references/small/cloud-{name}.exr")));
    let found = renders.disagreements(&reference);
    assert!(found.is_empty(), "{name}:\n{}", found.join("\n"));
}

#[test]
fn small_cloud_agrees() {
    assert_small_scene_agrees("cloud");
}

#[test]
fn small_smoke_agrees() {
    assert_small_scene_agrees("smoke");
}

#[test]
fn small_f15_4a_agrees() {
    assert_small_scene_agrees("f15-4a");
}

#[test]
fn small_f15_4b_agrees() {
    assert_small_scene_agrees("f15-4b");
}

#[test]
fn small_f15_4c_agrees() {
    assert_small_scene_agrees("f15-4c");
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
        let renders = render_seeds(&scene, SEEDS, 16, Some(window));
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
    let renders = render_seeds(&scene, SEEDS, SPP, None);
    let spoilt = |spoil: &dyn Fn(&mut Image)| {
        let mut pictures = renders.pictures.clone();
        pictures.iter_mut().for_each(spoil);
        let spp = renders.spp;
        Renders { pictures, spp }.disagreements(&reference)
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
