//! Portable float maps: a text header and raw floats, bottom row first.
//!
//! Format: `PF` (RGB) or `Pf` (grey), width, height, scale, one white-space byte or a line end of two, samples. A
//! negative scale means little-endian; its magnitude multiplies the samples.

use crate::image::codec::DecodeOptions;
use crate::image::{Image, ImageError, sample_count};

/// Decodes a file.
pub(super) fn decode(bytes: &[u8], options: &DecodeOptions) -> Result<Image, ImageError> {
    let mut rest = bytes;
    let channels = match next_word(&mut rest)? {
        "PF" => 3,
        "Pf" => 1,
        other => {
            return Err(invalid(format!(
                "a PFM file starts with PF or Pf, not \"{}\"",
                other.escape_debug()
            )));
        }
    };
    let width = next_side(&mut rest)?;
    let height = next_side(&mut rest)?;
    let word = next_word(&mut rest)?;
    let scale = match word.parse::<f32>() {
        Ok(scale) if scale.is_finite() && scale != 0.0 => scale,
        _ => {
            return Err(invalid(format!(
                "the scale of a PFM file is a number other than 0, not \"{word}\""
            )));
        }
    };
    let n_bytes = sample_count(width, height, channels).and_then(|count| count.checked_mul(4));
    let samples = behind_line_end(bytes, rest, n_bytes);
    let samples = match n_bytes {
        Some(count) if samples.len() == count => samples,
        _ => {
            let n_bytes = n_bytes.map_or("more".to_owned(), |count| count.to_string());
            return Err(invalid(format!(
                "{width}x{height} pixels with {channels} channels take {n_bytes} bytes, but {} follow the header",
                samples.len()
            )));
        }
    };
    options.fits(width, height, channels)?;
    let from_bytes = if scale < 0.0 {
        f32::from_le_bytes
    } else {
        f32::from_be_bytes
    };
    let data = samples
        .as_chunks::<4>()
        .0
        .iter()
        .map(|&sample| from_bytes(sample) * scale.abs())
        .collect();
    let mut image = Image::new(width, height, channels, data)?;
    image.flip_vertical();
    Ok(image)
}

/// Encodes little-endian with scale 1.
pub(super) fn encode(image: &Image) -> Vec<u8> {
    let magic = if image.channels() == 3 { "PF" } else { "Pf" };
    let mut bytes = format!("{magic}\n{} {}\n-1\n", image.width(), image.height()).into_bytes();
    bytes.reserve_exact(image.data().len() * 4);
    for row in image.rows().rev() {
        bytes.extend(row.iter().flat_map(|sample| sample.to_le_bytes()));
    }
    bytes
}

/// What follows the header, of which `rest` is all but its first white space. A line feed behind a carriage return is
/// part of the line end where lines before it end so, and where the length of the file says so; otherwise it is the
/// first byte of the samples.
fn behind_line_end<'a>(bytes: &[u8], rest: &'a [u8], n_bytes: Option<usize>) -> &'a [u8] {
    let header = &bytes[..bytes.len() - rest.len()];
    let (Some(before), Some(after)) = (header.strip_suffix(b"\r"), rest.strip_prefix(b"\n")) else {
        return rest;
    };
    let is_split = before.windows(2).any(|pair| pair == b"\r\n") || n_bytes == Some(after.len());
    if is_split { after } else { rest }
}

/// Takes a word and the one white-space byte after it.
fn next_word<'a>(rest: &mut &'a [u8]) -> Result<&'a str, ImageError> {
    let trimmed = rest.trim_ascii_start();
    let end = trimmed.iter().position(u8::is_ascii_whitespace);
    let end = end.ok_or_else(|| invalid("the PFM header is not complete".into()))?;
    *rest = &trimmed[end + 1..];
    std::str::from_utf8(&trimmed[..end]).map_err(|_| invalid("the PFM header is not text".into()))
}

fn next_side(rest: &mut &[u8]) -> Result<usize, ImageError> {
    let word = next_word(rest)?;
    let side = word.parse().ok().filter(|&side: &usize| side > 0);
    side.ok_or_else(|| {
        invalid(format!(
            "width and height of a PFM file are positive numbers, not \"{word}\""
        ))
    })
}

fn invalid(text: String) -> ImageError {
    ImageError::Invalid(text)
}
