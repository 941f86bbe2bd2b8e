//! What a picture does not need costs nothing but the reading of its text: no file is opened, nothing is built.

#![expect(clippy::print_stdout, reason = "how close it was is worth reading")]

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use tyndall::compile::{Assets, CompileOptions, Compiled, Skipped, compile};
use tyndall::describe::describe;
use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{LoadError, Loaded, Loader, parse};

const TEXTURES: usize = 1000;
const MATERIALS: usize = 1000;
const OBJECTS: usize = 200;
const GRIDS: usize = 50;
/// Cells of a grid along each axis.
const GRID_SIDE: usize = 16;

/// Counts the files that are asked for; there are none.
#[derive(Default)]
struct Watch {
    n_opened: AtomicUsize,
}

impl Watch {
    fn note(&self) -> String {
        self.n_opened.fetch_add(1, Ordering::Relaxed);
        "it is not there".to_owned()
    }
}

impl Loader for Watch {
    fn load(&self, _path: &str, _top_level: &str) -> Result<Loaded, LoadError> {
        Err(LoadError::new(self.note()))
    }
}

impl Assets for Watch {
    fn read(&self, _path: &Spanned<String>) -> Result<SourceBytes, String> {
        Err(self.note())
    }
}

/// A ball in a scene with this inside its world.
fn scene(world: &str) -> String {
    format!(
        "Film \"image\" \"integer xresolution\" 16 \"integer yresolution\" 16\n\
         LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\"\nIntegrator \"volpath\"\nWorldBegin\n\
         LightSource \"infinite\"\n{world}Material \"matte\"\nShape \"sphere\"\nWorldEnd\n"
    )
}

/// Things that nothing leads to, most of which name files; `times` as many as the constants say.
fn attic(times: usize) -> String {
    let mut text = String::new();
    for i in 0..times * TEXTURES {
        let _ = writeln!(
            text,
            "Texture \"t{i}\" \"color\" \"{}\" \"string filename\" \"big-{i}.exr\"",
            ["imagemap", "ptex"][i % 2]
        );
    }
    for i in 0..times * MATERIALS {
        let _ = writeln!(
            text,
            "MakeNamedMaterial \"m{i}\" \"string type\" \"fourier\" \"string bsdffile\" \"big-{i}.bsdf\""
        );
    }
    for i in 0..times * OBJECTS {
        let _ = writeln!(
            text,
            "ObjectBegin \"o{i}\"\nMaterial \"matte\" \"texture Kd\" \"t{i}\"\n\
             Shape \"plymesh\" \"string filename\" \"big-{i}.ply\"\nObjectEnd"
        );
    }
    for i in 0..times * GRIDS {
        let _ = writeln!(
            text,
            "MakeNamedMedium \"g{i}\" \"string type\" \"heterogeneous\" \"integer nx\" {GRID_SIDE} \
             \"integer ny\" {GRID_SIDE} \"integer nz\" {GRID_SIDE} \"float density\" [{}]",
            "0.5 ".repeat(GRID_SIDE.pow(3))
        );
    }
    text
}

/// What a load took.
struct Load {
    compiled: Compiled,
    n_opened: usize,
    parse: Duration,
    compile: Duration,
}

#[track_caller]
fn load(text: &str) -> Load {
    let watch = Watch::default();
    let mut sources = Sources::new();
    let root = sources.add("scene", Arc::new(text.as_bytes().to_vec()) as SourceBytes);
    let start = Instant::now();
    let (file, findings) = parse(&mut sources, root, &watch);
    assert!(!findings.has_errors());
    let parse = start.elapsed();
    let start = Instant::now();
    let (scene, findings) = describe(file);
    assert!(!findings.has_errors());
    let frame = scene.frames.into_iter().next().expect("a frame");
    let (compiled, findings) = compile(frame, &CompileOptions::default(), &watch);
    assert!(!findings.has_errors(), "what is not there is not missed");
    Load {
        compiled: compiled.expect("a picture"),
        n_opened: watch.n_opened.into_inner(),
        parse,
        compile: start.elapsed(),
    }
}

#[test]
fn what_nothing_leads_to_is_neither_opened_nor_built() {
    let full = load(&scene(&attic(1)));
    assert_eq!(full.n_opened, 0);
    let empty = load(&scene("")).compiled.skipped;
    let numbers = |skipped: &Skipped| {
        [
            skipped.textures.len(),
            skipped.materials.len(),
            skipped.media.len(),
            skipped.objects.len(),
        ]
    };
    let [textures, materials, media, objects] = numbers(&empty);
    // The materials of the objects' shapes are not built either.
    let wanted = [
        textures + TEXTURES,
        materials + MATERIALS + OBJECTS,
        media + GRIDS,
        objects + OBJECTS,
    ];
    assert_eq!(numbers(&full.compiled.skipped), wanted);
    // The watch is awake: one thing that is used is asked for.
    let used = attic(1) + "ObjectInstance \"o7\"\n";
    let text = scene(&used);
    let watch = Watch::default();
    let mut sources = Sources::new();
    let root = sources.add_text("scene", text);
    let (file, _) = parse(&mut sources, root, &watch);
    let (scene, _) = describe(file);
    let frame = scene.frames.into_iter().next().expect("a frame");
    let (_, findings) = compile(frame, &CompileOptions::default(), &watch);
    assert!(findings.has_errors());
    assert_eq!(watch.n_opened.into_inner(), 1, "its mesh");
}

#[test]
#[ignore = "a clock: for machines that do nothing else"]
fn load_time_grows_with_the_bytes_that_are_read_and_no_faster() {
    let text = scene(&attic(1));
    // The least of several: what else the machine does only adds.
    let singles: Vec<Load> = (0..9).map(|_| load(&text)).collect();
    let least = |time: fn(&Load) -> Duration| singles.iter().map(time).min().expect("some loads");
    let (parse, compile) = (least(|load| load.parse), least(|load| load.compile));
    println!(
        "{} bytes: parsed in {parse:?}, the rest took {compile:?}",
        text.len()
    );
    assert!(
        compile <= parse,
        "parsed in {parse:?}, the rest took {compile:?}"
    );

    let double = scene(&attic(2));
    let loads: Vec<Load> = (0..9).map(|_| load(&double)).collect();
    let whole = |loads: &[Load]| loads.iter().map(|load| load.parse + load.compile).min();
    let (single, double) = (whole(&singles), whole(&loads));
    println!("twice as many: {double:?} instead of {single:?}");
    assert!(double <= single.map(|single| single * 3));
}
