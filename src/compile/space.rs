//! Render space: where the numbers of the inner loop live.
//!
//! World space is moved, so that the point of the scene nearest the camera is the origin, and scaled by a power of
//! two, so that the scene is about one unit large. Single precision is then spent where the camera looks, a scene far
//! from the world origin loses nothing, and scaling a scene by 2ᵏ gives the same bits.

use glam::{DAffine3, DMat4, DVec3};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::Span;

use crate::math::Transform;
use crate::math::animated::corners_of;
use crate::math::transform::{image_of_box, power_of_two_near};

/// The map from world to render space.
#[derive(Clone, Copy, Debug)]
pub(super) struct RenderSpace {
    render_from_world: Transform,
    scale: f64,
}

/// A box in world space, in double precision.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldBounds {
    pub(super) min: DVec3,
    pub(super) max: DVec3,
}

impl WorldBounds {
    pub(super) const EMPTY: Self = Self {
        min: DVec3::splat(f64::INFINITY),
        max: DVec3::splat(f64::NEG_INFINITY),
    };

    pub(super) fn add(&mut self, p: DVec3) {
        if p.is_finite() {
            self.min = self.min.min(p);
            self.max = self.max.max(p);
        }
    }

    /// The middle; the origin of an empty box.
    pub(super) fn center(&self) -> DVec3 {
        let center = self.min * 0.5 + self.max * 0.5;
        if center.is_finite() {
            center
        } else {
            DVec3::ZERO
        }
    }

    /// Adds the image of a box.
    pub(super) fn add_image(&mut self, map: &DAffine3, of: &Self) {
        let of = [of.min, of.max];
        let [lo, hi] = image_of_box(map, of);
        if lo.is_finite() && hi.is_finite() {
            self.min = self.min.min(lo);
            self.max = self.max.max(hi);
        } else {
            // Of an empty box nothing is left, of a huge one the corners that are still numbers.
            for corner in corners_of(of) {
                self.add(map.transform_point3(corner));
            }
        }
    }

    pub(super) fn union(self, other: Self) -> Self {
        Self {
            min: self.min.min(other.min),
            max: self.max.max(other.max),
        }
    }
}

impl RenderSpace {
    pub(super) fn new(bounds: WorldBounds, camera: DVec3) -> Self {
        let extent = bounds.max - bounds.min;
        let (origin, size) = if extent.min_element() >= 0.0 {
            (camera.clamp(bounds.min, bounds.max), extent.max_element())
        } else {
            (camera, 0.0)
        };
        let scale = if size > 0.0 && size.is_finite() {
            1.0 / power_of_two_near(size)
        } else {
            1.0
        };
        Self {
            render_from_world: Transform::scale_translate(scale, -origin * scale),
            scale,
        }
    }

    /// Length in render space of one world unit.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    /// The way back.
    pub(super) fn world_from_render(&self) -> Transform {
        self.render_from_world.inverse()
    }

    /// The map itself.
    pub(super) fn affine(&self) -> DAffine3 {
        *self.render_from_world.affine()
    }

    /// Composes with a transform to world space.
    pub(super) fn place(&self, world_from_local: &Transform) -> Transform {
        self.render_from_world.compose(world_from_local)
    }
}

/// An invertible transform from a matrix of the file, or a located error.
pub(super) fn transform(m: DMat4, span: Span, diagnostics: &mut Diagnostics) -> Option<Transform> {
    invertible(Transform::from_matrix(m), span, diagnostics)
}

/// Reports a transform of the file that cannot be inverted, where there is none.
pub(super) fn invertible<T>(
    transform: Option<T>,
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Option<T> {
    if transform.is_none() {
        diagnostics.push(
            Diagnostic::error(
                "bad-transform",
                span,
                "the current transform cannot be inverted",
            )
            .with_label("left out")
            .with_help(
                "a scale of 0, or a matrix that is singular or projective, is in force here",
            ),
        );
    }
    transform
}
