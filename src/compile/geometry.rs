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

use crate::compile::assets::{Assets, lack_of_memory};
use crate::compile::placement::{self, InstanceMotion, InstancePlacement, Placement};
use crate::compile::shapes::Local;
use crate::compile::space::{RenderSpace, WorldBounds};
use crate::describe::description::{Frame, ShapeEntity};
use crate::ids::{GeometryId, LightId, ObjectId};
use crate::light::{AreaLight, Light};
use crate::math::{AnimatedTransform, Motion, MotionChain, Transform};
use crate::shape::mesh::Linear;
use crate::shape::{Curves, Mesh, Quadric, Shape};
use crate::world::{CopiedLamp, Geometry, Instance, LampCopies, WorldParts};
pub(super) use load::{Loaded, load};
use load::{LocalObject, LocalShape, MANY_INSTANCES};
pub(super) use surface::Builders;
use surface::Surface;

/// Lights from which on no instance adds another: lamps and instances multiply, so that a short scene may ask for any
/// number. This many take about two thirds of a gigabyte.
const MAX_COPIED_LIGHTS: usize = 3 << 20;

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
        let assets = builders.assets;
        let mut surface = |shape: &LocalShape, in_object: bool, diagnostics: &mut Diagnostics| {
            builders.surface(shape, frame, in_object, &mut area_lights, diagnostics)
        };
        for shape in self.shapes {
            let of_surface = surface(&shape, false, diagnostics);
            if of_surface.is_nothing() {
                continue;
            }
            match shape.world_from_object.clone() {
                Placement::Still(definition) => {
                    let LocalShape { local, entity, .. } = shape;
                    let transform = space.place(&definition);
                    let unit = space.scale();
                    let placed = placed(local, &entity, Some(&definition), &transform, unit, None);
                    origins.note(&entity);
                    add(parts, placed, &of_surface, &entity, diagnostics);
                }
                Placement::Moving(moving) => {
                    let object = object(parts, origins, vec![(shape, of_surface)], diagnostics);
                    let motion = object.motion(space, &[*moving]);
                    parts.instances.push(Instance {
                        object: object.id,
                        render_from_object: motion,
                        growth: object.growth(space),
                    });
                }
            }
        }
        for object in self.objects {
            let surfaces: Vec<Surface> = object
                .shapes
                .iter()
                .map(|shape| surface(shape, true, diagnostics))
                .collect();
            let placements = &self.placements[object.placements.clone()];
            object.place(
                surfaces,
                placements,
                (space, assets),
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
        (space, assets): (&RenderSpace, &dyn Assets),
        (parts, origins): (&mut WorldParts, &mut Origins),
        diagnostics: &mut Diagnostics,
    ) {
        let only_one = placements.len() == 1;
        let is_still =
            |p: &InstancePlacement| matches!(p.world_from_instance, InstanceMotion::Still(_));
        let all_still = placements.iter().all(is_still);
        let (mut shared, mut lamps) = (Vec::new(), Vec::new());
        let shapes = self.shapes.into_iter().zip(surfaces);
        for (shape, mut surface) in shapes.filter(|(_, surface)| !surface.is_nothing()) {
            let emits = surface.emission.is_some();
            match shape.still() {
                Some(definition) if all_still && (only_one || emits) => {
                    let entity = &shape.entity;
                    if !only_one
                        && let Some(lack) =
                            lack_of_memory(bytes_of_copies(&shape, placements), assets)
                    {
                        let message = format!("a light in {} instances {lack}", placements.len());
                        diagnostics.push(
                            Diagnostic::error("too-large", entity.entity.span, message)
                                .with_label("it is left out"),
                        );
                        continue;
                    }
                    let mut copies = Copies::default();
                    let first_light = parts.lights.len();
                    let mut n_copies = placements.len();
                    for (n_placed, placement) in placements.iter().enumerate() {
                        let n_lights = parts.lights.len() + copies.n_elements();
                        if emits && n_placed > 0 && n_lights >= MAX_COPIED_LIGHTS {
                            n_copies = n_placed;
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
                        let placed = placed(
                            local,
                            entity,
                            Some(definition),
                            &transform,
                            space.scale(),
                            Some(&instance),
                        );
                        if let Some(whole) = copies.push(placed) {
                            origins.note(entity);
                            add(parts, whole, &surface, entity, diagnostics);
                        }
                    }
                    if let Some(rest) = copies.0 {
                        origins.note(entity);
                        add(parts, rest, &surface, entity, diagnostics);
                    }
                    if emits && !only_one {
                        // Copies follow each other, whether or not they are of one mesh.
                        let n_elements = (parts.lights.len() - first_light) / n_copies;
                        let first_of = |copy| LightId::new(first_light + copy * n_elements);
                        lamps.push(CopiedLamp {
                            n_elements: n_elements as u32,
                            first_lights: (0..n_copies).map(first_of).collect(),
                        });
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
        if !lamps.is_empty() {
            let affine = |placement: &InstancePlacement| *placement.start().affine();
            let place = |placement| space.affine() * affine(placement);
            parts.lamp_copies.push(LampCopies {
                render_from_object: placements.iter().map(place).collect(),
                shapes: lamps,
            });
        }
        if !shared.is_empty() {
            instantiate(shared, placements, space, (parts, origins), diagnostics);
        }
    }
}

/// Copies of one shape, one after the other: those of a mesh that differ in nothing but the places of their vertices
/// are one mesh, whose surface and bookkeeping exist once.
#[derive(Default)]
struct Copies(Option<Shape>);

impl Copies {
    fn n_elements(&self) -> usize {
        self.0.as_ref().map_or(0, Shape::n_elements)
    }

    /// Adds a copy. Gives back those before it if it is not of one mesh with them.
    fn push(&mut self, copy: Shape) -> Option<Shape> {
        match (&mut self.0, &copy) {
            (Some(Shape::Mesh(mesh)), Shape::Mesh(copy)) if mesh.has_room_for(copy) => {
                mesh.append(copy);
                None
            }
            _ => self.0.replace(copy),
        }
    }
}

/// Memory that an element of a lamp takes in a world besides its vertices: in the hierarchy and among the lights.
const BYTES_PER_LAMP: u128 = 256;

/// Memory that the still copies of a shape take.
fn bytes_of_copies(shape: &LocalShape, placements: &[InstancePlacement]) -> u128 {
    let of_one = match &shape.local {
        Local::Mesh(mesh) => {
            let of_vertex = 2 * size_of::<[f32; 3]>() + size_of::<[f32; 2]>();
            let of_triangle = BYTES_PER_LAMP + size_of::<[u32; 3]>() as u128;
            (mesh.positions.len() * of_vertex) as u128 + mesh.triangles.len() as u128 * of_triangle
        }
        Local::Form(_) | Local::Curves(_) => BYTES_PER_LAMP + size_of::<Geometry>() as u128,
    };
    of_one * placements.len() as u128
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
        growth: object.growth(space),
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
    /// Length in that space of one unit of the world.
    unit: f64,
}

impl PlacedObject {
    /// See [`Instance::growth`].
    fn growth(&self, space: &RenderSpace) -> f64 {
        space.scale() / self.unit
    }

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
        let unit = local_space.scale();
        let placed = placed(local, &entity, still.as_ref(), &transform, unit, None);
        origins.note(&entity);
        add(parts, placed, &surface, &entity, diagnostics);
        let geometry = parts.geometries.last_mut().expect("one was just added");
        geometry.object = id;
    }
    PlacedObject {
        id,
        local_space: local_space.place(&Transform::IDENTITY),
        unit: local_space.scale(),
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
                        is_turned: emission.is_turned,
                        has_holes: emission.has_holes,
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

/// The shape in the space reached by `transform`, in which one unit of the world is `unit` long. `instance` is the part
/// of it that comes from an instance: pbrt-v3 decides orientation by the definition alone, and normals then transform
/// as normals.
fn placed(
    local: Local,
    entity: &ShapeEntity,
    definition: Option<&Transform>,
    transform: &Transform,
    unit: f64,
    instance: Option<&Transform>,
) -> Shape {
    let definition_mirrors = definition.is_some_and(Transform::swaps_handedness);
    match local {
        Local::Form(form) => {
            let flip_normal = entity.reverse_orientation != definition_mirrors;
            let form = match entity.area_light {
                None => form.defined_under(definition.unwrap_or(&Transform::IDENTITY).affine()),
                Some(_) => form,
            };
            Shape::Quadric(Quadric::new(form, *transform, flip_normal).with_unit(unit))
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
            mesh.unit = unit as f32;
            mesh.normal_unit = (unit / mean_scale(transform)) as f32;
            mesh.instance = instance.map(|instance| {
                Box::new(Linear {
                    forward: instance.affine().matrix3,
                    inverse: instance.inverse().affine().matrix3,
                })
            });
            Shape::Mesh(mesh)
        }
    }
}

/// How many times as long lengths become, in the mean.
fn mean_scale(transform: &Transform) -> f64 {
    transform.determinant().abs().cbrt()
}

fn move_vertices(mesh: &mut Mesh, transform: &Transform) {
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    for p in &mut mesh.positions {
        *p = transform.point(wide(*p)).as_vec3().to_array();
    }
    // Directions keep their relative lengths, which weigh interpolation, at a size that suits f32.
    let size = mean_scale(transform);
    for n in &mut mesh.normals {
        *n = (transform.normal(wide(*n)) * size).as_vec3().to_array();
    }
    for s in &mut mesh.tangents {
        *s = (transform.vector(wide(*s)) / size).as_vec3().to_array();
    }
}
