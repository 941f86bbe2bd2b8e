//! `.bsdf` files: tables in the format `SCATFUN`, version 1 (Jakob et al. 2014), little-endian.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | `SCATFUN`, 1 |
//! | 4 | flags: 1 for a BSDF |
//! | 4, 4, 4, 4, 4 | n nodes, coefficients, longest series, channels (1 or 3), bases (1) |
//! | 12 | sizes of what is not read |
//! | 4 | relative index of refraction (f32) |
//! | 16 | not read |
//! | 4 n | cosines of the nodes (f32) |
//! | 4 n² | running integrals, not read: ours are made from the coefficients |
//! | 8 n² | first coefficient and length of each series, by μo, then by μi |
//! | 4 × coefficients | coefficients (f32), those of a series by channel |

use std::fmt;

use crate::scatter::fourier::density::Density;
use crate::scatter::fourier::{FourierTable, Series};

const MAGIC: &[u8; 8] = b"SCATFUN\x01";
const HEADER_LENGTH: usize = 64;

/// Told apart by who has to act. Texts are one sentence without a full stop and name no file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum FourierFileError {
    /// The bytes contradict the format: whoever made them must mend them.
    Invalid(String),
    /// Sound, but outside what this program reads: another table is needed.
    Unsupported(String),
}

impl fmt::Display for FourierFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Invalid(text) | Self::Unsupported(text)) = self;
        f.write_str(text)
    }
}

impl std::error::Error for FourierFileError {}

fn invalid<T>(text: impl Into<String>) -> Result<T, FourierFileError> {
    Err(FourierFileError::Invalid(text.into()))
}

/// Reads a table. Time and memory are bounded by the length of the file.
///
/// # Errors
/// Not a table, a kind of table that is not read, one that is cut short or contradicts itself, numbers that are not
/// finite.
pub fn decode(bytes: &[u8]) -> Result<FourierTable, FourierFileError> {
    let Some((header, body)) = bytes.split_at_checked(HEADER_LENGTH) else {
        return invalid("the file is shorter than its header");
    };
    if !header.starts_with(MAGIC) {
        return invalid("it is not a BSDF table: it does not start with \"SCATFUN\", version 1");
    }
    let word = |k: usize| word_at(header, 8 + 4 * k);
    let [flags, n_nodes, n_coefficients, longest, n_channels, n_bases] =
        [0, 1, 2, 3, 4, 5].map(|k| word(k) as i32);
    let unsupported = |text: String| Err(FourierFileError::Unsupported(text));
    if flags != 1 {
        return unsupported(format!(
            "its flags are {flags}; only plain BSDFs, 1, are read"
        ));
    }
    if n_channels != 1 && n_channels != 3 {
        return unsupported(format!("it has {n_channels} channels; 1 or 3 are read"));
    }
    if n_bases != 1 {
        return unsupported(format!("it has {n_bases} bases; only 1 is read"));
    }
    let eta = f32::from_bits(word(9));
    if !(eta > 0.0 && eta.is_finite()) {
        return invalid(format!("its index of refraction is {eta}"));
    }
    let (Ok(n), Ok(n_coefficients)) = (usize::try_from(n_nodes), usize::try_from(n_coefficients))
    else {
        return invalid("a number of nodes or coefficients is negative");
    };
    if n < 2 {
        return invalid(format!("it has {n} nodes; two are the least"));
    }
    // Wide enough for any two counts.
    let (n_wide, coefficients_wide) = (n as u128, n_coefficients as u128);
    let needed = 4 * (n_wide + 3 * n_wide * n_wide + coefficients_wide);
    if (body.len() as u128) < needed {
        return invalid(format!(
            "{} bytes follow the header, but {n} nodes and {n_coefficients} coefficients need {needed}",
            body.len()
        ));
    }
    let (mu, rest) = body.split_at(4 * n);
    let (integrals, rest) = rest.split_at(4 * n * n);
    let (places, rest) = rest.split_at(8 * n * n);
    let mu = floats(mu);
    let coefficients = floats(&rest[..4 * n_coefficients]);
    check_nodes(&mu)?;
    if let Some(k) = coefficients.iter().position(|a| !a.is_finite()) {
        return invalid(format!("coefficient {k} is {}", coefficients[k]));
    }
    let n_channels = n_channels as usize;
    let series = series(places, n_channels, i64::from(longest), n_coefficients)?;
    let integrals = floats(integrals);
    let masses = integrals.chunks_exact(n).map(|row| row[n - 1]).collect();
    let density = Density::new(&mu, &series, &coefficients);
    Ok(FourierTable {
        mu,
        n_channels,
        eta,
        series,
        masses,
        coefficients,
        density,
    })
}

fn check_nodes(mu: &[f32]) -> Result<(), FourierFileError> {
    if let Some(k) = mu.iter().position(|mu| !(mu.abs() <= 1.0)) {
        return invalid(format!("the cosine of node {k} is {}", mu[k]));
    }
    if mu.windows(2).any(|pair| pair[0] > pair[1]) || mu[mu.len() - 2] == mu[mu.len() - 1] {
        return invalid("the cosines of its nodes do not ascend");
    }
    Ok(())
}

/// Where the series are, each within the coefficients and none longer than `longest`.
fn series(
    places: &[u8],
    n_channels: usize,
    longest: i64,
    n_coefficients: usize,
) -> Result<Vec<Series>, FourierFileError> {
    let mut total = 0;
    let mut series = Vec::with_capacity(places.len() / 8);
    for (k, place) in places.chunks_exact(8).enumerate() {
        let (start, len) = (word_at(place, 0) as i32, word_at(place, 4) as i32);
        let fits = len == 0
            || (start >= 0
                && len > 0
                && i64::from(len) <= longest
                && start as u64 + len as u64 * n_channels as u64 <= n_coefficients as u64);
        if !fits {
            return invalid(format!(
                "series {k}, {len} coefficients from number {start} on, is out of bounds"
            ));
        }
        let len = len as usize;
        total += len as u64 * n_channels as u64;
        series.push(Series {
            start: if len > 0 { start as usize } else { 0 },
            len,
        });
    }
    // Shared coefficients would let a small file ask for any amount of work.
    if total > n_coefficients as u64 {
        return invalid("its series overlap");
    }
    Ok(series)
}

fn word_at(bytes: &[u8], at: usize) -> u32 {
    let mut word = [0; 4];
    word.copy_from_slice(&bytes[at..at + 4]);
    u32::from_le_bytes(word)
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    let words = bytes.chunks_exact(4);
    words.map(|word| f32::from_bits(word_at(word, 0))).collect()
}
