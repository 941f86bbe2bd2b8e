//! Family N: sampling, accumulation, output.

use std::sync::atomic::AtomicBool;

use glam::DMat3;
use tyndall::compile::CompileOptions;
use tyndall::film::Film;
use tyndall::image::Image;
use tyndall::light::{InfiniteLight, Wanted};
use tyndall::math::Vec3;
use tyndall::render::{Rendered, Unwatched, render};
use tyndall::sampling::warp::uniform_sphere;
use tyndall::spectrum::Rgb;
use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use crate::common::scene::compile_scene;
use crate::common::seen::{environment, seen_by};

fn rendered(film: &str, scene: &str, seed: u64) -> Rendered {
    let options = CompileOptions {
        seed,
        ..CompileOptions::default()
    };
    let job = compile_scene(format!("{film}\n{scene}"), &options, |_| None).job;
    let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(rendered.report.bad_samples, 0);
    rendered
}

/// A film of a few pixels, a filter, and a sample count.
fn film(side: usize, filter: &str, spp: u32) -> String {
    format!(
        "Film \"image\" \"integer xresolution\" {side} \"integer yresolution\" {side}\n\
         PixelFilter {filter}\nSampler \"random\" \"integer pixelsamples\" {spp}"
    )
}

#[test]
fn n05_a_large_even_map_is_drawn_evenly() {
    // 2²⁵ texels: in single precision a running sum of them would stand still after 2²⁴.
    let (width, height) = (8192, 4096);
    let map = Image::new(width, height, 1, vec![1.0; width * height]).expect("a picture");
    let light =
        InfiniteLight::with_map(Rgb::ONE, map, DMat3::IDENTITY, true).expect("it is not black");
    let even = 1.0 / (4.0 * std::f32::consts::PI);
    let mut random = Uniform::new(2);
    // The density is even: its integral over the sphere is 1.
    let mass = Mean::of(200_000, || {
        f64::from(light.pdf_w(uniform_sphere(random.unit2()), Wanted::All) / even)
    });
    assert!((mass.value - 1.0).abs() < 1e-4, "{mass:?}");
    // And what is drawn follows it, by blocks of equal solid angle.
    const BLOCKS: [usize; 2] = [64, 32];
    let mut counts = vec![0u32; BLOCKS[0] * BLOCKS[1]];
    let n = 1 << 20;
    for _ in 0..n {
        let sample = light
            .sample(random.unit2(), Wanted::All)
            .expect("a direction");
        let w = sample.wi;
        let phi = w.y().atan2(w.x()) / std::f32::consts::TAU;
        let place = |x: f32, n: usize| ((x.rem_euclid(1.0) * n as f32) as usize).min(n - 1);
        let (column, row) = (
            place(phi, BLOCKS[0]),
            place((0.5 * (w.z() + 1.0)).min(0.999_999_9), BLOCKS[1]),
        );
        counts[row * BLOCKS[0] + column] += 1;
    }
    let expected = f64::from(n) / counts.len() as f64;
    let chi2: f64 = counts
        .iter()
        .map(|&c| (f64::from(c) - expected).powi(2) / expected)
        .sum();
    let freedom = counts.len() as f64 - 1.0;
    assert!(
        (chi2 - freedom).abs() < 5.0 * (2.0 * freedom).sqrt(),
        "{chi2} of {freedom}"
    );
}

#[test]
fn n08_every_channel_keeps_its_own_precision() {
    for scale in [1e6, 1.0] {
        let sky = [scale, 1.0, 1e-9];
        let scene = seen_by("path", 1, [0.0; 3], [0.0, 0.0, 1.0], &environment(sky));
        let Rendered { image, .. } = rendered(&film(2, "\"gaussian\"", 64), &scene, 0);
        for pixel in image.data().chunks(3) {
            for (actual, expected) in pixel.iter().zip(sky) {
                let error = (f64::from(*actual) / expected - 1.0).abs();
                assert!(error < 1e-6, "{pixel:?} for {sky:?}");
            }
        }
    }
}

#[test]
fn n14_a_single_bright_texel_is_drawn_without_noise() {
    // Radiance over density varies by the sine of the polar angle in a row of texels only.
    for row in [2, 4, 6] {
        let mut data = vec![0.0; 8 * 16];
        data[row * 16 + 5] = 1000.0;
        let map = Image::new(16, 8, 1, data).expect("a picture");
        let light =
            InfiniteLight::with_map(Rgb::ONE, map, DMat3::IDENTITY, true).expect("not black");
        let mut random = Uniform::new(7);
        let n = 100_000;
        let mean = Mean::of(n, || {
            let sample = light
                .sample(random.unit2(), Wanted::All)
                .expect("a direction");
            f64::from(sample.radiance.g() / sample.pdf_w)
        });
        let deviation = mean.standard_error * f64::from(n as u32).sqrt() / mean.value;
        // Two rows of patches hold the texel, each of them with the mean of its sines: the sine itself goes from its
        // value at one border to that at the other.
        let step = std::f64::consts::PI / 8.0;
        let sine = |r: f64| (step * r).sin();
        let spread = (-1..=1)
            .map(|k| {
                (sine(row as f64 + 0.5 + f64::from(k)) / sine(row as f64 + 0.5))
                    .ln()
                    .abs()
            })
            .fold(0.0, f64::max);
        assert!(
            deviation < spread.max(0.02),
            "row {row}: {deviation} of {spread}"
        );
    }
}

#[test]
fn n19_filters_with_negative_lobes_neither_explode_nor_shift_the_mean() {
    // A bright half plane: an edge through the picture.
    let world = "AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] Shape \"trianglemesh\" \
                 \"point P\" [0 -9 0  0 9 0  9 9 0  9 -9 0] \"integer indices\" [0 2 1 0 3 2]\n\
                 AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] Shape \"trianglemesh\" \
                 \"point P\" [0 -9 0  0 9 0  9 9 0  9 -9 0] \"integer indices\" [0 1 2 0 2 3]\n";
    let scene = seen_by("path", 1, [0.013, 0.0, -3.0], [0.0, 0.0, 1.0], world);
    let mean = |filter: &str, spp: u32, seed: u64| {
        let Rendered { image, .. } = rendered(&film(32, filter, spp), &scene, seed);
        let brightest = image.data().iter().copied().fold(0.0, f32::max);
        let sum: f64 = image.data().iter().map(|c| f64::from(*c)).sum();
        (sum / image.data().len() as f64, brightest)
    };
    let (reference, _) = mean("\"box\"", 4096, 0);
    for filter in ["\"mitchell\"", "\"sinc\""] {
        for spp in [1, 4] {
            for seed in 0..8 {
                let (_, brightest) = mean(filter, spp, seed);
                // A weight sum of nearly 0 would show as a pixel of any brightness.
                assert!(brightest <= 1000.0, "{filter}, {spp}: {brightest}");
            }
        }
        let (value, brightest) = mean(filter, 1024, 3);
        assert!(
            (value - reference).abs() < 0.01,
            "{filter}: {value} for {reference}"
        );
        assert!(brightest < 1.3, "{filter}: {brightest}");
    }
}

#[test]
fn n26_a_small_bright_lamp_through_glass_is_as_bright_as_with_many_samples() {
    // Fireflies are left alone: means of few samples scatter around the mean of many.
    let world = "LightSource \"infinite\" \"rgb L\" [.1 .1 .1]\n\
        AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [500 500 500]\n\
        Translate 1 2 0 Shape \"sphere\" \"float radius\" .1 AttributeEnd\n\
        AttributeBegin Material \"glass\" Shape \"sphere\" \"float radius\" .5 AttributeEnd\n\
        Material \"matte\" \"rgb Kd\" [.8 .8 .8] Translate 0 -1 0 Rotate -90 1 0 0 Shape \"disk\" \"float radius\" 9\n";
    let scene = seen_by("path", 8, [0.0, 1.0, -4.0], [0.0, -0.4, 1.0], world);
    let mean_of = |spp: u32, seed: u64| {
        let image = rendered(&film(8, "\"box\"", spp), &scene, seed).image;
        image.data().iter().map(|c| f64::from(*c)).sum::<f64>() / image.data().len() as f64
    };
    let mut seed = 0;
    let few = Mean::of(256, || {
        seed += 1;
        mean_of(16, seed)
    });
    let mut seed = 1000;
    let many = Mean::of(64, || {
        seed += 1;
        mean_of(256, seed)
    });
    few.agrees_with_mean(&many)
        .assert_accepted("16 samples, and 256");
}

#[test]
fn n30_subnormal_light_is_as_bright_as_it_is() {
    let light = 1e-40;
    let world =
        environment([light; 3]) + "Material \"matte\" \"rgb Kd\" [1 1 1] Shape \"sphere\"\n";
    let scene = seen_by("path", 20, [0.0, 0.1, -3.0], [0.0, 0.0, 1.0], &world);
    let Rendered { image, .. } = rendered(&film(4, "\"box\"", 1024), &scene, 0);
    for c in image.data() {
        assert!((f64::from(*c) / light - 1.0).abs() < 0.1, "{c:e}");
    }
}

#[test]
fn n03_environments_answer_to_random_numbers_at_both_ends() {
    let mut data = vec![0.0; 8 * 4];
    data[3] = 1.0;
    let map = Image::new(8, 4, 1, data).expect("a picture");
    let light = InfiniteLight::with_map(Rgb::ONE, map, DMat3::IDENTITY, true).expect("not black");
    for u in [0.0, f32::EPSILON, 0.5, 1.0 - f32::EPSILON / 2.0] {
        for v in [0.0, f32::EPSILON, 0.5, 1.0 - f32::EPSILON / 2.0] {
            let Some(sample) = light.sample([u, v], Wanted::All) else {
                continue;
            };
            let w: Vec3 = sample.wi;
            assert!((w.length() - 1.0).abs() < 1e-5);
            assert!(sample.pdf_w > 0.0 && sample.pdf_w.is_finite());
            assert!(sample.radiance.is_finite());
        }
    }
}

#[test]
fn n19_weights_that_cancel_are_not_divided_by() {
    let scene = seen_by("path", 1, [0.0; 3], [0.0, 0.0, 1.0], &environment([1.0; 3]));
    let scene = film(9, "\"mitchell\"", 1) + "\n" + &scene;
    let desc = compile_scene(scene, &CompileOptions::default(), |_| None)
        .job
        .film;
    // White samples in the middle of a pixel, black ones in the negative lobe: for some counts the weights nearly
    // cancel, and the white ones alone do not.
    let mut brightest = 0f32;
    for n_white in 1..40 {
        for n_black in 1..400 {
            let mut film = Film::new(desc.clone());
            let mut part = desc.start_block(film.sample_bounds());
            for _ in 0..n_white {
                part.add_sample(&desc, [4.5, 4.5], Rgb::ONE, 1.0);
            }
            for _ in 0..n_black {
                part.add_sample(&desc, [6.0, 4.5], Rgb::BLACK, 1.0);
            }
            film.merge(&part);
            brightest = brightest.max(film.develop().pixel(4, 4)[0]);
        }
    }
    assert!((50.0..=501.0).contains(&brightest), "{brightest}");
}

#[test]
fn n13_the_poles_of_a_map_blend_its_top_and_bottom_rows() {
    // Within half a texel of a pole, as in pbrt-v3, whose maps repeat in both directions; nowhere else.
    let (width, height) = (16, 8);
    let mut data = vec![0.0; width * height];
    data[..width].fill(1000.0);
    let map = Image::new(width, height, 1, data).expect("a picture");
    let light = InfiniteLight::with_map(Rgb::ONE, map, DMat3::IDENTITY, true).expect("not black");
    let at = |row: f32| {
        let (sin, cos) = (row * std::f32::consts::PI / height as f32).sin_cos();
        light.le(Vec3::new(sin, 0.0, cos)).g()
    };
    assert!((at(8.0) - 500.0).abs() < 1.0, "the south pole: {}", at(8.0));
    assert!((at(0.0) - 500.0).abs() < 1.0, "the north pole: {}", at(0.0));
    for row in [1.5, 2.0, 4.0, 7.0, 7.5] {
        assert!(at(row).abs() < 1e-2, "row {row}: {}", at(row));
    }
}
