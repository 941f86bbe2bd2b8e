//! Located diagnostics: what is wrong, where, and how to mend it.

use crate::source::Span;

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

/// The findings of a run, in the order they were made.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Diagnostics {
    /// All findings.
    pub list: Vec<Diagnostic>,
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
}

impl Diagnostics {
    /// Records a finding.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.list.push(diagnostic);
    }
}
