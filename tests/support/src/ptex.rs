//! Writes Ptex files of every kind, for tests of what reads them.

use std::collections::HashMap;
use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;

/// Type of samples, by its code in the file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DataType {
    /// 0 to 255.
    U8,
    /// 0 to 65535.
    U16,
    /// 16-bit float.
    Half,
    /// 32-bit float.
    Float,
}

/// What is written of one face.
#[derive(Clone, Debug)]
pub struct Face {
    /// Logarithms of the resolution.
    pub log2: [u8; 2],
    /// Faces beyond the edges, −1 for none.
    pub neighbours: [i32; 4],
    /// Their edges.
    pub their_edges: [u8; 4],
    /// One of the quads that another polygon was cut into.
    pub is_subface: bool,
    /// Its one pixel is said to hold for the faces around it, too.
    pub is_neighbourhood_constant: bool,
    /// Samples between 0 and 1, interleaved: one pixel, or all.
    pub samples: Vec<f32>,
}

/// A file to be written.
#[derive(Clone, Debug)]
pub struct PtexWriter {
    /// Triangles instead of quads.
    pub is_triangles: bool,
    /// How samples are stored.
    pub data_type: DataType,
    /// Samples in a pixel.
    pub channels: u16,
    /// Channel of alpha, −1 for none.
    pub alpha: i32,
    /// 0 clamp, 1 black, 2 periodic; along u and v.
    pub borders: [u16; 2],
    /// The first two channels turn with the faces.
    pub turns_vectors: bool,
    /// Differences of whole numbers are stored instead of themselves.
    pub differences: bool,
    /// Faces larger than this, as a power of two along either axis, are cut into such tiles.
    pub tile_log2: Option<u8>,
    /// Coarser levels are stored.
    pub levels: bool,
    /// Some meta data stands between levels and edits.
    pub meta: bool,
    /// The faces.
    pub faces: Vec<Face>,
    /// Faces written again at the end, with their numbers.
    pub edits: Vec<(u32, Face)>,
}

impl PtexWriter {
    /// A file of one type with the faces of a mesh, bare of everything else.
    pub fn new(is_triangles: bool, data_type: DataType, channels: u16, faces: Vec<Face>) -> Self {
        Self {
            is_triangles,
            data_type,
            channels,
            alpha: -1,
            borders: [0; 2],
            turns_vectors: false,
            differences: false,
            tile_log2: None,
            levels: true,
            meta: false,
            faces,
            edits: Vec::new(),
        }
    }

    /// The file.
    ///
    /// # Panics
    /// If a face has not one pixel or all.
    pub fn encode(&self) -> Vec<u8> {
        let infos: Vec<u8> = self.faces.iter().flat_map(|f| self.info(f, 0)).collect();
        let means: Vec<u8> = (self.faces.iter())
            .flat_map(|face| self.stored(&self.mean(face)))
            .collect();
        let (infos, means) = (zip(&infos), zip(&means));
        let mut level_infos = Vec::new();
        let mut level_data = Vec::new();
        for (n_faces, data) in self.level_blocks() {
            level_infos.extend((data.len() as u64).to_le_bytes());
            level_infos.extend((data.header_len as u32).to_le_bytes());
            level_infos.extend((n_faces as u32).to_le_bytes());
            level_data.extend(data.bytes);
        }
        let meta = if self.meta {
            let mut entry = vec![2, b'k', 0, 0];
            entry.extend(3u32.to_le_bytes());
            entry.extend(*b"of\0");
            (zip(&entry), entry.len())
        } else {
            (Vec::new(), 0)
        };
        let edits: Vec<u8> = (self.edits.iter())
            .flat_map(|(n, f)| self.edit(*n, f))
            .collect();

        let mut file = Vec::from(*b"Ptex");
        let u32s = |file: &mut Vec<u8>, values: &[u32]| {
            values.iter().for_each(|x| file.extend(x.to_le_bytes()));
        };
        let mesh = u32::from(!self.is_triangles);
        u32s(
            &mut file,
            &[1, mesh, self.data_type as u32, self.alpha as u32],
        );
        file.extend(self.channels.to_le_bytes());
        file.extend(((level_infos.len() / 16) as u16).to_le_bytes());
        let sizes = [
            self.faces.len(),
            40,
            infos.len(),
            means.len(),
            level_infos.len(),
            4,
        ];
        u32s(&mut file, &sizes.map(|n| n as u32));
        file.extend((level_data.len() as u64).to_le_bytes());
        u32s(&mut file, &[meta.0.len() as u32, meta.1 as u32]);
        for half in [
            self.borders[0],
            0,
            self.borders[1],
            self.turns_vectors.into(),
        ] {
            file.extend(half.to_le_bytes());
        }
        u32s(&mut file, &[0, 0]);
        let tables = infos.len() + means.len() + level_infos.len();
        let edits_at = 104 + tables + level_data.len() + meta.0.len() + 8;
        for long in [0, edits.len(), edits_at] {
            file.extend((long as u64).to_le_bytes());
        }
        for part in [&infos, &means, &level_infos, &level_data, &meta.0] {
            file.extend(part);
        }
        file.extend([0; 8]);
        assert_eq!(file.len(), edits_at);
        file.extend(edits);
        file
    }

    fn is_constant(&self, face: &Face) -> bool {
        face.samples.len() == usize::from(self.channels)
    }

    fn info(&self, face: &Face, flags: u8) -> Vec<u8> {
        let mut info = vec![face.log2[0], face.log2[1]];
        let edges = face.their_edges.iter().rev();
        info.push(edges.fold(0, |byte, edge| byte << 2 | edge));
        let around = u8::from(face.is_neighbourhood_constant) << 2;
        let kind = u8::from(face.is_subface) << 3 | u8::from(self.is_constant(face));
        info.push(flags | around | kind);
        face.neighbours
            .iter()
            .for_each(|n| info.extend(n.to_le_bytes()));
        info
    }

    fn mean(&self, face: &Face) -> Vec<f32> {
        let n = usize::from(self.channels);
        let count = (face.samples.len() / n) as f32;
        let channel = |c| face.samples.iter().skip(c).step_by(n).sum::<f32>() / count;
        (0..n).map(channel).collect()
    }

    /// Samples as the file has them.
    fn stored(&self, samples: &[f32]) -> Vec<u8> {
        let bytes = |x: &f32| match self.data_type {
            DataType::U8 => vec![(x * 255.0) as u8],
            DataType::U16 => Vec::from(((x * 65535.0) as u16).to_le_bytes()),
            DataType::Half => Vec::from(half_bits(*x).to_le_bytes()),
            DataType::Float => Vec::from(x.to_le_bytes()),
        };
        samples.iter().flat_map(bytes).collect()
    }

    /// A face or tile; its bytes and the header for it.
    fn block(&self, samples: &[f32], log2: [u8; 2]) -> (u32, Vec<u8>) {
        let n = usize::from(self.channels);
        if samples.chunks(n).all(|pixel| pixel == &samples[..n]) {
            let pixel = self.stored(&samples[..n]);
            return (pixel.len() as u32, pixel);
        }
        assert_eq!(samples.len(), n << (log2[0] + log2[1]));
        let mut planes: Vec<f32> = Vec::with_capacity(samples.len());
        (0..n).for_each(|c| planes.extend(samples.iter().skip(c).step_by(n)));
        let mut bytes = self.stored(&planes);
        let mut encoding = 1;
        if self.differences {
            match self.data_type {
                DataType::U8 => {
                    encoding = 2;
                    let mut last = 0;
                    for x in &mut bytes {
                        (last, *x) = (*x, x.wrapping_sub(last));
                    }
                }
                DataType::U16 => {
                    encoding = 2;
                    let mut last = 0u16;
                    for pair in bytes.as_chunks_mut::<2>().0 {
                        let x = u16::from_le_bytes(*pair);
                        *pair = x.wrapping_sub(last).to_le_bytes();
                        last = x;
                    }
                }
                DataType::Half | DataType::Float => {}
            }
        }
        let zipped = zip(&bytes);
        (zipped.len() as u32 | encoding << 30, zipped)
    }

    /// A face, in tiles if it is large.
    fn face(&self, samples: &[f32], log2: [u8; 2]) -> (u32, Vec<u8>) {
        let Some(tile) = self.tile_log2.filter(|t| log2.iter().any(|l| l > t)) else {
            return self.block(samples, log2);
        };
        let n = usize::from(self.channels);
        let tile = log2.map(|l| l.min(tile));
        let (mut headers, mut data) = (Vec::new(), Vec::new());
        for j in 0..1usize << (log2[1] - tile[1]) {
            for i in 0..1usize << (log2[0] - tile[0]) {
                let mut samples_of_tile = Vec::new();
                for y in 0..1usize << tile[1] {
                    let row = ((j << tile[1]) + y) << log2[0];
                    let first = (row + (i << tile[0])) * n;
                    samples_of_tile.extend(&samples[first..first + (n << tile[0])]);
                }
                let (header, bytes) = self.block(&samples_of_tile, tile);
                headers.extend(header.to_le_bytes());
                data.extend(bytes);
            }
        }
        let headers = zip(&headers);
        let mut bytes = Vec::from(tile);
        bytes.extend((headers.len() as u32).to_le_bytes());
        bytes.extend(headers);
        bytes.extend(data);
        (bytes.len() as u32 | 3 << 30, bytes)
    }

    fn level_blocks(&self) -> Vec<(usize, LevelData)> {
        let side = |face: &Face| {
            if self.is_constant(face) {
                1
            } else {
                face.log2[0].min(face.log2[1])
            }
        };
        let mut order: Vec<usize> = (0..self.faces.len()).collect();
        order.sort_by_key(|f| std::cmp::Reverse(side(&self.faces[*f])));
        let mut levels = Vec::new();
        let mut current: Vec<(usize, [u8; 2], Vec<f32>)> = (self.faces.iter().enumerate())
            .map(|(k, face)| (k, face.log2, face.samples.clone()))
            .collect();
        for level in 0..if self.levels { 16 } else { 1 } {
            if level > 0 {
                let kept = order.iter().filter(|f| side(&self.faces[**f]) > 1 + level);
                let kept: Vec<usize> = kept.copied().collect();
                if kept.is_empty() {
                    break;
                }
                current = (kept.iter())
                    .map(|f| {
                        let (_, log2, samples) = current
                            .iter()
                            .find(|c| c.0 == *f)
                            .expect("it is in the level before");
                        (*f, log2.map(|l| l - 1), self.reduced(samples, *log2))
                    })
                    .collect();
            }
            let (mut headers, mut data) = (Vec::new(), Vec::new());
            for (f, log2, samples) in &current {
                if self.is_constant(&self.faces[*f]) {
                    headers.extend([0; 4]);
                    continue;
                }
                let (header, bytes) = self.face(samples, *log2);
                headers.extend(header.to_le_bytes());
                data.extend(bytes);
            }
            let headers = zip(&headers);
            let header_len = headers.len();
            let bytes = [headers, data].concat();
            levels.push((current.len(), LevelData { header_len, bytes }));
        }
        levels
    }

    /// Means of four; those of triangles as Ptex has them.
    fn reduced(&self, fine: &[f32], [u, v]: [u8; 2]) -> Vec<f32> {
        let (n, width) = (usize::from(self.channels), 1usize << u);
        let at = |x: usize, y: usize, c: usize| fine[(y * width + x) * n + c];
        let mut coarse = Vec::new();
        for y in 0..1usize << (v - 1) {
            for x in 0..width / 2 {
                for c in 0..n {
                    let fourth = if self.is_triangles {
                        at(width - 1 - 2 * y, width - 1 - 2 * x, c)
                    } else {
                        at(2 * x + 1, 2 * y + 1, c)
                    };
                    let others =
                        at(2 * x, 2 * y, c) + at(2 * x + 1, 2 * y, c) + at(2 * x, 2 * y + 1, c);
                    coarse.push(0.25 * (others + fourth));
                }
            }
        }
        coarse
    }

    fn edit(&self, number: u32, face: &Face) -> Vec<u8> {
        let mut edit = Vec::from(number.to_le_bytes());
        edit.extend(self.info(face, 2));
        let (header, bytes) = if self.is_constant(face) {
            (0, Vec::new())
        } else {
            self.face(&face.samples, face.log2)
        };
        edit.extend(header.to_le_bytes());
        edit.extend(self.stored(&self.mean(face)));
        edit.extend(bytes);
        let mut whole = vec![0];
        whole.extend((edit.len() as u32).to_le_bytes());
        whole.extend(edit);
        whole
    }
}

struct LevelData {
    header_len: usize,
    bytes: Vec<u8>,
}

impl LevelData {
    fn len(&self) -> usize {
        self.bytes.len()
    }
}

fn zip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(bytes).expect("vectors grow");
    encoder.finish().expect("vectors grow")
}

/// The half below a number from 0 to 65504.
fn half_bits(x: f32) -> u16 {
    let bits = x.to_bits();
    let exponent = (bits >> 23) as i32 - 127 + 15;
    if exponent <= 0 {
        return 0;
    }
    (exponent as u16) << 10 | (bits >> 13 & 0x3ff) as u16
}

/// The faces of a mesh of polygons, given by the numbers of their corners counter-clockwise. In a mesh of quads every
/// other polygon is cut into as many subfaces as it has corners; their numbers follow one another. All are one black
/// pixel.
pub fn faces(polygons: &[Vec<u32>], is_triangles: bool) -> Vec<Face> {
    let sides = if is_triangles { 3 } else { 4 };
    let mut first = Vec::new();
    let mut n_faces = 0;
    let mut edges = HashMap::new();
    for (p, polygon) in polygons.iter().enumerate() {
        first.push(n_faces);
        let n = polygon.len();
        n_faces += if n == sides { 1 } else { n };
        for k in 0..n {
            edges.insert((polygon[k], polygon[(k + 1) % n]), (p, k));
        }
    }
    let is_whole = |p: usize| polygons[p].len() == sides;
    let mut faces = Vec::new();
    for (p, polygon) in polygons.iter().enumerate() {
        let n = polygon.len();
        let beyond = |k: usize| edges.get(&(polygon[(k + 1) % n], polygon[k])).copied();
        if is_whole(p) {
            let mut face = blank(false);
            for k in 0..n {
                let Some((q, l)) = beyond(k) else { continue };
                // Of the two subfaces there it knows the one at the start of its edge.
                (face.neighbours[k], face.their_edges[k]) = if is_whole(q) {
                    (first[q] as i32, l as u8)
                } else {
                    ((first[q] + (l + 1) % polygons[q].len()) as i32, 3)
                };
            }
            faces.push(face);
            continue;
        }
        for k in 0..n {
            // From the corner along the polygon, over the middle, and back.
            let mut face = blank(true);
            let mut set = |edge: usize, neighbour: usize, theirs: u8| {
                (face.neighbours[edge], face.their_edges[edge]) = (neighbour as i32, theirs);
            };
            set(1, first[p] + (k + 1) % n, 2);
            set(2, first[p] + (k + n - 1) % n, 1);
            if let Some((q, l)) = beyond(k) {
                let m = polygons[q].len();
                if is_whole(q) {
                    set(0, first[q], l as u8);
                } else {
                    set(0, first[q] + (l + 1) % m, 3);
                }
            }
            if let Some((q, l)) = beyond((k + n - 1) % n) {
                if is_whole(q) {
                    set(3, first[q], l as u8);
                } else {
                    set(3, first[q] + l, 0);
                }
            }
            faces.push(face);
        }
    }
    faces
}

fn blank(is_subface: bool) -> Face {
    Face {
        log2: [0; 2],
        neighbours: [-1; 4],
        their_edges: [0; 4],
        is_subface,
        is_neighbourhood_constant: false,
        samples: vec![0.0],
    }
}

/// A grid of quads, closed to a torus or not; corners begin with another one from quad to quad.
pub fn grid(columns: u32, rows: u32, is_torus: bool) -> Vec<Vec<u32>> {
    let (wide, high) = if is_torus {
        (columns, rows)
    } else {
        (columns + 1, rows + 1)
    };
    let vertex = |i: u32, j: u32| j % high * wide + i % wide;
    let quads = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j)));
    quads
        .map(|(i, j)| {
            let mut quad = vec![
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ];
            quad.rotate_left((i as usize * 3 + j as usize) % 4);
            quad
        })
        .collect()
}

/// The six sides of a cube: three meet at each corner.
pub fn cube() -> Vec<Vec<u32>> {
    [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ]
    .map(Vec::from)
    .to_vec()
}

/// Quads around a vertex.
pub fn star(points: u32) -> Vec<Vec<u32>> {
    (0..points)
        .map(|k| {
            let at = |ring: u32, k: u32| 1 + 2 * (k % points) + ring;
            let mut quad = vec![0, at(0, k), at(1, k), at(0, k + 1)];
            quad.rotate_left(k as usize % 4);
            quad
        })
        .collect()
}

/// Triangles around a vertex.
pub fn fan(points: u32) -> Vec<Vec<u32>> {
    (0..points)
        .map(|k| {
            let mut triangle = vec![0, 1 + k, 1 + (k + 1) % points];
            triangle.rotate_left(k as usize % 3);
            triangle
        })
        .collect()
}

/// A pentagon and a triangle that share an edge, with quads on their other edges.
pub fn patchwork() -> Vec<Vec<u32>> {
    let pentagon = vec![0, 1, 2, 3, 4];
    let triangle = vec![1, 0, 5];
    let mut polygons = vec![pentagon, triangle];
    for (k, [a, b]) in [[1, 2], [2, 3], [3, 4], [4, 0], [0, 5], [5, 1]]
        .iter()
        .enumerate()
    {
        // Outer corners are shared, so that there are no gaps between the quads.
        let outer = |v: u32| 10 + v;
        let mut quad = vec![*b, *a, outer(*a), outer(*b)];
        quad.rotate_left(k % 4);
        polygons.push(quad);
    }
    polygons
}
