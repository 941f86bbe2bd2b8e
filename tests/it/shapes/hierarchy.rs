//! What the hierarchies find against a look at every element, and closed surfaces that nothing leaves.

use glam::{DAffine3, DQuat, DVec3};
use tyndall::ids::{LightId, MaterialId, ObjectId};
use tyndall::light::{Light, PointLight, Wanted};
use tyndall::math::{
    AnimatedTransform, Motion, MotionChain, Normal3, Point3, Ray, Transform, Vec3,
};
use tyndall::shape::curve::{CurveSource, CurveStyle};
use tyndall::shape::{Curves, Mesh, RayShear, Shape};
use tyndall::spectrum::Rgb;
use tyndall::world::{Cutout, Geometry, Instance, Receiver, World, WorldParts, spawn_ray};
use tyndall_test_support::Uniform;

use super::copies::{direction, placed, ray};

fn geometry(shape: Shape, object: ObjectId) -> Geometry {
    Geometry {
        shape,
        material: MaterialId::NONE,
        media: None,
        cutout: Cutout::default(),
        first_light: LightId::NONE,
        object,
    }
}

fn nearer(a: (f32, bool), b: (f32, bool)) -> (f32, bool) {
    if a.0 < b.0 { a } else { b }
}

fn world_of(shape: Shape) -> World {
    World::new(WorldParts {
        geometries: vec![geometry(shape, ObjectId::NONE)],
        ..WorldParts::default()
    })
}

fn map(random: &mut Uniform, reach: f64) -> Transform {
    let (axis, at) = (direction(random), direction(random) * reach);
    let turn = DQuat::from_axis_angle(axis, 6.0 * f64::from(random.unit()));
    let scale = DVec3::new(1.0, 0.7, 1.3) * (0.5 + f64::from(random.unit()));
    let map = DAffine3::from_scale_rotation_translation(scale, turn, at);
    Transform::from_affine(map).expect("an invertible map")
}

fn strands(random: &mut Uniform) -> CurveSource {
    let mut point = || direction(random) * 1.5;
    CurveSource {
        style: CurveStyle::Flat,
        segments: (0..5).map(|_| [0; 4].map(|_| point())).collect(),
        widths: [0.1, 0.02],
        split_depth: 3,
        normals: Vec::new(),
    }
}

/// Everything at once: shapes that stand by themselves, and copies of two objects, still and moving.
fn everything() -> WorldParts {
    let mut random = Uniform::new(41);
    let mut parts = WorldParts {
        n_objects: 2,
        shutter: [0.0, 1.0],
        ..WorldParts::default()
    };
    for (k, placed) in placed().into_iter().enumerate() {
        let (mesh, object) = (
            placed.triangulated(6),
            [ObjectId::NONE, ObjectId(0), ObjectId(1)],
        );
        parts.geometries.push(geometry(placed.shape, object[k % 3]));
        parts
            .geometries
            .push(geometry(Shape::Mesh(mesh), object[(k + 1) % 3]));
    }
    for object in [ObjectId::NONE, ObjectId(0), ObjectId(1)] {
        let (source, map) = (strands(&mut random), map(&mut random, 0.5));
        let curves = Curves::new(&source, &map, false);
        parts
            .geometries
            .push(geometry(Shape::Curves(curves), object));
    }
    for k in 0..8 {
        let render_from_object = if k % 2 == 0 {
            Motion::Still(map(&mut random, 6.0))
        } else {
            let keys = [0; 2].map(|_| map(&mut random, 6.0));
            let moving = AnimatedTransform::new(keys, [0.2, 0.9]).expect("no mirror");
            Motion::Moving(Box::new(MotionChain {
                outer: Transform::IDENTITY,
                links: vec![moving],
                inner: Transform::IDENTITY,
            }))
        };
        parts.instances.push(Instance {
            object: ObjectId(k / 2 % 2),
            render_from_object,
            growth: 1.0,
        });
    }
    parts.lights = (0..50)
        .map(|_| {
            Light::Point(PointLight {
                p: Point3::from_f64(direction(&mut random) * 8.0),
                intensity: Rgb::ONE,
            })
        })
        .collect();
    parts
}

/// Distance to the nearest element of all, and whether rounding decides there: at the rim of a curve, whose test
/// knows nothing of its box.
fn nearest(parts: &WorldParts, ray: &Ray, t_max: f32) -> Option<(f32, bool)> {
    let among = |object: ObjectId, ray: &Ray| {
        let shear = RayShear::new(ray);
        parts
            .geometries
            .iter()
            .filter(|geometry| geometry.object == object)
            .flat_map(|geometry| {
                let shape = &geometry.shape;
                (0..shape.n_elements() as u32)
                    .filter(|&k| !shape.bounds(k).is_empty())
                    .filter_map(|k| shape.intersect(k, ray, &shear, t_max))
                    .map(|at| {
                        let [_, v] = at.barycentric;
                        let is_rim = matches!(shape, Shape::Curves(_)) && (v - 0.5).abs() > 0.499;
                        (at.t, is_rim)
                    })
            })
            .reduce(nearer)
    };
    let in_instances = parts.instances.iter().filter_map(|instance| {
        let object_from_render = instance.render_from_object.at(ray.time)?.inverse();
        let ray = Ray {
            o: Point3::from_f64(object_from_render.point(ray.o.to_f64())),
            d: Vec3::from_f64(object_from_render.vector(ray.d.to_f64())),
            time: ray.time,
        };
        among(instance.object, &ray)
    });
    among(ObjectId::NONE, ray)
        .into_iter()
        .chain(in_instances)
        .reduce(nearer)
}

#[test]
fn g17_every_ray_finds_what_a_look_at_every_element_finds() {
    let parts = everything();
    let world = World::new(parts.clone());
    let mut random = Uniform::new(43);
    let (mut n_hits, mut n_occluded) = (0, 0);
    for k in 0..3000u32 {
        let o = direction(&mut random) * [0.5, 4.0, 12.0][k as usize % 3];
        let mut d = direction(&mut random) * 5.0 - o;
        // Along the axes, with zeros of both signs.
        if k % 10 == 0 {
            d = [DVec3::new(1.0, 0.0, -0.0), DVec3::new(-0.0, -1.0, 0.0)][k as usize / 10 % 2];
        }
        let ray = Ray {
            time: random.unit(),
            ..ray(o, d)
        };
        let found = world.closest(&ray, f32::INFINITY).map(|hit| hit.at.t);
        let expected = nearest(&parts, &ray, f32::INFINITY);
        let is_rim = expected.is_some_and(|(_, is_rim)| is_rim);
        assert!(
            is_rim || found == expected.map(|(t, _)| t),
            "{expected:?} is not {found:?}: {ray:?}"
        );
        n_hits += usize::from(found.is_some());

        let at = Receiver {
            p: ray.o,
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wanted: Wanted::All,
            time: ray.time,
        };
        let id = LightId::new(k as usize % 50);
        let sample = world
            .sample_on_light(id, 1.0, &at, [0.5; 2])
            .expect("a light");
        let Light::Point(light) = &parts.lights[k as usize % 50] else {
            unreachable!("all are points");
        };
        let to_light = light.p - at.p;
        let shadow = Ray {
            d: to_light / to_light.length(),
            ..ray
        };
        let expected = nearest(&parts, &shadow, to_light.length());
        let is_rim = expected.is_some_and(|(_, is_rim)| is_rim);
        let is_occluded = expected.is_some();
        assert!(
            is_rim || world.is_occluded(&sample) == is_occluded,
            "{expected:?}: {shadow:?}"
        );
        n_occluded += usize::from(is_occluded);
    }
    assert!(n_hits > 1000 && n_occluded > 500, "{n_hits}, {n_occluded}");
}

/// A sphere of triangles: an octahedron, divided.
fn ball(levels: u32) -> Mesh {
    let mut positions: Vec<DVec3> = vec![
        DVec3::X,
        DVec3::Y,
        DVec3::NEG_X,
        DVec3::NEG_Y,
        DVec3::Z,
        DVec3::NEG_Z,
    ];
    let mut triangles: Vec<[u32; 3]> = (0..4u32)
        .flat_map(|k| [[k, (k + 1) % 4, 4], [(k + 1) % 4, k, 5]])
        .collect();
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[p, q]| {
                *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                    let middle = positions[p as usize] + positions[q as usize];
                    positions.push(middle.normalize());
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    Mesh {
        positions: positions.iter().map(|p| p.as_vec3().to_array()).collect(),
        triangles,
        ..Mesh::default()
    }
}

#[test]
fn g17_no_ray_escapes_from_a_ball_of_triangles() {
    let mesh = ball(4);
    let world = world_of(Shape::Mesh(mesh.clone()));
    let mut random = Uniform::new(47);
    for k in 0..1_000_000 {
        let o = direction(&mut random) * (0.9 * f64::from(random.unit()));
        let corners = mesh.triangles[random.bits() as usize % mesh.n_triangles()]
            .map(|v| glam::Vec3::from(mesh.positions[v as usize]).as_dvec3());
        let target = match k % 4 {
            0 => corners[0],
            1 => corners[0].lerp(corners[1], f64::from(random.unit())),
            2 => direction(&mut random) * 2.0,
            _ => o + [DVec3::X, DVec3::NEG_Y, DVec3::new(0.0, -0.0, -1.0)][k / 4 % 3],
        };
        let o = if k % 8 == 3 { DVec3::ZERO } else { o };
        let ray = ray(o, target - o);
        assert!(world.closest(&ray, f32::INFINITY).is_some(), "{ray:?}");
    }
}

/// A closed box whose walls are pairs of triangles.
fn room() -> Mesh {
    let corner = |k: usize| [0, 1, 2].map(|axis| [-1.0, 1.0][k >> axis & 1]);
    let mut mesh = Mesh {
        positions: (0..8).map(corner).collect(),
        ..Mesh::default()
    };
    for a in 0..3 {
        let (b, c) = (1u32 << ((a + 1) % 3), 1 << ((a + 2) % 3));
        for at in [0, 1 << a] {
            mesh.triangles.push([at, at + b, at + b + c]);
            mesh.triangles.push([at, at + b + c, at + c]);
        }
    }
    mesh
}

#[test]
fn g04_no_path_leaves_a_room_by_its_edges() {
    let mut random = Uniform::new(53);
    for far in [0.0, 0.37, 100.0] {
        let mut mesh = room();
        let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 10.0 * far);
        for p in &mut mesh.positions {
            let at = turn * glam::Vec3::from(*p).as_dvec3() + DVec3::splat(far);
            *p = at.as_vec3().to_array();
        }
        let world = world_of(Shape::Mesh(mesh.clone()));
        for k in 0..300_000 {
            let corner = |k: u64| glam::Vec3::from(mesh.positions[k as usize]).as_dvec3();
            // Aimed at an edge, or beside it by as little as the numbers resolve.
            let (a, axis) = (random.bits() % 8, random.bits() % 3);
            let [p, q] = [corner(a), corner(a ^ 1 << axis)];
            let along = match k % 4 {
                0 => 1e-7 * f64::from(random.unit()),
                _ => f64::from(random.unit()),
            };
            let beside = direction(&mut random) * [0.0, 1e-8, 1e-7, 1e-6][k / 4 % 4] * (1.0 + far);
            let o = DVec3::splat(far) + direction(&mut random) * 0.5;
            let first = ray(o, p.lerp(q, along) + beside - o);
            let hit = world.closest(&first, f32::INFINITY).expect("a wall");
            let surface = world.surface(&first, &hit);
            let mut d = direction(&mut random);
            // Back into the room.
            let inward = if surface.ng.dot(first.d) < 0.0 {
                1.0
            } else {
                -1.0
            };
            d *= inward * surface.ng.to_f64().dot(d).signum();
            let d = ray(o, d).d;
            let next = spawn_ray(surface.p, surface.p_err, surface.ng, d, 0.0);
            let again = world.closest(&next, f32::INFINITY);
            assert!(again.is_some(), "from {first:?} on {next:?}");
        }
    }
}

#[test]
fn g25_tiny_texture_coordinates_turn_no_tangent() {
    let mesh = |scale: f32| Mesh {
        positions: vec![[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 1.1, -0.2]],
        triangles: vec![[0, 1, 2]],
        normals: vec![[0.0, 0.1, 1.0], [0.2, 0.0, 1.0], [0.0, -0.3, 1.0]],
        uvs: [[0.25, 0.5], [1.0, 0.125], [0.5, 0.75]]
            .map(|uv| uv.map(|x: f32| x * scale))
            .to_vec(),
        ..Mesh::default()
    };
    let one = mesh(1.0).surface(0, [0.3, 0.4]);
    for k in [-40, -17, 12, 40] {
        let scale = 2f32.powi(k);
        let other = mesh(scale).surface(0, [0.3, 0.4]);
        for (a, b) in [
            (one.dpdu, other.dpdu),
            (one.dpdv, other.dpdv),
            (one.dndu, other.dndu),
            (one.dndv, other.dndv),
        ] {
            assert_eq!(a, b * scale, "2^{k}");
        }
        // The shading frame of a mesh with normals knows no size of its texture coordinates.
        assert_eq!(one.tangent, other.tangent);
        assert_eq!(one.ns, other.ns);
    }
}
