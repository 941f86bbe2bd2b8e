//! `docs/format.md` is what the schema table says.

use std::path::Path;

#[test]
fn the_committed_reference_is_the_one_the_table_generates() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/format.md");
    let generated = tyndall_parser::schema::markdown();
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&path, &generated).expect("docs/format.md can be written");
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let first_difference = committed
        .lines()
        .zip(generated.lines())
        .position(|(a, b)| a != b)
        .map_or_else(
            || committed.lines().count().min(generated.lines().count()) + 1,
            |i| i + 1,
        );
    assert!(
        committed == generated,
        "docs/format.md differs from line {first_difference}; run UPDATE_EXPECT=1 cargo test --test format_doc"
    );
}
