//! The files a scene names, behind a trait: compiling touches no file system itself.

use tyndall_parser::source::{SourceBytes, Spanned};

use crate::spectrum::float_file::{self, FloatFile};

/// Reads the files that parameters name.
pub trait Assets: Sync {
    /// The bytes of a file. Its span says which scene file named it: relative paths start at the directory of that
    /// file's top-level file.
    ///
    /// # Errors
    /// The end of the sentence "cannot read …: ".
    fn read(&self, path: &Spanned<String>) -> Result<SourceBytes, String>;
}

/// For scenes that name no files.
pub struct NoAssets;

impl Assets for NoAssets {
    fn read(&self, _path: &Spanned<String>) -> Result<SourceBytes, String> {
        Err("no files can be read here".to_owned())
    }
}

/// The part of a file name behind the last dot.
pub(super) fn extension(path: &str) -> &str {
    path.rsplit_once('.').map_or("", |(_, extension)| extension)
}

/// The numbers of a text file, or the code and message of a diagnostic.
pub(super) fn read_numbers(
    path: &Spanned<String>,
    assets: &dyn Assets,
) -> Result<FloatFile, (&'static str, String)> {
    let name = &path.value;
    let bytes = assets
        .read(path)
        .map_err(|error| ("missing-file", format!("cannot read \"{name}\": {error}")))?;
    float_file::read((*bytes).as_ref()).map_err(|error| ("bad-number", format!("{name}: {error}")))
}
