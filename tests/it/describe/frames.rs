//! Frames: options, defaults, and worlds without end.

use glam::DMat4;
use tyndall_parser::directive::Directive;

use crate::describe::scene::{
    codes, frame, int, make_material, make_medium, media, name, only, plugin, run, sphere, string,
    texture, world,
};

#[test]
fn absent_options_hold_the_defaults_of_pbrt() {
    let frame = frame(world([]));
    let kinds = [
        &frame.film,
        &frame.filter,
        &frame.sampler,
        &frame.accelerator,
        &frame.integrator,
        &frame.camera.entity,
    ]
    .map(|entity| entity.kind.value.as_str());
    assert_eq!(
        kinds,
        ["image", "box", "halton", "bvh", "path", "perspective"]
    );
    assert_eq!(frame.transform_times, [0.0, 1.0]);
    assert_eq!(frame.camera.world_from_camera.start, DMat4::IDENTITY);
    assert_eq!(frame.materials[0].entity.kind.value, "matte");
}

#[test]
fn nothing_carries_over_from_one_frame_to_the_next() {
    let (description, diagnostics) = run(vec![
        Directive::TransformTimes([2.0, 3.0]),
        Directive::Film(plugin("image", [int("xresolution", 5)])),
        Directive::Camera(plugin("environment", [])),
        make_medium("fog", [string("type", "homogeneous")]),
        Directive::WorldBegin,
        make_material("m", [string("type", "mirror")]),
        texture("t", "float", "constant", []),
        Directive::ObjectBegin(name("o")),
        sphere(),
        Directive::ObjectEnd,
        Directive::ReverseOrientation,
        Directive::AttributeBegin,
        Directive::WorldEnd,
        Directive::WorldBegin,
        Directive::NamedMaterial(plugin("m", [])),
        media("fog", ""),
        Directive::ObjectInstance(name("o")),
        Directive::CoordSysTransform(name("camera")),
        sphere(),
        Directive::WorldEnd,
    ]);
    assert_eq!(
        codes(&diagnostics),
        [
            "unclosed-block",
            "unknown-material",
            "unknown-object",
            "unknown-coordinate-system",
            "unknown-medium"
        ]
    );
    let [first, second] = &description.frames[..] else {
        panic!()
    };
    assert_eq!(first.transform_times, [2.0, 3.0]);
    assert_eq!(second.transform_times, [0.0, 1.0]);
    assert_eq!(first.camera.entity.kind.value, "environment");
    assert_eq!(second.camera.entity.kind.value, "perspective");
    assert!(
        second.film.params.params.is_empty()
            && second.media.is_empty()
            && second.textures.is_empty()
    );
    assert!(!second.shapes[0].reverse_orientation);
}

#[test]
fn a_world_without_end_renders_nothing_and_says_so() {
    let (description, diagnostics) = run(vec![Directive::WorldBegin, sphere()]);
    assert!(description.frames.is_empty());
    assert_eq!(only(&diagnostics, "missing-world-end").span.unwrap().lo, 0);
}

#[test]
fn a_scene_without_a_world_says_so() {
    let (_, diagnostics) = run(vec![Directive::Identity]);
    assert_eq!(only(&diagnostics, "nothing-to-render").span.unwrap().lo, 0);
    let (_, diagnostics) = run(vec![]);
    assert_eq!(only(&diagnostics, "nothing-to-render").span, None);
}
