//! Extreme sizes and distances.

use std::f64::consts::PI;

use glam::{DAffine3, DQuat, DVec3};
use tyndall::math::{Point3, Ray, Transform, Vec3};
use tyndall::sampling::warp::{uniform_sphere, uniform_triangle};
use tyndall::shape::quadric::{Disk, Form, Sphere};
use tyndall::shape::{ElementHit, Mesh, Quadric, RayShear, Shape};
use tyndall::world::spawn_ray;
use tyndall_test_support::Uniform;

use crate::common::probe::{assert_exact, assert_mean};
use crate::common::solids::{V, environment, seen_by};

const EYE: V = [0.4, 0.3, 0.5];
const TOWARD: V = [-0.1, 0.05, -0.5];

const FLOOR: &str = "AttributeBegin Material \"matte\" \"rgb Kd\" [1 1 1] Shape \"disk\" \"float radius\" 50 AttributeEnd\n";

#[test]
fn g05_a_tiny_ball_around_a_point_light_hides_it() {
    for (radius, distance) in [
        (0.05, 1e3),
        (1e-2, 1e3),
        (0.5, 1e4),
        (0.05, 1e4),
        (1e-4, 1.0),
    ] {
        let world = FLOOR.to_owned()
            + &format!(
                "LightSource \"point\" \"point from\" [0.3 0.35 {distance}] \"rgb I\" [1e9 1e9 1e9]\n\
                 Material \"matte\" \"rgb Kd\" [0 0 0] Translate 0.3 0.35 {distance}\n\
                 Shape \"sphere\" \"float radius\" {radius}\n"
            );
        for integrator in ["path", "volpath"] {
            let scene = seen_by(integrator, 5, EYE, TOWARD, &world);
            assert_exact(&scene, [0.0; 3], &format!("radius {radius} at {distance}"));
        }
    }
}

#[test]
fn g06_a_shell_just_outside_a_glowing_ball_hides_it() {
    for offset in [0.0, 100.0] {
        for gap in [1e-2, 1e-4, 1e-5] {
            let shells = format!(
                "Translate {offset} 0 2\n\
                 AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1e6 1e6 1e6] Shape \"sphere\" AttributeEnd\n\
                 Material \"matte\" \"rgb Kd\" [0 0 0] Shape \"sphere\" \"float radius\" {}\n",
                1.0 + gap
            );
            let floor = format!("AttributeBegin Translate {offset} 0 0 {FLOOR} AttributeEnd\n");
            let world = floor + &shells;
            let what = format!("gap {gap} at {offset}");
            let from = |[x, y, z]: V| [x + offset, y, z];
            let lit = seen_by("path", 5, from(EYE), TOWARD, &world);
            assert_exact(&lit, [0.0; 3], &format!("the floor, {what}"));
            let seen = seen_by("path", 5, from([0.0, 0.0, 7.0]), [0.05, 0.05, -1.0], &world);
            assert_exact(&seen, [0.0; 3], &format!("the ball, {what}"));
        }
    }
}

#[test]
fn g08_a_ground_the_size_of_a_planet_is_lit() {
    let sun = format!(
        "LightSource \"distant\" \"point from\" [0 0 1] \"point to\" [0 0 0] \"rgb L\" [{PI} {PI} {PI}]\n"
    );
    for radius in [1e3, 1e6, 1e7, 1e8] {
        let world = sun.clone()
            + &format!(
                "Material \"matte\" \"rgb Kd\" [1 1 1] Translate 0 0 -{radius}\n\
                 Shape \"sphere\" \"float radius\" {radius}\n"
            );
        let scene = seen_by("path", 1, [0.0, 0.0, 2.0], [0.1, 0.2, -1.0], &world);
        let samples = crate::common::probe::Probe::new(&scene).samples(4);
        for sample in samples {
            assert!(
                (sample[0] - 1.0).abs() < 1e-3,
                "radius {radius}: {sample:?}"
            );
        }
    }
}

#[test]
fn a_sky_lights_the_ground_of_a_planet() {
    // The horizon of so large a ball is flat: the whole upper half of the sky is seen.
    for radius in [1e6, 1e8] {
        let world = environment([1.0; 3])
            + &format!(
                "Material \"matte\" \"rgb Kd\" [1 1 1] Translate 0 0 -{radius}\n\
                 Shape \"sphere\" \"float radius\" {radius}\n"
            );
        let scene = seen_by("path", 50, [0.0, 0.0, 2.0], [0.1, 0.2, -1.0], &world);
        assert_mean(&scene, 20_000, [1.0; 3], &format!("radius {radius}"));
    }
}

/// How often a ray that leaves a shape meets it again at once.
fn self_hits(form: Form, is_flat: bool) -> (usize, String) {
    let mut random = Uniform::new(21);
    let mut number = |lo: f64, hi: f64| lo + (hi - lo) * f64::from(random.unit());
    let (mut n, mut example) = (0, String::new());
    for i in 0..4000 {
        // Transforms as scenes compose them: there and back over large distances, with rotations between.
        let far = 10f64.powf(number(-2.0, 7.0));
        let turn = DQuat::from_axis_angle(
            DVec3::new(number(-1.0, 1.0), number(-1.0, 1.0), 1.0).normalize(),
            if i % 2 == 0 { PI } else { number(0.0, 6.0) },
        );
        let away = DVec3::new(number(-1.0, 1.0), number(-1.0, 1.0), number(-1.0, 1.0)) * far;
        let parts = [
            DAffine3::from_translation(-away),
            DAffine3::from_quat(turn),
            DAffine3::from_translation(turn.inverse() * away),
            DAffine3::from_scale(DVec3::new(1.0, number(0.3, 3.0), 1.0)),
            DAffine3::from_quat(turn.inverse()),
        ];
        let transform = parts
            .into_iter()
            .filter_map(Transform::from_affine)
            .fold(Transform::IDENTITY, |map, part| map.compose(&part));
        let shape = Shape::Quadric(Quadric::new(form.clone(), transform, false));
        // From somewhere toward a point of the shape, and on by reflection.
        let w = uniform_sphere([number(0.0, 1.0) as f32, number(0.0, 1.0) as f32]);
        let target = transform.point(DVec3::new(number(-0.4, 0.4), number(-0.4, 0.4), 0.0));
        let o = Point3::from_f64(target + w.to_f64() * number(1.0, 20.0));
        let d = Vec3::from_f64((target - o.to_f64()).normalize());
        let ray = Ray { o, d, time: 0.0 };
        let Some(hit) = shape.intersect(0, &ray, &RayShear::new(&ray), f32::INFINITY) else {
            continue;
        };
        let surface = shape.surface(0, &ray, &hit);
        let ng = Vec3::from(surface.ng);
        let mirrored = (d - ng * (2.0 * d.dot(ng))).normalize();
        for w in [mirrored, d] {
            let next = spawn_ray(surface.p, surface.p_err, surface.ng, w, 0.0);
            let again = shape.intersect(0, &next, &RayShear::new(&next), f32::INFINITY);
            // Another part of a curved shape may be met, but not this one.
            if let Some(again) = again.filter(|hit| is_flat || hit.t < 1e-4) {
                n += 1;
                example = format!("{ray:?} {surface:?} {again:?}");
            }
        }
    }
    (n, example)
}

#[test]
fn rays_that_leave_a_surface_do_not_meet_it_where_they_left() {
    let disk = Form::Disk(Disk::new(0.0, 1.0, 0.0, 2.0 * PI));
    let (n, example) = self_hits(disk, true);
    assert_eq!(n, 0, "disk: {example}");
    let sphere = Form::Sphere(Sphere::new(1.0, -1.0, 1.0, 2.0 * PI));
    let (n, example) = self_hits(sphere, false);
    assert_eq!(n, 0, "sphere: {example}");
}

#[test]
fn rays_that_leave_a_triangle_do_not_meet_it() {
    let mut random = Uniform::new(3);
    for i in 0..200_000 {
        let mut number = || 2.0 * random.unit() - 1.0;
        let far = [1.0, 10.0, 1000.0][i % 3];
        let width = [1.0, 1e-2, 1e-4][i / 3 % 3];
        let corner = [0; 3].map(|_| far * number());
        // Every other triangle lies in a plane of constant y, where its normal is exact.
        let mut edge = || [number(), if i % 2 == 0 { 0.0 } else { number() }, number()];
        let (long, wide) = (edge(), edge());
        let positions = [0.0, 1.0, 1.0].iter().zip([0.0, 0.0, width]);
        let positions =
            positions.map(|(a, b)| [0, 1, 2].map(|k| corner[k] + a * long[k] + b * wide[k]));
        let shape = Shape::Mesh(Mesh {
            positions: positions.collect(),
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        });
        if shape.bounds(0).is_empty() {
            continue;
        }
        let barycentric = uniform_triangle(random.unit2());
        let on_it = ElementHit {
            t: 1.0,
            barycentric,
        };
        let ray = Ray {
            o: Point3::ZERO,
            d: Vec3::new(0.0, 0.0, 1.0),
            time: 0.0,
        };
        let surface = shape.surface(0, &ray, &on_it);
        let mut w = uniform_sphere(random.unit2());
        if i % 5 == 0 {
            // Grazing.
            let ng = Vec3::from(surface.ng);
            w = (w - ng * (0.999 * w.dot(ng))).normalize();
        }
        let next = spawn_ray(surface.p, surface.p_err, surface.ng, w, 0.0);
        let again = shape.intersect(0, &next, &RayShear::new(&next), f32::INFINITY);
        assert!(again.is_none(), "{surface:?} {w:?}: {again:?}");
    }
}
