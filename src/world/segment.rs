//! Straight segments between two points, and what stands between them.

use crate::ids::InstanceId;
use crate::math::error::offset_origin;
use crate::math::{Point3, Ray, Vec3};
use crate::shape::Shape;
use crate::world::{ElementRef, Hit, Receiver, World};

/// From one point toward another, or toward infinity.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    pub(super) ray: Ray,
    /// Distance to the point aimed at.
    pub(super) t_max: f32,
    /// The surface which that point is on.
    pub(super) aim: Option<Aim>,
    /// The light without extent that it ends at, if that may lie on a surface.
    pub(super) light: Option<Point3>,
}

/// The surface a segment ends on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Aim {
    /// The element.
    pub target: ElementRef,
    /// The instance it is in.
    pub instance: InstanceId,
    /// It is met on the side its normal points away from.
    pub from_behind: bool,
}

impl Segment {
    /// From a receiver to a point roughly in the unit direction `wi`.
    pub(super) fn new(at: &Receiver, to: Point3, wi: Vec3, aim: Option<Aim>) -> Self {
        let o = offset_origin(at.p, at.p_err, at.ng, wi);
        let toward = to - o;
        let t_max = toward.length();
        let d = if t_max > 0.0 { toward / t_max } else { wi };
        let time = at.time;
        Self {
            ray: Ray { o, d, time },
            t_max,
            aim,
            light: None,
        }
    }

    /// From a receiver in the unit direction `wi`.
    pub(super) fn to_infinity(at: &Receiver, wi: Vec3) -> Self {
        Self {
            ray: Ray {
                o: offset_origin(at.p, at.p_err, at.ng, wi),
                d: wi,
                time: at.time,
            },
            t_max: f32::INFINITY,
            aim: None,
            light: None,
        }
    }

    /// From one point to another. `None` if they are the same.
    pub fn between(from: &Receiver, to: &Receiver, aim: Option<Aim>) -> Option<Self> {
        let wi = (to.p - from.p).try_normalize()?;
        let end = offset_origin(to.p, to.p_err, to.ng, -wi);
        Some(Self::new(from, end, wi, aim))
    }
}

impl World {
    /// Whether a surface that was found on a segment stands between its ends. The flat element that holds the point
    /// aimed at cannot, and of a piece of a curve the point is the nearest there is. A line meets a surface of second
    /// degree at most twice, and passes from one side of it to the other each time, whatever part of the surface exists:
    /// a hit from the side that is aimed at is the point itself.
    #[inline]
    pub(super) fn stands_between(&self, segment: &Segment, hit: &Hit) -> bool {
        let Some(aim) = segment.aim else {
            // A light on a surface lights it.
            return segment
                .light
                .is_none_or(|p| !self.holds_point(&segment.ray, hit, p));
        };
        if aim.target != hit.target || aim.instance != hit.instance {
            return true;
        }
        match &self.geometry(hit.target.geometry).shape {
            Shape::Mesh(_) | Shape::Curves(_) => false,
            Shape::Quadric(quadric) => {
                let ng = if hit.instance.is_some() {
                    self.surface(&segment.ray, hit).n_surface
                } else {
                    quadric.normal(&segment.ray, hit.at.t)
                };
                (ng.dot(segment.ray.d) > 0.0) != aim.from_behind
            }
        }
    }
}
