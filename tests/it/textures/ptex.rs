//! Ptex files as our writer makes them, read back, and filtered as the Ptex library does.

use tyndall::image::ImageError;
use tyndall::image::ptex::{Level, Ptex, PtexFile, Sample};
use tyndall::sampling::rng::Rng;
use tyndall::texture::TextureContext;
use tyndall::texture::ptex::filtered;
use tyndall_test_support::ptex::{
    DataType, Face, PtexWriter, cube, faces, fan, grid, patchwork, star,
};

use crate::textures::at::uv;

const ROOM: u64 = 1 << 30;
/// Look-ups in each file.
const LOOKUPS: usize = 6;

/// Random texels for all faces of a mesh: of all resolutions, one in five of one pixel.
fn painted(mut faces: Vec<Face>, channels: usize, is_triangles: bool, rng: &mut Rng) -> Vec<Face> {
    for face in &mut faces {
        paint(face, channels, is_triangles, rng);
    }
    faces
}

fn paint(face: &mut Face, channels: usize, is_triangles: bool, rng: &mut Rng) {
    let mut log2 = || 1 + (rng.uniform() * 5.0) as u8;
    face.log2 = [log2(), log2()];
    if is_triangles {
        face.log2[1] = face.log2[0];
    }
    let is_constant = rng.uniform() < 0.2;
    let n = if is_constant {
        channels
    } else {
        channels << (face.log2[0] + face.log2[1])
    };
    face.samples = (0..n).map(|_| rng.uniform()).collect();
}

/// One file of each kind.
fn files() -> Vec<(&'static str, PtexWriter)> {
    let mut rng = Rng::new(19);
    let mut file = |polygons: Vec<Vec<u32>>, data_type, channels: u16| {
        let is_triangles = polygons.iter().all(|p| p.len() == 3);
        let faces = painted(
            faces(&polygons, is_triangles),
            channels.into(),
            is_triangles,
            &mut rng,
        );
        PtexWriter::new(is_triangles, data_type, channels, faces)
    };
    let mut files = vec![
        (
            "torus",
            PtexWriter {
                differences: true,
                tile_log2: Some(3),
                ..file(grid(4, 3, true), DataType::U8, 3)
            },
        ),
        (
            "clamped grid",
            PtexWriter {
                differences: true,
                ..file(grid(3, 2, false), DataType::U16, 1)
            },
        ),
        ("cube", file(cube(), DataType::Half, 3)),
        (
            "black star",
            PtexWriter {
                borders: [1, 1],
                ..file(star(5), DataType::Float, 3)
            },
        ),
        (
            "periodic star",
            PtexWriter {
                borders: [2, 0],
                tile_log2: Some(2),
                ..file(star(6), DataType::Float, 1)
            },
        ),
        ("patchwork", file(patchwork(), DataType::U8, 3)),
        (
            "vectors",
            PtexWriter {
                turns_vectors: true,
                tile_log2: Some(2),
                ..file(patchwork(), DataType::Float, 3)
            },
        ),
        (
            "alpha",
            PtexWriter {
                alpha: 2,
                ..file(grid(2, 2, false), DataType::U16, 3)
            },
        ),
        (
            "edited",
            PtexWriter {
                meta: true,
                ..file(grid(3, 3, true), DataType::Float, 3)
            },
        ),
        (
            "bare",
            PtexWriter {
                levels: false,
                ..file(grid(2, 2, false), DataType::U8, 1)
            },
        ),
        ("fan", file(fan(5), DataType::U8, 3)),
        (
            "tiled fan",
            PtexWriter {
                tile_log2: Some(2),
                ..file(fan(6), DataType::Float, 1)
            },
        ),
        (
            "edited fan",
            PtexWriter {
                differences: true,
                levels: false,
                ..file(fan(3), DataType::U16, 3)
            },
        ),
    ];
    for (name, writer) in &mut files {
        if name.starts_with("edited") {
            for number in [1, 2] {
                let mut face = writer.faces[number as usize].clone();
                paint(&mut face, 3, writer.is_triangles, &mut rng);
                writer.edits.push((number, face));
            }
        }
    }
    files
}

/// Points all over a mesh with footprints of all sizes and shapes.
fn lookups(writer: &PtexWriter, seed: u64) -> Vec<TextureContext> {
    let n_faces = writer.faces.len();
    let mut rng = Rng::new(seed);
    let lookup = |_| {
        let size = 3.0 * 2f32.powf(-8.0 * rng.uniform());
        let mut length = || size * (2.0 * rng.uniform() - 1.0) * rng.uniform();
        let duv_dx = [length(), length()];
        let duv_dy = [length(), length()];
        // Often beside an edge.
        let mut x = || (1.2 * rng.uniform() - 0.1).clamp(0.0, 1.0);
        let (mut u, mut v) = (x(), x());
        if writer.is_triangles && u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        TextureContext {
            duv_dx,
            duv_dy,
            face: (n_faces as f32 * rng.uniform()) as u32,
            ..uv(u, v)
        }
    };
    (0..LOOKUPS).map(lookup).collect()
}

fn decode(writer: &PtexWriter) -> Ptex {
    let PtexFile {
        ptex,
        dropped_levels,
        bad_samples,
    } = Ptex::decode(&writer.encode(), ROOM).expect("it is sound");
    assert_eq!((dropped_levels, bad_samples), (0, 0));
    ptex
}

/// What the Ptex library 2.4 (of Walt Disney Animation Studios, in C++) makes of the same look-ups in the same files
/// with the filter `f_bspline`, width 1, no blur: a line for each look-up, 0 for channels that there are not. Over 400
/// times as many look-ups the largest difference was 5.4e-7.
const LIBRARY: &str = include_str!("ptex_library.txt");

#[test]
fn ptex_filters_give_what_the_library_gives() {
    let mut expected = LIBRARY.lines();
    for ((name, writer), seed) in files().into_iter().zip(0..) {
        let ptex = decode(&writer);
        for ctx in lookups(&writer, seed) {
            let line = expected.next().expect("a line for each look-up");
            let line: Vec<f32> = (line.split(' ').map(|x| x.parse()))
                .collect::<Result<_, _>>()
                .expect("three numbers");
            let value = filtered(&ptex, &ctx);
            for (value, expected) in value.iter().zip(&line) {
                let error = (value - expected).abs();
                assert!(error < 2e-6, "{name}: {value} is not {expected} at {ctx:?}");
            }
        }
    }
    assert_eq!(expected.next(), None);
}

#[test]
fn ptex_texels_are_read_as_they_were_written() {
    fn assert_holds<T: Sample>(texels: &[T], one: f32, written: &[f32], name: &str) {
        assert_eq!(texels.len(), written.len(), "{name}");
        for (texel, written) in texels.iter().zip(written) {
            let error = (texel.to_f32() / one - written).abs();
            assert!(error <= 1.0 / 255.0, "{name}");
        }
    }
    for (name, writer) in files() {
        let ptex = decode(&writer);
        assert_eq!(ptex.faces().len(), writer.faces.len());
        for (number, face) in (0..).zip(&writer.faces) {
            if writer.alpha >= 0 || writer.edits.iter().any(|(n, _)| *n == number) {
                continue;
            }
            let read = *ptex.face(number).expect("it exists");
            let level = if read.is_constant {
                ptex.mean(number)
            } else {
                ptex.level(&read, read.log2)
            };
            let (one, written) = (ptex.one(), &face.samples[..]);
            match level {
                Level::U8(texels) => assert_holds(texels, one, written, name),
                Level::U16(texels) => assert_holds(texels, one, written, name),
                Level::Half(texels) => assert_holds(texels, one, written, name),
                Level::Float(texels) => assert_holds(texels, one, written, name),
            }
        }
    }
}

#[test]
fn ptex_files_without_room_are_shown_coarser() {
    let (_, writer) = files().swap_remove(0);
    let bytes = writer.encode();
    let whole = decode(&writer);
    let mut last = 0;
    for room in [whole.n_bytes() - 1, whole.n_bytes() / 4, 2000, 0] {
        let file = Ptex::decode(&bytes, room).expect("it is sound");
        assert!(file.dropped_levels > 0 && file.dropped_levels >= last);
        // What does not fit at all is one texel for each face.
        assert!(file.ptex.n_bytes() <= room || file.dropped_levels >= 5);
        last = file.dropped_levels;
        for ctx in lookups(&writer, 5) {
            let value = filtered(&file.ptex, &ctx);
            assert!(value.iter().all(|x| (0.0..=1.0).contains(x)), "{value:?}");
            // A footprint as wide as the face asks for the coarsest levels, which are the same.
            let wide = TextureContext {
                duv_dx: [1.0, 0.0],
                duv_dy: [0.0, 1.0],
                ..ctx
            };
            assert_eq!(filtered(&file.ptex, &wide), filtered(&whole, &wide));
        }
    }
}

#[test]
fn ptex_faces_that_do_not_exist_are_black() {
    let (_, writer) = files().swap_remove(0);
    let ptex = decode(&writer);
    for face in [writer.faces.len() as u32, u32::MAX] {
        let ctx = TextureContext {
            face,
            ..uv(0.5, 0.5)
        };
        assert_eq!(filtered(&ptex, &ctx), [0.0; 3]);
    }
}

#[test]
fn a_constant_neighbourhood_is_not_filtered() {
    let mut mesh = faces(&grid(3, 3, true), false);
    for (k, face) in mesh.iter_mut().enumerate() {
        face.is_neighbourhood_constant = k == 4;
        face.samples = vec![if k == 4 { 0.5 } else { 1.0 }];
    }
    let ptex = decode(&PtexWriter::new(false, DataType::Float, 1, mesh));
    let at = |face| {
        let ctx = TextureContext {
            duv_dx: [2.0, 2.0],
            face,
            ..uv(0.0, 0.0)
        };
        filtered(&ptex, &ctx)[0]
    };
    // It is as the file says, even where that is wrong.
    assert_eq!(at(4), 0.5);
    assert!((0..9).any(|face| at(face) > 0.5 && at(face) < 1.0));
}

#[test]
fn damaged_ptex_files_are_refused_or_shown() {
    let mut rng = Rng::new(7);
    let mut n_refused = 0;
    for (name, writer) in files() {
        let sound = writer.encode();
        for k in 0..150 {
            let mut bytes = sound.clone();
            if k % 5 == 0 {
                bytes.truncate((rng.uniform() * bytes.len() as f32) as usize);
            }
            // Headers more often than texels.
            for _ in 0..1 + k % 4 {
                let range = if k % 2 == 0 { 104 } else { bytes.len() };
                let at = (rng.uniform() * range as f32) as usize;
                if let Some(byte) = bytes.get_mut(at) {
                    *byte = rng.next_u32() as u8;
                }
            }
            match Ptex::decode(&bytes, 1 << 24) {
                Err(
                    ImageError::Invalid(text)
                    | ImageError::Unsupported(text)
                    | ImageError::TooLarge(text),
                ) => {
                    assert!(!text.is_empty());
                    n_refused += 1;
                }
                Ok(file) => {
                    for ctx in lookups(&writer, k) {
                        let value = filtered(&file.ptex, &ctx);
                        assert!(value.iter().all(|x| x.is_finite()), "{name}: {value:?}");
                    }
                }
            }
        }
    }
    assert!(n_refused > 500, "{n_refused}");
}

#[test]
fn ptex_neighbourhoods_in_circles_come_to_an_end() {
    let mut rng = Rng::new(11);
    for k in 0..300 {
        let is_triangles = k % 2 == 0;
        let mut mesh = faces(&if is_triangles { fan(5) } else { star(5) }, is_triangles);
        for face in &mut mesh {
            paint(face, 1, is_triangles, &mut rng);
            face.is_subface = !is_triangles && rng.uniform() < 0.5;
            face.neighbours = face.neighbours.map(|_| (rng.uniform() * 6.0) as i32 - 1);
            face.their_edges = face.their_edges.map(|_| (rng.uniform() * 4.0) as u8);
        }
        let writer = PtexWriter::new(is_triangles, DataType::Float, 1, mesh);
        let ptex = decode(&writer);
        for ctx in lookups(&writer, k) {
            assert!(filtered(&ptex, &ctx)[0].is_finite());
        }
    }
}
