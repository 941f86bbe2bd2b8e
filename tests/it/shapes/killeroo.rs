//! A subdivided animal among the published scenes.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tyndall::camera::CameraSample;
use tyndall::compile::{Assets, CompileOptions, compile};
use tyndall::describe::describe;
use tyndall::shape::Shape;
use tyndall_parser::diagnostic::Style;
use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{LoadError, Loaded, Loader, parse};

struct Directory(PathBuf);

impl Loader for Directory {
    fn load(&self, path: &str, _top_level: &str) -> Result<Loaded, LoadError> {
        let bytes =
            std::fs::read(self.0.join(path)).map_err(|error| LoadError::new(error.to_string()))?;
        Ok(Loaded {
            name: path.to_owned(),
            bytes: Arc::new(bytes) as SourceBytes,
        })
    }
}

impl Assets for Directory {
    fn read(&self, path: &Spanned<String>) -> Result<SourceBytes, String> {
        Err(format!("{} is not expected", path.value))
    }
}

#[test]
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
fn two_killeroos_stand_in_their_corner() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes/killeroo");
    let Ok(text) = std::fs::read(directory.join("killeroo-simple.small.pbrt")) else {
        println!("skipped: the scene is not here");
        return;
    };
    let mut sources = Sources::new();
    let root = sources.add_text("killeroo", text);
    let files = Directory(directory);
    let (file, mut findings) = parse(&mut sources, root, &files);
    let (scene, more) = describe(file);
    findings.extend(more);
    let frame = scene.frames.into_iter().next().expect("a frame");
    let (compiled, more) = compile(frame, &CompileOptions::default(), &files);
    findings.extend(more);
    findings
        .list
        .retain(|found| !found.message.contains("plastic"));
    assert!(
        findings.is_empty(),
        "{}",
        findings.render(&sources, Style::Plain)
    );
    let job = compiled.expect("a picture").job;
    let (mut n_animal, mut n_wall, n) = (0, 0, 233);
    for (x, y) in (0..n * n).map(|k| (k % n, k / n)) {
        let sample = CameraSample {
            raster: [f64::from(x) + 0.5, f64::from(y) + 0.5],
            time: 0.0,
            lens: [0.5, 0.5],
        };
        let ray = job.camera.ray(&sample).expect("a pinhole").ray;
        let Some(hit) = job.world.closest(&ray, f32::INFINITY) else {
            continue;
        };
        match &job.world.geometry(hit.target.geometry).shape {
            Shape::Mesh(mesh) if !mesh.normals.is_empty() => n_animal += 1,
            _ => n_wall += 1,
        }
    }
    // In the published picture they fill a good fifth.
    assert!(n_animal + n_wall > n * n * 99 / 100, "{n_animal} {n_wall}");
    let share = f64::from(n_animal) / f64::from(n * n);
    assert!((0.1..0.4).contains(&share), "{share}");
}
