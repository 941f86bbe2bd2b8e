//! Transforms, coordinate systems and the camera.

use glam::{DMat4, DVec3};
use tyndall::describe::description::{Frame, MediumRef};
use tyndall_parser::diagnostic::Severity;
use tyndall_parser::directive::{ActiveTransform, Directive};

use crate::describe::scene::{
    codes, frame, make_medium, media, name, only, plugin, point_at, run, sphere, string, world,
};

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
    let mut unbounded = DMat4::IDENTITY.to_cols_array();
    unbounded[12] = f64::INFINITY;
    for (directive, code) in [
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
        (Directive::Transform(unbounded), "not-finite"),
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

fn scaled(factors: [f64; 3]) -> Directive {
    Directive::Scale(factors)
}

/// Matrices without an inverse.
fn flattening() -> [Directive; 4] {
    let mut flat = DMat4::IDENTITY.to_cols_array();
    flat[5] = 0.0;
    let mut dependent = DMat4::IDENTITY.to_cols_array();
    dependent[..11].copy_from_slice(&[0.1, 0.2, 0.3, 0.0, 0.4, 0.5, 0.6, 0.0, 0.7, 0.8, 0.9]);
    [
        scaled([0.0; 3]),
        scaled([1.0, 0.0, 1.0]),
        Directive::Transform(flat),
        Directive::ConcatTransform(dependent),
    ]
}

#[test]
fn what_is_below_a_singular_transform_vanishes() {
    let light = || Directive::LightSource(plugin("point", []));
    for directive in flattening() {
        let (description, diagnostics) = run(world([
            Directive::ObjectBegin(name("o")),
            sphere(),
            Directive::ObjectEnd,
            Directive::AttributeBegin,
            directive.clone(),
            // Nothing brings space back but a new transform.
            Directive::Rotate {
                degrees: 30.0,
                axis: [1.0, 2.0, 3.0],
            },
            scaled([1e6, 1e-6, 1e3]),
            sphere(),
            light(),
            Directive::ObjectInstance(name("o")),
            Directive::CoordinateSystem(name("flat")),
            Directive::TransformBegin,
            Directive::Identity,
            sphere(),
            Directive::CoordSysTransform(name("flat")),
            sphere(),
            Directive::TransformEnd,
            Directive::AttributeEnd,
            sphere(),
        ]));
        let finding = only(&diagnostics, "singular-transform");
        assert_eq!(finding.severity, Severity::Warning, "{directive:?}");
        assert_eq!(finding.span.unwrap().lo, 500, "{directive:?}");
        let frame = &description.frames[0];
        assert_eq!(frame.shapes.len(), 2, "{directive:?}");
        assert!(frame.lights.is_empty() && frame.instances.is_empty());
        let left = frame
            .shapes
            .iter()
            .map(|shape| shape.world_from_object.start);
        assert!(left.into_iter().all(|matrix| matrix == DMat4::IDENTITY));
    }
}

#[test]
fn a_singular_transform_above_nothing_is_silent() {
    for directive in flattening() {
        let (description, diagnostics) = run(world([
            Directive::ObjectBegin(name("empty")),
            Directive::ObjectEnd,
            Directive::AttributeBegin,
            directive.clone(),
            Directive::ObjectInstance(name("empty")),
            Directive::Identity,
            sphere(),
            Directive::AttributeEnd,
        ]));
        assert_eq!(codes(&diagnostics), [""; 0], "{directive:?}");
        assert_eq!(description.frames[0].shapes.len(), 1);
    }
}

#[test]
fn a_shape_that_shrinks_to_nothing_vanishes() {
    let (description, diagnostics) = run(world([
        Directive::ActiveTransform(ActiveTransform::EndTime),
        scaled([0.0; 3]),
        sphere(),
        Directive::Identity,
        sphere(),
    ]));
    only(&diagnostics, "singular-transform");
    assert_eq!(description.frames[0].shapes.len(), 1);
}

#[test]
fn no_camera_stands_below_a_singular_transform() {
    let mut directives = vec![
        scaled([1.0, 1.0, 0.0]),
        Directive::Camera(plugin("perspective", [])),
    ];
    directives.extend(world([sphere()]));
    let (description, diagnostics) = run(directives);
    let finding = only(&diagnostics, "singular-transform");
    assert_eq!(finding.severity, Severity::Error);
    let camera = description.frames[0].camera.world_from_camera;
    assert_eq!(camera.start, DMat4::IDENTITY);
}

#[test]
fn a_projective_row_that_changes_nothing_is_a_warning() {
    let bent = |row: f64| {
        let mut bent = DMat4::from_translation(DVec3::X).to_cols_array();
        bent[3] = row;
        bent
    };
    // Nothing is below the first, and rounding hides the second.
    for directives in [
        vec![
            Directive::AttributeBegin,
            Directive::Transform(bent(0.5)),
            Directive::AttributeEnd,
            sphere(),
        ],
        vec![Directive::ConcatTransform(bent(1e-9)), sphere()],
    ] {
        let (description, diagnostics) = run(world(directives));
        let finding = only(&diagnostics, "projective-transform");
        assert_eq!(finding.severity, Severity::Warning);
        assert_eq!(description.frames[0].shapes.len(), 1);
    }
    // Far from the origin, as little matters.
    let mut far = bent(1e-9);
    far[12] = 1e6;
    let (_, diagnostics) = run(world([Directive::ConcatTransform(far), sphere()]));
    let finding = only(&diagnostics, "projective-transform");
    assert_eq!(finding.severity, Severity::Error);
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
