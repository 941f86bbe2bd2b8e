//! What nobody sees, and the order in which things are written.

use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use crate::invariance::compared::{
    assert_close, assert_identical, assert_same_mean, for_all, job, picture,
};
use crate::invariance::scenes::{Form, HIDING_BALL, Stand, Still, TEXTURES, decorated, still};

const WITHOUT_LIGHT_PATHS: &[&str] = &[
    "path",
    "volpath",
    "directlighting",
    "whitted",
    "ambientocclusion",
];
const STRATEGIES: [&str; 3] = ["uniform", "power", "spatial"];

/// A scene as text, with the choice of lights by a strategy where there is one, and all lights or one of them.
fn written(scene: &Still, strategy: usize, before: &str, form: Form) -> String {
    let text = scene.text_with(1.0, &Stand::default(), before, form);
    let (depth, instead) = match scene.integrator {
        "path" | "volpath" => (
            "\"integer maxdepth\"",
            format!(
                "\"string lightsamplestrategy\" \"{}\" \"integer maxdepth\"",
                STRATEGIES[strategy]
            ),
        ),
        "directlighting" if strategy == 0 => (
            "\"integer maxdepth\"",
            "\"string strategy\" \"one\" \"integer maxdepth\"".to_owned(),
        ),
        "ambientocclusion" => (
            "\"integer maxdepth\" 5",
            "\"integer nsamples\" 4".to_owned(),
        ),
        _ => return text,
    };
    text.replace(depth, &instead)
}

fn textures() -> String {
    TEXTURES.concat()
}

/// The same with a marble of less than 1. As it is, it reaches 40: rounding grows a hundredfold at each bounce within a
/// bent surface of it, and paths that the last bits tell apart make up a pixel.
fn dim_textures() -> String {
    textures().replace("\"clouds\"", "\"bright\"")
        + "Texture \"clouds\" \"spectrum\" \"scale\" \"texture tex1\" \"bright\" \"rgb tex2\" [.02 .02 .02]\n"
}

/// Far out, beside the picture or behind the camera.
fn speck() -> impl Strategy<Value = [f64; 3]> {
    let away = (2u32..=17).prop_map(|k| 3.0 * 2f64.powi(k as i32));
    (0usize..5, away).prop_map(|(side, away)| match side {
        0 => [away, 0.0, 0.0],
        1 => [-away, 0.0, 0.0],
        2 => [0.0, away, 0.0],
        3 => [0.0, -away, 0.0],
        _ => [0.0, 0.0, -6.0 - away],
    })
}

fn scenes() -> impl Strategy<Value = (Still, usize)> {
    let scenes = prop_oneof![
        still(WITHOUT_LIGHT_PATHS, false),
        decorated(WITHOUT_LIGHT_PATHS, false)
    ];
    (scenes, 0..STRATEGIES.len())
}

fn adding_a_speck(
    ((scene, strategy), [x, y, z]): ((Still, usize), [f64; 3]),
) -> Result<(), TestCaseError> {
    let speck = format!(
        "AttributeBegin Material \"matte\" \"rgb Kd\" [0 0 0] Translate {x} {y} {z} \
         Shape \"trianglemesh\" \"point P\" [0 0 0 .015625 0 0 0 .015625 .015625] \
         \"integer indices\" [0 1 2] AttributeEnd\n"
    );
    let [without, with] = ["", &speck].map(|speck| {
        let text = written(&scene, strategy, &(textures() + speck), Form::Plain);
        picture(&job(&text))
    });
    assert_identical(&without, &with, &format!("a speck at {x} {y} {z}"))
}

#[test]
fn a_speck_out_of_sight_changes_no_bit() {
    for_all(300, false, (scenes(), speck()), adding_a_speck);
}

#[test]
#[ignore = "long"]
fn a_speck_out_of_sight_changes_no_bit_of_many_scenes() {
    for_all(300, true, (scenes(), speck()), adding_a_speck);
}

fn adding_unused_things((scene, strategy): (Still, usize)) -> Result<(), TestCaseError> {
    let unused = "Texture \"unused\" \"spectrum\" \"dots\"\n\
                  MakeNamedMaterial \"unused\" \"string type\" \"glass\"\n\
                  MakeNamedMedium \"unused\" \"string type\" \"homogeneous\"\n\
                  ObjectBegin \"unused\" AreaLightSource \"diffuse\" NamedMaterial \"unused\" \
                  MediumInterface \"unused\" \"\" Translate 9 0 0 Shape \"sphere\" \"float radius\" 100 ObjectEnd\n";
    let [without, with] = ["", unused].map(|unused| {
        let text = written(&scene, strategy, &(textures() + unused), Form::Plain);
        picture(&job(&text))
    });
    assert_identical(&without, &with, "unused things")
}

#[test]
fn what_is_not_used_changes_no_bit() {
    for_all(200, false, scenes(), adding_unused_things);
}

#[test]
#[ignore = "long"]
fn what_is_not_used_changes_no_bit_of_many_scenes() {
    for_all(200, true, scenes(), adding_unused_things);
}

fn reordering((scene, strategy): (Still, usize)) -> Result<(), TestCaseError> {
    let forward = written(&scene, strategy, &textures(), Form::Plain);
    let mut other = scene;
    other.things.reverse();
    other.lamps.reverse();
    let backward: String = TEXTURES.iter().rev().copied().collect();
    let backward = written(&other, strategy, &backward, Form::Plain);
    let [a, b] = [&forward, &backward].map(|text| picture(&job(text)));
    assert_identical(&a, &b, &format!("in reverse, {forward}"))
}

#[test]
fn no_order_changes_a_bit() {
    for_all(300, false, scenes(), reordering);
}

#[test]
#[ignore = "long"]
fn no_order_changes_a_bit_of_many_scenes() {
    for_all(300, true, scenes(), reordering);
}

fn rewriting(((scene, strategy), form): ((Still, usize), Form)) -> Result<(), TestCaseError> {
    let text = |form| {
        written(&scene, strategy, &(dim_textures() + HIDING_BALL), form)
            .replace("\"integer xresolution\" 12", "\"integer xresolution\" 32")
            .replace("\"integer yresolution\" 8", "\"integer yresolution\" 24")
            .replace("\"integer pixelsamples\" 4", "\"integer pixelsamples\" 16")
            .replace(
                "Camera \"perspective\"",
                "Camera \"perspective\" \"float shutterclose\" 0",
            )
    };
    let [a, b] = [Form::Plain, form].map(|form| picture(&job(&text(form))));
    assert_close(&a, &b, &format!("{form:?}, {}", text(form)))
}

fn form() -> impl Strategy<Value = Form> {
    proptest::sample::select(&[Form::Object, Form::Twice, Form::Moving, Form::Nested][..])
}

#[test]
fn objects_motions_and_nesting_change_little() {
    let scenes = (decorated(WITHOUT_LIGHT_PATHS, false), 0..STRATEGIES.len());
    for_all(200, false, (scenes, form()), rewriting);
}

#[test]
#[ignore = "long"]
fn objects_motions_and_nesting_change_little_of_many() {
    let scenes = (decorated(WITHOUT_LIGHT_PATHS, false), 0..STRATEGIES.len());
    for_all(200, true, (scenes, form()), rewriting);
}

/// As in pbrt-v3, mirrors turn the normals of quadrics and curves around, and with them sides and bumps; nothing else has
/// a handedness.
fn mirroring((scene, strategy): (Still, usize)) -> Result<(), TestCaseError> {
    let scene = scene.without_shining_balls();
    let [a, b] = [("", Form::Reversed), ("Scale -1 1 1", Form::Plain)].map(|(mirror, form)| {
        written(&scene, strategy, &textures(), form)
            .replace("0 1 0 \nCamera", &format!("0 1 0 {mirror}\nCamera"))
            .replace("WorldBegin", &format!("WorldBegin {mirror}"))
    });
    assert_ne!(a, b);
    assert_same_mean(&a, &b, "mirrored")
}

fn textured() -> impl Strategy<Value = (Still, usize)> {
    (decorated(&["path", "volpath"], true), 0..STRATEGIES.len())
}

#[test]
fn mirrors_around_the_scene_change_no_mean() {
    for_all(60, false, textured(), mirroring);
}

#[test]
#[ignore = "long"]
fn mirrors_around_the_scene_change_no_mean_of_many() {
    for_all(60, true, textured(), mirroring);
}
