//! Little-endian bodies in the layouts that exporters write: items of fixed size, and faces with one list
//! `uchar int` or `uchar uint`. Other layouts are left to `general`.

use ply_rs_bw::ply::{PropertyType, ScalarType};

use super::builder::Builder;
use super::general::ends_early;
use super::header::{Element, Role, Use};
use super::{Place, PlyError};

/// Reads the items of one element from `at` on and returns where they end; `None` if the layout is not known here.
pub(super) fn read(
    element: &Element,
    bytes: &[u8],
    at: usize,
    builder: &mut Builder,
) -> Option<Result<usize, PlyError>> {
    if element.role == Role::Face {
        let layout = FaceLayout::of(element)?;
        return Some(read_faces(element, &layout, bytes, at, builder));
    }
    let layout = RowLayout::of(element)?;
    Some(layout.rows(element, bytes, at).map(|rows| {
        if element.role == Role::Vertex {
            layout.add_vertices(rows, builder);
        }
        at + rows.len()
    }))
}

/// Items of fixed size.
struct RowLayout {
    /// Bytes of an item.
    stride: usize,
    /// Where in an item the `f32` of each slot is.
    offsets: [Option<usize>; 8],
}

impl RowLayout {
    /// `None` with a list, or with a component of a vertex that is not a `float`.
    fn of(element: &Element) -> Option<Self> {
        let mut stride = 0;
        let mut offsets = [None; 8];
        for (property, usage) in element.def.properties.values().zip(&element.uses) {
            let PropertyType::Scalar(scalar) = &property.data_type else {
                return None;
            };
            if let Use::Slot(slot) = *usage {
                if *scalar != ScalarType::Float {
                    return None;
                }
                offsets[slot] = Some(stride);
            }
            stride += size_of(scalar);
        }
        Some(Self { stride, offsets })
    }

    /// The bytes of all items.
    fn rows<'a>(
        &self,
        element: &Element,
        bytes: &'a [u8],
        at: usize,
    ) -> Result<&'a [u8], PlyError> {
        let rest = &bytes[at..];
        let length = element.n_items().checked_mul(self.stride);
        length.and_then(|length| rest.get(..length)).ok_or_else(|| {
            let index = rest.len() / self.stride;
            ends_early(element, index, Place::Byte(at + index * self.stride))
        })
    }

    fn add_vertices(&self, rows: &[u8], builder: &mut Builder) {
        let mesh = &mut builder.mesh;
        let [x, y, z, nx, ny, nz, u, v] = self.offsets;
        // The sizes of the vectors follow from bytes that are there.
        if let (Some(x), Some(y), Some(z)) = (x, y, z) {
            let rows = rows.chunks_exact(self.stride);
            mesh.positions
                .extend(rows.map(|row| [f32_at(row, x), f32_at(row, y), f32_at(row, z)]));
        }
        if let (Some(x), Some(y), Some(z)) = (nx, ny, nz) {
            let rows = rows.chunks_exact(self.stride);
            mesh.normals
                .extend(rows.map(|row| [f32_at(row, x), f32_at(row, y), f32_at(row, z)]));
        }
        if let (Some(u), Some(v)) = (u, v) {
            let rows = rows.chunks_exact(self.stride);
            mesh.uvs
                .extend(rows.map(|row| [f32_at(row, u), f32_at(row, v)]));
        }
    }
}

/// Faces: scalars, one list of corners with its length in a byte, scalars.
struct FaceLayout {
    /// Bytes before the list.
    before: usize,
    /// Bytes behind the list.
    behind: usize,
    /// Whether corners are signed; only messages care.
    signed: bool,
    /// Where `face_indices` is.
    face_index: Option<FaceIndexAt>,
}

/// Where in a face its number is.
#[derive(Clone, Copy)]
enum FaceIndexAt {
    /// Bytes from the start of the face.
    Before(usize),
    /// Bytes from the end of the list.
    Behind(usize),
}

impl FaceLayout {
    fn of(element: &Element) -> Option<Self> {
        let mut list = None;
        let (mut before, mut behind) = (0, 0);
        let mut face_index = None;
        for (property, usage) in element.def.properties.values().zip(&element.uses) {
            match (&property.data_type, usage) {
                (
                    PropertyType::List(
                        ScalarType::UChar,
                        item @ (ScalarType::Int | ScalarType::UInt),
                    ),
                    Use::Corners,
                ) => list = Some(item),
                (PropertyType::List(..), _) => return None,
                (PropertyType::Scalar(scalar), usage) => {
                    if *usage == Use::FaceIndex {
                        if *scalar != ScalarType::Int {
                            return None;
                        }
                        face_index = Some(if list.is_none() {
                            FaceIndexAt::Before(before)
                        } else {
                            FaceIndexAt::Behind(behind)
                        });
                    }
                    let part = if list.is_none() {
                        &mut before
                    } else {
                        &mut behind
                    };
                    *part += size_of(scalar);
                }
            }
        }
        list.map(|item| Self {
            before,
            behind,
            signed: *item == ScalarType::Int,
            face_index,
        })
    }

    /// The face that `rest` starts with, as the bytes before its list, those of its corners, those behind it, and the
    /// rest; `None` if it is cut off.
    #[inline]
    fn split<'a>(&self, rest: &'a [u8]) -> Option<([&'a [u8]; 3], &'a [u8])> {
        let (before, rest) = rest.split_at_checked(self.before)?;
        let (&n_corners, rest) = rest.split_first()?;
        let (corners, rest) = rest.split_at_checked(4 * usize::from(n_corners))?;
        let (behind, rest) = rest.split_at_checked(self.behind)?;
        Some(([before, corners, behind], rest))
    }
}

fn read_faces(
    element: &Element,
    layout: &FaceLayout,
    bytes: &[u8],
    at: usize,
    builder: &mut Builder,
) -> Result<usize, PlyError> {
    let n_items = element.n_items();
    let mut rest = &bytes[at..];
    // Most faces are triangles; no more of them are reserved than there are bytes for.
    let size = layout.before + 1 + 12 + layout.behind;
    let n_triangles = n_items.min(rest.len() / size);
    builder.mesh.triangles.reserve(n_triangles);
    let mut polygon = Vec::new();
    for index in 0..n_items {
        let place = || Place::Byte(bytes.len() - rest.len());
        let Some(([before, corners, behind], next)) = layout.split(rest) else {
            return Err(ends_early(element, index, place()));
        };
        let face_index = match layout.face_index {
            None => 0,
            Some(FaceIndexAt::Before(at)) => u32_at(before, at).cast_signed(),
            Some(FaceIndexAt::Behind(at)) => u32_at(behind, at).cast_signed(),
        };
        // As unsigned numbers, negative corners are larger than any vertex.
        let added = if corners.len() == 12 {
            let triangle = [u32_at(corners, 0), u32_at(corners, 4), u32_at(corners, 8)];
            builder.face(&triangle, face_index)
        } else {
            polygon.clear();
            polygon.extend(corners.chunks_exact(4).map(|corner| u32_at(corner, 0)));
            builder.face(&polygon, face_index)
        };
        if let Err(corner) = added {
            let corner = if layout.signed {
                f64::from(corner.cast_signed())
            } else {
                f64::from(corner)
            };
            return Err(PlyError::invalid(place(), builder.no_vertex(corner)));
        }
        rest = next;
    }
    Ok(bytes.len() - rest.len())
}

/// Bytes of a scalar.
fn size_of(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

// Called on its own for each component, not by `map` over an array of places: that is not unrolled, and takes five times
// as many instructions.
#[inline]
fn u32_at(bytes: &[u8], at: usize) -> u32 {
    let four = bytes[at..at + 4].try_into().expect("a range of four bytes");
    u32::from_le_bytes(four)
}

#[inline]
fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}
