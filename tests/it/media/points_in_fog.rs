//! Point lights in fog, next to what is looked at: closed forms, and how the error falls.

use std::f64::consts::PI;

use tyndall_test_support::z_test::Mean;

use crate::common::probe::{Probe, assert_mean};
use crate::common::solids::{V, homogeneous, null_box, volpath};
use crate::media::single_scattering::henyey_greenstein;
use crate::media::vectors::{along, cross, dot, span_in_box, unit};

/// Homogeneous fog.
#[derive(Clone, Copy)]
struct Fog {
    sigma_a: V,
    sigma_s: V,
    g: f64,
}

impl Fog {
    /// Adds light that is scattered once on a way through the fog.
    fn add(&self, sum: &mut V, light: f64, way: f64) {
        for (k, sum) in sum.iter_mut().enumerate() {
            let sigma_t = self.sigma_a[k] + self.sigma_s[k];
            *sum += self.sigma_s[k] * light * (-sigma_t * way).exp();
        }
    }
}

const GREY: Fog = Fog {
    sigma_a: [0.1; 3],
    sigma_s: [0.3; 3],
    g: 0.0,
};
const COLOURED: Fog = Fog {
    sigma_a: [0.3, 0.1, 0.0],
    sigma_s: [1.9, 0.4, 0.02],
    g: 0.5,
};
const THIN: Fog = Fog {
    sigma_a: [0.01; 3],
    sigma_s: [0.02; 3],
    g: 0.0,
};
/// Only one channel scatters, and another lets everything pass.
const ONE_CHANNEL: Fog = Fog {
    sigma_a: [0.0, 0.0, 0.7],
    sigma_s: [0.0, 0.5, 0.0],
    g: -0.4,
};

/// A point of light and its intensity.
type Lamp = (V, f64);

fn lamp_text(&([x, y, z], i): &Lamp) -> String {
    format!("LightSource \"point\" \"point from\" [{x} {y} {z}] \"rgb I\" [{i} {i} {i}]\n")
}

/// Light of lamps scattered once toward `eye` on the part [t0, t1] of a ray, by midpoints of the angle under which each
/// lamp sees it.
fn scattered_once(fog: Fog, eye: V, toward: V, [t0, t1]: [f64; 2], lamps: &[Lamp]) -> V {
    const STEPS: usize = 400;
    let d = unit(toward);
    let mut sum = [0.0; 3];
    for &(p, intensity) in lamps {
        let to_lamp = along(p, eye, -1.0);
        let foot = dot(to_lamp, d);
        let aside = cross(to_lamp, d);
        let distance = dot(aside, aside).sqrt();
        let angle = |t: f64| ((t - foot) / distance).atan();
        let (a, b) = (angle(t0), angle(t1));
        for i in 0..STEPS {
            let theta = a + (b - a) * (i as f64 + 0.5) / STEPS as f64;
            let t = foot + distance * theta.tan();
            let r = distance / theta.cos();
            let cos = (foot - t) / r;
            // dt / r² is dθ / D.
            let arrives =
                intensity * henyey_greenstein(fog.g, cos) * (b - a) / (STEPS as f64 * distance);
            fog.add(&mut sum, arrives, t - t0 + r);
        }
    }
    sum
}

const EYE: V = [0.13, 0.21, -2.0];
const TOWARD: V = [0.02, -0.03, 1.0];

/// The world: fog everywhere, and lamps.
fn endless(fog: Fog, lamps: &[Lamp]) -> String {
    let lamps: String = lamps.iter().map(lamp_text).collect();
    homogeneous("fog", fog.sigma_a, fog.sigma_s, fog.g)
        + "MediumInterface \"fog\" \"fog\"\n"
        + &lamps
}

/// A scene seen from within the fog.
fn within(depth: u32, eye: V, toward: V, world: &str) -> String {
    let scene = volpath(depth, eye, toward, world);
    // The medium of the camera is the outside medium where it stands.
    scene.replacen("Camera ", "MediumInterface \"\" \"fog\" Camera ", 1)
}

/// A place `aside` from the ray, `t` along it.
fn beside(t: f64, aside: f64) -> V {
    let d = unit(TOWARD);
    let across = unit(cross(d, [1.0, 0.3, 0.0]));
    along(along(EYE, d, t), across, aside)
}

#[test]
fn light_of_a_point_next_to_the_ray_is_scattered_as_the_integral_says() {
    for (what, fog) in [
        ("grey", GREY),
        ("coloured", COLOURED),
        ("thin", THIN),
        ("one channel", ONE_CHANNEL),
    ] {
        for (t, aside) in [(1.0, 0.01), (2.0, 0.3), (-0.2, 0.1), (3.0, 4.0)] {
            let lamps = [(beside(t, aside), 2.0)];
            let expected = scattered_once(fog, EYE, TOWARD, [0.0, 1e4], &lamps);
            let scene = within(1, EYE, TOWARD, &endless(fog, &lamps));
            let what = format!("{what} fog, a lamp at {t}, {aside} aside");
            assert_mean(&scene, 30_000, expected, &what);
        }
    }
}

/// Lamps of which some are chosen by neither technique as they should be, in a box.
#[test]
fn light_of_many_points_of_different_power_adds_up() {
    let lamps: Vec<Lamp> = [
        (0.6, 0.02, 1.0),
        (1.1, 0.2, 50.0),
        (1.5, 0.05, 1e-3),
        (2.4, 3.0, 900.0),
    ]
    .map(|(t, aside, intensity)| (beside(t, aside), intensity))
    .into();
    let (lo, hi) = ([-1.0, -1.2, -1.7], [0.9, 1.1, 0.4]);
    let [t0, t1] = span_in_box(EYE, unit(TOWARD), lo, hi);
    for (what, fog) in [("grey", GREY), ("coloured", COLOURED)] {
        // Beyond the box light does not get weaker: all but the last lamp are inside.
        let mut expected = scattered_once(fog, EYE, TOWARD, [t0, t1], &lamps[..3]);
        for x in (0..4000).map(|i| (t1 - t0) * (f64::from(i) + 0.5) / 4000.0) {
            let p = along(EYE, unit(TOWARD), t0 + x);
            let to_lamp = along(lamps[3].0, p, -1.0);
            let squared = dot(to_lamp, to_lamp);
            let wi = unit(to_lamp);
            let [_, inside] = span_in_box(p, wi, lo, hi);
            let way = x + inside.min(squared.sqrt());
            let scattered = henyey_greenstein(fog.g, dot(unit(TOWARD), wi)) * lamps[3].1 / squared
                * (t1 - t0)
                / 4000.0;
            fog.add(&mut expected, scattered, way);
        }
        let world = homogeneous("fog", fog.sigma_a, fog.sigma_s, fog.g)
            + &null_box(lo, hi, "fog", "")
            + &lamps.iter().map(lamp_text).collect::<String>();
        let scene = volpath(1, EYE, TOWARD, &world);
        assert_mean(
            &scene,
            100_000,
            expected,
            &format!("four lamps, {what} fog"),
        );
    }
}

/// Side of the square of film around a lamp, relative to the distance from the eye.
const WINDOW: f64 = 0.002;

/// Mean of what is scattered once over a square of film with a lamp in its middle, `away` from the eye.
fn around_lamp(fog: Fog, away: f64, intensity: f64) -> f64 {
    const N: usize = 48;
    let lamp = [([0.0, 0.0, away], intensity)];
    let mut sum = 0.0;
    // The square in slices of even angle around the lamp, and each by its distance from it, where light is even.
    for i in 0..N {
        let phi = (i as f64 + 0.5) / N as f64 * 2.0 * PI;
        let (sin, cos) = phi.sin_cos();
        let rim = 0.5 * WINDOW / sin.abs().max(cos.abs());
        for j in 0..N {
            let s = (j as f64 + 0.5) / N as f64 * rim;
            let toward = [s * cos, s * sin, 1.0];
            let seen = scattered_once(fog, [0.0; 3], toward, [0.0, 1e4], &lamp)[0];
            sum += seen * s * rim;
        }
    }
    sum * 2.0 * PI / (N * N) as f64 / (WINDOW * WINDOW)
}

/// Slope of the logarithm of the mean relative error over that of the number of samples, 4² to 4⁷. The mean of absolute
/// errors: squares of the errors of one long run fall as they should whatever its variance.
fn slope(scene: &str, expected: f64) -> f64 {
    const BATCHES: u32 = 64;
    let probe = Probe::new(scene);
    // Film is as wide as twice the distance: the field of view is 90 degrees.
    let side = (0.5 * WINDOW) as f32;
    let mut first = 0;
    let points: Vec<(f64, f64)> = (2..=7)
        .map(|k| {
            let n = 4usize.pow(k);
            let batches = if k < 6 { 4 * BATCHES } else { BATCHES };
            let error = Mean::of(batches as usize, || {
                let samples = probe.samples_within(side, first, n as u32);
                first += n as u32;
                let mean = samples.iter().map(|s| f64::from(s[0])).sum::<f64>() / n as f64;
                (mean / expected - 1.0).abs()
            });
            ((n as f64).ln(), error.value.ln())
        })
        .collect();
    let n = points.len() as f64;
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2))
}

#[test]
fn v18_the_error_next_to_a_point_light_falls_with_the_root_of_the_samples() {
    for (what, fog) in [("thin", THIN), ("grey", GREY)] {
        let expected = around_lamp(fog, 2.0, 3.0);
        let world = endless(fog, &[([0.0, 0.0, 2.0], 3.0)]);
        let slope_of = |world: &str| {
            let scene = within(1, [0.0; 3], [0.0, 0.0, 1.0], world);
            slope(&scene, expected)
        };
        let found = slope_of(&world);
        assert!((found + 0.5).abs() < 0.1, "{what} fog: slope {found}");
        // A lamp with the least of extents has its distances drawn by extinction alone: it shows that the measure sees
        // what is wrong with them.
        let (radius, away) = (1e-5, 2.0);
        let radiance = 3.0 / (PI * radius * radius);
        let speck = format!(
            "AreaLightSource \"diffuse\" \"rgb L\" [{radiance} {radiance} {radiance}]\n\
             Translate 0 0 {away} Shape \"sphere\" \"float radius\" {radius}\n"
        );
        let by_extinction = slope_of(&(endless(fog, &[]) + &speck));
        assert!(
            by_extinction > -0.4,
            "{what} fog, a speck: slope {by_extinction}"
        );
    }
}

/// Paths that scatter often come by the lamp on any of their segments.
#[test]
fn v18_the_error_falls_where_light_scatters_often() {
    let fog = Fog {
        sigma_a: [0.05; 3],
        sigma_s: [1.0; 3],
        g: 0.0,
    };
    let world = endless(fog, &[([0.0, 0.0, 2.0], 3.0)]);
    let scene = within(4, [0.0; 3], [0.0, 0.0, 1.0], &world);
    let samples = Probe::new(&scene).samples_within((0.5 * WINDOW) as f32, 1 << 30, 1 << 21);
    let expected = samples.iter().map(|s| f64::from(s[0])).sum::<f64>() / samples.len() as f64;
    let found = slope(&scene, expected);
    assert!((found + 0.5).abs() < 0.1, "slope {found}");
}
