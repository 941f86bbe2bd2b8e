//! A speck far out of sight makes a scene wider, and nothing else.

use crate::setup::{CAMERA, ROOM, compare_pictures, job, picture};
use tyndall::image::Image;

const SEEDS: u64 = 20;
/// Scene sizes away.
const AWAY: [f64; 3] = [3.0, 1e3, 1e6];

/// A ball of glass, whose caustic only light tracing finds under a sun.
const BALL: &str = "AttributeBegin Material \"glass\" Translate 0 .5 -1 Shape \"sphere\" \"float radius\" .4 AttributeEnd\n";
const SUN: &str =
    "LightSource \"distant\" \"point from\" [1 3 -1] \"point to\" [0 0 0] \"rgb L\" [2 2 1]\n";
const SKY: &str = "LightSource \"infinite\" \"rgb L\" [.5 .6 .7]\n";

fn speck(away: f64) -> String {
    // Just large enough for single precision.
    let (x, side) = (6.0 * away, 0.1 + 12e-6 * away);
    format!(
        "AttributeBegin Material \"matte\" \"rgb Kd\" [0 0 0] Translate {x} {x} -9\n\
         Shape \"trianglemesh\" \"point P\" [0 0 0 {side} 0 0 0 {side} {side}] \"integer indices\" [0 1 2] AttributeEnd\n"
    )
}

fn pictures(integrator: &str, spp: u32, world: &str, first_seed: u64) -> Vec<Image> {
    let mut job = job(integrator, CAMERA, spp, world);
    let taken = |seed| {
        job.seed = seed;
        picture(&job)
    };
    (first_seed..first_seed + SEEDS).map(taken).collect()
}

/// Sum over pixels of the variance of their green.
fn variance(pictures: &[Image]) -> f64 {
    let n = pictures.len() as f64;
    let of_pixel = |i: usize| {
        let values = || pictures.iter().map(|image| f64::from(image.data()[i]));
        let mean = values().sum::<f64>() / n;
        values().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)
    };
    let n_values = pictures[0].data().len();
    (1..n_values).step_by(3).map(of_pixel).sum()
}

#[test]
fn a_speck_out_of_sight_starves_no_light_path() {
    for (integrator, spp, light) in [
        ("\"bdpt\" \"integer maxdepth\" 4", 16, SUN),
        ("\"bdpt\" \"integer maxdepth\" 4", 16, SKY),
        (
            "\"mlt\" \"integer maxdepth\" 4 \"integer bootstrapsamples\" 3000 \"integer chains\" 50 \
             \"integer mutationsperpixel\" 50",
            1,
            SUN,
        ),
        (
            "\"sppm\" \"integer maxdepth\" 4 \"integer iterations\" 4 \"integer photonsperiteration\" 4000 \
             \"float radius\" .3",
            1,
            SUN,
        ),
    ] {
        let world = format!("{ROOM}{BALL}{light}");
        let without = pictures(integrator, spp, &world, 0);
        for away in AWAY {
            let with = pictures(integrator, spp, &format!("{}{world}", speck(away)), SEEDS);
            let what = format!("{integrator}, {away}");
            compare_pictures(&with, &without).assert_accepted(&what);
            let ratio = variance(&with) / variance(&without);
            assert!(
                (0.7..1.4).contains(&ratio),
                "{what}: {ratio} times the variance"
            );
        }
    }
}
