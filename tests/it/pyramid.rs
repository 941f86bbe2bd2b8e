//! Pixel buffers, mip pyramids and measures of difference.

use glam::Vec2;
use tyndall::image::Image;
use tyndall::image::metrics::Comparison;
use tyndall::image::mip::{MipMap, Wrap};
use tyndall::image::repair::{self, Samples};
use tyndall::spectrum::Rgb;
use tyndall_test_support::Uniform;

/// Smooth, all different, some above 1.
fn gradient(width: usize, height: usize, channels: usize) -> Image {
    let data = (0..width * height * channels)
        .map(|i| i as f32 * 0.37 + 0.01)
        .collect();
    Image::new(width, height, channels, data).unwrap()
}

fn grey(width: usize, height: usize, data: &[f32]) -> Image {
    Image::new(width, height, 1, data.to_vec()).unwrap()
}

// --- Buffers -----------------------------------------------------------------------------------------------------

#[test]
fn images_of_impossible_shape_are_errors() {
    for (width, height, channels, n_samples) in
        [(0, 1, 1, 0), (1, 0, 3, 0), (1, 1, 2, 2), (2, 2, 1, 3)]
    {
        assert!(Image::new(width, height, channels, vec![0.0; n_samples]).is_err());
    }
    assert!(Image::new(usize::MAX, usize::MAX, 3, vec![0.0; 3]).is_err());
}

#[test]
fn flipping_twice_changes_nothing_and_once_swaps_the_rows() {
    for height in [1, 2, 5] {
        let image = gradient(3, height, 3);
        let mut flipped = image.clone();
        flipped.flip_vertical();
        for y in 0..height {
            assert_eq!(flipped.pixel(1, y), image.pixel(1, height - 1 - y));
        }
        flipped.flip_vertical();
        assert_eq!(flipped, image);
    }
}

#[test]
fn grey_is_luminance() {
    let image = Image::new(1, 1, 3, vec![0.2, 0.5, 0.9]).unwrap();
    assert_eq!(
        image.into_grey().data(),
        [Rgb::new(0.2, 0.5, 0.9).luminance()]
    );
}

#[test]
fn impossible_texels_are_repaired_and_counted() {
    let mut image = grey(
        7,
        1,
        &[
            1.0,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            -5.0,
            3.0,
            -0.0,
        ],
    );
    let repairs = repair::repair(&mut image, Samples::NonNegative);
    assert_eq!(
        (
            repairs.nan,
            repairs.infinite,
            repairs.negative,
            repairs.total()
        ),
        (1, 1, 2, 4)
    );
    assert_eq!(image.data(), [1.0, 0.0, 3.0, 0.0, 0.0, 3.0, 0.0]);
    assert_eq!(repair::repair(&mut image, Samples::NonNegative).total(), 0);
    let mut hopeless = Image::constant(f32::INFINITY);
    repair::repair(&mut hopeless, Samples::NonNegative);
    assert_eq!(hopeless.data(), [0.0]);
}

// --- Pyramids ----------------------------------------------------------------------------------------------------

#[test]
fn powers_of_two_are_not_resampled() {
    let image = gradient(8, 4, 3);
    let mip = MipMap::new(image.clone(), Wrap::Repeat);
    assert_eq!(mip.level(0), &image);
    let sizes: Vec<_> = (0..mip.n_levels())
        .map(|l| (mip.level(l).width(), mip.level(l).height()))
        .collect();
    assert_eq!(sizes, [(8, 4), (4, 2), (2, 1), (1, 1)]);
}

#[test]
fn coarser_levels_are_box_averages() {
    let mip = MipMap::new(
        grey(4, 2, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]),
        Wrap::Clamp,
    );
    assert_eq!(mip.level(1).data(), [3.5, 5.5]);
    assert_eq!(mip.level(2).data(), [4.5]);
}

#[test]
fn black_borders_darken_levels_below_one_texel() {
    let narrow = grey(4, 1, &[1.0; 4]);
    assert_eq!(
        MipMap::new(narrow.clone(), Wrap::Repeat).level(1).data(),
        [1.0, 1.0]
    );
    assert_eq!(MipMap::new(narrow, Wrap::Black).level(1).data(), [0.5, 0.5]);
}

/// The resampling rule in f64, one axis, straight from its definition.
fn lanczos_row(row: &[f64], new: usize, wrap: Wrap) -> Vec<f64> {
    use std::f64::consts::PI;
    let lanczos = |x: f64| match x.abs() * PI {
        x if x < 1e-9 => 1.0,
        x if x > PI => 0.0,
        x => (2.0 * x).sin() / (2.0 * x) * x.sin() / x,
    };
    let n = row.len() as i64;
    let texel = |i: i64| match wrap {
        Wrap::Repeat => row[i.rem_euclid(n) as usize],
        Wrap::Clamp => row[i.clamp(0, n - 1) as usize],
        Wrap::Black => *row
            .get(usize::try_from(i).unwrap_or(usize::MAX))
            .unwrap_or(&0.0),
    };
    let sample = |i: usize| {
        let center = (i as f64 + 0.5) * row.len() as f64 / new as f64;
        let first = (center - 1.5).floor() as i64;
        let weights: Vec<f64> = (0..4)
            .map(|tap| lanczos(((first + tap) as f64 + 0.5 - center) / 2.0))
            .collect();
        let sum: f64 = weights.iter().sum();
        weights
            .iter()
            .zip(first..)
            .map(|(weight, i)| weight / sum * texel(i))
            .sum::<f64>()
    };
    (0..new).map(sample).collect()
}

#[test]
fn other_sizes_are_resampled_by_the_four_tap_lanczos_of_the_format() {
    let row = [0.3, 2.0, 0.7, 1.1, 0.9, 5.0];
    for wrap in [Wrap::Repeat, Wrap::Black, Wrap::Clamp] {
        let expected: Vec<f64> = lanczos_row(&row, 8, wrap)
            .into_iter()
            .map(|v| v.max(0.0))
            .collect();
        let samples = row.map(|v| v as f32);
        let across = MipMap::new(grey(6, 1, &samples), wrap);
        let down = MipMap::new(grey(1, 6, &samples), wrap);
        for (i, expected) in expected.iter().enumerate() {
            for actual in [across.level(0).data()[i], down.level(0).data()[i]] {
                assert!(
                    (f64::from(actual) - expected).abs() < 2e-6,
                    "{wrap:?} {i}: {actual} is not {expected}"
                );
            }
        }
    }
}

#[test]
fn resampling_keeps_constants_and_never_goes_below_zero() {
    let flat = Image::new(5, 7, 3, vec![0.75; 105]).unwrap();
    for wrap in [Wrap::Repeat, Wrap::Clamp] {
        let mip = MipMap::new(flat.clone(), wrap);
        assert_eq!((mip.level(0).width(), mip.level(0).height()), (8, 8));
        let worst = (0..mip.n_levels())
            .flat_map(|l| mip.level(l).data())
            .map(|v| (v - 0.75).abs())
            .fold(0.0, f32::max);
        assert!(worst < 1e-6, "{wrap:?}: {worst}");
    }
    assert!(
        MipMap::new(flat, Wrap::Black).level(0).pixel(0, 0)[0] < 0.75,
        "black comes in at the border"
    );
    let step = MipMap::new(grey(6, 1, &[0.0, 0.0, 0.0, 9.0, 9.0, 9.0]), Wrap::Clamp);
    assert!(
        step.level(0).data().iter().all(|&v| v >= 0.0)
            && step.level(0).data().iter().any(|&v| v > 9.0)
    );
}

#[test]
fn thread_counts_do_not_change_a_bit() {
    let image = gradient(300, 200, 3);
    let build = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        let mip = pool.install(|| MipMap::new(image.clone(), Wrap::Repeat));
        (0..mip.n_levels())
            .map(|l| mip.level(l).clone())
            .collect::<Vec<_>>()
    };
    assert!(build(1) == build(4));
}

fn checker() -> Image {
    grey(4, 2, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
}

#[test]
fn bilinear_meets_texels_at_their_centres_and_blends_between() {
    let mip = MipMap::new(checker(), Wrap::Repeat);
    let at = |s: f32, t: f32| mip.bilinear::<f32>(0, Vec2::new(s, t));
    assert_eq!((at(0.125, 0.25), at(0.875, 0.75)), (0.0, 7.0));
    assert_eq!((at(0.25, 0.25), at(0.125, 0.5)), (0.5, 2.0));
    assert_eq!(
        at(0.0, 0.25),
        1.5,
        "the left neighbour of the first texel is the last"
    );
    assert_eq!(at(1.125, -0.75), 0.0);
    let clamped = MipMap::new(checker(), Wrap::Clamp);
    assert_eq!(clamped.bilinear::<f32>(0, Vec2::new(-3.0, 0.25)), 0.0);
    let black = MipMap::new(checker(), Wrap::Black);
    assert_eq!(black.bilinear::<f32>(0, Vec2::new(1.0, 0.25)), 1.5);
    assert_eq!(
        mip.bilinear::<f32>(99, Vec2::new(0.5, 0.5)),
        3.5,
        "levels beyond the last are the last"
    );
}

#[test]
fn trilinear_picks_levels_by_width() {
    let mip = MipMap::new(checker(), Wrap::Repeat);
    let st = Vec2::new(0.125, 0.25);
    let at = |width: f32| mip.trilinear::<f32>(st, width);
    assert_eq!((at(0.0), at(0.25)), (0.0, 0.0), "one texel wide is level 0");
    let level1 = mip.bilinear::<f32>(1, st);
    assert_eq!(at(0.5), level1);
    let halfway = at(0.25 * 2f32.sqrt());
    assert!((halfway - 0.5 * level1).abs() < 1e-6, "{halfway}");
    assert_eq!((at(1.0), at(50.0)), (3.5, 3.5));
    let footprint = mip.trilinear_footprint::<f32>(st, Vec2::new(0.01, -0.5), Vec2::new(0.2, 0.0));
    assert_eq!(footprint, level1);
}

#[test]
fn colour_and_number_read_the_same_texels() {
    let image = Image::new(2, 1, 3, vec![1.0, 2.0, 3.0, 5.0, 6.0, 7.0]).unwrap();
    let mip = MipMap::new(image, Wrap::Clamp);
    let st = Vec2::new(0.5, 0.5);
    let colour = mip.bilinear::<Rgb>(0, st);
    assert_eq!(colour, Rgb::new(3.0, 4.0, 5.0));
    assert!((mip.bilinear::<f32>(0, st) - colour.luminance()).abs() < 1e-6);
    let grey = MipMap::new(Image::constant(0.25), Wrap::Clamp);
    assert_eq!(grey.bilinear::<Rgb>(0, st), Rgb::splat(0.25));
}

/// The EWA rule in f64, from its definition: exact Gaussian, all texels of a repeating level.
fn ellipse_mean(image: &Image, st: [f64; 2], d0: [f64; 2], d1: [f64; 2]) -> f64 {
    let (w, h) = (image.width() as f64, image.height() as f64);
    let (x0, y0) = (st[0] * w - 0.5, st[1] * h - 0.5);
    let (d0, d1) = ([d0[0] * w, d0[1] * h], [d1[0] * w, d1[1] * h]);
    let a = d0[1] * d0[1] + d1[1] * d1[1] + 1.0;
    let b = -2.0 * (d0[0] * d0[1] + d1[0] * d1[1]);
    let c = d0[0] * d0[0] + d1[0] * d1[0] + 1.0;
    let f = a * c - 0.25 * b * b;
    let (mut sum, mut weights) = (0.0, 0.0);
    for y in -200i64..200 {
        for x in -200i64..200 {
            let (dx, dy) = (x as f64 - x0, y as f64 - y0);
            let r2 = (a * dx * dx + b * dx * dy + c * dy * dy) / f;
            if r2 < 1.0 {
                let weight = (-2.0 * r2).exp() - (-2f64).exp();
                let wrapped = (
                    x.rem_euclid(image.width() as i64),
                    y.rem_euclid(image.height() as i64),
                );
                sum += weight * f64::from(image.pixel(wrapped.0 as usize, wrapped.1 as usize)[0]);
                weights += weight;
            }
        }
    }
    sum / weights
}

#[test]
fn ewa_is_the_gaussian_mean_over_the_ellipse() {
    let mut random = Uniform::new(7);
    let data: Vec<f32> = (0..32 * 32).map(|_| random.unit()).collect();
    let image = grey(32, 32, &data);
    let mip = MipMap::new(image.clone(), Wrap::Repeat);
    let texel = 1.0 / 32.0;
    // Minor axes of exactly one texel stay on level 0.
    let ellipses = [
        ([texel, 0.0], [0.0, texel]),
        ([4.0 * texel, 0.0], [0.0, texel]),
        ([0.0, -texel], [3.0 * texel, 0.0]),
    ];
    for (d0, d1) in ellipses {
        for st in [[0.3, 0.4], [0.01, 0.98], [0.5, 0.5]] {
            let v = |p: [f64; 2]| Vec2::new(p[0] as f32, p[1] as f32);
            let actual = f64::from(mip.ewa::<f32>(v(st), v(d0), v(d1), 8.0));
            let expected = ellipse_mean(&image, st, d0, d1);
            assert!(
                (actual - expected).abs() < 0.01,
                "{st:?} {d0:?} {d1:?}: {actual} is not {expected}"
            );
        }
    }
}

#[test]
fn ewa_limits_the_ratio_and_falls_back_to_bilinear() {
    let mip = MipMap::new(gradient(16, 16, 1), Wrap::Repeat);
    let st = Vec2::new(0.31, 0.72);
    let long = Vec2::new(0.5, 0.0);
    assert_eq!(
        mip.ewa::<f32>(st, long, Vec2::ZERO, 8.0),
        mip.bilinear::<f32>(0, st)
    );
    let thin = mip.ewa::<f32>(st, long, Vec2::new(0.0, 1e-4), 4.0);
    let lengthened = mip.ewa::<f32>(st, long, Vec2::new(0.0, 0.125), 4.0);
    assert!(
        (thin - lengthened).abs() < 1e-3 * lengthened,
        "{thin} {lengthened}"
    );
    let swapped = mip.ewa::<f32>(st, Vec2::new(0.0, 0.125), long, 4.0);
    assert_eq!(swapped, lengthened);
    let everything = mip.ewa::<f32>(st, Vec2::new(4.0, 0.0), Vec2::new(0.0, 4.0), 8.0);
    assert_eq!(everything, mip.texel::<f32>(mip.n_levels() - 1, 0, 0));
}

#[test]
fn look_ups_answer_to_any_input() {
    let extremes = [
        0.0,
        -1.0,
        1e-45,
        1e-20,
        1e-4,
        0.5,
        3.0,
        1e10,
        1e30,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
    ];
    let vectors = || {
        extremes
            .into_iter()
            .flat_map(|x| [Vec2::new(x, 0.25), Vec2::new(1e-3, -x)])
    };
    for wrap in [Wrap::Repeat, Wrap::Black, Wrap::Clamp] {
        for (width, height) in [(1, 1), (8, 1), (5, 16)] {
            let mip = MipMap::new(gradient(width, height, 3), wrap);
            for d0 in vectors() {
                for d1 in vectors() {
                    for ratio in [0.0, 8.0, 1e30, f32::NAN] {
                        let value = mip.ewa::<Rgb>(Vec2::new(0.4, 0.9), d0, d1, ratio);
                        assert!(value.is_finite(), "{d0} {d1} {ratio}: {value:?}");
                    }
                    let far = mip.trilinear_footprint::<Rgb>(d0, d1, d0);
                    let st_is_usable = d0.x.abs() < 1e4 && d0.y.abs() < 1e4;
                    assert!(far.is_finite() || !st_is_usable, "{d0} {d1}: {far:?}");
                }
            }
        }
    }
}

// --- Measures ----------------------------------------------------------------------------------------------------

#[test]
fn measures_have_their_defined_values() {
    let reference = grey(2, 2, &[1.0, 2.0, 3.0, 2.0]);
    let test = grey(2, 2, &[1.0, 2.5, 3.0, 1.0]);
    let compared = |test: &Image, reference: &Image| {
        Comparison::new(test, reference).expect("they have one shape")
    };
    let comparison = compared(&test, &reference);
    assert_eq!(comparison.test_mean, [1.875]);
    assert_eq!(comparison.mse, (0.25 + 1.0) / 4.0);
    let rel_mse = comparison.rel_mse;
    assert!((rel_mse - 1.25 / 4.04 / 4.0).abs() < 1e-12, "{rel_mse}");
    let doubled = |image: &Image| {
        Image::new(2, 2, 1, image.data().iter().map(|v| v * 2.0).collect()).unwrap()
    };
    assert_eq!(
        compared(&doubled(&test), &doubled(&reference)).rel_mse,
        rel_mse,
        "scale does not matter"
    );
    let black = grey(2, 2, &[0.0; 4]);
    assert_eq!(compared(&black, &black).rel_mse, 0.0);
    assert_eq!(compared(&test, &black).rel_mse, f64::INFINITY);
}

#[test]
fn images_of_different_shape_are_not_compared() {
    let error = Comparison::new(&gradient(2, 3, 1), &gradient(2, 3, 3)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the image has 2x3 pixels of 1 channels, the reference 2x3 pixels of 3 channels"
    );
    assert!(Comparison::new(&gradient(2, 3, 1), &gradient(3, 2, 1)).is_err());
}
