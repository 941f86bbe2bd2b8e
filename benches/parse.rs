//! Throughput of reading scene files, in bytes of text: tokens to directives, and directives to a description.
//!
//! The text is what scenes are made of: a mesh of numbers, and many small directives.

use std::fmt::Write;

use divan::Bencher;
use divan::counter::BytesCount;
use tyndall::describe::describe;
use tyndall_parser::source::Sources;
use tyndall_parser::{LoadError, Loaded, Loader, SceneFile, parse};

fn main() {
    divan::main();
}

/// The scenes name no files.
struct NoFiles;

impl Loader for NoFiles {
    fn load(&self, _path: &str, _top_level: &str) -> Result<Loaded, LoadError> {
        Err(LoadError::new("there are no files".to_owned()))
    }
}

/// A mesh of 200 000 vertices and as many triangles: 8 MB of numbers.
fn mesh() -> String {
    let mut text = "WorldBegin\nShape \"trianglemesh\" \"point P\" [\n".to_owned();
    for i in 0..200_000u32 {
        let t = f64::from(i) * 1e-3;
        let _ = writeln!(text, "{:.6} {:.6} {:.6e}", t.sin(), -t.cos(), t * 1e-2);
    }
    text.push_str("] \"integer indices\" [\n");
    for i in 0..200_000u32 {
        let _ = writeln!(text, "{} {} {}", i % 1000, (i + 1) % 1000, (i + 317) % 1000);
    }
    text.push_str("]\nWorldEnd\n");
    text
}

/// 20 000 spheres, each with transformations and a material of its own: 4 MB of directives.
fn directives() -> String {
    let mut text = "WorldBegin\n".to_owned();
    for i in 0..20_000 {
        let _ = write!(
            text,
            "AttributeBegin # ball {i}\n  Translate {i} 0.5 -1.25\n  Rotate 30 0 1 0\n  \
             Material \"plastic\" \"rgb Kd\" [ 0.25 0.5 0.75 ] \"float roughness\" 0.01\n  \
             Shape \"sphere\" \"float radius\" [ 0.5 ]\nAttributeEnd\n"
        );
    }
    text.push_str("WorldEnd\n");
    text
}

fn read(text: &str) -> SceneFile {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", text);
    let (scene, found) = parse(&mut sources, root, &NoFiles);
    assert!(found.is_empty());
    scene
}

#[divan::bench]
fn parse_mesh(bencher: Bencher<'_, '_>) {
    let text = mesh();
    bencher
        .counter(BytesCount::of_str(&text))
        .bench(|| read(&text));
}

#[divan::bench]
fn parse_directives(bencher: Bencher<'_, '_>) {
    let text = directives();
    bencher
        .counter(BytesCount::of_str(&text))
        .bench(|| read(&text));
}

#[divan::bench]
fn describe_directives(bencher: Bencher<'_, '_>) {
    let text = directives();
    bencher
        .counter(BytesCount::of_str(&text))
        .with_inputs(|| read(&text))
        .bench_values(describe);
}
