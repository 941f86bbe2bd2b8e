//! What must not change a picture: its unit of length, its place, its crop window, its threads.

use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::image::{Image, PixelRect};
use tyndall::render::{Unwatched, render};

use crate::common::scene::compile_scene;
use crate::common::solids::{
    V, environment, homogeneous, null_box, null_sphere, seen_by, translate, volpath,
};

fn picture(scene: &str, film: &str, options: &CompileOptions) -> Image {
    let text = format!(
        "Film \"image\" \"integer xresolution\" 48 \"integer yresolution\" 40 {film}\n\
         Sampler \"halton\" \"integer pixelsamples\" 20\n{scene}"
    );
    let job = compile_scene(text, options, |_| None).job;
    let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(rendered.report.bad_samples, 0);
    assert_eq!(rendered.report.counters.stuck_paths, 0);
    assert_eq!(rendered.report.counters.leaked_paths, 0);
    assert_eq!(rendered.report.counters.mismatched(), 0);
    rendered.image
}

fn plain(scene: &str) -> Image {
    picture(
        scene,
        "PixelFilter \"gaussian\"",
        &CompileOptions::default(),
    )
}

/// Numbers of the format times a factor; with a point or an exponent, since the format's integers end at 2⁶³.
fn scaled(numbers: &[f64], factor: f64) -> String {
    let words: Vec<String> = numbers
        .iter()
        .map(|x| format!("{:?}", x * factor))
        .collect();
    words.join(" ")
}

/// Balls, a mesh, a mirror, glass and lights of all kinds on a floor, in units of `s`.
fn still_life(s: f64) -> String {
    let n = |numbers: &[f64]| scaled(numbers, s);
    let intensity = scaled(&[8.0, 4.0, 2.0], s * s);
    format!(
        "AttributeBegin Material \"matte\" \"rgb Kd\" [.5 .25 .75]\n\
         Shape \"trianglemesh\" \"point P\" [{floor}] \"integer indices\" [0 1 2 0 2 3] AttributeEnd\n\
         AttributeBegin Material \"matte\" \"rgb Kd\" [.75 .75 .75] \"float sigma\" 30\n\
         Translate {ball} Shape \"sphere\" \"float radius\" {r} AttributeEnd\n\
         AttributeBegin Material \"glass\" Translate {glass} Shape \"sphere\" \"float radius\" {r} AttributeEnd\n\
         AttributeBegin Material \"mirror\" Translate {mirror} Rotate 90 0 1 0\n\
         Shape \"disk\" \"float radius\" {r} AttributeEnd\n\
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 4 2] Translate {lamp}\n\
         Shape \"sphere\" \"float radius\" {quarter} AttributeEnd\n\
         AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [2 4 4]\n\
         Shape \"trianglemesh\" \"point P\" [{panel}] \"integer indices\" [0 1 2] AttributeEnd\n\
         LightSource \"point\" \"point from\" [{point}] \"rgb I\" [{intensity}]\n\
         LightSource \"distant\" \"point from\" [1 2 -1] \"rgb L\" [.5 .5 .5]\n\
         {sky}",
        floor = n(&[
            -8.0, -1.0, -8.0, -8.0, -1.0, 8.0, 8.0, -1.0, 8.0, 8.0, -1.0, -8.0
        ]),
        ball = n(&[-1.0, 0.0, 0.5]),
        glass = n(&[1.0, -0.25, -0.75]),
        mirror = n(&[-2.5, 0.5, 0.25]),
        r = 0.75 * s,
        lamp = n(&[0.5, 2.5, 0.5]),
        quarter = 0.25 * s,
        panel = n(&[2.0, 1.0, 2.0, 3.0, 1.0, 1.0, 2.5, 2.0, 1.5]),
        point = n(&[-2.0, 3.0, -2.0]),
        sky = environment([0.125, 0.25, 0.5]),
    )
}

/// A coloured fog with a grid cloud and a ball in it, in units of `s`.
fn mist(s: f64) -> String {
    let per = |sigma: V| sigma.map(|x| x / s);
    let at = |p: V| p.map(|x| x * s);
    homogeneous("fog", per([0.125, 0.25, 0.5]), per([1.0, 0.5, 0.25]), 0.5)
        + &format!(
            "MakeNamedMedium \"cloud\" \"string type\" \"heterogeneous\" \"rgb sigma_a\" [{a}] \
             \"rgb sigma_s\" [{b}] \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \
             \"point p0\" [{p0}] \"point p1\" [{p1}] \"float density\" [0 1 .5 2 .25 4 1 1]\n",
            a = scaled(&[0.5; 3], 1.0 / s),
            b = scaled(&[4.0, 2.0, 1.0], 1.0 / s),
            p0 = scaled(&[-0.5; 3], s),
            p1 = scaled(&[0.5; 3], s),
        )
        + &null_box(at([-2.0, -1.0, -2.0]), at([2.0, 1.5, 2.0]), "fog", "")
        + &null_box(at([-0.5; 3]), at([0.5; 3]), "cloud", "fog")
        + &null_sphere(at([1.0, 0.25, 0.5]), 0.5 * s, "", "fog")
        + &format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 9 9]\n{}\
             Shape \"sphere\" \"float radius\" {} AttributeEnd\n",
            translate(at([0.5, 3.0, -0.5])),
            0.5 * s
        )
        + &environment([0.25, 0.5, 0.75])
}

fn assert_identical(a: &Image, b: &Image, what: &str) {
    let differing = a
        .data()
        .iter()
        .zip(b.data())
        .filter(|(a, b)| a.to_bits() != b.to_bits());
    assert_eq!(
        differing.count(),
        0,
        "{what}: of {} samples",
        a.data().len()
    );
}

#[test]
fn g01_g02_the_unit_of_length_changes_no_bit() {
    let life = |k: i32| {
        let s = 2f64.powi(k);
        let [eye, toward] = [[0.5, 1.0, -6.0], [0.0, -0.25, 1.5]].map(|v| v.map(|x| x * s));
        plain(&seen_by("path", 6, eye, toward, &still_life(s)))
    };
    let mist = |k: i32| {
        let s = 2f64.powi(k);
        let [eye, toward] = [[0.5, 1.0, -6.0], [0.0, -0.125, 1.5]].map(|v| v.map(|x| x * s));
        plain(&volpath(20, eye, toward, &mist(s)))
    };
    for (scene, what) in [
        (&life as &dyn Fn(i32) -> Image, "surfaces"),
        (&mist, "media"),
    ] {
        let one = scene(0);
        assert!(one.data().iter().any(|&c| c > 0.1), "{what}: a picture");
        for k in [-40, -13, 13, 40] {
            assert_identical(&scene(k), &one, &format!("{what}, 2^{k}"));
        }
    }
}

#[test]
fn g03_the_place_in_the_world_changes_next_to_nothing() {
    let at = |far: f64, volumetric: bool| {
        let world = if volumetric {
            mist(1.0)
        } else {
            still_life(1.0)
        };
        // A point light's position is added behind the transform: it moves along with it.
        let world = translate([far; 3]) + "\n" + &world;
        let eye = [0.5, 1.0, -6.0].map(|x| x + far);
        let integrator = if volumetric { "volpath" } else { "path" };
        plain(&seen_by(integrator, 8, eye, [0.0, -0.125, 1.5], &world))
    };
    for volumetric in [false, true] {
        let home = at(0.0, volumetric);
        for far in [1e4, 1e6] {
            let away = at(far, volumetric);
            let squares = home.data().iter().zip(away.data());
            let sum: f64 = squares.map(|(a, b)| f64::from(a - b).powi(2)).sum();
            let rmse = (sum / home.data().len() as f64).sqrt();
            assert!(rmse < 1e-3, "at {far}: {rmse}");
        }
    }
}

#[test]
fn n23_a_crop_window_shows_the_same_bits() {
    for filter in ["box", "gaussian", "mitchell"] {
        let scene = seen_by(
            "path",
            4,
            [0.5, 1.0, -6.0],
            [0.0, -0.25, 1.5],
            &still_life(1.0),
        );
        let film = |window: &str| format!("{window} PixelFilter \"{filter}\"");
        let whole = picture(&scene, &film(""), &CompileOptions::default());
        let window = "\"float cropwindow\" [.25 .75 .3 .85]";
        let part = picture(&scene, &film(window), &CompileOptions::default());
        let rect = PixelRect {
            x0: 12,
            y0: 12,
            width: 24,
            height: 22,
        };
        let expected = whole.crop(rect).expect("a part of the picture");
        assert_eq!((part.width(), part.height()), (24, 22));
        assert_identical(&part, &expected, filter);
    }
}

#[test]
fn n24_threads_change_no_bit() {
    let scene = volpath(20, [0.5, 1.0, -6.0], [0.0, -0.125, 1.5], &mist(1.0));
    let on = |n: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
        pool.expect("threads").install(|| plain(&scene))
    };
    let one = on(1);
    for n in [2, 3, 7] {
        assert_identical(&on(n), &one, &format!("{n} threads"));
    }
}

#[test]
fn seeds_change_the_noise_and_not_the_mean() {
    let scene = volpath(20, [0.5, 1.0, -6.0], [0.0, -0.125, 1.5], &mist(1.0));
    let with = |seed: u64| {
        let options = CompileOptions {
            seed,
            ..CompileOptions::default()
        };
        picture(&scene, "PixelFilter \"box\"", &options)
    };
    let (a, b) = (with(1), with(2));
    let differing = a
        .data()
        .iter()
        .zip(b.data())
        .filter(|(a, b)| a != b)
        .count();
    assert!(differing > 500, "{differing} samples differ");
    let mean = |image: &Image| image.data().iter().map(|&c| f64::from(c)).sum::<f64>();
    assert!((mean(&a) / mean(&b) - 1.0).abs() < 0.02);
}
