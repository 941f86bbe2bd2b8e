//! What moves, and what emits.

use tyndall_parser::diagnostic::Severity;
use tyndall_parser::directive::{ActiveTransform, Directive};

use crate::describe::scene::{
    frame, make_medium, name, only, plugin, run, sphere, string, texture, world,
};

#[test]
fn what_cannot_move_warns() {
    for directive in [
        Directive::LightSource(plugin("point", [])),
        texture("t", "float", "constant", []),
        make_medium("fog", [string("type", "homogeneous")]),
    ] {
        let (_, diagnostics) = run(world([
            Directive::ActiveTransform(ActiveTransform::EndTime),
            Directive::Translate([1.0, 0.0, 0.0]),
            directive,
        ]));
        assert_eq!(
            only(&diagnostics, "animation-ignored").span.unwrap().lo,
            300
        );
    }
}

#[test]
fn a_moving_shape_emits_nothing_and_warns() {
    let (description, diagnostics) = run(world([
        Directive::AreaLightSource(plugin("diffuse", [])),
        sphere(),
        Directive::ActiveTransform(ActiveTransform::EndTime),
        Directive::Translate([1.0, 0.0, 0.0]),
        sphere(),
    ]));
    let shapes = &description.frames[0].shapes;
    assert!(shapes[0].area_light.is_some());
    assert!(shapes[1].area_light.is_none());
    let finding = only(&diagnostics, "animated-area-light");
    assert_eq!(
        (
            finding.severity,
            finding.span.unwrap().lo,
            finding.notes[0].0.lo
        ),
        (Severity::Warning, 500, 100)
    );
}

#[test]
fn an_area_light_in_an_object_is_kept_and_warns_once() {
    let (description, diagnostics) = run(world([
        Directive::ObjectBegin(name("o")),
        Directive::AreaLightSource(plugin("diffuse", [])),
        sphere(),
        sphere(),
        Directive::ObjectEnd,
    ]));
    let object = &description.frames[0].objects[0];
    assert!(object.shapes.iter().all(|shape| shape.area_light.is_some()));
    assert_eq!(
        only(&diagnostics, "instanced-area-light").span.unwrap().lo,
        300
    );
}

#[test]
fn an_area_light_without_a_name_switches_emission_off() {
    let frame = frame(world([
        Directive::AreaLightSource(plugin("diffuse", [])),
        Directive::AreaLightSource(plugin("", [])),
        sphere(),
    ]));
    assert_eq!(frame.shapes[0].area_light, None);
    assert_eq!(frame.area_lights.len(), 1);
}
