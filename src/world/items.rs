//! What the hierarchies of the world are built over: triangles of meshes, and slots for everything else. Keys are the
//! geometry and the element, so that of two surfaces in one place the one declared first is seen.

use std::ops::Range;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::accel::{self, Bvh, Item, Key};
use crate::ids::{GeometryId, InstanceId};
use crate::math::Bounds3;
use crate::shape::Shape;
use crate::world::{ElementRef, Geometry};

/// Stands for the geometry in keys of instances.
const INSTANCE: u32 = u32::MAX >> 1;

/// Elements whose boxes are worth a second thread.
const WORTH_A_THREAD: u32 = 1 << 12;

/// What a slot holds.
pub(super) enum Slot {
    /// An element that is no triangle.
    Element(ElementRef),
    /// A placed object.
    Instance(InstanceId),
}

/// The elements of some of the geometries.
pub(super) fn items_of(geometries: &[Geometry], chosen: &[usize]) -> Vec<Item> {
    // What is never written takes no memory; growing would mean moving.
    let mut items = Vec::with_capacity(n_elements(geometries, chosen));
    for &index in chosen {
        let shape = &geometries[index].shape;
        let make = match shape {
            Shape::Mesh(_) => Item::triangle,
            Shape::Quadric(_) | Shape::Curves(_) => Item::slot,
        };
        let elements = 0..shape.n_elements() as u32;
        let add_all = |items: &mut Vec<Item>, elements: Range<u32>| {
            for element in elements {
                let item = make(&shape.bounds(element), [index as u32, element]);
                accel::push_item(items, item);
            }
        };
        if elements.end <= WORTH_A_THREAD {
            add_all(&mut items, elements);
            continue;
        }
        let starts: Vec<u32> = elements.clone().step_by(WORTH_A_THREAD as usize).collect();
        let pieces: Vec<Vec<Item>> = starts
            .into_par_iter()
            .map(|start| {
                let elements = start..elements.end.min(start + WORTH_A_THREAD);
                let mut items = Vec::with_capacity(elements.len());
                add_all(&mut items, elements);
                items
            })
            .collect();
        items.extend(pieces.into_iter().flatten());
    }
    items
}

/// Their number.
pub(super) fn n_elements(geometries: &[Geometry], chosen: &[usize]) -> usize {
    let n_elements = |&index: &usize| geometries[index].shape.n_elements();
    chosen.iter().map(n_elements).sum()
}

/// A placed object.
pub(super) fn instance(id: InstanceId, bounds: &Bounds3) -> Item {
    Item::slot(bounds, [INSTANCE, id.index() as u32])
}

/// Builds the hierarchy over items of these geometries.
pub(super) fn hierarchy(items: Vec<Item>, geometries: &[Geometry]) -> Bvh {
    Bvh::build(items, |key| match &geometries[key[0] as usize].shape {
        Shape::Mesh(mesh) => mesh.corners(key[1]),
        Shape::Quadric(_) | Shape::Curves(_) => unreachable!("only meshes have triangles"),
    })
}

/// The element that a key names, unless it is that of an instance.
#[inline]
pub(super) fn element_of(key: Key) -> ElementRef {
    ElementRef {
        geometry: GeometryId::new(key[0] as usize),
        element: key[1],
    }
}

/// What the slot of a key holds.
#[inline]
pub(super) fn slot_of(key: Key) -> Slot {
    if key[0] == INSTANCE {
        Slot::Instance(InstanceId::new(key[1] as usize))
    } else {
        Slot::Element(element_of(key))
    }
}
