//! Directives that change the current transforms.

use super::Builder;
use crate::describe::state::{CoordinateSystem, Ctm, Flaws};
use crate::describe::transform::{self, LastRow, Refused};
use glam::DMat4;
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::directive::ActiveTransform;
use tyndall_parser::source::{Span, Spanned};

/// What a transform directive does to the current transforms.
#[derive(Clone, Copy)]
pub(super) enum Change {
    Replace(DMat4),
    Multiply(DMat4),
}

impl Builder {
    pub(super) fn multiply(&mut self, keyword: &str, span: Span, matrix: Result<DMat4, Refused>) {
        match matrix {
            Ok(matrix) => {
                self.change_ctm(keyword, span, Change::Multiply(matrix));
            }
            Err(refused) => self.diagnostics.push(*refused),
        }
    }

    /// Changes the active transforms; false, and reported, if that takes them out of range.
    pub(super) fn change_ctm(&mut self, keyword: &str, span: Span, change: Change) -> bool {
        let mut ctm = self.draft.ctm.changed(|ctm| match change {
            Change::Replace(matrix) => matrix,
            Change::Multiply(matrix) => ctm * matrix,
        });
        let ends = std::iter::once(&ctm.start).chain(ctm.end.as_deref());
        // What had no inverse before has none again, whatever rounding says.
        let flawed = |ctm: &Ctm| ctm.flaws.as_deref().is_some_and(Flaws::is_any);
        let (Change::Replace(factor) | Change::Multiply(factor)) = change;
        // Rounding may leave a singular matrix something like an inverse.
        let is_singular = transform::is_singular(&factor);
        let is_plain = !flawed(&ctm) && !is_singular && ends.clone().all(transform::is_usable);
        let fits = is_plain || self.find_flaws(&mut ctm, change, is_singular, span);
        if fits {
            self.draft.ctm = ctm;
        } else {
            self.diagnostics.push(
                Diagnostic::error(
                    "out-of-range",
                    span,
                    format!("{keyword} takes the current transform out of single precision"),
                )
                .with_label("this transform is left out"),
            );
        }
        fits
    }

    /// Notes which of the changed transforms have no inverse; false if one is out of range.
    fn find_flaws(&mut self, ctm: &mut Ctm, change: Change, is_singular: bool, span: Span) -> bool {
        let mut flaws = ctm.flaws.take().map_or_else(Flaws::default, |flaws| *flaws);
        let matrices = [ctm.start, ctm.pair().end];
        for end in self.active_ends() {
            let matrix = &matrices[end];
            if let Change::Replace(_) = change {
                (flaws.singular[end], flaws.projective[end]) = (None, None);
            }
            if is_singular {
                flaws.singular[end].get_or_insert(span);
            } else if flaws.singular[end].is_none() && !transform::is_usable(matrix) {
                return false;
            }
            if !transform::is_in_range(matrix) {
                return false;
            }
        }
        ctm.flaws = flaws.is_any().then(|| Box::new(flaws));
        true
    }

    /// The ends of the motion that transform directives change.
    fn active_ends(&self) -> std::ops::Range<usize> {
        match self.draft.ctm.active {
            ActiveTransform::All => 0..2,
            ActiveTransform::StartTime => 0..1,
            ActiveTransform::EndTime => 1..2,
        }
    }

    pub(super) fn look_at(&mut self, eye: [f64; 3], target: [f64; 3], up: [f64; 3], span: Span) {
        let matrix = transform::look_at(eye, target, up, span).map(|(matrix, warning)| {
            self.diagnostics.extend(warning);
            matrix
        });
        self.multiply("LookAt", span, matrix);
    }

    pub(super) fn transform(&mut self, numbers: [f64; 16], span: Span) {
        self.matrix(numbers, "Transform", span, Change::Replace);
    }

    pub(super) fn concat_transform(&mut self, numbers: [f64; 16], span: Span) {
        self.matrix(numbers, "ConcatTransform", span, Change::Multiply);
    }

    fn matrix(
        &mut self,
        numbers: [f64; 16],
        keyword: &str,
        span: Span,
        change: fn(DMat4) -> Change,
    ) {
        let (matrix, last_row) = match transform::matrix(numbers, keyword, span) {
            Ok(found) => found,
            Err(refused) => {
                self.diagnostics.push(*refused);
                return;
            }
        };
        if !self.change_ctm(keyword, span, change(matrix)) {
            return;
        }
        match last_row {
            LastRow::Affine => {}
            LastRow::Rounding => self.diagnostics.push(transform::projective(span, false)),
            LastRow::Projective => {
                // Whether it matters is known when something stands below it.
                self.draft.projective.push(span);
                for end in self.active_ends() {
                    let flaws = self.draft.ctm.flaws.get_or_insert_default();
                    flaws.projective[end].get_or_insert(span);
                }
            }
        }
    }

    /// Reports the projective matrices that nothing was below.
    pub(super) fn report_idle_matrices(&mut self) {
        for span in std::mem::take(&mut self.draft.projective) {
            if !self.draft.reported_transforms.contains(&span) {
                self.diagnostics.push(transform::projective(span, false));
            }
        }
    }

    /// Whether something that stands here is hidden by a transform without an inverse, as by `Scale 0 0 0`; the first
    /// thing below each is reported, as is the first below a projective matrix.
    pub(super) fn is_hidden(&mut self, what: &str, span: Span) -> bool {
        let Some(flaws) = self.draft.ctm.flaws.as_deref() else {
            return false;
        };
        let hidden_by = self.draft.ctm.hidden_by();
        let bent_by = flaws.projective.iter().flatten().copied().next();
        if let Some(by) = hidden_by {
            if self.draft.reported_transforms.insert(by) {
                self.diagnostics.push(
                    Diagnostic::warning(
                        "singular-transform",
                        by,
                        "this transform has no inverse: what is below it vanishes",
                    )
                    .with_label("flattens space")
                    .with_note(span, format!("{what} is not seen"))
                    .with_help(
                        "a flat shape needs no scale: disk and trianglemesh are flat by themselves",
                    ),
                );
            }
            return true;
        }
        if let Some(by) = bent_by
            && self.draft.reported_transforms.insert(by)
        {
            let found = transform::projective(by, true);
            self.diagnostics
                .push(found.with_note(span, format!("{what} is below it")));
        }
        false
    }

    pub(super) fn transform_times(&mut self, times: [f64; 2], span: Span) {
        match transform::finite(&times, "TransformTimes", span) {
            Ok(()) => self.draft.options.transform_times = Some(times),
            Err(refused) => self.diagnostics.push(*refused),
        }
    }

    pub(super) fn coordinate_system(&mut self, name: Spanned<String>) {
        let ctm = &self.draft.ctm;
        let system = CoordinateSystem {
            pair: ctm.pair(),
            flaws: ctm.flaws.clone(),
            span: name.span,
        };
        self.draft.coordinate_systems.insert(name.value, system);
    }

    pub(super) fn coord_sys_transform(&mut self, name: &Spanned<String>) {
        match self.draft.coordinate_systems.get(&name.value) {
            Some(system) => {
                self.draft.ctm = Ctm {
                    flaws: system.flaws.clone(),
                    ..self.draft.ctm.with(&system.pair)
                };
            }
            None => {
                let known = self
                    .draft
                    .coordinate_systems
                    .iter()
                    .map(|(name, system)| (name.as_str(), system.span));
                let diagnostic = self.suggester.unknown(
                    "unknown-coordinate-system",
                    name,
                    "coordinate system",
                    known,
                );
                self.diagnostics
                    .push(diagnostic.with_label("the current transform stays as it is"));
            }
        }
    }

    /// Warns that only the start of a motion is used.
    pub(super) fn warn_if_animated(&mut self, what: &str, span: Span) {
        if self.draft.ctm.is_animated() {
            self.diagnostics.push(
                Diagnostic::warning("animation-ignored", span, format!("{what} cannot move"))
                    .with_label("the transform at the start of the motion is used"),
            );
        }
    }
}
