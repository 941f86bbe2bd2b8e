//! Pictures of single strategies: parts of the whole, or each of them the whole of a depth.

use tyndall::film::{Filter, FilterTable};
use tyndall::image::Image;
use tyndall::integrator::bdpt::{Strategy, Visualized};
use tyndall::integrator::{Bdpt, Integrator};
use tyndall::render::Job;

use crate::bidirectional::invariance::{WINDOW, assert_identical, in_window};
use crate::bidirectional::setup::{CAMERA, LIGHTS, ROOM, compare_pictures, job, rendered};
use crate::common::findings::findings;

const WEIGHTS: &str = "\"bdpt\" \"integer maxdepth\" 3 \"bool visualizeweights\" \"true\"";
const STRATEGIES: &str = "\"bdpt\" \"integer maxdepth\" 2 \"bool visualizestrategies\" \"true\"";

/// A floor and a ball above it under a round lamp, all of them apart: no two points of surfaces are so close that a
/// strategy which joins them has no variance.
const APART: &str = "\
    AttributeBegin Material \"matte\" \"rgb Kd\" [.7 .5 .3]\n\
    Shape \"trianglemesh\" \"point P\" [-3 -.5 -3  -3 -.5 3  3 -.5 3  3 -.5 -3] \
    \"integer indices\" [0 1 2 0 2 3] AttributeEnd\n\
    AttributeBegin Material \"matte\" \"rgb Kd\" [.8 .8 .8] Translate -.5 .7 0\n\
    Shape \"sphere\" \"float radius\" .6 AttributeEnd\n\
    AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4] Translate 1 1.8 -.5\n\
    Shape \"sphere\" \"float radius\" .4 AttributeEnd\n";

fn several_lights(integrator: &str) -> Job {
    let world = format!("{ROOM}{}", LIGHTS[9].1);
    job(integrator, CAMERA, 20, &world)
}

#[test]
fn the_strategies_by_weight_add_up_to_the_picture() {
    let mut job = several_lights(WEIGHTS);
    let filter = Filter::Mitchell {
        b: 1.0 / 3.0,
        c: 1.0 / 3.0,
    };
    // Negative weights, parts of the frame beside it, and a scale.
    job.film.filter = FilterTable::new(filter, [2.0, 1.5]);
    job.film.scale = 1.5;
    let rendered = rendered(&job);
    assert_eq!(rendered.strategies.len(), Strategy::all(3).count());
    let mut n_lit = 0;
    for (i, &expected) in rendered.image.data().iter().enumerate() {
        let parts = rendered.strategies.iter().map(|part| part.data()[i]);
        let size: f64 = parts.clone().map(|x| f64::from(x).abs()).sum();
        let sum: f64 = parts.map(f64::from).sum();
        let error = (sum.max(0.0) - f64::from(expected)).abs();
        assert!(error <= 1e-5 * size, "number {i}: {sum} for {expected}");
        n_lit += usize::from(expected > 0.0);
    }
    assert!(n_lit > 100, "{n_lit} numbers are lit");
    for (strategy, part) in Strategy::all(3).zip(&rendered.strategies) {
        let is_lit = part.data().iter().any(|&x| x > 0.0);
        assert!(is_lit, "{strategy:?} finds nothing");
    }
}

#[test]
fn a_picture_is_the_same_bits_with_its_strategies_shown_and_without() {
    let mut job = several_lights(WEIGHTS);
    let shown = rendered(&job);
    let Integrator::Bdpt(bdpt) = &mut job.integrator else {
        panic!("{:?}", job.integrator);
    };
    bdpt.visualized = None;
    let plain = rendered(&job);
    assert_identical(&shown.image, &plain.image, "with strategies");
    assert!(plain.strategies.is_empty());
}

#[test]
fn strategies_that_find_every_path_of_a_depth_agree() {
    let mut job = job(STRATEGIES, CAMERA, 64, APART);
    // Of each strategy, pictures from two disjoint sets of seeds.
    let n_seeds = 24;
    let mut pictures = [0, n_seeds].map(|first| -> Vec<Vec<Image>> {
        let mut of_strategies = vec![Vec::new(); Strategy::all(2).count()];
        for seed in first..first + n_seeds {
            job.seed = seed;
            let images = rendered(&job).strategies;
            for (pictures, image) in of_strategies.iter_mut().zip(images) {
                pictures.push(image);
            }
        }
        of_strategies
    });
    for depth in [1, 2] {
        let by_sampling_lights = Strategy { s: 1, t: depth + 1 };
        for strategy in Strategy::all(2).filter(|strategy| strategy.depth() == depth) {
            let verdict = compare_pictures(
                &pictures[0][strategy.index()],
                &pictures[1][by_sampling_lights.index()],
            );
            assert!(verdict.accepted(), "{strategy:?}: {}", verdict.explanation);
        }
    }
    // What only finds a part, or counts it otherwise, is seen.
    let [a, b] = [Strategy { s: 1, t: 2 }, Strategy { s: 1, t: 3 }].map(Strategy::index);
    assert!(!compare_pictures(&pictures[0][a], &pictures[1][b]).accepted());
    for image in &mut pictures[0][a] {
        image.data_mut().iter_mut().for_each(|x| *x *= 1.1);
    }
    assert!(!compare_pictures(&pictures[0][a], &pictures[1][a]).accepted());
}

#[test]
fn neither_crop_nor_threads_change_a_bit_of_a_strategy() {
    let mut job = several_lights(STRATEGIES);
    let with = |job: &Job, n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build();
        pool.expect("threads").install(|| rendered(job).strategies)
    };
    let whole = with(&job, 1);
    for (many, one) in with(&job, 5).iter().zip(&whole) {
        assert_identical(many, one, "threads");
    }
    job.film.crop = WINDOW;
    for (part, whole) in with(&job, 2).iter().zip(&whole) {
        assert_identical(part, &in_window(whole), "crop");
    }
}

#[test]
fn weights_go_before_strategies_and_long_paths_are_lowered_with_a_warning() {
    let of = |parameters: &str| {
        let world = format!("{ROOM}{}", LIGHTS[0].1);
        let job = job(&format!("\"bdpt\" {parameters}"), CAMERA, 1, &world);
        let Integrator::Bdpt(Bdpt {
            max_depth,
            visualized,
            ..
        }) = job.integrator
        else {
            panic!("{:?}", job.integrator);
        };
        (max_depth, visualized)
    };
    let (strategies, weights) = (
        "\"bool visualizestrategies\" \"true\" ",
        "\"bool visualizeweights\" \"true\" ",
    );
    let deep = "\"integer maxdepth\" 9 ";
    assert_eq!(of(deep), (9, None));
    assert_eq!(of(strategies), (5, Some(Visualized::Strategies)));
    assert_eq!(of(weights), (5, Some(Visualized::Weights)));
    let both = format!("{strategies}{weights}");
    assert_eq!(of(&both), (5, Some(Visualized::Weights)));

    let lowered = |parameters: &str| {
        let scene = format!(
            "Integrator \"bdpt\" {parameters} WorldBegin LightSource \"point\" \
             Shape \"sphere\" WorldEnd"
        );
        let found = findings(&scene);
        found.iter().any(|(code, _)| code == "lowered-depth")
    };
    assert!(lowered(&format!("{deep}{weights}")));
    assert!(lowered(&format!("{strategies}{deep}")));
    assert!(!lowered(strategies) && !lowered(deep));
}

#[test]
fn every_film_counts_as_memory() {
    let needed = |integrator: &str| several_lights(integrator).bytes_needed();
    let n_strategies = Strategy::all(3).count() as u128;
    let [plain, shown] = ["\"bdpt\" \"integer maxdepth\" 3", WEIGHTS].map(needed);
    assert!(
        shown - plain > n_strategies * 12 * 12 * 32,
        "{plain}, {shown}"
    );
    assert!(plain > needed("\"path\""), "splats");
    let chains = |n: u32| {
        needed(&format!(
            "\"mlt\" \"integer bootstrapsamples\" 1 \"integer chains\" {n}"
        ))
    };
    assert!(
        chains(1) > chains(1000) + 12 * 12 * 100,
        "splats of a chain"
    );
}
