//! Transforms of the file, still or moving, checked.

use glam::DAffine3;
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::Span;

use crate::compile::space::{self, WorldBounds};
use crate::describe::description::{InstanceEntity, ObjectRef, TransformPair};
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
    let moving = motion([start, end], times, span, diagnostics);
    Some(moving.map_or(Placement::Still(start), Placement::Moving))
}

/// The motion between two transforms, or a located error.
fn motion(
    keys: [Transform; 2],
    times: [f64; 2],
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Option<Box<AnimatedTransform>> {
    let moving = AnimatedTransform::new(keys, times);
    if moving.is_none() {
        let message = "one of the two key frames mirrors and the other does not";
        diagnostics.push(
            Diagnostic::error("bad-motion", span, message)
                .with_label("the first one is used for both"),
        );
    }
    moving.map(Box::new)
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

/// Where an instance puts its object: there may be millions, so that no inverse is kept.
pub(super) struct InstancePlacement {
    pub(super) object: ObjectRef,
    pub(super) world_from_instance: InstanceMotion,
}

/// World from instance.
pub(super) enum InstanceMotion {
    /// Invertible.
    Still(DAffine3),
    Moving(Box<AnimatedTransform>),
}

/// A map that was found to be invertible, with its inverse.
pub(super) fn with_inverse(map: &DAffine3) -> Transform {
    Transform::from_affine(*map).expect("a placement is invertible")
}

impl InstancePlacement {
    /// World from instance, where a motion starts.
    pub(super) fn start(&self) -> Transform {
        match &self.world_from_instance {
            InstanceMotion::Still(map) => with_inverse(map),
            InstanceMotion::Moving(moving) => moving.keys()[0],
        }
    }

    /// Box around what is placed, itself within `of_object`; motion counts at its key frames.
    pub(super) fn world_bounds(&self, of_object: &WorldBounds) -> WorldBounds {
        let mut bounds = WorldBounds::EMPTY;
        match &self.world_from_instance {
            InstanceMotion::Still(map) => bounds.add_image(map, of_object),
            InstanceMotion::Moving(moving) => moving
                .keys()
                .iter()
                .for_each(|key| bounds.add_image(key.affine(), of_object)),
        }
        bounds
    }

    /// The placement that an instance of the file asks for, or a located error.
    pub(super) fn new(
        entity: InstanceEntity,
        times: [f64; 2],
        diagnostics: &mut Diagnostics,
    ) -> Option<Self> {
        let InstanceEntity {
            object,
            world_from_instance,
            span,
        } = entity;
        let start = *world_from_instance.start();
        let is_invertible = Transform::is_invertible(&start).then_some(());
        space::invertible(is_invertible, span, diagnostics)?;
        let moving = match world_from_instance.end() {
            None => None,
            Some(end) => {
                let end = Transform::from_affine(*end);
                let end = space::invertible(end, span, diagnostics)?;
                let keys = [Transform::from_affine(start)?, end];
                motion(keys, times, span, diagnostics)
            }
        };
        Some(Self {
            object,
            world_from_instance: moving
                .map_or(InstanceMotion::Still(start), InstanceMotion::Moving),
        })
    }
}
