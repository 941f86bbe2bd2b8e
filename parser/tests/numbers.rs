//! Numbers against the standard library's correctly rounded parser, and against what C `strtof` is known to do.

use proptest::prelude::{ProptestConfig, any, prop_oneof};
use proptest::{prop_assert, prop_assert_eq, proptest};
use tyndall_parser::numbers::{Number, list, literal};

/// So many cases, or as many as `PROPTEST_CASES` says.
fn cases(cases: u32) -> ProptestConfig {
    let default = ProptestConfig::default();
    let cases = if std::env::var_os("PROPTEST_CASES").is_some() {
        default.cases
    } else {
        cases
    };
    ProptestConfig {
        cases,
        failure_persistence: None,
        ..default
    }
}

/// Text, and whether the value of it reads back with exactly these bits, on the long way and on the fast one.
#[track_caller]
fn check_f32(text: &str) {
    let expected: f32 = text.parse().unwrap();
    let found = literal(text.as_bytes()).unwrap_or_else(|| panic!("{text} is a number"));
    assert_eq!(found.used, text.len(), "{text}");
    assert_eq!(
        found.number.to_f32().to_bits(),
        expected.to_bits(),
        "{text}: {:?} for {expected:?}",
        found.number
    );
    let mut fast = Vec::new();
    list(format!("{text} ]").as_bytes(), |number| fast.push(number));
    assert!(fast.len() <= 1);
    for number in fast {
        assert_eq!(number, found.number, "{text}: the fast path differs");
    }
}

#[test]
fn hard_cases_are_correctly_rounded() {
    for text in [
        "0.0",
        "-0",
        "-0.0",
        "+1",
        ".5",
        "5.",
        "-.5e-1",
        "1e10",
        "1E+10",
        "1e-10",
        "1e-45",
        "7e-46",
        "7.1e-46",
        "1e-50",
        "3.4028235e38",
        "3.40282351e38",
        "3.4028236e38",
        "1e39",
        "1e400",
        "-1e400",
        "1e-400",
        "1.17549435e-38",
        "1.1754942e-38",
        "16777217.0",
        "16777219.0",
        "16777217.0000000000000000000000000000000000001",
        "8388608.5",
        "8388609.5",
        "8388608.500000001",
        "1.00000005960464477539062",
        "1.00000005960464477539062501",
        "1.000000059604644775390625",
        "0.1",
        "0.3333333333333333333",
        "123456789.123456789",
        "9007199254740993.0",
        "9007199254740992.0",
        "1e22",
        "1e23",
        "4503599627370497.5",
        "0.000000000000000000000000000000000000012345",
        "123456789012345678901234567890.5",
        "1234567.8",
        "-5e-51",
        "99999999999999999999e-20",
        "00000000000000000001.5",
        "0e999",
        "1e0000000001",
        "0.00000000000000000000e5",
        "9.5367431640625e-7",
        "6.103515625e-05",
        "33554433.0",
        "33554434.0",
        "33554435.0",
        "33554438.0",
        "33554442.0",
    ] {
        check_f32(text);
    }
}

#[test]
fn midpoints_of_neighbouring_floats_and_their_neighbourhood_are_correctly_rounded() {
    // Here a detour through double precision would round twice.
    for i in 0..20_000_u32 {
        let below = f32::from_bits(
            0x3f00_0000_u32.wrapping_add(i.wrapping_mul(0x0000_1f35)) & 0x4b7f_ffff | 0x3000_0000,
        );
        let above = f32::from_bits(below.to_bits() + 1);
        let midpoint = (f64::from(below) + f64::from(above)) / 2.0;
        check_f32(&format!("{midpoint:?}"));
        check_f32(&format!("{midpoint:.16}"));
        check_f32(&format!("{:?}", f64::from_bits(midpoint.to_bits() + 1)));
        check_f32(&format!("{:?}", f64::from_bits(midpoint.to_bits() - 1)));
    }
}

proptest! {
    #![proptest_config(cases(20_000))]

    #[test]
    fn any_float_reads_back_as_itself(bits in any::<u32>()) {
        let value = f32::from_bits(bits);
        if value.is_finite() {
            for text in [format!("{value}"), format!("{value:?}"), format!("{value:e}"), format!("{value:.20e}")] {
                check_f32(&if text.bytes().all(|byte| byte.is_ascii_digit()) { format!("{text}.0") } else { text });
            }
        }
    }

    #[test]
    fn any_decimal_is_correctly_rounded(text in r"[-+]?([0-9]{1,25}\.[0-9]{0,25}|\.[0-9]{1,20})([eE][-+]?[0-9]{1,3})?") {
        check_f32(&text);
    }

    #[test]
    fn short_decimals_are_correctly_rounded(text in r"-?[0-9]{0,9}\.[0-9]{1,9}(e-?[0-9]{1,2})?") {
        check_f32(&text);
    }

    #[test]
    fn decimals_near_midpoints_are_correctly_rounded(
        bits in 0x3000_0000..0x4b00_0000_u32, digits in 12..22_usize, nudge in -3..=3_i64,
    ) {
        let [below, above] = [bits, bits + 1].map(|bits| f64::from(f32::from_bits(bits)));
        let near = f64::from_bits(((below + above) / 2.0).to_bits().wrapping_add_signed(nudge));
        check_f32(&format!("{near:.digits$e}"));
        check_f32(&format!("{near:.digits$}"));
    }

    #[test]
    fn digits_alone_are_integers_that_saturate(text in "[0-9]{1,30}") {
        let expected = text.parse::<i64>().unwrap_or(i64::MAX);
        let found = literal(text.as_bytes()).unwrap();
        prop_assert_eq!((found.number, found.used), (Number::Integer(expected), text.len()));
    }

    #[test]
    fn lists_agree_with_single_numbers(
        words in proptest::collection::vec(
            prop_oneof!["[0-9]", "-?[0-9]{1,12}", r"-?[0-9]{0,4}\.[0-9]{1,8}", r"[0-9]\.[0-9]{3}e-?[0-9]{1,3}"], 0..50),
        gap in "[ \n\t\r]{1,5}",
    ) {
        let text = words.join(&gap) + "]";
        let mut found = Vec::new();
        let used = list(text.as_bytes(), |number| found.push(number));
        for (number, word) in found.iter().zip(&words) {
            prop_assert_eq!(*number, literal(word.as_bytes()).unwrap().number, "{}", word);
        }
        // It may stop early before a number that needs care, never inside one, and never behind the bracket.
        prop_assert!(found.len() <= words.len() && used < text.len());
        prop_assert!(found.len() < words.len() || text.as_bytes()[used] == b']');
    }

    #[test]
    fn no_bytes_upset_it(bytes in proptest::collection::vec(any::<u8>(), 0..40)) {
        if let Some(found) = literal(&bytes) {
            prop_assert!(found.used > 0 && found.used <= bytes.len());
        }
    }
}

#[track_caller]
fn check_prefix(text: &str, value: f32, used: usize) {
    let found = literal(text.as_bytes()).unwrap_or_else(|| panic!("{text} starts with a number"));
    let same = found.number.to_f32().to_bits() == value.to_bits()
        || (value.is_nan() && found.number.to_f32().is_nan());
    assert!(same, "{text}: {:?} for {value:?}", found.number);
    assert_eq!(found.used, used, "{text}");
}

#[test]
fn garbage_behind_a_number_is_left_over() {
    for (text, value, used) in [
        (".1a", 0.1, 2),
        (".2,5", 0.2, 2),
        ("3e-1#x", 0.3, 4),
        ("1,5", 1.0, 1),
        ("1.2.3", 1.2, 3),
        ("1e", 1.0, 1),
        ("1e+", 1.0, 1),
        ("1e+x", 1.0, 1),
        ("12\0", 12.0, 2),
        ("1-2", 1.0, 1),
        ("--1", 0.0, 0),
    ] {
        if used == 0 {
            assert_eq!(literal(text.as_bytes()), None, "{text}");
        } else {
            check_prefix(text, value, used);
        }
    }
}

#[test]
fn infinities_nans_and_hexadecimal_floats_are_those_of_strtof() {
    for (text, value, used) in [
        ("inf", f32::INFINITY, 3),
        ("-INFinity", f32::NEG_INFINITY, 9),
        ("infinit", f32::INFINITY, 3),
        ("nan", f32::NAN, 3),
        ("NaN(tag_1)", f32::NAN, 10),
        ("nan(", f32::NAN, 3),
        ("nano", f32::NAN, 3),
        ("0x10", 16.0, 4),
        ("0X1.8p3", 12.0, 7),
        ("-0x.8", -0.5, 5),
        ("0x1p-149", f32::from_bits(1), 8),
        ("0x1p-150", 0.0, 8),
        ("0x1.8p-150", f32::from_bits(1), 10),
        ("0x1p-9999999999999999999999", 0.0, 27),
        ("0x1p9999999999999999999999", f32::INFINITY, 26),
        ("0x1.ffffffp127", f32::INFINITY, 14),
        ("0x1.fffffep127", f32::MAX, 14),
        ("0x1000001", 16_777_216.0, 9),
        ("0x1000003", 16_777_220.0, 9),
        ("0x1000001.00000000000000000001", 16_777_218.0, 30),
        (
            "0x123456789abcdef0123456789",
            0x1_2345_6789_abcd_ef01_2345_6789_u128 as f32,
            27,
        ),
        ("0x", 0.0, 1),
        ("0xg", 0.0, 1),
        ("0x1p", 1.0, 3),
        ("0x1p+", 1.0, 3),
        ("\u{b}\u{c}7.5", 7.5, 5),
    ] {
        check_prefix(text, value, used);
    }
}

#[test]
fn words_without_a_numeric_prefix_are_no_numbers() {
    for text in [
        "", "a", "true", "foo", "-", "+", ".", "]", "-.", "e5", ".e5", "+-1", "in", "na", "-x",
        " 1", "\u{c}",
    ] {
        assert_eq!(literal(text.as_bytes()), None, "{text:?}");
    }
}

#[test]
fn integers_truncate_toward_zero_and_say_when_they_do_not_fit() {
    let integer = |text: &str| literal(text.as_bytes()).unwrap().number.to_i32();
    assert_eq!(integer("3.9"), Ok(3));
    assert_eq!(integer("-3.9"), Ok(-3));
    assert_eq!(integer("2147483647"), Ok(i32::MAX));
    assert_eq!(integer("2147483648"), Err(i32::MAX));
    assert_eq!(integer("-2147483648"), Ok(i32::MIN));
    assert_eq!(integer("-3e9"), Err(i32::MIN));
    assert_eq!(integer("nan"), Err(0));
}

#[test]
fn reals_are_single_precision_and_integers_are_not() {
    let double = |text: &str| literal(text.as_bytes()).unwrap().number.to_f64();
    assert_eq!(double("1234567.8"), 1_234_567.75);
    assert_eq!(double("16777217"), 16_777_217.0);
    assert_eq!(double("16777217."), 16_777_216.0);
    // pbrt-v3 goes through double precision here, and so rounds twice: 2^53 + 2^29 + 1 loses its 1 and then ties.
    let single = |text: &str| literal(text.as_bytes()).unwrap().number.to_f32();
    assert_eq!(single("9007199791611905"), 9_007_199_254_740_992.0);
    assert_eq!(single("9007199791611905.0"), 9_007_200_328_482_816.0);
}
