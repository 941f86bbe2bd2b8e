//! Small scenes with what must come out of them: `ok/*.pbrt` beside `*.ast`, `err/*.pbrt` beside `*.diag`.
//!
//! `UPDATE_EXPECT=1 cargo test -p tyndall-parser --test corpus` rewrites the expectations; read the difference.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tyndall_parser::diagnostic::Style;
use tyndall_parser::{
    Diagnostics, FileId, LoadError, Loaded, NoIncludes, SceneFile, Sources, Span, parse, parse_all,
    print,
};

/// Reads files of one directory. The top-level name says nothing here, as all scenes lie in that directory.
fn loader(directory: &Path) -> impl Fn(&str, &str) -> Result<Loaded, LoadError> {
    let directory = directory.to_path_buf();
    move |path: &str, _: &str| match fs::read(directory.join(path)) {
        Ok(bytes) => Ok(Loaded {
            name: path.to_owned(),
            bytes: Arc::new(bytes),
        }),
        Err(_) => Err(LoadError::new("no such file")),
    }
}

/// Directives with the source text of their places: `#` lines for places, the canonical text between them.
fn tree(scene: &SceneFile, sources: &Sources) -> String {
    let mut text = String::new();
    let quote = |span: Span| {
        String::from_utf8_lossy(sources.text(span))
            .escape_debug()
            .to_string()
    };
    for directive in &scene.directives {
        let (place, extent) = (sources.place(directive.span), quote(directive.span));
        let parts = directive.value.parts();
        writeln!(text, "# {place}: {extent}").unwrap();
        for string in parts.strings {
            writeln!(text, "#   string {}", quote(string.span)).unwrap();
        }
        for param in parts.params.into_iter().flatten() {
            writeln!(
                text,
                "#   param {} value {}",
                quote(param.decl_span),
                quote(param.value_span)
            )
            .unwrap();
        }
        writeln!(text, "{}", directive.value).unwrap();
    }
    text
}

/// Compares with the file at `path`, or rewrites it when `UPDATE_EXPECT` is set; says what differs.
fn compare(path: &Path, found: &str) -> Result<(), String> {
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(path, found).unwrap();
        return Ok(());
    }
    let expected = fs::read_to_string(path).unwrap_or_default();
    if expected == found {
        return Ok(());
    }
    Err(format!(
        "{}\n--- expected\n{expected}\n--- found\n{found}",
        path.display()
    ))
}

/// Parses every scene of a directory and checks what `describe` says of it against the file beside it.
fn check(
    directory: &str,
    extension: &str,
    describe: impl Fn(&SceneFile, &Diagnostics, &Sources) -> String,
) {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/corpus")
        .join(directory);
    let mut paths: Vec<PathBuf> = fs::read_dir(&directory)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    paths.retain(|path| {
        path.extension()
            .is_some_and(|extension| extension == "pbrt")
    });
    paths.sort();
    assert!(!paths.is_empty());
    let mut faults = Vec::new();
    for path in paths {
        let mut sources = Sources::new();
        let name = path.file_name().unwrap().to_string_lossy();
        let file = sources.add_text(name, fs::read(&path).unwrap());
        let (scene, found) = parse(&mut sources, file, &loader(&directory));
        faults.extend(
            compare(
                &path.with_extension(extension),
                &describe(&scene, &found, &sources),
            )
            .err(),
        );
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn accepted_scenes_give_their_directives_places_and_warnings() {
    check("ok", "ast", |scene, found, sources| {
        let warnings = found.render(sources, Style::Plain);
        assert!(!found.has_errors(), "{warnings}");
        tree(scene, sources) + if found.is_empty() { "" } else { "\n" } + &warnings
    });
}

#[test]
fn faulty_scenes_give_their_findings() {
    check("err", "diag", |_, found, sources| {
        let text = found.render(sources, Style::Plain);
        assert!(found.has_errors(), "{text}");
        text
    });
}

#[test]
fn faulty_scenes_keep_the_directives_around_the_fault() {
    let mut sources = Sources::new();
    let text = "Identity Shpae \"s\" Scale 1 1 1 Translate x Shape \"t\" \"float a\" [1 q] \"float b\" 2 WorldEnd";
    let file = sources.add_text("a", text);
    let (scene, found) = parse(&mut sources, file, &NoIncludes);
    assert_eq!(found.counts().fatal, 3);
    let kept: Vec<String> = scene
        .directives
        .iter()
        .map(|directive| directive.value.to_string())
        .collect();
    assert_eq!(
        kept,
        [
            "Identity",
            "Scale 1 1 1",
            "Shape \"t\"\n    \"float b\" [2]",
            "WorldEnd"
        ]
    );
}

#[test]
fn several_top_level_files_are_one_scene_but_lists_end_with_their_file() {
    let mut sources = Sources::new();
    let files: Vec<FileId> = ["Shape \"a\"", "\"float radius\" 1", "Include \"x\""]
        .iter()
        .map(|text| sources.add_text(*text, *text))
        .collect();
    let names = std::cell::RefCell::new(Vec::new());
    let load = |path: &str, top_level: &str| {
        names.borrow_mut().push(format!("{path} for {top_level}"));
        Ok(Loaded {
            name: "x".into(),
            bytes: Arc::new(b"Identity".to_vec()),
        })
    };
    let (scene, found) = parse_all(&mut sources, &files, &load);
    assert_eq!(print(&scene), "Shape \"a\"\nIdentity\n");
    assert_eq!(
        found.iter().map(|fault| fault.code).collect::<Vec<_>>(),
        ["unexpected-token"]
    );
    assert_eq!(names.into_inner(), ["x for Include \"x\""]);
    assert_eq!(sources.top_level(scene.directives[1].span.file), files[2]);
}
