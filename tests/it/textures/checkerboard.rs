//! The antialiased checkerboard against quadrature.

use glam::{DVec2, Vec2};
use tyndall::texture::{Checkerboard2, Mapping2, Smoothing, Texture, TextureContext, UvMapping};
use tyndall_test_support::Uniform;

use crate::textures::at::{UV, constant, float, uv};

fn board(mapping: Mapping2, smoothing: Smoothing, ctx: &TextureContext) -> f32 {
    let fields = [constant(0.0), constant(1.0)];
    let board = Checkerboard2 {
        mapping,
        fields,
        smoothing,
    };
    float(Texture::Checkerboard2(board), ctx)
}

/// Share of the box around `center` that lies in odd fields, by the midpoint rule along each axis.
fn share_of_odd(center: DVec2, half: DVec2) -> f64 {
    const N: usize = 20_000;
    let odd = |x: f64, half: f64| {
        let is_odd = |k: usize| {
            let x = x + half * (2.0 * (k as f64 + 0.5) / N as f64 - 1.0);
            x.floor().rem_euclid(2.0) == 1.0
        };
        (0..N).filter(|&k| is_odd(k)).count() as f64 / N as f64
    };
    let (s, t) = (odd(center.x, half.x), odd(center.y, half.y));
    s * (1.0 - t) + t * (1.0 - s)
}

#[test]
fn closed_form_is_the_mean_over_the_box() {
    let mut random = Uniform::new(11);
    let mut strict = 0;
    for _ in 0..300 {
        let mut next = |low: f32, high: f32| low + (high - low) * random.unit();
        let mut ctx = uv(next(-5.0, 5.0), next(-5.0, 5.0));
        ctx.duv_dx = [next(-0.99, 0.99), next(-0.2, 0.2)];
        ctx.duv_dy = [next(-0.3, 0.3), next(-0.99, 0.99)];
        let half = Vec2::from(ctx.duv_dx)
            .abs()
            .max(Vec2::from(ctx.duv_dy).abs());
        let expected = share_of_odd(Vec2::from(ctx.uv).as_dvec2(), half.as_dvec2());
        let value = board(UV, Smoothing::ClosedForm, &ctx);
        assert!(
            (f64::from(value) - expected).abs() < 1e-3,
            "{ctx:?}: {value} is not {expected}"
        );
        strict += usize::from(value > 0.01 && value < 0.99);
    }
    assert!(strict > 100, "most boxes cross an edge");
}

#[test]
fn without_smoothing_or_footprint_fields_are_sharp() {
    for smoothing in [Smoothing::None, Smoothing::ClosedForm] {
        for (u, v, expected) in [
            (0.5, 0.5, 0.0),
            (1.5, 0.5, 1.0),
            (-0.01, 0.5, 1.0),
            (-0.5, -1.5, 1.0),
        ] {
            assert_eq!(board(UV, smoothing, &uv(u, v)), expected, "{u}, {v}");
        }
    }
    let mut wide = uv(0.5, 0.5);
    wide.duv_dx = [0.7, 0.0];
    assert_eq!(board(UV, Smoothing::None, &wide), 0.0);
    assert!(board(UV, Smoothing::ClosedForm, &wide) > 0.2);
}

#[test]
fn footprints_wider_than_two_fields_show_the_mean() {
    for (dx, dy) in [([1.01, 0.0], [0.0, 0.0]), ([0.0, 0.0], [0.3, 77.0])] {
        let mut ctx = uv(0.1, 0.4);
        (ctx.duv_dx, ctx.duv_dy) = (dx, dy);
        assert_eq!(board(UV, Smoothing::ClosedForm, &ctx), 0.5);
    }
}

#[test]
fn a_footprint_along_one_axis_only_is_smoothed_along_it() {
    // Crossing s = 1 with t inside the even row: half and half.
    let mut ctx = uv(1.0, 0.5);
    ctx.duv_dx = [0.25, 0.0];
    assert_eq!(board(UV, Smoothing::ClosedForm, &ctx), 0.5);
    ctx.uv = [1.125, 0.5];
    assert_eq!(board(UV, Smoothing::ClosedForm, &ctx), 0.75);
}

#[test]
fn m11_checkerboards_of_1e12_fields_show_their_mean() {
    let mut random = Uniform::new(5);
    for scale in [1e12, (1_u64 << 40) as f32, 1e30] {
        let mapping = Mapping2::Uv(UvMapping {
            scale: Vec2::splat(scale),
            delta: Vec2::ZERO,
        });
        for smoothing in [Smoothing::None, Smoothing::ClosedForm] {
            let n = 4000;
            let sum: f64 = (0..n)
                .map(|_| {
                    let ctx = uv(random.unit(), random.unit());
                    f64::from(board(mapping, smoothing, &ctx))
                })
                .sum();
            let mean = sum / f64::from(n);
            assert!((mean - 0.5).abs() < 0.005, "{scale}, {smoothing:?}: {mean}");
        }
    }
}
