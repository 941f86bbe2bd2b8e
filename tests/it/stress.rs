//! Very many samples, and no mercy: pictures of the subset by two estimators that share little, and means with closed
//! forms, each deviation judged by its own noise.
//!
//! `cargo test --release --test it stress:: -- --ignored --nocapture` runs for as long as its environment asks:
//!
//! | variable | default | meaning |
//! |---|---|---|
//! | `STRESS_SPP` | 16 | samples per pixel of each picture |
//! | `STRESS_SEEDS` | 16 | pictures of each scene by each estimator |
//! | `STRESS_SAMPLES` | 1000000 | samples of each closed form |
//! | `STRESS_ONLY` | all | comparisons whose names hold this |
//! | `STRESS_REPORT` | `target/stress.md` | where the report goes: every comparison, its largest deviations first |
//!
//! A block of 16 × 16 pixels deviates by z standard errors, which are measured: the spread of its mean over the seeds. Of
//! n blocks the largest z of right pictures is about what chance gives, the bound that the report shows beside it.

#![expect(
    clippy::print_stdout,
    reason = "the report is worth reading while it grows"
)]

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::scene::compile_scene;
use crate::common::solids::{V, environment, homogeneous, null_box, null_sphere, seen_by, volpath};
use tyndall::compile::CompileOptions;
use tyndall::image::Image;
use tyndall::render::{Unwatched, render};
use tyndall_test_support::z_test::Mean;

/// Side of a block in pixels.
const BLOCK: usize = 16;

fn setting(name: &str, default: u32) -> u32 {
    std::env::var(name)
        .ok()
        .and_then(|value| value.parse().ok())
        .unwrap_or(default)
}

/// How far two means are apart.
struct Deviation {
    place: String,
    ours: f64,
    theirs: f64,
    z: f64,
}

/// One comparison.
struct Comparison {
    name: String,
    deviations: Vec<Deviation>,
}

impl Comparison {
    /// The largest deviation that chance gives once in a thousand such comparisons, if errors are those of as many
    /// pictures: the tails of few are long, so the bound of the normal law is widened by as much as Student's is.
    fn bound(&self, n_seeds: u32) -> f64 {
        let per_test = 1e-3 / self.deviations.len().max(1) as f64;
        let normal = (-2.0 * per_test.ln()).sqrt();
        let freedom = 2.0 * (f64::from(n_seeds) - 1.0);
        // Cornish and Fisher's first term.
        normal * (1.0 + (normal * normal + 1.0) / (4.0 * freedom))
    }

    fn worst(&self) -> f64 {
        self.deviations
            .iter()
            .map(|d| d.z.abs())
            .fold(0.0, f64::max)
    }
}

/// Pictures of a scene by an integrator, one for each seed.
fn pictures(file: &Path, text: &str, first_seed: u64) -> Vec<Image> {
    let directory = file.parent().expect("a file is in a directory");
    let read = |path: &str| std::fs::read(directory.join(path)).ok();
    let options = CompileOptions {
        quick: true,
        spp: Some(setting("STRESS_SPP", 16)),
        ..CompileOptions::default()
    };
    let mut job = compile_scene(text, &options, read).job;
    (0..u64::from(setting("STRESS_SEEDS", 16)))
        .map(|seed| {
            job.seed = first_seed + seed;
            let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
            assert_eq!(rendered.report.bad_samples, 0, "bad samples");
            let counters = rendered.report.counters;
            assert_eq!(counters.stuck_paths + counters.shadow.stuck, 0, "stuck");
            assert_eq!(counters.leaked_paths + counters.mismatched(), 0, "media");
            rendered.image
        })
        .collect()
}

/// Scattering events: connecting paths of many costs their square, and the integrand is the same at any depth.
const MAX_DEPTH: u32 = 6;

/// The scene under another integrator.
fn under(text: &str, integrator: &str) -> String {
    let lines: Vec<String> = text
        .lines()
        .map(|line| {
            if line.starts_with("Integrator \"") {
                format!("Integrator \"{integrator}\" \"integer maxdepth\" {MAX_DEPTH}")
            } else {
                line.to_owned()
            }
        })
        .collect();
    lines.join("\n") + "\n"
}

/// Mean of a channel over a block in each of several pictures.
fn block_mean(pictures: &[Image], [x0, y0]: [usize; 2], channel: usize) -> Mean {
    let mut values = pictures.iter().map(|image| {
        let (x1, y1) = (
            (x0 + BLOCK).min(image.width()),
            (y0 + BLOCK).min(image.height()),
        );
        let mut sum = 0.0;
        for y in y0..y1 {
            for x in x0..x1 {
                sum += f64::from(image.pixel(x, y)[channel]);
            }
        }
        sum / ((x1 - x0) * (y1 - y0)) as f64
    });
    Mean::of(pictures.len(), || {
        values.next().expect("one for each picture")
    })
}

fn z(a: &Mean, b: &Mean) -> f64 {
    // What single precision rounds counts as noise.
    let rounding = 1e-5 * a.value.abs().max(b.value.abs());
    let error = a.standard_error.hypot(b.standard_error).hypot(rounding);
    if error > 0.0 {
        (a.value - b.value) / error
    } else {
        0.0
    }
}

/// Every block of two sets of pictures.
fn compare(name: String, ours: &[Image], theirs: &[Image]) -> Comparison {
    let (width, height) = (ours[0].width(), ours[0].height());
    let mut deviations = Vec::new();
    for y in (0..height).step_by(BLOCK) {
        for x in (0..width).step_by(BLOCK) {
            for channel in 0..3 {
                let [a, b] = [ours, theirs].map(|pictures| block_mean(pictures, [x, y], channel));
                deviations.push(Deviation {
                    place: format!("block ({x}, {y}), channel {channel}"),
                    ours: a.value,
                    theirs: b.value,
                    z: z(&a, &b),
                });
            }
        }
    }
    Comparison { name, deviations }
}

/// Scenes of the subset, and another integrator that finds the same light. Null surfaces, shadow masks and subsurface
/// scattering mean different things to the integrators of pbrt-v3, and what a light without extent sends through glass is
/// found from its end alone: scenes with those have no partner here. Nor have curves, which rays leave two widths away, so
/// that what is seen between them depends on the end where the path starts.
const PAIRS: [(&str, &str, &str); 10] = [
    ("amber/amber", "volpath", "bdpt"),
    ("cameras/orthographic", "path", "bdpt"),
    ("cloud/cloud", "volpath", "bdpt"),
    ("disney/disney", "path", "bdpt"),
    ("leaves/leaves", "volpath", "bdpt"),
    ("lights/spot", "path", "bdpt"),
    ("lights/projection", "path", "bdpt"),
    ("room/room", "volpath", "bdpt"),
    ("shapes/shapes", "path", "bdpt"),
    ("smoke/smoke", "volpath", "bdpt"),
];

/// Name, scene, radiance.
fn closed_forms() -> Vec<(&'static str, String, V)> {
    const EYE: V = [0.13, 0.21, -5.0];
    const AHEAD: V = [0.0, 0.0, 1.0];
    const ONE: V = [1.0; 3];
    let furnace = |world: &str| volpath(1_000_000, EYE, AHEAD, &(environment(ONE) + world));
    let slab = |sigma_a: V, sigma_s: V, depth: u32| {
        let world = homogeneous("fog", sigma_a, sigma_s, 0.0)
            + &environment(ONE)
            + &null_box([-50.0, -50.0, 0.0], [50.0, 50.0, 1.0], "fog", "");
        volpath(depth, EYE, AHEAD, &world)
    };
    let ball =
        |medium: &str| furnace(&(medium.to_owned() + &null_sphere([0.0; 3], 1.0, "fog", "")));
    let body = |material: &str| furnace(&format!("Material {material} Shape \"sphere\"\n"));
    let lamp = "AreaLightSource \"diffuse\" \"rgb L\" [4 4 4] Translate 0.13 0.21 4 Shape \"sphere\" \"float radius\" 0.5\n";
    // A floor seen from below the lamp: pi sin² of its half angle.
    let floor = "AttributeBegin Material \"matte\" \"rgb Kd\" [.5 .5 .5] Shape \"disk\" \"float radius\" 50 AttributeEnd\n";
    let under_lamp = |integrator: &str| {
        let toward = [-0.5, 0.0, -0.5];
        seen_by(
            integrator,
            1,
            [0.63, 0.21, 0.5],
            toward,
            &(floor.to_owned() + lamp),
        )
    };
    let lit = [0.5 * 4.0 * 0.25 / 16.0; 3];
    vec![
        (
            "furnace: fog",
            ball(&homogeneous("fog", [0.0; 3], ONE, 0.0)),
            ONE,
        ),
        (
            "furnace: coloured fog, forward",
            ball(&homogeneous("fog", [0.0; 3], [5.0, 1.0, 0.2], 0.9)),
            ONE,
        ),
        (
            "furnace: thick fog, backward",
            ball(&homogeneous("fog", [0.0; 3], [20.0; 3], -0.6)),
            ONE,
        ),
        (
            "furnace: white matte ball",
            body("\"matte\" \"rgb Kd\" [1 1 1]"),
            ONE,
        ),
        ("furnace: smooth glass ball", body("\"glass\""), ONE),
        (
            "slab: absorption",
            slab([0.5, 1.0, 2.0], [0.0; 3], 5),
            [0.5, 1.0, 2.0].map(|s: f64| (-s).exp()),
        ),
        ("ball lamp over a floor, path", under_lamp("path"), lit),
        (
            "ball lamp over a floor, volpath",
            under_lamp("volpath"),
            lit,
        ),
        (
            "ball lamp over a floor, directlighting",
            under_lamp("directlighting"),
            lit,
        ),
        ("ball lamp over a floor, bdpt", under_lamp("bdpt"), lit),
    ]
}

fn closed_form(name: &str, scene: &str, expected: V) -> Comparison {
    let means = Probe::new(scene).means(setting("STRESS_SAMPLES", 1_000_000));
    let deviations = means.iter().zip(expected).enumerate();
    Comparison {
        name: name.to_owned(),
        deviations: deviations
            .map(|(channel, (mean, expected))| Deviation {
                place: format!("channel {channel}"),
                ours: mean.value,
                theirs: expected,
                z: z(
                    mean,
                    &Mean {
                        value: expected,
                        standard_error: 0.0,
                    },
                ),
            })
            .collect(),
    }
}

/// The comparisons, those with the largest deviations first, and in each the largest ones.
fn report(comparisons: &mut [Comparison], n_seeds: u32) -> String {
    comparisons.sort_by(|a, b| b.worst().total_cmp(&a.worst()));
    let mut text = String::from(
        "| comparison | means compared | largest z | bound | where | value | reference |\n|---|---|---|---|---|---|---|\n",
    );
    for comparison in comparisons {
        let bound = comparison.bound(n_seeds);
        comparison
            .deviations
            .sort_by(|a, b| b.z.abs().total_cmp(&a.z.abs()));
        for worst in comparison.deviations.iter().take(3) {
            let _ = writeln!(
                text,
                "| {} | {} | {:.2} | {bound:.1} | {} | {:.6} | {:.6} |",
                comparison.name,
                comparison.deviations.len(),
                worst.z,
                worst.place,
                worst.ours,
                worst.theirs
            );
        }
    }
    text
}

#[test]
#[ignore = "runs for as long as its environment asks"]
fn many_samples_find_no_deviation() {
    let n_seeds = setting("STRESS_SEEDS", 16);
    let only = std::env::var("STRESS_ONLY").unwrap_or_default();
    let mut comparisons = Vec::new();
    for (name, scene, expected) in closed_forms() {
        if !name.contains(&only) {
            continue;
        }
        comparisons.push(closed_form(name, &scene, expected));
        println!("{name}: {:.2}", comparisons[comparisons.len() - 1].worst());
    }
    for (scene, first, second) in PAIRS {
        let name = format!("{scene}: {first}, {second}");
        if !name.contains(&only) {
            continue;
        }
        let file = Path::new("assets/pbrt-v3-scenes-subset").join(format!("{scene}.pbrt"));
        let text = std::fs::read_to_string(&file).expect("the scene is there");
        let ours = pictures(&file, &under(&text, first), 0);
        let theirs = pictures(&file, &under(&text, second), 1 << 20);
        let comparison = compare(name, &ours, &theirs);
        println!("{}: {:.2}", comparison.name, comparison.worst());
        comparisons.push(comparison);
    }
    let text = report(&mut comparisons, n_seeds);
    let path = std::env::var_os("STRESS_REPORT")
        .map_or_else(|| PathBuf::from("target/stress.md"), PathBuf::from);
    if let Some(directory) = path.parent() {
        std::fs::create_dir_all(directory).expect("a directory for the report");
    }
    std::fs::write(&path, &text).expect("a report");
    println!("{text}");
    let beyond: Vec<&str> = comparisons
        .iter()
        .filter(|comparison| comparison.worst() > comparison.bound(n_seeds))
        .map(|comparison| comparison.name.as_str())
        .collect();
    assert!(beyond.is_empty(), "beyond chance: {beyond:?}");
}

#[test]
fn a_planted_deviation_of_two_percent_is_beyond_chance_and_none_is_not() {
    let file = Path::new("assets/pbrt-v3-scenes-subset/lights/spot.pbrt");
    let text = std::fs::read_to_string(file).expect("the scene is there");
    let ours = pictures(file, &text, 0);
    let theirs = pictures(file, &text, 1 << 20);
    let n_seeds = setting("STRESS_SEEDS", 16);
    let same = compare("same".to_owned(), &ours, &theirs);
    assert!(same.worst() < same.bound(n_seeds), "{}", same.worst());
    let brighter: Vec<Image> = theirs
        .into_iter()
        .map(|mut image| {
            image.data_mut().iter_mut().for_each(|c| *c *= 1.02);
            image
        })
        .collect();
    let other = compare("brighter".to_owned(), &ours, &brighter);
    assert!(other.worst() > other.bound(n_seeds), "{}", other.worst());
}

#[test]
fn closed_forms_hold_with_few_samples() {
    for (name, scene, expected) in closed_forms() {
        if name.starts_with("slab") {
            assert_exact(&scene, expected, name);
        } else {
            assert_mean(&scene, 2000, expected, name);
        }
    }
}
