//! Shapes, objects and instances: read in parallel, then placed in render space with their materials, media and
//! lights.
//!
//! A static instance becomes part of the world itself where that serves better: if its object has no other, and for
//! whatever emits, so that every copy lights the scene.

mod load;
mod surface;

use glam::{DAffine3, DVec3};
use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, ParallelExtend,
    ParallelIterator,
};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::Span;

use crate::compile::placement::{self, InstanceMotion, InstancePlacement, Placement};
use crate::compile::shapes::Local;
use crate::compile::space::{RenderSpace, WorldBounds};
use crate::describe::description::{Frame, ShapeEntity};
use crate::ids::{GeometryId, LightId, ObjectId};
use crate::light::{AreaLight, Light};
use crate::math::{AnimatedTransform, Motion, MotionChain, Transform};
use crate::shape::{Curves, Mesh, Quadric, Shape};
use crate::world::{Geometry, Instance, WorldParts};
pub(super) use load::{Loaded, load};
use load::{LocalObject, LocalShape, MANY_INSTANCES};
pub(super) use surface::Builders;
use surface::Surface;

/// Lights from which on no instance adds another: lamps and instances multiply, so that a short scene may ask for any
/// number. This many take about a gigabyte.
const MAX_COPIED_LIGHTS: usize = 1 << 21;

/// Elements that are worth a second thread to look at.
const MANY_ELEMENTS: usize = 1 << 12;

/// Where the geometries of a world come from: the place of each one's directive, by [`GeometryId`].
#[derive(Clone, Debug, Default)]
pub struct Origins(Vec<Span>);

impl Origins {
    /// The place of the directive that made a geometry.
    pub fn of(&self, geometry: GeometryId) -> Option<Span> {
        self.0.get(geometry.index()).copied()
    }

    /// The next geometry comes from this directive.
    fn note(&mut self, entity: &ShapeEntity) {
        self.0.push(entity.entity.span);
    }
}

impl Loaded {
    /// Moves everything to render space and attaches what belongs to the surfaces.
    pub(super) fn place(
        self,
        frame: &Frame,
        space: &RenderSpace,
        builders: &mut Builders,
        parts: &mut WorldParts,
        origins: &mut Origins,
        diagnostics: &mut Diagnostics,
    ) {
        let mut area_lights = vec![None; frame.area_lights.len()];
        let mut surface = |shape: &LocalShape, diagnostics: &mut Diagnostics| {
            builders.surface(shape, frame, &mut area_lights, diagnostics)
        };
        for shape in self.shapes {
            let of_surface = surface(&shape, diagnostics);
            match shape.world_from_object.clone() {
                Placement::Still(definition) => {
                    let LocalShape { local, entity, .. } = shape;
                    let transform = space.place(&definition);
                    let placed = placed(local, &entity, Some(&definition), &transform, None);
                    origins.note(&entity);
                    add(parts, placed, &of_surface, &entity, diagnostics);
                }
                Placement::Moving(moving) => {
                    let object = object(parts, origins, vec![(shape, of_surface)], diagnostics);
                    let motion = object.motion(space, &[*moving]);
                    parts.instances.push(Instance {
                        object: object.id,
                        render_from_object: motion,
                    });
                }
            }
        }
        for object in self.objects {
            let surfaces: Vec<Surface> = object
                .shapes
                .iter()
                .map(|shape| surface(shape, diagnostics))
                .collect();
            let placements = &self.placements[object.placements.clone()];
            object.place(
                surfaces,
                placements,
                space,
                (parts, &mut *origins),
                diagnostics,
            );
        }
    }
}

impl LocalObject {
    /// Places an object wherever an instance wants it.
    fn place(
        self,
        surfaces: Vec<Surface>,
        placements: &[InstancePlacement],
        space: &RenderSpace,
        (parts, origins): (&mut WorldParts, &mut Origins),
        diagnostics: &mut Diagnostics,
    ) {
        let only_one = placements.len() == 1;
        let is_still =
            |p: &InstancePlacement| matches!(p.world_from_instance, InstanceMotion::Still(_));
        let all_still = placements.iter().all(is_still);
        let mut shared = Vec::new();
        for (shape, mut surface) in self.shapes.into_iter().zip(surfaces) {
            let emits = surface.emission.is_some();
            match shape.still() {
                Some(definition) if all_still && (only_one || emits) => {
                    for (n_placed, placement) in placements.iter().enumerate() {
                        let entity = &shape.entity;
                        if emits && n_placed > 0 && parts.lights.len() >= MAX_COPIED_LIGHTS {
                            let n_left = placements.len() - n_placed;
                            let message = format!(
                                "instances make more than {MAX_COPIED_LIGHTS} lights, each of them a light by itself"
                            );
                            diagnostics.push(
                                Diagnostic::error("too-many-lights", entity.entity.span, message)
                                    .with_label(format!("{n_left} copies are left out")),
                            );
                            break;
                        }
                        let instance = placement.start();
                        let transform = space.place(&instance.compose(definition));
                        let local = shape.local.clone();
                        let placed =
                            placed(local, entity, Some(definition), &transform, Some(&instance));
                        origins.note(entity);
                        add(parts, placed, &surface, entity, diagnostics);
                    }
                }
                still => {
                    if surface.emission.take().is_some() {
                        let message = "an area light in a moving instance does not emit";
                        let span = shape.entity.entity.span;
                        diagnostics.push(Diagnostic::warning("moving-light", span, message));
                    }
                    if still.is_some() {
                        shared.push((shape, surface));
                    } else {
                        let alone = vec![(shape, surface)];
                        let into = (&mut *parts, &mut *origins);
                        instantiate(alone, placements, space, into, diagnostics);
                    }
                }
            }
        }
        if !shared.is_empty() {
            instantiate(shared, placements, space, (parts, origins), diagnostics);
        }
    }
}

/// Makes an object of shapes that move as one, and an instance of it at each placement.
fn instantiate(
    shapes: Vec<(LocalShape, Surface)>,
    placements: &[InstancePlacement],
    space: &RenderSpace,
    (parts, origins): (&mut WorldParts, &mut Origins),
    diagnostics: &mut Diagnostics,
) {
    let own_motion = match &shapes[0].0.world_from_object {
        Placement::Moving(moving) => Some(**moving),
        Placement::Still(_) => None,
    };
    let object = object(parts, origins, shapes, diagnostics);
    let instance = |placement: &InstancePlacement| Instance {
        object: object.id,
        render_from_object: match (&placement.world_from_instance, own_motion) {
            (InstanceMotion::Still(world_from_instance), None) => {
                object.still(space, world_from_instance)
            }
            (InstanceMotion::Still(_), Some(own)) => {
                object.motion_within(space, &placement.start(), &[own])
            }
            (InstanceMotion::Moving(moving), own_motion) => {
                let links: Vec<AnimatedTransform> =
                    std::iter::once(**moving).chain(own_motion).collect();
                object.motion(space, &links)
            }
        },
    };
    let placements = placements.par_iter().with_min_len(MANY_INSTANCES);
    parts.instances.par_extend(placements.map(instance));
}

/// An object in the making: its id, and its own space around its shapes.
struct PlacedObject {
    id: ObjectId,
    local_space: Transform,
}

impl PlacedObject {
    fn still(&self, space: &RenderSpace, world_from_instance: &DAffine3) -> Motion {
        let object_space = self.local_space.inverse();
        // The inverse of the step between is not asked for.
        let affine = space.affine() * *world_from_instance * *object_space.affine();
        let in_steps = || {
            let world_from_instance = placement::with_inverse(world_from_instance);
            space.place(&world_from_instance).compose(&object_space)
        };
        Motion::Still(Transform::from_affine(affine).unwrap_or_else(in_steps))
    }

    fn motion(&self, space: &RenderSpace, links: &[AnimatedTransform]) -> Motion {
        self.motion_within(space, &Transform::IDENTITY, links)
    }

    fn motion_within(
        &self,
        space: &RenderSpace,
        world_from_instance: &Transform,
        links: &[AnimatedTransform],
    ) -> Motion {
        Motion::Moving(Box::new(MotionChain {
            outer: space.place(world_from_instance),
            links: links.to_vec(),
            inner: self.local_space.inverse(),
        }))
    }
}

/// Adds the shapes to the world as an object. A moving shape is in its own object space, a still one in that of the
/// object's definition.
fn object(
    parts: &mut WorldParts,
    origins: &mut Origins,
    shapes: Vec<(LocalShape, Surface)>,
    diagnostics: &mut Diagnostics,
) -> PlacedObject {
    let id = ObjectId::new(parts.n_objects);
    parts.n_objects += 1;
    let definition = |shape: &LocalShape| shape.still().copied().unwrap_or(Transform::IDENTITY);
    let bounds = shapes
        .iter()
        .map(|(shape, _)| match &shape.world_from_object {
            Placement::Still(_) => shape.world_bounds,
            Placement::Moving(_) => shape.local.bounds(&Transform::IDENTITY),
        })
        .fold(WorldBounds::EMPTY, WorldBounds::union);
    let local_space = RenderSpace::new(bounds, bounds.center());
    for (shape, surface) in shapes {
        let transform = local_space.place(&definition(&shape));
        let still = shape.still().copied();
        let LocalShape { local, entity, .. } = shape;
        let placed = placed(local, &entity, still.as_ref(), &transform, None);
        origins.note(&entity);
        add(parts, placed, &surface, &entity, diagnostics);
        let geometry = parts.geometries.last_mut().expect("one was just added");
        geometry.object = id;
    }
    PlacedObject {
        id,
        local_space: local_space.place(&Transform::IDENTITY),
    }
}

/// Adds a placed shape to the world, with a light for each element if it emits.
fn add(
    parts: &mut WorldParts,
    shape: Shape,
    surface: &Surface,
    entity: &ShapeEntity,
    diagnostics: &mut Diagnostics,
) {
    report_degenerate(&shape, entity, diagnostics);
    let geometry = GeometryId::new(parts.geometries.len());
    let first_light = match surface.emission {
        None => LightId::NONE,
        Some(emission) => {
            let first = LightId::new(parts.lights.len());
            parts
                .lights
                .extend((0..shape.n_elements() as u32).map(|element| {
                    Light::Area(AreaLight {
                        geometry,
                        element,
                        radiance: emission.radiance,
                        two_sided: emission.two_sided,
                    })
                }));
            let (n_lights, medium) = (parts.lights.len(), surface.medium_outside);
            parts.light_media.resize(n_lights, medium);
            parts.light_samples.resize(n_lights, emission.n_samples);
            first
        }
    };
    parts.geometries.push(Geometry {
        shape,
        material: surface.material,
        media: surface.media,
        cutout: surface.cutout,
        first_light,
        object: ObjectId::NONE,
    });
}

fn report_degenerate(shape: &Shape, entity: &ShapeEntity, diagnostics: &mut Diagnostics) {
    let n = shape.n_elements();
    let n_empty = (0..n as u32)
        .into_par_iter()
        .with_min_len(MANY_ELEMENTS)
        .filter(|&element| !shape.has_area(element))
        .count();
    if n_empty == 0 {
        return;
    }
    let what = match shape {
        Shape::Mesh(_) => format!("{n_empty} of {n} triangles have no area and are left out"),
        Shape::Quadric(_) => "the shape has no area and is left out".to_owned(),
        Shape::Curves(_) => {
            format!("{n_empty} of {n} parts of the curve have no area and are left out")
        }
    };
    diagnostics.push(Diagnostic::warning("no-area", entity.entity.span, what));
}

/// The shape in the space reached by `transform`. `instance` is the part of it that comes from an instance: pbrt-v3
/// decides orientation by the definition alone, and normals then transform as normals.
fn placed(
    local: Local,
    entity: &ShapeEntity,
    definition: Option<&Transform>,
    transform: &Transform,
    instance: Option<&Transform>,
) -> Shape {
    let definition_mirrors = definition.is_some_and(Transform::swaps_handedness);
    match local {
        Local::Form(form) => {
            let flip_normal = entity.reverse_orientation != definition_mirrors;
            Shape::Quadric(Quadric::new(form, *transform, flip_normal))
        }
        Local::Curves(source) => {
            let flip_normal = entity.reverse_orientation != definition_mirrors;
            Shape::Curves(Curves::new(&source, transform, flip_normal))
        }
        Local::Mesh(mut mesh) => {
            move_vertices(&mut mesh, transform);
            mesh.reverse_orientation = entity.reverse_orientation;
            // The face normal is computed from the placed vertices, whose winding an instance may have mirrored.
            let instance_mirrors = instance.is_some_and(Transform::swaps_handedness);
            mesh.flip_face = definition_mirrors != instance_mirrors;
            let size = |t: &Transform| t.determinant().abs().cbrt();
            mesh.unit = (size(transform) / definition.map_or(1.0, size)) as f32;
            Shape::Mesh(mesh)
        }
    }
}

fn move_vertices(mesh: &mut Mesh, transform: &Transform) {
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    for p in &mut mesh.positions {
        *p = transform.point(wide(*p)).as_vec3().to_array();
    }
    // Directions keep their relative lengths, which weigh interpolation, at a size that suits f32.
    let size = transform.determinant().abs().cbrt();
    for n in &mut mesh.normals {
        *n = (transform.normal(wide(*n)) * size).as_vec3().to_array();
    }
    for s in &mut mesh.tangents {
        *s = (transform.vector(wide(*s)) / size).as_vec3().to_array();
    }
}
