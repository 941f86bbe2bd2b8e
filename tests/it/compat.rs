//! What `docs/compat.md` promises: its rows name tests, loading says where pbrt-v3's own light sampling is biased, and
//! rows that belong to no other subject hold.

use std::f64::consts::PI;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::common::findings::findings;
use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::scene::compile_scene;
use crate::common::seen::{environment, seen_by};
use tyndall::compile::CompileOptions;
use tyndall::render::{Unwatched, render};

/// The columns of every table of the page.
const COLUMNS: &str = "| pbrt-v3 | Tyndall | seen as | ratio | test |";

/// What is wrong with the tables of a page: rows that lack a cell, and tests that do not exist. `read` gives the text of
/// a file by its path from the root.
fn faults(page: &str, read: impl Fn(&str) -> Option<String>) -> Vec<String> {
    let mut faults = Vec::new();
    let mut columns = "";
    for line in page.lines() {
        if !line.starts_with('|') {
            columns = "";
        } else if columns.is_empty() {
            columns = line;
            if line != COLUMNS {
                faults.push(format!("columns: {line}"));
            }
        } else if !line.starts_with("|---") {
            faults.extend(faults_of_row(line, &read));
        }
    }
    faults
}

fn faults_of_row(row: &str, read: &impl Fn(&str) -> Option<String>) -> Vec<String> {
    let inner = row.strip_prefix("| ").unwrap_or(row);
    let inner = inner.strip_suffix(" |").unwrap_or(inner);
    let cells: Vec<&str> = inner.split(" | ").map(str::trim).collect();
    if cells.len() != 5 || cells.iter().any(|cell| cell.is_empty()) {
        return vec![format!("not five cells: {row}")];
    }
    if cells[3].contains("TODO") {
        return vec![format!("not measured: {row}")];
    }
    let missing = |test: &&str| {
        let Some((path, name)) = linked(test) else {
            return true;
        };
        !read(path).is_some_and(|text| has_test(&text, name))
    };
    cells[4]
        .split("<br>")
        .filter(missing)
        .map(|test| format!("{}: no test {test}", cells[0]))
        .collect()
}

/// Path and name of a test written as ``[file](../path) `name` ``.
fn linked(test: &str) -> Option<(&str, &str)> {
    let (path, name) = test.split_once("](../")?.1.split_once(") `")?;
    Some((path, name.strip_suffix('`')?))
}

/// Whether a source has a test of this name: a function behind the attribute and those that follow it.
fn has_test(text: &str, name: &str) -> bool {
    let head = format!("fn {name}(");
    text.split("#[test]").skip(1).any(|rest| {
        let mut lines = rest.lines().map(str::trim).skip(1);
        lines
            .find(|line| !line.starts_with("#["))
            .is_some_and(|line| line.starts_with(&head))
    })
}

#[test]
fn every_row_of_the_page_names_a_test_that_exists() {
    let read =
        |path: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).ok();
    let page = read("docs/compat.md").expect("the page");
    let n_rows = page.lines().filter(|l| l.starts_with("| ")).count();
    assert!(n_rows > 150, "{n_rows} rows: are the tables read?");
    let faults = faults(&page, read);
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn rows_without_a_test_are_found() {
    let read = |path: &str| {
        (path == "tests/a.rs").then(|| String::from("#[test]\nfn held() {}\nfn not() {}"))
    };
    let row =
        |test: &str| format!("{COLUMNS}\n|---|---|---|---|---|\n| a | b | c | 1 | {test} |\n");
    let held = "[a.rs](../tests/a.rs) `held`";
    assert!(faults(&row(held), read).is_empty());
    for test in [
        "–",
        "",
        "`held`",
        "[a.rs](../tests/a.rs) `not`",
        "[a.rs](../tests/a.rs) `hel`",
        "[b.rs](../tests/b.rs) `held`",
        format!("{held}<br>[a.rs](../tests/a.rs) `gone`").as_str(),
        format!("{held} | more").as_str(),
    ] {
        assert_eq!(faults(&row(test), read).len(), 1, "{test}");
    }
    assert_eq!(faults("| a |\n|---|\n", read).len(), 1);
}

fn lamp(shape: &str) -> String {
    format!("WorldBegin AttributeBegin AreaLightSource \"diffuse\" {shape} AttributeEnd WorldEnd")
}

#[track_caller]
fn assert_warns(shape: &str, reason: &str) {
    let found = findings(&lamp(shape));
    let warned = found
        .iter()
        .any(|(code, message)| code == "biased-in-pbrt" && message.contains(reason));
    assert!(warned, "{shape}: {found:?}");
}

#[test]
fn row_19_mirrored_quadric_lights_are_announced() {
    assert_warns("Scale 1 1 -1 Shape \"sphere\"", "mirrored quadric");
}

#[test]
fn row_20_reversed_mesh_lights_with_normals_are_announced() {
    let mesh = "ReverseOrientation Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \
        \"normal N\" [0 0 1 0 0 1 0 0 1] \"integer indices\" [0 1 2]";
    assert_warns(mesh, "reversed mesh");
}

#[test]
fn row_24_scaled_sphere_lights_are_announced() {
    assert_warns("Scale .1 .1 .1 Shape \"sphere\"", "unscaled size");
}

#[test]
fn row_25_partial_quadric_lights_are_announced() {
    assert_warns("Shape \"sphere\" \"float phimax\" 180", "as the whole");
    assert_warns("Shape \"disk\" \"float innerradius\" 0.5", "as the whole");
}

#[test]
fn row_28_shapes_that_cast_no_shadow_are_announced_where_light_sampling_heeds_that() {
    let mesh = "Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] \
        \"float shadowalpha\" 0";
    let announced = |integrator: &str| {
        let scene = format!("Integrator \"{integrator}\" WorldBegin {mesh} WorldEnd");
        let found = findings(&scene);
        let told = |(code, message): &(String, String)| {
            code == "biased-in-pbrt" && message.contains("shadow of this shape")
        };
        found.iter().any(told)
    };
    assert!(announced("path") && announced("directlighting"));
    assert!(!announced("volpath"), "it has no effect there");
}

#[test]
fn row_29_emitters_with_masks_are_announced() {
    let mesh = |alpha: &str| {
        format!(
            "Texture \"mask\" \"float\" \"checkerboard\" \"float tex1\" 0 \"float tex2\" 1 \
             Shape \"trianglemesh\" \"point P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] {alpha}"
        )
    };
    assert_warns(&mesh("\"float alpha\" 0"), "alpha mask");
    assert_warns(&mesh("\"texture alpha\" \"mask\""), "alpha mask");
    let opaque = findings(&lamp(&mesh("\"float alpha\" 1")));
    assert!(opaque.iter().all(|(code, _)| code != "biased-in-pbrt"));
}

#[test]
fn row_58_emitters_without_a_material_are_announced() {
    assert_warns("Material \"none\" Shape \"sphere\"", "without a material");
}

#[test]
fn lights_that_pbrt_renders_right_are_not_announced() {
    for shape in [
        "Shape \"sphere\"",
        "Rotate 33 1 2 3 Translate 5 5 5 Shape \"disk\"",
    ] {
        let found = findings(&lamp(shape));
        assert!(
            found.iter().all(|(code, _)| code != "biased-in-pbrt"),
            "{found:?}"
        );
    }
}

/// Parameters of a material that only a shape names are checked like the material's own.
#[test]
fn a_bad_parameter_that_a_shape_overrides_is_reported_where_it_stands_and_once() {
    let codes = |world: &str| -> Vec<String> {
        let world = format!("WorldBegin LightSource \"infinite\" {world} WorldEnd");
        findings(&world).into_iter().map(|(code, _)| code).collect()
    };
    let metal = "Material \"metal\" \"bool remaproughness\" \"false\"";
    let shape = "Shape \"sphere\" \"float roughness\" 1e-6";
    assert_eq!(codes(&format!("{metal} {shape}")), ["clamped-roughness"]);
    let own =
        format!("{metal} \"float roughness\" 1e-6 Shape \"sphere\" Shape \"sphere\" \"float u\" 1");
    let roughness = codes(&own)
        .iter()
        .filter(|code| *code == "clamped-roughness")
        .count();
    assert_eq!(roughness, 1);
}

#[test]
fn integrators_tell_of_media_and_of_light_below_surfaces_that_they_leave_out() {
    let told = |integrator: &str, world: &str| {
        let scene = format!(
            "Integrator \"{integrator}\" WorldBegin LightSource \"infinite\" {world} WorldEnd"
        );
        let found = findings(&scene).into_iter();
        let told: Vec<String> = found
            .filter(|(code, _)| code == "ignored-scattering")
            .map(|(_, message)| message)
            .collect();
        assert!(
            told.iter().all(|message| message.contains(integrator)),
            "{told:?}"
        );
        told.len()
    };
    let fog = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \
        MediumInterface \"fog\" \"\" Material \"\" Shape \"sphere\"";
    let bodies = [
        "\"subsurface\"",
        "\"kdsubsurface\"",
        "\"disney\" \"rgb scatterdistance\" [.1 .1 .1]",
    ]
    .map(|material| format!("Material {material} Shape \"sphere\""));
    let solid = "Material \"disney\" Shape \"sphere\"";
    for (integrator, ignores_media, ignores_depth) in [
        ("path", 1, 0),
        ("volpath", 0, 0),
        ("bdpt", 0, 1),
        ("mlt", 0, 1),
        ("sppm", 1, 1),
        ("directlighting", 1, 1),
        ("whitted", 1, 1),
        ("ambientocclusion", 1, 1),
    ] {
        assert_eq!(told(integrator, "Shape \"sphere\""), 0, "{integrator}");
        assert_eq!(told(integrator, solid), 0, "{integrator}: disney");
        assert_eq!(told(integrator, fog), ignores_media, "{integrator}: media");
        for body in &bodies {
            assert_eq!(
                told(integrator, body),
                ignores_depth,
                "{integrator}: {body}"
            );
        }
    }
}

/// Light that surfaces reflect, seen from the side of +z through the origin.
fn at_origin(integrator: &str, max_depth: u32, world: &str) -> String {
    seen_by(
        integrator,
        max_depth,
        [1.0, 0.5, 3.0],
        [-1.0, -0.5, -3.0],
        world,
    )
}

/// A square across the origin, its normal and (u, v) given by the corners.
const SQUARE: &str = "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \
    \"point P\" [-2 -2 0 3 -2 0 3 2 0 -2 2 0] \"float uv\" [0 0 1 0 1 1 0 1]";

#[test]
fn from_of_a_point_light_is_added_in_world_space() {
    // The transform puts the origin at z = 1, and `from` goes on by 1 along the world's z.
    let light = "AttributeBegin Translate 0 0 1 Rotate 90 1 0 0 Scale 3 3 3 \
        LightSource \"point\" \"point from\" [0 0 1] \"rgb I\" [1 1 1] AttributeEnd\n";
    let world = format!("{light}Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n{SQUARE}");
    assert_exact(
        &at_origin("path", 1, &world),
        [0.5 / PI / 4.0; 3],
        "a floor",
    );
}

#[test]
fn a_stretched_sky_of_one_colour_lights_as_any_other() {
    let floor = format!("Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n{SQUARE}");
    for scale in ["1 1 3", "1 3 1", "20 20 20", ".05 .05 .05"] {
        let sky = environment([1.0, 2.0, 3.0]);
        let world = format!("AttributeBegin Scale {scale} {sky} AttributeEnd\n{floor}");
        assert_mean(
            &at_origin("path", 1, &world),
            20_000,
            [0.5, 1.0, 1.5],
            scale,
        );
    }
}

#[test]
fn vertex_normals_decide_the_side_a_triangle_shines_to() {
    let lamp = |normals: &str| {
        format!(
            "AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] Material \"matte\"\n{SQUARE} {normals}"
        )
    };
    let (lit, black) = ([1.0, 2.0, 3.0], [0.0; 3]);
    let down = "\"normal N\" [.1 0 -1 0 .1 -1 0 0 -1 0 0 -1]";
    assert_exact(&at_origin("path", 0, &lamp("")), lit, "by the winding");
    assert_exact(
        &at_origin("path", 0, &lamp(down)),
        black,
        "by normals that look away",
    );
    let from_below = seen_by("path", 0, [1.0, 0.5, -3.0], [-1.0, -0.5, 3.0], &lamp(down));
    assert_exact(&from_below, lit, "from the side of the normals");
}

#[test]
fn a_cone_of_negative_height_is_told_and_left_out() {
    let cone = "LightSource \"infinite\" Shape \"cone\" \"float height\" -1";
    let found = findings(&format!("WorldBegin {cone} WorldEnd"));
    assert!(found.iter().any(|(code, _)| code == "no-area"), "{found:?}");
}

#[test]
fn intermediate_pictures_of_sppm_are_told_to_be_missing() {
    let told = |every: u32| {
        let scene = format!(
            "Integrator \"sppm\" \"integer numiterations\" 8 \"integer imagewritefrequency\" {every} \
             WorldBegin LightSource \"infinite\" Shape \"sphere\" WorldEnd"
        );
        findings(&scene)
            .iter()
            .any(|(code, _)| code == "one-picture")
    };
    assert!(told(2) && !told(8));
}

#[test]
fn a_mixture_is_bumped_as_its_first_material() {
    let world = |material: &str| {
        format!(
            "LightSource \"distant\" \"point from\" [2 0 1] \"point to\" [0 0 0] \"rgb L\" [1 1 1]\n\
             Texture \"slope\" \"float\" \"bilerp\" \"float v00\" 0 \"float v01\" 0 \"float v10\" 2 \"float v11\" 2\n\
             MakeNamedMaterial \"bumped\" \"string type\" \"matte\" \"texture bumpmap\" \"slope\"\n\
             MakeNamedMaterial \"plain\" \"string type\" \"matte\"\n{material}\n{SQUARE}"
        )
    };
    let seen = |material: &str| {
        let scene = at_origin("path", 1, &world(material));
        f64::from(Probe::new(&scene).samples(1)[0][1])
    };
    let mix = |first: &str, second: &str| {
        seen(&format!(
            "Material \"mix\" \"string namedmaterial1\" \"{first}\" \"string namedmaterial2\" \"{second}\" \
             \"rgb amount\" [.2 .2 .2]"
        ))
    };
    let [bumped, plain] =
        ["bumped", "plain"].map(|name| seen(&format!("NamedMaterial \"{name}\"")));
    assert!((bumped / plain - 1.0).abs() > 0.1, "{bumped} {plain}");
    assert!((mix("bumped", "plain") / bumped - 1.0).abs() < 1e-5);
    assert!((mix("plain", "bumped") / plain - 1.0).abs() < 1e-5);
}

#[test]
fn light_below_a_mixture_comes_back_from_the_mixture() {
    let skin = "\"kdsubsurface\" \"rgb Kd\" [.6 .6 .6] \"rgb mfp\" [.02 .02 .02]";
    let mixture = format!(
        "MakeNamedMaterial \"skin\" \"string type\" {skin}\n\
         MakeNamedMaterial \"matte\" \"string type\" \"matte\"\n\
         Material \"mix\" \"string namedmaterial1\" \"skin\" \"string namedmaterial2\" \"matte\" \
         \"rgb amount\" [1 1 1]"
    );
    let means = |material: &str| {
        let world = environment([1.0; 3]) + &format!("{material}\n{SQUARE}");
        Probe::new(&at_origin("path", 1, &world)).means(20_000)
    };
    let alone = means(&format!("Material {skin}"));
    assert!(alone[0].value > 0.3, "light comes back: {alone:?}");
    for (mixed, alone) in means(&mixture).iter().zip(alone) {
        mixed
            .agrees_with_mean(&alone)
            .assert_accepted("mixed with nothing");
    }
}

#[test]
fn sppm_counts_the_sky_once_after_glossy_bounces() {
    let metal = "Material \"metal\" \"float roughness\" .05\n";
    let world = environment([1.0; 3]) + metal + SQUARE;
    let of = |integrator: &str| Probe::new(&at_origin(integrator, 4, &world)).means(20_000);
    for (photons, path) in of("sppm").iter().zip(of("path")) {
        photons
            .agrees_with_mean(&path)
            .assert_accepted("metal under a sky");
    }
}

#[test]
fn bdpt_sees_emitters_without_a_material() {
    let lamp = format!("AreaLightSource \"diffuse\" \"rgb L\" [1 2 3] Material \"none\"\n{SQUARE}");
    let film = "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1 PixelFilter \"box\"\n\
        Sampler \"random\" \"integer pixelsamples\" 16\n";
    let scene = film.to_owned()
        + &at_origin("bdpt", 3, &lamp)
            .replace("\"perspective\"", "\"perspective\" \"float fov\" 2");
    let job = compile_scene(scene, &CompileOptions::default(), |_| None).job;
    let seen = render(&job, &Unwatched, &AtomicBool::new(false)).image;
    for (seen, expected) in seen.data().iter().zip([1.0, 2.0, 3.0]) {
        assert!((seen - expected).abs() < 1e-4, "{seen} is not {expected}");
    }
}
