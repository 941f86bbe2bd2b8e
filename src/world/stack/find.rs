//! Which elements may share a place with others, found at load: those that meet a null surface, a lamp or a light without
//! extent, and these. A scene where none do asks for nothing more.

use std::collections::{HashMap, HashSet};

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
            swept: HashMap::new(),
            moving: HashMap::new(),
            extents: HashMap::new(),
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
    /// Elements of moving instances, in boxes around all places they get to.
    swept: HashMap<InstanceId, Bvh>,
    /// These elements one by one, and the boxes around such instances: to follow a motion takes long.
    moving: HashMap<(ElementRef, InstanceId), Option<Piece>>,
    extents: HashMap<InstanceId, Bounds3>,
    elements: Vec<Vec<u64>>,
    lights: Vec<u64>,
    error: f64,
    /// Elements that were compared with more than [`CROWD`] others.
    crowded: HashSet<[u64; 15]>,
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

    /// [`World::piece`], found once for what moves.
    fn piece(&mut self, target: ElementRef, instance: InstanceId) -> Option<Piece> {
        let world = self.world;
        if !instance.is_some() || !world.instances[instance.index()].is_moving() {
            return world.piece(target, instance);
        }
        let entry = self.moving.entry((target, instance));
        *entry.or_insert_with(|| world.piece(target, instance))
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
        let near = self.near(&piece.bounds);
        if near.len() > CROWD {
            self.crowded.insert(content(&piece));
        }
        for (other, placed) in near {
            if (other, placed) == (target, instance) {
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

    /// All elements that may touch a box at any time, and some more.
    fn near(&mut self, bounds: &Bounds3) -> Vec<(ElementRef, InstanceId)> {
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
            let extent = || instance.bounds(object, world.shutter);
            let extent = if instance.is_moving() {
                *self.extents.entry(id).or_insert_with(extent)
            } else {
                extent()
            };
            if !boxes_touch(bounds, &extent) {
                continue;
            }
            let mut found = Vec::new();
            match &instance.render_from_object {
                Motion::Still(transform) => {
                    let of = [bounds.min.to_f64(), bounds.max.to_f64()];
                    let inverse = Motion::Still(transform.inverse());
                    let [lo, hi] = inverse.bounds(of, world.shutter);
                    let within = Bounds3::around(lo, hi);
                    let mut slots = Vec::new();
                    let triangle = |key| found.push(key);
                    let slot = |key| slots.push(key);
                    // Errors are those of render space, which may be far larger.
                    object
                        .bvh()
                        .touching(&within, f32::INFINITY, triangle, slot);
                    found.extend(slots);
                }
                Motion::Moving(_) => {
                    let swept = self.swept.entry(id).or_insert_with(|| world.swept(id));
                    swept.touching(bounds, f32::INFINITY, |_| {}, |key| found.push(key));
                }
            }
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
        for (other, placed) in self.near(&point.bounds) {
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
    /// The elements of a moving instance, each in a box around all places it gets to.
    fn swept(&self, id: InstanceId) -> Bvh {
        let object = self.instances[id.index()].object;
        let parts = (0..self.geometries.len()).filter(|&i| self.geometries[i].object == object);
        let elements: Vec<[u32; 2]> = parts
            .flat_map(|index| {
                let n = self.geometries[index].shape.n_elements() as u32;
                (0..n).map(move |element| [index as u32, element])
            })
            .collect();
        let boxes: Vec<Bounds3> = elements
            .par_iter()
            .map(|&key| {
                let piece = self.piece(items::element_of(key), id);
                piece.map_or(Bounds3::EMPTY, |piece| piece.bounds)
            })
            .collect();
        let mut items = Vec::with_capacity(boxes.len());
        for (bounds, key) in boxes.iter().zip(elements) {
            push_item(&mut items, Item::slot(bounds, key));
        }
        Bvh::build(items, |_| unreachable!("there are no triangles"))
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
