//! Reading shapes in parallel, and how large the scene is that they make.

use std::ops::Range;

use glam::DVec3;
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, ParallelIterator,
};
use tyndall_parser::diagnostic::Diagnostics;
use tyndall_parser::schema::Family;

use crate::compile::assets::Assets;
use crate::compile::placement::{InstancePlacement, Placement, placement};
use crate::compile::shapes::{Local, Masks, ReadShape, read_shape};
use crate::compile::space::{NearPlace, View, WorldBounds};
use crate::describe::description::{Frame, MaterialEntity, ObjectEntity, ObjectRef, ShapeEntity};
use crate::math::Transform;

/// A shape that was read, with the state it was made under.
pub(super) struct LocalShape {
    pub(super) local: Local,
    pub(super) masks: Masks,
    pub(super) world_from_object: Placement,
    /// Box in world space, at both key frames.
    pub(super) world_bounds: WorldBounds,
    pub(super) entity: ShapeEntity,
}

/// An object; it has no shapes if no instance places it.
pub(super) struct LocalObject {
    pub(super) shapes: Vec<LocalShape>,
    /// Which of the placements of the frame are its own.
    pub(super) placements: Range<usize>,
}

/// The shapes of a frame, read but not yet placed.
pub(in crate::compile) struct Loaded {
    pub(super) shapes: Vec<LocalShape>,
    pub(super) objects: Vec<LocalObject>,
    /// Of all objects, those of each in file order.
    pub(super) placements: Vec<InstancePlacement>,
}

/// Instances that are worth a second thread.
pub(super) const MANY_INSTANCES: usize = 1 << 10;

/// Reads all shapes that the picture may show, in parallel; findings come in file order.
pub(in crate::compile) fn load(
    frame: &mut Frame,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Loaded {
    let times = frame.transform_times;
    // Scenes may consist of instances: collected this way, they stay in the memory in which they are.
    let mut placements: Vec<InstancePlacement> = std::mem::take(&mut frame.instances)
        .into_iter()
        .filter_map(|instance| InstancePlacement::new(instance, times, diagnostics))
        .collect();
    placements.sort_by_key(|placement| placement.object);
    let mut by_object = placements
        .chunk_by(|a, b| a.object == b.object)
        .map(|chunk| (chunk[0].object, chunk.len()))
        .peekable();
    let mut n_placed = 0;
    let ranges: Vec<Range<usize>> = (0..)
        .take(frame.objects.len())
        .map(|object| {
            let own = by_object.next_if(|&(placed, _)| placed == ObjectRef(object));
            let start = n_placed;
            n_placed += own.map_or(0, |(_, n)| n);
            start..n_placed
        })
        .collect();
    let keeps_faces = (frame.textures.iter()).any(|texture| texture.entity.kind.value == "ptex");
    let mut read = |entities: Vec<ShapeEntity>| {
        let materials = &frame.materials;
        read_all(entities, materials, times, keeps_faces, assets, diagnostics)
    };
    let shapes = read(std::mem::take(&mut frame.shapes));
    let objects = frame
        .objects
        .iter_mut()
        .zip(ranges)
        .map(|(object, placements)| {
            let entities = std::mem::take(&mut object.shapes);
            let shapes = if placements.is_empty() {
                Vec::new()
            } else {
                read(entities)
            };
            LocalObject { shapes, placements }
        })
        .collect();
    Loaded {
        shapes,
        objects,
        placements,
    }
}

fn read_all(
    entities: Vec<ShapeEntity>,
    materials: &[MaterialEntity],
    times: [f64; 2],
    keeps_faces: bool,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Vec<LocalShape> {
    let read: Vec<(Option<LocalShape>, Diagnostics)> = entities
        .into_par_iter()
        .map(|mut entity| {
            let mut diagnostics = Diagnostics::default();
            let overridden = entity.private_material.as_ref().and_then(|_| {
                Family::Material.find(&materials[entity.material.0 as usize].entity.kind.value)
            });
            let read = read_shape(
                &mut entity,
                overridden,
                keeps_faces,
                assets,
                &mut diagnostics,
            );
            let shape = read.and_then(|ReadShape { local, masks }| {
                let (pair, span) = (entity.world_from_object, entity.entity.span);
                let world_from_object = placement(pair, times, span, &mut diagnostics)?;
                let [start, end] = world_from_object.ends();
                let mut world_bounds = local.bounds(&start);
                if let Placement::Moving(_) = world_from_object {
                    world_bounds = world_bounds.union(local.bounds(&end));
                }
                Some(LocalShape {
                    local,
                    masks,
                    world_from_object,
                    world_bounds,
                    entity,
                })
            });
            (shape, diagnostics)
        })
        .collect();
    let mut shapes = Vec::with_capacity(read.len());
    for (shape, found) in read {
        shapes.extend(shape);
        diagnostics.append(found);
    }
    shapes
}

impl LocalShape {
    /// Whether it stands still, and where.
    pub(super) fn still(&self) -> Option<&Transform> {
        match &self.world_from_object {
            Placement::Still(transform) => Some(transform),
            Placement::Moving(_) => None,
        }
    }
}

impl Local {
    /// Box around the shape in a space reached by `transform`.
    pub(super) fn bounds(&self, transform: &Transform) -> WorldBounds {
        let mut bounds = WorldBounds::EMPTY;
        match self {
            Self::Mesh(mesh) => mesh
                .positions
                .iter()
                .for_each(|p| bounds.add(transform.point(DVec3::from(p.map(f64::from))))),
            Self::Curves(source) => source
                .corners()
                .for_each(|p| bounds.add(transform.point(p))),
            Self::Form(form) => form
                .corners()
                .iter()
                .for_each(|p| bounds.add(transform.point(*p))),
        }
        bounds
    }
}

fn bounds_of(shapes: &[LocalShape]) -> WorldBounds {
    shapes
        .iter()
        .map(|shape| shape.world_bounds)
        .fold(WorldBounds::EMPTY, WorldBounds::union)
}

impl Loaded {
    /// Names of object definitions that no instance places.
    pub(in crate::compile) fn skipped_objects(&self, entities: &[ObjectEntity]) -> Vec<String> {
        let skipped = self.objects.iter().zip(entities);
        let skipped = skipped.filter(|(object, _)| object.placements.is_empty());
        skipped
            .map(|(_, entity)| entity.name.value.clone())
            .collect()
    }

    /// Where the origin of render space is.
    pub(in crate::compile) fn origin(&self, view: &View) -> DVec3 {
        let mut nearest = self
            .shapes
            .iter()
            .map(|shape| view.nearest_of(&shape.world_bounds))
            .fold(None, NearPlace::nearer);
        for object in &self.objects {
            let of_object = bounds_of(&object.shapes);
            let of_placement = |placement: &InstancePlacement| {
                view.nearest_of(&placement.world_bounds(&of_object))
            };
            nearest = self.placements[object.placements.clone()]
                .par_iter()
                .with_min_len(MANY_INSTANCES)
                .map(of_placement)
                .reduce(|| nearest, NearPlace::nearer);
        }
        view.origin(nearest)
    }

    /// Box around the scene in world space; motion counts at its key frames.
    pub(in crate::compile) fn world_bounds(&self) -> WorldBounds {
        let mut bounds = bounds_of(&self.shapes);
        for object in &self.objects {
            let of_object = bounds_of(&object.shapes);
            let add = |bounds: WorldBounds, placement: &InstancePlacement| {
                bounds.union(placement.world_bounds(&of_object))
            };
            bounds = self.placements[object.placements.clone()]
                .par_iter()
                .with_min_len(MANY_INSTANCES)
                .fold(|| WorldBounds::EMPTY, add)
                .reduce(|| bounds, WorldBounds::union);
        }
        bounds
    }
}
