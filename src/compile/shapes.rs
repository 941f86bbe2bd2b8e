//! Reading shapes: parameters and files to geometry in object space.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::{Family, PluginRef};
use tyndall_parser::source::Span;

use crate::compile::assets::{Assets, read_file};
use crate::compile::reader::{ParamReader, Textured};
use crate::compile::{lookup, unsupported};
use crate::describe::description::{ShapeEntity, TextureRef};
use crate::shape::Mesh;
use crate::shape::curve::CurveSource;
use crate::shape::ply::{self, PlyMesh};
use crate::shape::quadric::Form;

mod curves;
mod quadrics;
mod surfaces;

const INSTEAD: &str = "the shape is left out";

/// A shape in object space.
#[derive(Clone)]
pub(super) enum Local {
    /// Vertices in object space; normals and tangents of any length.
    Mesh(Mesh),
    Form(Form),
    Curves(CurveSource),
}

/// A shape that was read.
pub(super) struct ReadShape {
    pub(super) local: Local,
    pub(super) masks: Masks,
}

/// The holes of a mesh, as written.
#[derive(Clone, Copy)]
pub(super) struct Masks {
    pub(super) alpha: Mask,
    pub(super) shadow_alpha: Mask,
}

impl Masks {
    const NONE: Self = Self {
        alpha: Mask::None,
        shadow_alpha: Mask::None,
    };
}

/// Where something is 0, and so is not there.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Mask {
    None,
    Everywhere,
    Texture(TextureRef),
}

/// Reads a shape; `overridden` is its material's plugin where its list may hold parameters for it. Numbers of faces are
/// kept where a texture may look them up.
pub(super) fn read_shape(
    shape: &mut ShapeEntity,
    overridden: Option<PluginRef>,
    keeps_faces: bool,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<ReadShape> {
    let plugin = lookup(Family::Shape, &shape.entity.kind, INSTEAD, diagnostics)?;
    let kind_span = shape.entity.kind.span;
    let entity = &mut shape.entity;
    let mut p = ParamReader::taking(plugin, entity, diagnostics);
    let mut masks = Masks::NONE;
    let local = match plugin.schema.name {
        "sphere" => Some(Local::Form(quadrics::sphere(&mut p))),
        "disk" => Some(Local::Form(quadrics::disk(&mut p))),
        "cylinder" => Some(Local::Form(quadrics::cylinder(&mut p))),
        "cone" => quadrics::cone(&mut p).map(Local::Form),
        "paraboloid" => Some(Local::Form(quadrics::paraboloid(&mut p))),
        "hyperboloid" => Some(Local::Form(quadrics::hyperboloid(&mut p))),
        "trianglemesh" => {
            masks = read_masks(&mut p);
            triangle_mesh(&mut p, keeps_faces).map(Local::Mesh)
        }
        "plymesh" => {
            masks = read_masks(&mut p);
            ply_mesh(&mut p, keeps_faces, assets).map(Local::Mesh)
        }
        "loopsubdiv" => surfaces::subdivision(&mut p, assets).map(Local::Mesh),
        "heightfield" => surfaces::heightfield(&mut p, assets).map(Local::Mesh),
        "nurbs" => surfaces::nurbs(&mut p, assets).map(Local::Mesh),
        "curve" => curves::curve(&mut p, assets).map(Local::Curves),
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
    // A mesh that is nowhere is no mesh, unless it is a lamp: that lights others.
    let is_something = masks.alpha != Mask::Everywhere || shape.area_light.is_some();
    let local = local.filter(|_| is_something)?;
    Some(ReadShape { local, masks })
}

fn read_masks(p: &mut ParamReader) -> Masks {
    let mut mask = |name: &str| match p.float_texture(name) {
        Textured::Texture(texture) => Mask::Texture(texture),
        Textured::Constant(alpha) if alpha.value == 0.0 => Mask::Everywhere,
        Textured::Constant(_) | Textured::Default => Mask::None,
    };
    Masks {
        alpha: mask("alpha"),
        shadow_alpha: mask("shadowalpha"),
    }
}

fn triangle_mesh(p: &mut ParamReader, keeps_faces: bool) -> Option<Mesh> {
    let (positions, indices) = (p.take_point3s("P"), p.take_ints("indices"));
    let (positions_span, indices_span) = (p.span("P"), p.span("indices"));
    let (positions, indices) = (positions?, indices?);
    let n = positions.len();
    let triangles = checked_triangles(p, &indices, indices_span, n)?;
    let mut faces = p.take_ints("faceIndices").unwrap_or_default();
    if !faces.is_empty() && faces.len() != triangles.len() {
        let (n, given) = (triangles.len(), faces.len());
        let message = format!("{n} triangles need {n} values of \"faceIndices\", not {given}");
        let span = p.span("faceIndices");
        p.report(Diagnostic::error("value-count", span, message).with_label("not used"));
        faces.clear();
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
    Some(drop_non_finite(
        Mesh {
            positions,
            triangles,
            normals,
            tangents,
            uvs,
            faces: kept_faces(faces, keeps_faces),
            ..Mesh::default()
        },
        positions_span,
        p,
    ))
}

/// Numbers of faces where they may be looked up. Negative ones are no faces, nor are their large counterparts.
fn kept_faces(faces: Vec<i32>, keeps_faces: bool) -> Vec<u32> {
    let kept = if keeps_faces { faces } else { Vec::new() };
    kept.into_iter().map(|face| face as u32).collect()
}

/// Indices in threes, if all are below `n_vertices`.
fn checked_triangles(
    p: &mut ParamReader,
    indices: &[i32],
    span: Span,
    n_vertices: usize,
) -> Option<Vec<[u32; 3]>> {
    let exists = |&i: &i32| usize::try_from(i).is_ok_and(|i| i < n_vertices);
    if let Some(bad) = indices.iter().find(|i| !exists(i)) {
        let message = format!("vertex {bad} does not exist: there are {n_vertices}");
        p.report(Diagnostic::error("bad-index", span, message).with_label(INSTEAD));
        return None;
    }
    let (triangles, rest) = indices.as_chunks::<3>();
    if !rest.is_empty() {
        let message = format!("{} indices at the end make no triangle", rest.len());
        p.report(Diagnostic::warning("dangling-indices", span, message));
    }
    Some(triangles.iter().map(|t| t.map(|i| i as u32)).collect())
}

/// Removes the triangles that use a vertex without a position, with one warning.
fn drop_non_finite(mut mesh: Mesh, span: Span, p: &mut ParamReader) -> Mesh {
    let is_finite = |v: &[f32; 3]| v.iter().all(|c| c.is_finite());
    if let Some(first) = mesh.positions.iter().position(|v| !is_finite(v)) {
        let positions = &mesh.positions;
        let is_kept = |t: &[u32; 3]| t.iter().all(|&v| is_finite(&positions[v as usize]));
        let mut triangles = mesh.triangles.iter();
        mesh.faces.retain(|_| triangles.next().is_some_and(is_kept));
        mesh.triangles.retain(is_kept);
        let message =
            format!("vertex {first} has a position that is not finite: its triangles are left out");
        p.report(Diagnostic::warning("bad-vertex", span, message));
    }
    mesh
}

fn ply_mesh(p: &mut ParamReader, keeps_faces: bool, assets: &dyn Assets) -> Option<Mesh> {
    let file = p.file("filename")?;
    let bytes = match read_file(&file, assets) {
        Ok(bytes) => bytes,
        Err(missing) => {
            p.report(missing.with_label(INSTEAD));
            return None;
        }
    };
    match ply::decode_within((*bytes).as_ref(), assets.memory_left()) {
        Ok(PlyMesh {
            positions,
            normals,
            uvs,
            triangles,
            face_indices,
            warnings,
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
                faces: kept_faces(face_indices, keeps_faces),
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
