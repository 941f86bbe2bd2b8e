//! The header: where the body starts, and what each property means to a mesh.

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, PropertyType, ScalarType};

use super::{Place, PlyError};

/// Names of the vertex properties a mesh takes, by slot. The texture coordinates have further names.
const SLOTS: [&str; 8] = ["x", "y", "z", "nx", "ny", "nz", "u", "v"];

/// Names of texture coordinates, best first.
const UV_NAMES: [[&str; 2]; 4] = [
    ["u", "v"],
    ["s", "t"],
    ["texture_u", "texture_v"],
    ["texture_s", "texture_t"],
];

/// Names of the list of corners, best first. pbrt-v3 knows only the first; many exporters write the second.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// Names of the list of texture coordinates of a face, best first: MeshLab writes the first.
const CORNER_UVS: [&str; 2] = ["texcoord", "texcoords"];

/// A header that was checked to describe a mesh.
pub(super) struct Header {
    /// Encoding of the body.
    pub(super) encoding: Encoding,
    /// Offset of the body in the file.
    pub(super) body: usize,
    /// The byte that ends a line: LF, or CR in files that know only CR.
    pub(super) line_end: u8,
    /// Elements in the order of the body.
    pub(super) elements: Vec<Element>,
    /// Vertices declared, at most `i32::MAX`.
    pub(super) n_vertices: u32,
    /// Whether all three components of a normal are there.
    pub(super) has_normals: bool,
    /// Whether a pair of texture coordinates is there.
    pub(super) has_uvs: bool,
    /// Whether there are faces with corners.
    pub(super) has_faces: bool,
    /// Whether faces carry `face_indices`.
    pub(super) has_face_indices: bool,
    /// Whether faces carry texture coordinates that are used: those of vertices come first.
    pub(super) has_corner_uvs: bool,
    /// Whether faces carry texture coordinates that are not used.
    pub(super) has_idle_corner_uvs: bool,
}

/// One element: `count` items of the same properties.
pub(super) struct Element {
    /// Name, count and properties as declared.
    pub(super) def: ElementDef,
    /// What each property means, in the order of the declaration.
    pub(super) uses: Vec<Use>,
    /// What the items are.
    pub(super) role: Role,
}

/// What an element's items are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Role {
    Vertex,
    Face,
    Other,
}

/// What a property is for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Use {
    /// Nothing.
    Skip,
    /// A component of a vertex: x y z, nx ny nz, u v.
    Slot(usize),
    /// The corners of a face.
    Corners,
    /// The number of a face.
    FaceIndex,
    /// The texture coordinates of the corners of a face, as one list u v u v ….
    CornerUvs,
}

impl Header {
    /// Reads and checks the header at the start of a file.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, PlyError> {
        let line_end = line_end(bytes)?;
        let (text, body) = normalised(bytes, line_end)?;
        let header = Parser::<DefaultElement>::new()
            .read_header(&mut Reader::new(text.as_bytes()))
            .map_err(|error| {
                let at = error.line().map_or(Place::File, Place::Line);
                PlyError::invalid(at, first_line(&error.to_string()))
            })?;
        if (header.version.major, header.version.minor) != (1, 0) {
            let message = format!("format version {} instead of 1.0", header.version);
            return Err(PlyError::unsupported(Place::File, message));
        }
        // ply-rs keeps only the last of two declarations with one name, which would shift everything behind.
        let declared = |word: &str| {
            text.lines()
                .filter(|line| {
                    line.starts_with(word) && line[word.len()..].starts_with([' ', '\t'])
                })
                .count()
        };
        let n_properties: usize = header.elements.values().map(|e| e.properties.len()).sum();
        if declared("element") != header.elements.len() || declared("property") != n_properties {
            let message = "an element or a property of one element is declared twice";
            return Err(PlyError::invalid(Place::File, message));
        }

        let elements: Vec<Element> = header
            .elements
            .into_iter()
            .map(|(_, def)| Element::new(def))
            .collect::<Result<_, _>>()?;
        let vertices = elements.iter().find(|e| e.role == Role::Vertex);
        let faces = elements.iter().find(|e| e.role == Role::Face);
        let vertices = vertices
            .ok_or_else(|| PlyError::invalid(Place::File, "there is no element `vertex`"))?;
        let has = |slot| vertices.uses.contains(&Use::Slot(slot));
        if let Some(slot) = (0..3).find(|&slot| !has(slot)) {
            let message = format!("vertices have no property `{}`", SLOTS[slot]);
            return Err(PlyError::invalid(Place::File, message));
        }
        let has_faces = faces.is_some();
        if !has_faces && elements.iter().any(|e| e.def.name == "tristrips") {
            let message = "faces are given as triangle strips (element `tristrips`)";
            return Err(PlyError::unsupported(Place::File, message));
        }
        let has_uvs = has(6);
        let gives_corner_uvs = faces.is_some_and(|e| e.uses.contains(&Use::CornerUvs));
        let n_vertices = i32::try_from(vertices.def.count)
            .map_err(|_| PlyError::unsupported(Place::File, "more than 2147483647 vertices"))?;
        Ok(Self {
            encoding: header.encoding,
            body,
            line_end,
            n_vertices: n_vertices.unsigned_abs(),
            has_normals: has(3),
            has_uvs,
            has_corner_uvs: gives_corner_uvs && !has_uvs,
            has_idle_corner_uvs: gives_corner_uvs && has_uvs,
            has_faces,
            has_face_indices: faces.is_some_and(|e| e.uses.contains(&Use::FaceIndex)),
            elements,
        })
    }

    /// The number of the line, from 1, in which the byte before `at` stands.
    pub(super) fn line_of(&self, bytes: &[u8], at: usize) -> usize {
        let before = &bytes[..at.saturating_sub(1)];
        1 + before.iter().filter(|&&b| b == self.line_end).count()
    }
}

impl Element {
    fn new(def: ElementDef) -> Result<Self, PlyError> {
        let role = match def.name.as_str() {
            "vertex" => Role::Vertex,
            "face"
                if CORNERS
                    .iter()
                    .any(|name| def.properties.contains_key(*name)) =>
            {
                Role::Face
            }
            _ => Role::Other,
        };
        let names: Vec<(&str, Use)> = match role {
            Role::Vertex => vertex_uses(&def),
            Role::Face => CORNERS
                .iter()
                .find(|name| def.properties.contains_key(**name))
                .map(|name| (*name, Use::Corners))
                .into_iter()
                .chain([("face_indices", Use::FaceIndex)])
                .chain(
                    CORNER_UVS
                        .iter()
                        .find(|name| is_list(&def, name))
                        .map(|name| (*name, Use::CornerUvs)),
                )
                .collect(),
            Role::Other => Vec::new(),
        };
        let mut uses = Vec::with_capacity(def.properties.len());
        for (name, property) in &def.properties {
            let usage = names.iter().find(|(known, _)| known == name);
            let usage = usage.map_or(Use::Skip, |&(_, usage)| usage);
            let complaint = match (&property.data_type, usage) {
                (PropertyType::List(ScalarType::Float | ScalarType::Double, _), _) => {
                    Some("counts the items of its lists in a type that is not an integer")
                }
                (PropertyType::List(..), Use::Slot(_) | Use::FaceIndex) => {
                    Some("is a list instead of a number")
                }
                (PropertyType::Scalar(_), Use::Corners) => Some("is a number instead of a list"),
                _ => None,
            };
            if let Some(complaint) = complaint {
                let message = format!("property `{name}` of element `{}` {complaint}", def.name);
                return Err(PlyError::invalid(Place::File, message));
            }
            uses.push(usage);
        }
        Ok(Self { def, uses, role })
    }

    /// Items in the body. An item without properties has no bytes, so a count of them says nothing.
    pub(super) fn n_items(&self) -> usize {
        if self.uses.is_empty() {
            0
        } else {
            self.def.count
        }
    }
}

/// Whether an element has a list of this name.
fn is_list(def: &ElementDef, name: &str) -> bool {
    let property = def.properties.get(name);
    property.is_some_and(|property| matches!(property.data_type, PropertyType::List(..)))
}

/// The names that matter in a vertex, incomplete normals and texture coordinates left out.
fn vertex_uses(def: &ElementDef) -> Vec<(&'static str, Use)> {
    let has = |name: &&str| def.properties.contains_key(*name);
    let slots = |names: &[&'static str], first: usize| -> Vec<(&'static str, Use)> {
        let uses = (first..).map(Use::Slot);
        names.iter().copied().zip(uses).collect()
    };
    let mut uses = slots(&SLOTS[..3], 0);
    if SLOTS[3..6].iter().all(has) {
        uses.extend(slots(&SLOTS[3..6], 3));
    }
    if let Some(names) = UV_NAMES.iter().find(|names| names.iter().all(has)) {
        uses.extend(slots(names, 6));
    }
    uses
}

/// The byte that ends the first line, which has to be `ply`.
fn line_end(bytes: &[u8]) -> Result<u8, PlyError> {
    match bytes {
        [b'p', b'l', b'y', b'\r', b'\n', ..] | [b'p', b'l', b'y', b'\n', ..] => Ok(b'\n'),
        [b'p', b'l', b'y', b'\r', ..] => Ok(b'\r'),
        _ => {
            let message = "the first line is not `ply`";
            Err(PlyError::invalid(Place::Line(1), message))
        }
    }
}

/// The header as ply-rs reads it, with as many lines as the file's: trimmed, ended by LF, comments (which may be in
/// any character set) and blank lines emptied. And the offset of the body.
fn normalised(bytes: &[u8], line_end: u8) -> Result<(String, usize), PlyError> {
    let mut text = String::new();
    let mut body = 0;
    let mut n_lines = 0;
    for line in bytes.split_inclusive(|&byte| byte == line_end) {
        body += line.len();
        n_lines += 1;
        let line = line.trim_ascii();
        let is_remark = [b"comment".as_slice(), b"obj_info"].iter().any(|word| {
            line.strip_prefix(*word)
                .is_some_and(|rest| rest.first().is_none_or(u8::is_ascii_whitespace))
        });
        if is_remark || line.is_empty() {
            text.push_str("comment");
        } else {
            let Ok(line) = str::from_utf8(line) else {
                let message = "the header has bytes that are not text";
                return Err(PlyError::invalid(Place::Line(n_lines), message));
            };
            text.push_str(line);
        }
        text.push('\n');
        if line == b"end_header" {
            return Ok((text, body));
        }
    }
    Err(PlyError::invalid(
        Place::Line(n_lines),
        "the header has no `end_header`",
    ))
}

/// The first line of a message of ply-rs, without the line number it leads with.
pub(super) fn first_line(message: &str) -> String {
    let line = message.lines().next().unwrap_or_default();
    let line = match line.split_once(": ") {
        Some((lead, rest)) if lead.starts_with("Line ") => rest,
        _ => line,
    };
    line.trim_end_matches(['.', ':']).to_owned()
}
