//! Rays that leave lights: drawn by their density, and as much light as light sampling finds.

use tyndall::ids::LightId;
use tyndall::image::Image;
use tyndall::light::Light;
use tyndall::math::{Frame, Normal3, Point3, Ray, Vec3};
use tyndall::sampling::warp::cosine_hemisphere;
use tyndall::world::{World, spawn_ray};
use tyndall_test_support::Uniform;
use tyndall_test_support::chi2::{Chi2, Sphere, Square};
use tyndall_test_support::z_test::Mean;

use crate::lights::setup::{FIRST, picture, receiver, world_of};

fn map() -> Image {
    picture(16, 8, |x, y| 0.2 + ((3 * x + 5 * y) % 7) as f32)
}

fn area(rest: &str) -> String {
    format!("AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [2 3 4] {rest} AttributeEnd")
}

/// Every kind of light, above the plane where its light is caught.
fn lights() -> Vec<String> {
    let stretched = "Translate .1 0 .5 Rotate 30 1 1 0 Scale .1 .2 .15";
    let mut lights: Vec<String> = [
        "LightSource \"point\" \"point from\" [.1 0 .4]",
        "Translate 0 0 .5 Rotate 160 1 0 0 LightSource \"spot\" \"float coneangle\" 50 \"float conedeltaangle\" 30",
        "Translate 0 0 .5 Rotate 160 1 0 0 Scale 1 2 1 LightSource \"spot\"",
        "Translate 0 0 .5 Rotate 170 1 0 0 LightSource \"projection\" \"float fov\" 60 \"string mapname\" \"a.pfm\"",
        "Translate 0 0 .5 Rotate 170 1 0 0 Scale 1 .5 1 LightSource \"projection\"",
        "Translate 0 0 .4 Rotate 70 1 0 1 LightSource \"goniometric\" \"string mapname\" \"a.pfm\"",
        "LightSource \"distant\" \"point from\" [.3 .1 1] \"point to\" [0 0 0]",
        "LightSource \"infinite\"",
        "Rotate 20 1 2 3 LightSource \"infinite\" \"string mapname\" \"a.pfm\"",
    ]
    .map(str::to_owned)
    .to_vec();
    for shape in [
        "Shape \"sphere\"",
        "Shape \"sphere\" \"float phimax\" 200 \"float zmax\" .5",
        "Rotate 180 1 0 0 Shape \"disk\"",
        "Shape \"cylinder\"",
        "Shape \"cone\"",
        "Shape \"paraboloid\"",
        "Shape \"hyperboloid\" \"point p1\" [1 0 0] \"point p2\" [.5 1 1]",
        "Shape \"trianglemesh\" \"point P\" [-1 -1 0  1 0 0  0 1 1] \"integer indices\" [0 2 1]",
    ] {
        lights.push(area(&format!("{stretched} {shape}")));
    }
    lights.push(
        area(&format!("{stretched} Shape \"disk\""))
            .replace("\"rgb L\"", "\"bool twosided\" \"true\" \"rgb L\""),
    );
    for style in ["flat", "cylinder"] {
        lights.push(area(&format!(
            "Translate 0 0 .4 Shape \"curve\" \"string type\" \"{style}\" \"float width\" .08 \"integer splitdepth\" 0\n\
             \"point P\" [-.2 0 0  -.1 .1 .1  .1 -.1 0  .2 0 .1]"
        )));
    }
    lights
}

/// Half side and height of the square that catches light from above.
const HALF: f32 = 0.3;
const HEIGHT: f32 = 0.05;

/// Flux through the square by following rays from every light.
fn caught(world: &World, seed: u64) -> Mean {
    let mut random = Uniform::new(seed);
    Mean::of(400_000, || {
        let mut flux = 0.0;
        for light in 0..world.n_lights() {
            let (u_pos, u_dir) = (random.unit2(), random.unit2());
            let Some(s) = world.sample_emission(LightId::new(light), u_pos, u_dir, 0.0) else {
                continue;
            };
            let ray = spawn_ray(s.p, s.p_err, s.ng, s.d, 0.0);
            let t = (HEIGHT - ray.o.z()) / ray.d.z();
            let p = ray.at(t);
            let is_caught =
                t > 0.0 && ray.d.z() < 0.0 && p.x().abs() <= HALF && p.y().abs() <= HALF;
            if !is_caught || world.closest(&ray, t).is_some() {
                continue;
            }
            let cos = if s.ng.length_squared() > 0.0 {
                s.ng.abs_dot(s.d)
            } else {
                1.0
            };
            flux += f64::from(s.radiance.g() * cos) / (f64::from(s.pdf_pos) * f64::from(s.pdf_dir));
        }
        flux
    })
}

/// The same by looking for light from points of the square.
fn found(world: &World, seed: u64) -> Mean {
    let mut random = Uniform::new(seed);
    let area = f64::from(4.0 * HALF * HALF);
    Mean::of(400_000, || {
        let [x, y] = random.unit2().map(|u| (2.0 * u - 1.0) * HALF);
        let at = receiver([x, y, HEIGHT], [0.0, 0.0, 1.0]);
        let u_light = f64::from(random.unit());
        match world.sample_light(&at, u_light, random.unit2()) {
            Some(s) if s.wi.z() > 0.0 && !world.is_occluded(&s) => {
                area * f64::from(s.radiance.g() * s.wi.z() / s.pdf)
            }
            _ => 0.0,
        }
    })
}

/// The same by going on in random directions from points of the square.
fn met(world: &World, seed: u64) -> Mean {
    let mut random = Uniform::new(seed);
    let scale = f64::from(4.0 * HALF * HALF) * std::f64::consts::PI;
    Mean::of(400_000, || {
        let [x, y] = random.unit2().map(|u| (2.0 * u - 1.0) * HALF);
        let ray = Ray {
            o: Point3::new(x, y, HEIGHT),
            d: cosine_hemisphere(random.unit2()),
            time: 0.0,
        };
        let Some(hit) = world.closest(&ray, f32::INFINITY) else {
            return 0.0;
        };
        let surface = world.surface(&ray, &hit);
        let emitted = world.emitted(&hit, &surface, -ray.d);
        emitted.map_or(0.0, |(_, le)| scale * f64::from(le.g()))
    })
}

#[test]
fn emitted_light_is_the_light_that_is_found() {
    for light in lights() {
        let world = world_of("spatial", &light, Some(&map()));
        let (emitted, seen) = (caught(&world, 1), found(&world, 2));
        assert!(emitted.value > 0.0, "{light}");
        if light.contains("AreaLightSource") {
            met(&world, 3)
                .agrees_with_mean(&seen)
                .assert_accepted(&light);
        }
        emitted.agrees_with_mean(&seen).assert_accepted(&light);
        assert!(
            emitted.standard_error < 0.15 * emitted.value,
            "{light}: {emitted:?}"
        );
    }
    // The judge is awake: 5 % are not lost.
    let world = world_of("spatial", &lights()[0], None);
    let emitted = caught(&world, 1);
    let dimmed = Mean {
        value: 0.95 * emitted.value,
        ..found(&world, 2)
    };
    assert!(!emitted.agrees_with_mean(&dimmed).accepted());
}

#[test]
fn directions_are_drawn_by_their_density() {
    let family = Chi2 {
        n_tests: lights().len(),
        ..Chi2::default()
    };
    for text in lights() {
        let world = world_of("spatial", &text, Some(&map()));
        // The direction depends on the normal: keep one point. On curves it is drawn first and uniform.
        let u_pos = [0.3, 0.6];
        let Some(at) = world.sample_emission(FIRST, u_pos, [0.4, 0.3], 0.0) else {
            assert!(text.contains("curve"), "{text}");
            continue;
        };
        // A hard edge has a test of its own, in the plane of the picture.
        let has_hard_edge = text.contains("projection");
        let light = world.light(FIRST);
        if matches!(light, Light::Distant(_)) || has_hard_edge || text.contains("curve") {
            continue;
        }
        // Around the normal of a surface, so that its horizon is a border between cells.
        let is_surface = text.contains("AreaLightSource");
        let frame = if is_surface {
            Frame::from_z(at.ng.into())
        } else {
            Frame::from_z(Vec3::new(0.0, 0.0, 1.0))
        };
        let mut n_other = 0;
        let draw = |u: &mut Uniform| {
            let s = world.sample_emission(FIRST, u_pos, u.unit2(), 0.0)?;
            let (pdf_pos, pdf_dir) = world.pdf_emission(FIRST, s.p, s.ng, s.d);
            let same = |a: f32, b: f32| (a / b - 1.0).abs() < 1e-2;
            n_other += usize::from(!same(pdf_dir, s.pdf_dir));
            n_other += usize::from(light.position().is_none() && !same(pdf_pos, s.pdf_pos));
            Some(frame.to_local(s.d).to_f64().as_vec3().to_array())
        };
        let pdf = |d: [f32; 3]| {
            let d = frame.to_world(Vec3::new(d[0], d[1], d[2]));
            f64::from(world.pdf_emission(FIRST, at.p, at.ng, d).1)
        };
        family.check(Sphere, draw, pdf).assert_accepted(&text);
        // Rounding may put a direction into the next texel, or to the other side of grazing.
        assert!(
            n_other <= 100,
            "{text}: {n_other} of 200000 densities differ"
        );
    }
}

#[test]
fn projected_directions_are_drawn_by_their_density() {
    let text = "LightSource \"projection\" \"float fov\" 90 \"string mapname\" \"a.pfm\"";
    let world = world_of("spatial", text, Some(&map()));
    // The picture is twice as wide as high, and its shorter side reaches from −1 to 1 on the plane z = 1.
    let draw = |u: &mut Uniform| {
        let s = world.sample_emission(FIRST, [0.5; 2], u.unit2(), 0.0)?;
        let (x, y) = (s.d.x() / s.d.z(), s.d.y() / s.d.z());
        Some([x / 4.0 + 0.5, y / 2.0 + 0.5].map(|c| c.clamp(0.0, 1.0 - f32::EPSILON)))
    };
    let pdf = |[s, t]: [f32; 2]| {
        let on_plane = Vec3::new(4.0 * s - 2.0, 2.0 * t - 1.0, 1.0);
        let d = on_plane / on_plane.length();
        let pdf_w = world.pdf_emission(FIRST, Point3::ZERO, Normal3::ZERO, d).1;
        // 8 is the area of the window, and cos³ the solid angle of an area of the plane.
        f64::from(pdf_w * d.z().powi(3)) * 8.0
    };
    Chi2::default()
        .check(Square, draw, pdf)
        .assert_accepted("projection");
}

#[test]
fn densities_of_curves_are_those_of_their_samples() {
    for text in lights().iter().filter(|text| text.contains("curve")) {
        let world = world_of("spatial", text, None);
        let mut random = Uniform::new(7);
        let mut n = 0;
        for _ in 0..20_000 {
            let Some(s) = world.sample_emission(FIRST, random.unit2(), random.unit2(), 0.0) else {
                continue;
            };
            let (pdf_pos, pdf_dir) = world.pdf_emission(FIRST, s.p, s.ng, s.d);
            assert!((pdf_pos / s.pdf_pos - 1.0).abs() < 1e-4, "{pdf_pos} {s:?}");
            assert_eq!(pdf_dir, s.pdf_dir);
            n += 1;
        }
        assert!(n > 200, "{n}");
    }
}

#[test]
fn rays_from_infinity_start_outside_the_scene() {
    for text in lights()
        .iter()
        .filter(|t| t.contains("infinite") || t.contains("distant"))
    {
        let world = world_of("spatial", text, Some(&map()));
        let (center, radius) = world.bounding_sphere();
        let mut random = Uniform::new(9);
        for _ in 0..1000 {
            let Some(s) = world.sample_emission(FIRST, random.unit2(), random.unit2(), 0.0) else {
                continue;
            };
            let ahead = (s.p.to_f64() - center).dot(s.d.to_f64());
            assert!((ahead + radius).abs() < 1e-5 * radius, "{ahead}");
            assert!(s.p.distance(Point3::from_f64(center)) < 1.5 * radius as f32);
        }
    }
}
