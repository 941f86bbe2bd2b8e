//! Reading shapes in parallel, and how large the scene is that they make.

use glam::DVec3;
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use tyndall_parser::diagnostic::Diagnostics;
use tyndall_parser::schema::Family;

use crate::compile::assets::Assets;
use crate::compile::placement::{Placement, placement};
use crate::compile::shapes::{Local, Masks, ReadShape, read_shape};
use crate::compile::space::WorldBounds;
use crate::describe::description::{Frame, MaterialEntity, ObjectEntity, ObjectRef, ShapeEntity};
use crate::math::Transform;

/// A shape that was read, with the state it was made under.
pub(super) struct LocalShape {
    pub(super) local: Local,
    pub(super) masks: Masks,
    pub(super) world_from_object: Placement,
    pub(super) entity: ShapeEntity,
}

/// An object, and where instances place it; it has no shapes if none does.
pub(super) struct LocalObject {
    pub(super) shapes: Vec<LocalShape>,
    /// World from instance.
    pub(super) placements: Vec<Placement>,
}

/// The shapes of a frame, read but not yet placed.
pub(in crate::compile) struct Loaded {
    pub(super) shapes: Vec<LocalShape>,
    pub(super) objects: Vec<LocalObject>,
}

/// Reads all shapes that the picture may show, in parallel; findings come in file order.
pub(in crate::compile) fn load(
    frame: &mut Frame,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Loaded {
    let times = frame.transform_times;
    let mut placements = vec![Vec::new(); frame.objects.len()];
    // Scenes may consist of instances: there is no need to have them twice.
    for instance in std::mem::take(&mut frame.instances) {
        let ObjectRef(object) = instance.object;
        let pair = instance.world_from_instance.pair();
        let placed = placement(pair, times, instance.span, diagnostics);
        placements[object as usize].extend(placed);
    }
    let mut read = |entities: Vec<ShapeEntity>| {
        read_all(entities, &frame.materials, times, assets, diagnostics)
    };
    let shapes = read(std::mem::take(&mut frame.shapes));
    let objects = frame
        .objects
        .iter_mut()
        .zip(placements)
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
    Loaded { shapes, objects }
}

fn read_all(
    entities: Vec<ShapeEntity>,
    materials: &[MaterialEntity],
    times: [f64; 2],
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
            let read = read_shape(&mut entity, overridden, assets, &mut diagnostics);
            let shape = read.and_then(|ReadShape { local, masks }| {
                let (pair, span) = (entity.world_from_object, entity.entity.span);
                let world_from_object = placement(pair, times, span, &mut diagnostics)?;
                Some(LocalShape {
                    local,
                    masks,
                    world_from_object,
                    entity,
                })
            });
            (shape, diagnostics)
        })
        .collect();
    let mut shapes = Vec::with_capacity(read.len());
    for (shape, found) in read {
        shapes.extend(shape);
        found
            .list
            .into_iter()
            .for_each(|diagnostic| diagnostics.push(diagnostic));
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

    /// Box around the shape in a space reached by `transform`.
    pub(super) fn bounds(&self, transform: &Transform) -> WorldBounds {
        let mut bounds = WorldBounds::EMPTY;
        match &self.local {
            Local::Mesh(mesh) => mesh
                .positions
                .iter()
                .for_each(|p| bounds.add(transform.point(DVec3::from(p.map(f64::from))))),
            Local::Curves(source) => source
                .corners()
                .for_each(|p| bounds.add(transform.point(p))),
            Local::Form(form) => form
                .corners()
                .iter()
                .for_each(|p| bounds.add(transform.point(*p))),
        }
        bounds
    }

    /// Box around the shape at both key frames.
    fn bounds_at_ends(&self) -> WorldBounds {
        let [start, end] = self.world_from_object.ends();
        let bounds = self.bounds(&start);
        if self.still().is_some() {
            bounds
        } else {
            bounds.union(self.bounds(&end))
        }
    }
}

fn bounds_of(shapes: &[LocalShape]) -> WorldBounds {
    shapes
        .par_iter()
        .map(LocalShape::bounds_at_ends)
        .reduce(|| WorldBounds::EMPTY, WorldBounds::union)
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

    /// Box around the scene in world space; motion counts at its key frames.
    pub(in crate::compile) fn world_bounds(&self) -> WorldBounds {
        let mut bounds = bounds_of(&self.shapes);
        for object in &self.objects {
            let corners = bounds_of(&object.shapes).corners();
            let mut add = |transform: &Transform| {
                for corner in corners {
                    bounds.add(transform.point(corner));
                }
            };
            for placement in &object.placements {
                match placement {
                    Placement::Still(transform) => add(transform),
                    Placement::Moving(moving) => moving.keys().iter().for_each(&mut add),
                }
            }
        }
        bounds
    }
}
