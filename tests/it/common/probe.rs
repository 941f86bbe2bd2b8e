//! Radiance along one camera ray, as independent samples.

use tyndall::camera::CameraSample;
use tyndall::compile::CompileOptions;
use tyndall::integrator::Counters;
use tyndall::integrator::trace::Unobserved;
use tyndall::render::Job;
use tyndall::sampler::Sampler;
use tyndall::sampling::rng::Rng;
use tyndall_test_support::z_test::Mean;

use super::scene::compile_scene;

/// Relative error allowed where an answer needs no dice: single precision, and the logarithm of what it computes.
pub(crate) const PRECISION: f64 = 2e-5;

/// The radiance that arrives along the axis of a scene's camera.
pub(crate) struct Probe {
    job: Job,
}

impl Probe {
    /// Compiles a scene that names no files and sets neither film nor filter.
    #[track_caller]
    pub(crate) fn new(scene: &str) -> Self {
        let text = format!(
            "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\n\
             PixelFilter \"box\"\n{scene}"
        );
        Self::of(compile_scene(text, &CompileOptions::default(), |_| None).job)
    }

    /// The camera of a job whose film is one pixel.
    pub(crate) fn of(job: Job) -> Self {
        assert_eq!(
            job.film.resolution,
            [1, 1],
            "the axis is in the middle of the pixel"
        );
        Self { job }
    }

    /// `n` samples, independent of each other: each has a seed of its own.
    #[track_caller]
    pub(crate) fn samples(&self, n: u32) -> Vec<[f32; 3]> {
        self.samples_within(0.0, 0, n)
    }

    /// The same from a square around the axis with a `side` in pixels; seeds begin with `first`.
    #[track_caller]
    pub(crate) fn samples_within(&self, side: f32, first: u32, n: u32) -> Vec<[f32; 3]> {
        let mut counters = Counters::default();
        let samples = (first..first + n)
            .map(|seed| {
                let mut sampler = Sampler::new(seed.into(), [0, 0], 0);
                let mut place = Rng::new(!u64::from(seed));
                let taken = CameraSample {
                    raster: place.uniform2().map(|u| f64::from(0.5 + side * (u - 0.5))),
                    time: 0.0,
                    lens: [0.5, 0.5],
                };
                let camera = &self.job.camera;
                let ray = camera.ray(&taken).expect("a pinhole").ray;
                let differential = camera.differential(&taken, 1.0).expect("a pinhole");
                let (world, ray) = (&self.job.world, ray);
                self.job
                    .integrator
                    .li(
                        world,
                        ray,
                        Some(&differential),
                        &mut sampler,
                        &mut counters,
                        &mut Unobserved,
                    )
                    .to_array()
            })
            .collect();
        assert_eq!(counters.stuck_paths, 0, "paths are stuck");
        assert_eq!(counters.shadow.stuck, 0, "rays toward lights are stuck");
        assert_eq!(counters.leaked_paths, 0, "paths have left a bounded medium");
        assert_eq!(
            counters.mismatched(),
            0,
            "paths meet boundaries from a medium they do not border on"
        );
        samples
    }

    /// The mean radiance of `n` samples, per channel.
    #[track_caller]
    pub(crate) fn means(&self, n: u32) -> [Mean; 3] {
        let samples = self.samples(n);
        [0, 1, 2].map(|channel| {
            let mut values = samples.iter().map(|sample| f64::from(sample[channel]));
            Mean::of(samples.len(), || values.next().expect("one value per call"))
        })
    }
}

/// Radiance that needs no dice: every sample must be the expected value.
#[track_caller]
pub(crate) fn assert_exact(scene: &str, expected: [f64; 3], what: &str) {
    assert_within(scene, expected, PRECISION, what);
}

/// The same to a relative error.
#[track_caller]
pub(crate) fn assert_within(scene: &str, expected: [f64; 3], tolerance: f64, what: &str) {
    for sample in Probe::new(scene).samples(16) {
        for (actual, expected) in sample.into_iter().zip(expected) {
            let error = (f64::from(actual) - expected).abs();
            assert!(
                error <= tolerance * expected.abs(),
                "{what}: {sample:?} is not {expected}"
            );
        }
    }
}

/// The mean radiance of `n` samples is the expected value, to four standard errors in each channel.
#[track_caller]
pub(crate) fn assert_mean(scene: &str, n: u32, expected: [f64; 3], what: &str) {
    let means = Probe::new(scene).means(n);
    for (channel, (mean, expected)) in means.iter().zip(expected).enumerate() {
        // What is left to rounding is judged as if it were noise.
        let mean = Mean {
            standard_error: mean.standard_error.hypot(PRECISION * expected / 4.0),
            ..*mean
        };
        mean.agrees_with(expected)
            .assert_accepted(&format!("{what}, channel {channel}"));
    }
}
