//! Paths in a cloud that share what they find: the same pictures as by paths alone, with less noise.

use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::image::Image;
use tyndall::integrator::trace::Unobserved;
use tyndall::render::{Job, Unwatched, render, retake};

use crate::nebula::Nebula;
use crate::scene::compile_scene;
use crate::seen::seen_by;
use crate::skies::{SKY, map};
use crate::solids::null_box;

const SIZE: usize = 12;
const SPP: u32 = 4;

/// A cloud in a box, beside a floor, under a sky; `film` goes on with the film's directive.
fn job(film: &str) -> Job {
    let cloud =
        Nebula::ragged([9, 8, 10], [-1.0; 3], [1.0; 3]).medium("cloud", [0.2; 3], [4.0; 3], 0.0);
    let wall = null_box([-1.0; 3], [1.0; 3], "cloud", "");
    let floor = "AttributeBegin Translate 0 -2 0 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 4 AttributeEnd\n";
    let world = format!("{SKY}{cloud}{wall}{floor}");
    let seen = seen_by("volpath", 6, [0.13, 0.21, -3.0], [0.0, 0.0, 1.0], &world);
    let text = format!(
        "Sampler \"02sequence\" \"integer pixelsamples\" {SPP}\n\
         Film \"image\" \"integer xresolution\" {SIZE} \"integer yresolution\" {SIZE} {film}\n{seen}"
    );
    let read = |name: &str| (name == "sky.pfm").then(map);
    compile_scene(text, &CompileOptions::default(), read).job
}

fn picture(job: &Job) -> Image {
    render(job, &Unwatched, &AtomicBool::new(false)).image
}

/// By paths that do not know of each other. The film's filter is a box.
fn alone(job: &Job) -> Vec<f64> {
    let pixels = (0..SIZE as i32).flat_map(|y| (0..SIZE as i32).map(move |x| [x, y]));
    let mean = |pixel: [i32; 2]| {
        let mut sum = [0.0; 3];
        for sample in 0..SPP {
            let taken = retake(job, pixel, sample, &mut Unobserved);
            for (sum, c) in sum.iter_mut().zip(taken.radiance.to_array()) {
                *sum += f64::from(c) * f64::from(taken.weight) / f64::from(SPP);
            }
        }
        sum
    };
    pixels.flat_map(mean).collect()
}

/// Mean over standard error, and variance.
fn standardised(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean / (variance / n).sqrt(), variance)
}

#[test]
fn sharing_changes_no_pixel_on_average_and_takes_noise_away() {
    let mut job = job("PixelFilter \"box\"");
    let pictures: Vec<[Vec<f64>; 2]> = (0..400)
        .map(|seed| {
            job.seed = seed;
            let shared = picture(&job).data().iter().map(|&c| f64::from(c)).collect();
            [shared, alone(&job)]
        })
        .collect();
    let of_pixel = |k: usize, by: fn(f64, f64) -> f64| {
        let values = pictures
            .iter()
            .map(move |[shared, alone]| by(shared[k], alone[k]));
        standardised(values)
    };
    let n = SIZE * SIZE * 3;
    let worst =
        |by: fn(f64, f64) -> f64| (0..n).map(|k| of_pixel(k, by).0.abs()).fold(0.0, f64::max);
    let whole = |by: fn(f64, f64) -> f64| {
        let sums = pictures.iter().map(move |[shared, alone]| {
            shared
                .iter()
                .zip(alone)
                .map(|(&a, &b)| by(a, b))
                .sum::<f64>()
        });
        standardised(sums).0.abs()
    };
    let variance = |by: fn(f64, f64) -> f64| (0..n).map(|k| of_pixel(k, by).1).sum::<f64>();
    let off = (worst(|a, b| a - b), whole(|a, b| a - b));
    assert!(off.0 < 5.0 && off.1 < 4.0, "standard errors off: {off:?}");
    // A hundredth would be seen.
    let planted = whole(|a, b| 1.01 * a - b);
    assert!(planted > 4.0, "a planted hundredth is {planted} off");
    let ratio = variance(|a, _| a) / variance(|_, b| b);
    assert!(ratio < 0.7, "{ratio} of the noise is left");
}

#[test]
fn who_shares_depends_on_neither_crop_window_nor_pixel_bounds_nor_threads() {
    let whole = job("PixelFilter \"gaussian\"");
    let picture_of_whole = picture(&whole);
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    assert_eq!(
        one.install(|| picture(&whole)).data(),
        picture_of_whole.data()
    );

    let cropped = job("\"float cropwindow\" [.25 .75 .5 1] PixelFilter \"gaussian\"");
    let crop = cropped.film.crop;
    let picture_of_crop = picture(&cropped);
    for y in 0..crop.height {
        let line = |image: &Image, x: usize, y: usize| {
            let first = (y * image.width() + x) * 3;
            image.data()[first..first + 3 * crop.width].to_vec()
        };
        let (x0, y0) = (crop.x0 as usize, crop.y0 as usize);
        assert_eq!(
            line(&picture_of_crop, 0, y),
            line(&picture_of_whole, x0, y0 + y),
            "line {y}"
        );
    }

    let mut bounded = job("PixelFilter \"box\"");
    let picture_of_all = picture(&bounded);
    let pixels = tyndall::image::PixelRect {
        x0: 3,
        y0: 5,
        width: 4,
        height: 6,
    };
    bounded.pixel_bounds = Some(pixels);
    let picture_within = picture(&bounded);
    for k in 0..SIZE * SIZE {
        let is_within = pixels.holds([(k % SIZE) as i32, (k / SIZE) as i32]);
        let [all, within] =
            [&picture_of_all, &picture_within].map(|image| &image.data()[3 * k..][..3]);
        assert_eq!(within, if is_within { all } else { &[0.0; 3] }, "pixel {k}");
    }
}
