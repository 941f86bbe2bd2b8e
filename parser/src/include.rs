//! Includes: the stack of lexers behind one stream of tokens. Opens nothing itself; a [`Loader`] does.
//!
//! As in pbrt-v3 an `Include` acts on *tokens*: when the included file is exhausted its parent continues in the middle
//! of whatever was being parsed. So parameters behind an `Include` belong to the last directive of the included file
//! when that one's list is still open, and published scenes rely on it.

use std::fmt;

use crate::diagnostic::{Diagnostic, Severity};
use crate::lexer::{self, Token};
use crate::numbers::{self, Number};
use crate::report::Report;
use crate::schema::directive;
use crate::source::{BYTE_ORDER_MARK, FileId, SourceBytes, Sources, Span, excerpt};

/// Includes within includes. Real scenes nest a handful of times.
const MAX_DEPTH: usize = 256;
/// Files included by one scene: what stops files that include each other twice from doubling without end.
const MAX_INCLUDES: usize = 100_000;

/// Finds and reads the files that `Include` asks for.
///
/// All relative paths of a scene are resolved against the directory of the *top-level* file, never the including one.
/// A closure `Fn(&str, &str) -> Result<Loaded, LoadError>` is a loader.
pub trait Loader {
    /// Reads the file that is called `path` in a scene whose top-level file is named `top_level`.
    fn load(&self, path: &str, top_level: &str) -> Result<Loaded, LoadError>;
}

/// A file that a [`Loader`] read.
#[derive(Clone)]
pub struct Loaded {
    /// Name for diagnostics.
    pub name: String,
    /// The whole text.
    pub bytes: SourceBytes,
}

/// Why a file could not be read, as the end of the sentence "cannot read …: ".
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct LoadError {
    /// E.g. `No such file or directory`.
    pub message: String,
}

/// A loader that finds nothing, for text that stands alone.
#[derive(Clone, Copy, Debug)]
pub struct NoIncludes;

impl LoadError {
    /// An error with this explanation.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
        }
    }
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for LoadError {}

impl<F: Fn(&str, &str) -> Result<Loaded, LoadError>> Loader for F {
    fn load(&self, path: &str, top_level: &str) -> Result<Loaded, LoadError> {
        self(path, top_level)
    }
}

impl Loader for NoIncludes {
    fn load(&self, _path: &str, _top_level: &str) -> Result<Loaded, LoadError> {
        Err(LoadError::new("files cannot be included here"))
    }
}

/// A token by kind and place; its text is looked up where it is needed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Lexeme {
    pub(crate) kind: Kind,
    pub(crate) span: Span,
}

/// What a [`Lexeme`] is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    Open,
    Close,
    Quoted,
    Word,
    /// The rest of a line behind a quote without its partner. Already reported.
    Unterminated,
}

/// One file being read.
struct Frame {
    file: FileId,
    bytes: SourceBytes,
    position: usize,
    /// Directives that were understood, and that were not.
    n_understood: u32,
    n_failed: u32,
    /// See [`has_directives`]; looked for when it is asked for.
    has_directives: Option<bool>,
}

impl Frame {
    /// Whether the next fault shows that this is another sort of file, of which no more should be quoted.
    fn is_no_scene(&mut self) -> bool {
        if self.n_failed <= self.n_understood {
            return false;
        }
        let text = (*self.bytes).as_ref();
        !*self
            .has_directives
            .get_or_insert_with(|| has_directives(text))
    }

    fn rest(&self) -> &[u8] {
        (*self.bytes)
            .as_ref()
            .get(self.position..)
            .unwrap_or_default()
    }
}

/// Whether a text holds directives, if with mistakes: at least a quarter of the lines that begin with a word begin with the
/// name of one. `Include` does not count: files of other programs have it.
fn has_directives(text: &[u8]) -> bool {
    let (mut n_words, mut n_directives) = (0usize, 0usize);
    for line in text.split(|byte| matches!(byte, b'\n' | b'\r')) {
        let line = line.trim_ascii_start();
        let length = line.iter().take_while(|b| b.is_ascii_alphabetic()).count();
        if length > 0 {
            let word = str::from_utf8(&line[..length]).unwrap_or_default();
            let is_one = word != "Include" && directive(word).is_some();
            n_words += 1;
            n_directives += usize::from(is_one);
        }
    }
    n_directives > 0 && 4 * n_directives >= n_words
}

/// The tokens of a scene across all its files, with one token of push-back.
pub(crate) struct TokenStream<'a> {
    pub(crate) sources: &'a mut Sources,
    pub(crate) report: Report,
    loader: &'a dyn Loader,
    top_level: FileId,
    frames: Vec<Frame>,
    pushed_back: Option<Lexeme>,
    n_includes: usize,
    /// Place of the last token read.
    last: Span,
    /// From the start of the current directive to the last token taken in its file.
    extent: Span,
    /// Where it ended before that token.
    end_before: u32,
}

/// How a path that was not found would be written here, if it has backslashes: they are part of names, and separate
/// nothing.
pub fn path_help(path: &str) -> Option<String> {
    if !path.contains('\\') || cfg!(windows) {
        return None;
    }
    let mut names = path.split(['\\', '/']);
    // Doubled backslashes separate once; a leading separator stays.
    let first = names.next().unwrap_or_default();
    let rest = names.filter(|name| !name.is_empty());
    let path: Vec<&str> = std::iter::once(first).chain(rest).collect();
    Some(format!(
        "directories are separated by / here: write \"{}\"",
        excerpt(path.join("/").as_bytes())
    ))
}

impl<'a> TokenStream<'a> {
    /// A stream without files.
    pub(crate) fn new(sources: &'a mut Sources, loader: &'a dyn Loader) -> Self {
        let nowhere = Span::new(FileId(0), 0, 0);
        Self {
            sources,
            report: Report::default(),
            loader,
            top_level: FileId(0),
            frames: Vec::new(),
            pushed_back: None,
            n_includes: 0,
            last: nowhere,
            extent: nowhere,
            end_before: 0,
        }
    }

    /// Starts with a top-level file.
    pub(crate) fn open(&mut self, root: FileId) {
        let Some(bytes) = self.sources.get(root).map(|file| file.bytes.clone()) else {
            return;
        };
        self.top_level = root;
        self.last = Span::new(root, 0, 0);
        self.push_frame(root, bytes, None);
    }

    /// Starts reading a file at the next token. `asked_by` is the `Include`, if there is one.
    fn push_frame(&mut self, file: FileId, bytes: SourceBytes, asked_by: Option<Span>) {
        let text = (*bytes).as_ref();
        let reason = match text {
            _ if u32::try_from(text.len()).is_err() => "it is 4 GiB or larger",
            [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => "it is UTF-16 text; save it as UTF-8",
            [0x1f, 0x8b, ..] => "it is compressed; unpack it first",
            _ => {
                let position = if text.starts_with(BYTE_ORDER_MARK) {
                    BYTE_ORDER_MARK.len()
                } else {
                    0
                };
                self.frames.push(Frame {
                    file,
                    bytes,
                    position,
                    n_understood: 0,
                    n_failed: 0,
                    has_directives: None,
                });
                return;
            }
        };
        let message = format!("cannot read \"{}\": {reason}", self.sources.name(file));
        self.report.push(Diagnostic::new(
            Severity::Fatal,
            "unreadable-file",
            asked_by,
            message,
        ));
    }

    /// The next token; `None` at the end of all input.
    pub(crate) fn next(&mut self) -> Option<Lexeme> {
        let lexeme = match self.pushed_back.take() {
            Some(lexeme) => lexeme,
            None => self.lex()?,
        };
        self.take(lexeme.span);
        Some(lexeme)
    }

    /// Gives the last token back. Not twice in a row.
    pub(crate) fn push_back(&mut self, lexeme: Lexeme) {
        self.pushed_back = Some(lexeme);
        self.extent = self.extent_before();
    }

    /// Lets the extent of a directive start at its keyword.
    pub(crate) fn start_extent(&mut self, keyword: Span) {
        (self.extent, self.end_before) = (keyword, keyword.hi);
    }

    /// From the keyword to the last token taken, as far as it lies in the keyword's file.
    pub(crate) fn extent(&self) -> Span {
        self.extent
    }

    /// The extent without the last token.
    pub(crate) fn extent_before(&self) -> Span {
        Span {
            hi: self.end_before,
            ..self.extent
        }
    }

    /// Whether only white space stands between the start of the line and this token.
    pub(crate) fn is_first_on_line(&self, lexeme: Lexeme) -> bool {
        let before = self.sources.text(Span {
            lo: 0,
            hi: lexeme.span.lo,
            ..lexeme.span
        });
        before
            .iter()
            .rev()
            .find(|byte| !matches!(byte, b' ' | b'\t'))
            .is_none_or(|byte| matches!(byte, b'\n' | b'\r'))
    }

    /// What the file in which the last token stands holds from an offset on.
    pub(crate) fn rest_of_file(&self, from: u32) -> &[u8] {
        let text = self.sources.get(self.last.file).map(|file| file.text());
        text.and_then(|text| text.get(from as usize..))
            .unwrap_or_default()
    }

    /// Leaves the rest of the current file unread.
    pub(crate) fn end_file(&mut self) {
        self.frames.pop();
    }

    /// The place behind the last token read.
    pub(crate) fn end(&self) -> Span {
        self.last.end()
    }

    /// The text of a token.
    pub(crate) fn text(&self, lexeme: Lexeme) -> &[u8] {
        self.sources.text(lexeme.span)
    }

    /// The text of a token for a message: short and printable.
    pub(crate) fn shown(&self, lexeme: Lexeme) -> String {
        excerpt(self.text(lexeme))
    }

    /// Notes whether a directive of a file was understood.
    pub(crate) fn count(&mut self, file: FileId, is_understood: bool) {
        if let Some(frame) = self
            .frames
            .iter_mut()
            .rev()
            .find(|frame| frame.file == file)
        {
            if is_understood {
                frame.n_understood = frame.n_understood.saturating_add(1);
            } else {
                frame.n_failed = frame.n_failed.saturating_add(1);
            }
        }
    }

    /// Leaves a file of which so little is understood that it is no scene. Its faults would quote it line by line, whoever
    /// it belongs to. False for others.
    pub(crate) fn leave_if_no_scene(&mut self, file: FileId) -> bool {
        let is_one = |frame: &mut Frame| frame.file == file && frame.is_no_scene();
        let Some(index) = self.frames.iter_mut().rposition(is_one) else {
            return false;
        };
        self.frames.truncate(index);
        let name = self.sources.name(file);
        let message = format!("\"{name}\" is no scene file: the rest of it is not read");
        self.report
            .push(Diagnostic::new(Severity::Fatal, "no-scene", None, message));
        true
    }

    /// Takes plain numbers as long as they follow in the current file; returns how many.
    pub(crate) fn numbers(&mut self, mut push: impl FnMut(Number)) -> usize {
        if self.pushed_back.is_some() {
            return 0;
        }
        let Some(frame) = self.frames.last() else {
            return 0;
        };
        let mut count = 0;
        let used = numbers::list(frame.rest(), |number| {
            count += 1;
            push(number);
        });
        self.advance(used);
        count
    }

    /// Takes plain numbers into `values` as long as they follow in the current file; returns how many.
    pub(crate) fn plain_numbers(&mut self, values: &mut [f64]) -> usize {
        let Some(frame) = self.frames.last().filter(|_| self.pushed_back.is_none()) else {
            return 0;
        };
        let (text, mut at, mut count) = (frame.rest(), 0, 0);
        while count < values.len()
            && let Some((number, used)) = numbers::next(&text[at..])
        {
            values[count] = number.to_f64();
            at += used;
            count += 1;
        }
        self.advance(at);
        count
    }

    /// Moves behind numbers that were read without making tokens of them.
    fn advance(&mut self, used: usize) {
        if let Some(frame) = self.frames.last_mut().filter(|_| used > 0) {
            frame.position += used;
            let at = frame.position as u32;
            let end = Span::new(frame.file, at, at);
            self.take(end);
        }
    }

    /// Notes that everything up to the end of `token` is taken.
    fn take(&mut self, token: Span) {
        self.last = token;
        self.end_before = self.extent.hi;
        self.extent = self.extent.to(token);
    }

    fn lex(&mut self) -> Option<Lexeme> {
        loop {
            let is_included = self.frames.len() > 1;
            let frame = self.frames.last_mut()?;
            let text = frame.rest();
            let Ok((rest, token)) = lexer::token(text) else {
                self.frames.pop();
                continue;
            };
            let hi = frame.position + (text.len() - rest.len());
            let lo = hi - token.text().len();
            // The file is below 4 GiB, push_frame saw to it.
            let span = Span::new(frame.file, lo as u32, hi as u32);
            let kind = match token {
                Token::Open => Kind::Open,
                Token::Close => Kind::Close,
                Token::Quoted(_) => Kind::Quoted,
                Token::Word(_) => Kind::Word,
                Token::Unterminated(_) => Kind::Unterminated,
            };
            frame.position = hi;
            let file = frame.file;
            if kind == Kind::Unterminated {
                if self.leave_if_no_scene(file) {
                    continue;
                }
                let message = "a string must end on the line it starts on";
                let fault = Diagnostic::fatal("unterminated-string", span, message)
                    .with_label("no closing quote");
                if is_included {
                    // As in pbrt-v3: the rest of this file is lost, its parent goes on.
                    let help = "the rest of this file is ignored; add the closing quote";
                    self.report.push(Diagnostic {
                        severity: Severity::Error,
                        ..fault.with_help(help)
                    });
                    self.frames.pop();
                    continue;
                }
                self.report.push(fault);
            }
            return Some(Lexeme { kind, span });
        }
    }

    /// Reads the file `path` before anything else. `directive` is the `Include` with its argument.
    pub(crate) fn include(&mut self, path: &str, directive: Span) {
        let limit = if self.frames.len() > MAX_DEPTH {
            Some(format!("more than {MAX_DEPTH} files include one another"))
        } else if self.n_includes >= MAX_INCLUDES {
            Some(format!("more than {MAX_INCLUDES} files are included"))
        } else {
            None
        };
        if let Some(message) = limit {
            self.report.push(
                Diagnostic::fatal("too-many-includes", directive, message).with_label("not read"),
            );
            return;
        }
        let loaded = match self.loader.load(path, self.sources.name(self.top_level)) {
            Ok(loaded) => loaded,
            Err(error) => {
                let message = format!("cannot read \"{}\": {error}", excerpt(path.as_bytes()));
                let help = path_help(path).unwrap_or_else(|| {
                    "relative paths start at the directory of the top-level scene file".to_owned()
                });
                self.report
                    .push(Diagnostic::error("missing-include", directive, message).with_help(help));
                return;
            }
        };
        self.n_includes += 1;
        if let Some(same) = self.frame_with_text((*loaded.bytes).as_ref()) {
            let message = format!("\"{}\" includes itself", self.sources.name(same));
            let chain = self.chain_down_to(same, directive);
            self.report.push(
                Diagnostic::fatal("include-loop", directive, message)
                    .with_label("not read again")
                    .with_help(format!("the loop is {chain}")),
            );
            return;
        }
        let file = self
            .sources
            .add_included(loaded.name, loaded.bytes.clone(), directive);
        self.push_frame(file, loaded.bytes, Some(directive));
    }

    /// A file being read that has exactly this text.
    ///
    /// Files are compared by content: whatever their names, a file with the text of one that is asking for it will ask
    /// for the same again, because paths do not depend on the including file.
    fn frame_with_text(&self, text: &[u8]) -> Option<FileId> {
        self.frames
            .iter()
            .find(|frame| (*frame.bytes).as_ref() == text)
            .map(|frame| frame.file)
    }

    /// `a → b → a` for a loop that starts at the file `start` and is closed by `directive`.
    fn chain_down_to(&self, start: FileId, directive: Span) -> String {
        let mut names = vec![self.sources.name(start), self.sources.name(directive.file)];
        let above = self
            .sources
            .include_chain(directive.file)
            .map(|span| span.file);
        names.extend(
            above
                .take_while(|&file| file >= start)
                .map(|file| self.sources.name(file)),
        );
        names.reverse();
        names.join(" → ")
    }
}
