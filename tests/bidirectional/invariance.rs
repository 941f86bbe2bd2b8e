//! Light may arrive in any pixel, but the same light whatever is rendered, by however many threads.

use tyndall::image::{Image, PixelRect};

use crate::setup::{CAMERA, LIGHTS, ROOM, job, picture};

const BDPT: &str = "\"bdpt\" \"integer maxdepth\" 4";

fn assert_identical(a: &Image, b: &Image, what: &str) {
    let same = a
        .data()
        .iter()
        .zip(b.data())
        .all(|(a, b)| a.to_bits() == b.to_bits());
    assert!(same && a.data().len() == b.data().len(), "{what}");
}

#[test]
fn n23_a_crop_window_shows_the_same_bits() {
    let world = format!("{ROOM}{}", LIGHTS[9].1);
    let whole = picture(&job(BDPT, CAMERA, 20, &world));
    let mut cropped = job(BDPT, CAMERA, 20, &world);
    let window = PixelRect {
        x0: 3,
        y0: 5,
        width: 6,
        height: 4,
    };
    cropped.film.crop = window;
    let part = whole.crop(window).expect("a window of the picture");
    assert_identical(&picture(&cropped), &part, "crop window");
    cropped.film.crop = PixelRect::from_size(12, 12);
    cropped.pixel_bounds = Some(window);
    let bounded = picture(&cropped);
    let inside = bounded.crop(window).expect("a window of the picture");
    assert_identical(&inside, &part, "pixel bounds");
    assert_eq!(bounded.pixel(0, 0), [0.0; 3], "outside the pixel bounds");
}

#[test]
fn n24_threads_change_no_bit() {
    let job = job(BDPT, CAMERA, 40, &format!("{ROOM}{}", LIGHTS[9].1));
    let with = |n_threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build();
        pool.expect("threads").install(|| picture(&job))
    };
    let one = with(1);
    for n_threads in [2, 5] {
        assert_identical(&with(n_threads), &one, "threads");
    }
}
