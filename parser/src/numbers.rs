//! Numbers: the literals of pbrt-v3, and a fast path for long lists of them.
//!
//! The rule of pbrt-v3 (`parseNumber` in `core/parser.cpp`): a literal of nothing but digits is a C `long`, anything
//! else goes through C `strtof`, whatever follows the longest numeric prefix is ignored, and no prefix is fatal.
//! So non-integers are *single* precision before anything is done with them.

/// A number as the file gives it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Number {
    /// A literal of digits only; saturated at the largest value.
    Integer(i64),
    /// Any other literal, correctly rounded to single precision.
    Real(f32),
}

/// A number at the start of a word, and how many bytes of the word belong to it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Literal {
    /// Its value.
    pub number: Number,
    /// Bytes used; less than the length of the word when garbage trails.
    pub used: usize,
}

impl Number {
    /// The value in single precision. Integers take the way of pbrt-v3 through double precision.
    #[inline]
    pub fn to_f32(self) -> f32 {
        match self {
            Self::Integer(n) => n as f64 as f32,
            Self::Real(x) => x,
        }
    }

    /// The value in double precision: exact for reals, nearest for integers beyond 2⁵³.
    #[inline]
    pub fn to_f64(self) -> f64 {
        match self {
            Self::Integer(n) => n as f64,
            Self::Real(x) => f64::from(x),
        }
    }

    /// The value truncated toward zero; `Err` with the nearest `i32` (0 for NaN) when it does not fit.
    #[inline]
    pub fn to_i32(self) -> Result<i32, i32> {
        match self {
            Self::Integer(n) => i32::try_from(n).map_err(|_| i32::MAX),
            // 2³¹ is a float, i32::MAX is not: the bounds below are exact.
            Self::Real(x) if (-2_147_483_648.0..2_147_483_648.0).contains(&x) => Ok(x as i32),
            Self::Real(x) => Err(x as i32),
        }
    }
}

/// Whether a byte ends a word: white space, a quote or a bracket. `#` does not.
#[inline]
pub fn is_delimiter(byte: u8) -> bool {
    is_space(byte) || matches!(byte, b'"' | b'[' | b']')
}

/// Whether a byte is white space: space, TAB, LF or CR, nothing else.
#[inline]
pub fn is_space(byte: u8) -> bool {
    matches!(byte, b' ' | b'\n' | b'\t' | b'\r')
}

/// Reads the number at the start of a word; `None` when it does not start with one.
///
/// Everything C `strtof` takes is taken: signs, missing integer or fraction part, `inf`, `nan`, hexadecimal floats.
pub fn literal(word: &[u8]) -> Option<Literal> {
    if let [byte] = word {
        // pbrt-v3 rejects any other lone byte.
        return byte.is_ascii_digit().then(|| Literal {
            number: Number::Integer(i64::from(byte - b'0')),
            used: 1,
        });
    }
    if let Some((number, used)) = plain(word).filter(|&(_, used)| used == word.len()) {
        return Some(Literal { number, used });
    }
    if word.iter().all(u8::is_ascii_digit) && !word.is_empty() {
        let digits = word.iter().map(|byte| i64::from(byte - b'0'));
        let number = Number::Integer(
            digits.fold(0_i64, |n, digit| n.saturating_mul(10).saturating_add(digit)),
        );
        return Some(Literal {
            number,
            used: word.len(),
        });
    }
    strtof(word).map(|(value, used)| Literal {
        number: Number::Real(value),
        used,
    })
}

/// C `strtof` in the C locale: the value and the number of bytes it took.
fn strtof(word: &[u8]) -> Option<(f32, usize)> {
    // strtof skips white space; vertical tab and form feed are the two kinds that do not end a word.
    let blanks = word
        .iter()
        .take_while(|&&byte| byte == 0x0b || byte == 0x0c)
        .count();
    let sign = usize::from(matches!(word.get(blanks), Some(b'+' | b'-')));
    let body = &word[blanks + sign..];
    let (magnitude, used) = hexadecimal(body)
        .or_else(|| not_a_number(body))
        .or_else(|| {
            // A second sign must not pass.
            let first = body.first().filter(|byte| !matches!(byte, b'+' | b'-'));
            first.and_then(|_| fast_float2::parse_partial::<f32, _>(body).ok())
        })?;
    let negative = word.get(blanks) == Some(&b'-');
    Some((
        if negative { -magnitude } else { magnitude },
        blanks + sign + used,
    ))
}

/// `nan` in any case, with an optional `(word)` of letters, digits and underscores behind it.
fn not_a_number(body: &[u8]) -> Option<(f32, usize)> {
    let rest = body
        .get(3..)
        .filter(|_| body[..3].eq_ignore_ascii_case(b"nan"))?;
    let tag = rest.strip_prefix(b"(").and_then(|tag| {
        let length = tag
            .iter()
            .take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_')
            .count();
        (tag.get(length) == Some(&b')')).then_some(length + 2)
    });
    Some((f32::NAN, 3 + tag.unwrap_or(0)))
}

/// A hexadecimal float such as `0x1.8p3`, rounded to nearest even.
fn hexadecimal(body: &[u8]) -> Option<(f32, usize)> {
    let digits = body
        .strip_prefix(b"0x")
        .or_else(|| body.strip_prefix(b"0X"))?;
    let mut mantissa = 0_u64;
    // Power of two to multiply the mantissa with.
    let mut exponent = 0_i64;
    let mut n_digits = 0;
    let mut at = 0;
    let mut behind_point = false;
    loop {
        match digits.get(at) {
            Some(b'.') if !behind_point => behind_point = true,
            Some(&byte) if byte.is_ascii_hexdigit() => {
                let digit = (byte as char).to_digit(16).map_or(0, u64::from);
                n_digits += 1;
                if mantissa >> 56 == 0 {
                    mantissa = mantissa << 4 | digit;
                    exponent -= 4 * i64::from(behind_point);
                } else {
                    // Beyond 56 bits only "is there anything left" matters: keep it in the lowest bit.
                    mantissa |= u64::from(digit != 0);
                    exponent += 4 * i64::from(!behind_point);
                }
            }
            _ => break,
        }
        at += 1;
    }
    if n_digits == 0 {
        // Only the zero of "0x" is a number.
        return Some((0.0, 1));
    }
    if let Some((power, used)) = binary_exponent(&digits[at..]) {
        exponent = exponent.saturating_add(power);
        at += used;
    }
    Some((scaled(mantissa, exponent), 2 + at))
}

/// `p` and a decimal exponent, saturated far outside the range of any float.
fn binary_exponent(text: &[u8]) -> Option<(i64, usize)> {
    let rest = text
        .strip_prefix(b"p")
        .or_else(|| text.strip_prefix(b"P"))?;
    let sign = usize::from(matches!(rest.first(), Some(b'+' | b'-')));
    let n_digits = rest[sign..]
        .iter()
        .take_while(|byte| byte.is_ascii_digit())
        .count();
    let digits = rest[sign..sign + n_digits].iter();
    let power = digits.fold(0_i64, |n, byte| {
        (n * 10 + i64::from(byte - b'0')).min(1 << 40)
    });
    let power = if rest.first() == Some(&b'-') {
        -power
    } else {
        power
    };
    (n_digits > 0).then_some((power, 1 + sign + n_digits))
}

/// `mantissa · 2^exponent` to the nearest float, ties to even.
fn scaled(mantissa: u64, exponent: i64) -> f32 {
    if mantissa == 0 {
        return 0.0;
    }
    let bits = 64 - i64::from(mantissa.leading_zeros());
    // Weight of the last place: 24 bits of precision, and never below 2⁻¹⁴⁹, where subnormals end.
    let last_place = (exponent + bits - 24).max(-149);
    let drop = last_place - exponent;
    let kept = if drop <= 0 {
        mantissa << -drop
    } else if drop > 64 {
        0
    } else {
        let wide = u128::from(mantissa);
        let half = 1_u128 << (drop - 1);
        let (quotient, remainder) = (wide >> drop, wide & ((1_u128 << drop) - 1));
        let up = remainder > half || (remainder == half && quotient & 1 == 1);
        quotient as u64 + u64::from(up)
    };
    // kept ≤ 2²⁴, so the product is exact unless it overflows to infinity, as it should.
    let power = last_place.clamp(-149, 1000) as i32;
    (kept as f64 * 2_f64.powi(power)) as f32
}

/// Reads plain decimal numbers separated by white space, and hands each to `push`; returns the bytes read.
///
/// It stops, without harm, before anything else: brackets, quotes, comments, and numbers whose rounding or spelling
/// needs more care. The caller reads one token the long way and comes back.
#[inline]
pub fn list(text: &[u8], mut push: impl FnMut(Number)) -> usize {
    let mut at = 0;
    while let Some((number, used)) = next(&text[at..]) {
        push(number);
        at += used;
    }
    at
}

/// Reads white space and one plain decimal number; with the bytes read. `None` where [`list`] would stop.
#[inline(always)] // one loop for each kind of vector; a call for each number costs a tenth
pub fn next(text: &[u8]) -> Option<(Number, usize)> {
    let mut blanks = 0;
    while blanks < text.len() && is_space(text[blanks]) {
        blanks += 1;
    }
    plain(&text[blanks..]).map(|(number, used)| (number, blanks + used))
}

/// Powers of ten that are exact in double precision.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// The plain decimal number, complete with its end, that the text starts with.
///
/// `None` when there is none, or when it is not certain that the result is correctly rounded.
#[inline(always)]
fn plain(text: &[u8]) -> Option<(Number, usize)> {
    // Half of a density grid is "0 ".
    if let [digit @ b'0'..=b'9', end, ..] = text
        && is_space(*end)
    {
        return Some((Number::Integer(i64::from(digit - b'0')), 1));
    }
    let negative = text.first() == Some(&b'-');
    let mut at = usize::from(negative);
    let mut mantissa = 0_u64;
    let mut n_digits = digits(text, &mut at, &mut mantissa);
    let mut exponent = 0_i32;
    let mut integer = !negative;
    if text.get(at) == Some(&b'.') {
        at += 1;
        let n_fraction = digits(text, &mut at, &mut mantissa);
        exponent -= n_fraction as i32;
        n_digits += n_fraction;
        integer = false;
    }
    // Nineteen digits never overflow 64 bits; the counts are small enough for every cast here.
    if n_digits == 0 || n_digits > 19 {
        return None;
    }
    if let Some(b'e' | b'E') = text.get(at) {
        exponent += decimal_exponent(text, &mut at)?;
        integer = false;
    }
    if text.get(at).is_some_and(|&byte| !is_delimiter(byte)) {
        return None;
    }
    if integer {
        return i64::try_from(mantissa)
            .ok()
            .map(|n| (Number::Integer(n), at));
    }
    let magnitude = rounded(mantissa, exponent)?;
    Some((
        Number::Real(if negative { -magnitude } else { magnitude }),
        at,
    ))
}

/// `mantissa · 10^exponent` to the nearest float, when that can be had from one operation in double precision.
///
/// Up to 2⁵³ both operands are exact, so the double is correctly rounded; beyond, the mantissa is rounded, too, and the
/// double is less than three units in the last place off. Every midpoint of two floats is a double and rounding is
/// monotone, so rounding once more to single precision can go wrong only when the double is a midpoint, or that near to
/// one; then the long way decides. The result is never subnormal: it is zero or at least 10⁻²².
#[inline(always)]
fn rounded(mantissa: u64, exponent: i32) -> Option<f32> {
    let power = *POWERS.get(exponent.unsigned_abs() as usize)?;
    let value = if exponent < 0 {
        mantissa as f64 / power
    } else {
        mantissa as f64 * power
    };
    // The 29 bits that a double has more than a float.
    let below_float = value.to_bits() & 0x1fff_ffff;
    let doubt = if mantissa <= 1 << 53 { 0 } else { 3 };
    (below_float.abs_diff(0x1000_0000) > doubt).then_some(value as f32)
}

/// Appends a run of decimal digits to `mantissa`, which wraps; moves `at` behind it and returns its length.
#[inline(always)]
fn digits(text: &[u8], at: &mut usize, mantissa: &mut u64) -> usize {
    const TENS: [u64; 9] = [
        1,
        10,
        100,
        1_000,
        10_000,
        100_000,
        1_000_000,
        10_000_000,
        100_000_000,
    ];
    let start = *at;
    // Eight bytes at a time, whatever the number of digits among them: no branch depends on it.
    while let Some(&chunk) = text.get(*at..).and_then(<[u8]>::first_chunk::<8>) {
        // Each byte becomes its digit's value. Adding 0x76 sets the top bit of a byte that is 10 or more; a carry out
        // of a byte above 0x89 can only reach bytes behind the first that is no digit.
        let values = u64::from_le_bytes(chunk) ^ 0x3030_3030_3030_3030;
        let others = (values.wrapping_add(0x7676_7676_7676_7676) | values) & 0x8080_8080_8080_8080;
        let n = others.trailing_zeros() as usize / 8;
        if n == 0 {
            return *at - start;
        }
        *mantissa = mantissa
            .wrapping_mul(TENS[n])
            .wrapping_add(eight_digits(values << (64 - 8 * n)));
        *at += n;
        if n < 8 {
            return *at - start;
        }
    }
    while let Some(digit @ b'0'..=b'9') = text.get(*at) {
        *mantissa = mantissa
            .wrapping_mul(10)
            .wrapping_add(u64::from(digit - b'0'));
        *at += 1;
    }
    *at - start
}

/// The number that eight digit values spell, first digit in the lowest byte: neighbours are joined to pairs, pairs to
/// fours, fours to eight (D. Lemire, "Quickly parsing eight digits", 2018).
#[inline(always)]
fn eight_digits(values: u64) -> u64 {
    let pairs = (values.wrapping_mul(10).wrapping_add(values >> 8)) & 0x00ff_00ff_00ff_00ff;
    let fours = (pairs.wrapping_mul(100).wrapping_add(pairs >> 16)) & 0x0000_ffff_0000_ffff;
    (fours.wrapping_mul(10_000).wrapping_add(fours >> 32)) & 0xffff_ffff
}

/// The exponent behind `e`, of at most three digits; moves `at` behind it.
#[inline]
fn decimal_exponent(text: &[u8], at: &mut usize) -> Option<i32> {
    let mut end = *at + 1;
    let negative = text.get(end) == Some(&b'-');
    if let Some(b'+' | b'-') = text.get(end) {
        end += 1;
    }
    let start = end;
    let mut value = 0;
    while let Some(digit @ b'0'..=b'9') = text.get(end).filter(|_| end - start < 4) {
        value = value * 10 + i32::from(digit - b'0');
        end += 1;
    }
    *at = end;
    (1..=3)
        .contains(&(end - start))
        .then_some(if negative { -value } else { value })
}
