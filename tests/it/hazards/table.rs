//! `docs/stability.md` is what the rows say, and the tests they name exist.

use std::collections::HashMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use crate::hazards::rows::{ROWS, Row, State};

const BEGIN: &str = "<!-- The table is written from tests/it/hazards/rows.rs. -->\n";
const END: &str = "<!-- End of the table. -->\n";

/// How many rows each family has.
const FAMILIES: [(char, usize); 6] = [
    ('G', 33),
    ('N', 30),
    ('M', 14),
    ('V', 25),
    ('L', 13),
    ('I', 8),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

fn cell(row: &Row) -> String {
    let tests: Vec<String> = row
        .tests
        .iter()
        .map(|test| {
            let (path, name) = test.split_once("::").expect("path::name");
            let file = path.rsplit('/').next().expect("a name");
            format!("[{file}](../{path}) `{name}`")
        })
        .collect();
    tests.join("<br>")
}

fn table() -> String {
    let mut text = String::from(BEGIN);
    text += "| row | trigger | pbrt-v3 | Tyndall | tests |\n|---|---|---|---|---|\n";
    for row in &ROWS {
        let state = match row.state {
            State::Held => "",
            State::Decided => "decided: ",
        };
        let _ = writeln!(
            text,
            "| {} (P{}) | {} | {} | {state}{} | {} |",
            row.id,
            row.priority,
            row.trigger,
            row.pbrt,
            row.ours,
            cell(row)
        );
    }
    text + END
}

#[test]
fn the_rows_are_complete_and_in_order() {
    let expected: Vec<String> = FAMILIES
        .iter()
        .flat_map(|(family, n)| (1..=*n).map(move |i| format!("{family}{i:02}")))
        .collect();
    let ids: Vec<&str> = ROWS.iter().map(|row| row.id).collect();
    assert_eq!(ids, expected);
    for row in &ROWS {
        assert!((1..=3).contains(&row.priority), "{}", row.id);
        assert!(!row.tests.is_empty(), "{} has no test", row.id);
    }
}

#[test]
fn every_test_that_a_row_names_exists() {
    let mut files: HashMap<&str, String> = HashMap::new();
    for row in &ROWS {
        for test in row.tests {
            let (path, name) = test.split_once("::").expect("path::name");
            let text = files.entry(path).or_insert_with(|| {
                std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
            });
            assert!(is_test(text, name), "{}: there is no test {test}", row.id);
        }
    }
}

/// Whether a source has a test of this name: a function right behind the attribute.
fn is_test(text: &str, name: &str) -> bool {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    lines
        .windows(2)
        .any(|pair| pair[0] == "#[test]" && pair[1].starts_with(&format!("fn {name}(")))
}

#[test]
fn a_function_that_is_no_test_is_not_taken_for_one() {
    assert!(is_test("#[test]\nfn a() {}", "a"));
    assert!(!is_test("#[test]\nfn ab() {}", "a"));
    assert!(!is_test("fn a() {}", "a"));
}

#[test]
fn the_committed_table_is_the_one_the_rows_make() {
    let path = root().join("docs/stability.md");
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let (before, rest) = committed.split_once(BEGIN).expect("a table begins");
    let (old, after) = rest.split_once(END).expect("the table ends");
    let new = table();
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&path, format!("{before}{new}{after}")).expect("it can be written");
        return;
    }
    assert!(
        format!("{BEGIN}{old}{END}") == new,
        "docs/stability.md is not what the rows say; run UPDATE_EXPECT=1 cargo test --test it hazards::"
    );
}
