//! Names: scoped maps, and what to say about a name that is not in one.

use std::collections::HashMap;
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::schema;
use tyndall_parser::source::{Span, Spanned};

/// A map whose changes can be undone back to a mark. A scope costs what was defined in it, however large the map.
#[derive(Debug)]
pub(super) struct Scoped<T> {
    map: HashMap<String, T>,
    /// What each name meant before each definition, oldest first.
    undo: Vec<(String, Option<T>)>,
}

impl<T> Default for Scoped<T> {
    fn default() -> Self {
        Self {
            map: HashMap::new(),
            undo: Vec::new(),
        }
    }
}

impl<T: Copy> Scoped<T> {
    /// What the name means now.
    pub(super) fn get(&self, name: &str) -> Option<T> {
        self.map.get(name).copied()
    }

    /// Gives the name a meaning until the enclosing scope ends; returns the one it had.
    pub(super) fn define(&mut self, name: &str, value: T) -> Option<T> {
        let before = self.map.insert(name.to_owned(), value);
        self.undo.push((name.to_owned(), before));
        before
    }

    /// A mark to return to.
    pub(super) fn mark(&self) -> usize {
        self.undo.len()
    }

    /// Undoes every definition since the mark.
    pub(super) fn undo_to(&mut self, mark: usize) {
        while self.undo.len() > mark {
            let Some((name, before)) = self.undo.pop() else {
                return;
            };
            match before {
                Some(value) => self.map.insert(name, value),
                None => self.map.remove(&name),
            };
        }
    }

    /// Every name defined now.
    pub(super) fn values(&self) -> impl Iterator<Item = T> {
        self.map.values().copied()
    }
}

/// Makes diagnostics about unknown names. Only the first few look for what was meant, since each
/// search goes through every name there is.
#[derive(Debug)]
pub(super) struct Suggester {
    left: u32,
}

impl Default for Suggester {
    fn default() -> Self {
        Self { left: 100 }
    }
}

impl Suggester {
    /// An error about an unknown name, with the nearest of the known ones and where that was defined.
    pub(super) fn unknown<'a>(
        &mut self,
        code: &'static str,
        name: &Spanned<String>,
        what: &str,
        known: impl Iterator<Item = (&'a str, Span)>,
    ) -> Diagnostic {
        let message = format!("there is no {what} \"{}\" here", name.value);
        let diagnostic = Diagnostic::error(code, name.span, message);
        match self.nearest(&name.value, known) {
            Some((meant, span)) => diagnostic
                .with_help(format!("did you mean \"{meant}\"?"))
                .with_note(span, format!("\"{meant}\" is defined here")),
            None => diagnostic,
        }
    }

    /// The nearest of the known names and where it was defined.
    pub(super) fn nearest<'a>(
        &mut self,
        name: &str,
        known: impl Iterator<Item = (&'a str, Span)>,
    ) -> Option<(&'a str, Span)> {
        self.left = self.left.checked_sub(1)?;
        // In the order of the file, so that equally near names do not depend on a hash.
        let mut known: Vec<_> = known.collect();
        known.sort_by_key(|(_, span)| (span.file, span.lo));
        let meant = schema::nearest(name, known.iter().map(|(name, _)| *name))?;
        known.into_iter().find(|(name, _)| *name == meant)
    }
}

#[cfg(test)]
mod tests {
    use super::Scoped;

    #[test]
    fn a_scope_ends_with_every_name_as_it_was() {
        let mut names = Scoped::default();
        assert_eq!(names.define("a", 1), None);
        let outer = names.mark();
        assert_eq!(names.define("a", 2), Some(1));
        names.define("b", 3);
        let inner = names.mark();
        names.define("a", 4);
        names.undo_to(inner);
        assert_eq!((names.get("a"), names.get("b")), (Some(2), Some(3)));
        names.undo_to(outer);
        assert_eq!((names.get("a"), names.get("b")), (Some(1), None));
        assert_eq!(names.values().collect::<Vec<_>>(), [1]);
    }
}
