//! Pictures of generated scenes, and whether they are the same.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};
use tyndall::compile::{Assets, CompileOptions, compile};
use tyndall::describe::describe;
use tyndall::image::Image;
use tyndall::render::{Job, Unwatched, render};
use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{NoIncludes, parse};

/// Standard errors within which means agree: thousands are compared.
const SIGMAS: f64 = 6.0;

struct NoFiles;

impl Assets for NoFiles {
    fn read(&self, _path: &Spanned<String>) -> Result<SourceBytes, String> {
        Ok(Arc::new(Vec::new()) as SourceBytes)
    }
}

/// The job of a scene. Warnings are of no interest here, errors are.
pub(crate) fn job(scene: &str) -> Job {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", scene.as_bytes().to_vec());
    let (file, mut findings) = parse(&mut sources, root, &NoIncludes);
    let (described, more) = describe(file);
    findings.extend(more);
    let frame = described.frames.into_iter().next().expect("a frame");
    let (compiled, more) = compile(frame, &CompileOptions::default(), &NoFiles);
    findings.extend(more);
    assert!(!findings.has_errors(), "{:?} in\n{scene}", findings.list);
    compiled.expect("a job").job
}

pub(crate) fn picture(job: &Job) -> Image {
    let rendered = render(job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(rendered.report.bad_samples, 0, "bad samples");
    assert_eq!(rendered.report.counters.stuck_paths, 0, "stuck paths");
    assert_eq!(rendered.report.counters.shadow.stuck, 0, "stuck rays");
    assert_eq!(rendered.report.counters.leaked_paths, 0, "leaked paths");
    rendered.image
}

/// Runs a property over generated cases: `n` of them, always the same, or as many others as the environment says.
pub(crate) fn for_all<S: Strategy>(
    n: u32,
    is_long: bool,
    strategy: S,
    property: impl Fn(S::Value) -> Result<(), TestCaseError>,
) {
    let wanted = std::env::var("INVARIANCE_CASES").ok();
    let cases = match wanted.and_then(|n| n.parse().ok()) {
        Some(wanted) if is_long => wanted,
        _ if is_long => 20 * n,
        _ => n,
    };
    let config = Config {
        cases,
        max_shrink_iters: 64,
        failure_persistence: None,
        ..Config::default()
    };
    let mut runner = if is_long {
        TestRunner::new(config)
    } else {
        let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
        TestRunner::new_with_rng(config, rng)
    };
    if let Err(failure) = runner.run(&strategy, property) {
        panic!("{failure}");
    }
}

/// The same bits.
pub(crate) fn assert_identical(a: &Image, b: &Image, what: &str) -> Result<(), TestCaseError> {
    let n = a
        .data()
        .iter()
        .zip(b.data())
        .filter(|(a, b)| a.to_bits() != b.to_bits())
        .count();
    prop_assert!(n == 0, "{what}: {n} of {} numbers differ", a.data().len());
    Ok(())
}

/// The same but for a few pixels, where rounding sends a path elsewhere.
pub(crate) fn assert_alike(a: &Image, b: &Image, what: &str) -> Result<(), TestCaseError> {
    let n = a
        .data()
        .iter()
        .zip(b.data())
        .filter(|(a, b)| (**a - **b).abs() > 1e-2 * a.abs().max(b.abs()).max(1e-3))
        .count();
    let most = a.data().len() / 20;
    prop_assert!(
        n <= most,
        "{what}: {n} of {} numbers differ",
        a.data().len()
    );
    Ok(())
}

/// The same but for one pixel in a hundred, and in the mean of each block of 8 × 8 pixels.
pub(crate) fn assert_close(a: &Image, b: &Image, what: &str) -> Result<(), TestCaseError> {
    let [width, height] = [a.width(), a.height()];
    let is_off =
        |a: f32, b: f32, tolerance: f32| (a - b).abs() > tolerance * a.abs().max(b.abs()).max(1.0);
    let pixels = || a.data().chunks(3).zip(b.data().chunks(3));
    let n = pixels()
        .filter(|(a, b)| (0..3).any(|k| is_off(a[k], b[k], 1e-4)))
        .count();
    prop_assert!(
        100 * n <= width * height,
        "{what}: {n} of {} pixels differ",
        width * height
    );
    for (y0, x0) in (0..height)
        .step_by(8)
        .flat_map(|y| (0..width).step_by(8).map(move |x| (y, x)))
    {
        let (mut sums, mut n) = ([[0.0f32; 3]; 2], 0.0);
        for (i, (a, b)) in pixels().enumerate() {
            let (y, x) = (i / width, i % width);
            if (y0..y0 + 8).contains(&y) && (x0..x0 + 8).contains(&x) {
                n += 1.0;
                for k in 0..3 {
                    sums[0][k] += a[k];
                    sums[1][k] += b[k];
                }
            }
        }
        let [ours, theirs] = sums;
        for (a, b) in ours.into_iter().zip(theirs) {
            let [a, b] = [a / n, b / n];
            prop_assert!(
                !is_off(a, b, 1e-3),
                "{what}: {a} and {b} in the block at {x0} {y0}"
            );
        }
    }
    Ok(())
}

/// Mean of a channel over pictures of several seeds, and its standard error. Where few pictures hold all the light, their
/// spread understates it: one picture more like the brightest would move the mean by what is added.
fn spread(channel: usize, pictures: &[Image]) -> (f64, f64) {
    let means: Vec<f64> = pictures
        .iter()
        .map(|image| {
            let pixels = image
                .data()
                .chunks(3)
                .map(|pixel| f64::from(pixel[channel]));
            pixels.sum::<f64>() / (image.data().len() / 3) as f64
        })
        .collect();
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let squares: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
    let brightest = means.iter().copied().fold(mean, f64::max);
    (
        mean,
        (squares / (n - 1.0) / n).sqrt() + (brightest - mean) / n,
    )
}

/// The same mean, by pictures with several seeds.
pub(crate) fn assert_same_mean(a: &str, b: &str, what: &str) -> Result<(), TestCaseError> {
    const N_SEEDS: u64 = 24;
    let pictures = |scene: &str, first: u64| -> Vec<Image> {
        let mut job = job(scene);
        (first..first + N_SEEDS)
            .map(|seed| {
                job.seed = seed;
                picture(&job)
            })
            .collect()
    };
    // Other seeds, so that the two are independent.
    let (ours, theirs) = (pictures(a, 0), pictures(b, 1000));
    for channel in 0..3 {
        let (x, ex) = spread(channel, &ours);
        let (y, ey) = spread(channel, &theirs);
        let error = ex.hypot(ey) + 1e-5 * x.abs().max(y.abs());
        prop_assert!(
            (x - y).abs() <= SIGMAS * error,
            "{what}, channel {channel}: {x} and {y} ± {error}\n{a}\n{b}"
        );
    }
    Ok(())
}
