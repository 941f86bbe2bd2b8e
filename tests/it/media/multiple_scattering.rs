//! Any number of collisions, against a walk that knows no light sampling and no weights.

use std::f64::consts::{PI, TAU};

use tyndall_test_support::Uniform;
use tyndall_test_support::z_test::Mean;

use crate::common::probe::Probe;
use crate::common::solids::{V, environment, homogeneous, null_box, volpath};
use crate::media::nebula::Nebula;
use crate::media::vectors::{along, dot, span_in_box, tangents, unit};

const EYE: V = [0.13, 0.21, -5.0];
const TOWARD: V = [0.02, -0.03, 1.0];

/// One channel of a cube of fog, lit by a disk that faces it from below.
struct Cube {
    sigma_t: f64,
    albedo: f64,
    g: f64,
}

const LO: V = [-1.0, -1.0, -1.0];
const HI: V = [0.9, 1.1, 1.0];
/// The lamp's height, centre and radius.
const LAMP: (f64, [f64; 2], f64) = (-2.0, [0.5, 0.0], 1.5);

impl Cube {
    /// Follows one path from the camera until it leaves the cube or is absorbed; what it then sees.
    fn walk(&self, random: &mut Uniform) -> f64 {
        let (mut o, mut d) = (EYE, unit(TOWARD));
        let [t0, _] = span_in_box(o, d, LO, HI);
        o = along(o, d, t0);
        loop {
            let [_, t1] = span_in_box(o, d, LO, HI);
            let t = -f64::from(1.0 - random.unit()).ln() / self.sigma_t;
            if t >= t1 {
                return if sees_lamp(o, d) { 1.0 } else { 0.0 };
            }
            if f64::from(random.unit()) >= self.albedo {
                return 0.0;
            }
            o = along(o, d, t);
            d = self.scatter(d, random);
        }
    }

    /// Henyey and Greenstein's own inversion for the cosine of the deflection.
    fn scatter(&self, d: V, random: &mut Uniform) -> V {
        let (u, g) = (f64::from(random.unit()), self.g);
        let cos = if g == 0.0 {
            1.0 - 2.0 * u
        } else {
            let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * u);
            (1.0 + g * g - s * s) / (2.0 * g)
        };
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * f64::from(random.unit())).sin_cos();
        let [s, t] = tangents(d);
        along(
            along(d.map(|x| x * cos), s, sin * cos_phi),
            t,
            sin * sin_phi,
        )
    }
}

fn sees_lamp(o: V, d: V) -> bool {
    let (height, [cx, cz], radius) = LAMP;
    let t = (height - o[1]) / d[1];
    let p = along(o, d, t);
    d[1] < 0.0 && t > 0.0 && (p[0] - cx).hypot(p[2] - cz) < radius
}

fn lamp() -> String {
    let (height, [cx, cz], radius) = LAMP;
    format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n\
         Translate {cx} {height} {cz} Rotate -90 1 0 0 Shape \"disk\" \"float radius\" {radius}\nAttributeEnd\n"
    )
}

#[test]
fn agrees_with_analog_walks() {
    let (sigma_a, sigma_s) = ([0.4, 0.0, 1.0], [1.6, 1.0, 3.0]);
    for g in [0.0, 0.7, -0.5] {
        let world =
            homogeneous("fog", sigma_a, sigma_s, g) + &null_box(LO, HI, "fog", "") + &lamp();
        let means = Probe::new(&volpath(1000, EYE, TOWARD, &world)).means(100_000);
        for k in 0..3 {
            let sigma_t = sigma_a[k] + sigma_s[k];
            let cube = Cube {
                sigma_t,
                albedo: sigma_s[k] / sigma_t,
                g,
            };
            let mut random = Uniform::new(k as u64);
            let walks = Mean::of(400_000, || cube.walk(&mut random));
            let what = format!("g = {g}, channel {k}");
            means[k].agrees_with_mean(&walks).assert_accepted(&what);
        }
    }
}

/// The means of a scene in a coloured medium are those of the three grey media of its channels.
fn assert_channels_are_grey_media(medium: impl Fn(V, V) -> String, what: &str) {
    let (sigma_a, sigma_s) = ([0.0, 0.5, 0.1], [8.0, 1.0, 0.2]);
    let scene = |sigma_a: V, sigma_s: V| {
        let world = medium(sigma_a, sigma_s)
            + &null_box(LO, HI, "fog", "")
            + &lamp()
            + &environment([0.1; 3])
            + "LightSource \"point\" \"point from\" [-3 2 -2] \"rgb I\" [5 5 5]\n";
        volpath(1000, EYE, TOWARD, &world)
    };
    let coloured = Probe::new(&scene(sigma_a, sigma_s)).means(100_000);
    for k in 0..3 {
        let grey = Probe::new(&scene([sigma_a[k]; 3], [sigma_s[k]; 3])).means(50_000);
        let what = format!("{what}, channel {k}");
        coloured[k]
            .agrees_with_mean(&grey[k])
            .assert_accepted(&what);
    }
}

#[test]
fn each_channel_of_a_coloured_medium_is_a_grey_medium() {
    assert_channels_are_grey_media(|a, s| homogeneous("fog", a, s, 0.5), "homogeneous");
    let nebula = Nebula::ragged([5, 4, 3], LO, HI);
    assert_channels_are_grey_media(|a, s| nebula.medium("fog", a, s, 0.5), "grid");
}

#[test]
fn v15_a_lamp_found_by_chance_through_glass_lights_fog_as_the_walk_says() {
    // A glass shell of index 1 is invisible but keeps light sampling out: only the continuation finds the lamp.
    let (sigma_a, sigma_s) = ([0.4, 0.0, 1.0], [1.6, 1.0, 3.0]);
    let (height, [cx, cz], _) = LAMP;
    let world = homogeneous("fog", sigma_a, sigma_s, 0.3) + &null_box(LO, HI, "fog", "") + &lamp();
    let pane = format!(
        "AttributeBegin Material \"glass\" \"float eta\" 1 Translate {cx} {} {cz} Rotate -90 1 0 0\n\
         Shape \"disk\" \"float radius\" 40 AttributeEnd\n",
        height + 0.3
    );
    let open = Probe::new(&volpath(1000, EYE, TOWARD, &world)).means(100_000);
    let behind = Probe::new(&volpath(1000, EYE, TOWARD, &(world + &pane))).means(400_000);
    for (open, behind) in open.iter().zip(&behind) {
        behind
            .agrees_with_mean(open)
            .assert_accepted("behind glass");
    }
}

#[test]
fn a_small_sphere_and_a_point_of_its_power_light_fog_alike() {
    // Light sampling alone against both strategies. Seen from 3 away the sphere's size matters by less than 1e-4.
    let fog =
        homogeneous("fog", [0.2, 0.4, 0.6], [1.5, 1.0, 0.5], 0.4) + &null_box(LO, HI, "fog", "");
    let radius = 0.02;
    let intensity = 9.0;
    let radiance = intensity / (PI * radius * radius);
    let point = format!(
        "LightSource \"point\" \"point from\" [-3 2 -2] \"rgb I\" [{intensity} {intensity} {intensity}]\n"
    );
    let sphere = format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{radiance} {radiance} {radiance}]\n\
         Translate -3 2 -2 Shape \"sphere\" \"float radius\" {radius} AttributeEnd\n"
    );
    let means =
        |light: &str| Probe::new(&volpath(100, EYE, TOWARD, &(fog.clone() + light))).means(100_000);
    assert!(dot(LO, LO) < 9.0);
    for (point, sphere) in means(&point).iter().zip(&means(&sphere)) {
        point
            .agrees_with_mean(sphere)
            .assert_accepted("point and sphere");
    }
}
