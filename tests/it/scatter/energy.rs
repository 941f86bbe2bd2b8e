//! Directional albedo: two ways to find it, its bounds, and the figures of the reference renderer.

use std::sync::atomic::AtomicBool;

use tyndall::compile::CompileOptions;
use tyndall::math::Vec3;
use tyndall::render::{Unwatched, render};
use tyndall::scatter::{Bsdf, Bxdf, TransportMode};
use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use crate::common::scene::compile_scene;
use crate::common::seen::{environment, seen_by};
use crate::scatter::cases::{
    LOSSLESS, any_direction, glass, metal, narrow_lobes, smooth_lobes, surface, views,
};

/// Mean weight of `n` drawn directions.
fn albedo_by_sampling(bsdf: &Bsdf, wo: Vec3, mode: TransportMode, n: usize) -> Mean {
    let mut random = Uniform::new(11);
    Mean::of(n, || {
        let sample = bsdf.sample(wo, random.unit(), random.unit2(), mode);
        sample.map_or(0.0, |sample| f64::from(sample.weight.g()))
    })
}

/// The same by directions that know nothing of the lobe.
fn albedo_by_uniform_directions(bsdf: &Bsdf, wo: Vec3, mode: TransportMode, n: usize) -> Mean {
    let mut random = Uniform::new(12);
    Mean::of(n, || {
        let wi = any_direction(&mut random);
        let f = bsdf.f(wo, wi, mode).g() * bsdf.abs_cos(wi);
        4.0 * std::f64::consts::PI * f64::from(f)
    })
}

#[test]
fn drawn_and_uniform_directions_find_the_same_albedo() {
    for (name, lobe) in smooth_lobes() {
        let bsdf = surface([lobe]);
        for wo in views() {
            for mode in [TransportMode::Radiance, TransportMode::Importance] {
                let drawn = albedo_by_sampling(&bsdf, wo, mode, 20_000);
                let uniform = albedo_by_uniform_directions(&bsdf, wo, mode, 200_000);
                drawn
                    .agrees_with_mean(&uniform)
                    .assert_accepted(&format!("{name} from {wo:?}, {mode:?}"));
            }
        }
    }
}

#[test]
fn the_judge_rejects_weights_that_are_two_percent_off() {
    let bsdf = surface([metal([0.5, 0.5], LOSSLESS)]);
    let wo = views()[1];
    let mode = TransportMode::Radiance;
    let mut drawn = albedo_by_sampling(&bsdf, wo, mode, 200_000);
    drawn.value *= 1.02;
    let uniform = albedo_by_uniform_directions(&bsdf, wo, mode, 200_000);
    assert!(!drawn.agrees_with_mean(&uniform).accepted());
}

#[test]
fn no_interface_gives_back_more_than_it_receives() {
    // The coat of substrate has no masking, and may.
    let passive = |lobe: &Bxdf| !matches!(lobe, Bxdf::FresnelBlend(_));
    let lobes = smooth_lobes().into_iter().chain(narrow_lobes());
    for (name, lobe) in lobes.filter(|(_, lobe)| passive(lobe)) {
        let bsdf = surface([lobe]);
        for wo in views() {
            let albedo = albedo_by_sampling(&bsdf, wo, TransportMode::Importance, 20_000);
            assert!(
                albedo.value <= 1.0 + 4.0 * albedo.standard_error + 1e-4,
                "{name} from {wo:?}: {albedo:?}"
            );
        }
    }
}

#[test]
fn narrow_lobes_lose_next_to_nothing() {
    for lobe in [metal([0.0, 0.0], LOSSLESS), glass([0.0, 0.0], 1.5)] {
        for wo in views().into_iter().filter(|wo| wo.z().abs() > 0.1) {
            let bsdf = surface([lobe]);
            let albedo = albedo_by_sampling(&bsdf, wo, TransportMode::Importance, 20_000);
            assert!(
                (albedo.value - 1.0).abs() < 1e-3,
                "{lobe:?} from {wo:?}: {albedo:?}"
            );
        }
    }
}

/// Mean radiance of a picture of 16 by 16 pixels: a unit ball in the furnace, seen from a distance of 5 under 40°.
fn ball_in_the_furnace(material: &str) -> Mean {
    let world = environment([1.0; 3]) + &format!("Material {material} Shape \"sphere\"");
    let scene = seen_by("path", 100, [0.0, 0.0, 5.0], [0.0, 0.0, -1.0], &world)
        .replace("\"perspective\"", "\"perspective\" \"float fov\" 40");
    let text = format!(
        "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\n\
         PixelFilter \"box\" Sampler \"lowdiscrepancy\" \"integer pixelsamples\" 64\n{scene}"
    );
    let mut job = compile_scene(text, &CompileOptions::default(), |_| None).job;
    let mut seed = 0;
    Mean::of(8, || {
        seed += 1;
        job.seed = seed;
        let picture = render(&job, &Unwatched, &AtomicBool::new(false)).image;
        let values = picture.data();
        values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64
    })
}

/// The figures of the reference renderer have three digits, and noise of some samples per pixel.
const REFERENCE_ERROR: f64 = 1e-3;

#[test]
fn m04_lossless_rough_metal_darkens_as_in_the_reference() {
    for (roughness, expected) in [(0.1, 0.992), (0.5, 0.926), (1.0, 0.855)] {
        let material = format!(
            "\"metal\" \"rgb eta\" [0 0 0] \"rgb k\" [1 1 1] \"float roughness\" {roughness} \
             \"bool remaproughness\" \"false\""
        );
        let mean = ball_in_the_furnace(&material);
        let mean = Mean {
            standard_error: mean.standard_error.hypot(REFERENCE_ERROR),
            ..mean
        };
        mean.agrees_with(expected)
            .assert_accepted(&format!("roughness {roughness}"));
    }
}
