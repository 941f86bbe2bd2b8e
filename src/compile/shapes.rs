//! Shapes: read in parallel, then placed in render space with their materials, media and lights.

use glam::DVec3;
use rayon::iter::{IntoParallelIterator, IntoParallelRefIterator, ParallelIterator};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::{Family, PluginRef};

use crate::compile::assets::Assets;
use crate::compile::materials::MaterialBuilder;
use crate::compile::media::Media;
use crate::compile::reader::{ParamReader, Textured};
use crate::compile::space::{self, RenderSpace, WorldBounds};
use crate::compile::textures::TextureBuilder;
use crate::compile::{lights, lookup, unsupported};
use crate::describe::description::{AreaLightRef, Frame, ShapeEntity};
use crate::ids::{GeometryId, LightId, MediumId};
use crate::light::{AreaLight, Light};
use crate::math::Transform;
use crate::shape::ply::{self, PlyMesh};
use crate::shape::quadric::{Disk, Form, Sphere};
use crate::shape::{Mesh, Quadric, Shape};
use crate::world::{Geometry, MediumInterface, WorldParts};

/// A shape in object space.
enum Local {
    /// Vertices in object space; normals and tangents of any length.
    Mesh(Mesh),
    Form(Form),
}

struct LocalShape {
    local: Local,
    world_from_object: Transform,
    entity: ShapeEntity,
}

/// The shapes of a frame, read but not yet placed.
pub(super) struct Loaded {
    shapes: Vec<LocalShape>,
}

/// Reads all shapes of a frame in parallel; findings come in file order.
pub(super) fn load(
    frame: &mut Frame,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Loaded {
    for instance in &frame.instances {
        diagnostics.push(unsupported("an object instance", instance.span, "left out"));
    }
    let materials = &frame.materials;
    let read: Vec<(Option<LocalShape>, Diagnostics)> = std::mem::take(&mut frame.shapes)
        .into_par_iter()
        .map(|mut entity| {
            let mut diagnostics = Diagnostics::default();
            let overridden = entity.private_material.as_ref().and_then(|_| {
                Family::Material.find(&materials[entity.material.0 as usize].entity.kind.value)
            });
            let local = read_shape(&mut entity, overridden, assets, &mut diagnostics);
            let shape = local.and_then(|local| {
                let pair = entity.world_from_object;
                let span = entity.entity.span;
                if pair.start != pair.end {
                    diagnostics.push(unsupported("a moving shape", span, "its start is used"));
                }
                let world_from_object = space::transform(pair.start, span, &mut diagnostics)?;
                Some(LocalShape {
                    local,
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
    Loaded { shapes }
}

impl Loaded {
    pub(super) fn world_bounds(&self) -> WorldBounds {
        self.shapes
            .par_iter()
            .map(|shape| {
                let mut bounds = WorldBounds::EMPTY;
                match &shape.local {
                    Local::Mesh(mesh) => mesh.positions.iter().for_each(|p| {
                        bounds.add(shape.world_from_object.point(DVec3::from(p.map(f64::from))));
                    }),
                    Local::Form(form) => {
                        form.corners()
                            .for_each(|p| bounds.add(shape.world_from_object.point(p)));
                    }
                }
                bounds
            })
            .reduce(|| WorldBounds::EMPTY, WorldBounds::union)
    }

    /// Moves the shapes to render space and attaches what belongs to their surfaces.
    #[expect(
        clippy::too_many_arguments,
        reason = "one builder for each arena of the world"
    )]
    pub(super) fn place(
        self,
        frame: &Frame,
        space: &RenderSpace,
        materials: &mut MaterialBuilder,
        textures: &mut TextureBuilder,
        media: &mut Media,
        assets: &dyn Assets,
        parts: &mut WorldParts,
        diagnostics: &mut Diagnostics,
    ) {
        let entities: Vec<ShapeEntity> = self.shapes.iter().map(|s| s.entity.clone()).collect();
        let placed: Vec<Shape> = self
            .shapes
            .into_par_iter()
            .map(|shape| place(shape, space))
            .collect();
        // One look at each `AreaLightSource`, however many shapes emit by it.
        let mut area_lights = vec![None; frame.area_lights.len()];
        for (shape, entity) in placed.into_iter().zip(entities) {
            report_degenerate(&shape, &entity, diagnostics);
            let material = materials.id(&entity, textures, diagnostics);
            let mut side = |medium: Option<_>| {
                medium.map_or(MediumId::NONE, |medium| media.id(medium, diagnostics))
            };
            let interface =
                (entity.media.inside != entity.media.outside).then(|| MediumInterface {
                    inside: side(entity.media.inside),
                    outside: side(entity.media.outside),
                });
            let geometry = GeometryId::new(parts.geometries.len());
            let mut first_light = LightId::NONE;
            if let Some(AreaLightRef(index)) = entity.area_light {
                let emission = area_lights[index as usize].get_or_insert_with(|| {
                    area_light(&frame.area_lights[index as usize], assets, diagnostics)
                });
                if let Some((radiance, two_sided)) = *emission {
                    first_light = LightId::new(parts.lights.len());
                    parts
                        .lights
                        .extend((0..shape.n_elements() as u32).map(|element| {
                            Light::Area(AreaLight {
                                geometry,
                                element,
                                radiance,
                                two_sided,
                            })
                        }));
                }
            }
            parts.geometries.push(Geometry {
                shape,
                material,
                media: interface,
                first_light,
            });
        }
    }
}

fn area_light(
    entity: &crate::describe::description::Entity,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<(crate::spectrum::Rgb, bool)> {
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
    Some((radiance?, two_sided))
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
    };
    diagnostics.push(Diagnostic::warning("no-area", entity.entity.span, what));
}

fn place(shape: LocalShape, space: &RenderSpace) -> Shape {
    let render_from_object = space.place(&shape.world_from_object);
    let reverse_orientation = shape.entity.reverse_orientation;
    let mut mesh = match shape.local {
        Local::Form(form) => {
            return Shape::Quadric(Quadric::new(form, render_from_object, reverse_orientation));
        }
        Local::Mesh(mesh) => mesh,
    };
    let wide = |v: [f32; 3]| DVec3::from(v.map(f64::from));
    for p in &mut mesh.positions {
        *p = render_from_object.point(wide(*p)).as_vec3().to_array();
    }
    // Directions keep their relative lengths, which weigh interpolation, at a size that suits f32.
    let size = render_from_object.determinant().abs().cbrt();
    for n in &mut mesh.normals {
        *n = (render_from_object.normal(wide(*n)) * size)
            .as_vec3()
            .to_array();
    }
    for s in &mut mesh.tangents {
        *s = (render_from_object.vector(wide(*s)) / size)
            .as_vec3()
            .to_array();
    }
    mesh.reverse_orientation = reverse_orientation;
    mesh.swaps_handedness = render_from_object.swaps_handedness();
    Shape::Mesh(mesh)
}

fn read_shape(
    shape: &mut ShapeEntity,
    overridden: Option<PluginRef>,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Local> {
    const INSTEAD: &str = "the shape is left out";
    let plugin = lookup(Family::Shape, &shape.entity.kind, INSTEAD, diagnostics)?;
    let kind_span = shape.entity.kind.span;
    let entity = &mut shape.entity;
    let mut p = ParamReader::taking(plugin, entity, diagnostics);
    let phi_max = |p: &mut ParamReader| (p.float("phimax") as f64).to_radians();
    let local = match plugin.schema.name {
        "sphere" => {
            let radius = p.float("radius") as f64;
            let z_min = p.optional_float("zmin").map_or(-radius, f64::from);
            let z_max = p.optional_float("zmax").map_or(radius, f64::from);
            Some(Local::Form(Form::Sphere(Sphere::new(
                radius,
                z_min,
                z_max,
                phi_max(&mut p),
            ))))
        }
        "disk" => {
            let height = p.float("height") as f64;
            let (radius, inner) = (p.float("radius") as f64, p.float("innerradius") as f64);
            Some(Local::Form(Form::Disk(Disk::new(
                height,
                radius,
                inner,
                phi_max(&mut p),
            ))))
        }
        "trianglemesh" => check_alpha(&mut p)
            .and_then(|()| triangle_mesh(&mut p))
            .map(Local::Mesh),
        "plymesh" => check_alpha(&mut p)
            .and_then(|()| ply_mesh(&mut p, assets))
            .map(Local::Mesh),
        name => {
            let what = format!("the shape \"{name}\"");
            p.report(unsupported(&what, kind_span, INSTEAD));
            None
        }
    };
    match overridden {
        Some(material) => p.finish_with_material(material),
        None => p.finish(),
    }
    local
}

/// A constant alpha of 0 removes the whole mesh; textures are not supported yet.
fn check_alpha(p: &mut ParamReader) -> Option<()> {
    for name in ["alpha", "shadowalpha"] {
        if let Textured::Texture(_) = p.float_texture(name) {
            let span = p.span(name);
            p.report(unsupported("an alpha texture", span, "the mesh is opaque"));
        }
    }
    match p.float_texture("alpha") {
        Textured::Constant(alpha) if alpha.value == 0.0 => None,
        _ => Some(()),
    }
}

fn triangle_mesh(p: &mut ParamReader) -> Option<Mesh> {
    let (positions, indices) = (p.take_point3s("P"), p.take_ints("indices"));
    let indices_span = p.span("indices");
    let (positions, indices) = (positions?, indices?);
    let n = positions.len();
    if let Some(bad) = indices
        .iter()
        .find(|&&i| usize::try_from(i).map_or(true, |i| i >= n))
    {
        let message = format!("vertex {bad} does not exist: there are {n}");
        p.report(
            Diagnostic::error("bad-index", indices_span, message)
                .with_label("the mesh is left out"),
        );
        return None;
    }
    let (triangles, rest) = indices.as_chunks::<3>();
    if !rest.is_empty() {
        let message = format!("{} indices at the end make no triangle", rest.len());
        p.report(Diagnostic::warning(
            "dangling-indices",
            indices_span,
            message,
        ));
    }
    let matching = |name: &str, count: usize, p: &mut ParamReader| {
        let fits = count == n;
        if !fits && count != 0 {
            let message = format!("{n} vertices need {n} values of \"{name}\", not {count}");
            let span = p.span(name);
            p.report(Diagnostic::error("value-count", span, message).with_label("not used"));
        }
        fits
    };
    let normals = p.take_normals("N").unwrap_or_default();
    let normals = if matching("N", normals.len(), p) {
        normals
    } else {
        Vec::new()
    };
    let tangents = p.take_vector3s("S").unwrap_or_default();
    let tangents = if matching("S", tangents.len(), p) {
        tangents
    } else {
        Vec::new()
    };
    let mut uvs = p.take_point2s_or_floats("uv").unwrap_or_default();
    if uvs.len() > n {
        let message = format!("{n} vertices need {n} values of \"uv\", not {}", uvs.len());
        let span = p.span("uv");
        p.report(
            Diagnostic::warning("value-count", span, message).with_label("the rest is not used"),
        );
        uvs.truncate(n);
    }
    let uvs = if matching("uv", uvs.len(), p) {
        uvs
    } else {
        Vec::new()
    };
    let triangles = triangles.iter().map(|t| t.map(|i| i as u32)).collect();
    Some(drop_non_finite(
        Mesh {
            positions,
            triangles,
            normals,
            tangents,
            uvs,
            ..Mesh::default()
        },
        p,
    ))
}

/// Removes the triangles that use a vertex without a position, with one warning.
fn drop_non_finite(mut mesh: Mesh, p: &mut ParamReader) -> Mesh {
    let is_finite = |v: &[f32; 3]| v.iter().all(|c| c.is_finite());
    if let Some(first) = mesh.positions.iter().position(|v| !is_finite(v)) {
        let positions = &mesh.positions;
        mesh.triangles
            .retain(|t| t.iter().all(|&v| is_finite(&positions[v as usize])));
        let message =
            format!("vertex {first} has a position that is not finite: its triangles are left out");
        let span = p.span("P");
        p.report(Diagnostic::warning("bad-vertex", span, message));
    }
    mesh
}

fn ply_mesh(p: &mut ParamReader, assets: &dyn Assets) -> Option<Mesh> {
    let file = p.file("filename")?;
    const INSTEAD: &str = "the shape is left out";
    let bytes = match assets.read(&file) {
        Ok(bytes) => bytes,
        Err(error) => {
            let message = format!("cannot read \"{}\": {error}", file.value);
            p.report(Diagnostic::error("missing-file", file.span, message).with_label(INSTEAD));
            return None;
        }
    };
    match ply::decode((*bytes).as_ref()) {
        Ok(PlyMesh {
            positions,
            normals,
            uvs,
            triangles,
            warnings,
            ..
        }) => {
            for warning in warnings {
                let message = format!("{}: {warning}", file.value);
                p.report(Diagnostic::warning("ply", file.span, message));
            }
            Some(Mesh {
                positions,
                triangles,
                normals,
                uvs,
                ..Mesh::default()
            })
        }
        Err(error) => {
            let message = format!("cannot decode \"{}\": {error}", file.value);
            p.report(Diagnostic::error("bad-ply", file.span, message).with_label(INSTEAD));
            None
        }
    }
}
