//! Materials as scene files write them: parameters, fallbacks, mixtures, findings.

use tyndall::compile::{CompileOptions, NoAssets, compile};
use tyndall::describe::describe;
use tyndall_parser::source::Sources;
use tyndall_parser::{NoIncludes, parse};

use crate::common::findings::findings;
use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::seen::{environment, seen_by};

const EYE: [f64; 3] = [0.1, 0.2, -5.0];
const AHEAD: [f64; 3] = [0.02, -0.03, 1.0];

/// A ball in a uniform sky, after some definitions.
fn ball(definitions: &str, material: &str) -> String {
    let world = environment([1.0; 3]) + &format!("{definitions}\n{material} Shape \"sphere\"");
    seen_by("path", 50, EYE, AHEAD, &world)
}

fn material(text: &str) -> String {
    ball("", &format!("Material {text}"))
}

/// The two scenes give the same samples, bit for bit.
#[track_caller]
fn assert_same(a: &str, b: &str) {
    assert_eq!(
        Probe::new(a).samples(50),
        Probe::new(b).samples(50),
        "{a}\n{b}"
    );
}

#[track_caller]
fn assert_different(a: &str, b: &str) {
    assert_ne!(
        Probe::new(a).samples(50),
        Probe::new(b).samples(50),
        "{a}\n{b}"
    );
}

#[test]
fn roughness_falls_back_as_the_format_says() {
    // Metal: each axis on its own to the common one.
    assert_same(
        &material("\"metal\" \"float roughness\" .3 \"float uroughness\" .1"),
        &material("\"metal\" \"float uroughness\" .1 \"float vroughness\" .3"),
    );
    assert_same(
        &material("\"metal\" \"float roughness\" .3 \"float vroughness\" .1"),
        &material("\"metal\" \"float uroughness\" .3 \"float vroughness\" .1"),
    );
    // Uber: v to u, not to the common one.
    assert_same(
        &material("\"uber\" \"float roughness\" .3 \"float uroughness\" .1"),
        &material("\"uber\" \"float uroughness\" .1 \"float vroughness\" .1"),
    );
    assert_same(
        &material("\"uber\" \"float roughness\" .3 \"float vroughness\" .1"),
        &material("\"uber\" \"float uroughness\" .3 \"float vroughness\" .1"),
    );
    assert_different(
        &material("\"uber\" \"float roughness\" .3"),
        &material("\"uber\" \"float roughness\" .1"),
    );
}

#[test]
fn roughness_is_remapped_unless_told_otherwise() {
    for kind in ["plastic", "metal", "translucent", "uber"] {
        let rough = |value: &str| material(&format!("\"{kind}\" \"float roughness\" {value}"));
        assert_same(
            &rough(".1"),
            &rough(&format!(
                "{} \"bool remaproughness\" \"false\"",
                alpha_of(0.1)
            )),
        );
        assert_different(&rough(".1"), &rough(".1 \"bool remaproughness\" \"false\""));
    }
}

fn alpha_of(roughness: f32) -> f32 {
    tyndall::scatter::microfacet::alpha_from_roughness(roughness)
}

#[test]
fn remapped_roughness_is_that_of_the_format() {
    let table = [
        (0.0, 0.0473),
        (0.01, 0.1389),
        (0.05, 0.3125),
        (0.1, 0.4618),
        (0.3, 0.8571),
        (0.5, 1.1308),
        (1.0, 1.6214),
    ];
    for (roughness, alpha) in table {
        assert!((alpha_of(roughness) - alpha).abs() < 1e-4, "{roughness}");
    }
}

#[test]
fn metal_is_copper_unless_told_otherwise() {
    let [r, g, b] = Probe::new(&material("\"metal\""))
        .means(2000)
        .map(|mean| mean.value);
    assert!(r > 0.8 && g > 0.5 && r > g && g > b, "{r} {g} {b}");
}

#[test]
fn parts_that_are_black_are_left_out() {
    for dark in [
        "\"plastic\" \"rgb Kd\" [0 0 0] \"rgb Ks\" [0 0 0]",
        "\"translucent\" \"rgb reflect\" [0 0 0] \"rgb transmit\" [0 0 0]",
        "\"substrate\" \"rgb Kd\" [0 0 0] \"rgb Ks\" [0 0 0]",
        "\"uber\" \"rgb Kd\" [0 0 0] \"rgb Ks\" [0 0 0]",
        "\"glass\" \"rgb Kr\" [0 0 0] \"rgb Kt\" [0 0 0] \"float uroughness\" .1",
    ] {
        assert_exact(&material(dark), [0.0; 3], dark);
    }
    assert_same(
        &material("\"plastic\" \"rgb Kd\" [.3 .4 .5] \"rgb Ks\" [0 0 0]"),
        &material("\"matte\" \"rgb Kd\" [.3 .4 .5]"),
    );
}

const WHITE_MIRROR_AND_BLACK: &str = "MakeNamedMaterial \"white\" \"string type\" \"mirror\" \"rgb Kr\" [1 1 1]\n\
     MakeNamedMaterial \"black\" \"string type\" \"matte\" \"rgb Kd\" [0 0 0]\n";

fn mix(first: &str, second: &str, amount: &str) -> String {
    format!(
        "\"mix\" \"string namedmaterial1\" \"{first}\" \"string namedmaterial2\" \"{second}\" {amount}"
    )
}

#[test]
fn a_mixture_gives_the_first_material_the_amount_and_the_second_the_rest() {
    let seen = |first: &str, second: &str, amount: &str| {
        let mix = mix(first, second, amount);
        ball(WHITE_MIRROR_AND_BLACK, &format!("Material {mix}"))
    };
    assert_exact(&seen("white", "black", ""), [0.5; 3], "half");
    let amount = "\"rgb amount\" [.25 .5 1]";
    assert_exact(&seen("white", "black", amount), [0.25, 0.5, 1.0], "amounts");
    assert_exact(
        &seen("black", "white", amount),
        [0.75, 0.5, 0.0],
        "the rest",
    );
    // Clamped below, not above; the rest is nothing then.
    let amount = "\"rgb amount\" [-1 2 1.5]";
    assert_exact(&seen("white", "black", amount), [0.0, 2.0, 1.5], "beyond");
    assert_exact(
        &seen("black", "white", amount),
        [1.0, 0.0, 0.0],
        "beyond, the rest",
    );
    assert_mean(
        &seen("white", "white", ""),
        2000,
        [1.0; 3],
        "the same twice",
    );
}

#[test]
fn mixtures_nest() {
    let inner = mix("white", "black", "\"rgb amount\" [.5 .5 .5]").replacen(
        "\"mix\"",
        "MakeNamedMaterial \"inner\" \"string type\" \"mix\"",
        1,
    );
    let outer = mix("inner", "black", "\"rgb amount\" [.5 .25 1]");
    let scene = ball(
        &format!("{WHITE_MIRROR_AND_BLACK}{inner}"),
        &format!("Material {outer}"),
    );
    assert_exact(&scene, [0.25, 0.125, 0.5], "nested");
}

#[test]
fn mixtures_of_glossy_materials_lie_between_their_parts() {
    let named = "MakeNamedMaterial \"a\" \"string type\" \"plastic\" \"rgb Kd\" [.5 .1 .3]\n\
                 MakeNamedMaterial \"b\" \"string type\" \"metal\" \"float roughness\" .2\n";
    let seen = |what: &str| Probe::new(&ball(named, what)).means(40_000);
    let (a, b) = (seen("NamedMaterial \"a\""), seen("NamedMaterial \"b\""));
    let amount = [0.3, 0.3, 0.3];
    let mixture = seen(&format!(
        "Material {}",
        mix("a", "b", "\"rgb amount\" [.3 .3 .3]")
    ));
    for channel in 0..3 {
        let expected =
            amount[channel] * a[channel].value + (1.0 - amount[channel]) * b[channel].value;
        let error =
            mixture[channel].standard_error + a[channel].standard_error + b[channel].standard_error;
        assert!(
            (mixture[channel].value - expected).abs() < 4.0 * error,
            "channel {channel}: {:?} is not {expected}",
            mixture[channel]
        );
    }
}

fn codes(scene: &str) -> Vec<String> {
    findings(scene)
        .into_iter()
        .map(|(code, _)| code.to_owned())
        .collect()
}

fn world(text: &str) -> String {
    format!("WorldBegin LightSource \"point\" {text} Shape \"sphere\" WorldEnd")
}

#[test]
fn unknown_and_null_parts_of_mixtures_are_located_errors_and_matte() {
    let unknown = format!(
        "Material {}",
        mix("white", "nobody", "\"rgb amount\" [0 0 0]")
    );
    let found = codes(&world(&format!("{WHITE_MIRROR_AND_BLACK}{unknown}")));
    assert_eq!(found, ["unknown-material"], "{unknown}");

    let null = "MakeNamedMaterial \"nothing\" \"string type\" \"none\"\n";
    let mixed = format!("Material {}", mix("white", "nothing", ""));
    let scene = world(&format!("{WHITE_MIRROR_AND_BLACK}{null}{mixed}"));
    assert_eq!(codes(&scene), ["null-in-mix"], "{scene}");
}

/// The mixture "m`k`" of two others.
fn named_mix(k: usize, first: usize, second: usize) -> String {
    let mix = mix(&format!("m{first}"), &format!("m{second}"), "");
    let named = format!("MakeNamedMaterial \"m{k}\" \"string type\" \"mix\"");
    mix.replacen("\"mix\"", &named, 1) + "\n"
}

#[test]
fn mixtures_of_too_many_lobes_are_located_errors_and_bounded() {
    // Each doubles the one before: 4 lobes, 8, 16, 32, … up to a depth where recursion would hurt.
    let mut text = "MakeNamedMaterial \"m0\" \"string type\" \"uber\"\n".to_owned();
    for k in 1..=3 {
        text += &named_mix(k, k - 1, k - 1);
    }
    assert!(codes(&world(&format!("{text} NamedMaterial \"m2\""))).is_empty());
    assert_eq!(
        codes(&world(&format!("{text} NamedMaterial \"m3\""))),
        ["too-many-lobes"]
    );
}

#[test]
fn mixtures_of_too_many_lobes_stay_bounded_where_shapes_override_them() {
    let mut text = "MakeNamedMaterial \"m0\" \"string type\" \"uber\" \"rgb opacity\" [.5 .5 .5] \
                    \"rgb Kr\" [.1 .1 .1] \"rgb Kt\" [.1 .1 .1]\n"
        .to_owned();
    for k in 1..=2 {
        text += &named_mix(k, k - 1, k - 1);
    }
    // 16 lobes are within the limit, with an amount of the shape's own as well.
    let overridden =
        format!("{text} NamedMaterial \"m2\" Shape \"sphere\" \"rgb amount\" [.3 .3 .3]");
    let scene = seen_by(
        "path",
        5,
        EYE,
        AHEAD,
        &(environment([1.0; 3]) + &overridden),
    );
    let mean = Probe::new(&scene).means(500)[0].value;
    assert!((0.3..1.1).contains(&mean), "{mean}");
    // 32 are not, and the shape's copy is no larger than the shared one.
    text += &named_mix(3, 2, 2);
    let too_many =
        format!("{text} NamedMaterial \"m3\" Shape \"sphere\" \"rgb amount\" [.3 .3 .3]");
    assert_eq!(codes(&world(&too_many)), ["too-many-lobes"]);
}

#[test]
fn a_chain_of_ten_thousand_mixtures_loads() {
    let mut text = "MakeNamedMaterial \"m0\" \"string type\" \"matte\"\n".to_owned();
    for k in 1..10_000 {
        text += &named_mix(k, k - 1, 0);
    }
    let found = codes(&world(&format!("{text} NamedMaterial \"m9999\"")));
    assert!(found.iter().all(|code| code == "too-many-lobes") && !found.is_empty());
}

/// Number of materials that a scene leads to, whatever is wrong with it.
fn n_materials(scene: &str) -> usize {
    let mut sources = Sources::new();
    let root = sources.add_text("scene", scene);
    let (mut scene, _) = describe(parse(&mut sources, root, &NoIncludes).0);
    let (compiled, _) = compile(
        scene.frames.remove(0),
        &CompileOptions::default(),
        &NoAssets,
    );
    let world = compiled.expect("there is a picture").job.world;
    world.materials().list.len()
}

#[test]
fn shapes_that_override_a_mixture_alike_share_one_copy_whatever_stands_in_for_its_parts() {
    let null = "MakeNamedMaterial \"nothing\" \"string type\" \"none\"\n";
    let mixed = format!("Material {}\n", mix("nobody", "nothing", ""));
    let copy = "Shape \"sphere\" \"rgb amount\" [.3 .3 .3]\n";
    let scene = |n_copies: usize| world(&format!("{null}{mixed}{}", copy.repeat(n_copies)));
    // Two parts, and the mixture as it stands; the last shape has that.
    assert_eq!(n_materials(&scene(0)), 3);
    assert_eq!(n_materials(&scene(1)), 4);
    assert_eq!(n_materials(&scene(100)), 4);
}

#[test]
fn what_is_wrong_with_a_material_is_said_once_and_what_is_wrong_with_a_shape_for_each() {
    let wrong = "Material \"glass\" \"float eta\" 0 \"float uroughness\" -1\n";
    let plain = "Shape \"sphere\" \"float zmin\" -.5\n";
    let copy = "Shape \"sphere\" \"float eta\" -1\n";
    let found = codes(&world(
        &(wrong.to_owned() + &(plain.to_owned() + copy).repeat(100)),
    ));
    // Few enough for all of a kind to be listed.
    assert_eq!(found.len(), 2 + 100);
    assert!(found.iter().all(|code| code == "out-of-range"));
}

#[test]
fn m02_impossible_indices_are_located_errors() {
    for kind in ["glass", "uber"] {
        for eta in ["0", "-1.5"] {
            let scene = world(&format!("Material \"{kind}\" \"float eta\" {eta}"));
            assert_eq!(codes(&scene), ["out-of-range"], "{scene}");
            // By way of a texture as well.
            let scene = world(&format!(
                "Texture \"t\" \"float\" \"constant\" \"float value\" {eta}\n\
                 Material \"{kind}\" \"texture eta\" \"t\""
            ));
            assert_eq!(codes(&scene), ["bad-index"], "{scene}");
        }
    }
}

#[test]
fn m03_clamped_roughness_is_a_warning() {
    let warned = |text: &str| codes(&world(&format!("Material {text}")));
    let raw = "\"bool remaproughness\" \"false\"";
    for text in [
        "\"plastic\" \"float roughness\" 0",
        "\"metal\" \"float roughness\" 1e-8",
        "\"uber\" \"float vroughness\" 0",
        "\"substrate\" \"float uroughness\" 1e-4",
        "\"translucent\" \"float roughness\" 0",
        "\"glass\" \"float uroughness\" 0 \"float vroughness\" 1e-8",
        "\"glass\" \"float uroughness\" .1 \"float vroughness\" 0",
    ] {
        assert_eq!(
            warned(&format!("{text} {raw}")),
            ["clamped-roughness"],
            "{text}"
        );
        assert!(warned(text).is_empty(), "{text}");
    }
    let smooth = "\"glass\" \"float uroughness\" 0 \"float vroughness\" 0";
    assert!(
        warned(&format!("{smooth} {raw}")).is_empty(),
        "perfectly smooth"
    );
}

#[test]
fn shapes_override_parameters_of_their_material() {
    let shape =
        "Material \"plastic\" \"rgb Kd\" [.1 .2 .3] \"float roughness\" .3 Shape \"sphere\"";
    let overriding = format!("{shape} \"float roughness\" .02 \"rgb Ks\" [.6 .6 .6]");
    let scene = |world: &str| seen_by("path", 50, EYE, AHEAD, &(environment([1.0; 3]) + world));
    assert_same(
        &scene(&overriding),
        &material(
            "\"plastic\" \"rgb Kd\" [.1 .2 .3] \"float roughness\" .02 \"rgb Ks\" [.6 .6 .6]",
        ),
    );
}

#[test]
fn materials_know_the_index_that_roulette_compensates_for() {
    // An uber with holes does as if it had none, like pbrt-v3's; what it shows is the same.
    for text in [
        "\"glass\" \"float eta\" 2",
        "\"uber\" \"float eta\" 2 \"rgb Kt\" [1 1 1] \"rgb Kr\" [1 1 1] \"rgb Kd\" [0 0 0] \"rgb Ks\" [0 0 0]",
    ] {
        assert_mean(&material(text), 20_000, [1.0; 3], text);
    }
}
