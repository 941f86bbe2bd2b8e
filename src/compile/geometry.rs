//! Shapes, objects and instances: read in parallel, then placed in render space with their materials, media and
//! lights.
//!
//! A static instance becomes part of the world itself where that serves better: if its object has no other, and for
//! whatever emits, so that every copy lights the scene.

use glam::DVec3;
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::Family;

use crate::compile::assets::Assets;
use crate::compile::materials::MaterialBuilder;
use crate::compile::media::Media;
use crate::compile::placement::{Placement, placement};
use crate::compile::reader::{ParamReader, Textured};
use crate::compile::shapes::{Local, Mask, Masks, ReadShape, read_shape};
use crate::compile::space::{RenderSpace, WorldBounds};
use crate::compile::textures::TextureBuilder;
use crate::compile::{lights, lookup};
use crate::describe::description::{
    AreaLightRef, Entity, Frame, MaterialEntity, ObjectRef, ShapeEntity,
};
use crate::ids::{GeometryId, LightId, MaterialId, MediumId, ObjectId};
use crate::light::{AreaLight, Light};
use crate::math::{AnimatedTransform, Motion, MotionChain, Transform};
use crate::shape::curve::CurveStyle;
use crate::shape::{Curves, Mesh, Quadric, Shape};
use crate::spectrum::Rgb;
use crate::texture::FloatSource;
use crate::world::{Cutout, Geometry, Instance, MediumInterface, WorldParts};

/// Lights from which on no instance adds another: lamps and instances multiply, so that a short scene may ask for any
/// number. This many take about a gigabyte.
const MAX_COPIED_LIGHTS: usize = 1 << 21;

/// A shape that was read, with the state it was made under.
struct LocalShape {
    local: Local,
    masks: Masks,
    world_from_object: Placement,
    entity: ShapeEntity,
}

/// An object that some instance places.
struct LocalObject {
    shapes: Vec<LocalShape>,
    n_instances: usize,
}

struct LocalInstance {
    object: ObjectRef,
    world_from_instance: Placement,
}

/// The shapes of a frame, read but not yet placed.
pub(super) struct Loaded {
    shapes: Vec<LocalShape>,
    objects: Vec<LocalObject>,
    instances: Vec<LocalInstance>,
}

/// What belongs to the surface of a shape, wherever it is placed.
#[derive(Clone, Copy)]
struct Surface {
    material: MaterialId,
    media: Option<MediumInterface>,
    /// Asked for where it emits.
    medium_outside: MediumId,
    /// If it emits.
    emission: Option<Emission>,
    cutout: Cutout,
}

/// What the elements of an emitting shape have in common.
#[derive(Clone, Copy)]
struct Emission {
    radiance: Rgb,
    two_sided: bool,
    n_samples: u32,
}

/// The arenas' builders.
pub(super) struct Builders<'a> {
    pub(super) materials: MaterialBuilder,
    pub(super) textures: TextureBuilder<'a>,
    pub(super) media: Media<'a>,
    pub(super) assets: &'a dyn Assets,
    /// Shadow masks matter to the integrator.
    pub(super) heeds_shadow_masks: bool,
}

/// Reads all shapes that the picture may show, in parallel; findings come in file order.
pub(super) fn load(
    frame: &mut Frame,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Loaded {
    let times = frame.transform_times;
    let mut instances = Vec::new();
    let mut n_instances = vec![0; frame.objects.len()];
    for instance in &frame.instances {
        let pair = instance.world_from_instance;
        if let Some(world_from_instance) = placement(pair, times, instance.span, diagnostics) {
            n_instances[instance.object.0 as usize] += 1;
            instances.push(LocalInstance {
                object: instance.object,
                world_from_instance,
            });
        }
    }
    let mut read = |entities: Vec<ShapeEntity>| {
        read_all(entities, &frame.materials, times, assets, diagnostics)
    };
    let shapes = read(std::mem::take(&mut frame.shapes));
    let objects = frame
        .objects
        .iter_mut()
        .zip(n_instances)
        .map(|(object, n_instances)| {
            let entities = std::mem::take(&mut object.shapes);
            let shapes = if n_instances == 0 {
                Vec::new()
            } else {
                read(entities)
            };
            LocalObject {
                shapes,
                n_instances,
            }
        })
        .collect();
    Loaded {
        shapes,
        objects,
        instances,
    }
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
    fn still(&self) -> Option<&Transform> {
        match &self.world_from_object {
            Placement::Still(transform) => Some(transform),
            Placement::Moving(_) => None,
        }
    }

    /// Box around the shape in a space reached by `transform`.
    fn bounds(&self, transform: &Transform) -> WorldBounds {
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
    /// Object definitions that no instance places.
    pub(super) fn n_objects_skipped(&self) -> usize {
        self.objects
            .iter()
            .filter(|object| object.n_instances == 0)
            .count()
    }

    /// Box around the scene in world space; motion counts at its key frames.
    pub(super) fn world_bounds(&self) -> WorldBounds {
        let mut bounds = bounds_of(&self.shapes);
        let objects: Vec<WorldBounds> = self
            .objects
            .iter()
            .map(|object| bounds_of(&object.shapes))
            .collect();
        for instance in &self.instances {
            for transform in instance.world_from_instance.ends() {
                for corner in objects[instance.object.0 as usize].corners() {
                    bounds.add(transform.point(corner));
                }
            }
        }
        bounds
    }

    /// Moves everything to render space and attaches what belongs to the surfaces.
    pub(super) fn place(
        self,
        frame: &Frame,
        space: &RenderSpace,
        builders: &mut Builders,
        parts: &mut WorldParts,
        diagnostics: &mut Diagnostics,
    ) {
        // One look at each `AreaLightSource`, however many shapes emit by it.
        let mut area_lights = vec![None; frame.area_lights.len()];
        let mut surface = |shape: &LocalShape, diagnostics: &mut Diagnostics| {
            let surface = builders.surface(shape, frame, &mut area_lights, diagnostics);
            if surface.emission.is_some() {
                warn_of_bias(shape, &surface, diagnostics);
            }
            if builders.heeds_shadow_masks && surface.cutout.shadow_alpha.is_some() {
                warn_of_half_shadow(shape, diagnostics);
            }
            surface
        };
        for shape in self.shapes {
            let of_surface = surface(&shape, diagnostics);
            match shape.world_from_object.clone() {
                Placement::Still(definition) => {
                    let LocalShape { local, entity, .. } = shape;
                    let transform = space.place(&definition);
                    let placed = placed(local, &entity, Some(&definition), &transform, None);
                    add(parts, placed, &of_surface, &entity, diagnostics);
                }
                Placement::Moving(moving) => {
                    let object = object(parts, &[(&shape, of_surface)], diagnostics);
                    let motion = object.motion(space, &[*moving]);
                    parts.instances.push(Instance {
                        object: object.id,
                        render_from_object: motion,
                    });
                }
            }
        }
        for (index, object) in self.objects.into_iter().enumerate() {
            let instances = self
                .instances
                .iter()
                .filter(|i| i.object.0 as usize == index);
            let placements: Vec<&Placement> = instances.map(|i| &i.world_from_instance).collect();
            let surfaces: Vec<Surface> = object
                .shapes
                .iter()
                .map(|shape| surface(shape, diagnostics))
                .collect();
            object.place(&surfaces, &placements, space, parts, diagnostics);
        }
    }
}

impl LocalObject {
    /// Places an object wherever an instance wants it.
    fn place(
        &self,
        surfaces: &[Surface],
        placements: &[&Placement],
        space: &RenderSpace,
        parts: &mut WorldParts,
        diagnostics: &mut Diagnostics,
    ) {
        let only_one = self.n_instances == 1;
        let all_still = placements.iter().all(|p| matches!(p, Placement::Still(_)));
        let mut shared = Vec::new();
        for (shape, surface) in self.shapes.iter().zip(surfaces) {
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
                        let [instance, _] = placement.ends();
                        let transform = space.place(&instance.compose(definition));
                        let local = shape.local.clone();
                        let placed =
                            placed(local, entity, Some(definition), &transform, Some(&instance));
                        add(parts, placed, surface, entity, diagnostics);
                    }
                }
                still => {
                    let mut surface = *surface;
                    if surface.emission.take().is_some() {
                        let message = "an area light in a moving instance does not emit";
                        let span = shape.entity.entity.span;
                        diagnostics.push(Diagnostic::warning("moving-light", span, message));
                    }
                    if still.is_some() {
                        shared.push((shape, surface));
                    } else {
                        instantiate(&[(shape, surface)], placements, space, parts, diagnostics);
                    }
                }
            }
        }
        if !shared.is_empty() {
            instantiate(&shared, placements, space, parts, diagnostics);
        }
    }
}

/// Makes an object of shapes that move as one, and an instance of it at each placement.
fn instantiate(
    shapes: &[(&LocalShape, Surface)],
    placements: &[&Placement],
    space: &RenderSpace,
    parts: &mut WorldParts,
    diagnostics: &mut Diagnostics,
) {
    let own_motion = match &shapes[0].0.world_from_object {
        Placement::Moving(moving) => Some(**moving),
        Placement::Still(_) => None,
    };
    let object = object(parts, shapes, diagnostics);
    for placement in placements {
        let motion = match placement {
            Placement::Still(instance) => match own_motion {
                None => object.still(space, instance),
                Some(own) => object.motion_within(space, instance, &[own]),
            },
            Placement::Moving(moving) => {
                let links: Vec<AnimatedTransform> =
                    std::iter::once(**moving).chain(own_motion).collect();
                object.motion(space, &links)
            }
        };
        parts.instances.push(Instance {
            object: object.id,
            render_from_object: motion,
        });
    }
}

/// An object in the making: its id, and its own space around its shapes.
struct PlacedObject {
    id: ObjectId,
    local_space: Transform,
}

impl PlacedObject {
    fn still(&self, space: &RenderSpace, world_from_instance: &Transform) -> Motion {
        Motion::Still(
            space
                .place(world_from_instance)
                .compose(&self.local_space.inverse()),
        )
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
    shapes: &[(&LocalShape, Surface)],
    diagnostics: &mut Diagnostics,
) -> PlacedObject {
    let id = ObjectId::new(parts.n_objects);
    parts.n_objects += 1;
    let definition = |shape: &LocalShape| shape.still().copied().unwrap_or(Transform::IDENTITY);
    let bounds = shapes
        .iter()
        .map(|(shape, _)| shape.bounds(&definition(shape)))
        .fold(WorldBounds::EMPTY, WorldBounds::union);
    let local_space = RenderSpace::new(bounds, bounds.center());
    for (shape, surface) in shapes {
        let transform = local_space.place(&definition(shape));
        let placed = placed(
            shape.local.clone(),
            &shape.entity,
            shape.still(),
            &transform,
            None,
        );
        add(parts, placed, surface, &shape.entity, diagnostics);
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

impl Builders<'_> {
    fn surface(
        &mut self,
        shape: &LocalShape,
        frame: &Frame,
        area_lights: &mut [Option<Option<Emission>>],
        diagnostics: &mut Diagnostics,
    ) -> Surface {
        let entity = &shape.entity;
        let material = self.materials.id(entity, &mut self.textures, diagnostics);
        let mut emission = entity.area_light.and_then(|AreaLightRef(index)| {
            let index = index as usize;
            *area_lights[index].get_or_insert_with(|| {
                area_light(&frame.area_lights[index], self.assets, diagnostics)
            })
        });
        let mut side = |medium: Option<_>| {
            medium.map_or(MediumId::NONE, |medium| self.media.id(medium, diagnostics))
        };
        let media = (entity.media.inside != entity.media.outside).then(|| MediumInterface {
            inside: side(entity.media.inside),
            outside: side(entity.media.outside),
        });
        let medium_outside = match &media {
            Some(media) => media.outside,
            None if emission.is_some() => side(entity.media.outside),
            None => MediumId::NONE,
        };
        // What turns to whoever looks at it has no back.
        if let (Some(emission), Local::Curves(source)) = (&mut emission, &shape.local) {
            emission.two_sided |= source.style != CurveStyle::Ribbon;
        }
        Surface {
            material,
            media,
            medium_outside,
            emission,
            cutout: Cutout {
                alpha: self.mask(shape.masks.alpha, diagnostics),
                shadow_alpha: self.mask(shape.masks.shadow_alpha, diagnostics),
            },
        }
    }

    /// A mask, unless it is nowhere 0.
    fn mask(&mut self, mask: Mask, diagnostics: &mut Diagnostics) -> Option<FloatSource> {
        const OPAQUE: f32 = 1.0;
        let source = match mask {
            Mask::None => return None,
            Mask::Everywhere => FloatSource::Constant(0.0),
            Mask::Texture(texture) => {
                let texture = Textured::Texture(texture);
                self.textures.float_source(texture, OPAQUE, diagnostics)
            }
        };
        Some(source)
            .filter(|source| !matches!(source, FloatSource::Constant(alpha) if *alpha != 0.0))
    }
}

/// What an area light is; `None` if it is black.
fn area_light(
    entity: &Entity,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Emission> {
    let plugin = lookup(
        Family::AreaLight,
        &entity.kind,
        "nothing is emitted",
        diagnostics,
    )?;
    let radiance = lights::radiance(plugin, entity, "L", assets, diagnostics);
    let mut p = ParamReader::new(plugin, entity, diagnostics);
    let two_sided = p.bool("twosided");
    p.finish();
    let n_samples = lights::n_samples(Family::AreaLight, entity, diagnostics);
    Some(Emission {
        radiance: radiance?,
        two_sided,
        n_samples,
    })
}

/// Scales within this of 1 are what composing rotations leaves.
const UNSCALED: f64 = 1e-6;

/// Says where pbrt-v3's light sampling disagrees with its own surfaces: its picture is biased, and ours differs.
fn warn_of_bias(shape: &LocalShape, surface: &Surface, diagnostics: &mut Diagnostics) {
    let [world_from_object, _] = shape.world_from_object.ends();
    let entity = &shape.entity;
    let kind = entity.entity.kind.value.as_str();
    let mut warn = |what: &str| {
        let message = format!("pbrt-v3 renders this light biased: {what}");
        diagnostics.push(
            Diagnostic::warning("biased-in-pbrt", entity.entity.span, message)
                .with_label("sampled here as it is seen"),
        );
    };
    match &shape.local {
        // What cannot be sampled in pbrt-v3 ends its run.
        Local::Curves(_) => {}
        Local::Form(_) if !["sphere", "disk", "cylinder"].contains(&kind) => {}
        Local::Form(form) => {
            let scale = world_from_object.uniform_scale(UNSCALED);
            if !scale.is_some_and(|scale| (scale - 1.0).abs() <= UNSCALED) {
                warn("it samples scaled quadrics with their unscaled size");
            }
            if !form.is_whole() && kind != "cylinder" {
                warn("it samples parts of quadrics as the whole");
            }
            if world_from_object.swaps_handedness() {
                warn("it samples the other side of a mirrored quadric");
            }
        }
        Local::Mesh(mesh) => {
            let has_frame = !mesh.normals.is_empty() || !mesh.tangents.is_empty();
            if entity.reverse_orientation && has_frame {
                warn("it samples the other side of a reversed mesh with normals or tangents");
            }
        }
    }
    if surface.cutout.alpha.is_some() {
        warn("what its alpha mask cuts out lights others all the same");
    }
    if !surface.material.is_some() {
        warn("it leaves out half of the light of surfaces without a material");
    }
}

/// Says that only half of pbrt-v3's light sampling passes what casts no shadow.
fn warn_of_half_shadow(shape: &LocalShape, diagnostics: &mut Diagnostics) {
    let message = "pbrt-v3 renders the shadow of this shape biased: light that is found by chance \
                   stops where its shadow mask lets sampled light pass";
    diagnostics.push(
        Diagnostic::warning("biased-in-pbrt", shape.entity.entity.span, message)
            .with_label("both pass here"),
    );
}

fn report_degenerate(shape: &Shape, entity: &ShapeEntity, diagnostics: &mut Diagnostics) {
    let n = shape.n_elements();
    let n_empty = (0..n as u32)
        .filter(|&element| shape.bounds(element).is_empty())
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
