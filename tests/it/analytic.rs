//! Closed scenes in which every point sends the same radiance in every direction, known to the last digit: what each
//! integrator makes of them with every sampler and camera.
//!
//! A unit sphere of albedo ρ whose surface receives the irradiance E directly and sends Le has, after at most D
//! scattering events, the radiance Le + (Le + E/π − Le·[E counts Le]) Σ ρᵏ; each scene below says its own sum. Inside a
//! shell of radiance 1, a medium that only scatters changes nothing (the white furnace).

use std::sync::atomic::AtomicBool;

use crate::common::scene::compile_scene;
use tyndall::compile::CompileOptions;
use tyndall::render::{Job, Unwatched, render};

/// Pictures of each combination, with seeds of their own.
const SEEDS: u64 = 24;
/// Standard errors by which a mean may be off.
const SIGMAS: f64 = 4.0;
/// Rounding of single precision over a path, relative.
const ROUNDING: f64 = 2e-5;

/// Scattering events that integrators of global light are asked for.
const DEPTH: i32 = 5;
const ALBEDO: f64 = 0.5;

const SAMPLERS: &[&str] = &[
    "\"random\" \"integer pixelsamples\" 16",
    "\"stratified\" \"integer xsamples\" 4 \"integer ysamples\" 4",
    "\"02sequence\" \"integer pixelsamples\" 16",
    "\"maxmindist\" \"integer pixelsamples\" 16",
    "\"halton\" \"integer pixelsamples\" 16",
    "\"sobol\" \"integer pixelsamples\" 16",
];

const CAMERAS: &[&str] = &[
    "LookAt .1 0 .3  0 .2 -1  0 1 0 Camera \"perspective\" \"float fov\" 70",
    "LookAt .1 0 .3  0 .2 -1  0 1 0 Camera \"perspective\" \"float lensradius\" .05 \"float focaldistance\" .7",
    "LookAt .1 0 .3  0 .2 -1  0 1 0 Camera \"orthographic\" \"float screenwindow\" [-.4 .4 -.4 .4]",
    "Camera \"environment\"",
];

/// How much of the transport an integrator follows.
#[derive(Clone, Copy, PartialEq)]
enum Follows {
    Direct,
    Surfaces,
    Everything,
}

const INTEGRATORS: &[(&str, Follows)] = &[
    ("\"whitted\"", Follows::Direct),
    ("\"directlighting\"", Follows::Direct),
    (
        "\"directlighting\" \"string strategy\" \"one\"",
        Follows::Direct,
    ),
    ("\"path\"", Follows::Surfaces),
    (
        "\"sppm\" \"integer iterations\" 8 \"integer photonsperiteration\" 2000 \"float radius\" .3",
        Follows::Surfaces,
    ),
    ("\"volpath\"", Follows::Everything),
    ("\"bdpt\"", Follows::Everything),
    (
        "\"mlt\" \"integer bootstrapsamples\" 1000 \"integer chains\" 10 \"integer mutationsperpixel\" 50",
        Follows::Everything,
    ),
];

/// Σ ρᵏ for k < n.
fn geometric(n: i32) -> f64 {
    (1.0 - ALBEDO.powi(n)) / (1.0 - ALBEDO)
}

fn scattering_events(follows: Follows) -> i32 {
    match follows {
        Follows::Direct => 1,
        Follows::Surfaces | Follows::Everything => DEPTH,
    }
}

fn job(integrator: &str, depth: i32, sampler: &str, camera: &str, world: &str) -> Job {
    let text = format!(
        "{camera}\nFilm \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\nPixelFilter \"box\"\n\
         Sampler {sampler}\nIntegrator {integrator} \"integer maxdepth\" {depth}\nWorldBegin\n{world}\nWorldEnd\n"
    );
    compile_scene(text, &CompileOptions::default(), |_| None).job
}

/// Mean over all pixels and channels for one seed.
fn mean(job: &mut Job, seed: u64) -> f64 {
    job.seed = seed;
    let rendered = render(job, &Unwatched, &AtomicBool::new(false));
    let report = &rendered.report;
    assert_eq!(report.bad_samples, 0, "samples that are no numbers");
    assert_eq!(report.counters.leaked_paths, 0, "leaked paths");
    let data = rendered.image.data();
    data.iter().map(|&c| f64::from(c)).sum::<f64>() / data.len() as f64
}

/// By how many standard errors the mean is off what is expected.
fn deviation(job: &mut Job, expected: f64) -> (f64, f64) {
    let means: Vec<f64> = (0..SEEDS).map(|seed| mean(job, seed)).collect();
    let n = SEEDS as f64;
    let found = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - found).powi(2)).sum::<f64>() / (n - 1.0) / n;
    (
        found,
        (found - expected) / variance.sqrt().max(ROUNDING * expected / SIGMAS),
    )
}

/// Combinations of integrator, sampler and camera. Each half has every pair of two of them.
#[derive(Clone, Copy)]
enum Half {
    First,
    Other,
}

/// Compares every combination of a half; `expected` by what the integrator follows.
fn assert_all(half: Half, world: &str, expected: impl Fn(Follows) -> Option<f64>) {
    let mut wrong = Vec::new();
    let mut n_compared = 0;
    for (i, (integrator, follows)) in INTEGRATORS.iter().enumerate() {
        let Some(expected) = expected(*follows) else {
            continue;
        };
        for (j, sampler) in SAMPLERS.iter().enumerate() {
            for (k, camera) in CAMERAS.iter().enumerate() {
                if (i + j + k) % 2 != half as usize {
                    continue;
                }
                let depth = scattering_events(*follows);
                let mut job = job(integrator, depth, sampler, camera, world);
                let (found, sigmas) = deviation(&mut job, expected);
                n_compared += 1;
                if sigmas.abs() > SIGMAS {
                    wrong.push(format!(
                        "{integrator} {sampler} {camera}: {found} for {expected}, off by {sigmas:.1} standard errors"
                    ));
                }
            }
        }
    }
    assert!(2 * n_compared >= 3 * SAMPLERS.len() * CAMERAS.len());
    assert!(
        wrong.is_empty(),
        "{} of {n_compared}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}

fn shell(albedo: f64, emission: f64) -> String {
    format!(
        "Material \"matte\" \"rgb Kd\" [{albedo} {albedo} {albedo}]\n\
         AreaLightSource \"diffuse\" \"rgb L\" [{emission} {emission} {emission}]\n\
         ReverseOrientation Shape \"sphere\"\n"
    )
}

/// Each event adds Le ρᵏ, the emission itself is k = 0.
fn shining_shell(half: Half) {
    let emission = 0.5;
    assert_all(half, &shell(ALBEDO, emission), |follows| {
        Some(emission * geometric(scattering_events(follows) + 1))
    });
}

#[test]
fn a_shell_that_shines_is_as_bright_as_the_series_says() {
    shining_shell(Half::First);
}

#[test]
#[ignore = "long"]
fn shining_shell_by_the_other_combinations() {
    shining_shell(Half::Other);
}

/// A point of intensity π in the middle: the irradiance is π everywhere.
fn shell_around_a_point(half: Half) {
    let world = "LightSource \"point\" \"rgb I\" [3.1415926535 3.1415926535 3.1415926535]\n\
                 Material \"matte\" \"rgb Kd\" [.5 .5 .5]\nReverseOrientation Shape \"sphere\"\n";
    assert_all(half, world, |follows| {
        Some(ALBEDO * geometric(scattering_events(follows)))
    });
}

#[test]
fn a_shell_around_a_point_of_light_is_as_bright_as_the_series_says() {
    shell_around_a_point(Half::First);
}

#[test]
#[ignore = "long"]
fn shell_around_a_point_by_the_other_combinations() {
    shell_around_a_point(Half::Other);
}

/// Two lights at once, of which one is chosen at a time.
fn shell_with_two_lights(half: Half) {
    let world = format!(
        "LightSource \"point\" \"rgb I\" [3.1415926535 3.1415926535 3.1415926535]\n{}",
        shell(ALBEDO, 0.1)
    );
    assert_all(half, &world, |follows| {
        let n = scattering_events(follows);
        Some(0.1 * geometric(n + 1) + ALBEDO * geometric(n))
    });
}

#[test]
fn a_shell_with_two_kinds_of_light_is_as_bright_as_their_sum() {
    shell_with_two_lights(Half::First);
}

#[test]
#[ignore = "long"]
fn shell_with_two_lights_by_the_other_combinations() {
    shell_with_two_lights(Half::Other);
}

/// The white furnace: scattering takes nothing and adds nothing.
#[test]
fn a_medium_that_only_scatters_does_not_show_in_an_even_shell() {
    let world = format!(
        "MakeNamedMedium \"milk\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0 0 0] \"rgb sigma_s\" [1 2 .5] \
         \"float g\" .3\nAttributeBegin\n{}AttributeEnd\n\
         Material \"\" MediumInterface \"milk\" \"\" Translate .2 .1 -.45 Shape \"sphere\" \"float radius\" .4\n",
        shell(0.0, 1.0)
    );
    let mut n_compared = 0;
    for integrator in ["\"volpath\"", "\"bdpt\"", INTEGRATORS[7].0] {
        for camera in CAMERAS {
            // Paths of more than 60 events carry less than rounding does.
            let mut job = job(integrator, 60, SAMPLERS[2], camera, &world);
            let (found, sigmas) = deviation(&mut job, 1.0);
            assert!(
                sigmas.abs() <= SIGMAS,
                "{integrator} {camera}: {found}, off by {sigmas:.1} standard errors"
            );
            n_compared += 1;
        }
    }
    assert_eq!(n_compared, 3 * CAMERAS.len());
}

/// Nothing is open in a closed shell.
#[test]
fn ambient_occlusion_finds_no_way_out_of_a_shell() {
    for sampler in SAMPLERS {
        for camera in CAMERAS {
            let text = format!(
                "{camera}\nFilm \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\n\
                 Sampler {sampler}\nIntegrator \"ambientocclusion\"\nWorldBegin\n{}\nWorldEnd\n",
                shell(ALBEDO, 0.0)
            );
            let mut job = compile_scene(text, &CompileOptions::default(), |_| None).job;
            assert_eq!(mean(&mut job, 0), 0.0, "{sampler} {camera}");
        }
    }
}

#[test]
fn the_comparison_sees_one_event_too_few() {
    let mut job = job(
        INTEGRATORS[3].0,
        DEPTH - 1,
        SAMPLERS[0],
        CAMERAS[0],
        &shell(ALBEDO, 0.5),
    );
    let (_, sigmas) = deviation(&mut job, 0.5 * geometric(DEPTH + 1));
    assert!(sigmas < -SIGMAS, "{sigmas}");
}
