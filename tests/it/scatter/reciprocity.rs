//! Light takes every way back.

use tyndall::scatter::TransportMode;
use tyndall_test_support::Uniform;

use crate::scatter::cases::{any_direction, narrow_lobes, smooth_lobes, surface};

/// Relative difference that the rounding of directions makes in a narrow lobe.
const PRECISION: f32 = 2e-2;

#[test]
fn the_adjoint_is_the_value_with_directions_exchanged() {
    let mut n_compared = 0;
    for (name, lobe) in smooth_lobes().into_iter().chain(narrow_lobes()) {
        let bsdf = surface([lobe]);
        let mut random = Uniform::new(21);
        for _ in 0..5000 {
            let wo = any_direction(&mut random);
            // Half of the pairs are such as the lobe draws.
            let drawn = bsdf.sample(wo, random.unit(), random.unit2(), TransportMode::Radiance);
            let wi = match drawn {
                Some(sample) if random.unit() < 0.5 => sample.wi,
                _ => any_direction(&mut random),
            };
            if wo.z().abs().min(wi.z().abs()) < 0.01 {
                continue;
            }
            let there = bsdf.f(wo, wi, TransportMode::Importance);
            let back = bsdf.f(wi, wo, TransportMode::Radiance);
            n_compared += usize::from(!there.is_black());
            for channel in 0..3 {
                let (there, back) = (there[channel], back[channel]);
                assert!(
                    (there - back).abs() <= PRECISION * there.max(back).max(1e-3),
                    "{name}: {wo:?} to {wi:?}: {there}, back {back}"
                );
            }
        }
    }
    assert!(n_compared > 100_000, "{n_compared} pairs");
}

#[test]
fn reflection_is_the_same_in_both_modes_and_transmission_differs_by_the_indices() {
    for (name, lobe) in smooth_lobes() {
        let bsdf = surface([lobe]);
        let mut random = Uniform::new(22);
        for _ in 0..2000 {
            let (wo, wi) = (any_direction(&mut random), any_direction(&mut random));
            let radiance = bsdf.f(wo, wi, TransportMode::Radiance).g();
            let importance = bsdf.f(wo, wi, TransportMode::Importance).g();
            let eta = match name.split_once("index ") {
                Some((_, eta)) if wo.z() * wi.z() < 0.0 => eta.parse().expect("an index"),
                _ if name.starts_with("refracting") => 1.33,
                _ => 1f32,
            };
            let compression = if wo.z() > 0.0 {
                eta * eta
            } else {
                1.0 / (eta * eta)
            };
            assert!(
                (radiance * compression - importance).abs() <= 1e-4 * importance,
                "{name}: {radiance} {importance}"
            );
        }
    }
}
