//! Typed access to the tables of a suite. Whatever is wrong is a located finding, and reading goes on.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use tyndall_parser::FileId;
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema;
use tyndall_parser::source::Span;

/// Walks the tree of a suite; all faults are reported at once.
pub(super) struct Reader {
    file: FileId,
    pub(super) found: Diagnostics,
}

/// A table whose keys are taken out one by one; what is left at the end is unknown.
pub(super) struct Table<'i> {
    entries: DeTable<'i>,
    span: Range<usize>,
    /// What the table describes, with its article.
    what: &'static str,
    asked: Vec<&'static str>,
}

impl<'i> Table<'i> {
    pub(super) fn new(entries: DeTable<'i>, span: Range<usize>, what: &'static str) -> Self {
        Self {
            entries,
            span,
            what,
            asked: Vec::new(),
        }
    }

    pub(super) fn take(&mut self, key: &'static str) -> Option<Spanned<DeValue<'i>>> {
        self.asked.push(key);
        self.entries.remove(key)
    }
}

impl Reader {
    /// Of the file `file`, without a finding yet.
    pub(super) fn new(file: FileId) -> Self {
        Self {
            file,
            found: Diagnostics::new(),
        }
    }

    /// The tree of the file. `None` if it is not TOML.
    pub(super) fn document<'i>(&mut self, text: &'i str, what: &'static str) -> Option<Table<'i>> {
        let (document, errors) = DeTable::parse_recoverable(text);
        for error in &errors {
            let span = error.span().unwrap_or_default();
            self.error("bad-toml", span, error.message().to_owned());
        }
        // Nobody is told of a key that is missing from the whole file at a place in it.
        errors
            .is_empty()
            .then(|| Table::new(document.into_inner(), 0..0, what))
    }

    /// A string that must be there.
    pub(super) fn needed(&mut self, table: &mut Table<'_>, key: &'static str) -> Option<String> {
        let value = self.needed_value(table, key);
        value.and_then(|value| self.text(value, key))
    }

    /// A value that must be there.
    pub(super) fn needed_value<'i>(
        &mut self,
        table: &mut Table<'i>,
        key: &'static str,
    ) -> Option<Spanned<DeValue<'i>>> {
        let value = table.take(key);
        if value.is_none() {
            let message = format!("{} needs a \"{key}\"", table.what);
            self.error("missing-key", table.span.clone(), message);
        }
        value
    }

    /// A string that may be there.
    pub(super) fn string(&mut self, table: &mut Table<'_>, key: &'static str) -> Option<String> {
        let value = table.take(key)?;
        self.text(value, key)
    }

    /// A string.
    pub(super) fn text(&mut self, value: Spanned<DeValue<'_>>, key: &str) -> Option<String> {
        let span = value.span();
        match value.into_inner() {
            DeValue::String(text) => Some(text.into_owned()),
            other => self.mismatch(span, key, "a string", &other),
        }
    }

    /// True or false; false if it is not there.
    pub(super) fn flag(&mut self, table: &mut Table<'_>, key: &'static str) -> bool {
        let Some(value) = table.take(key) else {
            return false;
        };
        let span = value.span();
        match value.into_inner() {
            DeValue::Boolean(flag) => flag,
            other => self
                .mismatch(span, key, "true or false", &other)
                .unwrap_or_default(),
        }
    }

    /// A number above 0.
    pub(super) fn number(&mut self, table: &mut Table<'_>, key: &'static str) -> Option<f64> {
        let value = table.take(key)?;
        self.above_zero(value, key)
    }

    fn above_zero(&mut self, value: Spanned<DeValue<'_>>, key: &str) -> Option<f64> {
        let span = value.span();
        let number = match value.get_ref() {
            DeValue::Integer(number) if number.radix() == 10 => number.as_str().parse().ok(),
            DeValue::Float(number) => number.as_str().parse().ok(),
            _ => None,
        };
        let number = number.filter(|number: &f64| number.is_finite() && *number > 0.0);
        number.or_else(|| self.mismatch(span, key, "a number above 0", value.get_ref()))
    }

    /// An integer from 1 to `max`.
    pub(super) fn count(
        &mut self,
        table: &mut Table<'_>,
        key: &'static str,
        max: u32,
    ) -> Option<u32> {
        let value = table.take(key)?;
        self.integer(&value, key, max)
    }

    fn integer(&mut self, value: &Spanned<DeValue<'_>>, key: &str, max: u32) -> Option<u32> {
        let number = match value.get_ref() {
            DeValue::Integer(number) => u32::from_str_radix(number.as_str(), number.radix()).ok(),
            _ => None,
        };
        let number = number.filter(|number| (1..=max).contains(number));
        let wanted = format!("an integer from 1 to {max}");
        number.or_else(|| self.mismatch(value.span(), key, &wanted, value.get_ref()))
    }

    /// Integers that grow.
    pub(super) fn counts(&mut self, table: &mut Table<'_>, key: &'static str) -> Option<Vec<u32>> {
        let value = table.take(key)?;
        let span = value.span();
        let DeValue::Array(list) = value.into_inner() else {
            let message = format!("\"{key}\" is a list of sample counts, such as [4, 16, 64]");
            self.error("bad-type", span, message);
            return None;
        };
        let counts: Option<Vec<u32>> = list
            .iter()
            .map(|count| self.integer(count, key, u32::MAX))
            .collect();
        let counts = counts?;
        if counts.is_empty() || counts.windows(2).any(|pair| pair[0] >= pair[1]) {
            let message =
                format!("the sample counts of \"{key}\" must grow, and there must be one");
            self.error("bad-range", span, message);
            return None;
        }
        Some(counts)
    }

    /// A figure of the third renderer and one of the peer.
    pub(super) fn pair(&mut self, table: &mut Table<'_>, key: &'static str) -> Option<[f64; 2]> {
        let value = table.take(key)?;
        let span = value.span();
        match value.into_inner() {
            DeValue::Array(list) if list.len() == 2 => {
                let mut numbers = list.into_iter().map(|value| self.above_zero(value, key));
                let (third, peer) = (numbers.next().flatten(), numbers.next().flatten());
                Some([third?, peer?])
            }
            other => self.mismatch(
                span,
                key,
                "a list of two numbers, of the known renderer and of the peer",
                &other,
            ),
        }
    }

    /// The tables of an array.
    pub(super) fn tables<'i>(
        &mut self,
        table: &mut Table<'i>,
        key: &'static str,
    ) -> Vec<Table<'i>> {
        let Some(value) = table.take(key) else {
            return Vec::new();
        };
        let span = value.span();
        let DeValue::Array(list) = value.into_inner() else {
            let message = format!("write [[{key}]], with two brackets, for each {key}");
            self.error("bad-type", span, message);
            return Vec::new();
        };
        let tables = list.into_iter().filter_map(|entry| {
            let span = entry.span();
            match entry.into_inner() {
                DeValue::Table(entries) => Some(Table::new(entries, span, "a scene")),
                other => self.mismatch(span, key, "a table", &other),
            }
        });
        tables.collect()
    }

    /// The tables below `key` in the order of the file.
    pub(super) fn named_tables<'i>(
        &mut self,
        table: &mut Table<'i>,
        key: &'static str,
        what: &'static str,
    ) -> Vec<(Spanned<String>, Table<'i>)> {
        let Some(value) = table.take(key) else {
            return Vec::new();
        };
        let span = value.span();
        let DeValue::Table(entries) = value.into_inner() else {
            let message = format!("write [{key}.NAME]: what stands below \"{key}\" has a name");
            self.error("bad-type", span, message);
            return Vec::new();
        };
        let mut tables: Vec<_> = entries
            .into_iter()
            .filter_map(|(name, value)| {
                let (name_span, span) = (name.span(), value.span());
                let name = Spanned::new(name_span, name.into_inner().into_owned());
                match value.into_inner() {
                    DeValue::Table(entries) => Some((name, Table::new(entries, span, what))),
                    other => self.mismatch(span, key, "a table", &other),
                }
            })
            .collect();
        tables.sort_by_key(|(name, _)| name.span().start);
        tables
    }

    /// Reports the keys that nobody asked for.
    pub(super) fn finish(&mut self, table: Table<'_>) {
        for key in table.entries.keys() {
            let name = key.get_ref();
            let message = format!("{} has no key \"{name}\"", table.what);
            let help = schema::did_you_mean(name, table.asked.iter().copied());
            let help = help.unwrap_or_else(|| format!("there are {}", table.asked.join(", ")));
            self.push("unknown-key", key.span(), message, Some(help));
        }
    }

    fn mismatch<T>(
        &mut self,
        span: Range<usize>,
        key: &str,
        wanted: &str,
        found: &DeValue<'_>,
    ) -> Option<T> {
        let message = format!("\"{key}\" must be {wanted}");
        let place = self.span(&span);
        let finding = Diagnostic::error("bad-type", place, message);
        self.found
            .push(finding.with_label(format!("this is a value of type {}", found.type_str())));
        None
    }

    /// Reports a fault.
    pub(super) fn error(&mut self, code: &'static str, span: Range<usize>, message: String) {
        self.push(code, span, message, None);
    }

    /// Reports a fault, and how to mend it.
    pub(super) fn push(
        &mut self,
        code: &'static str,
        span: Range<usize>,
        message: String,
        help: Option<String>,
    ) {
        let finding = Diagnostic::error(code, self.span(&span), message);
        self.found.push(match help {
            Some(help) => finding.with_help(help),
            None => finding,
        });
    }

    fn span(&self, span: &Range<usize>) -> Span {
        // Longer suites than 4 GiB point at their end.
        let place = |offset: usize| u32::try_from(offset).unwrap_or(u32::MAX);
        Span::new(self.file, place(span.start), place(span.end))
    }
}
