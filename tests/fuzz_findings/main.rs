//! What the fuzzer found, and what it starts from, through the entry points of its targets.
//!
//! `tests/fuzz_findings/<target>/` keeps each input that once broke a promise.

#[path = "../../fuzz/src/entry.rs"]
mod entry;

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

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
fn what_was_found_stays_mended() {
    assert!(replay(&root().join("tests/fuzz_findings")) > 0);
}

#[test]
fn every_target_starts_from_inputs_it_survives() {
    for (target, _) in entry::ENTRIES {
        let manifest = std::fs::read_to_string(root().join("fuzz/Cargo.toml")).expect("a manifest");
        assert!(manifest.contains(&format!("name = \"{target}\"")));
    }
    assert!(replay(&root().join("fuzz/seeds")) >= 30);
}

#[test]
fn the_dictionary_has_every_word_of_the_schema() {
    let mut words = BTreeSet::new();
    words.extend(DIRECTIVES.iter().map(|directive| directive.keyword));
    for plugin in Family::ALL.iter().flat_map(|family| family.plugins()) {
        words.insert(plugin.name);
        words.extend(
            plugin
                .groups
                .iter()
                .flat_map(|group| group.iter())
                .map(|param| param.name),
        );
    }
    let mut generated = String::from("# Words of scenes, written by the test `fuzz_findings`.\n");
    for word in words.iter().filter(|word| !word.is_empty()) {
        writeln!(generated, "\"{word}\"").expect("text grows");
    }
    let path = root().join("fuzz/scene.dict");
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&path, &generated).expect("fuzz/scene.dict can be written");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        committed == generated,
        "fuzz/scene.dict differs; run UPDATE_EXPECT=1 cargo test --test fuzz_findings"
    );
}
