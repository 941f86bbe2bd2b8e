//! Render space: where the numbers of the inner loop live.
//!
//! World space is moved, so that the origin is near the nearest point of what is before the camera, and scaled by a power of
//! two, so that the scene is about one unit large. Single precision is then spent where the camera looks, a scene far
//! from the world origin loses nothing, and scaling a scene by 2ᵏ gives the same bits. What lies beside the picture
//! moves nothing: it may change the scale, which changes no digit.

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

/// What a camera may see without mirrors, in world space: the part of space within five planes.
pub(super) struct View {
    /// Where the camera stands.
    pub(super) eye: DVec3,
    /// A point and the inward normal of each plane. Without any, everything may be seen.
    pub(super) planes: Option<[(DVec3, DVec3); 5]>,
}

/// A place of the scene near a camera.
#[derive(Clone, Copy)]
pub(super) struct NearPlace {
    distance2: f64,
    p: DVec3,
    /// Largest extent of what is there.
    reach: f64,
}

impl NearPlace {
    /// The nearer one; of equally near ones that with the smaller numbers, so that order decides nothing.
    pub(super) fn nearer(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        let (Some(x), Some(y)) = (a, b) else {
            return a.or(b);
        };
        let key = |place: &Self| {
            let NearPlace {
                distance2,
                p,
                reach,
            } = *place;
            [distance2, p.x, p.y, p.z, reach]
        };
        if key(&y) < key(&x) { b } else { a }
    }
}

impl View {
    /// The point of a box nearest the camera, if the box reaches into the view.
    pub(super) fn nearest_of(&self, bounds: &WorldBounds) -> Option<NearPlace> {
        let is_within = (bounds.max - bounds.min).min_element() >= 0.0
            && self.planes.iter().flatten().all(|&(at, inward)| {
                let farthest = DVec3::select(inward.cmpge(DVec3::ZERO), bounds.max, bounds.min);
                (farthest - at).dot(inward) >= 0.0
            });
        let p = self.eye.clamp(bounds.min.min(bounds.max), bounds.max);
        is_within.then_some(NearPlace {
            distance2: p.distance_squared(self.eye),
            p,
            reach: (bounds.max - bounds.min).max_element(),
        })
    }

    /// The origin of render space: the camera, but not farther from the nearest place than what is there is large. The
    /// place itself often lies in the plane of a floor or a wall. Where all coordinates across a plane are 0, so are the
    /// bounds of their errors, and whether a ray that leaves the plane meets it again takes a closer look each time.
    pub(super) fn origin(&self, nearest: Option<NearPlace>) -> DVec3 {
        let Some(NearPlace {
            distance2,
            p,
            reach,
        }) = nearest
        else {
            return self.eye;
        };
        let distance = distance2.sqrt();
        if distance > reach {
            p + (self.eye - p) * (reach / distance)
        } else {
            self.eye
        }
    }
}

impl RenderSpace {
    /// With the given place of the world as the origin, for a scene within `bounds`.
    pub(super) fn new(bounds: WorldBounds, origin: DVec3) -> Self {
        let extent = bounds.max - bounds.min;
        let size = if extent.min_element() >= 0.0 {
            extent.max_element()
        } else {
            0.0
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
