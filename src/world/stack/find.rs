//! Which elements may share a place with others, found at load: those that meet a null surface, a lamp or a light without
//! extent, and these. A scene where none do asks for nothing more.

use glam::{DAffine3, DVec3};

use super::Stacks;
use super::pairs::{Form, Piece, boxes_touch, may_meet};
use crate::ids::{InstanceId, LightId};
use crate::math::animated::corners_of;
use crate::math::error::EPSILON;
use crate::math::{Bounds3, Motion, Point3};
use crate::shape::Shape;
use crate::world::items::{self, Slot};
use crate::world::{ElementRef, Geometry, World};

/// What places in a transform's range add up from.
const OPERATIONS: f64 = 4.0;

impl World {
    /// What may share its place with other surfaces; `None` if nothing does.
    pub(in crate::world) fn find_stacks(&self) -> Option<Stacks> {
        let mut found = Found {
            world: self,
            elements: vec![Vec::new(); self.geometries.len()],
            lights: Vec::new(),
            error: 0.0,
        };
        let mut instances_of = vec![Vec::new(); self.objects.len()];
        for (index, instance) in self.instances.iter().enumerate() {
            instances_of[instance.object.index()].push(InstanceId::new(index));
        }
        for (index, geometry) in self.geometries.iter().enumerate() {
            if !is_passed_or_emits(geometry) {
                continue;
            }
            let target = |element| ElementRef {
                geometry: crate::ids::GeometryId::new(index),
                element,
            };
            for element in 0..geometry.shape.n_elements() as u32 {
                if !geometry.object.is_some() {
                    found.compare(target(element), InstanceId::NONE);
                    continue;
                }
                for &instance in &instances_of[geometry.object.index()] {
                    found.compare(target(element), instance);
                }
            }
        }
        for index in 0..self.lights.len() {
            if let Some(p) = self.lights[index].position() {
                found.place(LightId::new(index), p);
            }
        }
        let is_any = !found.lights.is_empty() || found.elements.iter().any(|e| !e.is_empty());
        is_any.then_some(Stacks {
            elements: found.elements,
            lights: found.lights,
            error: found.error as f32,
        })
    }
}

/// Whether what lies in the place of a surface makes a difference.
fn is_passed_or_emits(geometry: &Geometry) -> bool {
    !geometry.material.is_some() || geometry.first_light.is_some()
}

struct Found<'a> {
    world: &'a World,
    elements: Vec<Vec<u64>>,
    lights: Vec<u64>,
    error: f64,
}

fn set(bits: &mut Vec<u64>, index: usize) {
    let word = index / 64;
    if bits.len() <= word {
        bits.resize(word + 1, 0);
    }
    bits[word] |= 1 << (index % 64);
}

impl Found<'_> {
    fn set(&mut self, target: ElementRef, piece: &Piece) {
        set(
            &mut self.elements[target.geometry.index()],
            target.element as usize,
        );
        self.error = self.error.max(piece.error);
    }

    /// Marks an element and all that it meets.
    fn compare(&mut self, target: ElementRef, instance: InstanceId) {
        let Some(piece) = self.world.piece(target, instance) else {
            return;
        };
        let mut near = Vec::new();
        self.world.for_all_near(&piece.bounds, |other, placed| {
            if (other, placed) != (target, instance) {
                near.push((other, placed));
            }
        });
        for (other, placed) in near {
            let Some(other_piece) = self.world.piece(other, placed) else {
                continue;
            };
            if boxes_touch(&piece.bounds, &other_piece.bounds) && may_meet(&piece, &other_piece) {
                self.set(target, &piece);
                self.set(other, &other_piece);
            }
        }
    }

    /// Marks a light if it may lie on a surface.
    fn place(&mut self, light: LightId, p: Point3) {
        let error = OPERATIONS * f64::from(EPSILON) * p.to_f64().abs().max_element();
        let point = Piece {
            bounds: Bounds3::around(p.to_f64() - error, p.to_f64() + error),
            form: Form::Sphere(p.to_f64(), 0.0),
            error,
        };
        let (mut is_on_surface, mut widest) = (false, 0f64);
        self.world.for_all_near(&point.bounds, |other, placed| {
            if let Some(piece) = self.world.piece(other, placed)
                && boxes_touch(&point.bounds, &piece.bounds)
                && may_meet(&point, &piece)
            {
                is_on_surface = true;
                widest = widest.max(piece.error);
            }
        });
        if is_on_surface {
            set(&mut self.lights, light.index());
            self.error = self.error.max(widest).max(error);
        }
    }
}

impl World {
    /// An element where it is, and while it moves. `None` if rays do not meet it, and for curves, which turn to whoever
    /// looks.
    fn piece(&self, target: ElementRef, instance: InstanceId) -> Option<Piece> {
        let shape = &self.geometry(target.geometry).shape;
        let bounds = shape.bounds(target.element);
        if bounds.is_empty() || matches!(shape, Shape::Curves(_)) {
            return None;
        }
        let own = [bounds.min.to_f64(), bounds.max.to_f64()];
        let [motion, placed] = if instance.is_some() {
            let motion = &self.instances[instance.index()].render_from_object;
            [Some(motion), Some(motion)]
        } else {
            [None; 2]
        };
        let [lo, hi] = motion.map_or(own, |motion| motion.bounds(own, self.shutter));
        let transform = match placed {
            None => Some(DAffine3::IDENTITY),
            Some(Motion::Still(transform)) => Some(*transform.affine()),
            Some(Motion::Moving(_)) => None,
        };
        let largest = |[lo, hi]: [DVec3; 2]| lo.abs().max(hi.abs()).max_element();
        let stretch = transform.map_or(1.0, |t| {
            let m = t.matrix3;
            m.x_axis
                .length()
                .max(m.y_axis.length())
                .max(m.z_axis.length())
        });
        let terms = largest([lo, hi]) + stretch * largest(own);
        let error = OPERATIONS * f64::from(EPSILON) * terms;
        let form = match (shape, transform) {
            (Shape::Mesh(mesh), Some(t)) => Form::Triangle(
                mesh.corners(target.element)
                    .map(|p| t.transform_point3(DVec3::from(p.map(f64::from)))),
            ),
            (Shape::Quadric(quadric), Some(_)) if !instance.is_some() => {
                match quadric.whole_sphere() {
                    Some((center, radius)) => Form::Sphere(center, radius),
                    None => Form::Other,
                }
            }
            _ => Form::Other,
        };
        Some(Piece {
            bounds: Bounds3::around(lo - error, hi + error),
            form,
            error,
        })
    }

    /// Tells of all elements that may touch a box at any time.
    fn for_all_near(&self, bounds: &Bounds3, mut f: impl FnMut(ElementRef, InstanceId)) {
        let mut near = Vec::new();
        let mut instances = Vec::new();
        self.bvh.touching(
            bounds,
            |key| near.push(items::element_of(key)),
            |key| {
                if let Slot::Instance(instance) = items::slot_of(key) {
                    instances.push(instance);
                }
            },
        );
        // Slots that are elements come after triangles.
        self.bvh.touching(
            bounds,
            |_| {},
            |key| {
                if let Slot::Element(target) = items::slot_of(key) {
                    near.push(target);
                }
            },
        );
        near.into_iter()
            .for_each(|target| f(target, InstanceId::NONE));
        for id in instances {
            let instance = &self.instances[id.index()];
            let object = &self.objects[instance.object.index()];
            if !boxes_touch(bounds, &instance.bounds(object, self.shutter)) {
                continue;
            }
            let within = match &instance.render_from_object {
                Motion::Still(transform) => {
                    let object_from_render = *transform.inverse().affine();
                    let corners = corners_of([bounds.min.to_f64(), bounds.max.to_f64()])
                        .map(|p| object_from_render.transform_point3(p));
                    let [lo, hi] = corners
                        .iter()
                        .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lo, hi], p| {
                            [lo.min(*p), hi.max(*p)]
                        });
                    Bounds3::around(lo, hi)
                }
                Motion::Moving(_) => object.bvh().bounds(),
            };
            let found = std::cell::RefCell::new(Vec::new());
            let push = |key| found.borrow_mut().push(items::element_of(key));
            object.bvh().touching(&within, push, push);
            found
                .into_inner()
                .into_iter()
                .for_each(|target| f(target, id));
        }
    }
}
