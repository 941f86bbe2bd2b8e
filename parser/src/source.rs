//! Source files and places in them. Lines and columns are computed when something is printed, never while parsing.

use std::sync::Arc;

/// Index of a file in [`Sources`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug)]
pub struct FileId(pub u32);

/// A half-open byte range `lo..hi` of one source file.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Span {
    /// The file the range lies in.
    pub file: FileId,
    /// First byte.
    pub lo: u32,
    /// One past the last byte.
    pub hi: u32,
}

/// A value together with the place it was written at.
#[derive(Clone, PartialEq, Debug)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Where it stands.
    pub span: Span,
}

/// Bytes of a source file: shared, so that a memory-mapped file can stand behind them.
pub type SourceBytes = Arc<dyn AsRef<[u8]> + Send + Sync>;

/// One file that was read.
#[derive(Clone)]
pub struct SourceFile {
    /// Name shown in diagnostics, as the user would write it.
    pub name: String,
    /// The whole text.
    pub bytes: SourceBytes,
    /// The `Include` directive that asked for this file; `None` for a top-level file.
    pub included_from: Option<Span>,
}

/// Every file read so far, addressed by [`FileId`].
#[derive(Clone, Default)]
pub struct Sources {
    files: Vec<SourceFile>,
}
