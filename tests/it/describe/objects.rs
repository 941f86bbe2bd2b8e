//! Objects and their instances.

use glam::DMat4;
use tyndall::describe::description::ObjectRef;
use tyndall_parser::diagnostic::Severity;
use tyndall_parser::directive::Directive;

use crate::describe::scene::{codes, frame, name, only, plugin, point_at, run, sphere, world};

/// Quirk 16.
#[test]
fn q16_an_object_keeps_its_own_transform_and_the_instance_multiplies_on_the_left() {
    let frame = frame(world([
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::ObjectBegin(name("o")),
        sphere(),
        Directive::ObjectEnd,
        Directive::Identity,
        Directive::Scale([2.0, 2.0, 2.0]),
        Directive::ObjectInstance(name("o")),
    ]));
    assert!(frame.shapes.is_empty());
    let instance = &frame.instances[0];
    assert_eq!(instance.object, ObjectRef(0));
    let total = instance.world_from_instance.pair().start
        * frame.objects[0].shapes[0].world_from_object.start;
    assert_eq!(point_at(total, [0.0; 3]), [2.0, 0.0, 0.0]);
}

#[test]
fn an_object_is_an_attribute_block_and_its_lights_are_the_worlds() {
    let frame = frame(world([
        Directive::ObjectBegin(name("o")),
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::ReverseOrientation,
        Directive::LightSource(plugin("point", [])),
        sphere(),
        Directive::ObjectEnd,
        sphere(),
    ]));
    assert_eq!(frame.lights.len(), 1);
    assert_eq!(frame.objects[0].shapes.len(), 1);
    assert_eq!(frame.shapes[0].world_from_object.start, DMat4::IDENTITY);
    assert!(!frame.shapes[0].reverse_orientation);
}

#[test]
fn a_redefined_object_leaves_earlier_instances_alone() {
    let frame = frame(world([
        Directive::ObjectBegin(name("o")),
        sphere(),
        Directive::ObjectEnd,
        Directive::ObjectInstance(name("o")),
        Directive::ObjectBegin(name("o")),
        sphere(),
        Directive::ObjectEnd,
        Directive::ObjectInstance(name("o")),
    ]));
    let placed: Vec<_> = frame
        .instances
        .iter()
        .map(|instance| instance.object.0)
        .collect();
    assert_eq!(placed, [0, 1]);
}

#[test]
fn unknown_objects_are_errors_with_a_suggestion_and_empty_ones_are_nothing() {
    let (description, diagnostics) = run(world([
        Directive::ObjectBegin(name("tree")),
        Directive::ObjectEnd,
        Directive::ObjectInstance(name("tree")),
        Directive::ObjectInstance(name("tre")),
    ]));
    assert!(description.frames[0].instances.is_empty());
    let finding = only(&diagnostics, "unknown-object");
    assert_eq!(
        (finding.severity, finding.span.unwrap().lo),
        (Severity::Error, 410)
    );
    assert_eq!(finding.notes[0].0.lo, 110);
}

#[test]
fn an_object_inside_an_object_is_an_error_and_takes_over() {
    let (description, diagnostics) = run(world([
        Directive::ObjectBegin(name("outer")),
        sphere(),
        Directive::ObjectBegin(name("inner")),
        sphere(),
        sphere(),
        Directive::ObjectEnd,
        sphere(),
        Directive::ObjectEnd,
    ]));
    let frame = &description.frames[0];
    let sizes: Vec<_> = frame
        .objects
        .iter()
        .map(|object| object.shapes.len())
        .collect();
    assert_eq!(sizes, [1, 2]);
    assert_eq!(
        frame.shapes.len(),
        1,
        "after the inner object no object is open"
    );
    assert_eq!(codes(&diagnostics), ["nested-object", "unmatched-end"]);
}

#[test]
fn an_instance_inside_an_object_is_an_error_and_ignored() {
    let (description, diagnostics) = run(world([
        Directive::ObjectBegin(name("o")),
        sphere(),
        Directive::ObjectInstance(name("o")),
        Directive::ObjectEnd,
    ]));
    assert!(description.frames[0].instances.is_empty());
    assert_eq!(
        only(&diagnostics, "nested-instance").severity,
        Severity::Error
    );
}
