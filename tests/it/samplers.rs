//! Pictures with every sampler of the format. What the points themselves are like is tested where they are made.

use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::image::Image;
use tyndall::render::{Job, Unwatched, render};
use tyndall_test_support::z_test::Mean;

use crate::common::findings::findings;
use crate::common::scene::compile_scene;
use crate::common::seen::{environment, seen_by};

const SAMPLERS: [&str; 6] = [
    "Sampler \"02sequence\" \"integer pixelsamples\" 16",
    "Sampler \"sobol\" \"integer pixelsamples\" 16",
    "Sampler \"halton\" \"integer pixelsamples\" 16",
    "Sampler \"maxmindist\" \"integer pixelsamples\" 16",
    "Sampler \"stratified\"",
    "Sampler \"random\" \"integer pixelsamples\" 16",
];

/// A job of `size` x `size` pixels of a scene that names neither film nor sampler.
fn job(sampler: &str, size: u32, scene: &str, options: &CompileOptions) -> Job {
    let text = format!(
        "Film \"image\" \"integer xresolution\" {size} \"integer yresolution\" {size}\n\
         PixelFilter \"box\"\n{sampler}\n{scene}"
    );
    compile_scene(text, options, |_| None).job
}

fn picture(job: &Job) -> Image {
    let rendered = render(job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(rendered.report.bad_samples, 0);
    rendered.image
}

/// A matte floor seen from above, a fifth of its irradiance from a lamp of radiance 6, the rest of the sky is dark.
fn lit_floor(integrator: &str, fov: f64) -> String {
    let world = "Material \"matte\" \"rgb Kd\" [0.5 0.5 0.5] Shape \"disk\" \"float radius\" 50\n\
        AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 6 6] Translate 0.3 0.35 2 Rotate 180 1 0 0\n\
        Shape \"disk\" AttributeEnd\n";
    let eye = [0.4, 0.3, 0.5];
    let scene = seen_by(integrator, 1, eye, [-0.1, 0.05, -0.5], world);
    let camera = format!("Camera \"perspective\" \"float fov\" {fov}");
    scene.replace("Camera \"perspective\"", &camera)
}

#[test]
fn every_sampler_finds_the_same_mean_with_any_number_of_samples() {
    for sampler in SAMPLERS {
        for integrator in ["path", "directlighting", "whitted"] {
            for spp in [1, 13, 16] {
                let options = CompileOptions {
                    spp: Some(spp),
                    ..CompileOptions::default()
                };
                // A narrow pixel, in whose middle the answer is known.
                let mut job = job(sampler, 1, &lit_floor(integrator, 0.01), &options);
                let n = 4000 / spp as usize;
                let mean = Mean::of(n, || {
                    job.seed += 1;
                    f64::from(picture(&job).pixel(0, 0)[0])
                });
                mean.agrees_with(0.6)
                    .assert_accepted(&format!("{sampler}, {integrator}, {spp}"));
            }
        }
    }
}

#[test]
fn n20_dense_media_need_more_dimensions_than_any_table_has() {
    let world = environment([1.0; 3])
        + "MakeNamedMedium \"milk\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [50 50 50]\n\
           MediumInterface \"milk\" \"\" Material \"\" Shape \"sphere\"\n";
    for sampler in SAMPLERS {
        let scene = seen_by(
            "volpath",
            100_000,
            [0.0, 0.1, -2.0],
            [0.0, 0.0, 1.0],
            &world,
        );
        let options = CompileOptions {
            spp: Some(4),
            ..CompileOptions::default()
        };
        let mut job = job(sampler, 1, &scene, &options);
        let mean = Mean::of(60, || {
            job.seed += 1;
            f64::from(picture(&job).pixel(0, 0)[0])
        });
        let mean = Mean {
            standard_error: mean.standard_error.hypot(1e-4),
            ..mean
        };
        mean.agrees_with(1.0).assert_accepted(sampler);
    }
}

#[test]
fn n21_impossible_counts_are_told_and_possible_ones_are_not() {
    let told = |sampler: &str| {
        let scene = lit_floor("path", 40.0);
        let all = findings(&format!("{sampler}\n{scene}"));
        all.into_iter().map(|(code, _)| code).collect::<Vec<_>>()
    };
    for name in ["halton", "sobol", "02sequence", "maxmindist", "random"] {
        for count in ["0", "-1", "3000000000"] {
            let sampler = format!("Sampler \"{name}\" \"integer pixelsamples\" {count}");
            assert!(!told(&sampler).is_empty(), "{sampler}");
        }
    }
    assert!(!told("Sampler \"stratified\" \"integer xsamples\" 0").is_empty());
    let large = "Sampler \"maxmindist\" \"integer pixelsamples\" 1000000";
    assert_eq!(told(large), ["rounded-samples"]);
    let stratified = |side: u32| {
        format!("Sampler \"stratified\" \"integer xsamples\" {side} \"integer ysamples\" {side}")
    };
    assert!(told(&stratified(40_000)).is_empty());
    assert_eq!(told(&stratified(100_000)), ["many-samples"]);
}

#[test]
fn n22_errors_of_pixels_show_no_pattern() {
    // Correlation of the errors of pixels that are up to four apart; of n independent pairs it is within 1/√n.
    const SIZE: usize = 64;
    for sampler in SAMPLERS {
        let options = CompileOptions {
            spp: Some(32),
            ..CompileOptions::default()
        };
        let scene = lit_floor("path", 0.01);
        let image = picture(&job(sampler, SIZE as u32, &scene, &options));
        let at = |x: usize, y: usize| f64::from(image.pixel(x, y)[0]);
        let pixels = || (0..SIZE * SIZE).map(|i| at(i % SIZE, i / SIZE));
        let n = (SIZE * SIZE) as f64;
        let mean = pixels().sum::<f64>() / n;
        let variance = pixels().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        for dx in 0..=4 {
            for dy in 0..=4 {
                let (nx, ny) = (SIZE - dx, SIZE - dy);
                let sum: f64 = (0..nx * ny)
                    .map(|i| [i % nx, i / nx])
                    .map(|[x, y]| (at(x, y) - mean) * (at(x + dx, y + dy) - mean))
                    .sum();
                let n_pairs = (nx * ny) as f64;
                let correlation = sum / n_pairs / variance;
                let is_itself = dx + dy == 0;
                assert!(
                    is_itself || correlation.abs() < 5.0 / n_pairs.sqrt(),
                    "{sampler}, {dx} {dy}: {correlation}"
                );
            }
        }
    }
}

#[test]
fn n23_a_crop_window_is_a_part_of_the_whole() {
    for sampler in SAMPLERS {
        for integrator in ["path", "directlighting", "whitted"] {
            let scene = lit_floor(integrator, 60.0);
            let whole = picture(&job(sampler, 40, &scene, &CompileOptions::default()));
            let options = CompileOptions {
                crop_window: Some([0.25, 0.75, 0.25, 0.75]),
                ..CompileOptions::default()
            };
            let part = picture(&job(sampler, 40, &scene, &options));
            assert_eq!((part.width(), part.height()), (20, 20));
            for (x, y) in (0..400).map(|i| (i % 20, i / 20)) {
                let [a, b] = [part.pixel(x, y), whole.pixel(x + 10, y + 10)];
                assert_eq!(a, b, "{sampler}, {integrator}, ({x}, {y})");
            }
        }
    }
}

#[test]
fn without_jitter_every_sample_is_the_centre_of_its_cell() {
    // Four cells of a pixel whose upper left quarter is all that glows.
    let world = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] \"bool twosided\" \"true\"\n\
        Shape \"trianglemesh\" \"point P\" [-9 0 1  0 0 1  0 9 1  -9 9 1  9 0 1  9 9 1]\n\
        \"integer indices\" [0 1 2 0 2 3]\n";
    let scene = seen_by("path", 0, [0.0; 3], [0.0, 0.0, 1.0], world);
    let sampler = "Sampler \"stratified\" \"integer xsamples\" 2 \"integer ysamples\" 2 \"bool jitter\" \"false\"";
    for seed in 0..8 {
        let mut job = job(sampler, 1, &scene, &CompileOptions::default());
        job.seed = seed;
        assert_eq!(picture(&job).pixel(0, 0)[0], 0.25, "seed {seed}");
    }
}
