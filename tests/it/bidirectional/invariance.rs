//! Light may arrive in any pixel, but the same light whatever is rendered, by however many threads.

use std::sync::atomic::AtomicBool;

use tyndall::image::{Image, PixelRect};
use tyndall::render::{Unwatched, render};

use crate::bidirectional::setup::{CAMERA, LIGHTS, ROOM, job, picture};

const BDPT: &str = "\"bdpt\" \"integer maxdepth\" 4";
const MLT: &str = "\"mlt\" \"integer bootstrapsamples\" 500 \"integer chains\" 13";

pub(crate) fn assert_identical(a: &Image, b: &Image, what: &str) {
    let same = a
        .data()
        .iter()
        .zip(b.data())
        .all(|(a, b)| a.to_bits() == b.to_bits());
    assert!(same && a.data().len() == b.data().len(), "{what}");
}

pub(crate) const WINDOW: PixelRect = PixelRect {
    x0: 3,
    y0: 5,
    width: 6,
    height: 4,
};

pub(crate) fn in_window(image: &Image) -> Image {
    image.crop(WINDOW).expect("a window of the picture")
}

#[test]
fn n23_a_crop_window_shows_the_same_bits() {
    let world = format!("{ROOM}{}", LIGHTS[9].1);
    for integrator in [BDPT, MLT] {
        let mut job = job(integrator, CAMERA, 20, &world);
        let whole = picture(&job);
        job.film.crop = WINDOW;
        assert_identical(&picture(&job), &in_window(&whole), integrator);
    }
}

#[test]
fn pixel_bounds_show_the_same_bits_inside_and_nothing_outside() {
    let world = format!("{ROOM}{}", LIGHTS[9].1);
    let mut job = job(BDPT, CAMERA, 20, &world);
    let whole = picture(&job);
    job.pixel_bounds = Some(WINDOW);
    let bounded = picture(&job);
    assert_identical(&in_window(&bounded), &in_window(&whole), "pixel bounds");
    assert_eq!(bounded.pixel(0, 0), [0.0; 3], "outside the pixel bounds");
}

#[test]
fn n24_threads_change_no_bit() {
    let world = format!("{ROOM}{}", LIGHTS[9].1);
    for integrator in [BDPT, MLT] {
        let job = job(integrator, CAMERA, 40, &world);
        let with = |n_threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(n_threads)
                .build();
            pool.expect("threads").install(|| picture(&job))
        };
        let one = with(1);
        for n_threads in [2, 5] {
            assert_identical(&with(n_threads), &one, integrator);
        }
    }
}

#[test]
fn l06_a_scene_without_light_is_black_and_says_so() {
    let sealed = "AttributeBegin Translate 0 2 0 Material \"matte\" \"rgb Kd\" [0 0 0]\n\
                  Shape \"sphere\" \"float radius\" .5 AttributeEnd\n\
                  AttributeBegin Translate 0 2 0 AreaLightSource \"diffuse\" \"rgb L\" [9 9 9]\n\
                  Shape \"sphere\" \"float radius\" .1 AttributeEnd\n";
    let job = job(MLT, CAMERA, 1, &format!("{ROOM}{sealed}"));
    let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
    assert!(rendered.report.found_no_light);
    assert!(rendered.image.data().iter().all(|&x| x == 0.0));
}
