//! From `Texture` directives to sources: what is folded, what is read, what is reported.

use std::sync::{Arc, Mutex};

use glam::DVec3;
use tyndall_parser::source::{SourceBytes, Sources, Spanned};
use tyndall_parser::{NoIncludes, parse};
use tyndall_test_support::ptex;

use super::*;
use crate::compile::space::WorldBounds;
use crate::describe::describe;
use crate::image::Image;
use crate::image::codec::{ImageFile, Precision, encode};
use crate::math::{Point3, Vec3};
use crate::texture::TextureContext;

/// Files by name, and who was asked for.
struct Files {
    files: Vec<(&'static str, Vec<u8>)>,
    reads: Mutex<Vec<String>>,
}

impl Files {
    fn new(files: Vec<(&'static str, Vec<u8>)>) -> Self {
        let reads = Mutex::new(Vec::new());
        Self { files, reads }
    }

    fn reads(&self) -> Vec<String> {
        self.reads.lock().expect("no test panics in it").clone()
    }
}

impl Assets for Files {
    fn read(&self, path: &Spanned<String>) -> Result<SourceBytes, String> {
        self.reads
            .lock()
            .expect("no test panics in it")
            .push(path.value.clone());
        let file = self.files.iter().find(|(name, _)| *name == path.value);
        let (_, bytes) = file.ok_or("it is not there")?;
        Ok(Arc::new(bytes.clone()) as SourceBytes)
    }
}

fn pfm(width: usize, height: usize, data: &[f32]) -> Vec<u8> {
    encoded(width, height, data, "pfm")
}

fn encoded(width: usize, height: usize, data: &[f32], extension: &str) -> Vec<u8> {
    let channels = data.len() / width / height;
    let image = Image::new(width, height, channels, data.to_vec()).expect("a grid of samples");
    encode(&ImageFile::new(image), extension, Precision::Float).expect("a format that is written")
}

/// What became of the texture called `it`.
struct Outcome<V> {
    source: Option<Source<V>>,
    textures: Textures,
    skipped: usize,
    codes: Vec<&'static str>,
    space: RenderSpace,
}

/// Builds the last texture called `it` of a world, in a render space half as large as the world and moved by (1, 2, 3).
fn build<V: Kind>(world: &str, files: &Files) -> Outcome<V> {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", format!("WorldBegin {world} WorldEnd"));
    let (file, mut findings) = parse(&mut sources, root, &NoIncludes);
    let (scene, more) = describe(file);
    findings.extend(more);
    assert!(
        findings.list.iter().all(|finding| finding.code != "syntax"),
        "{findings:?}"
    );
    let mut frame = scene.frames.into_iter().next().expect("one frame");
    let mut bounds = WorldBounds::EMPTY;
    bounds.add(DVec3::new(1.0, 2.0, 3.0));
    bounds.add(DVec3::new(3.0, 3.0, 4.0));
    let space = RenderSpace::new(bounds, DVec3::ZERO);
    let mut builder = TextureBuilder::new(&mut frame, &space, files);
    let index = builder
        .entities
        .iter()
        .rposition(|texture| texture.name.value == "it" && texture.value_type == V::TYPE)
        .expect("a texture called it");
    let mut diagnostics = Diagnostics::default();
    let texture = TextureRef(u32::try_from(index).expect("few textures"));
    let source = builder.texture(texture, &mut diagnostics);
    Outcome {
        source,
        skipped: builder.skipped().len(),
        textures: builder.finish(),
        codes: diagnostics.list.iter().map(|d| d.code).collect(),
        space,
    }
}

impl<V: Kind> Outcome<V> {
    /// Its value at a point of the world with the given parameters.
    fn at(&self, world: [f64; 3], uv: [f32; 2]) -> V {
        let p = self.space.place(&crate::math::Transform::IDENTITY);
        let ctx = TextureContext {
            p: Point3::from_f64(p.point(DVec3::from(world))),
            uv,
            duv_dx: [0.0; 2],
            duv_dy: [0.0; 2],
            dp_dx: Vec3::ZERO,
            dp_dy: Vec3::ZERO,
            face: 0,
        };
        self.textures
            .evaluate(self.source.expect("it was built"), &ctx)
    }
}

#[track_caller]
fn float(world: &str) -> Outcome<f32> {
    let outcome = build(world, &Files::new(Vec::new()));
    assert!(outcome.codes.is_empty(), "{:?}", outcome.codes);
    outcome
}

#[track_caller]
fn assert_folds(world: &str, value: f32) {
    assert_eq!(
        float(world).source,
        Some(Source::Constant(value)),
        "{world}"
    );
}

/// A texture that varies.
const RAMP: &str =
    r#"Texture "ramp" "float" "bilerp" "float v00" 0 "float v01" 0 "float v10" 1 "float v11" 1 "#;

#[test]
fn constants_fold() {
    assert_folds(
        r#"Texture "it" "float" "constant" "float value" 0.25"#,
        0.25,
    );
    assert_folds(
        r#"Texture "it" "float" "scale" "float tex1" 3 "float tex2" 0.5"#,
        1.5,
    );
    assert_folds(
        r#"Texture "it" "float" "mix" "float tex1" 2 "float tex2" 4 "float amount" 0.25"#,
        2.5,
    );
    assert_folds(
        r#"Texture "it" "float" "bilerp" "float v00" 2 "float v01" 2 "float v10" 2 "float v11" 2"#,
        2.0,
    );
    assert_folds(
        r#"Texture "c" "float" "constant" "float value" 7
           Texture "it" "float" "checkerboard" "texture tex1" "c" "float tex2" 7"#,
        7.0,
    );
    assert_folds(
        r#"Texture "it" "float" "dots" "float inside" 7 "float outside" 7"#,
        7.0,
    );
}

#[test]
fn what_a_factor_of_0_or_an_amount_hides_is_not_built() {
    for (it, value) in [
        (r#""scale" "texture tex1" "ramp" "float tex2" 0"#, 0.0),
        (r#""scale" "float tex1" 0 "texture tex2" "ramp""#, 0.0),
        (
            r#""mix" "texture tex1" "ramp" "float tex2" 5 "float amount" 1"#,
            5.0,
        ),
        (
            r#""mix" "float tex1" 5 "texture tex2" "ramp" "float amount" 0"#,
            5.0,
        ),
    ] {
        assert_folds(&format!(r#"{RAMP} Texture "it" "float" {it}"#), value);
    }
}

#[test]
fn factors_of_1_and_equal_ends_are_seen_through() {
    for it in [
        r#""scale" "texture tex1" "ramp""#,
        r#""mix" "texture tex1" "ramp" "texture tex2" "ramp" "float amount" 0.3"#,
        r#""checkerboard" "texture tex1" "ramp" "texture tex2" "ramp""#,
    ] {
        let outcome = float(&format!(r#"{RAMP} Texture "it" "float" {it}"#));
        assert_eq!(outcome.at([0.0; 3], [0.25, 0.0]), 0.25, "{it}");
        // It is the ramp itself: nothing was added after it.
        let ramp = float(&RAMP.replace("\"ramp\"", "\"it\""));
        assert_eq!(outcome.source, ramp.source, "{it}");
    }
}

#[test]
fn an_image_of_one_colour_folds_unless_black_lies_around_it() {
    let files = || {
        Files::new(vec![
            ("one.pfm", pfm(1, 1, &[0.25])),
            ("flat.pfm", pfm(3, 2, &[0.5; 18])),
        ])
    };
    let image = |rest: &str| {
        build::<f32>(
            &format!(r#"Texture "it" "float" "imagemap" {rest}"#),
            &files(),
        )
        .source
    };
    let constant = |value| Some(Source::Constant(value));
    assert_eq!(image(r#""string filename" "one.pfm""#), constant(0.25));
    assert_eq!(
        image(r#""string filename" "flat.pfm" "float scale" 2"#),
        constant(1.0)
    );
    let black = image(r#""string filename" "one.pfm" "string wrap" "black""#);
    assert!(matches!(black, Some(Source::Texture(_))), "{black:?}");
}

#[test]
fn an_image_is_read_once_for_all_textures_with_its_settings() {
    let files = Files::new(vec![("a.pfm", pfm(2, 1, &[0.0, 1.0]))]);
    let world = r#"
        Texture "a" "float" "imagemap" "string filename" "a.pfm"
        Texture "b" "float" "imagemap" "string filename" "a.pfm" "float uscale" 4 "bool trilinear" "true"
        Texture "c" "float" "imagemap" "string filename" "a.pfm" "float scale" 2
        Texture "ab" "float" "mix" "texture tex1" "a" "texture tex2" "b"
        Texture "it" "float" "mix" "texture tex1" "ab" "texture tex2" "c""#;
    let outcome = build::<f32>(world, &files);
    assert!(outcome.codes.is_empty(), "{:?}", outcome.codes);
    assert_eq!(files.reads().len(), 2, "scale 1 and scale 2");
}

#[test]
fn files_that_nothing_can_reach_are_not_read() {
    let missing = r#"Texture "missing" "float" "imagemap" "string filename" "missing.exr" "#;
    let zero = r#"Texture "zero" "float" "scale" "float tex1" 0 "#;
    for it in [
        r#""constant" "float value" 1"#,
        r#""scale" "texture tex1" "missing" "float tex2" 0"#,
        r#""scale" "texture tex1" "missing" "texture tex2" "zero""#,
        r#""mix" "texture tex1" "missing" "float amount" 1"#,
    ] {
        let files = Files::new(Vec::new());
        let outcome = build::<f32>(
            &format!(r#"{missing} {zero} Texture "it" "float" {it}"#),
            &files,
        );
        assert_eq!(files.reads(), [""; 0], "{it}");
        assert!(outcome.codes.is_empty(), "{it}: {:?}", outcome.codes);
        assert!(outcome.skipped > 0, "{it}");
    }
    // The files are there to be asked for.
    let files = Files::new(Vec::new());
    let it = r#"Texture "it" "float" "scale" "texture tex1" "missing""#;
    let outcome = build::<f32>(&format!("{missing} {it}"), &files);
    assert_eq!(files.reads(), ["missing.exr"]);
    assert_eq!(outcome.codes, ["missing-file"]);
}

#[test]
fn a_missing_image_is_grey_after_gamma_and_scale() {
    for (name, expected) in [("missing.png", 0.428_082), ("missing.exr", 1.0)] {
        let world = format!(
            r#"Texture "it" "float" "imagemap" "string filename" "{name}" "float scale" 2"#
        );
        let outcome = build::<f32>(&world, &Files::new(Vec::new()));
        assert_eq!(outcome.codes, ["missing-file"]);
        let Some(Source::Constant(value)) = outcome.source else {
            panic!("{name} is the same everywhere");
        };
        assert!((value - expected).abs() < 1e-5, "{name}: {value}");
    }
}

#[test]
fn every_format_is_decoded_and_eight_bit_ones_are_linearised() {
    let ramp: Vec<f32> = (0..4).flat_map(|i| [i as f32 / 4.0; 3]).collect();
    let mut files = Vec::new();
    for name in ["a.pfm", "a.exr", "a.png", "a.TGA"] {
        let (_, extension) = name.split_once('.').expect("a dot");
        files.push((name, encoded(4, 1, &ramp, extension)));
    }
    let eight_bit = |format| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let codes = ramp
            .iter()
            .map(|&x| crate::image::srgb::to_byte(x))
            .collect();
        ::image::RgbImage::from_raw(4, 1, codes)
            .expect("4 pixels")
            .write_to(&mut bytes, format)
            .expect("memory suffices");
        bytes.into_inner()
    };
    files.push(("a.jpg", eight_bit(::image::ImageFormat::Jpeg)));
    // Radiance: linear values, here without compression; exponent 128 stands for 2^-8.
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 4\n".to_vec();
    for i in 0..4_u8 {
        hdr.extend([64 * i, 64 * i, 64 * i, 128]);
    }
    files.push(("a.hdr", hdr));
    for (name, _) in &files {
        let world = format!(r#"Texture "it" "spectrum" "imagemap" "string filename" "{name}""#);
        let outcome = build::<Rgb>(&world, &Files::new(files.clone()));
        assert!(outcome.codes.is_empty(), "{name}: {:?}", outcome.codes);
        for i in 0..4 {
            let expected = i as f32 / 4.0;
            let value = outcome.at([0.0; 3], [expected + 0.125, 0.5]).g();
            let tolerance = if *name == "a.jpg" { 0.03 } else { 0.004 };
            assert!(
                (value - expected).abs() < tolerance,
                "{name}: {value} at {i}"
            );
        }
    }
}

#[test]
fn gamma_said_wins_over_gamma_guessed() {
    let files = Files::new(vec![("a.pfm", pfm(2, 1, &[0.5, 1.0]))]);
    let world = r#"Texture "it" "float" "imagemap" "string filename" "a.pfm" "bool gamma" "true""#;
    let value = build::<f32>(world, &files).at([0.0; 3], [0.25, 0.5]);
    assert!((value - 0.214_041).abs() < 1e-5, "{value}");
}

#[test]
fn n11_impossible_texels_are_repaired_and_counted_but_heights_may_be_negative() {
    let texels = [f32::NAN, f32::INFINITY, -5.0, 2.0];
    let rgb: Vec<f32> = texels.iter().flat_map(|&x| [x; 3]).collect();
    let files = || {
        Files::new(vec![
            ("grey.pfm", pfm(4, 1, &texels)),
            ("rgb.pfm", pfm(4, 1, &rgb)),
        ])
    };
    let outcome = build::<Rgb>(
        r#"Texture "it" "spectrum" "imagemap" "string filename" "rgb.pfm""#,
        &files(),
    );
    assert_eq!(outcome.codes, ["bad-texels"]);
    let values = [0, 1, 2, 3].map(|i| outcome.at([0.0; 3], [0.25 * i as f32 + 0.125, 0.5]).r());
    assert_eq!(values, [0.0, 2.0, 0.0, 2.0]);
    let outcome = build::<f32>(
        r#"Texture "it" "float" "imagemap" "string filename" "grey.pfm""#,
        &files(),
    );
    assert_eq!(outcome.codes, ["bad-texels"]);
    let values = [0, 1, 2, 3].map(|i| outcome.at([0.0; 3], [0.25 * i as f32 + 0.125, 0.5]));
    assert_eq!(values, [0.0, 2.0, -5.0, 2.0]);
}

#[test]
fn the_bottom_row_of_a_file_is_t_0() {
    let files = Files::new(vec![("a.exr", encoded(1, 2, &[1.0, 0.0], "exr"))]);
    let world = r#"Texture "it" "float" "imagemap" "string filename" "a.exr""#;
    let outcome = build::<f32>(world, &files);
    assert_eq!(outcome.at([0.0; 3], [0.5, 0.25]), 0.0);
    assert_eq!(outcome.at([0.0; 3], [0.5, 0.75]), 1.0);
}

/// What (s, t) a mapping gives, shown as red and green.
fn mapped(before: &str, parameters: &str, world: [f64; 3]) -> [f32; 2] {
    let text = format!(r#"{before} Texture "it" "spectrum" "uv" {parameters}"#);
    let outcome = build::<Rgb>(&text, &Files::new(Vec::new()));
    assert!(outcome.codes.is_empty(), "{:?}", outcome.codes);
    let [s, t, _] = outcome.at(world, [0.25, 0.5]).to_array();
    [s, t]
}

#[track_caller]
fn assert_mapped(before: &str, parameters: &str, world: [f64; 3], expected: [f32; 2]) {
    let [s, t] = mapped(before, parameters, world);
    let [expected_s, expected_t] = expected;
    assert!(
        (s - expected_s).abs() < 1e-6 && (t - expected_t).abs() < 1e-6,
        "{before} {parameters}: ({s}, {t}) is not {expected:?}"
    );
}

#[test]
fn mappings_see_the_world_through_the_inverse_transform_and_planes_ignore_it() {
    // World (3, 2, 1) is (0, 2, 0) seen from the moved, stretched frame: direction +y.
    let before = "Translate 3 0 1 Scale 1 0.5 1";
    let p = [3.0, 1.0, 1.0];
    assert_mapped(
        "",
        r#""float uscale" 2 "float vdelta" 0.25"#,
        p,
        [0.5, 0.75],
    );
    assert_mapped(before, r#""string mapping" "spherical""#, p, [0.5, 0.25]);
    assert_mapped(before, r#""string mapping" "cylindrical""#, p, [0.75, 0.0]);
    let planar = r#""string mapping" "planar" "vector v1" [0.1 0 0] "vector v2" [0 0.25 0.25] "float udelta" 0.5"#;
    for before in ["", before] {
        assert_mapped(before, planar, p, [0.8, 0.5]);
    }
}

#[test]
fn a_mapping_that_does_not_exist_is_the_plain_one() {
    let text = r#"Texture "it" "spectrum" "uv" "string mapping" "cubic" "float uscale" 8"#;
    let outcome = build::<Rgb>(text, &Files::new(Vec::new()));
    assert_eq!(outcome.codes, ["unknown-choice"]);
    assert_eq!(outcome.at([0.0; 3], [0.25, 0.5]), Rgb::new(0.25, 0.5, 0.0));
}

#[test]
fn solid_textures_see_the_world_through_the_transform_itself() {
    let board = r#"Texture "it" "float" "checkerboard" "integer dimension" 3"#;
    for (before, p, expected) in [
        ("", [0.5, 0.5, 0.5], 1.0),
        ("", [1.5, 0.5, 0.5], 0.0),
        // Twice as many cubes, not half.
        ("Scale 2 2 2", [0.75, 0.25, 0.25], 0.0),
        ("Scale 2 2 2", [0.25, 0.25, 0.25], 1.0),
        ("Translate 1 0 0", [0.5, 0.5, 0.5], 0.0),
    ] {
        let outcome = float(&format!("{before} {board}"));
        assert_eq!(outcome.at(p, [0.0; 2]), expected, "{before} at {p:?}");
    }
}

#[test]
fn every_class_of_the_schema_is_built() {
    let files = Files::new(vec![("a.pfm", pfm(2, 1, &[0.0, 1.0]))]);
    for (family, value_type) in [
        (tyndall_parser::schema::Family::FloatTexture, "float"),
        (tyndall_parser::schema::Family::SpectrumTexture, "spectrum"),
    ] {
        let classes: Vec<&str> = family.plugins().iter().map(|p| p.name).collect();
        assert!(classes.len() > 10, "{classes:?}");
        for class in classes {
            let world =
                format!(r#"Texture "it" "{value_type}" "{class}" "string filename" "a.pfm""#);
            let (is_built, codes) = if value_type == "float" {
                let outcome = build::<f32>(&world, &files);
                (outcome.source.is_some(), outcome.codes)
            } else {
                let outcome = build::<Rgb>(&world, &files);
                (outcome.source.is_some(), outcome.codes)
            };
            assert!(is_built, "{value_type} {class}: {codes:?}");
            // The picture is no Ptex file.
            assert_eq!(codes.contains(&"bad-ptex"), class == "ptex", "{class}");
        }
    }
}

/// A file of two faces of one texel: 0.25 and 0.5 in every channel.
fn two_faces(channels: u16) -> Vec<u8> {
    let mut mesh = ptex::faces(&ptex::grid(2, 1, false), false);
    for (face, value) in mesh.iter_mut().zip([0.25, 0.5]) {
        face.samples = vec![value; channels.into()];
    }
    ptex::PtexWriter::new(false, ptex::DataType::Float, channels, mesh).encode()
}

#[test]
fn a_ptex_file_serves_all_textures_that_name_it() {
    let files = Files::new(vec![("fur.ptx", two_faces(3))]);
    let world = r#"Texture "a" "spectrum" "ptex" "string filename" "fur.ptx" "float gamma" 1
        Texture "b" "spectrum" "ptex" "string filename" "fur.ptx" "float gamma" 3
        Texture "it" "spectrum" "scale" "texture tex1" "a" "texture tex2" "b""#;
    let outcome = build::<Rgb>(world, &files);
    assert_eq!(outcome.codes, [""; 0]);
    assert_eq!(files.reads(), ["fur.ptx"]);
    let value = outcome.at([0.0; 3], [0.0, 0.5]);
    assert!((value - Rgb::splat(0.25f32.powi(4))).max_component().abs() < 1e-6);
}

#[test]
fn ptex_files_that_cannot_be_shown_are_black() {
    let files = Files::new(vec![
        ("two.ptx", two_faces(2)),
        ("text.ptx", b"Ptex?".to_vec()),
    ]);
    for (name, code) in [
        ("two.ptx", "unsupported"),
        ("text.ptx", "bad-ptex"),
        ("none.ptx", "missing-file"),
    ] {
        let world = format!(r#"Texture "it" "float" "ptex" "string filename" "{name}""#);
        let outcome = build::<f32>(&world, &files);
        assert_eq!(outcome.codes, [code], "{name}");
        assert_eq!(outcome.source, Some(Source::Constant(0.0)), "{name}");
    }
}

/// `n` textures, each around the one before.
fn chain(n: usize, link: impl Fn(&str, &str) -> String) -> String {
    let mut world = RAMP.replace("\"ramp\"", "\"t0\"");
    for i in 1..=n {
        let name = if i == n {
            "it".to_owned()
        } else {
            format!("t{i}")
        };
        world += &link(&name, &format!("t{}", i - 1));
        world += "\n";
    }
    world
}

#[test]
fn deep_chains_are_refused_where_they_get_too_deep_and_neither_overflow_nor_take_long() {
    let half = |name: &str, inner: &str| {
        format!(r#"Texture "{name}" "float" "scale" "texture tex1" "{inner}" "float tex2" 0.5"#)
    };
    let outcome = float(&chain(63, half));
    assert_eq!(outcome.at([0.0; 3], [1.0, 0.0]), 0.5f32.powi(63));
    for n in [64, 100_000] {
        let outcome = build::<f32>(&chain(n, half), &Files::new(Vec::new()));
        assert_eq!(outcome.source, None);
        assert_eq!(outcome.codes, ["deep-texture"], "{n}");
    }
}

#[test]
fn textures_that_double_their_look_ups_are_refused() {
    let square = |name: &str, inner: &str| {
        format!(
            r#"Texture "{name}" "float" "scale" "texture tex1" "{inner}" "texture tex2" "{inner}""#
        )
    };
    assert!(float(&chain(10, square)).source.is_some());
    let outcome = build::<f32>(&chain(60, square), &Files::new(Vec::new()));
    assert_eq!(outcome.codes, ["deep-texture"]);
}

#[test]
fn a_texture_that_names_itself_means_the_one_before_or_none() {
    let it = r#"Texture "it" "float" "scale" "texture tex1" "it" "float tex2" 0.5"#;
    // None before: the plugin's default, 1.
    let outcome = build::<f32>(it, &Files::new(Vec::new()));
    assert_eq!(outcome.source, Some(Source::Constant(0.5)));
    assert_eq!(outcome.codes, ["unknown-texture"]);
    let before = r#"Texture "it" "float" "constant" "float value" 6"#;
    assert_folds(&format!("{before} {it}"), 3.0);
}

#[test]
fn m12_parameters_that_make_a_texture_flat_are_announced() {
    for (parameters, value) in [
        (r#""dots" "float uscale" 0"#, 1.0),
        (r#""checkerboard" "float vscale" 0"#, 1.0),
        (
            r#""checkerboard" "string mapping" "planar" "vector v1" [0 0 0]"#,
            1.0,
        ),
    ] {
        let world = format!(r#"Texture "it" "float" {parameters}"#);
        let outcome = build::<f32>(&world, &Files::new(Vec::new()));
        assert_eq!(outcome.codes, ["flat-texture"], "{parameters}");
        assert_eq!(outcome.at([0.25; 3], [0.25, 0.25]), value, "{parameters}");
    }
}

#[test]
fn bad_values_are_reported_and_replaced() {
    for (parameters, code) in [
        (
            r#""scale" "float tex1" 1e30 "float tex2" 1e30"#,
            "bad-texture",
        ),
        (r#""checkerboard" "integer dimension" 4"#, "unknown-choice"),
        (r#""fbm" "integer octaves" -3"#, "out-of-range"),
        (r#""fbm" "integer octaves" 1000000000"#, "out-of-range"),
        (r#""imagemap""#, "missing-parameter"),
    ] {
        let world = format!(r#"Texture "it" "float" {parameters}"#);
        let outcome = build::<f32>(&world, &Files::new(Vec::new()));
        assert_eq!(outcome.codes, [code], "{parameters}");
    }
}

#[test]
fn every_way_to_write_a_spectrum_ends_in_the_same_colours() {
    let files = || Files::new(vec![("flat.spd", b"400 1\n700 1\n".to_vec())]);
    let flat = [1.20233, 0.94622, 0.90734];
    for (value, expected) in [
        (r#""rgb value" [0.1 0.2 -0.3]"#, [0.1, 0.2, -0.3]),
        (r#""color value" [0.1 0.2 0.3]"#, [0.1, 0.2, 0.3]),
        (r#""xyz value" [1 1 1]"#, [1.20479, 0.94829, 0.90892]),
        (r#""blackbody value" [6500 2]"#, [1.84444, 1.739, 1.83044]),
        (r#""spectrum value" [400 1 700 1]"#, flat),
        (r#""spectrum value" "flat.spd""#, flat),
    ] {
        let world = format!(r#"Texture "it" "spectrum" "constant" {value}"#);
        let outcome = build::<Rgb>(&world, &files());
        assert!(outcome.codes.is_empty(), "{value}: {:?}", outcome.codes);
        let Some(Source::Constant(rgb)) = outcome.source else {
            panic!("{value} is a constant");
        };
        for (channel, expected) in rgb.to_array().into_iter().zip(expected) {
            assert!((channel - expected).abs() < 2e-5, "{value}: {rgb:?}");
        }
    }
    for value in [
        r#""spectrum value" [400 1 400 2]"#,
        r#""spectrum value" "missing.spd""#,
    ] {
        let world = format!(r#"Texture "it" "spectrum" "constant" {value}"#);
        let outcome = build::<Rgb>(&world, &files());
        assert_eq!(
            outcome.source,
            Some(Source::Constant(Rgb::BLACK)),
            "{value}"
        );
        assert_eq!(outcome.codes.len(), 1, "{value}: {:?}", outcome.codes);
    }
}
