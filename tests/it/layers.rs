//! The order of the rooms, read from the source: who may know whom, and who may talk to the world outside.
//!
//! Names are taken from the text without comments and string contents. Tests inside the sources are held to the order
//! of the rooms too; only what they print or look up is their own affair.

use std::path::{Path, PathBuf};

/// The rooms, each of which may know the ones before it.
const ROOMS: [&str; 23] = [
    "stop",
    "ids",
    "math",
    "spectrum",
    "sampling",
    "image",
    "accel",
    "shape",
    "texture",
    "scatter",
    "material",
    "medium",
    "light",
    "camera",
    "sampler",
    "film",
    "world",
    "integrator",
    "render",
    "describe",
    "compile",
    "app",
    "main",
];

/// The room that reads scene descriptions knows the parser's crate and these.
const DESCRIBE_KNOWS: [&str; 2] = ["describe", "math"];

/// What only the application may do.
const OUTSIDE_WORLD: [&str; 10] = [
    "println!",
    "eprintln!",
    "print!",
    "eprint!",
    "dbg!",
    "std::env",
    "std::process",
    "std::fs",
    "stdin()",
    "stdout()",
];

/// Rooms that may do it.
const MAY_DO_IT: [&str; 2] = ["app", "main"];

/// Rooms that know the words of scene files.
const KNOW_WORDS: [&str; 2] = ["describe", "compile"];

/// A source file: its room and its text.
struct Source {
    room: String,
    path: String,
    text: String,
}

/// The same text with comments blanked out; the contents of strings too, if wanted. Lines stay where they are.
fn code(text: &str, keep_strings: bool) -> String {
    let bytes: Vec<char> = text.chars().collect();
    let mut out = String::new();
    let mut i = 0;
    let blank = |c: char| if c == '\n' { '\n' } else { ' ' };
    while i < bytes.len() {
        let rest = &bytes[i..];
        let end = match rest {
            ['/', '/', ..] => line_end(rest),
            ['/', '*', ..] => block_end(rest),
            ['r', '"' | '#', ..] if raw_string(rest).is_some() && !continues_a_word(&bytes, i) => {
                let (start, end) = raw_string(rest).expect("just seen");
                push_string(&mut out, &rest[..end], start, keep_strings);
                i += end;
                continue;
            }
            ['"', ..] => {
                let end = string_end(rest);
                push_string(&mut out, &rest[..end], 1, keep_strings);
                i += end;
                continue;
            }
            // A character, not a lifetime.
            ['\'', '\\', _, ..] => 3 + rest[3..].iter().position(|&c| c == '\'').unwrap_or(0) + 1,
            ['\'', _, '\'', ..] => 3,
            _ => {
                out.push(rest[0]);
                i += 1;
                continue;
            }
        };
        out.extend(rest[..end].iter().map(|&c| blank(c)));
        i += end;
    }
    out
}

fn continues_a_word(text: &[char], i: usize) -> bool {
    i > 0 && (text[i - 1].is_alphanumeric() || text[i - 1] == '_')
}

fn line_end(rest: &[char]) -> usize {
    rest.iter().position(|&c| c == '\n').unwrap_or(rest.len())
}

/// Comments nest.
fn block_end(rest: &[char]) -> usize {
    let (mut depth, mut i) = (0, 0);
    while i < rest.len() {
        match rest[i..] {
            ['/', '*', ..] => (depth, i) = (depth + 1, i + 2),
            ['*', '/', ..] => (depth, i) = (depth - 1, i + 2),
            _ => i += 1,
        }
        if depth == 0 {
            return i;
        }
    }
    rest.len()
}

fn string_end(rest: &[char]) -> usize {
    let mut i = 1;
    while i < rest.len() {
        match rest[i] {
            '\\' => i += 2,
            '"' => return i + 1,
            _ => i += 1,
        }
    }
    rest.len()
}

/// Where the contents of a raw string begin, and where the whole ends.
fn raw_string(rest: &[char]) -> Option<(usize, usize)> {
    let hashes = rest[1..].iter().take_while(|&&c| c == '#').count();
    let start = 1 + hashes + 1;
    if rest.get(start - 1) != Some(&'"') {
        return None;
    }
    let is_end = |i: &usize| {
        rest[*i] == '"'
            && rest[i + 1..]
                .iter()
                .take(hashes)
                .filter(|&&c| c == '#')
                .count()
                == hashes
    };
    let end = (start..rest.len()).find(is_end)?;
    Some((start, end + 1 + hashes))
}

fn push_string(out: &mut String, whole: &[char], start: usize, keep: bool) {
    for (i, &c) in whole.iter().enumerate() {
        let is_content = i >= start && i + start < whole.len();
        out.push(if is_content && !keep && c != '\n' {
            ' '
        } else {
            c
        });
    }
}

/// Names of the crate's rooms that the code mentions, with their lines: `crate::x` and `crate::{x, y::z}`.
fn rooms_mentioned(code: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '$') {
            continue;
        }
        let line = 1 + code[..at].matches('\n').count();
        let rest = code[at + "crate::".len()..].trim_start();
        if let Some(list) = rest.strip_prefix('{') {
            let mut depth = 0;
            let mut item = String::new();
            for c in list.chars() {
                match c {
                    '{' => depth += 1,
                    '}' if depth == 0 => break,
                    '}' => depth -= 1,
                    ',' if depth == 0 => found.push((line, first_word(&std::mem::take(&mut item)))),
                    _ if depth == 0 => item.push(c),
                    _ => {}
                }
            }
            found.push((line, first_word(&item)));
        } else {
            found.push((line, first_word(rest)));
        }
    }
    found.retain(|(_, room)| !room.is_empty());
    found
}

fn first_word(text: &str) -> String {
    let is_word = |c: &char| c.is_alphanumeric() || *c == '_';
    text.trim_start().chars().take_while(is_word).collect()
}

/// The code in front of the tests at the end of a file.
fn without_tests(code: &str) -> &str {
    code.split("#[cfg(test)]").next().unwrap_or(code)
}

fn order(room: &str) -> Option<usize> {
    ROOMS.iter().position(|r| *r == room)
}

/// Every way in which a source breaks the order; `words` are the words of scene files.
fn violations(source: &Source, words: &[String]) -> Vec<String> {
    let mut found = Vec::new();
    let code_only = code(&source.text, false);
    let mut report = |line: usize, what: String| {
        found.push(format!("{}:{line}: {what}", source.path));
    };
    let Some(own) = order(&source.room) else {
        report(
            1,
            format!("the room \"{}\" has no place in the order", source.room),
        );
        return found;
    };
    for (line, room) in rooms_mentioned(&code_only) {
        let Some(other) = order(&room) else {
            report(line, format!("\"{room}\" is no room"));
            continue;
        };
        let is_allowed = match source.room.as_str() {
            "describe" => DESCRIBE_KNOWS.contains(&room.as_str()),
            _ => other <= own,
        };
        if !is_allowed {
            report(
                line,
                format!("\"{}\" must not know \"{room}\"", source.room),
            );
        }
    }
    let own_code = without_tests(&code_only);
    let numbered = |text: &str, is_bad: &dyn Fn(&str) -> Option<String>| -> Vec<(usize, String)> {
        let lines = text.lines().enumerate();
        lines
            .filter_map(|(i, line)| is_bad(line).map(|what| (i + 1, what)))
            .collect()
    };
    for (line, what) in numbered(&code_only, &|line| {
        // Tests inside a module see what the module sees.
        let line = line.replace("use super::*;", "");
        let is_wildcard = ["::*;", "::*}", "::*,"]
            .iter()
            .any(|end| line.contains(end));
        is_wildcard.then(|| "wildcard import".to_owned())
    }) {
        report(line, what);
    }
    if !MAY_DO_IT.contains(&source.room.as_str()) {
        for (line, what) in numbered(own_code, &|line| {
            let word = OUTSIDE_WORLD.iter().find(|word| has_word(line, word))?;
            Some(format!("{word} below the application"))
        }) {
            report(line, what);
        }
    }
    if !KNOW_WORDS.contains(&source.room.as_str()) {
        let with_strings = code(&source.text, true);
        for (line, what) in numbered(without_tests(&with_strings), &|line| {
            let word = words
                .iter()
                .find(|word| line.contains(&format!("\"{word}\"")))?;
            Some(format!("\"{word}\" is a word of scene files"))
        }) {
            report(line, what);
        }
    }
    found
}

/// Whether a line holds a word that is not the end of a longer one.
fn has_word(line: &str, word: &str) -> bool {
    line.match_indices(word).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        !before.is_some_and(|c| c.is_alphanumeric() || c == '_')
    })
}

/// Names of plugins, except those that are also plain words.
fn scene_words() -> Vec<String> {
    use tyndall_parser::schema::Family;
    // Code may have reasons of its own to spell these.
    const COMMON: [&str; 5] = ["image", "none", "box", "path", "random"];
    Family::ALL
        .iter()
        .flat_map(|family| family.plugins())
        .map(|plugin| plugin.name.to_owned())
        .filter(|name| !COMMON.contains(&name.as_str()))
        .collect()
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    let mut pending = vec![root.clone()];
    while let Some(directory) = pending.pop() {
        for entry in std::fs::read_dir(directory).expect("a directory of sources") {
            let path: PathBuf = entry.expect("a readable entry").path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
        .into_iter()
        .map(|path| {
            let inner = path.strip_prefix(&root).expect("a file under src");
            let first = inner.components().next().expect("a file has a name");
            let room = first.as_os_str().to_string_lossy();
            Source {
                room: room.trim_end_matches(".rs").to_owned(),
                path: inner.display().to_string(),
                text: std::fs::read_to_string(&path).expect("sources are UTF-8"),
            }
        })
        .filter(|source| source.room != "lib")
        .collect()
}

#[test]
fn every_source_keeps_to_the_order_of_the_rooms() {
    let words = scene_words();
    let sources = sources();
    assert!(sources.len() > 50, "the sources were found");
    let found: Vec<String> = sources.iter().flat_map(|s| violations(s, &words)).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn every_room_is_declared_and_has_a_manual() {
    let sources = sources();
    for room in ROOMS {
        let paths = [format!("{room}.rs"), format!("{room}/mod.rs")];
        let source = sources.iter().find(|s| paths.contains(&s.path));
        let source = source.unwrap_or_else(|| panic!("the room \"{room}\" is missing"));
        assert!(
            source.text.starts_with("//!"),
            "{} has no manual",
            source.path
        );
    }
}

fn check(room: &str, text: &str) -> Vec<String> {
    let source = Source {
        room: room.to_owned(),
        path: format!("{room}.rs"),
        text: text.to_owned(),
    };
    violations(&source, &["trianglemesh".to_owned()])
}

#[test]
fn planted_violations_are_found() {
    let planted = [
        (
            "math",
            "use crate::world::World;",
            "must not know \"world\"",
        ),
        (
            "shape",
            "use crate::{ids::LightId, medium::{Medium, Grid}};",
            "must not know \"medium\"",
        ),
        (
            "world",
            "fn f() { crate::integrator::Path::new() }",
            "must not know \"integrator\"",
        ),
        ("render", "use crate::app::run;", "must not know \"app\""),
        (
            "describe",
            "use crate::spectrum::Rgb;",
            "must not know \"spectrum\"",
        ),
        ("film", "use crate::nowhere::X;", "is no room"),
        ("attic", "", "has no place"),
        (
            "film",
            "fn f() {\n    println!(\"x\");\n}",
            "film.rs:2: println! below",
        ),
        (
            "compile",
            "let home = std::env::var(\"HOME\");",
            "std::env below",
        ),
        ("render", "std::process::exit(1)", "std::process below"),
        (
            "shape",
            "match kind { \"trianglemesh\" => 1 }",
            "word of scene files",
        ),
        (
            "shape",
            "let kind = r#\"a\"#; if kind == \"trianglemesh\" {}",
            "word of scene files",
        ),
        ("light", "use crate::math::*;", "wildcard"),
        ("light", "use crate::math::{vector::*, Ray};", "wildcard"),
        (
            "math",
            "#[cfg(test)]\nmod tests { use crate::world::World; }",
            "must not know \"world\"",
        ),
    ];
    for (room, text, expected) in planted {
        let found = check(room, text);
        assert!(
            found.len() == 1 && found[0].contains(expected),
            "{room}: {text}: {found:?}"
        );
    }
}

#[test]
fn what_is_allowed_is_not_found() {
    let allowed = [
        (
            "world",
            "use crate::light::Light;\nuse crate::{ids::LightId, math::{Point3, Vec3}};",
        ),
        (
            "math",
            "/// See [`crate::world::World`].\n// crate::world, println!\nfn f() {}",
        ),
        (
            "math",
            "/* crate::world /* println! */ std::env */ fn f<'a>(c: &'a str) {}",
        ),
        (
            "film",
            "let text = \"crate::world println! std::env\"; let quote = '\"'; let x = \"\\\"\";",
        ),
        ("shape", "//! | `\"trianglemesh\"` |\nfn f() {}"),
        (
            "shape",
            "#[cfg(test)]\nmod tests { use super::*; fn f() { println!(\"trianglemesh\"); } }",
        ),
        ("compile", "match kind { \"trianglemesh\" => 1 }"),
        (
            "app",
            "println!(\"{}\", std::env::args().count()); std::process::exit(0)",
        ),
        (
            "sampling",
            "fn blueprint!() {} pub(in crate::sampling) fn f() {}",
        ),
    ];
    for (room, text) in allowed {
        let found = check(room, text);
        assert!(found.is_empty(), "{room}: {text}: {found:?}");
    }
}
