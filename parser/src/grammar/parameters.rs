//! Parameter lists: `"type name" value` pairs to typed values. The declaration stands first, so numbers go straight into
//! the vector of their type.

use std::collections::HashMap;
use std::ops::ControlFlow;

use super::{Parsed, Parser, Resync};
use crate::diagnostic::{Diagnostic, Severity};
use crate::include::{Kind, Lexeme};
use crate::numbers::Number;
use crate::params::{Param, ParamList, ParamType, ParamValue};
use crate::schema::nearest;
use crate::source::{Span, Spanned, excerpt};

/// Tuples of `N` numbers under construction.
struct Tuples<const N: usize> {
    whole: Vec<[f32; N]>,
    partial: [f32; N],
    filled: usize,
}

impl<const N: usize> Tuples<N> {
    fn new() -> Self {
        Self {
            whole: Vec::new(),
            partial: [0.0; N],
            filled: 0,
        }
    }

    #[inline]
    fn push(&mut self, value: f32) {
        self.partial[self.filled] = value;
        self.filled += 1;
        if self.filled == N {
            self.whole.push(self.partial);
            self.filled = 0;
        }
    }
}

/// Where the numbers of a list go.
enum Numbers {
    Discarded,
    Integers { values: Vec<i32>, n_clamped: usize },
    Floats(Vec<f32>),
    Pairs(Tuples<2>),
    Triples(Tuples<3>),
}

/// The values of one parameter under construction.
struct Values {
    numbers: Numbers,
    n_numbers: usize,
    /// `None` when strings are not wanted.
    strings: Option<Vec<Spanned<String>>>,
    n_strings: usize,
}

impl Values {
    /// Values for a type; for no type they are read and discarded.
    fn of(kind: Option<ParamType>) -> Self {
        let numbers = match kind {
            Some(ParamType::Integer) => Numbers::Integers {
                values: Vec::new(),
                n_clamped: 0,
            },
            Some(ParamType::Float) => Numbers::Floats(Vec::new()),
            Some(
                ParamType::Point2 | ParamType::Vector2 | ParamType::Blackbody | ParamType::Spectrum,
            ) => Numbers::Pairs(Tuples::new()),
            Some(
                ParamType::Point3
                | ParamType::Vector3
                | ParamType::Normal
                | ParamType::Rgb
                | ParamType::Xyz,
            ) => Numbers::Triples(Tuples::new()),
            Some(ParamType::Bool | ParamType::String | ParamType::Texture) | None => {
                Numbers::Discarded
            }
        };
        let takes_strings = matches!(
            kind,
            Some(ParamType::Bool | ParamType::String | ParamType::Texture | ParamType::Spectrum)
        );
        Self {
            numbers,
            n_numbers: 0,
            strings: takes_strings.then(Vec::new),
            n_strings: 0,
        }
    }

    fn push_number(&mut self, number: Number) {
        self.n_numbers += 1;
        match &mut self.numbers {
            Numbers::Discarded => {}
            Numbers::Integers { values, n_clamped } => push_integer(values, n_clamped, number),
            Numbers::Floats(values) => values.push(number.to_f32()),
            Numbers::Pairs(pairs) => pairs.push(number.to_f32()),
            Numbers::Triples(triples) => triples.push(number.to_f32()),
        }
    }
}

fn push_integer(values: &mut Vec<i32>, n_clamped: &mut usize, number: Number) {
    values.push(number.to_i32().unwrap_or_else(|nearest| {
        *n_clamped += 1;
        nearest
    }));
}

impl Parser<'_> {
    /// Parameters as long as quoted strings follow.
    pub(super) fn params(&mut self) -> ParamList {
        let mut written = Vec::new();
        while let Some(lexeme) = self.tokens.next() {
            if lexeme.kind != Kind::Quoted || self.tokens.report.is_full() {
                self.tokens.push_back(lexeme);
                break;
            }
            match self.param(lexeme) {
                Ok(param) => written.extend(param),
                Err(Resync) => {
                    self.resync();
                    break;
                }
            }
        }
        written.shrink_to_fit();
        let (list, replaced) = ParamList::resolved(written);
        if !replaced.is_empty() {
            self.report_replaced(&replaced, &list);
        }
        list
    }

    /// Says which parameters were given more than once: the last one counts.
    fn report_replaced(&mut self, replaced: &[Param], list: &ParamList) {
        let kept: HashMap<_, _> = list.iter().map(|param| (param.key(), param)).collect();
        for param in replaced {
            if self.only_counts(Severity::Warning, "repeated-parameter") {
                continue;
            }
            let message = format!("\"{}\" is given twice", excerpt(param.name.as_bytes()));
            let found = Diagnostic::warning("repeated-parameter", param.decl_span, message)
                .with_label("this one has no effect");
            self.report(match kept.get(&param.key()) {
                Some(kept) => found.with_note(kept.decl_span, "the last one counts"),
                None => found,
            });
        }
    }

    /// One parameter behind its declaration; `None` when it has to be dropped.
    fn param(&mut self, decl: Lexeme) -> Parsed<Option<Param>> {
        let declared = self.declaration(decl);
        let mut values = Values::of(declared.as_ref().map(|(kind, _)| *kind));
        let value_span = match self.value(decl, &mut values)? {
            ControlFlow::Continue(span) => span,
            ControlFlow::Break(()) => return Ok(None),
        };
        let Some((kind, name)) = declared else {
            return Ok(None);
        };
        let value = self.typed(kind, &name, values, value_span);
        Ok(value.map(|value| Param {
            name,
            value,
            decl_span: decl.span,
            value_span,
        }))
    }

    /// Type and name of a declaration; `None`, and reported, when it has no known type or no name.
    fn declaration(&mut self, decl: Lexeme) -> Option<(ParamType, String)> {
        let text = self.unquote(decl).value;
        let mut words = text.split([' ', '\t']).filter(|word| !word.is_empty());
        let fault = |message: String| {
            Diagnostic::error("malformed-declaration", decl.span, message)
                .with_label("this parameter is ignored")
                .with_help(r#"a parameter is declared as "type name", e.g. "float radius""#)
        };
        let Some(word) = words.next() else {
            self.report(fault("the declaration is empty".into()));
            return None;
        };
        let Some(kind) = ParamType::from_word(word) else {
            if self.only_counts(Severity::Error, "unknown-parameter-type") {
                return None;
            }
            let message = format!("`{}` is no parameter type", excerpt(word.as_bytes()));
            let fault = Diagnostic::error("unknown-parameter-type", decl.span, message)
                .with_label("this parameter is ignored");
            // `int` is too far from `integer` to be a slip of the finger, and still meant.
            let whole =
                || ParamType::words().find(|known| word.len() > 2 && known.starts_with(word));
            self.report(match nearest(word, ParamType::words()).or_else(whole) {
                Some(known) => fault.with_help(format!("did you mean \"{known}\"?")),
                None => fault,
            });
            return None;
        };
        let Some(name) = words.next() else {
            self.report(fault(format!(
                "the declaration \"{}\" has no name",
                kind.word()
            )));
            return None;
        };
        Some((kind, name.to_owned()))
    }

    /// Reads one value or one list into `values` and returns its place; breaks when the parameter is lost but the
    /// parameter list goes on.
    fn value(&mut self, decl: Lexeme, values: &mut Values) -> Parsed<ControlFlow<(), Span>> {
        let first = self.required("a value")?;
        match first.kind {
            Kind::Open => self.list(first, values),
            Kind::Quoted => {
                self.push_string(first, values);
                Ok(ControlFlow::Continue(first.span))
            }
            Kind::Word if !self.is_keyword(first) => {
                let Ok(number) = self.value_number(first) else {
                    // Given back for a resync that is not needed: one token is one value.
                    self.tokens.next();
                    return Ok(ControlFlow::Break(()));
                };
                values.push_number(number);
                Ok(ControlFlow::Continue(first.span))
            }
            _ => {
                if first.kind != Kind::Unterminated {
                    let message = format!("expected a value, found `{}`", self.tokens.shown(first));
                    self.report(
                        Diagnostic::fatal("unexpected-token", first.span, message)
                            .with_note(decl.span, "declared here"),
                    );
                }
                self.tokens.push_back(first);
                Err(Resync)
            }
        }
    }

    /// A list behind its opening bracket.
    fn list(&mut self, open: Lexeme, values: &mut Values) -> Parsed<ControlFlow<(), Span>> {
        loop {
            if values.n_strings == 0 {
                self.plain_numbers(values);
            }
            let Some(lexeme) = self.tokens.next() else {
                let message = "expected `]`, found the end of the scene";
                let end = self.tokens.end();
                self.report(
                    Diagnostic::fatal("unexpected-end", end, message)
                        .with_note(open.span, "the list starts here"),
                );
                return Err(Resync);
            };
            match lexeme.kind {
                Kind::Close => return Ok(ControlFlow::Continue(open.span.to(lexeme.span))),
                Kind::Quoted if values.n_numbers == 0 => self.push_string(lexeme, values),
                Kind::Word if values.n_strings == 0 && !self.is_keyword(lexeme) => {
                    match self.value_number(lexeme) {
                        Ok(number) => values.push_number(number),
                        Err(Resync) => return self.abandon_list(),
                    }
                }
                _ => {
                    let goes_on_behind = self.report_in_list(lexeme, open, values);
                    self.tokens.push_back(lexeme);
                    return if goes_on_behind {
                        Ok(ControlFlow::Break(()))
                    } else {
                        self.abandon_list()
                    };
                }
            }
        }
    }

    /// Takes plain numbers at full speed: the loop is compiled once for each kind of vector.
    fn plain_numbers(&mut self, values: &mut Values) {
        values.n_numbers += match &mut values.numbers {
            Numbers::Discarded => self.tokens.numbers(|_| ()),
            Numbers::Integers { values, n_clamped } => self
                .tokens
                .numbers(|number| push_integer(values, n_clamped, number)),
            Numbers::Floats(values) => self.tokens.numbers(|number| values.push(number.to_f32())),
            Numbers::Pairs(pairs) => self.tokens.numbers(|number| pairs.push(number.to_f32())),
            Numbers::Triples(triples) => {
                self.tokens.numbers(|number| triples.push(number.to_f32()))
            }
        };
    }

    /// Reports a token that cannot stand in a list; whether it reads as what comes behind a forgotten `]`.
    fn report_in_list(&mut self, lexeme: Lexeme, open: Lexeme, values: &Values) -> bool {
        let shown = self.tokens.shown(lexeme);
        let (code, message, is_behind) = match lexeme.kind {
            Kind::Unterminated => return false,
            Kind::Open => ("nested-list", "lists do not nest".to_owned(), false),
            Kind::Word if self.is_keyword(lexeme) => (
                "missing-bracket",
                format!("expected `]`, found the directive `{shown}`"),
                true,
            ),
            Kind::Quoted if values.n_numbers > 0 && self.reads_as_declaration(lexeme) => (
                "missing-bracket",
                format!("expected `]`, found the declaration `{shown}`"),
                true,
            ),
            _ => {
                let kinds = if values.n_numbers > 0 {
                    "string in a list of numbers"
                } else {
                    "word in a list of strings"
                };
                ("mixed-list", format!("`{shown}` is a {kinds}"), false)
            }
        };
        let fault = Diagnostic::fatal(code, lexeme.span, message);
        self.report(fault.with_note(open.span, "the list starts here"));
        is_behind
    }

    /// Whether a string could be the declaration of a parameter.
    fn reads_as_declaration(&self, lexeme: Lexeme) -> bool {
        let text = String::from_utf8_lossy(self.tokens.text(lexeme));
        let mut words = text
            .trim_matches('"')
            .split([' ', '\t'])
            .filter(|word| !word.is_empty());
        words
            .next()
            .is_some_and(|word| ParamType::from_word(word).is_some())
            && words.next().is_some()
    }

    /// Skips to the end of a list that is lost: its bracket, or the keyword behind a forgotten one.
    fn abandon_list(&mut self) -> Parsed<ControlFlow<(), Span>> {
        let mut depth = 1_usize;
        while let Some(lexeme) = self.tokens.next() {
            match lexeme.kind {
                Kind::Open => depth += 1,
                Kind::Close => depth -= 1,
                Kind::Word if self.is_keyword(lexeme) => {
                    self.tokens.push_back(lexeme);
                    break;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
            self.tokens.numbers(|_| ());
        }
        Ok(ControlFlow::Break(()))
    }

    /// A number among values, where a word is most often a boolean without its quotes.
    fn value_number(&mut self, lexeme: Lexeme) -> Parsed<Number> {
        let text = self.tokens.text(lexeme);
        if !matches!(text, b"true" | b"false") {
            return self.number(lexeme);
        }
        let shown = self.tokens.shown(lexeme);
        let message = format!("expected a number or a quoted string, found `{shown}`");
        let help = format!("write \"{shown}\", with quotes");
        self.report(Diagnostic::fatal("unexpected-token", lexeme.span, message).with_help(help));
        self.tokens.push_back(lexeme);
        Err(Resync)
    }

    fn push_string(&mut self, lexeme: Lexeme, values: &mut Values) {
        values.n_strings += 1;
        let value = self.unquote(lexeme);
        if let Some(strings) = &mut values.strings {
            strings.push(value);
        }
    }

    /// The values as their type asks for; `None`, and reported, when they are of the wrong kind.
    fn typed(
        &mut self,
        kind: ParamType,
        name: &str,
        values: Values,
        span: Span,
    ) -> Option<ParamValue> {
        let Values {
            numbers,
            n_strings,
            strings,
            ..
        } = values;
        match (strings, kind) {
            (Some(strings), ParamType::Spectrum) if n_strings > 0 => {
                return Some(ParamValue::SpectrumFiles(unspanned(strings)));
            }
            (Some(strings), ParamType::Bool | ParamType::String | ParamType::Texture)
                if n_strings > 0 =>
            {
                return self.typed_strings(kind, name, strings, span);
            }
            (_, ParamType::Bool | ParamType::String | ParamType::Texture) => {
                return self.wrong_kind(kind, name, "quoted strings", span);
            }
            _ if n_strings > 0 => return self.wrong_kind(kind, name, "numbers", span),
            _ => {}
        }
        Some(match (numbers, kind) {
            (Numbers::Integers { values, n_clamped }, _) => {
                if n_clamped > 0 {
                    let message = format!(
                        "{n_clamped} of {} values do not fit in 32 bits",
                        values.len()
                    );
                    let label = "replaced by the nearest that does";
                    self.report(
                        Diagnostic::warning("integer-overflow", span, message).with_label(label),
                    );
                }
                ParamValue::Integer(trimmed(values))
            }
            (Numbers::Floats(values), _) => ParamValue::Float(trimmed(values)),
            (Numbers::Pairs(pairs), kind) => {
                let pairs = self.whole(kind, pairs, span);
                match kind {
                    ParamType::Point2 => ParamValue::Point2(pairs),
                    ParamType::Vector2 => ParamValue::Vector2(pairs),
                    ParamType::Blackbody => ParamValue::Blackbody(pairs),
                    _ => ParamValue::Spectrum(pairs),
                }
            }
            (Numbers::Triples(triples), kind) => {
                let triples = self.whole(kind, triples, span);
                match kind {
                    ParamType::Point3 => ParamValue::Point3(triples),
                    ParamType::Vector3 => ParamValue::Vector3(triples),
                    ParamType::Normal => ParamValue::Normal(triples),
                    ParamType::Rgb => ParamValue::Rgb(triples),
                    _ => ParamValue::Xyz(triples),
                }
            }
            // Only the string types discard numbers, and those have returned.
            (Numbers::Discarded, _) => return None,
        })
    }

    /// One or more strings as booleans, strings or a texture name.
    fn typed_strings(
        &mut self,
        kind: ParamType,
        name: &str,
        strings: Vec<Spanned<String>>,
        span: Span,
    ) -> Option<ParamValue> {
        match kind {
            ParamType::Bool => Some(ParamValue::Bool(
                strings.iter().map(|string| self.boolean(string)).collect(),
            )),
            ParamType::String => Some(ParamValue::String(unspanned(strings))),
            _ => {
                let n_strings = strings.len();
                let mut names = unspanned(strings);
                if n_strings > 1 {
                    let message = format!(
                        "the texture parameter \"{}\" needs one name",
                        excerpt(name.as_bytes())
                    );
                    let label = format!("{n_strings} names; this parameter is ignored");
                    self.report(
                        Diagnostic::error("wrong-value-count", span, message).with_label(label),
                    );
                    return None;
                }
                names.pop().map(ParamValue::Texture)
            }
        }
    }

    fn boolean(&mut self, string: &Spanned<String>) -> bool {
        if !matches!(string.value.as_str(), "true" | "false")
            && !self.only_counts(Severity::Warning, "malformed-boolean")
        {
            let message = format!("`{}` is no boolean", excerpt(string.value.as_bytes()));
            let label = "read as \"false\"; booleans are \"true\" and \"false\"";
            self.report(
                Diagnostic::warning("malformed-boolean", string.span, message).with_label(label),
            );
        }
        string.value == "true"
    }

    fn wrong_kind(
        &mut self,
        kind: ParamType,
        name: &str,
        wanted: &str,
        span: Span,
    ) -> Option<ParamValue> {
        if self.only_counts(Severity::Error, "wrong-value-kind") {
            return None;
        }
        let message = format!(
            "the {} parameter \"{}\" takes {wanted}",
            kind.word(),
            excerpt(name.as_bytes())
        );
        let label = "this parameter is ignored";
        self.report(Diagnostic::error("wrong-value-kind", span, message).with_label(label));
        None
    }

    /// The whole tuples of a list; surplus numbers are dropped with a warning.
    fn whole<const N: usize>(
        &mut self,
        kind: ParamType,
        tuples: Tuples<N>,
        span: Span,
    ) -> Vec<[f32; N]> {
        if tuples.filled > 0 {
            let n_numbers = tuples.whole.len() * N + tuples.filled;
            let message = format!(
                "{n_numbers} numbers are no multiple of the {N} of a {}",
                kind.word()
            );
            let label = format!(
                "the last {} dropped",
                if tuples.filled == 1 {
                    "one is"
                } else {
                    "two are"
                }
            );
            self.report(Diagnostic::warning("tuple-remainder", span, message).with_label(label));
        }
        trimmed(tuples.whole)
    }
}

/// Gives back what a long list grew beyond its end; short ones are not worth the call.
fn trimmed<T>(mut values: Vec<T>) -> Vec<T> {
    const WORTHWHILE: usize = 1 << 14;
    if values.capacity() > WORTHWHILE {
        values.shrink_to_fit();
    }
    values
}

fn unspanned(strings: Vec<Spanned<String>>) -> Vec<String> {
    strings.into_iter().map(|string| string.value).collect()
}
