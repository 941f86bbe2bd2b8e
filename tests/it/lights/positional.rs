//! Spot, projection and goniometric lights: intensity by direction, and power.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use tyndall::light::{Light, SpotLight};
use tyndall::math::{Point3, Vec3};
use tyndall::sampling::warp::uniform_sphere;
use tyndall::spectrum::Rgb;
use tyndall::world::World;
use tyndall_test_support::z_test::Mean;
use tyndall_test_support::{Uniform, assert_close};

use crate::lights::setup::{FIRST, intensity_toward, picture, receiver, world, world_of};

/// From the manual: 1 on the plateau, then δ⁴, δ linear in the cosine.
fn falloff(angle: f64, cone: f64, delta: f64) -> f64 {
    let [cos, end, start] = [angle, cone, cone - delta].map(|a| a.to_radians().cos());
    if cos < end {
        0.0
    } else if cos >= start {
        1.0
    } else {
        ((cos - end) / (start - end)).powi(4)
    }
}

#[test]
fn a_spot_light_falls_off_toward_its_edge() {
    let spot = world(
        "LightSource \"spot\" \"point from\" [0 0 1] \"point to\" [0 0 0] \"rgb I\" [7 8 9]\n\
         \"float coneangle\" 40 \"float conedeltaangle\" 15 \"rgb scale\" [2 1 1]",
    );
    for angle in [0.0f64, 10.0, 24.9, 27.0, 30.0, 35.0, 39.0, 40.1, 60.0, 89.0] {
        let (sin, cos) = angle.to_radians().sin_cos();
        // On the floor, where the inclination and the distance make it I f cos³.
        let at = receiver([(sin / cos) as f32, 0.0, 0.0], [0.0, 0.0, 1.0]);
        let sample = spot.sample_light(&at, 0.5, [0.5; 2]);
        let irradiance = sample.map_or(Rgb::BLACK, |s| s.radiance * s.wi.z());
        let expected = falloff(angle, 40.0, 15.0) * cos.powi(3);
        for (actual, i) in irradiance.to_array().into_iter().zip([14.0, 8.0, 9.0]) {
            assert_close(f64::from(actual), i * expected, 2e-4);
        }
    }
    // Behind.
    assert!(intensity_toward(&spot, [0.0, 0.0, 1.0], [0.0, 0.1, 1.0]).is_black());
}

#[test]
fn a_spot_light_goes_where_the_transform_puts_it() {
    let cone = "\"float coneangle\" 40 \"float conedeltaangle\" 40";
    let [plain, moved, stretched] = [
        format!("LightSource \"spot\" \"point from\" [.1 .2 .9] \"point to\" [.1 1.2 -.1] {cone}"),
        format!(
            "Translate .1 .2 .9 Rotate -45 1 0 0 Scale .5 .5 .5 Translate 0 0 -2\n\
             LightSource \"spot\" \"point from\" [0 0 2] \"point to\" [0 4 2] {cone}"
        ),
        format!("Scale 2 1 1 LightSource \"spot\" \"point from\" [0 0 .5] {cone}"),
    ]
    .map(|light| world(&light));
    let mut random = Uniform::new(3);
    for _ in 0..500 {
        let d = uniform_sphere(random.unit2()).to_f64().as_vec3().to_array();
        let [a, b] = [&plain, &moved].map(|w| intensity_toward(w, [0.1, 0.2, 0.9], d).g());
        assert!((a - b).abs() < 1e-5, "{a} {b}");
        // Angles are measured in light space.
        let in_light = DVec3::new(f64::from(d[0]) / 2.0, d[1].into(), d[2].into()).normalize();
        let angle = in_light.z.acos().to_degrees();
        let c = intensity_toward(&stretched, [0.0, 0.0, 0.5], d).g();
        let expected = falloff(angle, 40.0, 40.0) as f32;
        assert!((c - expected).abs() < 1e-5, "{c} {expected}");
    }
}

#[test]
fn n17_a_tiny_cone_keeps_its_power() {
    let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
    let (s, t) = axis.any_orthonormal_pair();
    for degrees in [1e-4f32, 1e-2, 0.1, 1.0, 30.0, 90.0, 180.0] {
        let placed = DMat3::from_cols(s, t, axis);
        let spot = SpotLight::new(Point3::ZERO, Rgb::ONE, placed, degrees, 0.0);
        let flux = 4.0 * PI * (0.5 * f64::from(degrees).to_radians()).sin().powi(2);
        assert_close(spot.power(), flux, 1e-4);
        // By the rays it emits.
        let mut random = Uniform::new(1);
        let emitted = Mean::of(2000, || {
            let (d, i, pdf) = spot.sample_direction(random.unit2()).expect("a direction");
            let off = (d.to_f64() - axis).length();
            assert!(off <= 2.0 * (0.5 * f64::from(degrees).to_radians()).sin() + 1e-6);
            f64::from(i.g()) / f64::from(pdf)
        });
        assert_close(emitted.value, flux, 1e-3);
        assert_eq!(spot.intensity(Vec3::from_f64(axis)), Rgb::ONE, "{degrees}");
    }
}

/// Flux of a light that stands at a point, by quadrature of its intensity.
fn flux(intensity: impl Fn(Vec3) -> Rgb) -> f64 {
    const N: usize = 1500;
    let mut sum = 0.0;
    for i in 0..N * N {
        let u = [(i % N) as f32 + 0.5, (i / N) as f32 + 0.5].map(|x| x / N as f32);
        sum += f64::from(intensity(uniform_sphere(u)).g());
    }
    4.0 * PI * sum / (N * N) as f64
}

fn intensity_of(world: &World) -> impl Fn(Vec3) -> Rgb {
    move |w| match world.light(FIRST) {
        Light::Spot(spot) => spot.intensity(w),
        Light::Projection(projection) => projection.intensity(w),
        Light::Goniometric(goniometric) => goniometric.intensity(w),
        other => panic!("{other:?}"),
    }
}

#[test]
fn power_is_the_integral_of_intensity() {
    let map = picture(16, 8, |x, y| 1.0 + (x * y % 5) as f32);
    for (light, relative) in [
        (
            "LightSource \"spot\" \"float coneangle\" 50 \"float conedeltaangle\" 20",
            1e-3,
        ),
        (
            "LightSource \"spot\" \"float coneangle\" 20 \"float conedeltaangle\" 30",
            2e-3,
        ),
        (
            "Rotate 33 1 2 3 LightSource \"projection\" \"float fov\" 70",
            2e-3,
        ),
        (
            "LightSource \"projection\" \"float fov\" 100 \"string mapname\" \"a.pfm\"",
            5e-3,
        ),
        (
            "Rotate 40 1 0 1 LightSource \"goniometric\" \"string mapname\" \"a.pfm\"",
            5e-3,
        ),
    ] {
        let world = world_of("spatial", light, Some(&map));
        let power = match world.light(FIRST) {
            Light::Spot(spot) => spot.power(),
            Light::Projection(projection) => projection.power(),
            Light::Goniometric(goniometric) => goniometric.power(),
            other => panic!("{other:?}"),
        };
        assert_close(power, flux(intensity_of(&world)), relative);
    }
}

#[test]
fn a_projected_picture_has_its_top_row_at_the_smallest_y() {
    for (width, height, half) in [(4, 2, [2.0, 1.0]), (2, 4, [1.0, 2.0]), (4, 4, [1.0, 1.0])] {
        let map = picture(width, height, |x, y| (1 + x + 10 * y) as f32);
        let light = "Translate .1 .2 .5 LightSource \"projection\" \"float fov\" 90 \"rgb I\" [3 3 3]\n\
             \"string mapname\" \"slide.pfm\"";
        let world = world_of("spatial", light, Some(&map));
        let toward = |s: f32, t: f32, z: f32| {
            let d = [(2.0 * s - 1.0) * half[0], (2.0 * t - 1.0) * half[1], z];
            f64::from(intensity_toward(&world, [0.1, 0.2, 0.5], d).g())
        };
        for y in 0..height {
            for x in 0..width {
                let s = (x as f32 + 0.5) / width as f32;
                let t = (y as f32 + 0.5) / height as f32;
                assert_close(toward(s, t, 1.0), 3.0 * (1 + x + 10 * y) as f64, 1e-4);
            }
        }
        for (s, t, z) in [
            (-0.01, 0.5, 1.0),
            (1.01, 0.5, 1.0),
            (0.5, -0.01, 1.0),
            (0.5, 1.01, 1.0),
        ] {
            assert_eq!(toward(s, t, z), 0.0, "outside");
        }
        assert_eq!(toward(0.4, 0.6, -1.0), 0.0, "behind");
    }
}

#[test]
fn a_projection_without_a_picture_is_a_white_square() {
    let world = world("LightSource \"projection\" \"float fov\" 60 \"rgb I\" [5 5 5]");
    let tan = 30f64.to_radians().tan() as f32;
    let toward = |x: f32, y: f32| intensity_toward(&world, [0.0; 3], [x * tan, y * tan, 1.0]).g();
    for [x, y] in [[0.0, 0.0], [0.99, 0.99], [-0.99, 0.5]] {
        assert_close(toward(x, y).into(), 5.0, 1e-5);
    }
    assert_eq!([toward(1.01, 0.0), toward(0.0, -1.01)], [0.0; 2]);
}

#[test]
fn a_goniometric_map_has_its_pole_on_y() {
    let map = picture(8, 4, |x, y| (1 + x + 10 * y) as f32);
    let light = "Translate .1 .2 .5 LightSource \"goniometric\" \"string mapname\" \"lamp.pfm\"";
    let world = world_of("spatial", light, Some(&map));
    for y in 0..4 {
        for x in 0..8 {
            let (sin, cos) = (PI * (y as f64 + 0.5) / 4.0).sin_cos();
            let (sin_phi, cos_phi) = (2.0 * PI * (x as f64 + 0.5) / 8.0).sin_cos();
            let d = [sin * cos_phi, cos, sin * sin_phi].map(|x| x as f32);
            let actual = intensity_toward(&world, [0.1, 0.2, 0.5], d).g();
            assert_close(actual.into(), (1 + x + 10 * y) as f64, 1e-3);
        }
    }
}

#[test]
fn a_goniometric_light_without_a_map_is_a_point() {
    let world = world("Translate 0 0 .5 LightSource \"goniometric\" \"rgb I\" [5 5 5]");
    for d in [[1.0, 0.0, 0.0], [0.0, -0.3, -0.8]] {
        let actual = intensity_toward(&world, [0.0, 0.0, 0.5], d).g();
        assert_close(actual.into(), 5.0, 1e-5);
    }
}
