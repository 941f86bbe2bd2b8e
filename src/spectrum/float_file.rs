//! Text files of bare numbers: spectra (`.spd`) and lens descriptions.
//!
//! The format is loose, and published files rely on how loosely it is read, so the reading is fixed here: a number is a
//! run of digits and `. e + -` that starts with anything but `e`; the byte after it ends it and is consumed, whatever
//! it is; `#` opens a comment only where a number could start; a number that the end of the file cuts short is lost.

use std::fmt;

/// Longest number in bytes.
const MAX_NUMBER_LENGTH: usize = 31;

/// What a file holds, and what was odd about it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct FloatFile {
    /// The numbers in file order. Digits beyond the range of `f64` give infinities: check before use.
    pub values: Vec<f64>,
    /// Oddities, in file order; the values stand regardless.
    pub warnings: Vec<FloatFileWarning>,
}

/// An oddity and its line, counted from 1.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FloatFileWarning {
    /// A byte that is neither number, white space nor comment was skipped.
    UnexpectedByte {
        /// Line, counted from 1.
        line: usize,
        /// The byte.
        byte: u8,
    },
    /// The last number was dropped: nothing follows it, not even a line end.
    LastNumberLost {
        /// Line, counted from 1.
        line: usize,
    },
}

/// A number longer than 31 bytes. The maker of the file must shorten it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NumberTooLong {
    /// Line, counted from 1.
    pub line: usize,
}

impl fmt::Display for FloatFileWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnexpectedByte { line, byte } => {
                write!(
                    f,
                    "line {line}: \"{}\" is not part of a number; skipped",
                    byte.escape_ascii()
                )
            }
            Self::LastNumberLost { line } => {
                write!(
                    f,
                    "line {line}: the last number is dropped because no line end follows it"
                )
            }
        }
    }
}

impl fmt::Display for NumberTooLong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "line {}: a number is longer than {MAX_NUMBER_LENGTH} characters",
            self.line
        )
    }
}

impl std::error::Error for NumberTooLong {}

/// Reads the numbers of a file.
///
/// # Errors
/// A number of more than 31 bytes.
pub fn read(bytes: &[u8]) -> Result<FloatFile, NumberTooLong> {
    let mut file = FloatFile::default();
    let mut line = 1;
    let mut rest = bytes;
    while let Some((&byte, tail)) = rest.split_first() {
        if matches!(byte, b'0'..=b'9' | b'.' | b'+' | b'-') {
            let length = rest
                .iter()
                .position(|&b| !is_number_byte(b))
                .unwrap_or(rest.len());
            if length > MAX_NUMBER_LENGTH {
                return Err(NumberTooLong { line });
            }
            let (number, after) = rest.split_at(length);
            let Some((&terminator, tail)) = after.split_first() else {
                file.warnings
                    .push(FloatFileWarning::LastNumberLost { line });
                break;
            };
            file.values.push(leading_float(number));
            line += usize::from(terminator == b'\n');
            rest = tail;
        } else if byte == b'#' {
            let length = rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len());
            rest = &rest[length..];
        } else {
            if byte == b'\n' {
                line += 1;
            } else if !byte.is_ascii_whitespace() && byte != b'\x0b' {
                file.warnings
                    .push(FloatFileWarning::UnexpectedByte { line, byte });
            }
            rest = tail;
        }
    }
    Ok(file)
}

fn is_number_byte(byte: u8) -> bool {
    matches!(byte, b'0'..=b'9' | b'.' | b'e' | b'+' | b'-')
}

/// The longest prefix that is a number, as C's `atof` sees it; 0 when there is none.
fn leading_float(token: &[u8]) -> f64 {
    let digits_from = |start: usize| {
        token[start..]
            .iter()
            .take_while(|b| b.is_ascii_digit())
            .count()
    };
    let sign = usize::from(matches!(token.first(), Some(b'+' | b'-')));
    let mut end = sign + digits_from(sign);
    if token.get(end) == Some(&b'.') {
        end += 1;
        end += digits_from(end);
    }
    if token.get(end) == Some(&b'e') {
        let exponent = end + 1 + usize::from(matches!(token.get(end + 1), Some(b'+' | b'-')));
        if token.get(exponent).is_some_and(u8::is_ascii_digit) {
            end = exponent + digits_from(exponent);
        }
    }
    std::str::from_utf8(&token[..end])
        .ok()
        .and_then(|prefix| prefix.parse().ok())
        .unwrap_or(0.0)
}

/// Splits the numbers of a spectrum file into `(wavelength in nm, value)` pairs.
///
/// The second part is the wavelength that has no value when the count is odd: drop it with a warning.
pub fn pairs(values: &[f64]) -> (Vec<(f64, f64)>, Option<f64>) {
    let (pairs, rest) = values.as_chunks::<2>();
    (
        pairs.iter().map(|&[nm, value]| (nm, value)).collect(),
        rest.first().copied(),
    )
}
