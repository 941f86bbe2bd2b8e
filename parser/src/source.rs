//! Source files and places in them. Lines and columns are computed when something is printed, never while parsing.

use std::sync::{Arc, OnceLock};

use memchr::{memchr, memchr_iter, memrchr};

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

/// A place as people count it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Location {
    /// Line, from 1. Lines end with LF.
    pub line: usize,
    /// Column in characters, from 1. Bytes that are not UTF-8 count as the replacement characters they print as.
    pub column: usize,
}

/// One file that was read.
#[derive(Clone)]
pub struct SourceFile {
    /// Name shown in diagnostics, as the user would write it.
    pub name: String,
    /// The whole text.
    pub bytes: SourceBytes,
    /// The `Include` directive that asked for this file; `None` for a top-level file.
    pub included_from: Option<Span>,
    /// Line feeds before each block of [`LINE_BLOCK`] bytes; made at the first question.
    line_blocks: OnceLock<Vec<u32>>,
}

/// Every file read so far, addressed by [`FileId`]. A file that is included twice is two files here.
#[derive(Clone, Default)]
pub struct Sources {
    files: Vec<SourceFile>,
}

/// What some editors put in front of UTF-8 text. It is skipped.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Line feeds are counted for whole blocks of this many bytes, so that the index stays small whatever the line length.
const LINE_BLOCK: usize = 1 << 16;

impl Span {
    /// The range `lo..hi` of `file`.
    pub fn new(file: FileId, lo: u32, hi: u32) -> Self {
        Self { file, lo, hi }
    }

    /// From the start of `self` to the end of `other`; `self` when they lie in different files.
    pub fn to(self, other: Span) -> Self {
        if self.file == other.file {
            Self {
                hi: self.hi.max(other.hi),
                ..self
            }
        } else {
            self
        }
    }

    /// The empty place right behind this range.
    pub fn end(self) -> Self {
        Self {
            lo: self.hi,
            ..self
        }
    }

    /// Number of bytes.
    pub fn len(self) -> usize {
        self.hi.saturating_sub(self.lo) as usize
    }

    /// Whether `other` lies in this range.
    pub fn contains(self, other: Span) -> bool {
        self.file == other.file && self.lo <= other.lo && other.hi <= self.hi
    }

    /// Whether it covers no byte.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }
}

impl<T> Spanned<T> {
    /// Pairs a value with its place.
    pub fn new(value: T, span: Span) -> Self {
        Self { value, span }
    }
}

impl SourceFile {
    /// The whole text.
    pub fn text(&self) -> &[u8] {
        (*self.bytes).as_ref()
    }

    /// The offset where the line of the byte at `offset` starts. A byte-order mark belongs to no line.
    fn line_start(&self, offset: usize) -> usize {
        let text = self.text();
        let offset = offset.min(text.len());
        let start = if text.starts_with(BYTE_ORDER_MARK) {
            BYTE_ORDER_MARK.len().min(offset)
        } else {
            0
        };
        memrchr(b'\n', &text[..offset]).map_or(start, |at| at + 1)
    }

    /// The number of line feeds before `offset`.
    fn lines_before(&self, offset: usize) -> usize {
        let text = self.text();
        let offset = offset.min(text.len());
        let blocks = self.line_blocks.get_or_init(|| {
            let mut total = 0;
            let counted = text.chunks(LINE_BLOCK).map(|block| {
                let before = total;
                total += memchr_iter(b'\n', block).count() as u32;
                before
            });
            counted.collect()
        });
        let block = offset / LINE_BLOCK;
        // An offset at the very end may lie one block past the last one: count from the last block that exists.
        let block = block.min(blocks.len().saturating_sub(1));
        let before = blocks.get(block).map_or(0, |&n| n as usize);
        before + memchr_iter(b'\n', &text[(block * LINE_BLOCK).min(offset)..offset]).count()
    }
}

impl Sources {
    /// No files.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a top-level file. `name` is what diagnostics show.
    ///
    /// Files of 4 GiB and more are taken, too; the parser reports them and reads nothing of them.
    pub fn add(&mut self, name: impl Into<String>, bytes: SourceBytes) -> FileId {
        self.insert(name.into(), bytes, None)
    }

    /// Adds a top-level file from text in memory.
    pub fn add_text(&mut self, name: impl Into<String>, text: impl Into<Vec<u8>>) -> FileId {
        self.add(name, Arc::new(text.into()))
    }

    /// Adds a file that the `Include` directive at `included_from` asked for.
    pub fn add_included(
        &mut self,
        name: impl Into<String>,
        bytes: SourceBytes,
        included_from: Span,
    ) -> FileId {
        self.insert(name.into(), bytes, Some(included_from))
    }

    fn insert(&mut self, name: String, bytes: SourceBytes, included_from: Option<Span>) -> FileId {
        let id = FileId(self.files.len() as u32);
        self.files.push(SourceFile {
            name,
            bytes,
            included_from,
            line_blocks: OnceLock::new(),
        });
        id
    }

    /// The file `id`; `None` when it was made by other `Sources`.
    pub fn get(&self, id: FileId) -> Option<&SourceFile> {
        self.files.get(id.0 as usize)
    }

    /// Number of files, counting one included twice as two.
    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Whether no file was added.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// The name of a file as diagnostics show it; `?` for an id of other `Sources`.
    pub fn name(&self, id: FileId) -> &str {
        self.get(id).map_or("?", |file| &file.name)
    }

    /// The bytes a span covers; empty where it leaves its file.
    pub fn text(&self, span: Span) -> &[u8] {
        self.get(span.file)
            .and_then(|file| file.text().get(span.lo as usize..span.hi as usize))
            .unwrap_or_default()
    }

    /// Line and column of the first byte of a span.
    pub fn location(&self, span: Span) -> Location {
        let Some(file) = self.get(span.file) else {
            return Location { line: 1, column: 1 };
        };
        let offset = (span.lo as usize).min(file.text().len());
        let start = file.line_start(offset);
        let before = &file.text()[start..offset];
        // Lines may be long and findings many. What is valid, as nearly all is, is counted at memory speed.
        let n_before = match std::str::from_utf8(before) {
            Ok(valid) => valid.chars().count(),
            Err(_) => String::from_utf8_lossy(before).chars().count(),
        };
        Location {
            line: 1 + file.lines_before(offset),
            column: 1 + n_before,
        }
    }

    /// `file:line:column` of the first byte of a span.
    pub fn place(&self, span: Span) -> String {
        let Location { line, column } = self.location(span);
        format!("{}:{line}:{column}", self.name(span.file))
    }

    /// The `Include` directives that led to a file, innermost first.
    pub fn include_chain(&self, id: FileId) -> impl Iterator<Item = Span> {
        std::iter::successors(self.included_from(id), |span| self.included_from(span.file))
    }

    /// The top-level file that a file was included from, possibly through others; the file itself when it is one.
    ///
    /// All relative paths of a scene are resolved against the directory of this file.
    pub fn top_level(&self, id: FileId) -> FileId {
        self.include_chain(id).last().map_or(id, |span| span.file)
    }

    fn included_from(&self, id: FileId) -> Option<Span> {
        // A file is always added after the one that includes it; anything else would be a chain without end.
        self.get(id)
            .and_then(|file| file.included_from)
            .filter(|span| span.file < id)
    }

    /// The range of the line that holds the first byte of `span`, its line end excluded.
    pub(crate) fn line_span(&self, span: Span) -> Span {
        let Some(file) = self.get(span.file) else {
            return span;
        };
        let text = file.text();
        let offset = (span.lo as usize).min(text.len());
        let hi = memchr(b'\n', &text[offset..]).map_or(text.len(), |at| offset + at);
        let hi = if hi > offset && text[hi - 1] == b'\r' {
            hi - 1
        } else {
            hi
        };
        Span::new(span.file, file.line_start(offset) as u32, hi as u32)
    }
}

/// Text of unknown encoding for a message: UTF-8 with replacement characters, control characters escaped, and cut
/// to about 40 characters.
pub(crate) fn excerpt(text: &[u8]) -> String {
    const LONGEST: usize = 40;
    // No character has more than four bytes.
    let head = String::from_utf8_lossy(&text[..text.len().min(4 * LONGEST)]);
    let mut shown = String::new();
    for c in head.chars().take(LONGEST) {
        if c.is_control() {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
    }
    if head.chars().count() > LONGEST || text.len() > 4 * LONGEST {
        shown.push('…');
    }
    shown
}

#[cfg(test)]
mod tests {
    use super::{FileId, LINE_BLOCK, Location, Sources, Span, excerpt};

    fn location(text: &[u8], at: u32) -> Location {
        let mut sources = Sources::new();
        let file = sources.add_text("a", text);
        sources.location(Span::new(file, at, at))
    }

    #[test]
    fn lines_and_columns_count_from_one_in_characters() {
        assert_eq!(location(b"", 0), Location { line: 1, column: 1 });
        assert_eq!(location(b"ab\ncd", 2), Location { line: 1, column: 3 });
        assert_eq!(location(b"ab\ncd", 3), Location { line: 2, column: 1 });
        assert_eq!(
            location("äöü x".as_bytes(), 7),
            Location { line: 1, column: 5 }
        );
        assert_eq!(location(b"ab\n", 99), Location { line: 2, column: 1 });
    }

    #[test]
    fn lines_agree_with_a_plain_count_across_index_blocks() {
        let text: Vec<u8> = (0..3 * LINE_BLOCK)
            .map(|i| if i % 7 == 3 { b'\n' } else { b'x' })
            .collect();
        for at in [
            0,
            3,
            4,
            LINE_BLOCK - 1,
            LINE_BLOCK,
            LINE_BLOCK + 1,
            2 * LINE_BLOCK + 5,
            3 * LINE_BLOCK,
        ] {
            let line = 1 + text[..at].iter().filter(|&&b| b == b'\n').count();
            assert_eq!(location(&text, at as u32).line, line, "offset {at}");
        }
    }

    #[test]
    fn chain_and_top_level_follow_the_includes() {
        let mut sources = Sources::new();
        let a = sources.add_text("a", "Include \"b\"");
        let in_a = Span::new(a, 0, 11);
        let b = sources.add_included("b", std::sync::Arc::new(b"".to_vec()), in_a);
        let in_b = Span::new(b, 0, 0);
        let c = sources.add_included("c", std::sync::Arc::new(b"".to_vec()), in_b);
        assert_eq!(sources.include_chain(c).collect::<Vec<_>>(), [in_b, in_a]);
        assert_eq!((sources.top_level(c), sources.top_level(a)), (a, a));
        assert_eq!(sources.name(FileId(9)), "?");
    }

    #[test]
    fn excerpts_are_short_and_printable() {
        assert_eq!(excerpt(b"abc"), "abc");
        assert_eq!(excerpt(b"a\0b\xff"), "a\\u{0}b\u{fffd}");
        assert!(excerpt(&[b'x'; 1 << 20]).chars().count() <= 41);
    }
}
