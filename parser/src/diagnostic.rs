//! Located diagnostics: what is wrong, where, and how to mend it. Prints nothing; renders to a `String`.

use std::collections::HashSet;
use std::ops::Range;

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};

use crate::source::{Location, Sources, Span};

/// Includes listed under a finding, innermost first.
const MAX_INCLUDES_SHOWN: usize = 8;

/// How bad it is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum Severity {
    /// Suspicious, but the picture is what the file asks for.
    Warning,
    /// Something was dropped or replaced: the picture is not what the file asks for.
    Error,
    /// Nothing can be rendered.
    Fatal,
}

/// One finding.
#[derive(Clone, PartialEq, Debug)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// Stable kebab-case name, e.g. `unknown-parameter`.
    pub code: &'static str,
    /// One sentence, no full stop, no place.
    pub message: String,
    /// The place it points at. `None` when there is none (a file that could not be opened from the command line).
    pub span: Option<Span>,
    /// What to say under the caret; empty for a bare caret.
    pub label: String,
    /// Other places that explain it.
    pub notes: Vec<(Span, String)>,
    /// How to mend it, e.g. `did you mean "roughness"?`.
    pub help: Option<String>,
}

/// Whether rendered text carries ANSI colours.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Style {
    /// Plain text.
    #[default]
    Plain,
    /// ANSI colours, as rustc uses them.
    Coloured,
}

/// How many findings there are of each severity.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Counts {
    /// Number of warnings.
    pub warnings: usize,
    /// Number of errors.
    pub errors: usize,
    /// Number of fatal errors.
    pub fatal: usize,
}

/// Findings of one kind, which is a code and a severity, that are kept. What is found more often is counted: a scene may
/// have a million faults, and nobody reads the same sentence a million times.
pub const MAX_PER_KIND: usize = 200;

/// The findings of a run, in the order they were made; of each kind the first [`MAX_PER_KIND`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Diagnostics {
    /// The findings that are kept.
    pub list: Vec<Diagnostic>,
    /// How often each kind was found, in order of first occurrence. There are few.
    kinds: Vec<Kind>,
}

/// One kind of finding.
#[derive(Clone, PartialEq, Debug)]
struct Kind {
    code: &'static str,
    severity: Severity,
    n_found: usize,
}

impl Kind {
    fn n_left_out(&self) -> usize {
        self.n_found.saturating_sub(MAX_PER_KIND)
    }
}

impl Diagnostic {
    /// A warning at a place.
    pub fn warning(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, code, Some(span), message.into())
    }

    /// An error at a place.
    pub fn error(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, code, Some(span), message.into())
    }

    /// A fatal error at a place.
    pub fn fatal(code: &'static str, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Fatal, code, Some(span), message.into())
    }

    /// A finding with every part but label, notes and help.
    pub fn new(
        severity: Severity,
        code: &'static str,
        span: Option<Span>,
        message: String,
    ) -> Self {
        Self {
            severity,
            code,
            message,
            span,
            label: String::new(),
            notes: Vec::new(),
            help: None,
        }
    }

    /// Adds the text under the caret.
    pub fn with_label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// Adds a second place.
    pub fn with_note(mut self, span: Span, text: impl Into<String>) -> Self {
        self.notes.push((span, text.into()));
        self
    }

    /// Adds a suggestion.
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The text shown to the user, carets included, with a line feed at the end.
    ///
    /// ```text
    /// error[unknown-parameter-type]: `flaot` is no parameter type
    ///  --> scenes/ball.pbrt:3:16
    ///   |
    /// 3 | Shape "sphere" "flaot radius" 2
    ///   |                ^^^^^^^^^^^^^^ this parameter is ignored
    ///   |
    ///   = help: did you mean "float"?
    /// ```
    pub fn render(&self, sources: &Sources, style: Style) -> String {
        let title = match self.severity {
            Severity::Warning => Level::WARNING,
            Severity::Error => Level::ERROR,
            Severity::Fatal => Level::ERROR.with_name("fatal"),
        };
        let mut group = Group::with_title(
            title
                .primary_title(printable_lines(&self.message))
                .id(self.code),
        );
        let shown = self.span.and_then(|span| Excerpt::range(sources, span));
        let notes = self
            .notes
            .iter()
            .map(|(span, text)| (*span, text.as_str(), AnnotationKind::Context));
        let (beside, elsewhere): (Vec<_>, Vec<_>) =
            notes.partition(|(span, ..)| shown.is_some_and(|shown| shown.contains(*span)));
        if let Some(span) = self.span {
            let mut marks = vec![(span, self.label.as_str(), AnnotationKind::Primary)];
            marks.extend(beside);
            group = Self::place(group, sources, &marks);
            let mut includes = sources.include_chain(span.file);
            for include in includes.by_ref().take(MAX_INCLUDES_SHOWN) {
                group = group.element(Level::NOTE.message(printable(&format!(
                    "included from {}",
                    sources.place(include)
                ))));
            }
            let n_more = includes.count();
            if n_more > 0 {
                group =
                    group.element(Level::NOTE.message(format!("and {n_more} includes further up")));
            }
        }
        for mark in elsewhere {
            group = Self::place(group, sources, &[mark]);
        }
        if let Some(help) = &self.help {
            group = group.element(Level::HELP.message(printable_lines(help)));
        }
        let renderer = match style {
            Style::Plain => Renderer::plain(),
            Style::Coloured => Renderer::styled(),
        };
        let mut text = renderer.decor_style(DecorStyle::Ascii).render(&[group]);
        text.push('\n');
        text
    }

    /// Adds `--> file:line:column` of the first mark, and the source line under it with all of them.
    fn place<'a>(
        group: Group<'a>,
        sources: &Sources,
        marks: &[(Span, &str, AnnotationKind)],
    ) -> Group<'a> {
        let Some(&(span, ..)) = marks.first() else {
            return group;
        };
        let spans: Vec<Span> = marks.iter().map(|&(span, ..)| span).collect();
        let excerpt = Excerpt::new(sources, &spans);
        let Location { line, column } = sources.location(span);
        let name = printable(sources.name(span.file));
        let mut snippet = Snippet::source(excerpt.text).line_start(line);
        for (&(_, label, kind), marked) in marks.iter().zip(excerpt.marked) {
            let annotation = kind.span(marked);
            snippet = snippet.annotation(if label.is_empty() {
                annotation
            } else {
                annotation.label(printable(label))
            });
        }
        if excerpt.starts_line {
            group.element(snippet.path(name))
        } else {
            // The renderer would count columns from the cut.
            group
                .element(Origin::path(name).line(line).char_column(column))
                .element(snippet)
        }
    }
}

/// The part of a source line around a span, made printable.
struct Excerpt {
    text: String,
    /// Bytes of `text` to underline, for each span.
    marked: Vec<Range<usize>>,
    /// Whether nothing is cut off before it.
    starts_line: bool,
}

impl Excerpt {
    /// Source bytes shown before the place.
    const BEFORE: u32 = 100;
    /// Source bytes shown from the place on.
    const BEHIND: u32 = 100;

    /// The source bytes shown for a span; `None` for a file that is not there.
    fn range(sources: &Sources, span: Span) -> Option<Span> {
        sources.get(span.file)?;
        let line = sources.line_span(span);
        let at = span.lo.clamp(line.lo, line.hi);
        let lo = line.lo.max(at.saturating_sub(Self::BEFORE));
        let hi = line.hi.min(at.saturating_add(Self::BEHIND));
        Some(Span { lo, hi, ..line })
    }

    /// The line around the first of `spans`; the others must lie in its range.
    fn new(sources: &Sources, spans: &[Span]) -> Self {
        let nothing = Self {
            text: String::new(),
            marked: vec![0..0; spans.len()],
            starts_line: true,
        };
        let Some((first, shown)) = spans
            .first()
            .and_then(|span| Some((*span, Self::range(sources, *span)?)))
        else {
            return nothing;
        };
        let line = sources.line_span(first);
        let starts_line = shown.lo == line.lo;
        let mut text = String::from(if starts_line { "" } else { "…" });
        // The text is made piece by piece between the ends of the spans: printing changes lengths.
        let inside = |at: u32| at.clamp(shown.lo, shown.hi);
        let mut cuts: Vec<u32> = spans
            .iter()
            .flat_map(|span| [inside(span.lo), inside(span.hi)])
            .collect();
        cuts.extend([shown.lo, shown.hi]);
        cuts.sort_unstable();
        cuts.dedup();
        let mut offsets = vec![text.len()];
        for piece in cuts.windows(2) {
            let bytes = sources.text(Span {
                lo: piece[0],
                hi: piece[1],
                ..first
            });
            text.push_str(&printable(&String::from_utf8_lossy(bytes)));
            offsets.push(text.len());
        }
        text.push_str(if shown.hi < line.hi { "…" } else { "" });
        let offset = |at: u32| {
            cuts.binary_search(&inside(at))
                .map_or(text.len(), |cut| offsets[cut])
        };
        let marked = spans
            .iter()
            .map(|span| offset(span.lo)..offset(span.hi.max(span.lo)))
            .collect();
        Self {
            text,
            marked,
            starts_line,
        }
    }
}

/// Control characters other than TAB as replacement characters: none reaches a terminal, none ends the line.
fn printable(text: &str) -> String {
    text.chars()
        .map(|c| {
            if c.is_control() && c != '\t' {
                char::REPLACEMENT_CHARACTER
            } else {
                c
            }
        })
        .collect()
}

/// The same for text that may have several lines.
fn printable_lines(text: &str) -> String {
    text.split('\n')
        .map(printable)
        .collect::<Vec<_>>()
        .join("\n")
}

impl Diagnostics {
    /// Nothing found.
    pub fn new() -> Self {
        Self::default()
    }

    /// Records a finding, or counts it where enough of its kind are kept.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        let (code, severity) = (diagnostic.code, diagnostic.severity);
        if self.count(code, severity, 1) < MAX_PER_KIND {
            self.list.push(diagnostic);
        }
    }

    /// Records the findings of a part of the work, those it has only counted included.
    pub fn append(&mut self, more: Self) {
        let Self { list, kinds } = more;
        for diagnostic in list {
            self.push(diagnostic);
        }
        for kind in kinds {
            let n_left_out = kind.n_left_out();
            if n_left_out > 0 {
                self.count(kind.code, kind.severity, n_left_out);
            }
        }
    }

    /// Counts findings of a kind, and says how many there were before.
    fn count(&mut self, code: &'static str, severity: Severity, n: usize) -> usize {
        let known = |kind: &&mut Kind| kind.code == code && kind.severity == severity;
        match self.kinds.iter_mut().find(known) {
            Some(kind) => {
                kind.n_found += n;
                kind.n_found - n
            }
            None => {
                self.kinds.push(Kind {
                    code,
                    severity,
                    n_found: n,
                });
                0
            }
        }
    }

    /// For each kind of which more was found than is kept, a finding that says how many more.
    pub fn left_out(&self) -> impl Iterator<Item = Diagnostic> {
        let kinds = self.kinds.iter().filter(|kind| kind.n_left_out() > 0);
        kinds.map(|kind| {
            let message = format!(
                "{} more of the kind `{}` are not listed",
                kind.n_left_out(),
                kind.code
            );
            Diagnostic::new(kind.severity, kind.code, None, message)
        })
    }

    /// Makes every finding at least so bad.
    pub fn raise(&mut self, least: Severity) {
        for diagnostic in &mut self.list {
            diagnostic.severity = diagnostic.severity.max(least);
        }
        for kind in &mut self.kinds {
            kind.severity = kind.severity.max(least);
        }
    }

    /// The findings that are kept, in the order they were made.
    pub fn iter(&self) -> std::slice::Iter<'_, Diagnostic> {
        self.list.iter()
    }

    /// Number of findings that are kept.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Whether nothing was found.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Whether the picture will not be what the files ask for: an error or a fatal error was found.
    pub fn has_errors(&self) -> bool {
        self.worst() >= Some(Severity::Error)
    }

    /// Whether nothing can be rendered.
    pub fn has_fatal(&self) -> bool {
        self.worst() == Some(Severity::Fatal)
    }

    /// The worst severity found.
    pub fn worst(&self) -> Option<Severity> {
        self.list.iter().map(|diagnostic| diagnostic.severity).max()
    }

    /// How many findings there are of each severity, those that are only counted included.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts::default();
        for kind in &self.kinds {
            *match kind.severity {
                Severity::Warning => &mut counts.warnings,
                Severity::Error => &mut counts.errors,
                Severity::Fatal => &mut counts.fatal,
            } += kind.n_found;
        }
        counts
    }

    /// Renders every finding, a blank line behind each. Findings that read the same are shown once.
    pub fn render(&self, sources: &Sources, style: Style) -> String {
        let mut seen = HashSet::new();
        let mut text = String::new();
        for diagnostic in &self.list {
            let rendered = diagnostic.render(sources, style);
            if !seen.contains(&rendered) {
                text.push_str(&rendered);
                text.push('\n');
                seen.insert(rendered);
            }
        }
        text
    }
}

impl Extend<Diagnostic> for Diagnostics {
    fn extend<T: IntoIterator<Item = Diagnostic>>(&mut self, more: T) {
        more.into_iter()
            .for_each(|diagnostic| self.push(diagnostic));
    }
}

impl IntoIterator for Diagnostics {
    type Item = Diagnostic;
    type IntoIter = std::vec::IntoIter<Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.list.into_iter()
    }
}

impl<'a> IntoIterator for &'a Diagnostics {
    type Item = &'a Diagnostic;
    type IntoIter = std::slice::Iter<'a, Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

#[cfg(test)]
mod tests {
    use super::{Counts, Diagnostic, Diagnostics, MAX_PER_KIND, Severity, Style};
    use crate::source::{Sources, Span};

    fn plain(text: &[u8], lo: u32, hi: u32) -> String {
        let mut sources = Sources::new();
        let file = sources.add_text("a.pbrt", text);
        Diagnostic::error("some-code", Span::new(file, lo, hi), "it is wrong")
            .with_label("here")
            .with_help("mend it")
            .render(&sources, Style::Plain)
    }

    #[test]
    fn rendering_names_place_code_line_and_help() {
        let text = plain(b"Identity\nShape 5\n", 15, 16);
        let expected = "error[some-code]: it is wrong\n --> a.pbrt:2:7\n  |\n2 | Shape 5\n  |       ^ here\n  |\n  = help: mend it\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn endless_lines_are_cut_around_the_place_and_keep_their_column() {
        let mut line = vec![b'x'; 200_000];
        line[100_000] = b'Y';
        let text = plain(&line, 100_000, 150_000);
        assert!(text.contains("a.pbrt:1:100001"), "{text}");
        assert!(text.contains("xY"), "{text}");
        assert!(text.len() < 1500, "{}", text.len());
    }

    #[test]
    fn any_bytes_and_any_span_can_be_shown() {
        let bytes: Vec<u8> = (0..=255)
            .chain([0x1b, b'[', b'2', b'J', 0xe2, 0x82])
            .collect();
        for lo in 0..bytes.len() as u32 + 3 {
            for hi in [lo, lo + 1, lo + 200, 0, u32::MAX] {
                let text = plain(&bytes, lo, hi);
                assert!(text.contains("a.pbrt:") && !text.contains('\x1b'), "{text}");
            }
        }
    }

    #[test]
    fn the_include_chain_is_shown() {
        let mut sources = Sources::new();
        let a = sources.add_text("a.pbrt", "\nInclude \"b\"");
        let b = sources.add_included(
            "b.pbrt",
            std::sync::Arc::new(b"bad".to_vec()),
            Span::new(a, 1, 12),
        );
        let text = Diagnostic::warning("c", Span::new(b, 0, 3), "m").render(&sources, Style::Plain);
        assert!(text.contains("included from a.pbrt:2:1"), "{text}");
    }

    #[test]
    fn no_control_character_of_a_name_or_message_reaches_the_terminal() {
        let mut sources = Sources::new();
        let evil = "a\x1b[2J\r";
        let a = sources.add_text(evil, "Include");
        let b = sources.add_included(
            evil,
            std::sync::Arc::new(evil.as_bytes().to_vec()),
            Span::new(a, 0, 7),
        );
        let text = Diagnostic::error("c", Span::new(b, 0, 1), evil)
            .with_label(evil)
            .with_note(Span::new(a, 0, 1), evil)
            .with_help(evil)
            .render(&sources, Style::Plain);
        assert!(!text.contains(['\x1b', '\r']), "{text:?}");
    }

    #[test]
    fn colours_are_escapes_and_only_on_demand() {
        let sources = Sources::new();
        let fatal = Diagnostic::new(Severity::Fatal, "c", None, "m".into());
        assert!(fatal.render(&sources, Style::Coloured).contains("\x1b["));
        assert_eq!(fatal.render(&sources, Style::Plain), "fatal[c]: m\n");
    }

    #[test]
    fn notes_are_shown_even_when_the_finding_has_no_place() {
        let mut sources = Sources::new();
        let file = sources.add_text("a.pbrt", "Identity");
        let found = Diagnostic::new(Severity::Error, "c", None, "m".into())
            .with_note(Span::new(file, 0, 8), "see here");
        let text = found.render(&sources, Style::Plain);
        assert!(
            text.contains("a.pbrt:1:1") && text.contains("see here"),
            "{text}"
        );
    }

    #[test]
    fn repeated_findings_are_shown_once_and_counted_all() {
        let mut found = Diagnostics::new();
        let one = Diagnostic::new(Severity::Warning, "c", None, "m".into());
        found.extend([
            one.clone(),
            one.clone(),
            Diagnostic {
                severity: Severity::Error,
                ..one
            },
        ]);
        assert_eq!(
            found.render(&Sources::new(), Style::Plain),
            "warning[c]: m\n\nerror[c]: m\n\n"
        );
        assert_eq!(
            found.counts(),
            Counts {
                warnings: 2,
                errors: 1,
                fatal: 0
            }
        );
        assert!(found.has_errors() && !found.has_fatal());
    }

    #[test]
    fn many_findings_of_a_kind_are_counted() {
        let mut part = Diagnostics::new();
        for severity in [Severity::Warning, Severity::Error] {
            for i in 0..MAX_PER_KIND + 50 {
                part.push(Diagnostic::new(severity, "c", None, i.to_string()));
            }
        }
        let mut whole = part.clone();
        whole.append(part);
        assert_eq!(whole.len(), 2 * MAX_PER_KIND);
        let n = 2 * (MAX_PER_KIND + 50);
        let counts = Counts {
            warnings: n,
            errors: n,
            fatal: 0,
        };
        assert_eq!(whole.counts(), counts);
        let more: Vec<_> = whole.left_out().map(|found| found.message).collect();
        let line = format!("{} more of the kind `c` are not listed", n - MAX_PER_KIND);
        assert_eq!(more, [line.clone(), line]);
        whole.raise(Severity::Fatal);
        assert_eq!(whole.counts().fatal, 2 * n);
    }
}
