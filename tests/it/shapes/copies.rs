//! Quadrics beside their parametric definitions: what a test knows of a shape without asking it.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec3};
use tyndall::math::{Point3, Ray, Transform, Vec3};
use tyndall::shape::quadric::{Disk, Form, Paraboloid, Sphere, Sweep, cone, cylinder, hyperboloid};
use tyndall::shape::{Mesh, Quadric, Shape};
use tyndall_test_support::Uniform;

/// A quadric as a function of u and v.
pub(crate) struct Definition {
    pub(crate) name: String,
    pub(crate) form: Form,
    point: Box<dyn Fn(f64, f64) -> DVec3>,
    /// Area by a closed form, where there is a simple one.
    pub(crate) area: Option<f64>,
    /// Whether the derivatives by v and those of the normal are those of the point.
    pub(crate) is_parametrised: bool,
}

impl Definition {
    /// The point at (u, v) in object space.
    pub(crate) fn point(&self, u: f64, v: f64) -> DVec3 {
        (self.point)(u, v)
    }
}

fn turned(p: DVec3, phi: f64) -> DVec3 {
    glam::DMat3::from_rotation_z(phi) * p
}

/// The squared distance from the axis, as a function of z, of pbrt-v3's surface a (x² + y²) − c z² = 1: its waist is at
/// z = 0, and it goes through the circle of `p2` and that of a point beyond on the segment's line.
pub(crate) fn pbrts_hyperboloid(p1: DVec3, p2: DVec3) -> impl Fn(f64) -> f64 {
    let beyond = p1 + (p2 - p1) * 2.0;
    let squares = |p: DVec3| (p.truncate().length_squared(), p.z * p.z);
    let ((r1, z1), (r2, z2)) = (squares(beyond), squares(p2));
    // Two circles, two linear equations.
    let det = r2 * z1 - r1 * z2;
    let (a, c) = ((z1 - z2) / det, (r1 - r2) / det);
    move |z| (1.0 + c * z * z) / a
}

fn swept(name: &str, [p1, p2]: [[f64; 3]; 2], phi_max: f64) -> Definition {
    let (p1, p2) = (DVec3::from(p1), DVec3::from(p2));
    Definition {
        name: name.to_owned(),
        form: Form::Sweep(Sweep::new(p1, p2, phi_max)),
        point: Box::new(move |u, v| turned(p1.lerp(p2, v), phi_max * u)),
        area: None,
        is_parametrised: true,
    }
}

fn bent(name: &str, [p1, p2]: [[f64; 3]; 2], phi_max: f64) -> Definition {
    let (p1, p2) = (DVec3::from(p1), DVec3::from(p2));
    let rho2 = pbrts_hyperboloid(p1, p2);
    Definition {
        name: name.to_owned(),
        form: hyperboloid(p1, p2, phi_max),
        point: Box::new(move |u, v| {
            let on_segment = p1.lerp(p2, v);
            let outward = on_segment.truncate().normalize();
            let p = (outward * rho2(on_segment.z).sqrt()).extend(on_segment.z);
            turned(p, phi_max * u)
        }),
        area: None,
        is_parametrised: false,
    }
}

/// Every quadric, whole and in part.
pub(crate) fn definitions() -> Vec<Definition> {
    let mut all = Vec::new();
    for (part, phi_max) in [("whole", TAU), ("part", 4.0), ("sliver", 0.3)] {
        let named = |name: &str| format!("{name}, {part}");
        all.push(Definition {
            name: named("sphere"),
            form: Form::Sphere(Sphere::new(1.0, -0.5, 0.9, phi_max)),
            point: Box::new(move |u, v| {
                let theta = f64::acos(-0.5) + v * (0.9f64.acos() - f64::acos(-0.5));
                turned(DVec3::new(theta.sin(), 0.0, theta.cos()), phi_max * u)
            }),
            area: Some(phi_max * 1.4),
            is_parametrised: true,
        });
        all.push(Definition {
            name: named("disk"),
            form: Form::Disk(Disk::new(0.5, 1.0, 0.3, phi_max)),
            point: Box::new(move |u, v| turned(DVec3::new(1.0 - 0.7 * v, 0.0, 0.5), phi_max * u)),
            area: Some(phi_max * 0.5 * 0.91),
            is_parametrised: true,
        });
        all.push(Definition {
            name: named("cylinder"),
            form: Form::Sweep(cylinder(0.7, 1.0, -0.5, phi_max)),
            point: Box::new(move |u, v| turned(DVec3::new(0.7, 0.0, 1.5 * v - 0.5), phi_max * u)),
            area: Some(phi_max * 0.7 * 1.5),
            is_parametrised: true,
        });
        all.push(Definition {
            name: named("cone"),
            form: Form::Sweep(cone(0.6, 1.4, phi_max)),
            point: Box::new(move |u, v| {
                turned(DVec3::new(0.6 * (1.0 - v), 0.0, 1.4 * v), phi_max * u)
            }),
            area: Some(phi_max * 0.5 * 0.6 * 0.6f64.hypot(1.4)),
            is_parametrised: true,
        });
        all.push(Definition {
            name: named("paraboloid"),
            form: Form::Paraboloid(Paraboloid::new(0.8, 1.5, 0.0, phi_max)),
            point: Box::new(move |u, v| {
                turned(DVec3::new(0.8 * v.sqrt(), 0.0, 1.5 * v), phi_max * u)
            }),
            // A whole one has pi r / (6 h^2) ((r^2 + 4 h^2)^(3/2) - r^3).
            area: Some(
                phi_max * 0.8 / (12.0 * 1.5 * 1.5)
                    * ((0.8 * 0.8 + 4.0 * 1.5 * 1.5f64).powf(1.5) - 0.8f64.powi(3)),
            ),
            is_parametrised: true,
        });
        all.push(Definition {
            name: named("hanging paraboloid"),
            form: Form::Paraboloid(Paraboloid::new(0.4, -1.5, -0.5, phi_max)),
            point: Box::new(move |u, v| {
                let z = -1.5 + v;
                turned(DVec3::new(0.4 * (z / -0.5).sqrt(), 0.0, z), phi_max * u)
            }),
            area: None,
            is_parametrised: true,
        });
        let twisted = [[0.8, -0.7, -0.9], [0.4, 0.9, 0.6]];
        let narrow = [[0.5, -0.3, 0.1], [0.4, 0.9, 0.6]];
        let crossing = [[0.5, 0.0, 0.2], [-0.9, 0.0, 1.3]];
        let flat = [[0.3, 0.2, 0.7], [0.9, 0.8, 0.7]];
        for (name, segment) in [
            ("sweep", twisted),
            ("sweep, beside its waist", narrow),
            ("double cone", crossing),
            ("ring", flat),
        ] {
            all.push(swept(&named(name), segment, phi_max));
        }
        let barrel = [[1.0, 0.0, -0.9], [0.6, 0.15, 0.7]];
        for (name, segment) in [
            ("hyperboloid", twisted),
            ("hyperboloid, downward", [twisted[1], twisted[0]]),
            ("hyperboloid like a barrel", barrel),
        ] {
            all.push(bent(&named(name), segment, phi_max));
        }
    }
    all.push(Definition {
        name: "cylinder like a wire".to_owned(),
        form: Form::Sweep(cylinder(1e-3, -1.0, 1.0, TAU)),
        point: Box::new(|u, v| turned(DVec3::new(1e-3, 0.0, 2.0 * v - 1.0), TAU * u)),
        area: Some(TAU * 2e-3),
        is_parametrised: true,
    });
    all.push(Definition {
        name: "cone like a plate".to_owned(),
        form: Form::Sweep(cone(1.0, 1e-6, TAU)),
        point: Box::new(|u, v| turned(DVec3::new(1.0 - v, 0.0, 1e-6 * v), TAU * u)),
        area: Some(0.5 * TAU),
        is_parametrised: true,
    });
    all.push(Definition {
        name: "paraboloid like a plate".to_owned(),
        form: Form::Paraboloid(Paraboloid::new(1.0, 0.0, 1e-9, TAU)),
        point: Box::new(|u, v| turned(DVec3::new(v.sqrt(), 0.0, 1e-9 * v), TAU * u)),
        area: Some(0.5 * TAU),
        is_parametrised: true,
    });
    all
}

/// Placements: as it is, turned, stretched, mirrored.
pub(crate) fn placements() -> Vec<(&'static str, DAffine3)> {
    let axis = DVec3::new(0.36, 0.48, 0.8);
    let turn = DAffine3::from_axis_angle(axis, 0.7);
    let moved = |scale: DVec3| {
        DAffine3::from_translation(DVec3::new(0.3, -0.2, 0.5)) * turn * DAffine3::from_scale(scale)
    };
    vec![
        ("as defined", DAffine3::IDENTITY),
        ("turned", moved(DVec3::splat(1.5))),
        ("stretched", moved(DVec3::new(0.5, 1.6, 1.1))),
        ("mirrored", moved(DVec3::new(0.8, -1.2, 1.0))),
    ]
}

/// A quadric placed as pbrt-v3 orients it, and its definition.
pub(crate) struct Placed {
    pub(crate) name: String,
    pub(crate) shape: Shape,
    pub(crate) definition: Definition,
    pub(crate) map: DAffine3,
}

/// Every quadric in every placement.
pub(crate) fn placed() -> Vec<Placed> {
    let mut all = Vec::new();
    for (place, map) in placements() {
        for definition in definitions() {
            let transform = Transform::from_affine(map).expect("an invertible map");
            let flip = transform.swaps_handedness();
            let quadric = Quadric::new(definition.form.clone(), transform, flip);
            all.push(Placed {
                name: format!("{}, {place}", definition.name),
                shape: Shape::Quadric(quadric),
                definition,
                map,
            });
        }
    }
    all
}

impl Placed {
    /// A triangulation with `n` by `n` cells, and its surface parameters. Its normals are on the same side: a
    /// mirror turns the winding around, and pbrt-v3 turns the normal of a mirrored quadric around.
    pub(crate) fn triangulated(&self, n: usize) -> Mesh {
        let mut mesh = Mesh::default();
        for j in 0..=n {
            for i in 0..=n {
                let [u, v] = [i, j].map(|k| k as f64 / n as f64);
                let p = self.map.transform_point3(self.definition.point(u, v));
                mesh.positions.push(p.as_vec3().to_array());
                mesh.uvs.push([u as f32, v as f32]);
            }
        }
        let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
        for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
            let [a, b] = [at(i, j), at(i + 1, j)];
            let [d, c] = [at(i, j + 1), at(i + 1, j + 1)];
            mesh.triangles.push([a, b, c]);
            mesh.triangles.push([a, c, d]);
        }
        mesh
    }
}

/// A direction, uniform over the sphere.
pub(crate) fn direction(random: &mut Uniform) -> DVec3 {
    let [a, b] = random.unit2().map(f64::from);
    let z = 2.0 * a - 1.0;
    let r = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(r * (TAU * b).cos(), r * (TAU * b).sin(), z)
}

/// A ray from `o` along `d`.
pub(crate) fn ray(o: DVec3, d: DVec3) -> Ray {
    Ray {
        o: Point3::from_f64(o),
        d: Vec3::from_f64(d.normalize()),
        time: 0.0,
    }
}
