//! What the graphics state promises. Rows of pbrt-v3's sharp edges are named by their number.

#[path = "describe/scene.rs"]
mod scene;

use glam::{DMat4, DVec3};
use scene::{
    bool, codes, float, floats, frame, int, make_material, make_medium, media, name, only, plugin,
    points, rgb, run, sphere, string, texture, texture_param, world,
};
use std::path::Path;
use std::sync::Arc;
use tyndall::compile::reader::ParamReader;
use tyndall::describe::describe;
use tyndall::describe::description::{
    Entity, Frame, MaterialRef, MediumRef, ObjectRef, SceneDescription, ShapeEntity,
    TextureBinding, TextureRef, TextureType, TransformPair,
};
use tyndall_parser::diagnostic::{Severity, Style};
use tyndall_parser::directive::{ActiveTransform, Directive, Plugin};
use tyndall_parser::schema::Family;
use tyndall_parser::{LoadError, Loaded, Sources, parse};

fn point_at(matrix: DMat4, p: [f64; 3]) -> [f64; 3] {
    matrix.transform_point3(DVec3::from_array(p)).to_array()
}

// Transforms.

#[test]
fn transforms_multiply_on_the_right() {
    let frame = frame(world([
        Directive::Translate([1.0, 2.0, 3.0]),
        Directive::Scale([2.0, 2.0, 2.0]),
        sphere(),
    ]));
    let p = point_at(frame.shapes[0].world_from_object.start, [1.0, 0.0, 0.0]);
    assert_eq!(p, [3.0, 2.0, 3.0]);
}

#[test]
fn transform_replaces_and_concat_transform_multiplies_column_major() {
    let mut moved = DMat4::IDENTITY.to_cols_array();
    moved[12] = 5.0;
    let frame = frame(world([
        Directive::Scale([2.0, 2.0, 2.0]),
        Directive::ConcatTransform(moved),
        sphere(),
        Directive::Transform(moved),
        sphere(),
    ]));
    assert_eq!(
        point_at(frame.shapes[0].world_from_object.start, [0.0; 3]),
        [10.0, 0.0, 0.0]
    );
    assert_eq!(
        point_at(frame.shapes[1].world_from_object.start, [0.0; 3]),
        [5.0, 0.0, 0.0]
    );
}

#[test]
fn rotate_follows_the_right_hand_rule_about_an_axis_of_any_length() {
    for length in [1e-30, 1.0, 1e30] {
        let frame = frame(world([
            Directive::Rotate {
                degrees: 90.0,
                axis: [0.0, 0.0, length],
            },
            sphere(),
        ]));
        let p = DVec3::from(point_at(
            frame.shapes[0].world_from_object.start,
            [1.0, 0.0, 0.0],
        ));
        assert!((p - DVec3::Y).length() < 1e-15, "{p}");
    }
}

#[test]
fn identity_and_later_transforms_change_only_the_active_one() {
    let frame = frame(world([
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::ActiveTransform(ActiveTransform::EndTime),
        Directive::Translate([0.0, 1.0, 0.0]),
        sphere(),
        Directive::Identity,
        sphere(),
        Directive::ActiveTransform(ActiveTransform::StartTime),
        Directive::Translate([0.0, 0.0, 1.0]),
        sphere(),
    ]));
    let origins = |i: usize| {
        let pair = frame.shapes[i].world_from_object;
        (point_at(pair.start, [0.0; 3]), point_at(pair.end, [0.0; 3]))
    };
    assert_eq!(origins(0), ([1.0, 0.0, 0.0], [1.0, 1.0, 0.0]));
    assert_eq!(origins(1), ([1.0, 0.0, 0.0], [0.0; 3]));
    assert_eq!(origins(2), ([1.0, 0.0, 1.0], [0.0; 3]));
    assert!(frame.shapes[0].world_from_object.is_animated());
}

fn camera_frame(look_at: Directive) -> Frame {
    frame(vec![
        look_at,
        Directive::Camera(plugin("perspective", [])),
        Directive::WorldBegin,
        Directive::WorldEnd,
    ])
}

#[test]
fn look_at_makes_a_left_handed_camera_at_the_eye() {
    let frame = camera_frame(Directive::LookAt {
        eye: [1.0, 2.0, 3.0],
        target: [1.0, 2.0, 8.0],
        up: [0.0, 1.0, 0.0],
    });
    let camera = frame.camera.world_from_camera.start;
    assert_eq!(point_at(camera, [0.0; 3]), [1.0, 2.0, 3.0]);
    assert_eq!(point_at(camera, [1.0, 1.0, 1.0]), [2.0, 3.0, 4.0]);
    let frame = camera_frame(Directive::LookAt {
        eye: [5.0, 0.0, 0.0],
        target: [0.0; 3],
        up: [0.0, 0.0, 2.0],
    });
    let camera = frame.camera.world_from_camera.start;
    let (right, up) = (camera.x_axis.truncate(), camera.y_axis.truncate());
    assert_eq!(right.to_array(), [0.0, -1.0, 0.0], "up × forward");
    assert_eq!(up.to_array(), [0.0, 0.0, 1.0]);
}

#[test]
fn look_at_from_far_away_keeps_the_eye() {
    let eye = [1e6, 1e6 + 0.125, -1e6];
    let frame = camera_frame(Directive::LookAt {
        eye,
        target: [0.3, 0.7, 0.1],
        up: [0.0, 1.0, 0.0],
    });
    let camera = frame.camera.world_from_camera.start;
    let error = (DVec3::from(point_at(camera, [0.0; 3])) - DVec3::from(eye)).length();
    assert!(error < 1e-8, "{error:e}");
    assert!((camera.z_axis.truncate().length() - 1.0).abs() < 1e-14);
}

#[test]
fn look_at_with_up_along_the_view_warns_and_takes_some_perpendicular() {
    for up in [[0.0, 0.0, 1.0], [0.0, 0.0, -3.0], [0.0; 3]] {
        let (description, diagnostics) = run(vec![
            Directive::LookAt {
                eye: [0.0; 3],
                target: [0.0, 0.0, 5.0],
                up,
            },
            Directive::Camera(plugin("perspective", [])),
            Directive::WorldBegin,
            Directive::WorldEnd,
        ]);
        let finding = only(&diagnostics, "degenerate-look-at");
        assert_eq!(
            (finding.severity, finding.span.unwrap().lo),
            (Severity::Warning, 0)
        );
        let camera = description.frames[0].camera.world_from_camera.start;
        assert_eq!(camera.z_axis.truncate(), DVec3::Z);
        assert!(
            (camera.determinant() - 1.0).abs() < 1e-12,
            "x × y = z in these axes"
        );
    }
}

#[test]
fn degenerate_and_non_finite_transforms_are_located_and_left_out() {
    let mut flat = DMat4::IDENTITY.to_cols_array();
    flat[5] = 0.0;
    let mut dependent = DMat4::IDENTITY.to_cols_array();
    dependent[..11].copy_from_slice(&[0.1, 0.2, 0.3, 0.0, 0.4, 0.5, 0.6, 0.0, 0.7, 0.8, 0.9]);
    let mut unbounded = DMat4::IDENTITY.to_cols_array();
    unbounded[12] = f64::INFINITY;
    for (directive, code) in [
        (Directive::Scale([0.0, 1.0, 1.0]), "singular-transform"),
        (Directive::Scale([1.0, f64::NAN, 1.0]), "not-finite"),
        (
            Directive::Translate([f64::INFINITY, 0.0, 0.0]),
            "not-finite",
        ),
        (
            Directive::Rotate {
                degrees: 30.0,
                axis: [0.0; 3],
            },
            "zero-axis",
        ),
        (
            Directive::Rotate {
                degrees: f64::NAN,
                axis: [0.0, 0.0, 1.0],
            },
            "not-finite",
        ),
        (
            Directive::LookAt {
                eye: [1.0; 3],
                target: [1.0; 3],
                up: [0.0, 1.0, 0.0],
            },
            "degenerate-look-at",
        ),
        (
            Directive::LookAt {
                eye: [1.0; 3],
                target: [f64::NAN; 3],
                up: [0.0, 1.0, 0.0],
            },
            "not-finite",
        ),
        (Directive::Transform(flat), "singular-transform"),
        (Directive::Transform(unbounded), "not-finite"),
        (Directive::ConcatTransform(dependent), "singular-transform"),
        (Directive::ConcatTransform([f64::NAN; 16]), "not-finite"),
    ] {
        let (description, diagnostics) = run(world([
            Directive::Translate([1.0, 2.0, 3.0]),
            directive.clone(),
            sphere(),
        ]));
        let finding = only(&diagnostics, code);
        assert_eq!(finding.severity, Severity::Error, "{directive:?}");
        assert_eq!(finding.span.unwrap().lo, 200, "{directive:?}");
        let left = description.frames[0].shapes[0].world_from_object.start;
        assert_eq!(
            left,
            DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)),
            "{directive:?}"
        );
    }
}

#[test]
fn transforms_that_overflow_or_collapse_together_are_located() {
    for factor in [1e30, 1e-30] {
        let (description, diagnostics) = run(world([
            Directive::Scale([factor; 3]),
            Directive::Scale([factor; 3]),
            sphere(),
        ]));
        assert_eq!(only(&diagnostics, "out-of-range").span.unwrap().lo, 200);
        let start = description.frames[0].shapes[0].world_from_object.start;
        assert_eq!(start.x_axis.x, factor);
    }
}

#[test]
fn small_and_stretched_transforms_are_not_taken_for_singular() {
    let (description, diagnostics) = run(world([
        Directive::Scale([1e-20, 1e-20, 1e-20]),
        Directive::Scale([1.0, 1e6, 1e-6]),
        Directive::Rotate {
            degrees: 45.0,
            axis: [1.0, 1.0, 1.0],
        },
        sphere(),
    ]));
    assert_eq!(codes(&diagnostics), [""; 0]);
    assert_eq!(description.frames[0].shapes.len(), 1);
}

#[test]
fn a_projective_matrix_is_reported_and_made_affine() {
    let mut doubled = (DMat4::from_translation(DVec3::X) * 2.0).to_cols_array();
    let clean = frame(world([Directive::Transform(doubled), sphere()]));
    assert_eq!(
        clean.shapes[0].world_from_object.start,
        DMat4::from_translation(DVec3::X)
    );
    doubled[3] = 0.5;
    let (description, diagnostics) = run(world([Directive::Transform(doubled), sphere()]));
    assert_eq!(
        only(&diagnostics, "projective-transform").severity,
        Severity::Error
    );
    let start = description.frames[0].shapes[0].world_from_object.start;
    assert_eq!(start, DMat4::from_translation(DVec3::X));
}

#[test]
fn coordinate_systems_hold_both_transforms_and_ignore_which_is_active() {
    let frame = frame(world([
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::CoordinateSystem(name("here")),
        Directive::Identity,
        Directive::ActiveTransform(ActiveTransform::EndTime),
        Directive::CoordSysTransform(name("here")),
        sphere(),
    ]));
    let pair = frame.shapes[0].world_from_object;
    assert_eq!(point_at(pair.start, [0.0; 3]), [1.0, 0.0, 0.0]);
    assert_eq!(pair.start, pair.end);
}

#[test]
fn the_camera_leaves_camera_to_world_as_a_coordinate_system() {
    let frame = frame(vec![
        Directive::LookAt {
            eye: [0.0, 0.0, -5.0],
            target: [0.0; 3],
            up: [0.0, 1.0, 0.0],
        },
        Directive::Camera(plugin("perspective", [])),
        Directive::WorldBegin,
        Directive::CoordSysTransform(name("camera")),
        sphere(),
        Directive::Translate([1.0, 1.0, 1.0]),
        Directive::CoordSysTransform(name("world")),
        sphere(),
        Directive::WorldEnd,
    ]);
    assert_eq!(
        point_at(frame.shapes[0].world_from_object.start, [0.0; 3]),
        [0.0, 0.0, -5.0]
    );
    assert_eq!(frame.shapes[1].world_from_object.start, DMat4::IDENTITY);
}

#[test]
fn an_unknown_coordinate_system_is_an_error_that_suggests_one() {
    let (description, diagnostics) = run(world([
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::CoordinateSystem(name("lamp")),
        Directive::CoordSysTransform(name("Lamp")),
        sphere(),
    ]));
    let finding = only(&diagnostics, "unknown-coordinate-system");
    assert_eq!(
        (finding.severity, finding.span.unwrap().lo),
        (Severity::Error, 310)
    );
    assert_eq!(finding.help.as_deref(), Some("did you mean \"lamp\"?"));
    assert_eq!(finding.notes[0].0.lo, 210);
    let start = description.frames[0].shapes[0].world_from_object.start;
    assert_eq!(point_at(start, [0.0; 3]), [1.0, 0.0, 0.0]);
}

#[test]
fn world_begin_resets_transforms_and_keeps_the_graphics_state() {
    let frame = frame(vec![
        Directive::Translate([1.0, 0.0, 0.0]),
        Directive::ActiveTransform(ActiveTransform::EndTime),
        make_medium("fog", [string("type", "homogeneous")]),
        media("fog", ""),
        Directive::WorldBegin,
        Directive::Translate([0.0, 1.0, 0.0]),
        sphere(),
        Directive::WorldEnd,
    ]);
    let pair = frame.shapes[0].world_from_object;
    assert_eq!(point_at(pair.start, [0.0; 3]), [0.0, 1.0, 0.0]);
    assert_eq!(pair.start, pair.end);
    assert_eq!(frame.shapes[0].media.inside, Some(MediumRef(0)));
}

#[test]
fn a_scaled_camera_warns() {
    let (_, diagnostics) = run(vec![
        Directive::Scale([-1.0, 1.0, 1.0]),
        Directive::Camera(plugin("perspective", [])),
        Directive::Scale([2.0, 2.0, 2.0]),
        Directive::Camera(plugin("perspective", [])),
        Directive::WorldBegin,
        Directive::WorldEnd,
    ]);
    assert_eq!(
        only(&diagnostics, "scaled-camera").span.unwrap().lo,
        300,
        "a mirror is no scale"
    );
}

// Blocks.

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

// Frames.

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

// Textures and materials.

#[test]
fn float_and_spectrum_textures_are_separate_and_resolved_where_they_are_used() {
    let frame = frame(world([
        texture("t", "float", "constant", []),
        texture("t", "color", "constant", []),
        Directive::Material(plugin("matte", [rgb("Ks", 1.0), texture_param("Kd", "t")])),
    ]));
    let binding = &frame.materials[1].entity.textures[0];
    assert_eq!(
        (binding.param, binding.float, binding.spectrum),
        (1, Some(TextureRef(0)), Some(TextureRef(1)))
    );
}

#[test]
fn textures_are_scoped_and_users_keep_the_one_they_were_made_with() {
    let (description, diagnostics) = run(world([
        texture("t", "float", "constant", [float("value", 1.0)]),
        Directive::AttributeBegin,
        Directive::Material(plugin("matte", [texture_param("sigma", "t")])),
        texture("t", "float", "constant", [float("value", 2.0)]),
        Directive::Material(plugin("matte", [texture_param("sigma", "t")])),
        Directive::AttributeEnd,
        Directive::Material(plugin("matte", [texture_param("sigma", "t")])),
    ]));
    let bound: Vec<_> = description.frames[0].materials[1..]
        .iter()
        .map(|m| m.entity.textures[0].float.unwrap().0)
        .collect();
    assert_eq!(bound, [0, 1, 0]);
    let finding = only(&diagnostics, "redefined");
    assert_eq!(
        (
            finding.severity,
            finding.span.unwrap().lo,
            finding.notes[0].0.lo
        ),
        (Severity::Warning, 410, 110)
    );
}

#[test]
fn a_texture_sees_only_earlier_textures() {
    let frame = frame(world([
        texture("a", "float", "scale", [texture_param("tex1", "b")]),
        texture("b", "float", "scale", [texture_param("tex1", "a")]),
    ]));
    assert_eq!(frame.textures[0].entity.textures[0].float, None);
    assert_eq!(
        frame.textures[1].entity.textures[0].float,
        Some(TextureRef(0))
    );
}

#[test]
fn an_unknown_texture_is_no_finding_here_but_leaves_its_near_miss() {
    let (description, diagnostics) = run(world([
        texture("wood", "spectrum", "constant", []),
        Directive::Material(plugin("matte", [texture_param("Kd", "woood")])),
    ]));
    assert_eq!(codes(&diagnostics), [""; 0]);
    let near = description.frames[0].materials[1].entity.textures[0]
        .near_miss
        .as_ref()
        .unwrap();
    assert_eq!((near.value.as_str(), near.span.lo), ("wood", 110));
}

#[test]
fn textures_that_cannot_be_are_reported_and_not_stored() {
    for (value_type, class, code, severity) in [
        ("float", "constnt", "unknown-plugin", Severity::Error),
        (
            "colour",
            "constant",
            "unknown-texture-type",
            Severity::Error,
        ),
        // Quirk 44, where pbrt-v3 is silent.
        ("float", "uv", "unknown-plugin", Severity::Error),
        ("float", "marble", "unknown-plugin", Severity::Error),
    ] {
        let (description, diagnostics) = run(world([texture("t", value_type, class, [])]));
        assert_eq!(only(&diagnostics, code).severity, severity);
        assert!(diagnostics.list[0].help.is_some());
        assert!(description.frames[0].textures.is_empty());
    }
}

#[test]
fn named_materials_are_scoped() {
    let (description, diagnostics) = run(world([
        Directive::AttributeBegin,
        make_material("steel", [string("type", "metal")]),
        Directive::NamedMaterial(plugin("steel", [])),
        sphere(),
        Directive::AttributeEnd,
        Directive::NamedMaterial(plugin("steel", [])),
        sphere(),
    ]));
    let shapes = &description.frames[0].shapes;
    assert_eq!(
        (shapes[0].material, shapes[1].material),
        (MaterialRef(1), MaterialRef(0))
    );
    assert_eq!(
        only(&diagnostics, "unknown-material").severity,
        Severity::Error
    );
}

#[test]
fn an_unknown_named_material_keeps_the_current_one_and_suggests() {
    let (description, diagnostics) = run(world([
        make_material("steel", [string("type", "metal")]),
        Directive::Material(plugin("mirror", [])),
        Directive::NamedMaterial(plugin("stel", [])),
        sphere(),
    ]));
    assert_eq!(description.frames[0].shapes[0].material, MaterialRef(2));
    let finding = only(&diagnostics, "unknown-material");
    assert_eq!(finding.span.unwrap().lo, 310);
    assert_eq!(finding.help.as_deref(), Some("did you mean \"steel\"?"));
    assert_eq!(finding.notes[0].0.lo, 110);
}

#[test]
fn redefining_a_named_material_warns_and_shapes_keep_theirs() {
    let (description, diagnostics) = run(world([
        make_material("m", [string("type", "metal")]),
        Directive::NamedMaterial(plugin("m", [])),
        make_material("m", [string("type", "glass")]),
        sphere(),
        Directive::NamedMaterial(plugin("m", [])),
        sphere(),
    ]));
    let shapes = &description.frames[0].shapes;
    assert_eq!(
        (shapes[0].material, shapes[1].material),
        (MaterialRef(1), MaterialRef(2))
    );
    assert_eq!(only(&diagnostics, "redefined").notes[0].0.lo, 110);
}

/// Quirk 9.
#[test]
fn q09_a_named_material_without_type_is_an_error_and_the_null_material() {
    let (description, diagnostics) = run(world([
        make_material("m", [rgb("Kd", 1.0)]),
        Directive::NamedMaterial(plugin("m", [])),
        sphere(),
    ]));
    assert_eq!(
        only(&diagnostics, "missing-parameter").severity,
        Severity::Error
    );
    let frame = &description.frames[0];
    assert_eq!(
        frame.materials[frame.shapes[0].material.0 as usize]
            .entity
            .kind
            .value,
        ""
    );
}

#[test]
fn the_null_material_goes_by_two_names() {
    let (description, diagnostics) = run(world([
        Directive::Material(plugin("", [])),
        Directive::Material(plugin("none", [])),
    ]));
    assert_eq!(codes(&diagnostics), [""; 0]);
    let kinds: Vec<_> = description.frames[0].materials[1..]
        .iter()
        .map(|m| m.entity.kind.value.as_str())
        .collect();
    assert_eq!(kinds, ["", "none"]);
}

#[test]
fn an_unknown_material_is_matte_with_a_suggestion() {
    let (description, diagnostics) = run(world([
        Directive::Material(plugin("gless", [rgb("Kd", 0.2)])),
        sphere(),
    ]));
    let finding = only(&diagnostics, "unknown-plugin");
    assert_eq!(finding.severity, Severity::Error);
    assert_eq!(finding.help.as_deref(), Some("did you mean \"glass\"?"));
    let material = &description.frames[0].materials[1].entity;
    assert_eq!(
        (material.kind.value.as_str(), material.params.params.len()),
        ("matte", 1)
    );
}

#[test]
fn a_mix_names_materials_where_it_is_made() {
    let (description, diagnostics) = run(world([
        make_material("a", [string("type", "metal")]),
        make_material(
            "m",
            [
                string("namedmaterial2", "a"),
                string("type", "mix"),
                string("namedmaterial1", "unknown thing"),
            ],
        ),
        make_material("a", [string("type", "glass")]),
        Directive::Material(plugin("mix", [string("namedmaterial1", "a")])),
    ]));
    let frame = &description.frames[0];
    assert_eq!(
        frame.materials[2].materials,
        [(2, None), (0, Some(MaterialRef(1)))]
    );
    assert_eq!(frame.materials[4].materials, [(0, Some(MaterialRef(3)))]);
    assert_eq!(
        codes(&diagnostics),
        ["unknown-material", "redefined", "missing-parameter"]
    );
}

#[test]
fn parameters_of_named_material_are_reported() {
    let (_, diagnostics) = run(world([
        make_material("m", [string("type", "metal")]),
        Directive::NamedMaterial(plugin("m", [float("roughness", 0.1)])),
    ]));
    assert_eq!(only(&diagnostics, "unused-parameter").span.unwrap().lo, 220);
}

/// Quirk 13.
#[test]
fn q13_a_shape_seems_to_override_its_material_by_what_it_carries() {
    for (params, private) in [
        (vec![], false),
        (vec![float("radius", 2.0)], false),
        (vec![float("zmin", -1.0)], true),
        (vec![floats("zmin", &[1.0, 2.0])], false),
        (
            vec![
                texture_param("alpha", "t"),
                texture_param("shadowalpha", "t"),
            ],
            false,
        ),
        (vec![texture_param("Kd", "t")], true),
        (
            vec![
                string("filename", "a.ply"),
                string("type", "flat"),
                string("scheme", "loop"),
            ],
            false,
        ),
        (vec![string("basis", "bezier")], true),
        (vec![int("levels", 3)], true),
        (vec![bool("remaproughness", true)], true),
        (vec![rgb("Kd", 0.5)], true),
        (vec![points("P", 1)], true),
        (vec![points("P", 3)], false),
    ] {
        let shape = Directive::Shape(plugin("sphere", params.clone()));
        let (description, _) = run(world([shape]));
        assert_eq!(
            description.frames[0].shapes[0].private_material.is_some(),
            private,
            "{params:?}"
        );
    }
}

/// Quirk 13: the textures of the copy are those visible at the shape.
#[test]
fn q13_a_private_material_sees_the_textures_at_the_shape() {
    let (description, _) = run(world([
        texture("t", "float", "constant", []),
        Directive::Material(plugin("matte", [texture_param("sigma", "t")])),
        texture("t", "float", "constant", []),
        Directive::Shape(plugin("sphere", [float("zmin", -0.5)])),
        sphere(),
    ]));
    let frame = &description.frames[0];
    assert_eq!(
        frame.materials[1].entity.textures[0].float,
        Some(TextureRef(0))
    );
    assert_eq!(
        frame.shapes[0].private_material.as_ref().unwrap()[0].float,
        Some(TextureRef(1))
    );
    assert_eq!(frame.shapes[1].private_material, None);
}

#[test]
fn material_parameters_are_stored_once_for_many_shapes() {
    let frame = frame(world([
        Directive::Material(plugin("matte", [rgb("Kd", 0.2)])),
        sphere(),
        sphere(),
        sphere(),
    ]));
    assert_eq!(frame.materials.len(), 2);
    assert!(
        frame
            .shapes
            .iter()
            .all(|shape| shape.material == MaterialRef(1))
    );
}

#[test]
fn meshes_are_moved_not_copied() {
    let mesh = points("P", 1000);
    let address = |value: &tyndall_parser::params::ParamValue| match value {
        tyndall_parser::params::ParamValue::Point3(items) => items.as_ptr(),
        _ => panic!(),
    };
    let before = address(&mesh.value);
    let (description, _) = run(world([Directive::Shape(plugin("trianglemesh", [mesh]))]));
    assert_eq!(
        address(&description.frames[0].shapes[0].entity.params.params[0].value),
        before
    );
}

// Media.

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

// Motion and area lights.

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

// Objects.

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
    let total =
        instance.world_from_instance.start * frame.objects[0].shapes[0].world_from_object.start;
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

// Size.

#[test]
fn many_scopes_and_many_mistakes_take_linear_time() {
    let mut directives = Vec::new();
    for i in 0..20_000 {
        directives.push(Directive::AttributeBegin);
        directives.push(texture(&format!("t{i}"), "float", "constant", []));
        directives.push(Directive::NamedMaterial(plugin(&format!("m{i}"), [])));
        directives.push(make_material(&format!("n{i}"), [string("type", "matte")]));
    }
    let start = std::time::Instant::now();
    let (description, diagnostics) = run(world(directives));
    assert_eq!(description.frames[0].textures.len(), 20_000);
    assert_eq!(diagnostics.list.len(), 40_000);
    assert!(start.elapsed().as_secs() < 10, "{:?}", start.elapsed());
}

// Hostile input.

/// A small deterministic generator: Knuth's 64-bit linear congruence, upper bits.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 33) as usize % sides
    }

    fn number(&mut self) -> f64 {
        const NUMBERS: [f64; 12] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            90.0,
            1e-30,
            1e30,
            1e300,
            f64::NAN,
            f64::INFINITY,
            1e-300,
        ];
        NUMBERS[self.roll(NUMBERS.len())]
    }

    fn triple(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.number())
    }

    fn word(&mut self) -> &'static str {
        const WORDS: [&str; 12] = [
            "a",
            "b",
            "A",
            "",
            "camera",
            "world",
            "mix",
            "matte",
            "none",
            "homogeneous",
            "constant",
            "float",
        ];
        WORDS[self.roll(WORDS.len())]
    }

    fn plugin(&mut self) -> Plugin {
        let params: Vec<_> = (0..self.roll(4))
            .map(|_| match self.roll(6) {
                0 => string("type", self.word()),
                1 => string("namedmaterial1", self.word()),
                2 => texture_param("Kd", self.word()),
                3 => float("radius", self.number() as f32),
                4 => points("P", self.roll(3)),
                _ => rgb("Kd", 0.5),
            })
            .collect();
        plugin(self.word(), params)
    }

    fn directive(&mut self) -> Directive {
        match self.roll(36) {
            0 => Directive::Identity,
            1 => Directive::Translate(self.triple()),
            2 => Directive::Scale(self.triple()),
            3 => Directive::Rotate {
                degrees: self.number(),
                axis: self.triple(),
            },
            4 => Directive::LookAt {
                eye: self.triple(),
                target: self.triple(),
                up: self.triple(),
            },
            5 => Directive::Transform(std::array::from_fn(|_| self.number())),
            6 => Directive::ConcatTransform(std::array::from_fn(|_| self.number())),
            7 => Directive::CoordinateSystem(name(self.word())),
            8 => Directive::CoordSysTransform(name(self.word())),
            9 => Directive::ActiveTransform(ActiveTransform::EndTime),
            10 => Directive::ActiveTransform(ActiveTransform::All),
            11 => Directive::TransformTimes([self.number(), self.number()]),
            12 => Directive::Film(self.plugin()),
            13 => Directive::Camera(self.plugin()),
            14 => Directive::MakeNamedMedium(self.plugin()),
            15 => media(self.word(), self.word()),
            16 | 17 => Directive::WorldBegin,
            18 if self.roll(8) == 0 => Directive::WorldEnd,
            18 => Directive::ObjectEnd,
            19 => Directive::AttributeBegin,
            20 => Directive::AttributeEnd,
            21 => Directive::TransformBegin,
            22 => Directive::TransformEnd,
            23 | 24 => texture(
                self.word(),
                "float",
                self.word(),
                [texture_param("tex1", self.word())],
            ),
            25 => texture(self.word(), "color", "constant", []),
            26 => Directive::Material(self.plugin()),
            27 => Directive::MakeNamedMaterial(self.plugin()),
            28 => Directive::NamedMaterial(self.plugin()),
            29 => Directive::LightSource(self.plugin()),
            30 => Directive::AreaLightSource(self.plugin()),
            31 => Directive::ReverseOrientation,
            32 => Directive::ObjectBegin(name(self.word())),
            33 => Directive::ObjectEnd,
            34 => Directive::ObjectInstance(name(self.word())),
            _ => Directive::Shape(self.plugin()),
        }
    }
}

/// Every reference leads somewhere, textures and mixes only to what came before, and every transform can be inverted.
fn assert_sound(frame: &Frame) {
    let usable = |pair: TransformPair| {
        assert!(
            [pair.start, pair.end]
                .iter()
                .all(|m| m.is_finite() && m.inverse().is_finite())
        );
    };
    let bound = |bindings: &[TextureBinding], limit: usize| {
        for texture in bindings
            .iter()
            .flat_map(|binding| [binding.float, binding.spectrum])
            .flatten()
        {
            assert!((texture.0 as usize) < limit);
        }
    };
    let shape = |shape: &ShapeEntity| {
        usable(shape.world_from_object);
        bound(&shape.entity.textures, frame.textures.len());
        bound(
            shape.private_material.as_deref().unwrap_or_default(),
            frame.textures.len(),
        );
        assert!((shape.material.0 as usize) < frame.materials.len());
        assert!(
            shape
                .area_light
                .is_none_or(|light| (light.0 as usize) < frame.area_lights.len())
        );
        for medium in [shape.media.inside, shape.media.outside]
            .into_iter()
            .flatten()
        {
            assert!((medium.0 as usize) < frame.media.len());
        }
    };
    frame
        .shapes
        .iter()
        .chain(frame.objects.iter().flat_map(|object| &object.shapes))
        .for_each(shape);
    for (index, texture) in frame.textures.iter().enumerate() {
        bound(&texture.entity.textures, index);
    }
    for (index, material) in frame.materials.iter().enumerate() {
        bound(&material.entity.textures, frame.textures.len());
        assert!(
            material
                .materials
                .iter()
                .all(|(_, part)| part.is_none_or(|part| (part.0 as usize) < index))
        );
    }
    for instance in &frame.instances {
        usable(instance.world_from_instance);
        assert!(!frame.objects[instance.object.0 as usize].shapes.is_empty());
    }
    usable(frame.camera.world_from_camera);
    assert!(
        frame
            .camera
            .medium
            .is_none_or(|medium| (medium.0 as usize) < frame.media.len())
    );
    assert!(frame.transform_times.iter().all(|time| time.is_finite()));
}

#[test]
fn any_sequence_of_directives_makes_a_sound_description() {
    let (mut n_frames, mut n_shapes, mut n_instances) = (0, 0, 0);
    for seed in 0..2000 {
        let mut dice = Dice(seed);
        let directives = (0..300).map(|_| dice.directive()).collect();
        let (description, _) = run(directives);
        for frame in &description.frames {
            assert_sound(frame);
            n_shapes += frame.shapes.len();
            n_instances += frame.instances.len();
        }
        n_frames += description.frames.len();
    }
    assert!(
        n_frames > 1000 && n_shapes > 1000 && n_instances > 100,
        "{n_frames} {n_shapes} {n_instances}"
    );
}

// Published scenes.

/// Reads a scene with its includes and finds unknown plugins and parameters without effect in all of it.
fn findings_of(path: &Path) -> (SceneDescription, String) {
    let mut sources = Sources::new();
    let file = sources.add_text(path.display().to_string(), std::fs::read(path).unwrap());
    let loader = |included: &str, top: &str| {
        let path = Path::new(top).parent().unwrap().join(included);
        let bytes = std::fs::read(&path).map_err(|error| LoadError::new(error.to_string()))?;
        Ok(Loaded {
            name: path.display().to_string(),
            bytes: Arc::new(bytes),
        })
    };
    let (scene, mut found) = parse(&mut sources, file, &loader);
    let (description, more) = describe(scene);
    found.list.extend(more.list);
    let mut check = |family: Family, entity: &Entity| match family.lookup(&entity.kind) {
        Ok(plugin) => ParamReader::new(plugin, entity, &mut found).finish(),
        Err(finding) => found.push(*finding),
    };
    for frame in &description.frames {
        check(Family::Camera, &frame.camera.entity);
        check(Family::Film, &frame.film);
        check(Family::Filter, &frame.filter);
        check(Family::Sampler, &frame.sampler);
        check(Family::Accelerator, &frame.accelerator);
        check(Family::Integrator, &frame.integrator);
        frame
            .media
            .iter()
            .for_each(|medium| check(Family::Medium, &medium.entity));
        frame
            .materials
            .iter()
            .for_each(|material| check(Family::Material, &material.entity));
        frame
            .lights
            .iter()
            .for_each(|light| check(Family::Light, &light.entity));
        frame
            .area_lights
            .iter()
            .for_each(|light| check(Family::AreaLight, light));
        frame
            .shapes
            .iter()
            .for_each(|shape| check(Family::Shape, &shape.entity));
        for texture in &frame.textures {
            let family = match texture.value_type {
                TextureType::Float => Family::FloatTexture,
                TextureType::Spectrum => Family::SpectrumTexture,
            };
            check(family, &texture.entity);
        }
    }
    (description, found.render(&sources, Style::Plain))
}

#[test]
#[expect(clippy::print_stdout, reason = "a skipped test says so")]
fn published_scenes_have_nothing_to_complain_about() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    let Ok(folders) = std::fs::read_dir(&scenes) else {
        println!("skipped: no scenes at {}", scenes.display());
        return;
    };
    let files = folders
        .flatten()
        .filter_map(|folder| std::fs::read_dir(folder.path()).ok());
    let mut n_scenes = 0;
    for path in files
        .flat_map(|files| files.flatten())
        .map(|file| file.path())
    {
        let is_scene = path
            .extension()
            .is_some_and(|extension| extension == "pbrt");
        // Parts that scenes include are no scenes.
        if !is_scene
            || ["geometry", "materials"]
                .iter()
                .any(|part| path.file_stem().unwrap() == *part)
        {
            continue;
        }
        let (description, findings) = findings_of(&path);
        assert_eq!(findings, "", "{}", path.display());
        assert_eq!(description.frames.len(), 1, "{}", path.display());
        assert!(
            !description.frames[0].shapes.is_empty(),
            "{}",
            path.display()
        );
        n_scenes += 1;
    }
    assert!(n_scenes > 10, "{n_scenes}");
}
