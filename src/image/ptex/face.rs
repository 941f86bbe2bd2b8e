//! The texels of faces: unpacked, put together from tiles, halved.

use std::collections::HashMap;

use rayon::iter::{
    IndexedParallelIterator, IntoParallelIterator, IntoParallelRefIterator, ParallelIterator,
};

use crate::image::ImageError;
use crate::image::ptex::file::{self, Block, Encoding, inflate, invalid, multiply_alpha, slice};
use crate::image::ptex::{Face, MeshType, Sample};

/// Where the data of all faces is.
pub(super) struct Blocks<'a> {
    /// Blocks of each level: of all faces in the finest, then of those that are large enough.
    pub(super) levels: Vec<Vec<Block<'a>>>,
    /// Place of each face in all levels but the finest.
    pub(super) order: Vec<u32>,
    /// Faces whose coarser levels were stored before they were changed.
    pub(super) edited: Vec<bool>,
}

/// What is the same for all faces of a file.
#[derive(Clone, Copy)]
struct Format {
    mesh: MeshType,
    n_channels: usize,
    alpha: Option<usize>,
}

/// The levels of all faces one after the other, down from the resolution that is kept. Faces without variation become
/// constant.
pub(super) fn decode_faces<T: Sample>(
    mesh: MeshType,
    full: &[Face],
    faces: &mut [Face],
    blocks: &Blocks,
    means: &mut [T],
    (n_channels, alpha): (usize, Option<usize>),
) -> Result<Vec<T>, ImageError> {
    let format = Format {
        mesh,
        n_channels,
        alpha,
    };
    let finest = blocks.levels.first();
    let mut n_texels = 0;
    for (number, face) in faces.iter_mut().enumerate() {
        let mean = &mut means[number * n_channels..][..n_channels];
        // The library looks faces of one texel up in the table of constants.
        face.is_constant |= full[number].log2 == [0, 0];
        if face.is_constant {
            continue;
        }
        let Some(block) = finest.map(|level| level[number]) else {
            return Err(invalid("the file has no levels"));
        };
        if block.encoding == Encoding::Constant {
            mean.copy_from_slice(&format.pixel(block.bytes)?);
            face.is_constant = true;
            continue;
        }
        face.first = n_texels * n_channels;
        n_texels += mesh.n_texels(face.log2) as usize;
    }
    let mut levels = vec![T::ZERO; n_texels * n_channels];
    let mut parts = Vec::with_capacity(faces.len());
    let mut rest = levels.as_mut_slice();
    for face in faces.iter() {
        let n = if face.is_constant {
            0
        } else {
            mesh.n_texels(face.log2) as usize * n_channels
        };
        let (part, others) = std::mem::take(&mut rest).split_at_mut(n);
        parts.push(part);
        rest = others;
    }
    let filled: Vec<Result<(), ImageError>> = (faces.par_iter(), full.par_iter(), parts)
        .into_par_iter()
        .enumerate()
        .filter(|(_, (face, ..))| !face.is_constant)
        .map(|(number, (face, full, part))| {
            let mut pyramid = Pyramid {
                format,
                blocks,
                number,
                full: full.log2,
                mean: &means[number * n_channels..][..n_channels],
                known: HashMap::new(),
            };
            pyramid.fill(face.log2, part)
        })
        .collect();
    filled.into_iter().collect::<Result<(), _>>()?;
    Ok(levels)
}

/// Levels of one face on their way.
struct Pyramid<'a, T> {
    format: Format,
    blocks: &'a Blocks<'a>,
    number: usize,
    full: [u8; 2],
    mean: &'a [T],
    known: HashMap<[u8; 2], Vec<T>>,
}

impl<T: Sample> Pyramid<'_, T> {
    /// Writes all levels up to one to where they belong.
    fn fill(&mut self, top: [u8; 2], levels: &mut [T]) -> Result<(), ImageError> {
        let mesh = self.format.mesh;
        for level in mesh.levels(top) {
            self.make(level)?;
            let texels = &self.known[&level];
            let first = mesh.place(top, level) * self.format.n_channels;
            levels[first..first + texels.len()].copy_from_slice(texels);
        }
        Ok(())
    }

    /// Makes a level known, from the file or from finer ones. Calls itself once for each finer level at most.
    fn make(&mut self, level: [u8; 2]) -> Result<(), ImageError> {
        if self.known.contains_key(&level) {
            return Ok(());
        }
        let texels = self.stored(level)?;
        let texels = match texels {
            Some(texels) => texels,
            None => {
                let (from, along) = self.finer(level);
                self.make(from)?;
                self.format.reduced(&self.known[&from], from, along)
            }
        };
        self.known.insert(level, texels);
        Ok(())
    }

    /// A level as the file has it.
    fn stored(&self, level: [u8; 2]) -> Result<Option<Vec<T>>, ImageError> {
        if level == [0, 0] {
            return Ok(Some(self.mean.to_vec()));
        }
        let [down_u, down_v] = [0, 1].map(|axis| usize::from(self.full[axis] - level[axis]));
        if down_u != down_v {
            return Ok(None);
        }
        let place = match down_u {
            0 => self.number,
            _ if self.blocks.edited[self.number] => return Ok(None),
            _ => self.blocks.order[self.number] as usize,
        };
        let Some(block) = self.blocks.levels.get(down_u).and_then(|l| l.get(place)) else {
            return Ok(None);
        };
        let mut texels = self.format.unpack(*block, level)?;
        if down_u == 0 {
            multiply_alpha(&mut texels, self.format.n_channels, self.format.alpha);
        }
        Ok(Some(texels))
    }

    /// The level that one is made from, and the axis along which it is twice as fine (both on triangles).
    fn finer(&self, level: [u8; 2]) -> ([u8; 2], Option<usize>) {
        let [u, v] = level;
        if self.format.mesh == MeshType::Triangle {
            return ([u + 1, v + 1], None);
        }
        let (down_u, down_v) = (self.full[0] - u, self.full[1] - v);
        // Squares are halved along either axis in turn.
        let is_along_u = if down_u == down_v {
            u % 2 == 1
        } else {
            down_u > down_v
        };
        if is_along_u {
            ([u + 1, v], Some(0))
        } else {
            ([u, v + 1], Some(1))
        }
    }
}

impl Format {
    /// One texel.
    fn pixel<T: Sample>(self, bytes: &[u8]) -> Result<Vec<T>, ImageError> {
        let bytes = slice(bytes, 0, (self.n_channels * T::BYTES) as u64, "constants")?;
        let mut pixel: Vec<T> = bytes.chunks_exact(T::BYTES).map(T::from_bytes).collect();
        multiply_alpha(&mut pixel, self.n_channels, self.alpha);
        Ok(pixel)
    }

    /// A face, or a tile of one, interleaved.
    fn unpack<T: Sample>(self, block: Block, log2: [u8; 2]) -> Result<Vec<T>, ImageError> {
        let n_texels = 1usize << (log2[0] + log2[1]);
        match block.encoding {
            Encoding::Constant => {
                let bytes = (self.n_channels * T::BYTES) as u64;
                let bytes = slice(block.bytes, 0, bytes, "constants")?;
                let pixel: Vec<T> = bytes.chunks_exact(T::BYTES).map(T::from_bytes).collect();
                Ok(pixel.repeat(n_texels))
            }
            Encoding::Zipped | Encoding::Differences => {
                let n_samples = n_texels * self.n_channels;
                let bytes = inflate(block.bytes, (n_samples * T::BYTES) as u64, "texels")?;
                let mut previous = T::ZERO;
                let mut texels = vec![T::ZERO; n_samples];
                for (k, bytes) in bytes.chunks_exact(T::BYTES).enumerate() {
                    let mut sample = T::from_bytes(bytes);
                    if block.encoding == Encoding::Differences {
                        sample = sample.plus(previous);
                        previous = sample;
                    }
                    // Channel after channel there, side by side here.
                    texels[k % n_texels * self.n_channels + k / n_texels] = sample;
                }
                Ok(texels)
            }
            Encoding::Tiled => self.put_together(block.bytes, log2),
        }
    }

    fn put_together<T: Sample>(self, bytes: &[u8], log2: [u8; 2]) -> Result<Vec<T>, ImageError> {
        let head = slice(bytes, 0, 6, "tiles")?;
        let tile = [head[0], head[1]];
        if tile[0] > log2[0] || tile[1] > log2[1] {
            return Err(invalid("a tile is larger than its face"));
        }
        let table_bytes = u32::from_le_bytes([head[2], head[3], head[4], head[5]]);
        let table = slice(bytes, 6, table_bytes.into(), "tiles")?;
        let data = &bytes[6 + table.len()..];
        let n_log2 = [log2[0] - tile[0], log2[1] - tile[1]];
        let table = inflate(table, 4u64 << (n_log2[0] + n_log2[1]), "tiles")?;
        let tiles = file::blocks(&table, data, "tiles")?;
        let mut texels = vec![T::ZERO; self.n_channels << (log2[0] + log2[1])];
        let row = self.n_channels << tile[0];
        for (k, block) in tiles.into_iter().enumerate() {
            if block.encoding == Encoding::Tiled {
                return Err(invalid("a tile is made of tiles"));
            }
            let (i, j) = (k & ((1 << n_log2[0]) - 1), k >> n_log2[0]);
            let rows = self.unpack::<T>(block, tile)?;
            for (y, texels_of_row) in rows.chunks_exact(row).enumerate() {
                let first = (((j << tile[1]) + y) << log2[0]) * self.n_channels + i * row;
                texels[first..first + row].copy_from_slice(texels_of_row);
            }
        }
        Ok(texels)
    }

    /// The next coarser level along one axis, or along both on triangles.
    fn reduced<T: Sample>(self, fine: &[T], log2: [u8; 2], along: Option<usize>) -> Vec<T> {
        let (width, height) = (1usize << log2[0], 1usize << log2[1]);
        let at = |x: usize, y: usize, c: usize| fine[(y * width + x) * self.n_channels + c];
        let (columns, rows) = match along {
            Some(0) => (width / 2, height),
            Some(_) => (width, height / 2),
            None => (width / 2, height / 2),
        };
        let mut coarse = Vec::with_capacity(columns * rows * self.n_channels);
        for y in 0..rows {
            for x in 0..columns {
                for c in 0..self.n_channels {
                    coarse.push(match along {
                        Some(0) => T::halved(at(2 * x, y, c), at(2 * x + 1, y, c)),
                        Some(_) => T::halved(at(x, 2 * y, c), at(x, 2 * y + 1, c)),
                        // The triangle in the middle stands on its tip: its texel is on the other side of the diagonal.
                        None => T::quartered([
                            at(2 * x, 2 * y, c),
                            at(2 * x + 1, 2 * y, c),
                            at(2 * x, 2 * y + 1, c),
                            at(width - 1 - 2 * y, width - 1 - 2 * x, c),
                        ]),
                    });
                }
            }
        }
        coarse
    }
}
