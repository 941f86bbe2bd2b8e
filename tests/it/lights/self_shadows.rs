//! Hyperboloids whose normal in pbrt-v3 is not that of their surface: light is stopped where the two tell different sides.

use tyndall::camera::CameraSample;
use tyndall::compile::CompileOptions;
use tyndall::math::{Ray, Vec3};
use tyndall::world::spawn_ray;

use crate::common::probe::{Probe, assert_exact};
use crate::common::scene::compile_scene;
use crate::common::seen::{V, environment, seen_by};

/// Where the light comes from.
const TOWARD_LIGHT: V = [0.6, -0.64, 0.48];

const BENT: [&str; 2] = [
    "Shape \"hyperboloid\" \"point p1\" [1.5 0.2 0.3] \"point p2\" [0.6 -0.4 1.4]",
    "Shape \"hyperboloid\" \"point p1\" [0.4 0.9 -1.3] \"point p2\" [1.1 -0.2 -0.2]",
];

const INTEGRATORS: [&str; 7] = [
    "path",
    "volpath",
    "directlighting",
    "whitted",
    "bdpt",
    "mlt",
    "sppm",
];

#[test]
fn hyperboloids_shadow_themselves_by_their_normal() {
    let [x, y, z] = TOWARD_LIGHT;
    let light = format!(
        "LightSource \"distant\" \"point from\" [{x} {y} {z}] \"point to\" [0 0 0] \"rgb L\" [3 3 3]\n"
    );
    let toward_light = Vec3::from_f64(TOWARD_LIGHT.into());
    let (mut n_lit, mut n_stopped) = (0, 0);
    for shape in BENT {
        let world = format!("{light}Material \"matte\" \"rgb Kd\" [.5 .5 .5] {shape}\n");
        for k in 0..400 {
            let turn = f64::from(k) * 2.4;
            let eye = [
                6.0 * turn.cos(),
                6.0 * turn.sin(),
                0.1 * f64::from(k % 50) - 2.0,
            ];
            let aim = [
                0.9 * (3.0 * turn).sin(),
                0.9 * (5.0 * turn).cos(),
                0.15 * f64::from(k % 7) - 0.3,
            ];
            let toward = [0, 1, 2].map(|axis| aim[axis] - eye[axis]);
            let scene = |integrator: &str| seen_by(integrator, 1, eye, toward, &world);
            let text = format!(
                "Film \"image\" \"integer xresolution\" 1 \"integer yresolution\" 1\n{}",
                scene("path")
            );
            let compiled = compile_scene(text, &CompileOptions::default(), |_| None);
            let there = &compiled.job.world;
            let middle = CameraSample {
                raster: [0.5; 2],
                time: 0.0,
                lens: [0.5; 2],
            };
            let ray = compiled.job.camera.ray(&middle).expect("a pinhole").ray;
            let Some(hit) = there.closest(&ray, f32::INFINITY) else {
                continue;
            };
            let surface = there.surface(&ray, &hit);
            let cosines = [surface.ng, surface.n_surface].map(|n| n.dot(toward_light));
            let alike = surface.ng.0.dot(surface.n_surface.0) > 0.0;
            // Near a horizon rounding decides.
            if cosines.iter().any(|cos| cos.abs() < 1e-3) {
                continue;
            }
            let starts_in_front = (cosines[0] > 0.0) == alike;
            let is_stopped = starts_in_front != (cosines[1] > 0.0);
            // Rays that leave as the surface lies.
            let Ray { o, .. } = spawn_ray(
                surface.p,
                surface.p_err,
                surface.n_surface,
                toward_light,
                0.0,
            );
            let beyond = Ray {
                o,
                d: toward_light,
                time: 0.0,
            };
            let is_hidden = there.closest(&beyond, f32::INFINITY).is_some();
            // Beyond the box around its ends the surface is met by rays that come to the box alone.
            let just_before = Ray {
                o: surface.p - toward_light * 1e-3,
                ..beyond
            };
            if is_stopped && there.closest(&just_before, 2e-3).is_none() {
                continue;
            }
            let reflects = (surface.ng.dot(ray.d) < 0.0) == (cosines[0] > 0.0);
            let expected = if is_stopped || is_hidden || !reflects {
                0.0
            } else {
                3.0 * 0.5 / std::f64::consts::PI * f64::from(cosines[0].abs())
            };
            let (lit, stopped) = (expected > 0.0, is_stopped && reflects && !is_hidden);
            n_lit += u32::from(lit);
            n_stopped += u32::from(stopped);
            if !(stopped || lit && n_lit < 10) {
                continue;
            }
            for integrator in INTEGRATORS {
                assert_exact(
                    &scene(integrator),
                    [expected; 3],
                    &format!("{integrator}, {k}: {shape}"),
                );
            }
        }
    }
    assert!(n_lit > 50 && n_stopped > 5, "{n_lit} {n_stopped}");
}

#[test]
fn self_shadows_are_alike_from_both_ends() {
    let floor = "Shape \"disk\" \"float height\" -1.5 \"float radius\" 20\n";
    let sky = environment([0.5; 3]);
    let lamp = "LightSource \"point\" \"point from\" [2 -3 3] \"rgb I\" [20 20 20]\n";
    for shape in BENT {
        let world = format!("{sky}{lamp}Material \"matte\" \"rgb Kd\" [.7 .7 .7] {shape}\n{floor}");
        for eye in [[3.0, -5.0, 2.0], [-4.0, -4.0, 1.0], [1.0, 5.0, 3.0]] {
            let toward = eye.map(|x| -x);
            let means =
                |integrator| Probe::new(&seen_by(integrator, 3, eye, toward, &world)).means(60_000);
            let (ours, others) = (means("path"), means("bdpt"));
            for (a, b) in ours.iter().zip(&others) {
                a.agrees_with_mean(b)
                    .assert_accepted(&format!("{shape} from {eye:?}"));
            }
        }
    }
}
