//! The files a scene names, behind a trait: compiling touches no file system itself.

use tyndall_parser::diagnostic::Diagnostic;
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

    /// Bytes of memory that may still be taken for what is decoded and built.
    fn memory_left(&self) -> u64 {
        u64::MAX
    }

    /// Notes that so much memory will be taken. Whether it is time to ask how much is left: that is work of its own, which
    /// a million small things need not do each.
    fn takes(&self, _n_bytes: u128) -> bool {
        true
    }
}

/// Why something is not built for want of memory: the end of a sentence. `None` if there is enough for `n_bytes`.
pub(super) fn lack_of_memory(n_bytes: u128, assets: &dyn Assets) -> Option<String> {
    if !assets.takes(n_bytes) {
        return None;
    }
    let left = assets.memory_left();
    (n_bytes > left.into()).then(|| {
        let [taken, left] = [n_bytes, left.into()].map(memory_size);
        format!("takes {taken} of memory, more than the {left} that are left")
    })
}

/// In whole mebibytes, or kibibytes if it is less than one.
fn memory_size(n_bytes: u128) -> String {
    match n_bytes >> 20 {
        0 => format!("{} KiB", n_bytes >> 10),
        mebibytes => format!("{mebibytes} MiB"),
    }
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

/// Reads a file.
///
/// # Errors
/// A located finding, which says of a path from another system how it would be written here.
pub(super) fn read_file(
    path: &Spanned<String>,
    assets: &dyn Assets,
) -> Result<SourceBytes, Box<Diagnostic>> {
    assets.read(path).map_err(|error| {
        let message = format!("cannot read \"{}\": {error}", path.value);
        let mut missing = Diagnostic::error("missing-file", path.span, message);
        missing.help = tyndall_parser::include::path_help(&path.value);
        Box::new(missing)
    })
}

/// The numbers of a text file.
///
/// # Errors
/// A located finding.
pub(super) fn read_numbers(
    path: &Spanned<String>,
    assets: &dyn Assets,
) -> Result<FloatFile, Box<Diagnostic>> {
    let bytes = read_file(path, assets)?;
    float_file::read((*bytes).as_ref()).map_err(|error| {
        let message = format!("{}: {error}", path.value);
        Box::new(Diagnostic::error("bad-number", path.span, message))
    })
}
