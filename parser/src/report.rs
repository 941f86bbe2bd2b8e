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
        let key = (diagnostic.code, diagnostic.severity);
        let slot = self
            .counts
            .iter_mut()
            .find(|(code, severity, _)| (*code, *severity) == key);
        let count = match slot {
            Some((_, _, count)) => {
                *count += 1;
                *count
            }
            None => {
                self.counts.push((key.0, key.1, 1));
                1
            }
        };
        if count <= MAX_PER_CODE {
            self.kept.push(diagnostic);
        }
    }

    /// Counts a finding of which so many were kept that this one would not be, and says so: it need not be put into words.
    pub(crate) fn only_counts(&mut self, severity: Severity, code: &'static str) -> bool {
        let key = (code, severity);
        let slot = self.counts.iter_mut().find(|(c, s, _)| (*c, *s) == key);
        let Some((_, _, count)) = slot.filter(|(_, _, count)| *count >= MAX_PER_CODE) else {
            return false;
        };
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
