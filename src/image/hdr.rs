//! Headers of Radiance HDR files as other programs write them, made what the decoder knows.

use crate::image::ImageError;

/// Most bytes of a header: a file without an end of it is not searched to its last byte.
const LONGEST_HEADER: usize = 1 << 16;

/// The same file with the signature `#?RADIANCE` and lines that end in LF. The signature may be another one (`#?RGBE`)
/// or none at all, lines may end in LF, CR LF or CR, and the blank line before the resolution may be missing.
pub(super) fn normalised(bytes: &[u8]) -> Result<Vec<u8>, ImageError> {
    let mut header = b"#?RADIANCE\n".to_vec();
    let mut rest = &bytes[..bytes.len().min(LONGEST_HEADER)];
    while let Some(end) = rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')) {
        let line = rest[..end].trim_ascii();
        rest = &rest[end..];
        let is_resolution = matches!(line, [b'-' | b'+', b'X' | b'Y', b' ', ..]);
        rest = match rest {
            // Samples may begin with a line feed: a resolution ends as the lines before it have ended.
            [b'\r', b'\n', after @ ..] if !is_resolution || ends_in_crlf(bytes) => after,
            _ => &rest[1..],
        };
        if is_resolution {
            header.push(b'\n');
            header.extend_from_slice(line);
            header.push(b'\n');
            let n_read = bytes.len().min(LONGEST_HEADER) - rest.len();
            header.extend_from_slice(&bytes[n_read..]);
            return Ok(header);
        }
        // Remarks say nothing, and a line without `=` is no fact.
        if !line.starts_with(b"#") && line.contains(&b'=') {
            header.extend_from_slice(line);
            header.push(b'\n');
        }
    }
    Err(ImageError::Invalid(
        "a Radiance file has a line with its resolution, as in \"-Y 512 +X 1024\"".into(),
    ))
}

/// Whether the first line ends in CR LF.
fn ends_in_crlf(bytes: &[u8]) -> bool {
    let end = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r'));
    end.is_some_and(|end| bytes[end..].starts_with(b"\r\n"))
}
