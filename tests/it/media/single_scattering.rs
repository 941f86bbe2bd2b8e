//! Light scattered once, against the integral over the camera's ray and the light.

use std::f64::consts::PI;

use crate::common::probe::assert_mean;
use crate::common::solids::{V, environment, homogeneous, null_box, volpath};
use crate::media::vectors::{along, cross, dot, span_in_box, tangents, unit};

const SIGMA_A: V = [0.3, 0.1, 0.8];
const SIGMA_S: V = [0.9, 0.4, 0.1];
const EYE: V = [0.13, 0.21, -5.0];
const TOWARD: V = [0.02, -0.03, 1.0];
const SAMPLES: u32 = 60_000;

/// A piece of light as seen from a point: direction, radiance times solid angle, distance.
struct Ray {
    wi: V,
    weight: f64,
    distance: f64,
}

/// A light: its directive, and what it is from a point.
struct Light {
    text: String,
    seen_from: Box<dyn Fn(V) -> Vec<Ray>>,
}

pub(crate) fn henyey_greenstein(g: f64, cos: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cos).powf(1.5))
}

/// Midpoints of n cells of [0, 1].
fn midpoints(n: usize) -> impl Iterator<Item = f64> {
    (0..n).map(move |i| (i as f64 + 0.5) / n as f64)
}

/// Expected radiance of light scattered once in a box, each channel. The light's own colour is white.
fn expected(eye: V, toward: V, lo: V, hi: V, g: f64, light: &Light) -> V {
    const STEPS: usize = 300;
    let d = unit(toward);
    let [t0, t1] = span_in_box(eye, d, lo, hi);
    let dt = (t1 - t0) / STEPS as f64;
    let mut sum = [0.0; 3];
    for x in midpoints(STEPS) {
        let t = t0 + x * (t1 - t0);
        let p = along(eye, d, t);
        for ray in (light.seen_from)(p) {
            let [_, inside] = span_in_box(p, ray.wi, lo, hi);
            let way = (t - t0) + inside.min(ray.distance);
            let scattered = henyey_greenstein(g, dot(d, ray.wi)) * ray.weight * dt;
            for k in 0..3 {
                let sigma_t = SIGMA_A[k] + SIGMA_S[k];
                sum[k] += SIGMA_S[k] * scattered * (-sigma_t * way).exp();
            }
        }
    }
    sum
}

fn assert_scatters_once(name: &str, light: &Light, unscattered: f64) {
    let slab = ([-30.0, -30.0, 0.0], [30.0, 30.0, 1.2]);
    let cube = ([-1.0, -1.0, -1.0], [0.9, 1.1, 1.0]);
    for (shape, (lo, hi)) in [("slab", slab), ("box", cube)] {
        for g in [0.0, 0.6, -0.7] {
            let world = homogeneous("fog", SIGMA_A, SIGMA_S, g)
                + &null_box(lo, hi, "fog", "")
                + &light.text;
            let [t0, t1] = span_in_box(EYE, unit(TOWARD), lo, hi);
            let mut expected = expected(EYE, TOWARD, lo, hi, g, light);
            for k in 0..3 {
                let tau = (SIGMA_A[k] + SIGMA_S[k]) * (t1 - t0);
                expected[k] += unscattered * (-tau).exp();
            }
            let scene = volpath(1, EYE, TOWARD, &world);
            assert_mean(
                &scene,
                SAMPLES,
                expected,
                &format!("{name}, {shape}, g = {g}"),
            );
        }
    }
}

fn point(from: V, intensity: f64) -> Light {
    let [x, y, z] = from;
    Light {
        text: format!(
            "LightSource \"point\" \"point from\" [{x} {y} {z}] \"rgb I\" [{intensity} {intensity} {intensity}]\n"
        ),
        seen_from: Box::new(move |p| {
            let to_light = along(from, p, -1.0);
            let distance = dot(to_light, to_light).sqrt();
            vec![Ray {
                wi: unit(to_light),
                weight: intensity / (distance * distance),
                distance,
            }]
        }),
    }
}

#[test]
fn of_a_point_light_outside() {
    assert_scatters_once("point", &point([3.0, 2.0, 4.0], 50.0), 0.0);
}

#[test]
fn of_a_point_light_inside() {
    assert_scatters_once("point", &point([0.8, 0.7, 0.8], 5.0), 0.0);
}

#[test]
fn of_a_distant_light() {
    let wi = unit([0.5, -0.3, -0.8]);
    let [x, y, z] = [0.5, -0.3, -0.8];
    let light = Light {
        text: format!(
            "LightSource \"distant\" \"point from\" [{x} {y} {z}] \"point to\" [0 0 0] \"rgb L\" [2 2 2]\n"
        ),
        seen_from: Box::new(move |_| {
            vec![Ray {
                wi,
                weight: 2.0,
                distance: f64::INFINITY,
            }]
        }),
    };
    assert_scatters_once("distant", &light, 0.0);
}

#[test]
fn of_a_uniform_sky() {
    let light = Light {
        text: environment([1.0; 3]),
        seen_from: Box::new(|_| {
            // Equal areas of the cylinder are equal solid angles.
            const N: usize = 64;
            let piece = |z: f64, turn: f64| {
                let r = (1.0 - z * z).sqrt();
                let (sin, cos) = (2.0 * PI * turn).sin_cos();
                Ray {
                    wi: [r * cos, r * sin, z],
                    weight: 4.0 * PI / (N * N) as f64,
                    distance: f64::INFINITY,
                }
            };
            midpoints(N)
                .flat_map(|v| midpoints(N).map(move |u| (v, u)))
                .map(|(v, u)| piece(2.0 * v - 1.0, u))
                .collect()
        }),
    };
    assert_scatters_once("infinite", &light, 1.0);
}

/// A flat light that shines to one side, cut into pieces of equal area.
fn flat(text: String, pieces: Vec<V>, area: f64, normal: V) -> Light {
    let area = area / pieces.len() as f64;
    Light {
        text: format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 4 4]\n{text} AttributeEnd\n"
        ),
        seen_from: Box::new(move |p| {
            pieces
                .iter()
                .map(|&q| {
                    let to_light = along(q, p, -1.0);
                    let distance = dot(to_light, to_light).sqrt();
                    let cos = -dot(normal, to_light) / distance;
                    Ray {
                        wi: unit(to_light),
                        weight: 4.0 * area * cos.max(0.0) / (distance * distance),
                        distance,
                    }
                })
                .collect()
        }),
    }
}

#[test]
fn of_a_triangle() {
    let corners = [[2.0, 1.0, 0.0], [3.0, 1.0, 2.0], [2.0, 3.0, 0.5]];
    let [a, b, c] = corners;
    let (ab, ac) = (along(b, a, -1.0), along(c, a, -1.0));
    let n = cross(ab, ac);
    let area = 0.5 * dot(n, n).sqrt();
    let normal = unit(n);
    assert!(dot(normal, a) < 0.0, "it must face the medium");
    const N: usize = 20;
    let mut pieces = Vec::new();
    // Centroids of the small triangles of both orientations.
    for i in 0..N {
        for j in 0..N - i {
            let at = |s: f64, t: f64| along(along(a, ab, s / N as f64), ac, t / N as f64);
            let (i, j) = (i as f64, j as f64);
            pieces.push(at(i + 1.0 / 3.0, j + 1.0 / 3.0));
            if i + j < (N - 1) as f64 {
                pieces.push(at(i + 2.0 / 3.0, j + 2.0 / 3.0));
            }
        }
    }
    assert_eq!(pieces.len(), N * N);
    let points: Vec<String> = corners.iter().flatten().map(f64::to_string).collect();
    let text = format!(
        "Shape \"trianglemesh\" \"point P\" [{}] \"integer indices\" [0 1 2]",
        points.join(" ")
    );
    assert_scatters_once("triangle", &flat(text, pieces, area, normal), 0.0);
}

#[test]
fn of_a_disk() {
    // Around (0, -3, 0.5), facing +y.
    const N: usize = 16;
    let pieces = midpoints(N)
        .flat_map(|v| midpoints(N).map(move |u| (v, u)))
        .map(|(v, u)| {
            let (sin, cos) = (2.0 * PI * u).sin_cos();
            let r = 1.5 * v.sqrt();
            [r * cos, -3.0, 0.5 + r * sin]
        })
        .collect();
    let text = "Translate 0 -3 0.5 Rotate -90 1 0 0 Shape \"disk\" \"float radius\" 1.5".to_owned();
    let light = flat(text, pieces, PI * 1.5 * 1.5, [0.0, 1.0, 0.0]);
    assert_scatters_once("disk", &light, 0.0);
}

#[test]
fn of_a_sphere() {
    let (center, radius) = ([-2.0, 3.0, -1.0], 1.0f64);
    let light = Light {
        text: "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [4 4 4]\n\
               Translate -2 3 -1 Shape \"sphere\" \"float radius\" 1 AttributeEnd\n"
            .to_owned(),
        seen_from: Box::new(move |p| {
            const N: usize = 16;
            let to_center = along(center, p, -1.0);
            let d2 = dot(to_center, to_center);
            let axis = unit(to_center);
            let [s, t] = tangents(axis);
            let cos_max = (1.0 - radius * radius / d2).sqrt();
            let solid_angle = 2.0 * PI * (1.0 - cos_max);
            midpoints(N)
                .flat_map(|v| midpoints(N).map(move |u| (v, u)))
                .map(|(v, u)| {
                    let cos = 1.0 - v * (1.0 - cos_max);
                    let sin = (1.0 - cos * cos).sqrt();
                    let (sin_phi, cos_phi) = (2.0 * PI * u).sin_cos();
                    let wi = along(
                        along(axis.map(|a| a * cos), s, sin * cos_phi),
                        t,
                        sin * sin_phi,
                    );
                    let b = dot(wi, to_center);
                    Ray {
                        wi,
                        weight: 4.0 * solid_angle / (N * N) as f64,
                        distance: b - (b * b - d2 + radius * radius).max(0.0).sqrt(),
                    }
                })
                .collect()
        }),
    };
    assert_scatters_once("sphere", &light, 0.0);
}

#[test]
fn seen_from_within() {
    let (lo, hi) = ([-2.0, -2.0, -3.0], [2.0, 2.0, 3.0]);
    let eye = [0.3, 0.2, -1.0];
    let light = point([0.5, 2.8, 1.0], 10.0);
    for g in [0.0, 0.8] {
        let world = homogeneous("fog", SIGMA_A, SIGMA_S, g)
            + "MediumInterface \"\" \"fog\"\n"
            + &null_box(lo, hi, "fog", "")
            + "AttributeBegin MediumInterface \"\" \"\"\n"
            + &light.text
            + "AttributeEnd\n";
        let expected = expected(eye, TOWARD, lo, hi, g, &light);
        let scene = volpath(1, eye, TOWARD, &world);
        assert_mean(&scene, SAMPLES, expected, &format!("g = {g}"));
    }
}
