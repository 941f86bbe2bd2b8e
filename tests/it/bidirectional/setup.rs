//! Small scenes, and pictures of them.

use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::image::Image;
use tyndall::render::{Job, Rendered, Unwatched, render};
use tyndall_test_support::Verdict;
use tyndall_test_support::image_z::ImageZTest;

use crate::common::scene::compile_scene;

/// Pixels per row and column.
const SIDE: usize = 12;
/// Pictures of each integrator, with seeds of their own.
const SEEDS: u64 = 24;

/// A job for a scene whose integrator, camera and world are given.
#[track_caller]
pub(crate) fn job(integrator: &str, camera: &str, spp: u32, world: &str) -> Job {
    let text = format!(
        "Film \"image\" \"integer xresolution\" {SIDE} \"integer yresolution\" {SIDE}\n\
         PixelFilter \"box\"\n\
         Sampler \"random\" \"integer pixelsamples\" {spp}\n\
         Integrator {integrator}\n{camera}\nWorldBegin\n{world}\nWorldEnd\n"
    );
    compile_scene(text, &CompileOptions::default(), |_| None).job
}

#[track_caller]
pub(crate) fn picture(job: &Job) -> Image {
    rendered(job).image
}

#[track_caller]
pub(crate) fn rendered(job: &Job) -> Rendered {
    let rendered = render(job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(
        rendered.report.bad_samples, 0,
        "samples that are no numbers"
    );
    assert_eq!(rendered.report.counters.stuck_paths, 0, "stuck paths");
    rendered
}

/// Mean over the seeds and the variance of that mean, for each pixel.
struct Spread {
    mean: Vec<f32>,
    variance: Vec<f32>,
}

#[track_caller]
fn pictures(job: &mut Job, first_seed: u64) -> Vec<Image> {
    (0..SEEDS)
        .map(|seed| {
            job.seed = first_seed + seed;
            picture(job)
        })
        .collect()
}

fn spread(pictures: &[Image]) -> Spread {
    let n = pictures.len() as f64;
    // The channels of a path go together: three of them are no three witnesses.
    let value = |image: &Image, i: usize| {
        let rgb = &image.data()[3 * i..3 * i + 3];
        rgb.iter().map(|&c| f64::from(c)).sum::<f64>() / 3.0
    };
    let values = |i: usize| pictures.iter().map(move |image| value(image, i));
    let numbers = 0..SIDE * SIDE;
    let moments: Vec<(f64, f64)> = numbers
        .map(|i| {
            let mean = values(i).sum::<f64>() / n;
            let squares: f64 = values(i).map(|v| (v - mean).powi(2)).sum();
            (mean, squares / (n - 1.0) / n)
        })
        .collect();
    Spread {
        mean: moments.iter().map(|m| m.0 as f32).collect(),
        variance: moments.iter().map(|m| m.1 as f32).collect(),
    }
}

/// Whether two jobs of one film have one expectation.
#[track_caller]
pub(crate) fn compare(mut a: Job, mut b: Job) -> Verdict {
    compare_pictures(&pictures(&mut a, 0), &pictures(&mut b, SEEDS))
}

/// Whether independent pictures of one kind have the expectation of those of another.
#[track_caller]
pub(crate) fn compare_pictures(a: &[Image], b: &[Image]) -> Verdict {
    let (a, b) = (spread(a), spread(b));
    assert!(
        b.mean.iter().any(|&x| x > 0.0),
        "a black picture shows nothing"
    );
    let both = a.variance.iter().zip(&b.variance);
    let variance: Vec<f32> = both.map(|(a, b)| a + b).collect();
    let test = ImageZTest {
        width: SIDE,
        channels: 1,
        block: 4,
        alpha: 1e-4,
    };
    test.check(&a.mean, &b.mean, &variance)
}

/// A camera that looks into the room.
pub(crate) const CAMERA: &str =
    "LookAt 0 1 -4  0 .6 0  0 1 0 Camera \"perspective\" \"float fov\" 50";

/// Floor, back wall, a diffuse and a rough ball.
pub(crate) const ROOM: &str = "\
    AttributeBegin Material \"matte\" \"rgb Kd\" [.7 .5 .3]\n\
    Shape \"trianglemesh\" \"point P\" [-3 0 -3  -3 0 3  3 0 3  3 0 -3] \"integer indices\" [0 1 2 0 2 3]\n\
    Material \"matte\" \"rgb Kd\" [.3 .5 .7] \"float sigma\" 20\n\
    Shape \"trianglemesh\" \"point P\" [-3 0 2  -3 4 2  3 4 2  3 0 2] \"integer indices\" [0 1 2 0 2 3]\n\
    AttributeEnd\n\
    AttributeBegin Material \"matte\" \"rgb Kd\" [.8 .8 .8] Translate -.8 .5 0\n\
    Shape \"sphere\" \"float radius\" .5 AttributeEnd\n\
    AttributeBegin Material \"plastic\" \"float roughness\" .3 \"rgb Ks\" [.5 .5 .5] Translate .8 .5 .3\n\
    Shape \"sphere\" \"float radius\" .5 AttributeEnd\n";

/// Lights of every kind.
pub(crate) const LIGHTS: &[(&str, &str)] = &[
    (
        "point",
        "LightSource \"point\" \"point from\" [.5 2.5 -1] \"rgb I\" [5 4 3]\n",
    ),
    (
        "spot",
        "LightSource \"spot\" \"point from\" [1 3 -1] \"point to\" [0 0 0] \"rgb I\" [9 9 9] \
         \"float coneangle\" 25\n",
    ),
    (
        "projection",
        "AttributeBegin Translate 0 2 -3 LightSource \"projection\" \"rgb I\" [6 6 6] \
         \"float fov\" 60 AttributeEnd\n",
    ),
    (
        "goniometric",
        "AttributeBegin Translate 0 2 -1 LightSource \"goniometric\" \"rgb I\" [4 4 4] AttributeEnd\n",
    ),
    (
        "distant",
        "LightSource \"distant\" \"point from\" [1 2 -1] \"point to\" [0 0 0] \"rgb L\" [2 2 1]\n",
    ),
    (
        "infinite",
        "LightSource \"infinite\" \"rgb L\" [.5 .6 .7]\n",
    ),
    (
        "sphere",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4] Translate .3 1.8 -.3\n\
         Shape \"sphere\" \"float radius\" .3 AttributeEnd\n",
    ),
    (
        "panel",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 5 6] \"bool twosided\" \"true\"\n\
         Shape \"trianglemesh\" \"point P\" [-1 1.5 -1  0 2 -1  0 1.5 .5] \"integer indices\" [0 1 2]\n\
         AttributeEnd\n",
    ),
    (
        "invisible",
        "AttributeBegin Material \"\" AreaLightSource \"diffuse\" \"rgb L\" [4 4 4] Translate 0 1.5 -.5\n\
         Rotate 90 1 0 0 Shape \"disk\" \"float radius\" .6 AttributeEnd\n",
    ),
    (
        "several",
        "LightSource \"point\" \"point from\" [-1.5 2.5 -1] \"rgb I\" [3 1 1]\n\
         LightSource \"infinite\" \"rgb L\" [.1 .1 .3]\n\
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 6 4] Translate 1.5 1.8 -.3\n\
         Shape \"sphere\" \"float radius\" .2 AttributeEnd\n",
    ),
];
