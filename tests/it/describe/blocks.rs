//! Blocks: what they save, and what happens where they cross or do not end.

use glam::DMat4;
use tyndall::describe::description::MaterialRef;
use tyndall_parser::diagnostic::Severity;
use tyndall_parser::directive::{ActiveTransform, Directive};

use crate::describe::scene::{
    codes, frame, int, make_medium, media, only, plugin, point_at, run, sphere, string, world,
};

#[test]
fn attribute_blocks_restore_everything_and_transform_blocks_only_transforms() {
    let frame = frame(world([
        make_medium("fog", [string("type", "homogeneous")]),
        Directive::AttributeBegin,
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::ReverseOrientation,
        Directive::Material(plugin("mirror", [])),
        Directive::AreaLightSource(plugin("diffuse", [])),
        media("fog", "fog"),
        sphere(),
        Directive::AttributeEnd,
        sphere(),
        Directive::TransformBegin,
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::ReverseOrientation,
        Directive::TransformEnd,
        sphere(),
    ]));
    let [inner, restored, kept] = &frame.shapes[..] else {
        panic!()
    };
    assert!(
        inner.reverse_orientation && inner.area_light.is_some() && inner.media.inside.is_some()
    );
    assert_eq!(inner.material, MaterialRef(1));
    assert!(
        !restored.reverse_orientation
            && restored.area_light.is_none()
            && restored.media.inside.is_none()
    );
    assert_eq!(restored.material, MaterialRef(0));
    assert_eq!(restored.world_from_object.start, DMat4::IDENTITY);
    assert_eq!(kept.world_from_object.start, DMat4::IDENTITY);
    assert!(kept.reverse_orientation);
}

#[test]
fn blocks_restore_which_transform_is_active() {
    let frame = frame(world([
        Directive::TransformBegin,
        Directive::ActiveTransform(ActiveTransform::EndTime),
        Directive::TransformEnd,
        Directive::Translate([1.0, 0.0, 0.0]),
        sphere(),
    ]));
    assert!(!frame.shapes[0].world_from_object.is_animated());
}

#[test]
fn reverse_orientation_toggles() {
    let frame = frame(world([
        Directive::ReverseOrientation,
        Directive::ReverseOrientation,
        sphere(),
    ]));
    assert!(!frame.shapes[0].reverse_orientation);
}

#[test]
fn crossed_blocks_restore_the_transform_saved_last_and_warn() {
    let (description, diagnostics) = run(world([
        Directive::AttributeBegin, // saves the identity
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::TransformBegin, // saves x = 1
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::AttributeEnd, // restores x = 1
        sphere(),
        Directive::TransformEnd, // restores the identity
        sphere(),
    ]));
    let shapes = &description.frames[0].shapes;
    assert_eq!(
        point_at(shapes[0].world_from_object.start, [0.0; 3]),
        [1.0, 0.0, 0.0]
    );
    assert_eq!(
        point_at(shapes[1].world_from_object.start, [0.0; 3]),
        [0.0; 3]
    );
    assert_eq!(codes(&diagnostics), ["crossed-blocks", "crossed-blocks"]);
    assert_eq!(diagnostics.list[0].notes[0].0.lo, 300);
}

#[test]
fn crossed_blocks_that_use_up_all_transforms_do_not_panic() {
    let (description, diagnostics) = run(world([
        Directive::AttributeBegin,
        Directive::ReverseOrientation,
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::TransformEnd,
        Directive::Translate([0.0, 1.0, 0.0]),
        Directive::AttributeEnd,
        sphere(),
    ]));
    assert_eq!(codes(&diagnostics), ["crossed-blocks", "crossed-blocks"]);
    let shape = &description.frames[0].shapes[0];
    assert_eq!(
        point_at(shape.world_from_object.start, [0.0; 3]),
        [0.0, 1.0, 0.0]
    );
    assert!(!shape.reverse_orientation);
}

#[test]
fn ends_without_a_beginning_are_errors_and_ignored() {
    for end in [
        Directive::AttributeEnd,
        Directive::TransformEnd,
        Directive::ObjectEnd,
    ] {
        let (description, diagnostics) = run(world([
            Directive::Translate([1.0, 0.0, 0.0]),
            end,
            sphere(),
        ]));
        let finding = only(&diagnostics, "unmatched-end");
        assert_eq!(
            (finding.severity, finding.span.unwrap().lo),
            (Severity::Error, 200)
        );
        let start = description.frames[0].shapes[0].world_from_object.start;
        assert_eq!(point_at(start, [0.0; 3]), [1.0, 0.0, 0.0]);
    }
}

#[test]
fn directives_in_the_wrong_block_are_errors_and_ignored() {
    let (description, diagnostics) = run(vec![
        sphere(),
        Directive::WorldBegin,
        Directive::Film(plugin("image", [int("xresolution", 5)])),
        Directive::WorldBegin,
        sphere(),
        Directive::WorldEnd,
        Directive::WorldEnd,
    ]);
    assert_eq!(codes(&diagnostics), ["wrong-block"; 4]);
    let places: Vec<_> = diagnostics
        .list
        .iter()
        .map(|d| d.span.unwrap().lo)
        .collect();
    assert_eq!(places, [0, 200, 300, 600]);
    assert_eq!(description.frames.len(), 1);
    assert_eq!(description.frames[0].shapes.len(), 1);
    assert!(description.frames[0].film.params.params.is_empty());
}

/// Quirk 15.
#[test]
fn q15_blocks_before_world_begin_are_ignored_and_their_transforms_leak() {
    let (description, diagnostics) = run(vec![
        Directive::AttributeBegin,
        Directive::Translate([0.0, 0.0, 1.0]),
        Directive::AttributeEnd,
        Directive::TransformBegin,
        Directive::Translate([0.0, 0.0, 1.0]),
        Directive::TransformEnd,
        Directive::Camera(plugin("perspective", [])),
        Directive::WorldBegin,
        Directive::WorldEnd,
    ]);
    assert_eq!(codes(&diagnostics), ["wrong-block"; 4]);
    let camera = description.frames[0].camera.world_from_camera.start;
    assert_eq!(point_at(camera, [0.0; 3]), [0.0, 0.0, -2.0]);
}
