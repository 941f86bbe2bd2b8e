//! Ptex files: a picture for each face of a mesh, with the faces beside it (Burley and Lacewell 2008, "Ptex: Per-Face
//! Texture Mapping for Production Rendering"; format and library of Walt Disney Animation Studios, version 1.x).
//!
//! A file is decoded as a whole when it is loaded, into one arena of texels in its own data type. Each face has all
//! levels that filters ask for: every pair of powers of two up to its resolution on quads, squares on triangles. Levels
//! that the file stores are read, the others are halved from finer ones with the rounding of the library. Four times
//! the texels of the finest level are held at most, and no more than the caller allows: of files beyond that the finest
//! levels are left out, as many from each face.
//!
//! | part of the file | what is done |
//! |---|---|
//! | 8 and 16 bits, half, float; any number of channels | read |
//! | alpha | the channels before it are multiplied by it |
//! | faces: constant, zipped, differences, tiles | read |
//! | edits of faces | take the place of the face and of its levels |
//! | meta data, and edits of it | skipped |

mod face;
mod file;
mod sample;

use half::f16;

use crate::image::ImageError;
pub use sample::Sample;

/// What the faces are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum MeshType {
    /// Triangles: (u, v) and w = 1 − u − v. Texels above the diagonal hold the triangles that stand on their tips.
    Triangle,
    /// Quadrangles, u to the right and v up.
    Quad,
}

/// What lies beyond an edge without a neighbour.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Border {
    /// The texels of the edge.
    Clamp,
    /// Nothing.
    Black,
    /// As [`Self::Clamp`], but parameters outside [0, 1] come in again on the other side.
    Periodic,
}

/// A face.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Face {
    /// Logarithms to base 2 of the texels along u and v.
    pub log2: [u8; 2],
    /// The face beyond each edge: v = 0, u = 1, v = 1, u = 0 on quads; v = 0, w = 0, u = 0 on triangles. All exist.
    pub neighbours: [Option<u32>; 4],
    /// Which of their edges that is.
    pub their_edges: [u8; 4],
    /// One value holds for the whole face.
    pub is_constant: bool,
    /// It holds for all faces around it, too.
    pub is_neighbourhood_constant: bool,
    /// One of the quads that a face with another number of corners was cut into: half as wide as those beside it.
    pub is_subface: bool,
    /// Place of its first texel; constant faces have none.
    first: usize,
}

impl Face {
    /// Texels of the finest level.
    fn n_finest(&self) -> u64 {
        1 << (self.log2[0] + self.log2[1])
    }
}

/// The texels of all faces, as the file has them.
#[derive(Clone, Debug)]
enum Texels {
    U8(Arena<u8>),
    U16(Arena<u16>),
    Half(Arena<f16>),
    Float(Arena<f32>),
}

/// Texels of one type.
#[derive(Clone, Debug)]
struct Arena<T> {
    /// One pixel for each face: its mean.
    means: Vec<T>,
    /// The levels of all faces that are not constant, channels interleaved.
    levels: Vec<T>,
}

/// A decoded file.
#[derive(Clone, Debug)]
pub struct Ptex {
    mesh: MeshType,
    channels: usize,
    borders: [Border; 2],
    turns_vectors: bool,
    faces: Vec<Face>,
    texels: Texels,
}

/// A file with what is odd about it.
#[derive(Clone, Debug)]
pub struct PtexFile {
    /// What to look up.
    pub ptex: Ptex,
    /// How many of the finest levels are left out, because there is no room for them.
    pub dropped_levels: u8,
    /// How many samples were infinite, not numbers or too large to be added up, and are 0 now.
    pub bad_samples: usize,
}

/// Texels to be added up.
#[derive(Clone, Copy)]
pub enum Level<'a> {
    /// 0 to 255.
    U8(&'a [u8]),
    /// 0 to 65535.
    U16(&'a [u16]),
    /// As they are.
    Half(&'a [f16]),
    /// As they are.
    Float(&'a [f32]),
}

impl Ptex {
    /// Decodes a file's bytes, keeping at most `bytes_max` bytes of texels (and one texel for each face).
    ///
    /// Memory is bounded by the length of the input, too.
    ///
    /// # Errors
    /// [`ImageError`], by who must act.
    pub fn decode(bytes: &[u8], bytes_max: u64) -> Result<PtexFile, ImageError> {
        file::decode(bytes, bytes_max)
    }

    /// Bytes of texels.
    pub fn n_bytes(&self) -> u64 {
        let n = match &self.texels {
            Texels::U8(arena) => arena.levels.len(),
            Texels::U16(arena) => arena.levels.len() * u16::BYTES,
            Texels::Half(arena) => arena.levels.len() * f16::BYTES,
            Texels::Float(arena) => arena.levels.len() * f32::BYTES,
        };
        n as u64
    }

    /// What the faces are.
    pub fn mesh(&self) -> MeshType {
        self.mesh
    }

    /// Samples in a texel.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// What lies beyond edges without neighbours, along u and v.
    pub fn borders(&self) -> [Border; 2] {
        self.borders
    }

    /// Whether the first two channels are a vector in the tangent plane, which turns from face to face.
    pub fn turns_vectors(&self) -> bool {
        self.turns_vectors
    }

    /// All faces.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The face of that number.
    #[inline]
    pub fn face(&self, face: u32) -> Option<&Face> {
        self.faces.get(face as usize)
    }

    /// What a sample of 1 is stored as.
    #[inline]
    pub fn one(&self) -> f32 {
        match self.texels {
            Texels::U8(_) => u8::ONE,
            Texels::U16(_) => u16::ONE,
            Texels::Half(_) | Texels::Float(_) => 1.0,
        }
    }

    /// The one texel that stands for a face as a whole.
    #[inline]
    pub fn mean(&self, face: u32) -> Level<'_> {
        let first = face as usize * self.channels;
        let range = first..first + self.channels;
        match &self.texels {
            Texels::U8(arena) => Level::U8(&arena.means[range]),
            Texels::U16(arena) => Level::U16(&arena.means[range]),
            Texels::Half(arena) => Level::Half(&arena.means[range]),
            Texels::Float(arena) => Level::Float(&arena.means[range]),
        }
    }

    /// A level of a face that is not constant, of a resolution no higher than its own, and square on triangles:
    /// row by row from v = 0 up.
    #[inline]
    pub fn level(&self, face: &Face, log2: [u8; 2]) -> Level<'_> {
        debug_assert!(!face.is_constant);
        let first = face.first + self.mesh.place(face.log2, log2) * self.channels;
        let range = first..first + (self.channels << (log2[0] + log2[1]));
        match &self.texels {
            Texels::U8(arena) => Level::U8(&arena.levels[range]),
            Texels::U16(arena) => Level::U16(&arena.levels[range]),
            Texels::Half(arena) => Level::Half(&arena.levels[range]),
            Texels::Float(arena) => Level::Float(&arena.levels[range]),
        }
    }
}

impl MeshType {
    /// Texels before a level among those of its face.
    #[inline]
    fn place(self, face: [u8; 2], [u, v]: [u8; 2]) -> usize {
        match self {
            Self::Quad => {
                let column = (2usize << face[1]) - 1;
                ((1usize << u) - 1) * column + (((1usize << v) - 1) << u)
            }
            Self::Triangle => ((1usize << (2 * u)) - 1) / 3,
        }
    }

    /// Texels of all levels of a face.
    fn n_texels(self, [u, v]: [u8; 2]) -> u64 {
        match self {
            Self::Quad => ((2u64 << u) - 1) * ((2u64 << v) - 1),
            Self::Triangle => ((4u64 << (2 * u)) - 1) / 3,
        }
    }

    /// All levels of a face, the finest first.
    fn levels(self, face: [u8; 2]) -> Vec<[u8; 2]> {
        let all = (0..=face[0]).flat_map(|u| (0..=face[1]).map(move |v| [u, v]));
        let mut levels: Vec<_> = match self {
            Self::Quad => all.collect(),
            Self::Triangle => all.filter(|[u, v]| u == v).collect(),
        };
        levels.reverse();
        levels
    }
}
