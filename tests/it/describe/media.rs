//! Media: names, places, and which of them surrounds the camera.

use glam::{DMat4, DVec3};
use tyndall::describe::description::MediumRef;
use tyndall_parser::diagnostic::Severity;
use tyndall_parser::directive::Directive;

use crate::describe::scene::{
    codes, frame, make_medium, media, name, only, plugin, point_at, run, sphere, string, world,
};

/// Quirk 10.
#[test]
fn q10_the_camera_takes_the_outside_medium_of_world_end() {
    let fog = || make_medium("fog", [string("type", "homogeneous")]);
    let camera = |directives: Vec<Directive>| frame(world(directives)).camera.medium;
    assert_eq!(camera(vec![fog()]), None);
    assert_eq!(camera(vec![fog(), media("", "fog")]), Some(MediumRef(0)));
    assert_eq!(camera(vec![fog(), media("fog", "")]), None);
    let closed = vec![
        fog(),
        Directive::AttributeBegin,
        media("", "fog"),
        Directive::AttributeEnd,
    ];
    assert_eq!(camera(closed), None);
}

/// Quirk 10: what is unclosed at the end is dropped without being restored.
#[test]
fn q10_an_unclosed_block_leaks_its_medium_into_the_camera() {
    let (description, diagnostics) = run(world([
        make_medium("fog", [string("type", "homogeneous")]),
        Directive::AttributeBegin,
        Directive::TransformBegin,
        media("", "fog"),
    ]));
    assert_eq!(description.frames[0].camera.medium, Some(MediumRef(0)));
    assert_eq!(codes(&diagnostics), ["unclosed-block", "unclosed-block"]);
    assert_eq!(diagnostics.list[0].span.unwrap().lo, 200);
}

/// Quirk 11.
#[test]
fn q11_a_medium_is_placed_by_the_transform_at_its_definition_even_among_the_options() {
    let frame = frame(vec![
        Directive::Scale([-2.0, 2.0, 2.0]),
        make_medium("fog", [string("type", "heterogeneous")]),
        Directive::WorldBegin,
        Directive::Translate([1.0, 0.0, 0.0]),
        make_medium("mist", [string("type", "homogeneous")]),
        Directive::WorldEnd,
    ]);
    assert_eq!(
        frame.media[0].world_from_medium.start,
        DMat4::from_scale(DVec3::new(-2.0, 2.0, 2.0))
    );
    assert_eq!(
        frame.media[1].world_from_medium.start,
        DMat4::from_translation(DVec3::X)
    );
    assert_eq!(frame.media[0].entity.kind.value, "heterogeneous");
}

/// Quirk 12.
#[test]
fn q12_medium_names_are_looked_up_at_every_use() {
    let frame = frame(world([
        media("fog", ""),
        make_medium("fog", [string("type", "homogeneous")]),
        sphere(),
        make_medium("fog", [string("type", "homogeneous")]),
        sphere(),
    ]));
    assert_eq!(frame.shapes[0].media.inside, Some(MediumRef(0)));
    assert_eq!(frame.shapes[1].media.inside, Some(MediumRef(1)));
}

#[test]
fn an_unknown_medium_is_vacuum_and_reported_once_for_each_place() {
    let (description, diagnostics) = run(world([
        make_medium("fog", [string("type", "homogeneous")]),
        media("fgo", "fog"),
        sphere(),
        sphere(),
        media("fgo", "fog"),
        sphere(),
    ]));
    assert!(
        description.frames[0]
            .shapes
            .iter()
            .all(|shape| shape.media.inside.is_none())
    );
    assert!(
        description.frames[0]
            .shapes
            .iter()
            .all(|shape| shape.media.outside == Some(MediumRef(0)))
    );
    assert_eq!(codes(&diagnostics), ["unknown-medium", "unknown-medium"]);
    let finding = &diagnostics.list[0];
    assert_eq!(finding.span.unwrap().lo, 210);
    assert_eq!(finding.help.as_deref(), Some("did you mean \"fog\"?"));
    assert_eq!(finding.notes[0].0.lo, 110);
}

#[test]
fn one_medium_name_means_both_sides() {
    let frame = frame(world([
        make_medium("fog", [string("type", "homogeneous")]),
        Directive::MediumInterface {
            inside: name("fog"),
            outside: None,
        },
        sphere(),
    ]));
    assert_eq!(frame.shapes[0].media.inside, Some(MediumRef(0)));
    assert_eq!(frame.shapes[0].media.outside, Some(MediumRef(0)));
}

#[test]
fn media_that_cannot_be_are_reported_and_not_defined() {
    for (params, code, severity) in [
        (vec![], "missing-parameter", Severity::Error),
        (
            vec![string("type", "homogenous")],
            "unknown-plugin",
            Severity::Error,
        ),
    ] {
        let (description, diagnostics) = run(world([make_medium("fog", params)]));
        assert_eq!(only(&diagnostics, code).severity, severity);
        assert!(description.frames[0].media.is_empty());
    }
}

#[test]
fn a_light_stands_in_the_outside_medium() {
    let frame = frame(world([
        make_medium("fog", [string("type", "homogeneous")]),
        media("", "fog"),
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::LightSource(plugin("point", [])),
    ]));
    assert_eq!(frame.lights[0].medium, Some(MediumRef(0)));
    assert_eq!(
        point_at(frame.lights[0].world_from_light.start, [0.0; 3]),
        [1.0, 0.0, 0.0]
    );
}
