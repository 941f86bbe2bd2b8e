//! Family L: lights.

use std::sync::atomic::AtomicBool;

use tyndall::render::{Unwatched, render};

use crate::common::probe::Probe;
use crate::common::seen::seen_by;
use crate::hazards::loaded::load;

const FLOOR: &str = "AttributeBegin Material \"matte\" \"rgb Kd\" [1 1 1] Shape \"disk\" \"float radius\" 50 AttributeEnd\n";

#[test]
fn l05_lamps_in_instances_light_as_lamps_that_stand_by_themselves() {
    let lamp = "AreaLightSource \"diffuse\" \"rgb L\" [4 3 2] \"bool twosided\" \"true\"\n\
                Shape \"trianglemesh\" \"point P\" [-1 -1 0  1 -1 0  1 1 0] \"integer indices\" [0 1 2]\n\
                Shape \"sphere\" \"float radius\" .2\n";
    let places = [
        "Translate 0 0 3",
        "Translate 2 0 2 Rotate 40 1 2 3",
        "Translate -2 1 2",
    ];
    let copies: String = places
        .iter()
        .map(|place| format!("AttributeBegin {place} ObjectInstance \"lamp\" AttributeEnd\n"))
        .collect();
    let copied = format!("{FLOOR}ObjectBegin \"lamp\"\n{lamp}ObjectEnd\n{copies}");
    let lamps: String = places
        .iter()
        .map(|place| format!("AttributeBegin {place} {lamp} AttributeEnd\n"))
        .collect();
    let lit = |world: &str, integrator: &str| {
        let scene = seen_by(integrator, 1, [0.4, 0.3, 1.0], [-0.1, 0.05, -1.0], world);
        let film = "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\nPixelFilter \"box\"\n";
        // pbrt-v3 lights nothing with lamps in objects, which is told.
        let (compiled, found) = load(&(film.to_owned() + &scene), None);
        assert!(found.iter().all(|finding| !finding.is_error), "{found:?}");
        Probe::of(compiled.expect("a job").job).means(100_000)
    };
    let direct = format!("{FLOOR}{lamps}");
    for integrator in ["path", "volpath"] {
        let (a, b) = (lit(&copied, integrator), lit(&direct, integrator));
        for (a, b) in a.iter().zip(&b) {
            assert!(b.value > 0.1);
            a.agrees_with_mean(b).assert_accepted(integrator);
        }
    }
}

#[test]
fn n25_light_beyond_the_gamut_is_no_fault() {
    // A cyan lamp takes red away, and a red floor little else: its luminance is negative.
    let (scene, expected) = (
        "LightSource \"infinite\" \"xyz L\" [.2 .6 .2]\n\
         Material \"matte\" \"rgb Kd\" [1 .25 .5] Shape \"disk\" \"float radius\" 50\n",
        [0.0, 0.25 * 0.940_3, 0.5 * 0.100_1],
    );
    let film = "Film \"image\" \"integer xresolution\" 2 \"integer yresolution\" 2\n\
                Sampler \"halton\" \"integer pixelsamples\" 256\n";
    for integrator in ["path", "volpath", "bdpt", "directlighting", "sppm", "mlt"] {
        let seen = seen_by(integrator, 1, [0.4, 0.3, 1.0], [-0.1, 0.05, -1.0], scene);
        let (compiled, _) = load(&(film.to_owned() + &seen), None);
        let job = compiled.expect("a job").job;
        let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
        assert_eq!(rendered.report.bad_samples, 0, "{integrator}");
        let of = |channel: usize| rendered.image.data().iter().skip(channel).step_by(3);
        for (channel, expected) in expected.into_iter().enumerate() {
            let mean = of(channel).map(|&c| f64::from(c)).sum::<f64>() / 4.0;
            assert!(
                (mean - expected).abs() <= 0.05 * expected,
                "{integrator}, channel {channel}: {mean} {expected}"
            );
        }
    }
}
