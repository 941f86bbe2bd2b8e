//! Surfaces in one place: what a ray meets first where rounding does not tell.
//!
//! Files fill a room with fog by a box as large as the room, cut one fog in two boxes that share a face, or lay a lamp
//! into a ceiling. Surfaces whose distance is within the rounding errors of both are met in one order from either side: a
//! lamp that scatters, another opaque surface, a null surface that emits, any other. Behind an opaque surface, and behind
//! a null one, are all boundaries of media that were in its place: a path comes out in the medium that they lead to.
//!
//! Which elements may share a place with others is found at load ([`find`]), and asked by nothing else. What a ray meets in
//! one place is then gathered by a query of its own, and the offsets of rays that leave it clear all of it.

mod find;
mod overlaps;
mod pairs;

use std::cell::RefCell;

use arrayvec::ArrayVec;

use crate::ids::{GeometryId, InstanceId, LightId, MediumId};
use crate::math::error::{EPSILON, gamma};
use crate::math::{Normal3, Point3, Ray, Vec3};
use crate::shape::{ElementHit, Place, Shape};
use crate::world::{ElementRef, Hit, World};

/// Most surfaces in one place that are told apart; a mesh whose edge is met counts twice.
const MAX_MEMBERS: usize = 32;
/// Extent of the widest stack that is looked for, over the largest error of its members: each of them may reach farther
/// than the one before by the errors of both.
const WIDEST: f32 = 16.0;

/// What may share its place with other surfaces.
#[derive(Clone, Debug)]
pub(super) struct Stacks {
    /// A bit for each element, by geometry; nothing for geometries without.
    elements: Vec<Vec<u64>>,
    /// Lights without extent that may lie on a surface, a bit for each light.
    lights: Vec<u64>,
    /// No place of these is farther from where it should be, in any coordinate.
    error: f32,
    /// A rank of each geometry by its content, to choose among opaque ones.
    order: Vec<u32>,
    /// Opaque ones in one place that look different.
    overlaps: Vec<[GeometryId; 2]>,
}

/// Another surface where a ray meets one.
#[derive(Clone, Copy)]
struct Member {
    hit: Hit,
    place: Place,
    /// How far it lies off the plane of the first, and by how much that may be wrong.
    off: f32,
    error: f32,
}

/// All others where a ray meets a surface.
struct Stack {
    others: ArrayVec<Member, MAX_MEMBERS>,
    /// How far from the plane of the first surface they may lie.
    reach: f32,
}

fn is_set(bits: &[u64], index: usize) -> bool {
    bits.get(index / 64)
        .is_some_and(|word| word >> (index % 64) & 1 == 1)
}

impl Stacks {
    fn holds(&self, target: ElementRef) -> bool {
        is_set(
            &self.elements[target.geometry.index()],
            target.element as usize,
        )
    }
}

impl World {
    /// Whether a surface may share its place with others.
    #[inline]
    pub(super) fn may_be_stacked(&self, target: ElementRef) -> bool {
        self.stacks
            .as_ref()
            .is_some_and(|stacks| stacks.holds(target))
    }

    /// Whether a light without extent may lie on a surface.
    #[inline]
    pub(super) fn may_lie_on_surface(&self, light: LightId) -> bool {
        self.stacks
            .as_ref()
            .is_some_and(|stacks| is_set(&stacks.lights, light.index()))
    }

    /// What lies where a ray meets a surface, which is at `place` and satisfies `counts` as the others must. `None` if
    /// nothing does.
    #[cold]
    fn stack(
        &self,
        ray: &Ray,
        hit: &Hit,
        place: &Place,
        counts: impl Fn(&Hit) -> bool,
    ) -> Option<Stack> {
        let stacks = self.stacks.as_ref()?;
        let n = place.ng.0.abs();
        let own = n.dot((place.p_err + self.corner_error(hit, ray.time)).0);
        // Wherever the planes are near each other, and the roundings along the ray itself.
        let along = place.ng.abs_dot(ray.d);
        let far = ray.o.0.abs().max_element() + hit.at.t;
        let slack = (own + stacks.error * (n.x + n.y + n.z) + gamma(16) * far) / along;
        let widest = own + WIDEST * stacks.error * (n.x + n.y + n.z);
        let is_other = |other: &Hit| {
            other.at.t >= hit.at.t - slack
                && stacks.holds(other.target)
                && (other.target, other.instance) != (hit.target, hit.instance)
                && counts(other)
        };
        let found: RefCell<ArrayVec<Member, MAX_MEMBERS>> = RefCell::default();
        let limit = (hit.at.t + slack).next_up();
        self.any_where(ray, limit, |other| {
            if is_other(other) {
                let at = self.bare_place(ray, other);
                let error = at.p_err + self.corner_error(other, ray.time);
                let member = Member {
                    off: place.ng.dot(at.p - place.p).abs(),
                    error: n.dot(error.0),
                    hit: *other,
                    place: at,
                };
                if member.off <= widest {
                    // What does not fit is left out.
                    let _ = found.borrow_mut().try_push(member);
                }
            }
            false
        });
        let mut candidates = found.into_inner();
        let (mut reach, mut others) = (own, ArrayVec::new());
        while let Some(next) = candidates.iter().position(|m| m.off - m.error <= reach) {
            let member = candidates.swap_remove(next);
            reach = reach.max(member.off + member.error);
            others.push(member);
        }
        (!others.is_empty()).then_some(Stack { others, reach })
    }

    /// By how much the corners of a triangle may have been rounded, in each coordinate of render space.
    fn corner_error(&self, hit: &Hit, time: f32) -> Vec3 {
        let Shape::Mesh(mesh) = &self.geometry(hit.target.geometry).shape else {
            return Vec3::ZERO;
        };
        let largest = mesh
            .corners(hit.target.element)
            .into_iter()
            .fold(glam::Vec3A::ZERO, |m, p| m.max(glam::Vec3A::from(p).abs()));
        let error = Vec3(largest * EPSILON);
        if !hit.instance.is_some() {
            return error;
        }
        let motion = &self.instances[hit.instance.index()].render_from_object;
        motion.at(time).map_or(Vec3::ZERO, |transform| {
            let m = &transform.affine().matrix3;
            let e = error.to_f64();
            Vec3::from_f64(m.x_axis.abs() * e.x + m.y_axis.abs() * e.y + m.z_axis.abs() * e.z)
        })
    }

    /// How soon a surface is met among those in its place.
    fn rank(&self, hit: &Hit) -> u8 {
        let geometry = self.geometry(hit.target.geometry);
        match (geometry.material.is_some(), geometry.first_light.is_some()) {
            (true, true) => 0,
            (true, false) => 1,
            (false, true) => 2,
            (false, false) => 3,
        }
    }

    /// What a ray meets first where it meets `hit`, of surfaces that satisfy `counts`.
    #[cold]
    pub(super) fn first_of_stack(&self, ray: &Ray, hit: Hit, counts: impl Fn(&Hit) -> bool) -> Hit {
        let place = self.bare_place(ray, &hit);
        let Some(stack) = self.stack(ray, &hit, &place, counts) else {
            return hit;
        };
        // Of one mesh the nearest triangle, as everywhere; what is passed through may come in any order.
        let own = self.rank(&hit);
        let is_of_hit = |other: &Hit| {
            other.target.geometry == hit.target.geometry && other.instance == hit.instance
        };
        let may_be_first = |other: &Hit| {
            let rank = self.rank(other);
            rank < own || rank == own && own < 2 && !is_of_hit(other)
        };
        let key = |hit: &Hit| {
            let geometry = hit.target.geometry;
            let by_content = self.stacks.as_ref().map(|s| s.order[geometry.index()]);
            (self.rank(hit), by_content, geometry, hit.target.element)
        };
        let others = stack.others.iter().map(|m| m.hit).filter(may_be_first);
        others.fold(hit, |first, other| std::cmp::min_by_key(first, other, key))
    }

    /// The error box of a surface point, made so large that rays which leave it clear all that lies in its place.
    #[cold]
    pub(super) fn widened(&self, ray: &Ray, hit: &Hit, place: &Place) -> Vec3 {
        match self.stack(ray, hit, place, |_| true) {
            Some(stack) => clearing(place.p_err, place.ng, stack.reach),
            None => place.p_err,
        }
    }

    /// The same of a point on an element that is no part of an instance, which a line in direction `d` passes.
    pub(super) fn widened_on(
        &self,
        target: ElementRef,
        place: &Place,
        barycentric: [f32; 2],
        d: Vec3,
        time: f32,
    ) -> Vec3 {
        match self.stack_on(target, place, barycentric, d, time) {
            Some(stack) => clearing(place.p_err, place.ng, stack.reach),
            None => place.p_err,
        }
    }

    fn stack_on(
        &self,
        target: ElementRef,
        place: &Place,
        barycentric: [f32; 2],
        d: Vec3,
        time: f32,
    ) -> Option<Stack> {
        let stacks = self.stacks.as_ref()?;
        if !stacks.holds(target) {
            return None;
        }
        // From so far away that all of it lies ahead.
        let along = place.ng.abs_dot(d);
        let n = place.ng.0.abs();
        let far = place.p.0.abs().max_element();
        let back = 4.0 * (stacks.error * (n.x + n.y + n.z) + gamma(16) * far) / along;
        if !back.is_finite() {
            return None;
        }
        let ray = Ray {
            o: place.p - d * back,
            d,
            time,
        };
        let hit = Hit {
            target,
            instance: InstanceId::NONE,
            at: ElementHit {
                t: back,
                barycentric,
            },
        };
        self.stack(&ray, &hit, place, |_| true)
    }

    /// The medium behind a null surface that a ray meets in `medium`, and how many boundaries there do not border on
    /// that.
    #[inline]
    pub fn medium_behind_null(
        &self,
        ray: &Ray,
        hit: &Hit,
        place: &Place,
        medium: MediumId,
    ) -> (MediumId, u64) {
        if self.may_be_stacked(hit.target) {
            return self.medium_behind_stack(ray, hit, place, medium);
        }
        let borders = self.borders_on(hit.target, place.ng, ray.d, medium);
        let behind = self.medium_toward(hit.target, place.ng, ray.d, medium);
        (behind, u64::from(!borders))
    }

    /// The medium behind a surface that a path meets by `ray` in `medium`, if boundaries lie in its place. Then it is
    /// before all of them: what stays on the near side stays in `medium`.
    #[inline]
    pub fn medium_through_stack(&self, ray: &Ray, hit: &Hit, medium: MediumId) -> Option<MediumId> {
        self.medium_out_of_stack(ray, hit, ray.d, medium)
    }

    /// The medium that light comes to which leaves from below a surface, found by `ray`, in direction `d`, if boundaries
    /// lie in the place of the surface; `medium` is below.
    #[inline]
    pub fn medium_out_of_stack(
        &self,
        ray: &Ray,
        hit: &Hit,
        d: Vec3,
        medium: MediumId,
    ) -> Option<MediumId> {
        if self.may_be_stacked(hit.target) {
            self.medium_out_of(ray, hit, d, medium)
        } else {
            None
        }
    }

    #[cold]
    fn medium_out_of(&self, ray: &Ray, hit: &Hit, d: Vec3, medium: MediumId) -> Option<MediumId> {
        let place = self.bare_place(ray, hit);
        let stack = self.stack(ray, hit, &place, |_| true)?;
        let has_boundary = stack.others.iter().any(|m| self.is_boundary(&m.hit));
        has_boundary.then(|| self.lead_through(hit, &place, &stack, d, medium).0)
    }

    #[cold]
    fn medium_behind_stack(
        &self,
        ray: &Ray,
        hit: &Hit,
        place: &Place,
        medium: MediumId,
    ) -> (MediumId, u64) {
        let bare = self.bare_place(ray, hit);
        match self.stack(ray, hit, &bare, |_| true) {
            Some(stack) => self.lead_through(hit, &bare, &stack, ray.d, medium),
            None => {
                let borders = self.borders_on(hit.target, place.ng, ray.d, medium);
                let behind = self.medium_toward(hit.target, place.ng, ray.d, medium);
                (behind, u64::from(!borders))
            }
        }
    }

    /// The medium that light is in which leaves a point of a lamp in direction `d`: lamps are met before the boundaries
    /// in their place.
    pub(super) fn medium_off_lamp(
        &self,
        target: ElementRef,
        place: &Place,
        barycentric: [f32; 2],
        d: Vec3,
        time: f32,
        declared: MediumId,
    ) -> MediumId {
        let medium = self.medium_toward(target, place.ng, d, declared);
        let Some(stack) = self.stack_on(target, place, barycentric, d, time) else {
            return medium;
        };
        let crossed = stack.others.iter().map(|m| (m.hit, m.place.ng));
        self.lead(crossed.filter(|(hit, _)| self.is_boundary(hit)), d, medium)
            .0
    }

    fn is_boundary(&self, hit: &Hit) -> bool {
        let geometry = self.geometry(hit.target.geometry);
        !geometry.material.is_some() && geometry.media.is_some()
    }

    fn lead_through(
        &self,
        hit: &Hit,
        place: &Place,
        stack: &Stack,
        d: Vec3,
        medium: MediumId,
    ) -> (MediumId, u64) {
        let others = stack.others.iter().map(|m| (m.hit, m.place.ng));
        let others = others.filter(|(hit, _)| self.is_boundary(hit));
        self.lead([(*hit, place.ng)].into_iter().chain(others), d, medium)
    }

    /// The medium before the boundaries in the place of one that a ray meets. `None` if they do not say.
    #[cold]
    pub(super) fn medium_before_stack(&self, ray: &Ray, hit: &Hit) -> Option<MediumId> {
        let place = self.bare_place(ray, hit);
        // What leads on from ahead leads back to here.
        let back = |medium| match self.stack(ray, hit, &place, |_| true) {
            Some(stack) => self.lead_through(hit, &place, &stack, -ray.d, medium).0,
            None => self.medium_toward(hit.target, place.ng, -ray.d, medium),
        };
        let [one, other] = [MediumId::NONE, MediumId(MediumId::NONE.0 - 1)].map(back);
        (one == other).then_some(one)
    }

    /// Where boundaries in one place lead in direction `d` from `medium`, whatever their order: to the medium that is
    /// entered more often than it is left. How many do not fit in.
    fn lead(
        &self,
        surfaces: impl Iterator<Item = (Hit, Normal3)>,
        d: Vec3,
        medium: MediumId,
    ) -> (MediumId, u64) {
        let mut crossed: ArrayVec<(Hit, [MediumId; 2]), { MAX_MEMBERS + 1 }> = ArrayVec::new();
        for (hit, ng) in surfaces {
            let Some(interface) = &self.geometry(hit.target.geometry).media else {
                continue;
            };
            let step = [interface.toward(ng, -d), interface.toward(ng, d)];
            // An edge of a mesh belongs to both triangles; they are one boundary.
            let on_edge = |hit: &Hit| {
                let [b0, b1] = hit.at.barycentric;
                matches!(self.geometry(hit.target.geometry).shape, Shape::Mesh(_))
                    && (b0 == 0.0 || b1 == 0.0 || 1.0 - b0 - b1 <= EPSILON)
            };
            let is_known = on_edge(&hit)
                && crossed.iter().any(|(other, other_step)| {
                    other.target.geometry == hit.target.geometry
                        && other.instance == hit.instance
                        && *other_step == step
                        && on_edge(other)
                });
            if !is_known && step[0] != step[1] {
                let _ = crossed.try_push((hit, step));
            }
        }
        let balance = |medium: MediumId| {
            crossed.iter().fold(0, |sum, (_, [before, behind])| {
                sum + i32::from(*behind == medium) - i32::from(*before == medium)
            })
        };
        let media = || crossed.iter().flat_map(|(_, step)| *step);
        // What is no medium comes last: what is left is left before another is entered.
        let order = |medium: &MediumId| {
            (
                balance(*medium),
                medium.is_some(),
                std::cmp::Reverse(medium.0),
            )
        };
        let Some(end) = media().max_by_key(order) else {
            return (medium, 0);
        };
        if balance(end) <= 0 {
            let is_among = media().any(|other| other == medium);
            return (medium, u64::from(!is_among));
        }
        let start = media().min_by_key(|medium| balance(*medium));
        (end, u64::from(start != Some(medium) && end != medium))
    }

    /// Calls `f` for null surfaces that emit and lie in the place of `hit`.
    #[inline]
    pub fn for_other_lamps(&self, ray: &Ray, hit: &Hit, mut f: impl FnMut(&Hit)) {
        if !self.may_be_stacked(hit.target) {
            return;
        }
        self.other_lamps(ray, hit)
            .into_iter()
            .for_each(|lamp| f(&lamp));
    }

    #[cold]
    fn other_lamps(&self, ray: &Ray, hit: &Hit) -> ArrayVec<Hit, MAX_MEMBERS> {
        let place = self.bare_place(ray, hit);
        let stack = self.stack(ray, hit, &place, |_| true);
        let others = stack.map(|stack| stack.others).unwrap_or_default();
        let lamps = others.into_iter().map(|m| m.hit);
        lamps.filter(|other| self.rank(other) == 2).collect()
    }

    /// Whether something in the place of a null surface that is met stops light, of what satisfies `counts`.
    #[cold]
    pub(super) fn is_stopped_in_stack(
        &self,
        ray: &Ray,
        hit: &Hit,
        place: &Place,
        counts: impl Fn(&Hit) -> bool,
    ) -> bool {
        let is_stop = |m: &Member| self.rank(&m.hit) < 2 && counts(&m.hit);
        self.stack(ray, hit, place, |_| true)
            .is_some_and(|stack| stack.others.iter().any(is_stop))
    }

    /// Whether a surface that is met holds the point `p` of a light without extent.
    #[cold]
    pub(super) fn holds_point(&self, ray: &Ray, hit: &Hit, p: Point3) -> bool {
        let place = self.bare_place(ray, hit);
        let error = place.p_err + self.corner_error(hit, ray.time) + Vec3(p.0.abs() * EPSILON);
        place.ng.dot(p - place.p).abs() <= place.ng.0.abs().dot(error.0)
    }

    /// Where light leaves the point `p` of a light without extent in direction `d`: beyond the surfaces it lies on.
    pub(super) fn off_surfaces(&self, p: Point3, d: Vec3, time: f32) -> Point3 {
        let Some(stacks) = &self.stacks else { return p };
        let start = RefCell::new(0f32);
        let back = 4.0 * (stacks.error + gamma(16) * p.0.abs().max_element());
        let ray = Ray {
            o: p - d * back,
            d,
            time,
        };
        // At grazing angles a surface is met as far away as it likes.
        self.any_where(&ray, f32::INFINITY, |hit| {
            if self.holds_point(&ray, hit, p) {
                let place = self.bare_place(&ray, hit);
                let error = place.p_err + self.corner_error(hit, time) + Vec3(p.0.abs() * EPSILON);
                let off = place.ng.dot(p - place.p).abs() + place.ng.0.abs().dot(error.0);
                let mut start = start.borrow_mut();
                *start = start.max(off / place.ng.abs_dot(d));
            }
            false
        });
        let beyond = start.into_inner();
        if beyond > 0.0 && beyond.is_finite() {
            p + d * beyond
        } else {
            p
        }
    }
}

/// An error box along the normal that clears `reach`.
fn clearing(p_err: Vec3, ng: Normal3, reach: f32) -> Vec3 {
    Vec3(p_err.0.max(ng.0.abs() * (reach * (1.0 + gamma(4)))))
}
