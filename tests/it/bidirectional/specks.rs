//! A speck far out of sight makes a scene wider, and nothing else.

use crate::bidirectional::setup::{CAMERA, ROOM, compare_pictures, job, picture};
use tyndall::image::Image;

/// Scene sizes away.
const AWAY: [f64; 3] = [3.0, 1e3, 1e6];
/// Part by which a speck may change variances, or so many standard errors where these are more: those of chains of 20
/// seeds are 0.05, others are below 0.01.
const PART: f64 = 0.1;
const SIGMAS: f64 = 4.0;

const BDPT: (&str, u32) = ("\"bdpt\" \"integer maxdepth\" 4", 16);
const MLT: (&str, u32) = (
    "\"mlt\" \"integer maxdepth\" 4 \"integer bootstrapsamples\" 3000 \"integer chains\" 50 \
     \"integer mutationsperpixel\" 50",
    1,
);
const SPPM: (&str, u32) = (
    "\"sppm\" \"integer maxdepth\" 4 \"integer iterations\" 4 \"integer photonsperiteration\" 4000 \
     \"float radius\" .3",
    1,
);

/// A ball of glass, whose caustic only light tracing finds under a sun.
const BALL: &str = "AttributeBegin Material \"glass\" Translate 0 .5 -1 Shape \"sphere\" \"float radius\" .4 AttributeEnd\n";
const SUN: &str =
    "LightSource \"distant\" \"point from\" [1 3 -1] \"point to\" [0 0 0] \"rgb L\" [2 2 1]\n";
const SKY: &str = "LightSource \"infinite\" \"rgb L\" [.5 .6 .7]\n";
/// High above the room.
const STAR: &str = "LightSource \"point\" \"point from\" [5 30 -10] \"rgb I\" [2000 2000 2500]\n";
const SUN_AND_LAMP: &str = "LightSource \"distant\" \"point from\" [1 3 -1] \"point to\" [0 0 0] \"rgb L\" [2 2 1]\n\
     AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4] Translate .3 1.8 -.3\n\
     Shape \"sphere\" \"float radius\" .3 AttributeEnd\n";
/// Fog in a ball above the others.
const SUN_ON_FOG: &str = "LightSource \"distant\" \"point from\" [1 3 -1] \"point to\" [0 0 0] \"rgb L\" [2 2 1]\n\
     MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [.05 .05 .05] \
     \"rgb sigma_s\" [.3 .3 .3]\n\
     AttributeBegin MediumInterface \"fog\" \"\" Material \"\" Translate 0 2 0 Shape \"sphere\" \"float radius\" 1.2 AttributeEnd\n";

fn speck(away: f64) -> String {
    // Just large enough for single precision.
    let (x, side) = (6.0 * away, 0.1 + 12e-6 * away);
    format!(
        "AttributeBegin Material \"matte\" \"rgb Kd\" [0 0 0] Translate {x} {x} -9\n\
         Shape \"trianglemesh\" \"point P\" [0 0 0 {side} 0 0 0 {side} {side}] \"integer indices\" [0 1 2] AttributeEnd\n"
    )
}

fn pictures((integrator, spp): (&str, u32), world: &str, first_seed: u64, n: u64) -> Vec<Image> {
    let mut job = job(integrator, CAMERA, spp, world);
    let taken = |seed| {
        job.seed = seed;
        picture(&job)
    };
    (first_seed..first_seed + n).map(taken).collect()
}

/// Mean over pixels of the logarithm of the ratio of the variances of their green, and its standard error. Without pixels
/// that never vary.
fn log_ratio(a: &[Image], b: &[Image]) -> (f64, f64) {
    let variance = |pictures: &[Image], i: usize| {
        let n = pictures.len() as f64;
        let values = || pictures.iter().map(|image| f64::from(image.data()[i]));
        let mean = values().sum::<f64>() / n;
        values().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)
    };
    let ratios: Vec<f64> = (1..a[0].data().len())
        .step_by(3)
        .map(|i| [a, b].map(|pictures| variance(pictures, i)))
        .filter(|[a, b]| *a > 0.0 && *b > 0.0)
        .map(|[a, b]| (a / b).ln())
        .collect();
    let n = ratios.len() as f64;
    let mean = ratios.iter().sum::<f64>() / n;
    let squares: f64 = ratios.iter().map(|r| (r - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0) / n).sqrt())
}

fn adding_a_speck(integrator: (&str, u32), light: &str, away: &[f64], n_seeds: u64) {
    let world = format!("{ROOM}{BALL}{light}");
    let without = pictures(integrator, &world, 0, n_seeds);
    for &away in away {
        let what = format!("{}, {light}, {away}", integrator.0);
        let world = format!("{}{world}", speck(away));
        let others = pictures(integrator, &world, n_seeds, n_seeds);
        compare_pictures(&others, &without).assert_accepted(&what);
        // By the same random numbers: what the speck does not change has no noise here.
        let with = pictures(integrator, &world, 0, n_seeds);
        let (ratio, error) = log_ratio(&with, &without);
        assert!(
            ratio.abs() < PART.max(SIGMAS * error),
            "{what}: variance times {:.3} ± {error:.3}",
            ratio.exp()
        );
    }
}

#[test]
fn a_speck_out_of_sight_starves_no_light_path() {
    for (integrator, light) in [
        (BDPT, SUN),
        (BDPT, SKY),
        (BDPT, STAR),
        (BDPT, SUN_AND_LAMP),
        (BDPT, SUN_ON_FOG),
        (MLT, SUN),
        (SPPM, SUN),
        (SPPM, SUN_AND_LAMP),
    ] {
        adding_a_speck(integrator, light, &AWAY[2..], 20);
    }
}

/// Directions and distances keep their digits, in fog and beyond surfaces on the way as well.
#[test]
fn how_far_away_a_speck_is_changes_next_to_nothing() {
    // Above the sun's way to the room.
    const ROOF: &str = "AttributeBegin Material \"matte\" Translate 2 9 -3 Rotate 90 1 0 0\n\
         Shape \"disk\" \"float radius\" 2 AttributeEnd\n";
    for integrator in [BDPT, MLT, SPPM] {
        for light in [SUN, SKY, STAR, SUN_AND_LAMP, SUN_ON_FOG] {
            let [near, far] = [1e3, 1e6].map(|away| {
                let world = format!("{}{ROOM}{BALL}{ROOF}{light}", speck(away));
                pictures(integrator, &world, 0, 2)
            });
            let values = |pictures: &[Image]| -> Vec<f32> {
                pictures
                    .iter()
                    .flat_map(|image| image.data().to_vec())
                    .collect()
            };
            let (near, far) = (values(&near), values(&far));
            let is_off = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-3 * a.abs().max(b.abs());
            let n_off = near.iter().zip(&far).filter(is_off).count();
            let what = format!("{}, {light}", integrator.0);
            assert!(
                20 * n_off <= near.len(),
                "{what}: {n_off} of {} numbers differ",
                near.len()
            );
        }
    }
}

#[test]
#[ignore = "long"]
fn a_speck_out_of_sight_starves_no_light_path_at_all() {
    for integrator in [BDPT, MLT, SPPM] {
        for light in [SUN, SKY, STAR, SUN_AND_LAMP, SUN_ON_FOG] {
            adding_a_speck(integrator, light, &AWAY, 200);
        }
    }
}
