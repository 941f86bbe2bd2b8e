//! Pixels that the silhouette of a lamp runs through: what the camera sees there directly comes by rays of its own.

use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::image::Image;
use tyndall::render::{Unwatched, render};
use tyndall_test_support::z_test::Mean;

use crate::common::scene::compile_scene;

const SIZE: usize = 48;
const RADIANCE: f64 = 1000.0;
const SEEDS: usize = 24;
/// A limit that no sample reaches: limited samples are taken as a whole.
const UNSPLIT: &str = "\"float maxsampleluminance\" 1e30";

/// A ball that glows, off the middle, before a grey wall that it lights.
fn lamp_before_a_wall(integrator: &str, camera: &str, filter: &str, film: &str) -> String {
    format!(
        "Integrator \"{integrator}\" Sampler \"halton\" \"integer pixelsamples\" 4 PixelFilter {filter}\n\
         Film \"image\" \"integer xresolution\" {SIZE} \"integer yresolution\" {SIZE} {film}\n\
         Camera {camera}\n\
         WorldBegin\n\
         Material \"matte\" \"rgb Kd\" [0.5 0.5 0.5]\n\
         AttributeBegin Translate 0 0 9 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 40 AttributeEnd\n\
         AttributeBegin Translate 0.3 0.2 5 Material \"matte\" \"rgb Kd\" [0 0 0]\n\
         AreaLightSource \"diffuse\" \"rgb L\" [{RADIANCE} {RADIANCE} {RADIANCE}]\n\
         Shape \"sphere\" \"float radius\" 0.4 AttributeEnd\n\
         WorldEnd\n"
    )
}

const PERSPECTIVE: &str = "\"perspective\" \"float fov\" 30";

fn pictures(scene: &str) -> Vec<Image> {
    let mut job = compile_scene(scene, &CompileOptions::default(), |_| None).job;
    let picture = |seed: usize| {
        job.seed = seed as u64;
        render(&job, &Unwatched, &AtomicBool::new(false)).image
    };
    (0..SEEDS).map(picture).collect()
}

/// The mean of a picture over seeds.
fn mean(pictures: &[Image]) -> Mean {
    let of = |image: &Image| {
        let sum: f64 = image.data().iter().map(|&c| f64::from(c)).sum();
        sum / image.data().len() as f64
    };
    let mut means = pictures.iter().map(of);
    Mean::of(SEEDS, || means.next().expect("a picture for each seed"))
}

/// Variance of a pixel between seeds, on average.
fn variance(pictures: &[Image]) -> f64 {
    let n = pictures.len() as f64;
    let n_values = pictures[0].data().len();
    let of = |i: usize| {
        let values = || pictures.iter().map(|p| f64::from(p.data()[i]));
        let mean = values().sum::<f64>() / n;
        values().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)
    };
    (0..n_values).map(of).sum::<f64>() / n_values as f64
}

#[test]
fn pictures_with_split_samples_converge_to_the_same_with_less_noise() {
    let lens =
        "\"perspective\" \"float fov\" 30 \"float lensradius\" 0.03 \"float focaldistance\" 6";
    let narrow = "\"box\" \"float xwidth\" 0.4 \"float ywidth\" 0.3";
    for (integrator, camera, filter) in [
        ("path", PERSPECTIVE, "\"box\""),
        ("volpath", PERSPECTIVE, narrow),
        ("directlighting", PERSPECTIVE, "\"box\""),
        ("path", lens, "\"box\""),
    ] {
        let scene = |film| pictures(&lamp_before_a_wall(integrator, camera, filter, film));
        let (split, whole) = (scene(""), scene(UNSPLIT));
        let what = format!("{integrator}, {camera}, {filter}");
        mean(&split)
            .agrees_with_mean(&mean(&whole))
            .assert_accepted(&what);
        // What is lit is the same: but for the lamp and its silhouette, to the last bit.
        let dark = |image: &Image| image.data().iter().filter(|&&c| c < 1.0).count();
        let alike = |(a, b): (&Image, &Image)| {
            let values = a.data().iter().zip(b.data());
            values.filter(|(a, b)| a == b && **a < 1.0).count()
        };
        let n_alike = split.iter().zip(&whole).map(alike).min().unwrap_or(0);
        assert!(n_alike + 3 * 300 > dark(&whole[0]), "{what}: {n_alike}");
        let (split, whole) = (variance(&split), variance(&whole));
        assert!(8.0 * split < whole, "{what}: variances {split} and {whole}");
    }
}

#[test]
fn what_filters_weigh_is_not_split() {
    for filter in [
        "\"gaussian\"",
        "\"mitchell\"",
        "\"box\" \"float xwidth\" 0.7",
    ] {
        let scene = |film| pictures(&lamp_before_a_wall("path", PERSPECTIVE, filter, film));
        assert!(scene("") == scene(UNSPLIT), "{filter}");
    }
}

#[test]
fn a_lamp_covers_as_much_of_the_picture_as_geometry_says() {
    // In the middle of the view a ball is a disk; the wall is black.
    let scene = lamp_before_a_wall("path", PERSPECTIVE, "\"box\"", "")
        .replace("Translate 0.3 0.2 5", "Translate 0 0 5")
        .replace("[0.5 0.5 0.5]", "[0 0 0]");
    let sine: f64 = 0.4 / 5.0;
    let radius = sine.asin().tan() / 15f64.to_radians().tan();
    let expected = RADIANCE * std::f64::consts::PI * radius * radius / 4.0;
    mean(&pictures(&scene))
        .agrees_with(expected)
        .assert_accepted("the disk");
}

#[test]
fn a_lamp_that_fills_pixels_is_exactly_as_bright_as_it_is() {
    let scene = lamp_before_a_wall("path", PERSPECTIVE, "\"box\"", "");
    let image = &pictures(&scene)[1];
    let full = image
        .data()
        .iter()
        .filter(|&&c| (f64::from(c) / RADIANCE - 1.0).abs() < 1e-6)
        .count();
    // The disk of the lamp without its silhouette, three channels.
    assert!(full > 3 * 40, "{full}");
    let brightest = image.data().iter().fold(0f32, |a, &b| a.max(b));
    assert!(
        f64::from(brightest) < RADIANCE * (1.0 + 1e-6),
        "{brightest}"
    );
}
