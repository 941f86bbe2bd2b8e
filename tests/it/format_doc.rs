//! `docs/format.md` is what the schema table says, and the tables of `docs/cli.md` are what the commands say.

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
        "docs/format.md differs from line {first_difference}; run UPDATE_EXPECT=1 cargo test --test it format_doc::"
    );
}

/// The tables between `<!-- table: NAME -->` and `<!-- end -->`.
#[test]
fn the_tables_of_commands_are_those_of_the_code() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cli.md");
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let mut generated = committed.clone();
    for (name, table) in tyndall::app::manual_tables() {
        let (before, rest) = generated
            .split_once(&format!("<!-- table: {name} -->\n"))
            .unwrap_or_else(|| panic!("docs/cli.md has no table \"{name}\""));
        let (_, after) = rest.split_once("<!-- end -->").expect("the end of a table");
        generated = format!("{before}<!-- table: {name} -->\n{table}<!-- end -->{after}");
    }
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(&path, &generated).expect("docs/cli.md can be written");
        return;
    }
    assert!(
        committed == generated,
        "docs/cli.md is not what the code says; run UPDATE_EXPECT=1 cargo test --test it format_doc::"
    );
}
