//! Light that reaches a matte floor directly.

use std::f64::consts::PI;

use tyndall::compile::CompileOptions;
use tyndall_test_support::z_test::Mean;

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::scene::compile_scene;
use crate::common::solids::{V, environment, seen_by};

/// Seen at (0.3, 0.35, 0).
const EYE: V = [0.4, 0.3, 0.5];
const TOWARD: V = [-0.1, 0.05, -0.5];
const RECEIVER: V = [0.3, 0.35, 0.0];
const SAMPLES: u32 = 50_000;

fn on_floor(albedo: f64, light: &str) -> String {
    format!(
        "AttributeBegin Material \"matte\" \"rgb Kd\" [{albedo} {albedo} {albedo}]\n\
         Shape \"disk\" \"float radius\" 50 AttributeEnd\n{light}"
    )
}

fn floor(integrator: &str, albedo: f64, light: &str) -> String {
    seen_by(integrator, 1, EYE, TOWARD, &on_floor(albedo, light))
}

/// Both integrators, albedo 0.5, irradiance per channel.
fn assert_irradiance(light: &str, irradiance: f64, what: &str) {
    for integrator in ["path", "volpath"] {
        let scene = floor(integrator, 0.5, light);
        assert_mean(&scene, SAMPLES, [0.5 / PI * irradiance; 3], what);
    }
}

fn lamp(rest: &str) -> String {
    let [x, y, _] = RECEIVER;
    format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] Translate {x} {y} 0 {rest} AttributeEnd\n"
    )
}

#[test]
fn of_point_and_distant_lights_needs_no_dice() {
    let [x, y, _] = RECEIVER;
    let point = format!(
        "LightSource \"point\" \"point from\" [{} {y} 4] \"rgb I\" [7 8 9]\n",
        x + 3.0
    );
    let expected = [7.0, 8.0, 9.0].map(|i| 0.5 / PI * i / 25.0 * 0.8);
    assert_exact(&floor("path", 0.5, &point), expected, "point");
    let distant = "LightSource \"distant\" \"point from\" [0.6 0 0.8] \"point to\" [0 0 0] \"rgb L\" [3 4 5]\n";
    let expected = [3.0, 4.0, 5.0].map(|l| 0.5 / PI * l * 0.8);
    assert_exact(&floor("path", 0.5, distant), expected, "distant");
}

#[test]
fn of_a_uniform_sky_is_the_albedo() {
    assert_irradiance(&environment([1.0; 3]), PI, "sky");
}

#[test]
fn of_a_disk_overhead() {
    for (radius, height) in [(1.0, 2.0), (3.0, 0.7), (0.01, 5.0), (20.0, 1.0)] {
        let disk = lamp(&format!(
            "Translate 0 0 {height} Rotate 180 1 0 0 Shape \"disk\" \"float radius\" {radius}"
        ));
        let expected = PI * radius * radius / (radius * radius + height * height);
        assert_irradiance(&disk, expected, &format!("disk {radius} at {height}"));
    }
}

#[test]
fn n01_of_a_sphere_from_large_to_a_speck() {
    // Irradiance of a sphere overhead: pi L (r/d)^2. The radiance makes it pi.
    for ratio in [
        0.99, 0.5, 0.1, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5, 1e-6, 1e-7,
    ] {
        let distance = 2.0;
        let radius = ratio * distance;
        let radiance = 1.0 / (ratio * ratio);
        let light = format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{radiance} {radiance} {radiance}]\n\
             Translate {} {} {distance} Shape \"sphere\" \"float radius\" {radius} AttributeEnd\n",
            RECEIVER[0], RECEIVER[1]
        );
        for integrator in ["path", "volpath"] {
            // From the side and close to the floor, below the largest sphere.
            let (eye, toward) = ([RECEIVER[0] + 3.0, RECEIVER[1], 0.05], [-3.0, 0.0, -0.05]);
            let scene = seen_by(integrator, 1, eye, toward, &on_floor(1.0, &light));
            let mean = Probe::new(&scene).means(200_000)[1];
            assert!(mean.standard_error < 2.5e-4 * 4.0, "{ratio}: {mean:?}");
            let off = (mean.value - 1.0).abs();
            assert!(off < 1e-3, "radius / distance = {ratio}: {mean:?}");
        }
    }
}

/// Lambert's formula for the irradiance of a polygon of radiance 1, its corners seen from the receiver.
fn polygon(corners: &[V]) -> f64 {
    let dot = |a: V, b: V| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let unit = |a: V| a.map(|x| x / dot(a, a).sqrt());
    let mut sum = 0.0;
    for (i, &a) in corners.iter().enumerate() {
        let (a, b) = (unit(a), unit(corners[(i + 1) % corners.len()]));
        let cross = [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ];
        sum += dot(a, b).acos() * unit(cross)[2];
    }
    0.5 * sum.abs()
}

#[test]
fn of_triangles_and_quadrilaterals() {
    let triangle = [[1.0, -0.5, 1.0], [-0.5, 0.2, 2.0], [0.3, 1.5, 0.6]];
    let square = [
        [-1.0, -1.0, 0.8],
        [-1.0, 1.0, 0.8],
        [1.0, 1.0, 0.8],
        [1.0, -1.0, 0.8],
    ];
    for (corners, indices) in [(&triangle[..], "0 1 2"), (&square[..], "0 1 2 0 2 3")] {
        let points: Vec<String> = corners.iter().flatten().map(f64::to_string).collect();
        let light = lamp(&format!(
            "Shape \"trianglemesh\" \"point P\" [{}] \"integer indices\" [{indices}]",
            points.join(" ")
        ))
        .replace("[1 1 1]", "[1 1 1] \"bool twosided\" \"true\"");
        assert_irradiance(&light, polygon(corners), indices);
    }
}

/// Irradiance of a convex patch of a stretched unit sphere that emits outward, by the midpoint rule.
fn ellipsoid(center: V, scale: V, z: [f64; 2], phi_max: f64) -> f64 {
    const N: usize = 1000;
    let mut sum = 0.0;
    for i in 0..N * N {
        let [u, v] = [i % N, i / N].map(|k| (k as f64 + 0.5) / N as f64);
        let z = z[0] + v * (z[1] - z[0]);
        let (sin, cos) = (phi_max * u).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let n = [r * cos, r * sin, z];
        let p = [0, 1, 2].map(|k| center[k] + scale[k] * n[k]);
        // Normal times area element of the stretched sphere.
        let volume = scale[0] * scale[1] * scale[2];
        let m = [0, 1, 2].map(|k| n[k] / scale[k] * volume);
        let d2 = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
        let facing = -(m[0] * p[0] + m[1] * p[1] + m[2] * p[2]);
        sum += facing.max(0.0) * p[2] / (d2 * d2);
    }
    sum * phi_max * (z[1] - z[0]) / (N * N) as f64
}

#[test]
fn l01_of_scaled_spheres() {
    let whole = ([-1.0, 1.0], 2.0 * PI);
    let balls = [
        (
            "Translate 0 0 3 Scale 2 2 2 Shape \"sphere\" \"float radius\" 0.5",
            [1.0; 3],
        ),
        (
            "Translate 0 0 3 Scale 2 0.5 1 Shape \"sphere\"",
            [2.0, 0.5, 1.0],
        ),
    ];
    for (shape, scale) in balls {
        let expected = ellipsoid([0.0, 0.0, 3.0], scale, whole.0, whole.1);
        assert_irradiance(&lamp(shape), expected, shape);
    }
}

#[test]
fn l02_of_parts_of_spheres() {
    let half = "Translate 0.4 0 2 Shape \"sphere\" \"float phimax\" 180";
    let expected = ellipsoid([0.4, 0.0, 2.0], [1.0; 3], [-1.0, 1.0], PI);
    assert_irradiance(&lamp(half), expected, half);
    let belt =
        "Translate 0.4 0 2 Scale 1 2 1 Shape \"sphere\" \"float zmin\" -0.75 \"float zmax\" 0.5";
    let expected = ellipsoid([0.4, 0.0, 2.0], [1.0, 2.0, 1.0], [-0.75, 0.5], 2.0 * PI);
    assert_irradiance(&lamp(belt), expected, belt);
}

#[test]
fn lamps_shine_from_the_side_of_their_normal_or_from_both() {
    let disk = |change: &str, two_sided: bool| {
        lamp(&format!("Translate 0 0 2 {change} Shape \"disk\"")).replace(
            "[1 1 1]",
            &format!("[1 1 1] \"bool twosided\" \"{two_sided}\""),
        )
    };
    let lit = PI / 5.0;
    assert_irradiance(&disk("", false), 0.0, "away");
    assert_irradiance(&disk("ReverseOrientation", false), lit, "reversed");
    assert_irradiance(&disk("Rotate 180 1 0 0", false), lit, "turned");
    assert_irradiance(&disk("", true), lit, "both sides");
}

/// A portable float map of 16 x 8 pixels, top row first in `pixel`.
fn pfm(pixel: impl Fn(usize, usize) -> f32) -> Vec<u8> {
    let mut bytes = b"PF\n16 8\n-1.0\n".to_vec();
    for y in (0..8).rev() {
        for x in 0..16 {
            for _ in 0..3 {
                bytes.extend(pixel(x, y).to_le_bytes());
            }
        }
    }
    bytes
}

#[test]
fn n12_of_an_environment_with_a_bright_texel() {
    let texel = |x: usize, y: usize| if [x, y] == [5, 2] { 1e3 } else { 0.5 };
    // The format's look-up: bilinear between pixel centres, s from +x toward +y, t from +z.
    let le = |s: f64, t: f64| {
        let [x, y] = [s * 16.0 - 0.5, t * 8.0 - 0.5];
        let at = |x: f64, y: f64| {
            f64::from(texel(
                x.rem_euclid(16.0) as usize,
                y.rem_euclid(8.0) as usize,
            ))
        };
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let row = |y: f64| at(x.floor(), y) * (1.0 - fx) + at(x.floor() + 1.0, y) * fx;
        row(y.floor()) * (1.0 - fy) + row(y.floor() + 1.0) * fy
    };
    const N: usize = 2000;
    let mut irradiance = 0.0;
    for i in 0..N * N {
        let [s, t] = [(i % N) as f64 + 0.5, (i / N) as f64 + 0.5].map(|k| k / N as f64);
        let (sin, cos) = (PI * t).sin_cos();
        irradiance += le(s, t) * cos.max(0.0) * sin;
    }
    irradiance *= 2.0 * PI * PI / (N * N) as f64;
    let text =
        "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\nPixelFilter \"box\"\n"
            .to_owned()
            + &floor(
                "path",
                0.5,
                "LightSource \"infinite\" \"string mapname\" \"sky.pfm\"\n",
            );
    let read = |path: &str| (path == "sky.pfm").then(|| pfm(texel));
    let job = compile_scene(text, &CompileOptions::default(), read).job;
    let mean = Probe::of(job).means(SAMPLES)[0];
    mean.agrees_with(0.5 / PI * irradiance)
        .assert_accepted("sky");
    // 64 independent samples suffice for ten percent: the bright texel is sought out.
    let spread = mean.standard_error * f64::from(SAMPLES).sqrt();
    assert!(spread / 8.0 < 0.1 * mean.value, "{mean:?}");
}

#[test]
fn of_many_lights_is_the_sum_whatever_the_strategy() {
    let [x, y, _] = RECEIVER;
    let lights = [
        format!("LightSource \"point\" \"point from\" [{x} {y} 4] \"rgb I\" [7 1 9]\n"),
        "LightSource \"distant\" \"point from\" [1 2 5] \"rgb L\" [1 2 0.5]\n".to_owned(),
        environment([0.2, 0.3, 0.4]),
        lamp("Translate 1 0 2 Shape \"sphere\" \"float radius\" 0.3"),
        lamp("Translate 0 1 2 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 0.4"),
        lamp(
            "Shape \"trianglemesh\" \"point P\" [-1 -1 2 -1 1 2 -2 -1 2] \"integer indices\" [0 1 2]",
        ),
    ];
    let means = |light: &str| Probe::new(&floor("path", 0.5, light)).means(SAMPLES);
    // Each light alone, among the others turned off, which hide a part of the sky.
    let off = |light: &String| light.replace("\"rgb L\" [1 1 1]", "\"rgb L\" [0 0 0]");
    let lamps_off: String = lights[3..].iter().map(off).collect();
    let alone: Vec<[Mean; 3]> = (0..lights.len())
        .map(|i| match i {
            0..3 => means(&(lights[i].clone() + &lamps_off)),
            _ => means(&lights[i]),
        })
        .collect();
    let sum = [0, 1, 2].map(|k| Mean {
        value: alone.iter().map(|m| m[k].value).sum(),
        standard_error: alone
            .iter()
            .map(|m| m[k].standard_error.powi(2))
            .sum::<f64>()
            .sqrt(),
    });
    for strategy in ["uniform", "power", "spatial"] {
        let scene = floor("path", 0.5, &lights.concat());
        let scene = scene.replace(
            "Integrator \"path\"",
            &format!("Integrator \"path\" \"string lightsamplestrategy\" \"{strategy}\""),
        );
        let all = Probe::new(&scene).means(4 * SAMPLES);
        for (all, sum) in all.iter().zip(&sum) {
            all.agrees_with_mean(sum).assert_accepted(strategy);
        }
    }
}
