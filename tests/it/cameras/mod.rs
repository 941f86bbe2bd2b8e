//! Cameras against closed forms: directions, windows, blur, lenses, motion.

mod blur;
mod lenses;
mod loading;
mod projections;

use tyndall::camera::{Camera, CameraSample};
use tyndall::compile::{CompileOptions, Compiled};
use tyndall::math::Ray;

use crate::common::scene::compile_scene;

/// The frame that most tests use.
const RESOLUTION: [f64; 2] = [48.0, 32.0];

/// A ball of diameter 1 around the world's origin: render space is then world space, moved to the camera if that is
/// within half a unit of the origin in each direction.
const WORLD: &str =
    "WorldBegin LightSource \"infinite\" Shape \"sphere\" \"float radius\" 0.5 WorldEnd";

/// Compiles the options block of a scene with the usual frame; `lens` is the text of the file `lens.dat`.
#[track_caller]
fn compiled(options: &str, lens: &str) -> Compiled {
    let [width, height] = RESOLUTION;
    let text = format!(
        "Film \"image\" \"integer xresolution\" {width} \"integer yresolution\" {height}\n\
         {options}\n{WORLD}"
    );
    let read = |path: &str| (path == "lens.dat").then(|| lens.as_bytes().to_vec());
    compile_scene(text, &CompileOptions::default(), read)
}

#[track_caller]
fn camera(options: &str) -> Camera {
    compiled(options, "").job.camera
}

fn sample(raster: [f64; 2], lens: [f32; 2]) -> CameraSample {
    CameraSample {
        raster,
        time: 0.0,
        lens,
    }
}

/// The ray of a camera that has no lens to miss.
#[track_caller]
fn ray(camera: &Camera, raster: [f64; 2]) -> Ray {
    let found = camera.ray(&sample(raster, [0.5; 2])).expect("a ray");
    assert_eq!(found.weight, 1.0);
    found.ray
}

#[track_caller]
fn assert_near(actual: [f32; 3], expected: [f64; 3], what: &str) {
    let size = expected.iter().fold(1.0, |size: f64, x| size.max(x.abs()));
    let error = (0..3)
        .map(|k| (f64::from(actual[k]) - expected[k]).abs())
        .fold(0.0, f64::max);
    assert!(
        error <= 2e-7 * size,
        "{what}: {actual:?} is not {expected:?}"
    );
}
