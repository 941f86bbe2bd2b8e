//! Every class that is not noise, at points where the value is known.

use tyndall::image::Image;
use tyndall::image::mip::{MipMap, Wrap};
use tyndall::spectrum::Rgb;
use tyndall::texture::{
    Bilerp, Checkerboard2, Checkerboard3, Dots, Fbm, Filter, ImageTexture, Mix, Scale, Smoothing,
    Source, Texture, Textures, Uv, noise::Octaves,
};

use crate::textures::at::{SOLID, UV, assert_close, constant, float, point, rgb, uv};

#[test]
fn bilerp_is_bilinear_and_goes_on_beyond_the_corners() {
    let corners = [1.0, 2.0, 4.0, 10.0];
    for (u, v) in [
        (0.0, 0.0),
        (0.0, 1.0),
        (1.0, 0.0),
        (1.0, 1.0),
        (0.3, 0.8),
        (-2.0, 3.5),
    ] {
        // v00 + u (v10 - v00) + v (v01 - v00) + uv (v00 + v11 - v01 - v10)
        let [x, y] = [f64::from(u), f64::from(v)];
        let expected = 1.0 + 3.0 * x + y + 5.0 * x * y;
        let bilerp = Bilerp {
            mapping: UV,
            corners,
        };
        let value = float(Texture::Bilerp(bilerp), &uv(u, v));
        assert_close(value, expected, &format!("bilerp at {u}, {v}"));
    }
}

#[test]
fn uv_shows_fractions() {
    let uv_texture = || Texture::Uv(Uv { mapping: UV });
    assert_eq!(
        rgb(uv_texture(), &uv(0.25, 0.75)),
        Rgb::new(0.25, 0.75, 0.0)
    );
    assert_eq!(
        rgb(uv_texture(), &uv(3.25, -0.25)),
        Rgb::new(0.25, 0.75, 0.0)
    );
}

#[test]
fn scale_multiplies_by_channel_and_mix_goes_along_the_line() {
    let mut textures = Textures::default();
    let varying = textures.add(Texture::Uv(Uv { mapping: UV }));
    let scaled = textures.add(Texture::Scale(Scale {
        factors: [varying, constant(Rgb::new(2.0, 4.0, 8.0))],
    }));
    let at = uv(0.25, 0.5);
    assert_eq!(textures.spectrum(scaled, &at), Rgb::new(0.5, 2.0, 0.0));
    for amount in [0.0, 0.25, 1.0, 3.0] {
        let mix = textures.add(Texture::Mix(Mix {
            ends: [varying, constant(Rgb::ONE)],
            amount: constant(amount),
        }));
        let expected = Rgb::new(0.25, 0.5, 0.0) * (1.0 - amount) + Rgb::ONE * amount;
        assert_eq!(textures.spectrum(mix, &at), expected);
    }
}

#[test]
fn mix_takes_its_amount_from_a_texture() {
    let mut textures = Textures::default();
    let amount = textures.add(Texture::Bilerp(Bilerp {
        mapping: UV,
        corners: [0.0, 0.0, 1.0, 1.0],
    }));
    let mix = textures.add(Texture::Mix(Mix {
        ends: [constant(10.0), constant(20.0)],
        amount,
    }));
    assert_eq!(textures.float(mix, &uv(0.25, 0.9)), 12.5);
}

#[test]
fn cubes_alternate_in_three_directions() {
    let board = || {
        Texture::Checkerboard3(Checkerboard3 {
            mapping: SOLID,
            fields: [constant(1.0), constant(0.0)],
        })
    };
    for (p, expected) in [
        ([0.5, 0.5, 0.5], 1.0),
        ([1.5, 0.5, 0.5], 0.0),
        ([1.5, 1.5, 0.5], 1.0),
        ([1.5, 1.5, 1.5], 0.0),
        ([-0.5, 0.5, 0.5], 0.0),
        ([-0.5, -0.5, 0.5], 1.0),
    ] {
        assert_eq!(float(board(), &point(p)), expected, "{p:?}");
    }
}

/// Where pbrt-v3 has dots, in steps of 0.25 from (-2.94, 1.07).
const DOTS: [&str; 12] = [
    "o..........ooo..........",
    "........................",
    "........................",
    ".......oo..ooo..oo.ooo.o",
    ".......oo..ooo.ooo.ooo.o",
    ".......oo...o...o...o...",
    "....................o...",
    "............oo.ooo.ooo.o",
    "...........ooo.ooo.ooo.o",
    "............oo..o.......",
    "........................",
    "....o..............oo..o",
];

#[test]
fn dots_are_where_pbrt_has_them_and_show_the_second_source() {
    for (j, row) in DOTS.iter().enumerate() {
        for (i, symbol) in row.chars().enumerate() {
            let dots = Dots {
                mapping: UV,
                ground: constant(0.0),
                dot: constant(1.0),
            };
            let at = uv(-2.94 + 0.25 * i as f32, 1.07 + 0.25 * j as f32);
            let expected = if symbol == 'o' { 1.0 } else { 0.0 };
            assert_eq!(
                float(Texture::Dots(dots), &at),
                expected,
                "row {j}, column {i}"
            );
        }
    }
}

/// A texture over an image of 4 x 2 texels with values 0 to 7, and its texels.
fn image(wrap: Wrap, filter: Filter) -> (Textures, Source<f32>) {
    let mut textures = Textures::default();
    let texels = (0..8).map(|i| i as f32).collect();
    let texels = Image::new(4, 2, 1, texels).expect("8 texels");
    let image = textures.add_image(MipMap::new(texels, wrap));
    let source = textures.add(Texture::Image(ImageTexture {
        image,
        mapping: UV,
        filter,
    }));
    (textures, source)
}

#[test]
fn images_show_texels_at_their_centres_and_wrap() {
    let ewa = Filter::Ewa {
        max_anisotropy: 8.0,
    };
    for filter in [Filter::Trilinear, ewa] {
        for (wrap, left, above) in [
            (Wrap::Repeat, 3.0, 0.0),
            (Wrap::Clamp, 0.0, 4.0),
            (Wrap::Black, 0.0, 0.0),
        ] {
            let (textures, source) = image(wrap, filter);
            let at = |u, v| textures.float(source, &uv(u, v));
            assert_eq!(at(0.125, 0.25), 0.0);
            assert_eq!(at(0.625, 0.75), 6.0);
            assert_eq!(at(-0.125, 0.25), left, "{wrap:?} left");
            assert_eq!(at(0.125, 1.25), above, "{wrap:?} above");
        }
    }
}

#[test]
fn a_footprint_as_wide_as_the_image_shows_its_mean() {
    let ewa = Filter::Ewa {
        max_anisotropy: 8.0,
    };
    for filter in [Filter::Trilinear, ewa] {
        let (textures, source) = image(Wrap::Repeat, filter);
        let mut at = uv(0.3, 0.6);
        (at.duv_dx, at.duv_dy) = ([1.0, 0.0], [0.0, 1.0]);
        assert_close(textures.float(source, &at), 3.5, &format!("{filter:?}"));
    }
}

#[test]
fn repeats_far_out_show_the_same_as_the_first() {
    let (textures, source) = image(Wrap::Repeat, Filter::Trilinear);
    // Whole numbers and eighths are exact in single precision.
    for far in [4.0, -1024.0, 65536.0] {
        let (near, far) = (uv(0.375, 0.625), uv(far + 0.375, 0.625 - far));
        assert_eq!(textures.float(source, &near), textures.float(source, &far));
    }
}

#[test]
fn textures_know_whether_they_look_at_the_footprint() {
    let mut textures = Textures::default();
    let bilerp = textures.add(Texture::Bilerp(Bilerp {
        mapping: UV,
        corners: [0.0, 0.0, 1.0, 1.0],
    }));
    let fbm = textures.add(Texture::Fbm(Fbm {
        mapping: SOLID,
        octaves: Octaves {
            count: 8,
            roughness: 0.5,
        },
    }));
    let board = |smoothing, odd| {
        Texture::Checkerboard2(Checkerboard2 {
            mapping: UV,
            fields: [bilerp, odd],
            smoothing,
        })
    };
    let sharp = textures.add(board(Smoothing::None, constant(0.0)));
    let smooth = textures.add(board(Smoothing::ClosedForm, constant(0.0)));
    let sharp_of_fbm = textures.add(board(Smoothing::None, fbm));
    let mixed = textures.add(Texture::Mix(Mix {
        ends: [constant(Rgb::BLACK), constant(Rgb::ONE)],
        amount: sharp_of_fbm,
    }));
    let product = textures.add(Texture::Scale(Scale {
        factors: [bilerp, sharp],
    }));
    for (source, expected) in [
        (constant(1.0), false),
        (bilerp, false),
        (fbm, true),
        (sharp, false),
        (smooth, true),
        (sharp_of_fbm, true),
        (product, false),
    ] {
        assert_eq!(textures.needs_footprint(source), expected, "{source:?}");
    }
    assert!(textures.needs_footprint(mixed));
}
