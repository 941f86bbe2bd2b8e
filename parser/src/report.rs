//! The findings of one parse, kept to a sensible number whatever the input.

use crate::diagnostic::{Diagnostic, Diagnostics, Severity};

/// Findings of one code that are kept; the rest is counted.
const MAX_PER_CODE: usize = 50;
/// Fatal errors after which parsing stops.
const MAX_FATAL: usize = 50;

/// Collects findings; see the constants for what it does not keep.
#[derive(Default)]
pub(crate) struct Report {
    kept: Diagnostics,
    /// How often each code occurred, in order of first occurrence. There are few codes.
    counts: Vec<(&'static str, Severity, usize)>,
    n_fatal: usize,
}

impl Report {
    /// Records a finding.
    pub(crate) fn push(&mut self, diagnostic: Diagnostic) {
        self.n_fatal += usize::from(diagnostic.severity == Severity::Fatal);
        let count = self.count_of(diagnostic.severity, diagnostic.code);
        *count += 1;
        if *count <= MAX_PER_CODE {
            self.kept.push(diagnostic);
        }
    }

    /// How many findings of a kind there were.
    fn count_of(&mut self, severity: Severity, code: &'static str) -> &mut usize {
        let of_kind = |(c, s, _): &(&str, Severity, usize)| (*c, *s) == (code, severity);
        let index = self.counts.iter().position(of_kind);
        let index = index.unwrap_or_else(|| {
            self.counts.push((code, severity, 0));
            self.counts.len() - 1
        });
        &mut self.counts[index].2
    }

    /// Counts a finding of which so many were kept that this one would not be, and says so: it need not be put into words.
    pub(crate) fn only_counts(&mut self, severity: Severity, code: &'static str) -> bool {
        let count = self.count_of(severity, code);
        if *count < MAX_PER_CODE {
            return false;
        }
        *count += 1;
        self.n_fatal += usize::from(severity == Severity::Fatal);
        true
    }

    /// Whether going on would only repeat what is already said.
    pub(crate) fn is_full(&self) -> bool {
        self.n_fatal >= MAX_FATAL
    }

    /// What was found, with one line for each code of which more was found than kept.
    pub(crate) fn finish(mut self) -> Diagnostics {
        let gave_up = self.is_full();
        for (code, severity, count) in self.counts {
            if count > MAX_PER_CODE {
                let message = format!(
                    "{} more of the kind `{code}` are not shown",
                    count - MAX_PER_CODE
                );
                self.kept
                    .push(Diagnostic::new(severity, code, None, message));
            }
        }
        if gave_up {
            let message = "too many errors: the rest of the scene was not read".to_owned();
            self.kept.push(Diagnostic::new(
                Severity::Fatal,
                "too-many-errors",
                None,
                message,
            ));
        }
        self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_only_counted_is_counted_as_what_is_told() {
        let told = |is_short: bool| {
            let mut report = Report::default();
            for _ in 0..MAX_PER_CODE + 7 {
                if !(is_short && report.only_counts(Severity::Warning, "kind")) {
                    report.push(Diagnostic::new(
                        Severity::Warning,
                        "kind",
                        None,
                        "it".into(),
                    ));
                }
            }
            let found = report.finish();
            let messages = found.list.iter().map(|found| found.message.clone());
            messages.collect::<Vec<String>>()
        };
        assert_eq!(told(true), told(false));
        assert_eq!(told(true).len(), MAX_PER_CODE + 1);
        assert!(told(true)[MAX_PER_CODE].starts_with("7 more"));
    }
}
