//! PLY meshes: bytes to vertices and triangles, in object space.
//!
//! Owns the format: its header, its three encodings (plain or gzipped), the names that mean position, normal, texture
//! coordinate and face, polygons cut into triangles, and the checks that make the result safe to index. Refuses
//! files and paths: callers read bytes and say in which file a [`PlyError`] or [`PlyWarning`] happened.
//!
//! The format: Greg Turk, "The PLY Polygon File Format" (1994). Names and the cut of a quad follow pbrt-v3
//! (`shapes/plymesh.cpp`); where pbrt-v3 drops a face or the whole mesh without need, the face is kept instead.
//!
//! The header is read by `ply-rs`. Bodies are read by the readers of this module, and by `ply-rs` where the layout is
//! not one they know; [`Route::General`] asks for `ply-rs` throughout, so that two independent readers check each
//! other.

mod ascii;
mod binary;
mod builder;
mod general;
mod header;

use std::borrow::Cow;
use std::fmt;
use std::io::Read;

use ply_rs_bw::ply::Encoding;

use builder::Builder;
use header::Header;

/// A mesh as stored, in object space. Every index of `triangles` is inside `positions`.
#[derive(Clone, PartialEq, Default, Debug)]
pub struct PlyMesh {
    /// Vertices. Those that are not finite are kept, so that numbers agree with the file, but no triangle uses them.
    pub positions: Vec<[f32; 3]>,
    /// One normal per vertex, of any length, or empty. Zero where the file gives none that can be used.
    pub normals: Vec<[f32; 3]>,
    /// One pair of texture coordinates per vertex, or empty. Finite.
    pub uvs: Vec<[f32; 2]>,
    /// Corners of each triangle as indices of vertices, in the winding of the file.
    pub triangles: Vec<[u32; 3]>,
    /// The `face_indices` of the face each triangle was cut from, or empty.
    pub face_indices: Vec<i32>,
    /// What is odd about the file, and what was done about it.
    pub warnings: Vec<PlyWarning>,
}

/// Something odd about a file that still gives a mesh.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum PlyWarning {
    /// Vertices with a coordinate that is infinite or not a number; the triangles that use them are gone.
    NonFiniteVertices {
        /// How many vertices.
        count: usize,
        /// Number of the first, from 0.
        first: usize,
        /// How many triangles are gone.
        dropped: usize,
    },
    /// Normals that are zero, infinite or not a number; they are zero in the mesh.
    UnusableNormals {
        /// How many vertices.
        count: usize,
        /// Number of the first, from 0.
        first: usize,
    },
    /// Texture coordinates that are infinite or not a number; they are zero in the mesh.
    NonFiniteUvs {
        /// How many vertices.
        count: usize,
        /// Number of the first, from 0.
        first: usize,
    },
    /// Faces with fewer than three corners; they are gone.
    ShortFaces {
        /// How many faces.
        count: usize,
        /// Number of the first, from 0.
        first: usize,
    },
    /// Faces of five or more corners that the fan of triangles around their first corner does not tile, because they
    /// are not convex.
    FoldedPolygons {
        /// How many faces.
        count: usize,
        /// Number of the first, from 0.
        first: usize,
    },
    /// The file declares no list of vertex indices: the mesh has no triangles.
    NoFaces,
    /// Faces and vertices have texture coordinates: those of the vertices are used, as in pbrt-v3.
    IdleCornerUvs,
    /// Faces whose texture coordinates are not two for each corner; what is missing is 0.
    MisfitCornerUvs {
        /// How many faces.
        count: usize,
        /// Number of the first, from 0.
        first: usize,
    },
    /// Bytes behind the last element.
    Surplus {
        /// How many.
        count: usize,
    },
}

impl fmt::Display for PlyWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NonFiniteVertices {
                count,
                first,
                dropped,
            } => write!(
                f,
                "{count} vertices are not finite (the first is vertex {first}); {dropped} triangles that use them \
                 are dropped"
            ),
            Self::UnusableNormals { count, first } => write!(
                f,
                "{count} normals are zero or not finite (the first is that of vertex {first}); the geometric normal \
                 stands in"
            ),
            Self::NonFiniteUvs { count, first } => write!(
                f,
                "{count} texture coordinates are not finite (the first are those of vertex {first}); they are set \
                 to 0"
            ),
            Self::ShortFaces { count, first } => write!(
                f,
                "{count} faces have fewer than three corners (the first is face {first}); they are dropped"
            ),
            Self::FoldedPolygons { count, first } => write!(
                f,
                "{count} polygons are not convex (the first is face {first}); their triangles overlap"
            ),
            Self::IdleCornerUvs => write!(
                f,
                "faces have texture coordinates, and so have vertices: those of vertices are used"
            ),
            Self::MisfitCornerUvs { count, first } => write!(
                f,
                "the texture coordinates of {count} faces are not two for each corner (the first is face {first}); \
                 what is missing is 0"
            ),
            Self::Surplus { count } => write!(
                f,
                "{count} bytes follow the last element that the header declares; they are not read"
            ),
            Self::NoFaces => f.write_str(
                "no element `face` with a list `vertex_indices` or `vertex_index`: the mesh is empty",
            ),
        }
    }
}

/// Where in a file something is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// A line, from 1: the header, and bodies in ASCII.
    Line(usize),
    /// A byte, from 0: binary bodies. Of gzipped files, a byte of what was compressed.
    Byte(usize),
    /// The file as a whole.
    File,
}

/// Why a file gives no mesh, by who can help it.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum PlyError {
    /// The file breaks the format or contradicts itself: whoever wrote it has to act.
    Invalid {
        /// Where.
        at: Place,
        /// What is wrong, as a sentence without capital or full stop.
        message: String,
    },
    /// The file may be right but says something this reader does not know: convert it.
    Unsupported {
        /// Where.
        at: Place,
        /// What is not known, as a sentence without capital or full stop.
        message: String,
    },
}

impl PlyError {
    fn invalid(at: Place, message: impl Into<String>) -> Self {
        Self::Invalid {
            at,
            message: message.into(),
        }
    }

    fn unsupported(at: Place, message: impl Into<String>) -> Self {
        Self::Unsupported {
            at,
            message: message.into(),
        }
    }
}

impl fmt::Display for PlyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, at, message) = match self {
            Self::Invalid { at, message } => ("invalid", at, message),
            Self::Unsupported { at, message } => ("unsupported", at, message),
        };
        write!(f, "{kind} PLY file: ")?;
        match at {
            Place::Line(line) => write!(f, "line {line}: ")?,
            Place::Byte(byte) => write!(f, "byte {byte}: ")?,
            Place::File => {}
        }
        f.write_str(message)
    }
}

impl std::error::Error for PlyError {}

/// Which readers take the body of a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Route {
    /// The fastest reader that knows each element's layout.
    Fastest,
    /// `ply-rs` for every element: many times slower, and in ASCII stricter about the spelling of numbers (no `nan`,
    /// `inf`, `.5` or `1.`) and about lines (one for each item).
    General,
}

/// Decodes a PLY file, plain or gzipped.
///
/// Time and memory are bounded by the size of the input, whatever its header declares.
///
/// # Errors
///
/// See [`PlyError`]. An index outside the vertices is an error for the whole mesh.
pub fn decode(bytes: &[u8]) -> Result<PlyMesh, PlyError> {
    decode_by(bytes, Route::Fastest)
}

/// As [`decode`], where only so many bytes of memory are left.
///
/// # Errors
///
/// As [`decode`]; [`PlyError::Unsupported`] for what would not fit.
pub fn decode_within(bytes: &[u8], max_bytes: u64) -> Result<PlyMesh, PlyError> {
    decode_limited(bytes, Route::Fastest, max_bytes)
}

/// As [`decode`], with a choice of readers.
///
/// # Errors
///
/// As [`decode`].
pub fn decode_by(bytes: &[u8], route: Route) -> Result<PlyMesh, PlyError> {
    decode_limited(bytes, route, u64::MAX)
}

fn decode_limited(bytes: &[u8], route: Route, max_bytes: u64) -> Result<PlyMesh, PlyError> {
    let too_large = |n_bytes: u64| {
        let message = format!(
            "the mesh takes {} MiB of memory, more than the {} MiB that are left",
            n_bytes >> 20,
            max_bytes >> 20
        );
        PlyError::unsupported(Place::File, message)
    };
    let bytes = plain(bytes, max_bytes / MEMORY_OF_BYTE)?;
    let n_bytes = (bytes.len() as u64).saturating_mul(MEMORY_OF_BYTE);
    if n_bytes > max_bytes {
        return Err(too_large(n_bytes));
    }
    let header = Header::read(&bytes)?;
    let mut builder = Builder::new(&header);
    let mut at = header.body;
    for element in &header.elements {
        at = match (header.encoding, route) {
            (Encoding::Ascii, Route::Fastest) => {
                ascii::read(element, &header, &bytes, at, &mut builder)?
            }
            (Encoding::Ascii, Route::General) => {
                general::read_ascii(element, &header, &bytes, at, &mut builder)?
            }
            (encoding, route) => {
                let known = (encoding == Encoding::BinaryLittleEndian && route == Route::Fastest)
                    .then(|| binary::read(element, &bytes, at, &mut builder))
                    .flatten();
                match known {
                    Some(end) => end?,
                    None => general::read_binary(element, encoding, &bytes, at, &mut builder)?,
                }
            }
        };
    }
    let mut mesh = builder.finish();
    let rest = bytes[at.min(bytes.len())..].trim_ascii();
    if !rest.is_empty() && rest.iter().any(|&byte| byte != 0) {
        let count = rest.len();
        mesh.warnings.push(PlyWarning::Surplus { count });
    }
    Ok(mesh)
}

/// Bytes of memory that a byte of a file may become: a face of ASCII, `3 0 1 2`, has 8 bytes and becomes 12, and vectors
/// grow by doubling.
const MEMORY_OF_BYTE: u64 = 4;

/// How many times its compressed size a gzipped file may expand to, beyond the first mebibyte. Meshes reach 2 to 20;
/// gzip itself allows a thousand, which only files made to exhaust memory come near.
const MAX_EXPANSION: u64 = 200;

/// The bytes of the PLY file itself.
fn plain(bytes: &[u8], max_bytes: u64) -> Result<Cow<'_, [u8]>, PlyError> {
    if !bytes.starts_with(&[0x1f, 0x8b]) {
        return Ok(Cow::Borrowed(bytes));
    }
    let limit = (1 << 20) + MAX_EXPANSION * bytes.len() as u64;
    let mut plain = Vec::new();
    flate2::read::MultiGzDecoder::new(bytes)
        .take(limit.min(max_bytes) + 1)
        .read_to_end(&mut plain)
        .map_err(|error| PlyError::invalid(Place::File, format!("broken gzip data: {error}")))?;
    if plain.len() as u64 > max_bytes {
        let message = format!(
            "gzip data expands to more than {} MiB of memory allow",
            max_bytes >> 20
        );
        return Err(PlyError::unsupported(Place::File, message));
    }
    if plain.len() as u64 > limit {
        return Err(PlyError::unsupported(
            Place::File,
            format!("gzip data expands more than {MAX_EXPANSION} times"),
        ));
    }
    Ok(Cow::Owned(plain))
}
