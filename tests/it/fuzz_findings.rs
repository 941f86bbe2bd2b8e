//! What the fuzzer found, and what it starts from, through the entry points of its targets.
//!
//! `tests/fuzz_findings/<target>/` keeps each input that once broke a promise.

#[expect(
    unreachable_pub,
    reason = "it is a module of the fuzzing crate, where it is public"
)]
#[path = "../../fuzz/src/entry.rs"]
mod entry;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use tyndall_parser::diagnostic::{Diagnostic, Severity};
use tyndall_parser::schema::{DIRECTIVES, Family};

/// No finding may take longer; the slowest takes a hundredth of it.
const PATIENCE: Duration = Duration::from_secs(10);

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files of a directory, sorted.
fn files(directory: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(directory) else {
        return Vec::new();
    };
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut paths: Vec<_> = paths.filter(|path| path.is_file()).collect();
    paths.sort();
    paths
}

/// Runs the entry points over the directories of their names in `parent`; gives how many inputs there were.
fn replay(parent: &Path) -> usize {
    let mut n_inputs = 0;
    for (target, entry) in entry::ENTRIES {
        for path in files(&parent.join(target)) {
            let bytes = std::fs::read(&path).expect("a file of this test");
            let started = Instant::now();
            entry(&bytes);
            let spent = started.elapsed();
            assert!(spent < PATIENCE, "{} takes {spent:?}", path.display());
            n_inputs += 1;
        }
    }
    n_inputs
}

#[test]
fn seeds_and_findings_keep_every_promise() {
    let manifest = std::fs::read_to_string(root().join("fuzz/Cargo.toml")).expect("a manifest");
    for (target, _) in entry::ENTRIES {
        assert!(
            manifest.contains(&format!("name = \"{target}\"")),
            "{target}"
        );
    }
    assert!(replay(&root().join("fuzz/seeds")) >= 30);
    replay(&root().join("tests/fuzz_findings"));
}

/// A scene of eight pixels.
fn scene(options: &str, world: &str) -> String {
    format!(
        "Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 2 {options}\nWorldBegin\n{world}\nWorldEnd\n"
    )
}

/// Asserts that a scene is refused or mended at a place in it, before patience ends.
#[track_caller]
fn assert_told(text: &str) {
    let started = Instant::now();
    let found = entry::findings(text.as_bytes()).list;
    let spent = started.elapsed();
    let start = &text[..text.len().min(200)];
    assert!(spent < PATIENCE, "{spent:?} for {start}");
    let is_told =
        |finding: &Diagnostic| finding.severity >= Severity::Warning && finding.span.is_some();
    // What is missing for a picture is told of every scene here: that is not it.
    let is_about_it = |finding: &Diagnostic| is_told(finding) && finding.code != "no-lights";
    assert!(found.iter().any(is_about_it), "not told: {start}");
}

#[test]
fn counts_of_a_billion_are_located_errors() {
    let n = 1_000_000_000;
    for world in [
        format!("Shape \"heightfield\" \"integer nu\" {n} \"integer nv\" {n} \"float Pz\" [1]"),
        format!(
            "Shape \"nurbs\" \"integer nu\" {n} \"integer nv\" {n} \"integer uorder\" {n} \"integer vorder\" 2 \
                 \"float uknots\" [0 1] \"float vknots\" [0 1] \"point P\" [0 0 0]"
        ),
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 {n}] \"point P\" [0 0 0 1 0 0 0 1 0]"
        ),
        format!(
            "Shape \"loopsubdiv\" \"integer nlevels\" {n} \"integer indices\" [0 1 2] \
                 \"point P\" [0 0 0 1 0 0 0 1 0]"
        ),
        format!(
            "MakeNamedMedium \"m\" \"string type\" \"heterogeneous\" \"integer nx\" {n} \"integer ny\" {n} \
                 \"integer nz\" {n} \"float density\" [1]\nMediumInterface \"m\" \"\" Shape \"sphere\""
        ),
    ] {
        assert_told(&scene("Integrator \"volpath\"", &world));
    }
    assert_told(&format!(
        "Film \"image\" \"integer xresolution\" {n} \"integer yresolution\" {n} WorldBegin WorldEnd"
    ));
}

#[test]
fn numbers_that_are_none_are_told_where_they_stand() {
    let nan = "nan nan nan";
    for world in [
        format!("Translate {nan} Shape \"sphere\""),
        "Shape \"sphere\" \"float radius\" nan".to_owned(),
        format!(
            "Shape \"trianglemesh\" \"integer indices\" [0 1 2] \"point P\" [{nan} {nan} {nan}]"
        ),
        format!("LightSource \"point\" \"rgb I\" [{nan}]"),
        format!("Material \"matte\" \"rgb Kd\" [{nan}] Shape \"sphere\""),
    ] {
        assert_told(&scene("", &world));
    }
    assert_told(&scene(
        &format!("LookAt {nan} {nan} {nan}"),
        "Shape \"sphere\"",
    ));
}

#[test]
fn deep_nesting_ends() {
    const DEPTH: usize = 20_000;
    let shape = "Shape \"sphere\"";
    let mut textures = String::from("Texture \"t0\" \"color\" \"constant\"\n");
    let mut materials = String::from("MakeNamedMaterial \"m0\" \"string type\" \"matte\"\n");
    for k in 1..=DEPTH {
        let below = k - 1;
        writeln!(
            textures,
            "Texture \"t{k}\" \"color\" \"scale\" \"texture tex1\" \"t{below}\""
        )
        .expect("text grows");
        writeln!(
            materials,
            "MakeNamedMaterial \"m{k}\" \"string type\" \"mix\" \"string namedmaterial1\" \"m{below}\" \
             \"string namedmaterial2\" \"m{below}\""
        )
        .expect("text grows");
    }
    for world in [
        format!("{textures} Material \"matte\" \"texture Kd\" \"t{DEPTH}\" {shape}"),
        format!("{materials} NamedMaterial \"m{DEPTH}\" {shape}"),
        "AttributeBegin ".repeat(DEPTH) + shape,
        "ObjectBegin \"o\" ".repeat(DEPTH) + shape,
        "Include \"loop.pbrt\"".to_owned(),
    ] {
        assert_told(&scene("", &world));
    }
}

#[test]
fn the_dictionary_has_every_word_of_the_schema() {
    let text = std::fs::read_to_string(root().join("fuzz/scene.dict")).expect("a dictionary");
    let known: BTreeSet<_> = text.lines().map(|line| line.trim_matches('"')).collect();
    let plugins = Family::ALL.iter().flat_map(|family| family.plugins());
    let words = plugins.flat_map(|plugin| {
        let params = plugin.groups.iter().copied().flatten();
        std::iter::once(plugin.name).chain(params.map(|param| param.name))
    });
    for word in words.chain(DIRECTIVES.iter().map(|directive| directive.keyword)) {
        assert!(known.contains(word), "fuzz/scene.dict lacks {word:?}");
    }
}
