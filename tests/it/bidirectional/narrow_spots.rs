//! Noise under narrow spots, against that of the strategies that make up the picture.

use tyndall::compile::CompileOptions;
use tyndall::image::Image;
use tyndall::integrator::bdpt::Strategy;
use tyndall::render::Rendered;

use crate::bidirectional::setup::rendered;
use crate::common::scene::compile_scene;

const SIDE: usize = 48;
const SEEDS: u64 = 12;
/// How much more noise than by the best strategy is allowed, at equal time.
const ALLOWED: f64 = 1.5;

/// Pictures of a floor under a spot, light scattered once.
fn pictures(integrator: &str, cone: f64, edge: f64) -> Vec<Rendered> {
    let text = format!(
        "Film \"image\" \"integer xresolution\" {SIDE} \"integer yresolution\" {SIDE}\n\
         PixelFilter \"box\" Sampler \"random\" \"integer pixelsamples\" 32\n\
         Integrator {integrator}\n\
         LookAt 0 5 -5  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 50\nWorldBegin\n\
         LightSource \"spot\" \"point from\" [0 4 2] \"point to\" [0 0 0] \"rgb I\" [30 30 30]\n\
         \"float coneangle\" {cone} \"float conedeltaangle\" {edge}\n\
         Material \"matte\" \"rgb Kd\" [.6 .6 .6]\n\
         Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \
         \"point P\" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]\nWorldEnd\n"
    );
    let mut job = compile_scene(text, &CompileOptions::default(), |_| None).job;
    (0..SEEDS)
        .map(|seed| {
            job.seed = seed;
            rendered(&job)
        })
        .collect()
}

/// Mean variance of a pixel.
fn variance<'a>(pictures: impl Iterator<Item = &'a Image> + Clone) -> f64 {
    let n = pictures.clone().count() as f64;
    let n_pixels = SIDE * SIDE;
    let sum: f64 = (0..n_pixels)
        .map(|i| {
            let values = pictures
                .clone()
                .map(move |image| f64::from(image.data()[3 * i]));
            let mean = values.clone().sum::<f64>() / n;
            values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)
        })
        .sum();
    sum / n_pixels as f64
}

/// Rays followed for all pictures.
fn rays(pictures: &[Rendered]) -> f64 {
    let counts = pictures.iter().map(|picture| {
        let counters = &picture.report.counters;
        counters.rays + counters.shadow.rays
    });
    counts.sum::<u64>() as f64
}

fn assert_hardly_noisier(cones: &[(f64, f64)]) {
    for &(cone, edge) in cones {
        let alone = pictures(
            "\"bdpt\" \"integer maxdepth\" 1 \"bool visualizestrategies\" \"true\"",
            cone,
            edge,
        );
        let all = pictures("\"bdpt\" \"integer maxdepth\" 1", cone, edge);
        let by_camera = pictures("\"path\" \"integer maxdepth\" 1", cone, edge);
        let together = variance(all.iter().map(|p| &p.image)) * rays(&all);
        let camera = variance(by_camera.iter().map(|p| &p.image)) * rays(&by_camera);
        // What is not followed to the floor and on to the lamp is from the light.
        let samples: u64 = by_camera.iter().map(|p| p.report.samples).sum();
        let shadows: u64 = by_camera
            .iter()
            .map(|p| p.report.counters.shadow.rays)
            .sum();
        let from_light = rays(&all) - (samples + shadows) as f64;
        let place = Strategy { s: 2, t: 1 }.index();
        let light = variance(alone.iter().map(|p| &p.strategies[place])) * from_light;
        let ratio = (together / camera.min(light)).sqrt();
        assert!(
            ratio < ALLOWED,
            "a cone of {cone} degrees: {ratio} times the noise of the better of {} and {}",
            camera.sqrt(),
            light.sqrt()
        );
    }
}

// From many pixels down to a part of one; the edge soft or hard.
#[test]
fn l12_one_bounce_under_narrow_spots_is_hardly_noisier_than_by_the_best_strategy() {
    assert_hardly_noisier(&[(30.0, 10.0), (20.0, 0.1), (1.0, 0.2)]);
}

#[test]
#[ignore = "long"]
fn l12_one_bounce_under_other_narrow_spots_is_hardly_noisier_either() {
    assert_hardly_noisier(&[(20.0, 5.0), (5.0, 1.0), (0.1, 0.02)]);
}
