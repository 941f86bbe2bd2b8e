//! Mappings at known points, and their derivatives against differences.

use std::f64::consts::PI;

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec2};
use tyndall::math::Vec3;
use tyndall::texture::{Mapping2, Mapping3, UvMapping};
use tyndall_test_support::Uniform;

use crate::textures::at::{point, uv};

/// Turned, stretched and moved.
fn local_from_render() -> DAffine3 {
    DAffine3::from_scale_rotation_translation(
        DVec3::new(1.0, 2.0, 0.5),
        glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7),
        DVec3::new(0.1, -0.2, 0.3),
    )
}

fn mappings(local_from_render: DAffine3) -> [Mapping2; 3] {
    let planes = DMat3::from_cols(
        DVec3::new(0.5, 2.0, 0.0),
        DVec3::new(0.0, 1.0, -1.0),
        DVec3::ZERO,
    );
    [
        Mapping2::Spherical {
            sphere_from_render: local_from_render,
        },
        Mapping2::Cylindrical {
            cylinder_from_render: local_from_render,
        },
        Mapping2::Planar {
            st_from_render: DAffine3::from_mat3(planes.transpose()) * local_from_render,
        },
    ]
}

#[track_caller]
fn assert_near(actual: DVec2, expected: DVec2, tolerance: f64, what: &str) {
    assert!(
        actual.distance(expected) <= tolerance,
        "{what}: {actual} is not {expected}"
    );
}

#[test]
fn directions_have_their_angles() {
    let [sphere, cylinder, _] = mappings(DAffine3::IDENTITY);
    for (p, on_sphere, on_cylinder) in [
        ([2.0, 0.0, 0.0], (0.5, 0.0), (0.5, 0.0)),
        ([0.0, 3.0, 0.0], (0.5, 0.25), (0.75, 0.0)),
        ([-1.0, 0.0, 0.0], (0.5, 0.5), (1.0, 0.0)),
        ([0.0, -1.0, 0.0], (0.5, 0.75), (0.25, 0.0)),
        ([0.0, 0.0, 5.0], (0.0, 0.0), (0.5, 1.0)),
        ([0.0, 0.0, -5.0], (1.0, 0.0), (0.5, -1.0)),
        (
            [1.0, 1.0, 2f32.sqrt()],
            (0.25, 0.125),
            (0.625, 0.5f64.sqrt()),
        ),
    ] {
        let what = format!("{p:?}");
        let st = sphere.map(&point(p)).st;
        assert_near(st, on_sphere.into(), 1e-7, &what);
        let st = cylinder.map(&point(p)).st;
        assert_near(st, on_cylinder.into(), 1e-7, &what);
    }
}

#[test]
fn surface_parameters_are_scaled_and_shifted() {
    let mapping = Mapping2::Uv(UvMapping {
        scale: Vec2::new(4.0, -2.0),
        delta: Vec2::new(0.5, 8.0),
    });
    let mut at = uv(0.25, 3.0);
    (at.duv_dx, at.duv_dy) = ([0.5, 1.0], [2.0, -0.25]);
    let at = mapping.map(&at);
    assert_eq!(at.st, DVec2::new(1.5, 2.0));
    assert_eq!(at.dst_dx, Vec2::new(2.0, -2.0));
    assert_eq!(at.dst_dy, Vec2::new(8.0, 0.5));
}

#[test]
fn derivatives_are_those_of_the_coordinates() {
    let mut random = Uniform::new(7);
    for mapping in mappings(local_from_render()) {
        let solid = Mapping3 {
            texture_from_render: local_from_render(),
        };
        for _ in 0..500 {
            let mut next = || 2.0 * random.unit() - 1.0;
            let p = DVec3::new(next().into(), next().into(), next().into());
            let local = local_from_render().transform_point3(p);
            if local.truncate().length() < 0.2 {
                continue; // Coordinates turn fast around the axis: see below.
            }
            let mut ctx = point(p.as_vec3().to_array());
            ctx.dp_dx = Vec3::new(next(), next(), next()) * 0.01;
            ctx.dp_dy = Vec3::new(next(), next(), next()) * 0.01;
            let at = mapping.map(&ctx);
            let solid_at = solid.map(&ctx);
            for (dp, dst, solid_dp) in [
                (ctx.dp_dx, at.dst_dx, solid_at.dp_dx),
                (ctx.dp_dy, at.dst_dy, solid_at.dp_dy),
            ] {
                let step = dp * 0.01;
                let moved = |sign: f32| point((ctx.p + step * sign).into());
                let (after, before) = (moved(1.0), moved(-1.0));
                // What really was between the two points, in single precision.
                let share = (after.p - before.p).to_f64().length() / dp.to_f64().length();
                let mut difference = mapping.map(&after).st - mapping.map(&before).st;
                difference -= difference.round(); // The seam.
                let what = format!("{mapping:?} at {p}");
                assert_near(dst.as_dvec2() * share, difference, 2e-6, &what);
                let difference = solid.map(&after).p - solid.map(&before).p;
                assert!(
                    (solid_dp * share).distance(difference) < 1e-6,
                    "{what}: in space"
                );
            }
        }
    }
}

#[test]
fn the_seam_is_not_in_the_footprint_and_the_pole_spans_one_turn() {
    let [sphere, cylinder, _] = mappings(DAffine3::IDENTITY);
    // A hair beside the seam of both: +x for spheres, -x for cylinders.
    for (mapping, x) in [(sphere, 1.0), (cylinder, -1.0)] {
        let mut ctx = point([x, 1e-6, 0.0]);
        ctx.dp_dx = Vec3::new(0.0, -0.01, 0.0);
        let dst = mapping.map(&ctx).dst_dx.as_dvec2();
        let turn = DVec2::new(0.01 / (2.0 * PI), 0.0);
        let expected = if x > 0.0 {
            DVec2::new(0.0, -turn.x)
        } else {
            turn
        };
        assert_near(dst, expected, 1e-6, "beside the seam");
    }
    for p in [[0.0, 0.0, 1.0], [1e-8, 0.0, 1.0]] {
        let mut ctx = point(p);
        ctx.dp_dx = Vec3::new(0.0, 0.01, 0.0);
        let dst = sphere.map(&ctx).dst_dx;
        assert!(dst.is_finite() && dst.y == 1.0, "{dst}");
    }
    // Where no footprint is known, none is made up.
    assert_eq!(sphere.map(&point([0.0, 0.0, 1.0])).dst_dx, Vec2::ZERO);
}
