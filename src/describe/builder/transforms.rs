//! Directives that change the current transforms.

use super::Builder;
use crate::describe::transform::{self, Refused};
use glam::DMat4;
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::source::{Span, Spanned};

impl Builder {
    /// Records the warning that came with a matrix.
    fn warned(
        &mut self,
        result: Result<(DMat4, Option<Diagnostic>), Refused>,
    ) -> Result<DMat4, Refused> {
        let (matrix, warning) = result?;
        self.diagnostics.list.extend(warning);
        Ok(matrix)
    }

    pub(super) fn multiply(&mut self, keyword: &str, span: Span, matrix: Result<DMat4, Refused>) {
        match matrix {
            Ok(matrix) => self.change_ctm(keyword, span, |ctm| ctm * matrix),
            Err(refused) => self.diagnostics.push(*refused),
        }
    }

    pub(super) fn change_ctm(
        &mut self,
        keyword: &str,
        span: Span,
        change: impl Fn(DMat4) -> DMat4,
    ) {
        let ctm = self.draft.ctm.changed(change);
        let ends = std::iter::once(&ctm.start).chain(ctm.end.as_deref());
        if ends.into_iter().all(transform::is_usable) {
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
    }

    pub(super) fn look_at(&mut self, eye: [f64; 3], target: [f64; 3], up: [f64; 3], span: Span) {
        let matrix = self.warned(transform::look_at(eye, target, up, span));
        self.multiply("LookAt", span, matrix);
    }

    pub(super) fn transform(&mut self, numbers: [f64; 16], span: Span) {
        match self.warned(transform::matrix(numbers, "Transform", span)) {
            Ok(matrix) => self.change_ctm("Transform", span, |_| matrix),
            Err(refused) => self.diagnostics.push(*refused),
        }
    }

    pub(super) fn concat_transform(&mut self, numbers: [f64; 16], span: Span) {
        let matrix = self.warned(transform::matrix(numbers, "ConcatTransform", span));
        self.multiply("ConcatTransform", span, matrix);
    }

    pub(super) fn transform_times(&mut self, times: [f64; 2], span: Span) {
        match transform::finite(&times, "TransformTimes", span) {
            Ok(()) => self.draft.options.transform_times = Some(times),
            Err(refused) => self.diagnostics.push(*refused),
        }
    }

    pub(super) fn coordinate_system(&mut self, name: Spanned<String>) {
        self.draft
            .coordinate_systems
            .insert(name.value, (self.draft.ctm.pair(), name.span));
    }

    pub(super) fn coord_sys_transform(&mut self, name: &Spanned<String>) {
        match self.draft.coordinate_systems.get(&name.value) {
            Some((pair, _)) => self.draft.ctm = self.draft.ctm.with(pair),
            None => {
                let known = self
                    .draft
                    .coordinate_systems
                    .iter()
                    .map(|(name, (_, span))| (name.as_str(), *span));
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
