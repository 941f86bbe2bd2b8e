//! Transforms of the file, still or moving, checked.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::Span;

use crate::compile::space;
use crate::describe::description::TransformPair;
use crate::math::{AnimatedTransform, Transform};

/// A transform of the file, made ready.
#[derive(Clone)]
pub(super) enum Placement {
    Still(Transform),
    Moving(Box<AnimatedTransform>),
}

/// A transform pair of the file, or a located error. The end is heeded only where it differs.
pub(super) fn placement(
    pair: TransformPair,
    times: [f64; 2],
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Option<Placement> {
    let start = space::transform(pair.start, span, diagnostics)?;
    if !pair.is_animated() {
        return Some(Placement::Still(start));
    }
    let end = space::transform(pair.end, span, diagnostics)?;
    let moving = AnimatedTransform::new([start, end], times);
    if moving.is_none() {
        let message = "one of the two key frames mirrors and the other does not";
        diagnostics.push(
            Diagnostic::error("bad-motion", span, message)
                .with_label("the first one is used for both"),
        );
    }
    Some(moving.map_or(Placement::Still(start), |moving| {
        Placement::Moving(Box::new(moving))
    }))
}

impl Placement {
    /// The transforms at the two key frames.
    pub(super) fn ends(&self) -> [Transform; 2] {
        match self {
            Self::Still(transform) => [*transform; 2],
            Self::Moving(moving) => moving.keys(),
        }
    }
}
