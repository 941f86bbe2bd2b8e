//! Throughput of the PLY decoder, in bytes of the file: a wavy grid of 200 000 triangles with normals, and all meshes
//! of the bmw-m6 example scene (0.8 million triangles in 114 files) where it is there.

use divan::Bencher;
use divan::counter::BytesCount;
use tyndall::shape::ply::{Route, decode_by};

const ROUTES: [Route; 2] = [Route::Fastest, Route::General];
const SIDE: u32 = 317;

fn main() {
    divan::main();
}

fn grid(is_ascii: bool) -> Vec<u8> {
    let format = if is_ascii {
        "ascii"
    } else {
        "binary_little_endian"
    };
    let n_vertices = SIDE * SIDE;
    let n_faces = 2 * (SIDE - 1) * (SIDE - 1);
    let mut bytes = format!(
        "ply\nformat {format} 1.0\nelement vertex {n_vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\nelement face {n_faces}\n\
         property list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    for i in 0..n_vertices {
        let (x, y) = ((i % SIDE) as f32 * 0.1, (i / SIDE) as f32 * 0.1);
        let vertex = [x, y, (x * y).sin(), -x.cos(), y.sin(), 1.0];
        if is_ascii {
            bytes.extend(vertex.map(|c| c.to_string()).join(" ").bytes());
            bytes.push(b'\n');
        } else {
            bytes.extend(vertex.iter().flat_map(|c| c.to_le_bytes()));
        }
    }
    for i in (0..n_vertices - SIDE).filter(|i| i % SIDE != SIDE - 1) {
        for face in [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]] {
            if is_ascii {
                bytes.extend(format!("3 {} {} {}\n", face[0], face[1], face[2]).bytes());
            } else {
                bytes.push(3);
                bytes.extend(face.iter().flat_map(|corner| corner.to_le_bytes()));
            }
        }
    }
    bytes
}

#[divan::bench(args = ROUTES)]
fn binary(bencher: Bencher<'_, '_>, route: &Route) {
    run(bencher, &grid(false), *route);
}

#[divan::bench(args = ROUTES)]
fn ascii(bencher: Bencher<'_, '_>, route: &Route) {
    run(bencher, &grid(true), *route);
}

#[divan::bench(args = ROUTES)]
fn bmw_m6(bencher: Bencher<'_, '_>, route: &Route) {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../shared/scenes/bmw-m6/geometry"
    );
    let files: Vec<Vec<u8>> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| std::fs::read(entry.ok()?.path()).ok())
        .filter(|bytes| bytes.starts_with(b"ply"))
        .collect();
    let n_bytes: usize = files.iter().map(Vec::len).sum();
    bencher.counter(BytesCount::new(n_bytes)).bench(|| {
        let decode = |bytes| decode_by(bytes, *route).expect("the scene's meshes are PLY files");
        files
            .iter()
            .map(|bytes| decode(bytes).triangles.len())
            .sum::<usize>()
    });
}

fn run(bencher: Bencher<'_, '_>, bytes: &[u8], route: Route) {
    bencher
        .counter(BytesCount::of_slice(bytes))
        .bench(|| decode_by(bytes, route).expect("the grid is a PLY file"));
}
