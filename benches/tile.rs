//! A block of 16 x 16 pixels of scenes of our own, all phases of the inner loop together, in camera samples.

#[path = "../tests/it/common/scene.rs"]
mod scene;

use std::path::Path;
use std::sync::atomic::AtomicBool;

use divan::Bencher;
use divan::counter::ItemsCount;
use scene::compile_scene;
use tyndall::compile::CompileOptions;
use tyndall::image::PixelRect;
use tyndall::render::{Unwatched, render};

const SIDE: usize = 16;
const SPP: u32 = 16;

fn main() {
    divan::main();
}

#[divan::bench(args = ["cloud", "room", "spheres", "leaves"])]
fn tile(bencher: Bencher<'_, '_>, name: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("assets/pbrt-v3-scenes-subset")
        .join(name);
    let text = std::fs::read(folder.join(format!("{name}.pbrt"))).expect("the scene is there");
    let options = CompileOptions {
        spp: Some(SPP),
        ..CompileOptions::default()
    };
    let mut job = compile_scene(text, &options, |path| std::fs::read(folder.join(path)).ok()).job;
    let [width, height] = job.film.resolution;
    // A block in the middle, aligned as blocks are.
    let place = |length: u32| (length as usize / 2 / SIDE * SIDE) as i32;
    job.pixel_bounds = Some(PixelRect {
        x0: place(width),
        y0: place(height),
        width: SIDE,
        height: SIDE,
    });
    let n_samples = SIDE * SIDE * SPP as usize;
    bencher
        .counter(ItemsCount::new(n_samples))
        .bench(|| render(&job, &Unwatched, &AtomicBool::new(false)));
}
