//! Which elements may share a place with others, found at load: those that meet a null surface, a lamp or a light without
//! extent, and these. A scene where none do asks for nothing more.

use std::collections::HashSet;

use glam::{DAffine3, DVec3};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::Stacks;
use super::pairs::{Form, Piece, boxes_touch, may_meet};
use crate::accel::{Bvh, Item, push_item};
use crate::ids::{GeometryId, InstanceId, LightId};
use crate::math::error::EPSILON;
use crate::math::{Bounds3, Motion, Point3};
use crate::shape::Shape;
use crate::world::items::{self, Slot};
use crate::world::{ElementRef, Geometry, World};

/// What places in a transform's range add up from.
const OPERATIONS: f64 = 4.0;

/// Rounding errors that count between triangles: more than [`World::piece`] allows each of them.
const ROUNDINGS: f32 = 32.0;

/// So many elements near one are worth remembering it: those in the same place need not be compared with all of them.
const CROWD: usize = 64;

impl World {
    /// What may share its place with other surfaces; `None` if nothing does.
    pub(in crate::world) fn find_stacks(&self) -> Option<Stacks> {
        let mut found = Found {
            world: self,
            first_of: self.first_elements(),
            swept: self.instances.iter().map(|_| None).collect(),
            elements: vec![Vec::new(); self.geometries.len()],
            lights: Vec::new(),
            error: 0.0,
            crowded: HashSet::new(),
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
                geometry: GeometryId::new(index),
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
        let overlaps = self.find_overlaps(&mut found.elements, &mut found.error);
        let is_any = !found.lights.is_empty() || found.elements.iter().any(|e| !e.is_empty());
        is_any.then_some(Stacks {
            lights: found.lights,
            error: found.error as f32,
            order: self.order_by_content(&found.elements),
            elements: found.elements,
            overlaps,
        })
    }
}

/// Whether what lies in the place of a surface makes a difference.
fn is_passed_or_emits(geometry: &Geometry) -> bool {
    !geometry.material.is_some() || geometry.first_light.is_some()
}

struct Found<'a> {
    world: &'a World,
    /// Of each geometry, the number of its first element among those of its object.
    first_of: Vec<usize>,
    /// What moving instances get to; found once, as to follow a motion takes long.
    swept: Vec<Option<Box<Swept>>>,
    elements: Vec<Vec<u64>>,
    lights: Vec<u64>,
    error: f64,
    /// Elements that were compared with more than [`CROWD`] others.
    crowded: HashSet<[u64; 15]>,
}

/// What a moving instance gets to while the shutter is open.
struct Swept {
    extent: Bounds3,
    /// Each element of the object, in a box around all its places.
    pieces: Vec<Option<Piece>>,
    /// The same in a hierarchy.
    bvh: Bvh,
}

/// All that decides which others a piece meets, to the last bit.
fn content(piece: &Piece) -> [u64; 15] {
    let mut content = [0; 15];
    let Bounds3 { min, max } = piece.bounds;
    let corners = [min.0.to_array(), max.0.to_array()];
    let corners = corners.as_flattened().iter().map(|&c| f64::from(c));
    let form = match piece.form {
        Form::Triangle(vertices) => vertices.map(|v| v.to_array()),
        Form::Sphere(center, radius) => [center.to_array(), [radius; 3], [0.0; 3]],
        Form::Other => [[0.0; 3]; 3],
    };
    let numbers = corners.chain(form.as_flattened().iter().copied());
    for (slot, number) in content.iter_mut().zip(numbers) {
        *slot = number.to_bits();
    }
    content
}

pub(super) fn set(bits: &mut Vec<u64>, index: usize) {
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

    fn swept(&mut self, id: InstanceId) -> &Swept {
        let world = self.world;
        self.swept[id.index()].get_or_insert_with(|| Box::new(world.swept(id)))
    }

    /// [`World::piece`], found once for what moves.
    fn piece(&mut self, target: ElementRef, instance: InstanceId) -> Option<Piece> {
        if !instance.is_some() || !self.world.instances[instance.index()].is_moving() {
            return self.world.piece(target, instance);
        }
        let number = self.first_of[target.geometry.index()] + target.element as usize;
        self.swept(instance).pieces[number]
    }

    /// Marks an element and all that it meets.
    fn compare(&mut self, target: ElementRef, instance: InstanceId) {
        let Some(piece) = self.piece(target, instance) else {
            return;
        };
        // What is the same as one before meets the same, and was marked with it.
        if !self.crowded.is_empty() && self.crowded.contains(&content(&piece)) {
            return;
        }
        let near = self.near(&piece.bounds, Some((target, instance)));
        if near.len() > CROWD {
            self.crowded.insert(content(&piece));
        }
        for (other, placed) in near {
            if (other, placed) == (target, instance)
                || self.was_compared(other, placed, target, instance)
            {
                continue;
            }
            let Some(other_piece) = self.piece(other, placed) else {
                continue;
            };
            if boxes_touch(&piece.bounds, &other_piece.bounds) && may_meet(&piece, &other_piece) {
                self.set(target, &piece);
                self.set(other, &other_piece);
            }
        }
    }

    /// Whether an element is one that is compared with others, and was before `target`.
    fn was_compared(
        &self,
        other: ElementRef,
        placed: InstanceId,
        target: ElementRef,
        instance: InstanceId,
    ) -> bool {
        let order = |e: ElementRef, at: InstanceId| (e.geometry.index(), e.element, at.0);
        order(other, placed) < order(target, instance)
            && is_passed_or_emits(self.world.geometry(other.geometry))
    }

    /// All elements that may touch a box at any time, and some more; the box is around a part of an instance, or of
    /// nothing.
    fn near(
        &mut self,
        bounds: &Bounds3,
        of: Option<(ElementRef, InstanceId)>,
    ) -> Vec<(ElementRef, InstanceId)> {
        let world = self.world;
        let stands = InstanceId::NONE;
        let mut near = Vec::new();
        let mut slots = Vec::new();
        world.bvh.touching(
            bounds,
            ROUNDINGS,
            |key| near.push((items::element_of(key), stands)),
            |key| slots.push(items::slot_of(key)),
        );
        for slot in slots {
            let id = match slot {
                Slot::Element(target) => {
                    near.push((target, stands));
                    continue;
                }
                Slot::Instance(id) => id,
            };
            let instance = &world.instances[id.index()];
            let object = &world.objects[instance.object.index()];
            let mut found = Vec::new();
            let mut slots = Vec::new();
            match (&instance.render_from_object, of) {
                // What moves together keeps its distances.
                (Motion::Moving(_), Some((target, moves_with))) if moves_with == id => {
                    let within = world.bounds_in_object(target);
                    let triangle = |key| found.push(key);
                    let slot = |key| slots.push(key);
                    object
                        .bvh()
                        .touching(&within, f32::INFINITY, triangle, slot);
                    let touches = |key: &[u32; 2]| {
                        boxes_touch(&within, &world.bounds_in_object(items::element_of(*key)))
                    };
                    found.retain(touches);
                    slots.retain(touches);
                }
                (Motion::Moving(_), _) => {
                    let swept = self.swept(id);
                    if boxes_touch(bounds, &swept.extent) {
                        let slot = |key| found.push(key);
                        swept.bvh.touching(bounds, f32::INFINITY, |_| {}, slot);
                    }
                }
                (Motion::Still(transform), _) => {
                    if !boxes_touch(bounds, &instance.bounds(object, world.shutter)) {
                        continue;
                    }
                    let of = [bounds.min.to_f64(), bounds.max.to_f64()];
                    let inverse = Motion::Still(transform.inverse());
                    let [lo, hi] = inverse.bounds(of, world.shutter);
                    let within = Bounds3::around(lo, hi);
                    // Errors are those of render space, which may be far larger.
                    let triangle = |key| found.push(key);
                    let slot = |key| slots.push(key);
                    object
                        .bvh()
                        .touching(&within, f32::INFINITY, triangle, slot);
                }
            }
            found.extend(slots);
            near.extend(found.into_iter().map(|key| (items::element_of(key), id)));
        }
        near
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
        for (other, placed) in self.near(&point.bounds, None) {
            if let Some(piece) = self.piece(other, placed)
                && boxes_touch(&point.bounds, &piece.bounds)
                && may_meet(&point, &piece)
            {
                is_on_surface = true;
                widest = widest.max(piece.error);
            }
        }
        if is_on_surface {
            set(&mut self.lights, light.index());
            self.error = self.error.max(widest).max(error);
        }
    }
}

impl World {
    /// Of each geometry, the number of its first element among those of its object.
    fn first_elements(&self) -> Vec<usize> {
        let mut counts = vec![0; self.objects.len()];
        let first = |geometry: &Geometry| {
            if !geometry.object.is_some() {
                return 0;
            }
            let count = &mut counts[geometry.object.index()];
            let first = *count;
            *count += geometry.shape.n_elements();
            first
        };
        self.geometries.iter().map(first).collect()
    }

    fn swept(&self, id: InstanceId) -> Swept {
        let instance = &self.instances[id.index()];
        let parts =
            (0..self.geometries.len()).filter(|&i| self.geometries[i].object == instance.object);
        let elements: Vec<[u32; 2]> = parts
            .flat_map(|index| {
                let n = self.geometries[index].shape.n_elements() as u32;
                (0..n).map(move |element| [index as u32, element])
            })
            .collect();
        let pieces: Vec<Option<Piece>> = elements
            .par_iter()
            .map(|&key| self.piece(items::element_of(key), id))
            .collect();
        let mut items = Vec::with_capacity(pieces.len());
        for (piece, key) in pieces.iter().zip(elements) {
            let bounds = piece.map_or(Bounds3::EMPTY, |piece| piece.bounds);
            push_item(&mut items, Item::slot(&bounds, key));
        }
        Swept {
            extent: instance.bounds(&self.objects[instance.object.index()], self.shutter),
            pieces,
            bvh: Bvh::build(items, |_| unreachable!("there are no triangles")),
        }
    }

    /// A box around an element in the space of its object.
    fn bounds_in_object(&self, target: ElementRef) -> Bounds3 {
        let bounds = self.geometry(target.geometry).shape.bounds(target.element);
        let [lo, hi] = [bounds.min.to_f64(), bounds.max.to_f64()];
        let largest = lo.abs().max(hi.abs()).max_element();
        let error = 2.0 * OPERATIONS * f64::from(EPSILON) * largest;
        Bounds3::around(lo - error, hi + error)
    }

    /// An element where it is, and while it moves. `None` if rays do not meet it, and for curves, which turn to whoever
    /// looks.
    pub(super) fn piece(&self, target: ElementRef, instance: InstanceId) -> Option<Piece> {
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
}
