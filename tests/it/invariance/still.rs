//! Scenes as a whole: scaled, moved, turned, written in another order.

use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use crate::common::solids::null_sphere;
use crate::invariance::compared::{
    assert_alike, assert_identical, assert_same_mean, for_all, job, picture,
};
use crate::invariance::scenes::{Stand, Still, still};

const ALL: &[&str] = &["path", "volpath", "bdpt", "directlighting"];
const PATHS: &[&str] = &["path", "volpath"];

fn scaling((scene, k): (Still, i32)) -> Result<(), TestCaseError> {
    let at = |k: i32| picture(&job(&scene.text(2f64.powi(k), &Stand::default(), "")));
    assert_identical(&at(0), &at(k), &format!("2^{k}"))
}

#[test]
fn the_unit_of_length_changes_no_bit() {
    for_all(400, false, (still(ALL, false), -40..=40), scaling);
}

#[test]
#[ignore = "long"]
fn the_unit_of_length_changes_no_bit_of_many_scenes() {
    for_all(400, true, (still(ALL, false), -40..=40), scaling);
}

fn moving((scene, to): (Still, [i32; 3])) -> Result<(), TestCaseError> {
    let [x, y, z] = to;
    let stand = Stand {
        camera: format!("Translate {} {} {}", -x, -y, -z),
        world: format!("Translate {x} {y} {z}"),
    };
    let (home, away) = (
        scene.text(1.0, &Stand::default(), ""),
        scene.text(1.0, &stand, ""),
    );
    assert_alike(
        &picture(&job(&home)),
        &picture(&job(&away)),
        &format!("at {to:?}"),
    )
}

fn place() -> impl Strategy<Value = [i32; 3]> {
    const FAR: i32 = 1_000_000;
    [-FAR..=FAR, -FAR..=FAR, -FAR..=FAR]
}

#[test]
fn the_place_changes_next_to_nothing() {
    for_all(300, false, (still(PATHS, false), place()), moving);
}

#[test]
#[ignore = "long"]
fn the_place_changes_next_to_nothing_of_many_scenes() {
    for_all(300, true, (still(PATHS, false), place()), moving);
}

fn turning((scene, axis, angle): (Still, [i8; 3], u16)) -> Result<(), TestCaseError> {
    let [x, y, z] = axis;
    let stand = Stand {
        camera: format!("Rotate -{angle} {x} {y} {z}"),
        world: format!("Rotate {angle} {x} {y} {z}"),
    };
    let (upright, turned) = (
        scene.text(1.0, &Stand::default(), ""),
        scene.text(1.0, &stand, ""),
    );
    assert_same_mean(&upright, &turned, &format!("{angle} about {axis:?}"))
}

fn turn() -> impl Strategy<Value = (Still, [i8; 3], u16)> {
    (still(PATHS, true), [-9i8..=9, -9i8..=9, 1i8..=9], 1u16..360)
}

#[test]
fn the_orientation_changes_no_mean() {
    for_all(60, false, turn(), turning);
}

#[test]
#[ignore = "long"]
fn the_orientation_changes_no_mean_of_many_scenes() {
    for_all(60, true, turn(), turning);
}

fn reordering_shapes(mut scene: Still) -> Result<(), TestCaseError> {
    let forward = picture(&job(&scene.text(1.0, &Stand::default(), "")));
    scene.things.reverse();
    let backward = picture(&job(&scene.text(1.0, &Stand::default(), "")));
    assert_identical(&forward, &backward, "shapes in reverse")
}

#[test]
fn the_order_of_shapes_that_emit_nothing_changes_no_bit() {
    for_all(300, false, still(ALL, false), reordering_shapes);
}

#[test]
#[ignore = "long"]
fn the_order_of_shapes_that_emit_nothing_changes_no_bit_of_many_scenes() {
    for_all(300, true, still(ALL, false), reordering_shapes);
}

fn nesting((scene, radii): (Still, Vec<u8>)) -> Result<(), TestCaseError> {
    // Around everything but the camera, and in the middle of everything: not where the fog begins.
    let shells: String = radii
        .iter()
        .map(|r| null_sphere([0.0; 3], 0.5 + f64::from(*r) / 64.0, "", ""))
        .collect();
    let (plain, nested) = (
        scene.text(1.0, &Stand::default(), ""),
        scene.text(1.0, &Stand::default(), &shells),
    );
    assert_same_mean(&plain, &nested, "null shells")
}

fn nest() -> impl Strategy<Value = (Still, Vec<u8>)> {
    // The integrator `path` lets null surfaces block light sampling.
    let scenes = still(&["volpath"], true);
    (scenes, proptest::collection::vec(0u8..=128, 1..5))
}

#[test]
fn null_shells_change_no_mean() {
    for_all(50, false, nest(), nesting);
}

#[test]
#[ignore = "long"]
fn null_shells_change_no_mean_of_many_scenes() {
    for_all(50, true, nest(), nesting);
}
