//! Pictures of one scene with several seeds, and whether they agree with a converged one.
//!
//! The noise is measured, not assumed: the spread over the seeds gives standard errors s. That of one block's mean is known
//! badly from few seeds; it is taken from the spreads of the block's pixels, of which there are many, times one factor
//! for the picture by which the means of blocks spread more than pixels of their own noise would make them: filters
//! reach over several. The reference has noise too: if one of its samples varies as ours do, its variance is s² · (our samples per pixel) / (its
//! samples per pixel). The two add up, and a block may be off by `BLOCK_SIGMAS` of the sum's root plus `HALF_FLOAT` of
//! its value, by which the reference is rounded. The whole picture's mean may be off by `MEAN_TOLERANCE` plus four
//! standard errors.

#![expect(clippy::print_stdout, reason = "how close it was is worth reading")]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use super::scene::compile_scene;
use tyndall::compile::CompileOptions;
use tyndall::image::codec::decode;
use tyndall::image::{Image, PixelRect};
use tyndall::render::{Unwatched, render};

/// Side of a block in pixels.
pub(crate) const BLOCK: usize = 16;
/// Standard errors within which a block agrees. There are hundreds of blocks in a picture, some noise has a long tail, and
/// pixels are ratios of two sums over a filter, which few samples shift at edges: whence more than the usual four.
const BLOCK_SIGMAS: f64 = 7.0;
/// Half of the spacing of 11-bit significands, and as much again for what the film rounds.
const HALF_FLOAT: f64 = 1e-3;
/// Relative difference of means that is accepted besides noise.
const MEAN_TOLERANCE: f64 = 0.003;

/// Pictures of one scene with different seeds.
pub(crate) struct Renders {
    pub(crate) pictures: Vec<Image>,
    /// Samples per pixel of all of them together.
    pub(crate) spp: f64,
    /// Least number of samples per pixel of the reference.
    pub(crate) reference_spp: f64,
}

/// Renders a scene with `n_seeds` seeds; only what `window` needs, if there is one.
pub(crate) fn render_seeds(
    file: &Path,
    n_seeds: u64,
    options: &CompileOptions,
    window: Option<PixelRect>,
    reference_spp: f64,
) -> Renders {
    let text = std::fs::read(file).expect("the scene is there");
    render_text_seeds(text, file, n_seeds, options, window, reference_spp)
}

/// The same for a text that stands in for a file.
pub(crate) fn render_text_seeds(
    text: Vec<u8>,
    file: &Path,
    n_seeds: u64,
    options: &CompileOptions,
    window: Option<PixelRect>,
    reference_spp: f64,
) -> Renders {
    let directory = file.parent().expect("a file is in a directory");
    let read = |path: &str| std::fs::read(directory.join(path)).ok();
    let mut job = compile_scene(text, options, read).job;
    let spp = job.spp;
    job.pixel_bounds = window.map(|window| grown(window, job.film.filter.radius()));
    let pictures = (0..n_seeds)
        .map(|seed| {
            job.seed = seed;
            let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
            assert_eq!(
                rendered.report.bad_samples, 0,
                "samples that are no numbers"
            );
            assert_eq!(rendered.report.counters.stuck_paths, 0, "stuck paths");
            assert_eq!(rendered.report.counters.leaked_paths, 0, "leaked paths");
            assert_eq!(
                rendered.report.counters.shadow.stuck, 0,
                "stuck rays toward lights"
            );
            assert_eq!(
                rendered.report.counters.mismatched(),
                0,
                "boundaries met from another medium"
            );
            match window {
                Some(window) => rendered
                    .image
                    .crop(window)
                    .expect("a window of the picture"),
                None => rendered.image,
            }
        })
        .collect();
    Renders {
        pictures,
        spp: (n_seeds * u64::from(spp)) as f64,
        reference_spp,
    }
}

/// The pixels whose samples reach a window.
fn grown(window: PixelRect, radius: [f64; 2]) -> PixelRect {
    let [rx, ry] = radius.map(|r| r.ceil() as usize);
    PixelRect {
        x0: window.x0 - rx as i32,
        y0: window.y0 - ry as i32,
        width: window.width + 2 * rx,
        height: window.height + 2 * ry,
    }
}

pub(crate) fn read_reference(file: &Path) -> Image {
    let bytes = std::fs::read(file).expect("the reference is there");
    decode(&bytes, "exr")
        .expect("the reference is an EXR")
        .image
}

/// The blocks of a picture, row by row.
fn blocks(image: &Image) -> Vec<PixelRect> {
    let (width, height) = (image.width(), image.height());
    let block = |x: usize, y: usize| PixelRect {
        x0: x as i32,
        y0: y as i32,
        width: BLOCK.min(width - x),
        height: BLOCK.min(height - y),
    };
    (0..height)
        .step_by(BLOCK)
        .flat_map(|y| (0..width).step_by(BLOCK).map(move |x| block(x, y)))
        .collect()
}

/// The pixels of a rectangle, each as one.
fn pixels(rect: PixelRect) -> impl Iterator<Item = PixelRect> {
    let (width, height) = (rect.width as i32, rect.height as i32);
    (0..width * height).map(move |i| PixelRect {
        x0: rect.x0 + i % width,
        y0: rect.y0 + i / width,
        width: 1,
        height: 1,
    })
}

/// Mean of a channel over a rectangle.
fn mean(image: &Image, rect: PixelRect, channel: usize) -> f64 {
    let mut sum = 0.0;
    for y in 0..rect.height {
        for x in 0..rect.width {
            let [x, y] = [rect.x0 as usize + x, rect.y0 as usize + y];
            sum += f64::from(image.pixel(x, y)[channel]);
        }
    }
    sum / (rect.width * rect.height) as f64
}

/// Mean of several numbers and its standard error.
fn spread(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0) / n).sqrt())
}

impl Renders {
    /// Every way in which the pictures disagree with the reference.
    pub(crate) fn disagreements(&self, reference: &Image) -> Vec<String> {
        let first = &self.pictures[0];
        assert_eq!(
            (first.width(), first.height()),
            (reference.width(), reference.height()),
            "pictures of one size"
        );
        let reference_share = (self.spp / self.reference_spp).sqrt();
        let blocks = blocks(first);
        let mut found = Vec::new();
        for channel in 0..3 {
            let over_seeds = |rect: PixelRect| {
                let means: Vec<f64> = self
                    .pictures
                    .iter()
                    .map(|picture| mean(picture, rect, channel))
                    .collect();
                spread(&means)
            };
            let (ours, error) = over_seeds(first.bounds());
            let theirs = mean(reference, first.bounds(), channel);
            let error = error * 1f64.hypot(reference_share);
            println!("channel {channel}: {ours} ± {error:.1e}, reference {theirs}");
            if (ours - theirs).abs() > MEAN_TOLERANCE * theirs.abs() + 4.0 * error {
                found.push(format!(
                    "mean {channel}: {ours} ± {error:.1e} is not {theirs}"
                ));
            }

            let of_blocks: Vec<(f64, f64)> = blocks.iter().map(|&rect| over_seeds(rect)).collect();
            let by_pixels: Vec<f64> = blocks
                .iter()
                .map(|&rect| {
                    let pixels = pixels(rect).map(|pixel| over_seeds(pixel).1.powi(2));
                    pixels.sum::<f64>() / (rect.width * rect.height).pow(2) as f64
                })
                .collect();
            let together: f64 = of_blocks.iter().map(|(_, error)| error.powi(2)).sum();
            let factor = together / by_pixels.iter().sum::<f64>();
            let mut worst = 0f64;
            for ((&rect, (ours, _)), by_pixels) in blocks.iter().zip(of_blocks).zip(by_pixels) {
                let theirs = mean(reference, rect, channel);
                // Without any noise the factor is 0 / 0, and so is what it multiplies.
                let error = (by_pixels * factor).max(0.0).sqrt() * 1f64.hypot(reference_share);
                let excess = (ours - theirs).abs() - HALF_FLOAT * theirs.abs();
                worst = worst.max(excess / error);
                if excess.is_nan() || excess > BLOCK_SIGMAS * error {
                    let [x, y] = [rect.x0, rect.y0];
                    found.push(format!(
                        "block ({x}, {y}), channel {channel}: {ours} ± {error:.1e} is not {theirs}"
                    ));
                }
            }
            println!("channel {channel}: the worst block is {worst:.1} sigma off");
        }
        found
    }
}
