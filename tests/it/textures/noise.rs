//! Noise and what is made of it, against an evaluation written from the definition and against values of pbrt-v3.

use glam::DVec3;
use tyndall::math::Vec3;
use tyndall::texture::noise::{Octaves, noise};
use tyndall::texture::{Fbm, Marble, Texture, Windy, Wrinkled};
use tyndall_test_support::Uniform;

use crate::textures::at::{SOLID, assert_close, float, point, rgb};

/// Perlin's permutation, in hexadecimal.
const PERMUTATION: &str = "\
    97a0895b5a0f830dc95f6035c2e907e18c24671e458e086325f0150a17be0694\
    f778ea4b001ac53e5efcdbcb75230b2039b12158ed953857ae147d88aba844af\
    4aa547868b301ba64d929ee7536fe57a3cd385e6dc695c29372ef528f4668f36\
    41193fa101d85049d14c84bbd05912a9c8c4878274bc9f56a4646dc6adba0340\
    34d9e2fa7c7b05ca2693767eff5255d4cfce3be32f103a11b6bd1c2adfb7aad5\
    77f898022c9aa346dd99659ba72bac09811627fd13626c6e4f71e0e8b2b97068\
    daf661e4fb22f2c1eed2900cbfb3a2f1513391ebf90eef6b31c0d61fb5c76a9d\
    b854ccb07379322d7f0496fe8aeccd5dde72431d1848f38d80c34e42d73d9cb4";

fn permuted(i: i64) -> i64 {
    let i = i.rem_euclid(256) as usize;
    i64::from_str_radix(&PERMUTATION[2 * i..2 * i + 2], 16).expect("hexadecimal digits")
}

/// The gradients that hashes 0 to 15 pick.
const GRADIENTS: [[f64; 3]; 16] = [
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [-1.0, -1.0, 0.0],
    [1.0, 0.0, 1.0],
    [-1.0, 0.0, 1.0],
    [1.0, 0.0, -1.0],
    [-1.0, 0.0, -1.0],
    [0.0, 1.0, 1.0],
    [0.0, -1.0, 1.0],
    [0.0, 1.0, -1.0],
    [0.0, -1.0, -1.0],
    [1.0, 1.0, 0.0],
    [-1.0, 1.0, 0.0],
    [0.0, 1.0, -1.0],
    [0.0, -1.0, -1.0],
];

/// The sum over the eight lattice points around: gradient times offset, weighted by a quintic along each axis.
fn noise_by_definition(p: DVec3) -> f64 {
    let cell = p.floor();
    let mut sum = 0.0;
    for corner in 0..8 {
        let step = DVec3::new(
            f64::from(corner & 1),
            f64::from(corner >> 1 & 1),
            f64::from(corner >> 2),
        );
        let lattice = cell + step;
        let hash = lattice
            .to_array()
            .into_iter()
            .fold(0, |hash, x| permuted(hash + x as i64));
        let offset = p - lattice;
        let fade = |d: f64| {
            let x = 1.0 - d.abs();
            10.0 * x.powi(3) - 15.0 * x.powi(4) + 6.0 * x.powi(5)
        };
        let weight = fade(offset.x) * fade(offset.y) * fade(offset.z);
        sum += weight * offset.dot(DVec3::from(GRADIENTS[(hash & 15) as usize]));
    }
    sum
}

#[test]
fn noise_is_what_its_definition_says() {
    let mut random = Uniform::new(3);
    let mut largest = 0.0_f32;
    for _ in 0..5000 {
        let mut next = || 600.0 * (f64::from(random.unit()) - 0.5);
        let p = DVec3::new(next(), next(), next());
        let value = noise(p);
        assert_close(value, noise_by_definition(p), &format!("noise at {p}"));
        largest = largest.max(value.abs());
    }
    assert!(largest > 0.5);
}

#[test]
#[expect(clippy::approx_constant, reason = "a coordinate of a published value")]
fn noise_has_the_values_of_pbrt() {
    for (p, expected) in [
        ([0.25, 0.5, 0.75], -0.06879425),
        // Also a value of Perlin's own implementation.
        ([3.14, 42.0, 7.0], 0.136_919_958_784),
        ([-1.7, 2.3, -300.4], -0.311_774),
        ([255.5, 256.5, -0.25], -0.056030273),
        ([12.125, -7.375, 0.8125], -0.044612512),
    ] {
        assert_close(noise(DVec3::from(p)), expected, &format!("{p:?}"));
    }
}

const OCTAVES: Octaves = Octaves {
    count: 5,
    roughness: 0.6,
};

/// Position, footprint, fbm and turbulence by pbrt-v3, with [`OCTAVES`].
const SUMS: [([f32; 3], f32, f64, f64); 15] = [
    ([0.25, 0.5, 0.75], 0.0, 0.13917255, 0.29231307),
    ([0.25, 0.5, 0.75], 0.01, 0.13917255, 0.29231307),
    ([0.25, 0.5, 0.75], 0.04, 0.10788767, 0.31691051),
    ([0.25, 0.5, 0.75], 0.3, -0.06879425, 0.52991426),
    ([0.25, 0.5, 0.75], 1.0, 0.0, 0.66112006),
    ([12.125, -7.375, 0.8125], 0.0, -0.20733574, 0.35560092),
    ([12.125, -7.375, 0.8125], 0.01, -0.20733574, 0.35560092),
    ([12.125, -7.375, 0.8125], 0.04, -0.15890153, 0.36304906),
    ([12.125, -7.375, 0.8125], 0.3, -0.044612512, 0.50573254),
    ([12.125, -7.375, 0.8125], 1.0, 0.0, 0.66112006),
    ([0.1, 0.2, 0.3], 0.0, 0.37210077, 0.52452457),
    ([0.1, 0.2, 0.3], 0.01, 0.37210077, 0.52452457),
    ([0.1, 0.2, 0.3], 0.04, 0.37992361, 0.57258403),
    ([0.1, 0.2, 0.3], 0.3, 0.35872108, 0.81984115),
    ([0.1, 0.2, 0.3], 1.0, 0.0, 0.66112006),
];

#[test]
fn sums_of_octaves_have_the_values_of_pbrt() {
    for (p, footprint, fbm, turbulence) in SUMS {
        let mut at = point(p);
        // The longer one counts, whatever its direction.
        at.dp_dx = Vec3::new(0.0, 0.5 * footprint, 0.0);
        at.dp_dy = Vec3::new(0.6 * footprint, 0.0, -0.8 * footprint);
        let (mapping, octaves) = (SOLID, OCTAVES);
        let value = float(Texture::Fbm(Fbm { mapping, octaves }), &at);
        assert_close(value, fbm, &format!("fbm at {p:?}, {footprint}"));
        let value = float(Texture::Wrinkled(Wrinkled { mapping, octaves }), &at);
        assert_close(
            value,
            turbulence,
            &format!("wrinkled at {p:?}, {footprint}"),
        );
    }
}

#[test]
fn windy_has_the_values_of_pbrt() {
    for (p, expected) in [
        ([0.25, 0.5, 0.75], 0.025218073),
        ([12.125, -7.375, 0.8125], -0.040757727),
        ([0.1, 0.2, 0.3], 0.04691885),
    ] {
        let mut at = point(p);
        at.dp_dx = Vec3::new(0.02, 0.0, 0.0);
        let value = float(Texture::Windy(Windy { mapping: SOLID }), &at);
        assert_close(value, expected, &format!("{p:?}"));
    }
}

#[test]
fn marble_has_the_values_of_pbrt_bright_ones_included() {
    for (p, expected) in [
        ([0.25, 0.5, 0.75], [14.57684, 13.86881, 14.84742]),
        ([12.125, -7.375, 0.8125], [1.76104, 1.686419, 1.678007]),
        ([0.1, 0.2, 0.3], [13.75631, 13.08639, 13.99324]),
    ] {
        let mut at = point(p);
        at.dp_dy = Vec3::new(0.0, 0.0, 0.02);
        let marble = Marble {
            mapping: SOLID,
            octaves: OCTAVES,
            scale: 1.3,
            variation: 0.7,
        };
        let value = rgb(Texture::Marble(marble), &at).to_array();
        for (value, expected) in value.into_iter().zip(expected) {
            // The curve is steep out there: six segments of it, cubed.
            let error = (f64::from(value) - expected).abs();
            assert!(error < 1e-5 * expected, "{p:?}: {value} is not {expected}");
        }
    }
}
