//! Pixel filters: as tabulated, without bias.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::film::Film;
use tyndall::image::{Image, PixelRect};
use tyndall::render::{Job, Unwatched, render};
use tyndall::spectrum::Rgb;

use crate::common::scene::compile_scene;
use crate::common::solids::{environment, seen_by};

const FILTERS: [&str; 8] = [
    "\"box\"",
    "\"box\" \"float xwidth\" 0.1 \"float ywidth\" 0.1",
    "\"box\" \"float xwidth\" 1.5 \"float ywidth\" 0.75",
    "\"triangle\"",
    "\"gaussian\"",
    "\"gaussian\" \"float alpha\" 0.5 \"float xwidth\" 1.25",
    "\"mitchell\"",
    "\"sinc\"",
];

fn job(filter: &str, world: &str) -> Job {
    let text = format!(
        "Film \"image\" \"integer xresolution\" 9 \"integer yresolution\" 7\nPixelFilter {filter}\n\
         Sampler \"lowdiscrepancy\" \"integer pixelsamples\" 64\n"
    ) + &seen_by("path", 2, [0.0, 0.0, -5.0], [0.0, 0.0, 1.0], world);
    compile_scene(text, &CompileOptions::default(), |_| None).job
}

fn picture(job: &Job) -> Image {
    let rendered = render(job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(rendered.report.bad_samples, 0);
    rendered.image
}

#[test]
fn n18_a_constant_scene_is_constant_through_every_filter() {
    for filter in FILTERS {
        let image = picture(&job(filter, &environment([0.25, 0.5, 3.0])));
        for pixel in image.data().chunks(3) {
            for (actual, expected) in pixel.iter().zip([0.25, 0.5, 3.0f32]) {
                assert!(
                    (actual - expected).abs() < 1e-6 * expected,
                    "{filter}: {pixel:?}"
                );
            }
        }
    }
}

#[test]
fn n18_filters_keep_the_mean_of_a_picture() {
    // A bright ball well within the frame: its whole light reaches the film through every filter.
    let ball =
        "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] Shape \"sphere\" \"float radius\" 1.5\n";
    let mean = |filter: &str| {
        let mut total = 0.0;
        let mut job = job(filter, ball);
        for seed in 0..16 {
            job.seed = seed;
            let image = picture(&job);
            total += image.data().iter().map(|&c| f64::from(c)).sum::<f64>();
        }
        total
    };
    let expected = mean(FILTERS[0]);
    for filter in &FILTERS[2..6] {
        let ratio = mean(filter) / expected;
        assert!((ratio - 1.0).abs() < 0.01, "{filter}: {ratio}");
    }
}

/// The block that holds the middle of the picture.
fn middle_block(film: &Film) -> PixelRect {
    let holds_middle = |block: &PixelRect| {
        let inside = |start: i32, length: usize| (start..start + length as i32).contains(&4);
        inside(block.x0, block.width) && inside(block.y0, block.height)
    };
    Film::blocks_of(film.sample_bounds())
        .into_iter()
        .find(holds_middle)
        .expect("blocks cover the picture")
}

/// Weight of a sample at an offset from a pixel's centre: 16 steps over each radius, as the format says.
fn weight(filter: fn(f64, f64) -> f64, radius: [f64; 2], offset: [f64; 2]) -> f64 {
    let mut weight = 1.0;
    for axis in 0..2 {
        let r = radius[axis];
        if offset[axis].abs() > r {
            return 0.0;
        }
        let step = (offset[axis].abs() * 16.0 / r).floor().min(15.0);
        weight *= filter((step + 0.5) * r / 16.0, r);
    }
    weight
}

fn mitchell(x: f64, r: f64) -> f64 {
    // Mitchell and Netravali 1988 with B = C = 1/3, over [-2, 2].
    let x = 2.0 * x / r;
    if x < 1.0 {
        (7.0 * x.powi(3) - 12.0 * x.powi(2) + 16.0 / 3.0) / 6.0
    } else {
        (-7.0 / 3.0 * x.powi(3) + 12.0 * x.powi(2) - 20.0 * x + 32.0 / 3.0) / 6.0
    }
}

fn sinc(x: f64) -> f64 {
    (PI * x).sin() / (PI * x)
}

#[test]
fn filter_weights_are_the_tabulated_functions() {
    type Function = fn(f64, f64) -> f64;
    let cases: [(&str, Function, [f64; 2]); 5] = [
        (FILTERS[2], |_, _| 1.0, [1.5, 0.75]),
        (FILTERS[3], |x, r| r - x, [2.0, 2.0]),
        (
            FILTERS[4],
            |x, r| (-2.0 * x * x).exp() - (-2.0 * r * r).exp(),
            [2.0, 2.0],
        ),
        (FILTERS[6], mitchell, [2.0, 2.0]),
        (FILTERS[7], |x, _| sinc(x) * sinc(x / 3.0), [4.0, 4.0]),
    ];
    for (name, filter, radius) in cases {
        let desc = job(name, &environment([1.0; 3])).film;
        let mut random = tyndall_test_support::Uniform::new(2);
        for _ in 0..300 {
            // A white and a black sample: a pixel shows the white one's share of the weight.
            let [a, b] = [0, 1].map(|_| [0, 1].map(|_| 3.0 + 2.0 * f64::from(random.unit())));
            let mut film = Film::new(desc.clone());
            let mut part = desc.start_block(middle_block(&film));
            part.add_sample(&desc, a, Rgb::ONE, 1.0);
            part.add_sample(&desc, b, Rgb::BLACK, 1.0);
            film.merge(&part);
            let image = film.develop();
            for y in 0..7 {
                for x in 0..9 {
                    let center = [x as f64 + 0.5, y as f64 + 0.5];
                    let of =
                        |p: [f64; 2]| weight(filter, radius, [p[0] - center[0], p[1] - center[1]]);
                    let (white, black) = (of(a), of(b));
                    // Weights that nearly cancel are not divided by.
                    let least = 1e-3 * (white.abs() + black.abs());
                    let sum = (white + black).abs().max(least).copysign(white + black);
                    let expected = if sum == 0.0 {
                        0.0
                    } else {
                        (white / sum).max(0.0)
                    };
                    let actual = f64::from(image.pixel(x, y)[0]);
                    let allowed = 1e-6 * (1.0 + white.abs() / sum.abs().max(1e-9));
                    assert!(
                        (actual - expected).abs() <= allowed * (1.0 + expected),
                        "{name}, {a:?} {b:?}, pixel {x} {y}: {actual} is not {expected}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_sample_on_the_border_of_two_pixels_counts_for_both() {
    let desc = job("\"box\"", &environment([1.0; 3])).film;
    let mut film = Film::new(desc.clone());
    let mut part = desc.start_block(middle_block(&film));
    part.add_sample(&desc, [4.0, 2.5], Rgb::ONE, 1.0);
    film.merge(&part);
    let image = film.develop();
    let lit: Vec<usize> = (0..9).filter(|&x| image.pixel(x, 2)[0] > 0.0).collect();
    assert_eq!(lit, [3, 4]);
}

#[test]
fn n07_a_million_samples_lose_nothing() {
    let desc = job("\"box\"", &environment([1.0; 3])).film;
    let mut film = Film::new(desc.clone());
    let block = middle_block(&film);
    for _ in 0..1024 {
        let mut part = desc.start_block(block);
        for _ in 0..1024 {
            part.add_sample(&desc, [4.5, 2.5], Rgb::from_array([0.1, 1e6, 1e-9]), 1.0);
        }
        film.merge(&part);
    }
    let image = film.develop();
    for (actual, expected) in image.pixel(4, 2).iter().zip([0.1, 1e6, 1e-9f32]) {
        assert!(
            (actual / expected - 1.0).abs() < 1e-6,
            "{actual} is not {expected}"
        );
    }
}
