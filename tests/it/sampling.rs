//! Every sampling routine against its density, through the public interface: χ², and both ends of the unit interval.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec3};
use tyndall::ids::BlockId;
use tyndall::image::Image;
use tyndall::light::{InfiniteLight, LightChoice, Wanted};
use tyndall::math::{Frame, Normal3, Point3, Ray, Transform, Vec3};
use tyndall::sampling::warp::{
    UNIFORM_SPHERE_PDF, concentric_disk, cosine_hemisphere, cosine_hemisphere_pdf, uniform_sphere,
    uniform_triangle,
};
use tyndall::scatter::diffuse::Diffuse;
use tyndall::scatter::specular::Mirror;
use tyndall::scatter::{Bsdf, Bxdf, HenyeyGreenstein, TransportMode};
use tyndall::shape::quadric::{Disk, Form, Sphere};
use tyndall::shape::{Mesh, Quadric, RayShear, Shape, ShapeSample};
use tyndall::spectrum::Rgb;
use tyndall_test_support::chi2::{self, Chi2, Hemisphere, Square};
use tyndall_test_support::{Uniform, assert_close, chi2::Sphere as AllDirections};

/// Both ends of what a sampler may return, and what lies between.
const ENDS: [f32; 5] = [0.0, 2.3283064e-10, 0.5, 0.25, 1.0 - f32::EPSILON / 2.0];

fn ends() -> impl Iterator<Item = [f32; 2]> {
    ENDS.into_iter().flat_map(|a| ENDS.map(|b| [a, b]))
}

fn assert_unit(w: Vec3, what: &str) {
    let error = (w.to_f64().length() - 1.0).abs();
    assert!(error < 1e-6, "{what}: {w:?} is no direction");
}

/// A number in [0, 1) from one that rounding may have put on the edge.
fn below_one(x: f64) -> f32 {
    (x as f32).clamp(0.0, 1.0 - f32::EPSILON / 2.0)
}

#[test]
fn warps_draw_what_their_densities_say() {
    chi2::check(
        Hemisphere,
        |u| Some(cosine_hemisphere(u.unit2()).into()),
        |w| f64::from(cosine_hemisphere_pdf(w[2])),
    )
    .assert_accepted("cosine hemisphere");
    chi2::check(
        AllDirections,
        |u| Some(uniform_sphere(u.unit2()).into()),
        |_| f64::from(UNIFORM_SPHERE_PDF),
    )
    .assert_accepted("uniform sphere");
    // Squared radius and azimuth of uniform points of a disk are uniform.
    let polar = |u: &mut Uniform| {
        let [x, y] = concentric_disk(u.unit2()).map(f64::from);
        Some([
            below_one(y.atan2(x).rem_euclid(TAU) / TAU),
            below_one(x * x + y * y),
        ])
    };
    chi2::check(Square, polar, |_| 1.0).assert_accepted("concentric disk");
    // (1 - b0)^2 and b1 / (1 - b0) are, for a triangle.
    let unfolded = |u: &mut Uniform| {
        let [b0, b1] = uniform_triangle(u.unit2()).map(f64::from);
        let rest = 1.0 - b0;
        Some([below_one(rest * rest), below_one(b1 / rest)])
    };
    chi2::check(Square, unfolded, |_| 1.0).assert_accepted("triangle");
}

#[test]
fn n03_warps_are_finite_at_both_ends() {
    for u in ends() {
        assert_unit(cosine_hemisphere(u), "cosine hemisphere");
        assert!(cosine_hemisphere(u).z() >= 0.0);
        assert_unit(uniform_sphere(u), "uniform sphere");
        let [x, y] = concentric_disk(u).map(f64::from);
        assert!(x * x + y * y <= 1.0 + 1e-6, "disk: {x} {y}");
        let [b0, b1] = uniform_triangle(u);
        assert!(
            b0 >= 0.0 && b1 >= 0.0 && b0 + b1 <= 1.0,
            "triangle: {b0} {b1}"
        );
    }
}

fn direction(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z).normalize()
}

const LOBES: [f32; 8] = [0.0, 1e-4, 0.3, -0.3, 0.7, -0.7, 0.95, -0.95];

#[test]
fn henyey_greenstein_draws_what_its_density_says() {
    let family = Chi2 {
        n_tests: LOBES.len(),
        ..Chi2::default()
    };
    for g in LOBES {
        let phase = HenyeyGreenstein { g };
        let wo = direction(0.3, -0.5, 0.7);
        // The definition, with the cosine between the directions of travel.
        let pdf = |w: [f32; 3]| {
            let cos = -wo.to_f64().dot(Vec3::from(w).to_f64());
            let g = f64::from(g);
            (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
        };
        family
            .check(
                AllDirections,
                |u| Some(phase.sample(wo, u.unit2()).0.into()),
                pdf,
            )
            .assert_accepted(&format!("g = {g}"));
        for u in ends() {
            let (wi, pdf_w) = phase.sample(wo, u);
            assert_unit(wi, "phase function");
            assert!(
                pdf_w > 0.0 && pdf_w.is_finite(),
                "g = {g}, u = {u:?}: {pdf_w}"
            );
            assert_close(phase.p(wo, wi).into(), pdf(wi.into()), 2e-3);
        }
    }
}

/// A diffuse surface, whose shading normal leans away from the geometric one by an angle in degrees.
fn tilted(degrees: f32, roughness: f32) -> Bsdf<'static> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let ns = Normal3::from([sin * 0.6, sin * 0.8, cos]);
    let frame = Frame::from_normal_tangent(ns, Vec3::new(0.3, 1.0, 0.2));
    let mut bsdf = Bsdf::new(frame, Normal3::from([0.0, 0.0, 1.0]));
    bsdf.add(Bxdf::Diffuse(Diffuse::new(Rgb::splat(0.7), roughness)));
    bsdf
}

#[test]
fn diffuse_surfaces_draw_what_their_density_says() {
    let cases = [(0.0, 0.0), (20.0, 0.0), (50.0, 30.0), (-35.0, 90.0)];
    let family = Chi2 {
        n_tests: 3 * cases.len(),
        ..Chi2::default()
    };
    for (degrees, roughness) in cases {
        let bsdf = tilted(degrees, roughness);
        for wo in [
            direction(0.1, 0.2, 0.9),
            direction(-0.9, 0.1, 0.3),
            direction(0.3, 0.2, -0.8),
        ] {
            let sample = |u: [f32; 2]| bsdf.sample(wo, 0.3, u, TransportMode::Radiance);
            let pdf = |w: [f32; 3]| f64::from(bsdf.pdf(wo, w.into()));
            let draw = |u: &mut Uniform| sample(u.unit2()).map(|s| s.wi.into());
            let what = format!("tilt {degrees}, sigma {roughness}, from {wo:?}");
            family
                .check(AllDirections, draw, pdf)
                .assert_accepted(&what);
            for sample in ends().filter_map(sample) {
                assert_unit(sample.wi, &what);
                assert!(
                    sample.pdf_w > 0.0 && sample.pdf_w.is_finite(),
                    "{what}: {sample:?}"
                );
                assert!(
                    sample.weight.is_finite() && !sample.weight.has_negative(),
                    "{what}"
                );
                assert_close(sample.pdf_w.into(), pdf(sample.wi.into()), 1e-3);
            }
        }
    }
}

#[test]
fn weights_are_value_times_cosine_over_density() {
    let mut random = Uniform::new(3);
    for (degrees, roughness) in [(0.0, 0.0), (40.0, 0.0), (25.0, 45.0)] {
        let bsdf = tilted(degrees, roughness);
        for _ in 0..2000 {
            let wo: Vec3 = uniform_sphere(random.unit2());
            let Some(sample) =
                bsdf.sample(wo, random.unit(), random.unit2(), TransportMode::Radiance)
            else {
                continue;
            };
            let f = bsdf.f(wo, sample.wi, TransportMode::Radiance).g();
            let expected = f * bsdf.abs_cos(sample.wi) / bsdf.pdf(wo, sample.wi);
            assert!(
                (sample.weight.g() - expected).abs() <= 2e-3 * expected.max(1e-3),
                "{sample:?}: {expected}"
            );
        }
    }
}

/// Whether a light from `wi` is reflected although `wi` is never drawn, for some pair of directions.
fn has_value_without_density(degrees: f32) -> bool {
    let bsdf = tilted(degrees, 0.0);
    let mut random = Uniform::new(4);
    (0..20_000).any(|_| {
        let [wo, wi] = [0, 1].map(|_| uniform_sphere(random.unit2()));
        let f = bsdf.f(wo, wi, TransportMode::Radiance);
        !f.is_black() && bsdf.pdf(wo, wi) <= 0.0
    })
}

#[test]
fn values_have_a_density_where_the_normals_agree() {
    assert!(!has_value_without_density(0.0));
}

#[test]
#[ignore = "as in pbrt-v3, light from below the shading horizon is reflected and never drawn"]
fn g23_values_have_a_density_where_the_normals_disagree() {
    assert!(!has_value_without_density(25.0));
}

#[test]
fn beside_a_specular_lobe_the_density_shrinks_as_the_weight_grows() {
    let mut bsdf = tilted(20.0, 0.0);
    let plain = tilted(20.0, 0.0);
    bsdf.add(Bxdf::Mirror(Mirror {
        kr: Rgb::splat(0.4),
    }));
    let wo = direction(0.1, 0.2, 0.9);
    let draw = |bsdf: &Bsdf, u_lobe: f32| {
        let sample = bsdf.sample(wo, u_lobe, [0.3, 0.6], TransportMode::Radiance);
        sample.expect("a direction")
    };
    let (sample, alone) = (draw(&bsdf, 0.2), draw(&plain, 0.2));
    assert!(!sample.specular);
    // The diffuse lobe sends out more, and is chosen more often.
    let chance = f64::from(sample.pdf_w / alone.pdf_w);
    assert!(chance > 0.55 && chance < 0.7, "{chance}");
    assert_close(
        sample.weight.g().into(),
        f64::from(alone.weight.g()) / chance,
        1e-6,
    );
    let mirrored = draw(&bsdf, 0.9);
    assert!(mirrored.specular && mirrored.pdf_w == 0.0);
    assert_close(mirrored.weight.g().into(), 0.4 / (1.0 - chance), 1e-5);
}

/// A quadric as a light: how it is placed, and how to find the parameters of its points.
struct Emitter {
    name: &'static str,
    shape: Shape,
    world_from_object: DAffine3,
    /// (u, v) in [0, 1]², each uniform by object-space area, of an object-space point.
    parameters: fn(DVec3) -> [f64; 2],
    /// Object-space unit normal at an object-space point.
    normal: fn(DVec3) -> DVec3,
    /// Object-space area.
    area: f64,
}

fn azimuth(p: DVec3) -> f64 {
    p.y.atan2(p.x).rem_euclid(TAU)
}

fn emitters() -> Vec<Emitter> {
    let turn = DAffine3::from_rotation_y(0.7) * DAffine3::from_rotation_z(-1.1);
    let moved = |scale: DVec3| {
        DAffine3::from_translation(DVec3::new(0.3, -0.2, 0.5)) * turn * DAffine3::from_scale(scale)
    };
    let quadric = |form: Form, map: DAffine3| {
        let transform = Transform::from_affine(map).expect("an invertible map");
        Shape::Quadric(Quadric::new(form, transform, transform.swaps_handedness()))
    };
    let sphere = |name, map: DAffine3| Emitter {
        name,
        shape: quadric(Form::Sphere(Sphere::new(1.0, -1.0, 1.0, TAU)), map),
        world_from_object: map,
        parameters: |p| [azimuth(p) / TAU, 0.5 * (p.z + 1.0)],
        normal: |p| p.normalize(),
        area: 4.0 * PI,
    };
    let part = |name, map: DAffine3| Emitter {
        name,
        shape: quadric(Form::Sphere(Sphere::new(1.0, -0.5, 0.8, 4.0)), map),
        world_from_object: map,
        parameters: |p| [azimuth(p) / 4.0, (p.z + 0.5) / 1.3],
        normal: |p| p.normalize(),
        area: 4.0 * 1.3,
    };
    let disk = |name, map: DAffine3| Emitter {
        name,
        shape: quadric(Form::Disk(Disk::new(0.25, 1.0, 0.0, TAU)), map),
        world_from_object: map,
        parameters: |p| [azimuth(p) / TAU, p.x * p.x + p.y * p.y],
        normal: |_| DVec3::Z,
        area: PI,
    };
    let sector = |name, map: DAffine3| Emitter {
        name,
        shape: quadric(Form::Disk(Disk::new(0.0, 1.0, 0.5, 2.0)), map),
        world_from_object: map,
        parameters: |p| [azimuth(p) / 2.0, (p.x * p.x + p.y * p.y - 0.25) / 0.75],
        normal: |_| DVec3::Z,
        area: 0.75,
    };
    let one = DVec3::ONE;
    vec![
        sphere("stretched sphere", moved(DVec3::new(1.0, 2.0, 0.4))),
        sphere(
            "mirrored stretched sphere",
            moved(DVec3::new(-1.0, 0.5, 1.5)),
        ),
        part("part of a sphere", moved(one)),
        part("part of a scaled sphere", moved(2.5 * one)),
        part(
            "part of a mirrored stretched sphere",
            moved(DVec3::new(1.0, -2.0, 0.7)),
        ),
        disk("disk", moved(one)),
        disk("stretched disk", moved(DVec3::new(2.0, 0.5, 1.0))),
        sector("sector of an annulus", moved(one)),
        sector("mirrored sector", moved(DVec3::new(1.0, 1.0, -3.0))),
    ]
}

/// The factor by which a map stretches area where the object-space normal is `n`: by two tangents.
fn stretch(map: &DAffine3, n: DVec3) -> f64 {
    let (s, t) = n.any_orthonormal_pair();
    map.transform_vector3(s)
        .cross(map.transform_vector3(t))
        .length()
}

fn receivers() -> [Point3; 3] {
    [
        Point3::new(4.0, 3.0, -2.0),
        Point3::new(-1.0, -6.0, 2.5),
        Point3::new(0.4, -0.1, 30.0),
    ]
}

#[test]
fn l01_l02_placed_quadrics_are_drawn_by_their_density() {
    let emitters = emitters();
    let family = Chi2 {
        n_tests: 3 * emitters.len(),
        ..Chi2::default()
    };
    for emitter in &emitters {
        let map = emitter.world_from_object;
        for from in receivers() {
            let draw = |u: &mut Uniform| {
                let sample = emitter.shape.sample_toward(0, from, u.unit2())?;
                let p = map.inverse().transform_point3(sample.p.to_f64());
                Some((emitter.parameters)(p).map(below_one))
            };
            // The density per solid angle that the shape claims, per parameter area: cos / d² by our own geometry.
            let pdf = |[u, v]: [f32; 2]| {
                let p = point_of(emitter, [u.into(), v.into()]);
                let n = (emitter.normal)(p);
                let world = map.transform_point3(p);
                let normal_matrix = map.matrix3.inverse().transpose();
                let ng = (normal_matrix * n).normalize();
                let to_light = world - from.to_f64();
                let cos = ng.dot(to_light).abs() / to_light.length();
                let pdf_w = emitter.shape.pdf_toward(
                    0,
                    from,
                    Point3::from_f64(world),
                    Normal3::from_f64(ng),
                );
                f64::from(pdf_w) * cos / to_light.length_squared() * stretch(&map, n) * emitter.area
            };
            let what = format!("{} from {from:?}", emitter.name);
            family.check(Square, draw, pdf).assert_accepted(&what);
        }
    }
}

/// The object-space point of two parameters, found from the ones of the three families of shapes.
fn point_of(emitter: &Emitter, [u, v]: [f64; 2]) -> DVec3 {
    let on_sphere = |phi: f64, z: f64| {
        let (sin, cos) = phi.sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(r * cos, r * sin, z)
    };
    let on_disk = |phi: f64, r2: f64, z: f64| {
        let (sin, cos) = phi.sin_cos();
        DVec3::new(r2.sqrt() * cos, r2.sqrt() * sin, z)
    };
    let p = match emitter.name {
        name if name.contains("sector") => on_disk(2.0 * u, 0.25 + 0.75 * v, 0.0),
        name if name.contains("disk") => on_disk(TAU * u, v, 0.25),
        name if name.contains("part") => on_sphere(4.0 * u, 1.3 * v - 0.5),
        _ => on_sphere(TAU * u, 2.0 * v - 1.0),
    };
    let [a, b] = (emitter.parameters)(p);
    assert!(
        (b - v).abs() < 1e-9 && ((a - u).abs() < 1e-9 || u < 1e-9),
        "parameters"
    );
    p
}

#[test]
fn drawn_points_lie_on_the_shape_and_rays_toward_them_meet_it() {
    let mut random = Uniform::new(8);
    for emitter in emitters() {
        let object_from_world = emitter.world_from_object.inverse();
        for from in receivers() {
            let mut n_lost = 0;
            for _ in 0..5000 {
                let sample = emitter.shape.sample_toward(0, from, random.unit2());
                let sample = sample.expect("a receiver off the shape's plane sees it");
                let p = object_from_world.transform_point3(sample.p.to_f64());
                let [u, v] = (emitter.parameters)(p);
                let n = (emitter.normal)(p);
                let height = match emitter.name {
                    name if name.contains("sector") => p.z,
                    name if name.contains("disk") => p.z - 0.25,
                    _ => p.length() - 1.0,
                };
                assert!(
                    height.abs() < 2e-6,
                    "{}: {p} is off by {height}",
                    emitter.name
                );
                let inside = -1e-5..=1.0 + 1e-5;
                let on_seam = (1.0 - 1e-6..=TAU).contains(&u);
                assert!(
                    inside.contains(&v) && (inside.contains(&u) || on_seam),
                    "{u} {v}"
                );
                assert_normal(&emitter, &sample, n);
                n_lost += usize::from(!ray_meets(&emitter.shape, from, &sample));
            }
            // Points within rounding of an edge may be missed.
            assert!(n_lost <= 5, "{}: {n_lost} of 5000 rays miss", emitter.name);
        }
    }
}

/// The normal is the surface's, on the side that pbrt-v3's rule says: flipped in object space by a mirror.
fn assert_normal(emitter: &Emitter, sample: &ShapeSample, n_object: DVec3) {
    let map = emitter.world_from_object;
    let mirrored = map.matrix3.determinant() < 0.0;
    let n = (map.matrix3.inverse().transpose() * n_object).normalize();
    let expected = if mirrored { -n } else { n };
    let error = (sample.ng.to_f64() - expected).length();
    assert!(
        error < 1e-5,
        "{}: {:?} is not {expected}",
        emitter.name,
        sample.ng
    );
}

/// Whether a ray from the receiver meets the shape at the drawn point, perhaps behind another part of it.
fn ray_meets(shape: &Shape, from: Point3, sample: &ShapeSample) -> bool {
    let to_light = sample.p.to_f64() - from.to_f64();
    let mut t0 = 0.0;
    for _ in 0..4 {
        let d = Vec3::from_f64(to_light.normalize());
        let ray = Ray {
            o: Point3::from_f64(from.to_f64() + to_light.normalize() * t0),
            d,
            time: 0.0,
        };
        let Some(hit) = shape.intersect(0, &ray, &RayShear::new(&ray), f32::INFINITY) else {
            return false;
        };
        t0 += f64::from(hit.t);
        if (t0 - to_light.length()).abs() < 1e-3 * to_light.length() {
            return true;
        }
        t0 *= 1.0 + 1e-5;
    }
    false
}

/// A whole sphere of radius `scale` around the origin, its axis turned.
fn whole_sphere(scale: f64) -> Shape {
    let map = DAffine3::from_rotation_x(0.4) * DAffine3::from_scale(DVec3::splat(scale));
    let transform = Transform::from_affine(map).expect("an invertible map");
    let form = Form::Sphere(Sphere::new(1.0, -1.0, 1.0, TAU));
    Shape::Quadric(Quadric::new(form, transform, false))
}

#[test]
fn whole_spheres_are_drawn_uniformly_in_the_cone_they_fill() {
    // Radius over distance from nearly touching to a speck.
    let distances = [1.001, 1.5, 10.0, 1e4, 1e7];
    let family = Chi2 {
        n_tests: distances.len(),
        ..Chi2::default()
    };
    for distance in distances {
        let radius = 0.75;
        let shape = whole_sphere(radius);
        let axis = DVec3::new(0.36, 0.48, 0.8);
        let from = Point3::from_f64(axis * (distance * radius));
        let distance = from.to_f64().length() / radius;
        let axis = from.to_f64().normalize();
        let (s, t) = axis.any_orthonormal_pair();
        let sin2_max = 1.0 / (distance * distance);
        let one_minus_cos = |sin2: f64| sin2 / (1.0 + (1.0 - sin2).max(0.0).sqrt());
        let draw = |u: &mut Uniform| {
            let sample = shape.sample_toward(0, from, u.unit2())?;
            let w = (sample.p.to_f64() - from.to_f64()).normalize();
            let sin2 = w.cross(axis).length_squared();
            let v = one_minus_cos(sin2) / one_minus_cos(sin2_max);
            assert!(v < 1.0 + 1e-3, "{distance}: outside the cone: {v}");
            let turn = w.dot(t).atan2(w.dot(s)).rem_euclid(TAU) / TAU;
            Some([below_one(turn), below_one(v)])
        };
        family
            .check(Square, draw, |_| 1.0)
            .assert_accepted(&format!("at {distance} radii"));
        let solid_angle = TAU * one_minus_cos(sin2_max);
        let sample = shape.sample_toward(0, from, [0.3, 0.4]).expect("a sample");
        assert_close(sample.pdf_w.into(), 1.0 / solid_angle, 1e-5);
        let pdf = shape.pdf_toward(0, from, sample.p, sample.ng);
        assert_close(pdf.into(), 1.0 / solid_angle, 1e-5);
    }
}

#[test]
fn from_within_a_sphere_is_drawn_by_area() {
    let shape = whole_sphere(2.0);
    for from in [Point3::new(0.0, 0.0, 0.0), Point3::new(0.5, -1.5, 0.3)] {
        // Seen from within, every direction meets the sphere once.
        let pdf = |w: [f32; 3]| {
            let d = Vec3::from(w);
            let ray = Ray {
                o: from,
                d,
                time: 0.0,
            };
            let hit = shape
                .intersect(0, &ray, &RayShear::new(&ray), f32::INFINITY)
                .expect("a wall all around");
            let surface = shape.surface(0, &ray, &hit);
            f64::from(shape.pdf_toward(0, from, surface.p, surface.ng))
        };
        let draw = |u: &mut Uniform| {
            let sample = shape.sample_toward(0, from, u.unit2())?;
            Some(Vec3::from_f64((sample.p.to_f64() - from.to_f64()).normalize()).into())
        };
        chi2::check(AllDirections, draw, pdf).assert_accepted("within a sphere");
    }
}

#[test]
fn triangles_are_drawn_by_their_density() {
    let corners = [[1.0, 0.0, 2.0], [-1.0, 0.5, 2.5], [0.0, 2.0, 1.0f32]];
    let mesh = Mesh {
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let shape = Shape::Mesh(mesh);
    let [a, b, c] = corners.map(|p| DVec3::from(p.map(f64::from)));
    let n = (b - a).cross(c - a);
    let (area, normal) = (0.5 * n.length(), n.normalize());
    assert_close(shape.area(0), area, 1e-12);
    for from in receivers() {
        // Barycentric weights of a point by the areas they span.
        let draw = |u: &mut Uniform| {
            let sample = shape.sample_toward(0, from, u.unit2())?;
            let p = sample.p.to_f64();
            let weight = |q: DVec3, r: DVec3| (q - p).cross(r - p).dot(normal) / n.length();
            let (b0, b1) = (weight(b, c), weight(c, a));
            let rest = 1.0 - b0;
            Some([below_one(rest * rest), below_one(b1 / rest)])
        };
        let pdf = |[r2, s]: [f32; 2]| {
            let rest = f64::from(r2).sqrt();
            let (b0, b1) = (1.0 - rest, f64::from(s) * rest);
            let p = a * b0 + b * b1 + c * (1.0 - b0 - b1);
            let to_light = p - from.to_f64();
            let cos = normal.dot(to_light).abs() / to_light.length();
            let (p, ng) = (Point3::from_f64(p), Normal3::from_f64(normal));
            let pdf_w = f64::from(shape.pdf_toward(0, from, p, ng));
            pdf_w * cos / to_light.length_squared() * area
        };
        chi2::check(Square, draw, pdf).assert_accepted("triangle");
        for u in ends() {
            let sample = shape.sample_toward(0, from, u).expect("a sample");
            assert!(sample.p.is_finite() && sample.pdf_w > 0.0 && sample.pdf_w.is_finite());
        }
    }
}

#[test]
fn n03_shapes_are_finite_at_both_ends() {
    let mut shapes: Vec<Shape> = emitters().into_iter().map(|e| e.shape).collect();
    shapes.extend([1e-6, 1.0].map(whole_sphere));
    for shape in &shapes {
        for from in receivers() {
            for sample in ends().filter_map(|u| shape.sample_toward(0, from, u)) {
                assert!(
                    sample.p.is_finite() && sample.pdf_w > 0.0 && sample.pdf_w.is_finite(),
                    "{sample:?}"
                );
                assert!(
                    (sample.ng.to_f64().length() - 1.0).abs() < 1e-5,
                    "{sample:?}"
                );
            }
        }
    }
}

/// A map of 16 x 8 pixels.
fn map(pixel: impl Fn(usize, usize) -> f32) -> Image {
    let data = (0..16 * 8)
        .flat_map(|i| [pixel(i % 16, i / 16); 3])
        .collect();
    Image::new(16, 8, 3, data).expect("a map")
}

fn smooth(x: usize, y: usize) -> f32 {
    1.5 + (x as f32 * 0.39).sin() + 0.1 * y as f32
}

fn one_bright_texel(x: usize, y: usize) -> f32 {
    if [x, y] == [5, 2] { 1e4 } else { 1e-3 }
}

fn dark_half(x: usize, _: usize) -> f32 {
    if x < 8 { 0.0 } else { 1.0 }
}

#[test]
fn n12_environments_are_drawn_by_their_density_under_any_transform() {
    let transforms = [
        DMat3::IDENTITY,
        DMat3::from_rotation_x(-1.2) * DMat3::from_rotation_z(0.5),
        DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)),
        DMat3::from_rotation_y(0.8) * DMat3::from_diagonal(DVec3::new(1.0, 3.0, 0.5)),
        DMat3::from_diagonal(DVec3::splat(1e-9)),
    ];
    let maps = [map(smooth), map(one_bright_texel), map(dark_half)];
    let facing = |x, y, z| Wanted::Facing(Normal3::new(x, y, z).normalize());
    let all_wanted = [
        Wanted::All,
        facing(0.0, 0.0, 1.0),
        facing(-0.6, 0.0, -0.8),
        facing(0.3, -0.9, 0.1),
        Wanted::Within(BlockId::new(0)),
        Wanted::Within(BlockId::new(1)),
    ];
    // One veil lets through what comes from a side, the other the more the higher it stands.
    let transmittances = |w: Vec3| vec![f32::from(w.x() > 0.3), 0.5 + 0.5 * w.z()];
    let family = Chi2 {
        n_tests: transforms.len() * maps.len() * all_wanted.len(),
        ..Chi2::default()
    };
    for map in &maps {
        for (m, wanted) in transforms
            .into_iter()
            .flat_map(|m| all_wanted.map(|w| (m, w)))
        {
            let mut light =
                InfiniteLight::with_map(Rgb::ONE, map.clone(), m, true).expect("a light");
            if matches!(wanted, Wanted::Within(_)) {
                light.heed_blocks(transmittances);
            }
            let size = m.determinant().abs().cbrt();
            let m = m * (1.0 / size);
            let inverse = m.inverse();
            // Latitude and longitude in light space: the map's own square.
            let mut n_other = 0;
            let draw = |u: &mut Uniform| {
                let sample = light.sample(u.unit2(), wanted)?;
                let w = (inverse * sample.wi.to_f64()).normalize();
                let s = w.y.atan2(w.x).rem_euclid(TAU) / TAU;
                let t = w.truncate().length().atan2(w.z) / PI;
                let ratio = light.pdf_w(sample.wi, wanted) / sample.pdf_w;
                n_other += usize::from(!(0.99..1.01).contains(&ratio));
                Some([below_one(s), below_one(t)])
            };
            let pdf = |[s, t]: [f32; 2]| {
                let (sin, cos) = (PI * f64::from(t)).sin_cos();
                let (sin_phi, cos_phi) = (TAU * f64::from(s)).sin_cos();
                let in_light = DVec3::new(sin * cos_phi, sin * sin_phi, cos);
                let stretched = m * in_light;
                let w = Vec3::from_f64(stretched.normalize());
                // A map of directions spreads solid angle by |det| / |M w|³.
                let spread = m.determinant().abs() / stretched.length().powi(3);
                f64::from(light.pdf_w(w, wanted)) * spread * 2.0 * PI * PI * sin
            };
            family
                .check(Square, draw, pdf)
                .assert_accepted("environment");
            // Rounding may put a direction into the next cell of the table.
            assert!(n_other <= 40, "{n_other} of 200000 densities differ");
            let mut random = Uniform::new(5);
            for _ in 0..5000 {
                let w = uniform_sphere(random.unit2());
                assert!(
                    light.le(w).is_black() || light.pdf_w(w, wanted) > 0.0,
                    "light without density"
                );
            }
            for sample in ends().filter_map(|u| light.sample(u, wanted)) {
                assert_unit(sample.wi, "environment");
                assert!(
                    sample.pdf_w > 0.0 && sample.pdf_w.is_finite() && sample.radiance.is_finite()
                );
            }
        }
    }
}

#[test]
fn an_environment_that_heeds_no_normals_draws_for_all_light_alike() {
    let light = |heeds_normals| {
        InfiniteLight::with_map(Rgb::ONE, map(smooth), DMat3::IDENTITY, heeds_normals)
            .expect("a light")
    };
    let differ = |light: &InfiniteLight| {
        let mut random = Uniform::new(8);
        (0..100).any(|_| {
            let u = random.unit2();
            let drawn = |wanted| light.sample(u, wanted).map(|s| (s.wi, s.pdf_w));
            let w = uniform_sphere(random.unit2());
            let up = Wanted::Facing(Normal3::new(0.0, 0.0, 1.0));
            drawn(up) != drawn(Wanted::All) || light.pdf_w(w, up) != light.pdf_w(w, Wanted::All)
        })
    };
    assert!(differ(&light(true)));
    assert!(!differ(&light(false)));
}

#[test]
fn a_veil_asks_for_what_it_lets_through() {
    let mut light =
        InfiniteLight::with_map(Rgb::ONE, map(smooth), DMat3::from_rotation_y(0.8), false)
            .expect("a light");
    let share_of_upper_half = |light: &InfiniteLight, wanted| {
        let mut random = Uniform::new(4);
        let n = 10_000;
        let drawn = (0..n).filter_map(|_| light.sample(random.unit2(), wanted));
        drawn.filter(|sample| sample.wi.z() > 0.0).count() as f64 / f64::from(n)
    };
    let all = share_of_upper_half(&light, Wanted::All);
    light.heed_blocks(|w| vec![f32::from(w.z() > 0.0), f32::from(w.z() < 0.0), 1.0]);
    let behind = |veil| share_of_upper_half(&light, Wanted::Within(BlockId::new(veil)));
    assert!(
        behind(0) > 0.85 && behind(1) < 0.15,
        "{} {}",
        behind(0),
        behind(1)
    );
    // One that lets through all light alike, and none, change nothing.
    assert!((behind(2) - all).abs() < 0.02, "{} {all}", behind(2));
    let unveiled = share_of_upper_half(&light, Wanted::All);
    assert!((unveiled - all).abs() < 0.02, "{unveiled} {all}");
}

#[test]
fn an_environment_is_looked_up_where_the_format_says() {
    // Top row is +z; s = 0 is +x, s = 1/4 is +y.
    let light = |pixel: fn(usize, usize) -> f32| {
        InfiniteLight::with_map(Rgb::ONE, map(pixel), DMat3::IDENTITY, true).expect("a light")
    };
    let rows = light(|_, y| y as f32);
    let at = |t: f32| {
        let (sin, cos) = (std::f32::consts::PI * t).sin_cos();
        rows.le(Vec3::new(0.6 * sin, 0.8 * sin, cos)).g()
    };
    for y in 0..8 {
        assert!(
            (at((y as f32 + 0.5) / 8.0) - y as f32).abs() < 1e-4,
            "row {y}"
        );
    }
    assert!((at(0.5) - 3.5).abs() < 1e-4, "between rows");
    let columns = light(|x, _| x as f32);
    for x in 0..16 {
        let (sin, cos) = (std::f32::consts::TAU * (x as f32 + 0.5) / 16.0).sin_cos();
        let le = columns.le(Vec3::new(cos, sin, 0.0)).g();
        assert!((le - x as f32).abs() < 1e-3, "column {x}: {le}");
    }
}

#[test]
fn the_integral_of_radiance_over_density_is_the_maps() {
    // E[L / pdf] is the light's integral over the sphere; by quadrature of the look-up.
    let m = DMat3::from_rotation_y(0.8) * DMat3::from_diagonal(DVec3::new(1.0, 2.0, 0.7));
    let light = InfiniteLight::with_map(Rgb::ONE, map(smooth), m, true).expect("a light");
    let mut random = Uniform::new(6);
    let drawn = tyndall_test_support::z_test::Mean::of(200_000, || {
        let sample = light
            .sample(random.unit2(), Wanted::All)
            .expect("a bright map");
        f64::from(sample.radiance.g()) / f64::from(sample.pdf_w)
    });
    const N: usize = 1000;
    let mut sum = 0.0;
    for i in 0..N * N {
        let u = [(i % N) as f32 + 0.5, (i / N) as f32 + 0.5].map(|x| x / N as f32);
        sum += f64::from(light.le(uniform_sphere(u)).g());
    }
    let expected = 4.0 * PI * sum / (N * N) as f64;
    drawn.agrees_with(expected).assert_accepted("integral");
}

#[test]
fn n04_lights_are_chosen_as_often_as_they_say() {
    for weights in [
        vec![1.0; 5],
        vec![0.0, 3.0, 1.0, 0.0],
        vec![1e-38, 1e38, 1e38],
        vec![0.0; 4],
        vec![0.0, 2.0],
        vec![7.0],
    ] {
        let choice = LightChoice::new(&weights);
        let n = 200_000;
        let mut counts = vec![0usize; weights.len()];
        let mut random = Uniform::new(12);
        for i in 0..n + ENDS.len() {
            let u = ENDS.get(i).copied().unwrap_or_else(|| random.unit());
            let (index, pmf) = choice.sample(f64::from(u)).expect("there are lights");
            assert_eq!(pmf, choice.pmf(index));
            assert!(pmf > 0.0 && pmf <= 1.0);
            counts[index] += 1;
        }
        let total: f64 = weights.iter().sum();
        let mut sum = 0.0;
        for (i, weight) in weights.iter().enumerate() {
            let expected = if total > 0.0 {
                weight / total
            } else {
                1.0 / weights.len() as f64
            };
            let pmf = f64::from(choice.pmf(i));
            sum += pmf;
            let allowed = 1e-6 * expected + f64::from(f32::MIN_POSITIVE);
            assert!((pmf - expected).abs() <= allowed, "{weights:?}: {pmf}");
            let deviation = (n as f64 * expected * (1.0 - expected)).sqrt();
            let off = (counts[i] as f64 - n as f64 * expected).abs();
            assert!(
                off <= 4.0 * deviation + ENDS.len() as f64,
                "{weights:?}: {counts:?}"
            );
            assert!(
                expected > 0.0 || counts[i] == 0,
                "a light of weight 0 was chosen"
            );
        }
        assert!((sum - 1.0).abs() < 1e-6, "{weights:?}: {sum}");
    }
    assert!(LightChoice::new(&[]).sample(0.5).is_none());
}
