//! What must hold for any input: no panic, bounded time and memory, and a round trip through the printed text.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use std::{fs, io};

use proptest::collection::vec;
use proptest::prelude::{Just, ProptestConfig, Strategy, any, prop_oneof};
use proptest::sample::{Index, select};
use proptest::{prop_assert, proptest};
use tyndall_parser::diagnostic::Style;
use tyndall_parser::directive::{ActiveTransform, Plugin};
use tyndall_parser::params::{Param, ParamList, ParamValue};
use tyndall_parser::{
    Diagnostics, Directive, FileId, LoadError, Loaded, NoIncludes, SceneFile, Sources, Span,
    Spanned, parse, print,
};

/// So many cases, or as many as `PROPTEST_CASES` says.
fn cases(cases: u32) -> ProptestConfig {
    let default = ProptestConfig::default();
    let cases = if std::env::var_os("PROPTEST_CASES").is_some() {
        default.cases
    } else {
        cases
    };
    ProptestConfig {
        cases,
        failure_persistence: None,
        ..default
    }
}

/// A directory of scenes of the benchmark set, if it is there.
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
fn scenes() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scenes");
    if !path.is_dir() {
        println!("skipped: {} is not there", path.display());
    }
    path.is_dir().then_some(path)
}

/// Every file below `directory` whose name ends with `.pbrt`.
fn pbrt_files(directory: &Path, found: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(directory)? {
        let path = entry?.path();
        if path.is_dir() {
            pbrt_files(&path, found)?;
        } else if path
            .extension()
            .is_some_and(|extension| extension == "pbrt")
        {
            found.push(path);
        }
    }
    found.sort();
    Ok(())
}

fn read(text: impl Into<Vec<u8>>) -> (SceneFile, Diagnostics, Sources) {
    let mut sources = Sources::new();
    let file = sources.add_text("test.pbrt", text);
    let (scene, found) = parse(&mut sources, file, &NoIncludes);
    (scene, found, sources)
}

/// Parses and renders everything there is to say: neither may panic, and whatever was understood must print.
fn survives(bytes: &[u8]) {
    let (scene, found, sources) = read(bytes);
    let text = found.render(&sources, Style::Coloured);
    assert_eq!(text.is_empty(), found.is_empty());
    for directive in &scene.directives {
        assert!(directive.span.lo < directive.span.hi && directive.span.hi as usize <= bytes.len());
    }
    let (again, found_again, _) = read(print(&scene));
    assert!(!found_again.has_fatal(), "{}", print(&scene));
    assert!(again.says_the_same(&scene), "{}", print(&scene));
}

#[test]
fn the_judge_of_round_trips_sees_every_kind_of_difference() {
    let base = r#"Translate 1 2 3 MediumInterface "a" Shape "s" "float f" [1 2] "string t" "x" ActiveTransform All"#;
    for (from, to) in [
        ("1 2 3", "1 2 4"),
        ("1 2 3", "1 2 nan"),
        ("\"a\"", "\"a\" \"a\""),
        ("\"a\"", "\"b\""),
        ("[1 2]", "[1]"),
        ("[1 2]", "[1 -2]"),
        ("float f", "float g"),
        ("float f", "integer f"),
        ("\"x\"", "\"y\""),
        ("All", "EndTime"),
        ("Translate", "Scale"),
        ("ActiveTransform All", ""),
    ] {
        let other = base.replacen(from, to, 1);
        assert!(
            !read(base).0.says_the_same(&read(other.as_str()).0),
            "{from} and {to}"
        );
    }
    let spread = base
        .replace(' ', "\n ")
        .replace("\"float\n f\"", "\"float f\"")
        .replace("\"string\n t\"", "\"string t\"");
    assert!(
        read(base).0.says_the_same(&read(spread).0),
        "only the places differ"
    );
}

#[test]
fn every_scene_of_the_set_parses_without_a_word_and_round_trips() {
    let Some(directory) = scenes() else { return };
    let mut paths = Vec::new();
    pbrt_files(&directory, &mut paths).unwrap();
    assert!(!paths.is_empty());
    for path in paths {
        let base = path.parent().unwrap().to_path_buf();
        let load = |name: &str, _: &str| match fs::read(base.join(name)) {
            Ok(bytes) => Ok(Loaded {
                name: name.to_owned(),
                bytes: Arc::new(bytes),
            }),
            Err(error) => Err(LoadError::new(error.to_string())),
        };
        let mut sources = Sources::new();
        let file = sources.add_text(path.display().to_string(), fs::read(&path).unwrap());
        let (scene, found) = parse(&mut sources, file, &load);
        // Fragments that are included from elsewhere miss their own includes, which start at the top-level directory.
        let faults = found
            .iter()
            .filter(|diagnostic| diagnostic.code != "missing-include")
            .count();
        assert!(faults == 0, "{}", found.render(&sources, Style::Plain));
        let (again, found, again_sources) = read(print(&scene));
        assert!(
            found.is_empty(),
            "{}",
            found.render(&again_sources, Style::Plain)
        );
        assert!(again.says_the_same(&scene), "{}", path.display());
    }
}

fn spanned(value: String) -> Spanned<String> {
    Spanned::new(value, Span::new(FileId(0), 0, 0))
}

fn string() -> impl Strategy<Value = Spanned<String>> {
    prop_oneof!["[a-z]{0,8}", r#"[\PC\n\r\t"\\'\x08\x0c\x01 \[\]#]{0,12}"#].prop_map(spanned)
}

/// Numbers an argument can have: integers up to the largest, and single precision.
fn double() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<f32>().prop_map(f64::from),
        (0..i64::MAX).prop_map(|n| n as f64),
        (-9..9_i32).prop_map(f64::from)
    ]
}

fn doubles<const N: usize>() -> impl Strategy<Value = [f64; N]> {
    vec(double(), N).prop_map(|values| std::array::from_fn(|i| values[i]))
}

fn float() -> impl Strategy<Value = f32> {
    prop_oneof![
        any::<u32>().prop_map(f32::from_bits),
        (-100..100_i16).prop_map(|n| f32::from(n) / 4.0)
    ]
}

fn tuples<const N: usize>() -> impl Strategy<Value = Vec<[f32; N]>> {
    let tuple = vec(float(), N).prop_map(|values| std::array::from_fn(|i| values[i]));
    vec(tuple, 0..20)
}

fn integer() -> impl Strategy<Value = i32> {
    // Negative integers are read in single precision.
    prop_oneof![0..i32::MAX, (-(1 << 24)..0), Just(i32::MIN)]
}

fn value() -> impl Strategy<Value = ParamValue> {
    let strings = || vec(string().prop_map(|string| string.value), 1..4);
    prop_oneof![
        vec(integer(), 0..40).prop_map(ParamValue::Integer),
        vec(float(), 0..40).prop_map(ParamValue::Float),
        vec(any::<bool>(), 1..4).prop_map(ParamValue::Bool),
        strings().prop_map(ParamValue::String),
        string().prop_map(|string| ParamValue::Texture(string.value)),
        tuples().prop_map(ParamValue::Point2),
        tuples().prop_map(ParamValue::Vector2),
        tuples().prop_map(ParamValue::Point3),
        tuples().prop_map(ParamValue::Vector3),
        tuples().prop_map(ParamValue::Normal),
        tuples().prop_map(ParamValue::Rgb),
        tuples().prop_map(ParamValue::Xyz),
        tuples().prop_map(ParamValue::Blackbody),
        tuples().prop_map(ParamValue::Spectrum),
        strings().prop_map(ParamValue::SpectrumFiles),
    ]
}

fn plugin() -> impl Strategy<Value = Plugin> {
    let nowhere = Span::new(FileId(0), 0, 0);
    let param = ("[^ \t\"\\\\\n]{1,6}", value()).prop_map(move |(name, value)| Param {
        name,
        value,
        decl_span: nowhere,
        value_span: nowhere,
    });
    (string(), vec(param, 0..6)).prop_map(|(name, written)| Plugin {
        name,
        params: ParamList::from_written(written),
    })
}

fn directive() -> impl Strategy<Value = Directive> {
    let transform = prop_oneof![
        doubles().prop_map(Directive::Translate),
        doubles().prop_map(Directive::Scale),
        (double(), doubles()).prop_map(|(degrees, axis)| Directive::Rotate { degrees, axis }),
        (doubles(), doubles(), doubles()).prop_map(|(eye, target, up)| Directive::LookAt {
            eye,
            target,
            up
        }),
        doubles().prop_map(Directive::Transform),
        doubles().prop_map(Directive::ConcatTransform),
        doubles().prop_map(Directive::TransformTimes),
        select(vec![
            ActiveTransform::All,
            ActiveTransform::StartTime,
            ActiveTransform::EndTime
        ])
        .prop_map(Directive::ActiveTransform),
    ];
    let bare = select(vec![
        Directive::Identity,
        Directive::WorldBegin,
        Directive::WorldEnd,
        Directive::AttributeBegin,
        Directive::AttributeEnd,
        Directive::TransformBegin,
        Directive::TransformEnd,
        Directive::ReverseOrientation,
        Directive::ObjectEnd,
    ]);
    let named = prop_oneof![
        string().prop_map(Directive::CoordinateSystem),
        string().prop_map(Directive::CoordSysTransform),
        string().prop_map(Directive::ObjectBegin),
        string().prop_map(Directive::ObjectInstance),
        (string(), proptest::option::of(string()))
            .prop_map(|(inside, outside)| Directive::MediumInterface { inside, outside }),
    ];
    let makers: Vec<fn(Plugin) -> Directive> = vec![
        Directive::PixelFilter,
        Directive::Film,
        Directive::Sampler,
        Directive::Accelerator,
        Directive::Integrator,
        Directive::Camera,
        Directive::MakeNamedMedium,
        Directive::Material,
        Directive::MakeNamedMaterial,
        Directive::LightSource,
        Directive::AreaLightSource,
        Directive::Shape,
    ];
    let plugins = prop_oneof![
        (select(makers), plugin()).prop_map(|(make, plugin)| make(plugin)),
        (string(), string(), plugin()).prop_map(|(name, value_type, class)| Directive::Texture {
            name,
            value_type,
            class
        }),
    ];
    prop_oneof![transform, bare, named, plugins]
}

/// Pieces of scene files, whole and broken.
const PIECES: [&str; 42] = [
    "Shape",
    "Include",
    "\"a\"",
    "Transform",
    "Translate",
    "LookAt",
    "[",
    "]",
    "\"float a\"",
    "\"integer b\"",
    "\"rgb c\"",
    "\"spectrum d\"",
    "\"bool e\"",
    "\"texture f\"",
    "\"point3 g\"",
    "\"string h\"",
    "1",
    "-2.5",
    "1e400",
    "nan",
    "0x1p3",
    "1,5",
    "true",
    "\"true\"",
    "\"",
    "\\",
    "#",
    "\n",
    "\r\n",
    "\0",
    "\u{feff}",
    "WorldBegin",
    "WorldEnd",
    "Worldend",
    "MediumInterface",
    "ActiveTransform",
    "All",
    "Texture",
    "\"\\q\"",
    "\"\\",
    "NamedMaterial",
    "\"  \"",
];

proptest! {
    #![proptest_config(cases(2000))]

    #[test]
    fn printed_directives_read_back_as_themselves(directives in vec(directive(), 0..8)) {
        let nowhere = Span::new(FileId(0), 0, 0);
        let directives = directives.into_iter().map(|directive| Spanned::new(directive, nowhere)).collect();
        let scene = SceneFile { directives };
        let text = print(&scene);
        let (again, found, sources) = read(text.as_str());
        prop_assert!(found.is_empty(), "{text}\n{}", found.render(&sources, Style::Plain));
        prop_assert!(again.says_the_same(&scene), "{text}\n{again:?}");
        prop_assert!(print(&again) == text, "printing is not stable");
    }

    #[test]
    fn arbitrary_bytes_are_survived(bytes in vec(any::<u8>(), 0..300)) {
        survives(&bytes);
    }

    #[test]
    fn arbitrary_pieces_are_survived(pieces in vec((select(PIECES.to_vec()), select(vec!["", " ", "\n"])), 0..60)) {
        let text: String = pieces.into_iter().flat_map(|(piece, gap)| [piece, gap]).collect();
        survives(text.as_bytes());
    }

    #[test]
    fn mutated_scenes_are_survived(
        directives in vec(directive(), 1..5),
        edits in vec((any::<Index>(), any::<Index>(), select(PIECES.to_vec()), any::<u8>()), 1..5),
    ) {
        let nowhere = Span::new(FileId(0), 0, 0);
        let directives = directives.into_iter().map(|directive| Spanned::new(directive, nowhere)).collect();
        let mut bytes = print(&SceneFile { directives }).into_bytes();
        for (at, to, piece, byte) in edits {
            let (at, to) = (at.index(bytes.len() + 1), to.index(bytes.len() + 1));
            match byte % 4 {
                0 => bytes.truncate(at),
                1 => drop(bytes.splice(at.min(to)..at.max(to), piece.bytes())),
                2 => drop(bytes.splice(at..at, piece.bytes())),
                _ => bytes.get_mut(at).into_iter().for_each(|target| *target = byte),
            }
        }
        survives(&bytes);
    }
}

proptest! {
    #![proptest_config(cases(2000))]

    #[test]
    fn arbitrary_pieces_in_files_that_include_each_other_are_survived(
        files in vec(vec(select([&PIECES[..], &["Include \"0\"", "Include \"1\"", "Include \"2\"", "Include \"3\""]].concat()), 0..20), 3),
    ) {
        let texts: Vec<String> = files.into_iter().map(|pieces| pieces.join(" ")).collect();
        let load = |name: &str, _: &str| match name.parse().ok().and_then(|i: usize| texts.get(i)) {
            Some(text) => Ok(Loaded { name: name.to_owned(), bytes: Arc::new(text.clone().into_bytes()) }),
            None => Err(LoadError::new("there is no such file")),
        };
        let mut sources = Sources::new();
        let file = sources.add_text("0", texts[0].as_str());
        let (scene, found) = parse(&mut sources, file, &load);
        found.render(&sources, Style::Plain);
        let (again, _, _) = read(print(&scene));
        prop_assert!(again.says_the_same(&scene));
    }
}

/// Runs `work` and demands that it takes no longer than hostile input of a few megabytes may.
#[track_caller]
fn in_time(work: impl FnOnce()) {
    let start = Instant::now();
    work();
    assert!(
        start.elapsed() < Duration::from_secs(10),
        "{:?}",
        start.elapsed()
    );
}

#[test]
fn hostile_texts_take_linear_time_and_few_words() {
    let n = 1_000_000;
    let texts = [
        "[".repeat(n),
        "]".repeat(n),
        "\"".repeat(n),
        "\"a\n".repeat(n),
        "#\n".repeat(n),
        "Shpae ".repeat(n),
        "x".repeat(4 * n),
        "9".repeat(4 * n),
        format!("Shape \"s\" \"float a\" {}", "[".repeat(n)),
        format!("Shape \"s\" \"float a\" [{}", "[ ".repeat(n)),
        format!("Shape \"s\" \"float a\" [{}", "1,5 ".repeat(n)),
        format!("Shape \"s\" \"float a\" [{}]", "x ".repeat(n)),
        format!("Shape \"s\" \"float a\" [{}]", "\"b\" ".repeat(n)),
        format!("Shape \"s\" \"float a\" [{}]", "1 \"float b\" [".repeat(n)),
        format!("Shape \"s\" {}", "\"float a\" 1 ".repeat(n)),
        format!("Shape \"s\" {}", "\"bool a\" \"x\" ".repeat(n)),
        format!("Shape \"s\" {}", "\"nonsense a\" 1 ".repeat(n)),
        format!(
            "Shape \"s\" {}",
            (0..n / 4)
                .map(|i| format!("\"float a{i}\" {i} "))
                .collect::<String>()
        ),
        format!("Shape \"{}\"", "\\q".repeat(n)),
        format!("Shape \"s\" \"{} a\" 1", "y".repeat(n)),
        "Include \"a\"\n".repeat(n / 4),
        "AttributeBegin\n".repeat(n / 4),
        "Translate 1\n".repeat(n / 4),
    ];
    for text in texts {
        in_time(|| {
            let (scene, found, sources) = read(text.as_str());
            assert!(found.len() < 300, "{}", found.len());
            let shown = found.render(&sources, Style::Plain);
            assert!(shown.len() < 300_000, "{}", shown.len());
            assert!(scene.directives.len() <= text.len());
        });
    }
}

/// A loader that makes up each file from its name.
fn made_up(make: impl Fn(&str) -> String) -> impl Fn(&str, &str) -> Result<Loaded, LoadError> {
    move |name: &str, _: &str| {
        Ok(Loaded {
            name: name.to_owned(),
            bytes: Arc::new(make(name).into_bytes()),
        })
    }
}

#[test]
fn endless_chains_of_includes_end() {
    in_time(|| {
        let deeper = made_up(|name| format!("Include \"{}\"", name.len().to_string() + name));
        let mut sources = Sources::new();
        let file = sources.add_text("root", "Include \"a\"");
        let (_, found) = parse(&mut sources, file, &deeper);
        assert_eq!(
            found
                .iter()
                .map(|diagnostic| diagnostic.code)
                .collect::<Vec<_>>(),
            ["too-many-includes"]
        );
        assert!(found.render(&sources, Style::Plain).len() < 100_000);
    });
}

#[test]
fn includes_that_double_at_each_level_end() {
    in_time(|| {
        let doubling = made_up(|name| {
            let level: u32 = name.parse().unwrap_or(0);
            format!("# {level}\nInclude \"{0}\" Include \"{0}\"", level + 1).replace("40", "x")
        });
        let mut sources = Sources::new();
        let file = sources.add_text("root", "Include \"0\"");
        let (_, found) = parse(&mut sources, file, &doubling);
        assert!(found.has_fatal() && found.len() < 200);
    });
}
