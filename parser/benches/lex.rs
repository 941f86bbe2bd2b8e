//! Throughput of parsing: long lists of numbers, which decide how fast a scene loads, and ordinary directives.
//!
//! `cargo bench -p tyndall-parser` prints MB/s. Scenes of the benchmark set are measured, too, where they are present.

use std::fs;
use std::hint::black_box;
use std::path::Path;

use divan::Bencher;
use divan::counter::BytesCount;
use tyndall_parser::{NoIncludes, Sources, parse};

fn main() {
    divan::main();
}

/// Numbers that look random, the same in each run (the multiplier of PCG, O'Neill 2014).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u32 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as u32
    }

    fn unit(&mut self) -> f32 {
        self.next() as f32 / (1_u64 << 31) as f32
    }
}

const N_VALUES: usize = 1 << 20;

/// A grid as simulations write it: mostly empty, the rest in full single precision.
fn density() -> String {
    let mut noise = Noise(1);
    let mut text = String::from("MakeNamedMedium \"smoke\" \"float density\" [");
    while text.len() < 6 * N_VALUES {
        // Runs of empty and of filled cells.
        for _ in 0..noise.next() % 200 {
            text.push_str("0 ");
        }
        for _ in 0..noise.next() % 100 {
            text.push_str(&format!("{} ", noise.unit()));
        }
    }
    text + "]"
}

/// A triangle mesh as exporters write it.
fn mesh() -> String {
    let mut noise = Noise(2);
    let mut text = String::from("Shape \"trianglemesh\" \"point P\" [\n");
    for _ in 0..N_VALUES / 6 {
        let [x, y, z] = [0; 3].map(|_| 200.0 * noise.unit() - 100.0);
        text.push_str(&format!("{x:.6} {y:.6} {z:.6}\n"));
    }
    text.push_str("] \"integer indices\" [\n");
    for _ in 0..N_VALUES / 6 {
        let [a, b, c] = [0; 3].map(|_| noise.next() as usize % (N_VALUES / 6));
        text.push_str(&format!("{a} {b} {c}\n"));
    }
    text + "]"
}

/// Many small directives.
fn directives() -> String {
    let one = "AttributeBegin\n  Translate 1.5 0 -2.25\n  Material \"plastic\" \"rgb Kd\" [.1 .2 .3] \
               \"float roughness\" 0.05 # shiny\n  Shape \"sphere\" \"float radius\" [2]\nAttributeEnd\n";
    one.repeat(20_000)
}

fn measure(bencher: Bencher<'_, '_>, text: String) {
    bencher
        .counter(BytesCount::new(text.len()))
        .bench_local(|| {
            let mut sources = Sources::new();
            let file = sources.add_text("bench.pbrt", text.as_str());
            black_box(parse(&mut sources, file, &NoIncludes))
        });
}

#[divan::bench]
fn density_grid(bencher: Bencher<'_, '_>) {
    measure(bencher, density());
}

#[divan::bench]
fn triangle_mesh(bencher: Bencher<'_, '_>) {
    measure(bencher, mesh());
}

#[divan::bench]
fn small_directives(bencher: Bencher<'_, '_>) {
    measure(bencher, directives());
}

#[divan::bench(args = [
    "cloud/geometry/density_render.70.pbrt",
    "killeroo/geometry/killeroo.pbrt",
    "buddha-fractal/geometry.pbrt",
])]
fn scene_file(bencher: Bencher<'_, '_>, name: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../shared/scenes")
        .join(name);
    if let Ok(text) = fs::read_to_string(path) {
        measure(bencher, text);
    }
}
