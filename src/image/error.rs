//! Why pixels could not be read or written.

use std::fmt;

/// Told apart by who has to act. Texts are one sentence without a full stop and name no file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ImageError {
    /// The bytes, or the arguments, contradict the format: whoever made them must mend them.
    Invalid(String),
    /// Sound, but outside what this program reads or writes: convert, or choose another format.
    Unsupported(String),
    /// The file claims more pixels than its bytes can hold, or the format has room for: check the file, or split it.
    TooLarge(String),
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Invalid(text) | Self::Unsupported(text) | Self::TooLarge(text)) = self;
        f.write_str(text)
    }
}

impl std::error::Error for ImageError {}
