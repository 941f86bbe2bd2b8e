//! Every number the scene format fixes for colours and spectra.

use tyndall::spectrum::float_file::{self, FloatFileWarning, NumberTooLong};
use tyndall::spectrum::sampled::{SampledSpectrum, SpectrumError};
use tyndall::spectrum::{Rgb, blackbody, cie, copper, xyz};

/// The format's tables are printed to five decimals.
const PRINTED: f32 = 1.0e-5;

fn assert_rgb(actual: Rgb, expected: [f32; 3], tolerance: f32) {
    let worst = (actual - Rgb::from_array(expected))
        .map(f32::abs)
        .max_component();
    assert!(worst <= tolerance, "{actual:?} is not {expected:?}");
}

#[test]
fn a_flat_spectrum_is_not_white() {
    let flat = SampledSpectrum::new(vec![(500.0, 1.0)]).unwrap();
    assert_rgb(flat.to_rgb(), [1.20233, 0.94622, 0.90734], PRINTED);
}

#[test]
fn xyz_of_ones_has_the_printed_rgb() {
    assert_rgb(
        xyz::rgb_from_xyz([1.0; 3]),
        [1.20479, 0.94829, 0.90892],
        PRINTED,
    );
}

fn xyz_from_rgb(rgb: Rgb) -> [f64; 3] {
    let [r, g, b] = rgb.to_array().map(f64::from);
    xyz::XYZ_FROM_RGB.map(|row| row[0] * r + row[1] * g + row[2] * b)
}

#[test]
fn the_two_matrices_undo_each_other() {
    for rgb in [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.2, 0.7, -0.1],
    ] {
        assert_rgb(
            xyz::rgb_from_xyz(xyz_from_rgb(Rgb::from_array(rgb))),
            rgb,
            3.0e-6,
        );
    }
}

#[test]
fn luminance_is_the_y_row() {
    let colour = Rgb::new(0.3, 5.0, 2.0);
    assert!((f64::from(colour.luminance()) - xyz_from_rgb(colour)[1]).abs() < 1e-6);
}

#[test]
fn blackbodies_match_the_printed_table() {
    let table = [
        (1500.0, [0.01111, 0.00148, -0.00022]),
        (2000.0, [0.12191, 0.03130, 0.00099]),
        (2700.0, [0.53349, 0.22157, 0.05290]),
        (3000.0, [0.73506, 0.35049, 0.11298]),
        (4000.0, [1.16520, 0.76155, 0.43977]),
        (5000.0, [1.19001, 0.94206, 0.74794]),
        (5500.0, [1.11849, 0.94909, 0.84311]),
        (6500.0, [0.92222, 0.86950, 0.91522]),
        (10000.0, [0.38594, 0.44029, 0.63353]),
    ];
    for (kelvin, rgb) in table {
        assert_rgb(blackbody::rgb(kelvin).unwrap(), rgb, PRINTED);
    }
}

#[test]
fn blackbodies_are_finite_at_any_positive_temperature() {
    for exponent in -300..=300 {
        let kelvin = 10f64.powi(exponent);
        assert!(blackbody::rgb(kelvin).unwrap().is_finite(), "{kelvin} K");
    }
}

#[test]
fn impossible_temperatures_are_errors() {
    for kelvin in [0.0, -0.0, -5000.0, f64::NAN, f64::INFINITY] {
        let error = blackbody::rgb(kelvin).unwrap_err();
        assert!(error.to_string().contains("above 0 K"), "{error}");
    }
}

#[test]
fn copper_matches_the_printed_defaults() {
    assert_rgb(copper::eta(), [0.19999, 0.92209, 1.09988], PRINTED);
    assert_rgb(copper::k(), [3.90464, 2.44763, 2.13765], PRINTED);
}

#[test]
fn the_observer_peaks_at_555_nm_and_sums_to_its_integral() {
    assert_eq!(cie::MATCHING[555 - cie::FIRST_NM][1], 1.0);
    let sum: f64 = cie::MATCHING.iter().map(|row| row[1]).sum();
    assert!((sum - cie::Y_INTEGRAL).abs() < 3e-5, "{sum}");
}

#[test]
fn samples_are_sorted_interpolated_and_held_at_the_ends() {
    let spectrum = SampledSpectrum::new(vec![(600.0, 3.0), (400.0, 1.0), (500.0, 5.0)]).unwrap();
    let expected = [
        (300.0, 1.0),
        (400.0, 1.0),
        (450.0, 3.0),
        (500.0, 5.0),
        (575.0, 3.5),
        (600.0, 3.0),
        (900.0, 3.0),
    ];
    for (nm, value) in expected {
        assert_eq!(spectrum.at(nm), value, "at {nm} nm");
    }
}

#[test]
fn tables_that_are_no_spectra_are_errors() {
    assert_eq!(SampledSpectrum::new(vec![]), Err(SpectrumError::Empty));
    let twice = vec![(500.0, 1.0), (400.0, 2.0), (500.0, 1.0)];
    assert_eq!(
        SampledSpectrum::new(twice),
        Err(SpectrumError::DuplicateWavelength(500.0))
    );
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(
            SampledSpectrum::new(vec![(400.0, 1.0), (500.0, bad)]),
            Err(SpectrumError::NonFinite(1))
        );
        assert_eq!(
            SampledSpectrum::new(vec![(bad, 1.0)]),
            Err(SpectrumError::NonFinite(0))
        );
    }
}

#[test]
fn float_files_keep_their_loose_grammar() {
    let cases: [(&str, &[f64]); 9] = [
        ("400 1.5\n500 2\n", &[400.0, 1.5, 500.0, 2.0]),
        (
            "# comment 1 2\n400,.5;+3 -4e-2\n",
            &[400.0, 0.5, 3.0, -0.04],
        ),
        ("400 1#2\n", &[400.0, 1.0, 2.0]),
        ("1E3 ", &[1.0, 3.0]),
        ("1-2 ", &[1.0]),
        ("1.2.3 ", &[1.2]),
        ("4e 5e+ 6e+2 ", &[4.0, 5.0, 600.0]),
        ("+ - . ", &[0.0, 0.0, 0.0]),
        ("", &[]),
    ];
    for (text, values) in cases {
        assert_eq!(
            float_file::read(text.as_bytes()).unwrap().values,
            values,
            "{text:?}"
        );
    }
}

#[test]
fn the_last_number_is_lost_without_a_line_end() {
    let file = float_file::read(b"400 1\n500 2").unwrap();
    assert_eq!(file.values, [400.0, 1.0, 500.0]);
    assert_eq!(
        file.warnings,
        [FloatFileWarning::LastNumberLost { line: 2 }]
    );
    let (pairs, dangling) = float_file::pairs(&file.values);
    assert_eq!((pairs, dangling), (vec![(400.0, 1.0)], Some(500.0)));
}

#[test]
fn bytes_that_are_no_numbers_are_reported_with_their_line() {
    let file = float_file::read(b"1\n2 x\n\xff").unwrap();
    assert_eq!(file.values, [1.0, 2.0]);
    let odd = |line, byte| FloatFileWarning::UnexpectedByte { line, byte };
    assert_eq!(file.warnings, [odd(2, b'x'), odd(3, 0xff)]);
}

#[test]
fn over_long_numbers_are_errors() {
    let fits = format!("{}\n", "1".repeat(31));
    assert_eq!(float_file::read(fits.as_bytes()).unwrap().values.len(), 1);
    let long = format!("7\n{}\n", "1".repeat(32));
    assert_eq!(
        float_file::read(long.as_bytes()),
        Err(NumberTooLong { line: 2 })
    );
}

#[test]
fn colours_compute_channel_by_channel() {
    let a = Rgb::new(1.0, 2.0, 4.0);
    let b = Rgb::new(2.0, 0.5, -1.0);
    assert_eq!(a + b, Rgb::new(3.0, 2.5, 3.0));
    assert_eq!(a - b, Rgb::new(-1.0, 1.5, 5.0));
    assert_eq!(a * b, Rgb::new(2.0, 1.0, -4.0));
    assert_eq!(a / b, Rgb::new(0.5, 4.0, -4.0));
    assert_eq!(2.0 * a / 4.0, Rgb::new(0.5, 1.0, 2.0));
    let mut c = a;
    c += b;
    c -= 1.0;
    c *= b;
    c /= 0.5;
    assert_eq!(c, Rgb::new(8.0, 1.5, -4.0));
    assert_eq!([a, b, -b].into_iter().sum::<Rgb>(), a);
    assert_eq!(
        (b.min_component(), b.max_component(), b.mean()),
        (-1.0, 2.0, 0.5)
    );
    assert_eq!(
        (b.clamp_negative(), b.clamp(0.0, 1.0)),
        (Rgb::new(2.0, 0.5, 0.0), Rgb::new(1.0, 0.5, 0.0))
    );
    assert_eq!((a.lerp(b, 0.0), a.lerp(b, 1.0)), (a, b));
    assert!(b.has_negative() && !a.has_negative() && !a.is_black() && Rgb::BLACK.is_black());
    assert!(
        a.is_finite()
            && !Rgb::new(0.0, f32::NAN, 0.0).is_finite()
            && !Rgb::splat(f32::INFINITY).is_finite()
    );
    assert_eq!(std::mem::size_of::<Rgb>(), 16);
}

#[test]
fn exp_neg_is_a_transmittance() {
    let tr = Rgb::new(0.0, 1.0, 80.0).exp_neg();
    assert_rgb(tr, [1.0, (-1f32).exp(), (-80f32).exp()], 1e-7);
    assert!(tr.b() > 0.0 && Rgb::splat(f32::INFINITY).exp_neg().is_black());
}
