//! From bytes to faces: headers, tables and where the data of each face is.

use std::io::Read;

use half::f16;

use crate::image::ImageError;
use crate::image::ptex::face::{Blocks, decode_faces};
use crate::image::ptex::{Arena, Border, Face, MeshType, Ptex, PtexFile, Sample, Texels};

/// Most that deflate shrinks by.
const DEFLATE_RATIO: u64 = 1032;
/// Bytes that a file of any length may unpack to.
const FREE_BYTES: u64 = 1 << 20;
/// The largest resolution along an axis, as a power of 2.
const LOG2_MAX: u8 = 15;
/// More channels than files have, and few enough for sizes to fit.
const CHANNELS_MAX: u16 = 4096;

const HEADER_BYTES: u64 = 64;
const EXTENSION_BYTES: usize = 40;
const FACE_BYTES: usize = 20;
/// Memory that tables take for a face while a file is decoded, besides its mean.
const TABLE_BYTES_PER_FACE: u64 = 2 * size_of::<Face>() as u64 + 64;
const LEVEL_BYTES: usize = 16;
const EDIT_BYTES: usize = 28;

const FLAG_CONSTANT: u8 = 1;
const FLAG_NEIGHBOURHOOD_CONSTANT: u8 = 4;
const FLAG_SUBFACE: u8 = 8;

/// How the data of a face or tile is stored: two bits of its header.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Encoding {
    Constant,
    Zipped,
    Differences,
    Tiled,
}

/// Where the data of a face or tile is, and what it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<'a> {
    pub(super) encoding: Encoding,
    pub(super) bytes: &'a [u8],
}

pub(super) fn invalid(message: impl Into<String>) -> ImageError {
    ImageError::Invalid(message.into())
}

/// A part of a file.
pub(super) fn slice<'a>(
    bytes: &'a [u8],
    at: u64,
    len: u64,
    what: &str,
) -> Result<&'a [u8], ImageError> {
    let end = at.checked_add(len).filter(|end| *end <= bytes.len() as u64);
    end.map(|end| &bytes[at as usize..end as usize])
        .ok_or_else(|| invalid(format!("the file ends within its {what}")))
}

/// Unpacks exactly `n` bytes, if that many can be in there.
pub(super) fn inflate(zipped: &[u8], n: u64, what: &str) -> Result<Vec<u8>, ImageError> {
    if n > zipped.len() as u64 * DEFLATE_RATIO + 64 {
        let message = format!("{} bytes of {what} cannot hold {n} bytes", zipped.len());
        return Err(ImageError::TooLarge(message));
    }
    let mut unpacked = vec![0; n as usize];
    flate2::read::ZlibDecoder::new(zipped)
        .read_exact(&mut unpacked)
        .map_err(|_| invalid(format!("the {what} are damaged")))?;
    Ok(unpacked)
}

/// Little-endian numbers one after the other; the length was checked.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_first_chunk().expect("the length was checked");
        self.0 = rest;
        *head
    }

    fn u8(&mut self) -> u8 {
        u8::from_le_bytes(self.take())
    }

    fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    fn u64(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }
}

/// What the two headers say.
struct Header {
    mesh: MeshType,
    data_type: u32,
    alpha: Option<usize>,
    channels: u16,
    n_levels: u16,
    n_faces: u32,
    borders: [Border; 2],
    turns_vectors: bool,
    /// Sizes of the tables that follow the headers.
    faces_bytes: u32,
    means_bytes: u32,
    levels_bytes: u32,
    /// Places in the file.
    faces_at: u64,
    data_at: u64,
    edits_at: u64,
    edits_end: u64,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, ImageError> {
        let mut n = Numbers(slice(bytes, 0, HEADER_BYTES, "header")?);
        if n.take() != *b"Ptex" {
            return Err(invalid("the file does not begin with \"Ptex\""));
        }
        let version = n.u32();
        if version != 1 {
            let message = format!("Ptex files of version {version} are not known, only of 1");
            return Err(ImageError::Unsupported(message));
        }
        let mesh = match n.u32() {
            0 => MeshType::Triangle,
            1 => MeshType::Quad,
            other => return Err(invalid(format!("{other} is no type of mesh"))),
        };
        let data_type = n.u32();
        let alpha = n.u32() as i32;
        let (channels, n_levels) = (n.u16(), n.u16());
        if channels == 0 || channels > CHANNELS_MAX {
            return Err(invalid(format!("the file has {channels} channels")));
        }
        let n_faces = n.u32();
        let extension_bytes = n.u32();
        let [faces_bytes, means_bytes, levels_bytes] = [n.u32(), n.u32(), n.u32()];
        n.u32(); // The minor version changes nothing.
        let data_bytes = n.u64();
        let (meta_bytes, _) = (n.u32(), n.u32());

        let extension = slice(bytes, HEADER_BYTES, extension_bytes.into(), "header")?;
        let mut padded = [0; EXTENSION_BYTES];
        let known = extension.len().min(EXTENSION_BYTES);
        padded[..known].copy_from_slice(&extension[..known]);
        let mut n = Numbers(&padded);
        let border = |code: u16| match code {
            0 => Ok(Border::Clamp),
            1 => Ok(Border::Black),
            2 => Ok(Border::Periodic),
            other => Err(invalid(format!("{other} is no border"))),
        };
        let u_border = border(n.u16())?;
        n.u16();
        let v_border = border(n.u16())?;
        let turns_vectors = n.u16() == 1;
        let (large_meta_headers, _) = (n.u32(), n.u32());
        let [large_meta, edits_bytes, edits_at] = [n.u64(), n.u64(), n.u64()];

        let sum = |terms: &[u64]| {
            let sum = terms.iter().try_fold(0, |a: u64, b| a.checked_add(*b));
            sum.ok_or_else(|| invalid("the sizes in the header are too large"))
        };
        let faces_at = HEADER_BYTES + u64::from(extension_bytes);
        let tables = u64::from(faces_bytes) + u64::from(means_bytes) + u64::from(levels_bytes);
        let data_at = faces_at + tables;
        // Eight bytes keep older readers from what follows.
        let meta = u64::from(meta_bytes) + 8 + u64::from(large_meta_headers);
        let end = sum(&[data_at, data_bytes, meta, large_meta])?;
        // Files that do not say where their edits are have them up to the end.
        let edits_end = if edits_at > 0 {
            sum(&[edits_at.max(end), edits_bytes])?
        } else {
            u64::MAX
        };
        Ok(Self {
            mesh,
            data_type,
            alpha: usize::try_from(alpha)
                .ok()
                .filter(|a| *a < usize::from(channels)),
            channels,
            n_levels,
            n_faces,
            borders: [u_border, v_border],
            turns_vectors,
            faces_bytes,
            means_bytes,
            levels_bytes,
            faces_at,
            data_at,
            edits_at: edits_at.max(end),
            edits_end,
        })
    }
}

pub(super) fn decode(bytes: &[u8], bytes_max: u64) -> Result<PtexFile, ImageError> {
    let header = Header::read(bytes)?;
    match header.data_type {
        0 => decode_as(bytes, &header, bytes_max, Texels::U8),
        1 => decode_as(bytes, &header, bytes_max, Texels::U16),
        2 => decode_as::<f16>(bytes, &header, bytes_max, Texels::Half),
        3 => decode_as::<f32>(bytes, &header, bytes_max, Texels::Float),
        other => Err(invalid(format!("{other} is no type of data"))),
    }
}

fn decode_as<T: Sample>(
    bytes: &[u8],
    header: &Header,
    bytes_max: u64,
    texels: impl FnOnce(Arena<T>) -> Texels,
) -> Result<PtexFile, ImageError> {
    let (n_faces, n_channels) = (u64::from(header.n_faces), usize::from(header.channels));
    let tables = n_faces * (TABLE_BYTES_PER_FACE + (n_channels * T::BYTES) as u64 * 2);
    if tables > bytes_max.max(FREE_BYTES) {
        let message = format!("its tables of {n_faces} faces need {} MiB", tables >> 20);
        return Err(ImageError::TooLarge(message));
    }
    let zipped = slice(bytes, header.faces_at, header.faces_bytes.into(), "faces")?;
    let table = inflate(zipped, n_faces * FACE_BYTES as u64, "faces")?;
    let mut faces = (table.chunks_exact(FACE_BYTES).zip(0..))
        .map(|(record, face)| read_face(record, face, header))
        .collect::<Result<Vec<_>, _>>()?;

    let at = header.faces_at + u64::from(header.faces_bytes);
    let zipped = slice(bytes, at, header.means_bytes.into(), "constants")?;
    let pixel_bytes = n_channels * T::BYTES;
    let table = inflate(zipped, n_faces * pixel_bytes as u64, "constants")?;
    let mut means: Vec<T> = table.chunks_exact(T::BYTES).map(T::from_bytes).collect();
    multiply_alpha(&mut means, n_channels, header.alpha);

    let mut blocks = read_levels(bytes, header, faces.len())?;
    blocks.order = reduction_order(&faces);
    read_edits(bytes, header, &mut faces, &mut means, &mut blocks)?;

    let mut bad_samples = sweep(&mut means);
    let budget = bytes_max.min(bytes.len() as u64 * 4 * DEFLATE_RATIO + FREE_BYTES);
    let full = faces.clone();
    let unpacked_max = bytes.len() as u64 * DEFLATE_RATIO + FREE_BYTES;
    // Every face is unpacked as a whole before what is kept of it is made.
    let largest = (full.iter().filter(|face| !face.is_constant)).max_by_key(|face| face.n_finest());
    if let Some(face) = largest
        && face.n_finest().saturating_mul(pixel_bytes as u64) > unpacked_max
    {
        let [u, v] = face.log2;
        let message = format!(
            "a file of {} bytes cannot hold a face of 2^{u} x 2^{v} texels",
            bytes.len()
        );
        return Err(ImageError::TooLarge(message));
    }
    let dropped_levels = fit(&mut faces, header.mesh, pixel_bytes as u64, budget);
    let mut levels = decode_faces(header.mesh, &full, &mut faces, &blocks, &mut means, {
        (n_channels, header.alpha)
    })?;
    bad_samples += sweep(&mut levels);
    Ok(PtexFile {
        ptex: Ptex {
            mesh: header.mesh,
            channels: n_channels,
            borders: header.borders,
            turns_vectors: header.turns_vectors,
            faces,
            texels: texels(Arena { means, levels }),
        },
        dropped_levels,
        bad_samples,
    })
}

fn read_face(record: &[u8], number: u32, header: &Header) -> Result<Face, ImageError> {
    let mut n = Numbers(record);
    let log2 = [n.u8(), n.u8()];
    let (edges, flags) = (n.u8(), n.u8());
    let is_square = log2[0] == log2[1] || header.mesh == MeshType::Quad;
    if log2.iter().any(|l| *l > LOG2_MAX) || !is_square {
        let message = format!(
            "face {number} has a resolution of 2^{} x 2^{}",
            log2[0] as i8, log2[1] as i8
        );
        return Err(invalid(message));
    }
    let n_edges = match header.mesh {
        MeshType::Quad => 4,
        MeshType::Triangle => 3,
    };
    let their_edges = [0, 2, 4, 6].map(|shift| (edges >> shift) & 3);
    let mut neighbours = [0; 4].map(|_: u32| n.u32());
    for (edge, neighbour) in neighbours.iter_mut().enumerate() {
        let exists = edge < n_edges && usize::from(their_edges[edge]) < n_edges;
        if !exists || *neighbour >= header.n_faces {
            *neighbour = u32::MAX;
        }
    }
    Ok(Face {
        log2,
        neighbours: neighbours.map(|n| (n != u32::MAX).then_some(n)),
        their_edges,
        is_constant: flags & FLAG_CONSTANT != 0,
        is_neighbourhood_constant: flags & FLAG_NEIGHBOURHOOD_CONSTANT != 0,
        is_subface: flags & FLAG_SUBFACE != 0,
        first: 0,
    })
}

/// Place of each face among those that a file stores coarser levels of: by the shorter side, the longest first.
fn reduction_order(faces: &[Face]) -> Vec<u32> {
    let side = |face: &Face| {
        if face.is_constant {
            1
        } else {
            face.log2[0].min(face.log2[1])
        }
    };
    let mut sorted: Vec<u32> = (0..faces.len() as u32).collect();
    sorted.sort_by_key(|face| std::cmp::Reverse(side(&faces[*face as usize])));
    let mut order = vec![0; faces.len()];
    for (place, face) in (0..).zip(sorted) {
        order[face as usize] = place;
    }
    order
}

/// Blocks one after the other, from the table of their headers.
pub(super) fn blocks<'a>(
    table: &[u8],
    mut data: &'a [u8],
    what: &str,
) -> Result<Vec<Block<'a>>, ImageError> {
    let headers = table.as_chunks::<4>().0.iter();
    headers
        .map(|header| {
            let (encoding, len) = block_header(u32::from_le_bytes(*header));
            let bytes = slice(data, 0, len, what)?;
            data = &data[bytes.len()..];
            Ok(Block { encoding, bytes })
        })
        .collect()
}

fn block_header(header: u32) -> (Encoding, u64) {
    let encoding = match header >> 30 {
        0 => Encoding::Constant,
        1 => Encoding::Zipped,
        2 => Encoding::Differences,
        _ => Encoding::Tiled,
    };
    (encoding, u64::from(header & 0x3fff_ffff))
}

fn read_levels<'a>(
    bytes: &'a [u8],
    header: &Header,
    n_faces: usize,
) -> Result<Blocks<'a>, ImageError> {
    let at = header.data_at - u64::from(header.levels_bytes);
    let n_bytes = u64::from(header.n_levels) * LEVEL_BYTES as u64;
    if n_bytes > header.levels_bytes.into() {
        return Err(invalid("the table of levels is too short"));
    }
    let mut n = Numbers(slice(bytes, at, n_bytes, "levels")?);
    let mut at = header.data_at;
    let mut levels = Vec::new();
    for level in 0..header.n_levels {
        let (size, table_size, count) = (n.u64(), n.u32(), n.u32());
        if count as usize > n_faces || (level == 0 && count as usize != n_faces) {
            return Err(invalid(format!("level {level} has {count} faces")));
        }
        let data = slice(bytes, at, size, "levels")?;
        let zipped = slice(data, 0, table_size.into(), "levels")?;
        let table = inflate(zipped, 4 * u64::from(count), "levels")?;
        levels.push(blocks(&table, &data[zipped.len()..], "levels")?);
        at += size;
    }
    Ok(Blocks {
        levels,
        order: Vec::new(),
        edited: vec![false; n_faces],
    })
}

/// Faces that were written again, behind everything else.
fn read_edits<'a, T: Sample>(
    bytes: &'a [u8],
    header: &Header,
    faces: &mut [Face],
    means: &mut [T],
    blocks: &mut Blocks<'a>,
) -> Result<(), ImageError> {
    const FACE_DATA: u8 = 0;
    const HEAD_BYTES: u64 = 5;
    let (mut at, n_channels) = (header.edits_at, usize::from(header.channels));
    // The last edit may be cut off: it is as if it were not there.
    while at < header.edits_end
        && let Ok(head) = slice(bytes, at, HEAD_BYTES, "edits")
    {
        let mut n = Numbers(head);
        let (kind, size) = (n.u8(), n.u32());
        if size == 0 {
            break;
        }
        let data = slice(bytes, at + HEAD_BYTES, size.into(), "edits")?;
        at += HEAD_BYTES + u64::from(size);
        if kind != FACE_DATA {
            continue;
        }
        let head = slice(data, 0, EDIT_BYTES as u64, "edits")?;
        let number = Numbers(head).u32();
        let Some(face) = faces.get_mut(number as usize) else {
            return Err(invalid(format!("there is no face {number} to edit")));
        };
        *face = read_face(&head[4..24], number, header)?;
        let (encoding, len) = block_header(Numbers(&head[24..]).u32());
        let pixel_bytes = (n_channels * T::BYTES) as u64;
        let pixel = slice(data, EDIT_BYTES as u64, pixel_bytes, "edits")?;
        let mean = &mut means[number as usize * n_channels..][..n_channels];
        for (sample, bytes) in mean.iter_mut().zip(pixel.chunks_exact(T::BYTES)) {
            *sample = T::from_bytes(bytes);
        }
        multiply_alpha(mean, n_channels, header.alpha);
        blocks.edited[number as usize] = true;
        if !face.is_constant {
            let bytes = slice(data, EDIT_BYTES as u64 + pixel_bytes, len, "edits")?;
            let Some(finest) = blocks.levels.first_mut() else {
                return Err(invalid("there is no level to edit"));
            };
            finest[number as usize] = Block { encoding, bytes };
        }
    }
    Ok(())
}

/// Multiplies the channels before the alpha channel by it, or all others if it is the first.
pub(super) fn multiply_alpha<T: Sample>(
    samples: &mut [T],
    n_channels: usize,
    alpha: Option<usize>,
) {
    let Some(alpha) = alpha else { return };
    for texel in samples.chunks_exact_mut(n_channels) {
        let by = texel[alpha].to_f32() / T::ONE;
        let others = if alpha == 0 { 1..n_channels } else { 0..alpha };
        for sample in &mut texel[others] {
            *sample = sample.scaled(by);
        }
    }
}

/// Sets what cannot be added up to 0, and counts it.
fn sweep<T: Sample>(samples: &mut [T]) -> usize {
    let mut count = 0;
    for sample in samples.iter_mut().filter(|s| !s.is_usable()) {
        *sample = T::ZERO;
        count += 1;
    }
    count
}

/// Coarsens all faces by as many levels as it takes until their texels fit; how many these are.
fn fit(faces: &mut [Face], mesh: MeshType, pixel_bytes: u64, budget: u64) -> u8 {
    let coarsened = |face: &Face, by: u8| face.log2.map(|l| l.saturating_sub(by));
    let fits = |by: &u8| {
        let varying = faces.iter().filter(|face| !face.is_constant);
        let texels = varying.map(|face| mesh.n_texels(coarsened(face, *by)));
        texels.sum::<u64>().saturating_mul(pixel_bytes) <= budget
    };
    let by = (0..LOG2_MAX).find(fits).unwrap_or(LOG2_MAX);
    for face in faces.iter_mut() {
        face.log2 = coarsened(face, by);
    }
    by
}
