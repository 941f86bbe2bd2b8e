//! Asymmetric lamps against quadrature of the model: S w + H (1 − w) of what an ordinary one gives, where S and H are 1 if
//! light sampling and rays see the lamp in pbrt-v3, and w is the MIS weight of light sampling.

use std::f64::consts::{PI, TAU};

use tyndall::compile::CompileOptions;
use tyndall::ids::LightId;
use tyndall::light::{Light, Wanted};
use tyndall::math::{Normal3, Point3, Vec3};
use tyndall::spectrum::copper;
use tyndall::world::Receiver;

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::scene::compile_scene;
use crate::common::seen::{V, environment, seen_by};

/// What a lamp gives a point that scatters evenly.
#[derive(Clone, Copy)]
struct Shares {
    all: f64,
    /// By points that are drawn on it: S w.
    drawn: f64,
    /// By rays that find it: H (1 − w).
    found: f64,
}

const KD: f64 = 0.5;
const LE: f64 = 10.0;

/// w for a direction drawn with densities `light` and `lobe`.
fn share(light: f64, lobe: f64) -> f64 {
    1.0 / (1.0 + (lobe / light).powi(2))
}

/// A square of side 2 above a point of the floor at distance 1, of two triangles that are lamps of area 2 each.
fn of_panel() -> Shares {
    let n = 1000;
    let middle = |i: usize| (2.0 * (i as f64 + 0.5) / n as f64) - 1.0;
    let (mut all, mut drawn) = (0.0, 0.0);
    for i in 0..n {
        for j in 0..n {
            let squared = 1.0 + middle(i).powi(2) + middle(j).powi(2);
            let cos = 1.0 / squared.sqrt();
            let value = LE * KD / PI * cos * cos / squared * (4.0 / (n * n) as f64);
            all += value;
            drawn += value * share(squared / (cos * 2.0), cos / PI);
        }
    }
    let found = all - drawn;
    Shares { all, drawn, found }
}

/// A sphere of radius `r`, its centre above a point of the floor at distance 1.
fn of_sphere(r: f64) -> Shares {
    let cos_max = (1.0 - r * r).sqrt();
    let light = 1.0 / (TAU * (1.0 - cos_max));
    let n = 100_000;
    let step = (1.0 - cos_max) / f64::from(n);
    let (mut all, mut drawn) = (0.0, 0.0);
    for i in 0..n {
        let cos = cos_max + (f64::from(i) + 0.5) * step;
        let value = LE * KD / PI * cos * TAU * step;
        all += value;
        drawn += value * share(light, cos / PI);
    }
    let found = all - drawn;
    Shares { all, drawn, found }
}

const FLOOR: &str = "AttributeBegin Material \"matte\" \"rgb Kd\" [.5 .5 .5] Shape \"disk\" \"float radius\" 40 AttributeEnd\n";

fn lamp(before: &str, shape: &str) -> String {
    format!(
        "AttributeBegin Material \"matte\" \"rgb Kd\" [0 0 0] AreaLightSource \"diffuse\" \"rgb L\" [10 10 10] {before}\n\
         {shape} AttributeEnd\n"
    )
}

/// The panel; by its winding it shines up, or down to the floor.
fn panel(winds_down: bool, more: &str) -> String {
    let indices = if winds_down {
        "0 2 1 0 3 2"
    } else {
        "0 1 2 0 2 3"
    };
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [{indices}] \"point P\" [-1 -1 1  1 -1 1  1 1 1  -1 1 1] \
         \"float uv\" [0 0 1 0 1 1 0 1] {more}"
    )
}

const DOWN: &str = "\"normal N\" [0 0 -1 0 0 -1 0 0 -1 0 0 -1]";
const UP: &str = "\"normal N\" [0 0 1 0 0 1 0 0 1 0 0 1]";
const ALONG: &str = "\"vector S\" [1 0 0 1 0 0 1 0 0 1 0 0]";
const REVERSED: &str = "ReverseOrientation";
const MIRRORED: &str = "Scale -1 1 1";

/// A scene for an integrator, which may be followed by its strategy.
fn seen_with(integrator: &str, eye: V, toward: V, world: &str) -> String {
    let (name, strategy) = integrator.split_once(' ').unwrap_or((integrator, "all"));
    let scene = seen_by(name, 1, eye, toward, world);
    if name == "directlighting" {
        let with = format!("Integrator \"{name}\" \"string strategy\" \"{strategy}\"");
        scene.replacen(&format!("Integrator \"{name}\""), &with, 1)
    } else {
        scene
    }
}

/// The light on the floor below the middle of a lamp, as it is seen from one side.
#[track_caller]
fn assert_floor(integrator: &str, world: &str, expected: f64, what: &str) {
    let world = format!("{FLOOR}{world}");
    let scene = seen_with(integrator, [0.3, 0.0, 0.3], [-0.3, 0.0, -0.3], &world);
    let what = format!("{integrator}: {what}");
    if expected == 0.0 {
        assert_exact(&scene, [0.0; 3], &what);
    } else {
        assert_mean(&scene, 20_000, [expected; 3], &what);
    }
}

const WEIGHED: [&str; 7] = [
    "path",
    "volpath",
    "directlighting all",
    "directlighting one",
    "bdpt",
    "mlt",
    "sppm",
];

/// Lamps above the floor: those that only light it, by what is drawn, and those that only show there.
fn panels() -> Vec<(&'static str, String, bool)> {
    vec![
        ("alpha 0", lamp("", &panel(true, "\"float alpha\" 0")), true),
        (
            "normals down, reversed",
            lamp(REVERSED, &panel(true, DOWN)),
            true,
        ),
        (
            "normals up, reversed",
            lamp(REVERSED, &panel(false, UP)),
            false,
        ),
        (
            "normals down, reversed and mirrored",
            lamp(&format!("{MIRRORED} {REVERSED}"), &panel(true, DOWN)),
            true,
        ),
        (
            "tangents, reversed",
            lamp(REVERSED, &panel(false, ALONG)),
            true,
        ),
        (
            "tangents, reversed, wound down",
            lamp(REVERSED, &panel(true, ALONG)),
            false,
        ),
        (
            "tangents, reversed and mirrored",
            lamp(&format!("{MIRRORED} {REVERSED}"), &panel(false, ALONG)),
            true,
        ),
    ]
}

#[test]
fn asymmetric_panels_light_the_floor() {
    let shares = of_panel();
    // Measured in pbrt-v3's pictures as well.
    assert!((shares.all - 2.7706).abs() < 1e-3, "{}", shares.all);
    assert!((shares.drawn - 2.4449).abs() < 1e-3, "{}", shares.drawn);
    assert!((shares.found - 0.3258).abs() < 1e-3, "{}", shares.found);
    for (what, world, lights) in panels() {
        let expected = if lights { shares.drawn } else { shares.found };
        for integrator in WEIGHED {
            assert_floor(integrator, &world, expected, what);
        }
        // That draws points alone.
        assert_floor(
            "whitted",
            &world,
            if lights { shares.all } else { 0.0 },
            what,
        );
    }
}

#[test]
fn mirrored_quadrics_light_the_floor() {
    let shares = of_sphere(0.5);
    assert!((shares.drawn - 1.1756).abs() < 1e-3, "{}", shares.drawn);
    let at = "Translate 0 0 1 Scale 1 1 -1";
    let sphere = |more: &str| {
        lamp(
            &format!("{at} {more}"),
            "Shape \"sphere\" \"float radius\" 0.5",
        )
    };
    for integrator in WEIGHED {
        assert_floor(integrator, &sphere(""), shares.drawn, "sphere");
        assert_floor(
            integrator,
            &sphere(REVERSED),
            shares.found,
            "reversed sphere",
        );
    }
    assert_floor("whitted", &sphere(""), shares.all, "sphere");
    assert_floor("whitted", &sphere(REVERSED), 0.0, "reversed sphere");
}

#[test]
fn other_lights_beside_asymmetric_lamps_stay() {
    let world = lamp("", &panel(true, "\"float alpha\" 0")) + &environment([2.0; 3]);
    let expected = of_panel().drawn + 2.0 * KD;
    for integrator in WEIGHED {
        assert_floor(integrator, &world, expected, "under a sky");
    }
}

/// Of a disk of radius 1 above the floor at distance 1.
fn of_disk() -> Shares {
    let n = 100_000;
    let (mut all, mut drawn) = (0.0, 0.0);
    for i in 0..n {
        let r2 = (f64::from(i) + 0.5) / f64::from(n);
        let cos = 1.0 / (1.0 + r2).sqrt();
        let value = LE * KD / PI * cos.powi(4) * PI / f64::from(n);
        all += value;
        drawn += value * share((1.0 + r2) / (cos * PI), cos / PI);
    }
    let found = all - drawn;
    Shares { all, drawn, found }
}

#[test]
fn mirrored_disks_light_the_floor() {
    let shares = of_disk();
    let disk = |more: &str| lamp(&format!("Translate 0 0 1 {more}"), "Shape \"disk\"");
    for integrator in ["path", "directlighting one", "bdpt", "mlt"] {
        // Their normals are drawn below, and found above.
        let down = disk("Rotate 180 1 0 0 Scale -1 1 1");
        assert_floor(integrator, &down, shares.drawn, "drawn below");
        assert_floor(integrator, &disk(MIRRORED), shares.found, "found below");
    }
}

#[test]
fn what_a_mask_cuts_out_lights_as_it_is_drawn() {
    // Left of the middle there is a hole.
    let mask = "Texture \"mask\" \"float\" \"checkerboard\" \"float uscale\" 2 \"float vscale\" 1 \
                \"string aamode\" \"none\" \"float tex1\" 0 \"float tex2\" 1\n";
    let shares = of_panel();
    let half = mask.to_owned() + &lamp("", &panel(true, "\"texture alpha\" \"mask\""));
    let expected = (shares.drawn + shares.all) / 2.0;
    let reversed = mask.to_owned()
        + &lamp(
            REVERSED,
            &panel(false, &format!("{UP} \"texture alpha\" \"mask\"")),
        );
    for integrator in ["path", "volpath", "directlighting all", "bdpt", "mlt"] {
        assert_floor(integrator, &half, expected, "half a panel");
        assert_floor(
            integrator,
            &reversed,
            shares.found / 2.0,
            "half a reversed panel",
        );
    }
}

#[test]
fn two_sided_lamps_that_are_turned_are_ordinary() {
    let turned = lamp(REVERSED, &panel(true, DOWN)).replace(
        "\"rgb L\" [10 10 10]",
        "\"rgb L\" [10 10 10] \"bool twosided\" \"true\"",
    );
    let compiled = compile_scene(
        seen_by("path", 1, [0.0; 3], [0.0, 0.0, 1.0], &turned),
        &CompileOptions::default(),
        |_| None,
    );
    assert!(!compiled.job.world.facts().has_asymmetric_lamps);
    for integrator in ["path", "bdpt", "whitted"] {
        assert_floor(integrator, &turned, of_panel().all, "two-sided");
    }
    // But for their holes.
    let cut = turned.replace(DOWN, "\"float alpha\" 0");
    assert_floor("path", &cut, of_panel().drawn, "two-sided, alpha 0");
}

#[test]
fn lamps_in_instances_light_as_they_show() {
    let placed = |lamp: &str| {
        // Another light, below the floor: without any, there would be something to tell.
        let other = "LightSource \"point\" \"point from\" [0 0 -5]\n";
        format!("{other}ObjectBegin \"lamp\" {lamp} ObjectEnd ObjectInstance \"lamp\"\n")
    };
    for integrator in ["path", "bdpt"] {
        let shown = placed(&lamp(REVERSED, &panel(false, UP)));
        assert_floor(integrator, &shown, of_panel().all, "it shows");
        let hidden = placed(&lamp(REVERSED, &panel(true, DOWN)));
        assert_floor(integrator, &hidden, 0.0, "it does not");
        let cut = placed(&lamp("", &panel(true, "\"float alpha\" 0")));
        assert_floor(integrator, &cut, 0.0, "it is nowhere");
    }
}

#[test]
fn cameras_and_mirrors_see_what_rays_find() {
    let mirror = FLOOR.replace(
        "\"matte\" \"rgb Kd\" [.5 .5 .5]",
        "\"mirror\" \"rgb Kr\" [1 1 1]",
    );
    for (what, world, lights) in panels() {
        let expected = if lights { 0.0 } else { LE };
        for integrator in [
            "path",
            "volpath",
            "directlighting",
            "whitted",
            "bdpt",
            "mlt",
            "sppm",
        ] {
            let direct = seen_by(integrator, 3, [0.1, 0.2, 0.3], [0.0, 0.0, 1.0], &world);
            assert_exact(
                &direct,
                [expected; 3],
                &format!("{integrator}, seen: {what}"),
            );
            let world = format!("{mirror}{world}");
            let mirrored = seen_by(integrator, 3, [0.1, 0.2, 0.3], [0.01, 0.0, -1.0], &world);
            assert_exact(
                &mirrored,
                [expected; 3],
                &format!("{integrator}, mirrored: {what}"),
            );
        }
    }
}

/// What pbrt-v3's `path` shows of the floor where it mirrors a panel of alpha 0 toward the camera, measured to 0.1 to 0.2 %.
const MEASURED: [(&str, f64); 10] = [
    ("\"metal\" \"float roughness\" .1", 2.7745),
    ("\"metal\" \"float roughness\" .02", 2.6372),
    ("\"metal\" \"float roughness\" .005", 1.7197),
    (
        "\"plastic\" \"rgb Kd\" [.3 .3 .3] \"rgb Ks\" [.5 .5 .5] \"float roughness\" .1",
        1.571,
    ),
    (
        "\"translucent\" \"rgb Kd\" [.5 .5 .5] \"rgb Ks\" [.3 .3 .3] \"float roughness\" .15",
        1.3741,
    ),
    (
        "\"substrate\" \"rgb Kd\" [.4 .4 .4] \"rgb Ks\" [.3 .3 .3]",
        2.6031,
    ),
    (
        "\"disney\" \"rgb color\" [.5 .5 .5] \"float sheen\" .5 \"float clearcoat\" 1 \"float spectrans\" .3 \
         \"float roughness\" .3",
        1.9088,
    ),
    (
        "\"uber\" \"rgb Kd\" [.3 .3 .3] \"rgb Ks\" [.3 .3 .3] \"rgb Kr\" [.2 .2 .2] \"float roughness\" .1",
        1.5316,
    ),
    (
        "\"glass\" \"float uroughness\" .2 \"float vroughness\" .2 \"bool remaproughness\" \"false\"",
        0.2227,
    ),
    ("\"matte\" \"rgb Kd\" [.5 .5 .5]", 2.4473),
];

#[test]
fn lobes_share_an_invisible_panel_as_pbrt_shows_it() {
    for (material, expected) in MEASURED {
        let floor = format!(
            "AttributeBegin Material {material} Shape \"disk\" \"float radius\" 40 AttributeEnd\n"
        );
        let world = floor + &lamp("", &panel(true, "\"float alpha\" 0"));
        for integrator in ["path", "bdpt"] {
            let scene = seen_by(integrator, 1, [0.3, 0.0, 0.9], [-0.3, 0.0, -0.9], &world);
            let means = Probe::new(&scene).means(20_000);
            let mean = means.iter().map(|mean| mean.value).sum::<f64>() / 3.0;
            let error = 4.0 * means[0].standard_error + 0.003 * expected;
            assert!(
                (mean - expected).abs() < error,
                "{integrator}, {material}: {mean} is not {expected} to {error}"
            );
        }
    }
}

/// Reflectance of a conductor of index of refraction `eta` + i `k` for unpolarized light (pbrt, 3rd ed., section 8.2.1).
fn conductor(cos: f64, eta: f64, k: f64) -> f64 {
    let (cos2, sin2) = (cos * cos, 1.0 - cos * cos);
    let difference = eta * eta - k * k - sin2;
    let a2_plus_b2 = (difference * difference + 4.0 * eta * eta * k * k).sqrt();
    let a = ((a2_plus_b2 + difference) / 2.0).sqrt();
    let across = (a2_plus_b2 + cos2 - 2.0 * cos * a) / (a2_plus_b2 + cos2 + 2.0 * cos * a);
    let (sum, product) = (cos2 * a2_plus_b2 + sin2 * sin2, 2.0 * a * cos * sin2);
    let along = across * (sum - product) / (sum + product);
    (across + along) / 2.0
}

/// What copper of roughness `alpha`, seen at 45°, shows of a panel of two triangles of area 2 that lies in the mirrored
/// direction at height 2, if only points that are drawn on it shine; in each channel.
fn drawn_on_copper(alpha: f64) -> [f64; 3] {
    let (cos_o, height, n) = (0.5f64.sqrt(), 2.0, 800);
    let tan2 = |cos: f64| 1.0 / (cos * cos) - 1.0;
    let lambda = |cos: f64| ((1.0 + alpha * alpha * tan2(cos)).sqrt() - 1.0) / 2.0;
    let [eta, k] = [copper::eta(), copper::k()].map(|rgb| rgb.to_array().map(f64::from));
    // Most of the places are near the middle, where the lobe is narrow.
    let knot = |i: usize| (6.0 * (2.0 * i as f64 / n as f64 - 1.0)).sinh() / 6.0f64.sinh();
    let middle = |i: usize| (knot(i) + knot(i + 1)) / 2.0;
    let side = |i: usize| knot(i + 1) - knot(i);
    let mut sums = [0.0; 3];
    for i in 0..n {
        for j in 0..n {
            let (x, y) = (middle(i) - height, middle(j));
            let d2 = x * x + y * y + height * height;
            let d = d2.sqrt();
            let (x, y, cos_i) = (x / d, y / d, height / d);
            let (hx, hy, hz) = (x + cos_o, y, cos_i + cos_o);
            let length = (hx * hx + hy * hy + hz * hz).sqrt();
            let (cos_h, cos_facet) = (hz / length, (hx * x + hy * y + hz * cos_i) / length);
            let spread = 1.0 + tan2(cos_h) / (alpha * alpha);
            let facets = 1.0 / (PI * alpha * alpha * cos_h.powi(4) * spread * spread);
            let shown = facets / (1.0 + lambda(cos_i) + lambda(cos_o)) / (4.0 * cos_i * cos_o);
            let lobe = facets / (1.0 + lambda(cos_o)) / (4.0 * cos_o);
            let weight = share(d2 / (cos_i * 2.0), lobe);
            let arriving = LE * weight * cos_i * cos_i / d2 * side(i) * side(j);
            for channel in 0..3 {
                let reflectance = conductor(cos_facet, eta[channel], k[channel]);
                sums[channel] += shown * arriving * reflectance;
            }
        }
    }
    sums
}

#[test]
fn metal_mirrors_an_invisible_panel_as_far_as_drawn() {
    let panel = panel(true, "\"float alpha\" 0");
    let lamp = lamp("Translate -2 0 1", &panel);
    for (roughness, red) in [(0.1, 4.37), (0.02, 1.36), (0.005, 0.37)] {
        let expected = drawn_on_copper(roughness);
        assert!((expected[0] - red).abs() < 0.005, "{expected:?}");
        let floor = format!(
            "AttributeBegin Material \"metal\" \"float roughness\" {roughness} \
             \"bool remaproughness\" \"false\" Shape \"disk\" \"float radius\" 40 AttributeEnd\n"
        );
        for integrator in WEIGHED {
            let world = floor.clone() + &lamp;
            let scene = seen_with(integrator, [0.7, 0.0, 0.7], [-0.7, 0.0, -0.7], &world);
            assert_mean(
                &scene,
                20_000,
                expected,
                &format!("{integrator}, roughness {roughness}"),
            );
        }
    }
}

#[test]
fn power_counts_both_sides_of_a_turned_lamp() {
    // Beside the same panel, which is ordinary: mirroring alone turns no mesh.
    let lamps = [REVERSED, MIRRORED].map(|before| lamp(before, &panel(true, DOWN)));
    let text = seen_by(
        "path\" \"string lightsamplestrategy\" \"power",
        1,
        [0.0; 3] as V,
        [0.0, 0.0, 1.0],
        &format!("{FLOOR}{}", lamps.concat()),
    );
    let compiled = compile_scene(text, &CompileOptions::default(), |_| None);
    let world = compiled.job.world;
    let at = Receiver {
        p: Point3::ZERO,
        p_err: Vec3::ZERO,
        ng: Normal3::new(0.0, 0.0, 1.0),
        wanted: Wanted::All,
        time: 0.0,
    };
    let mut of_turned = 0.0;
    for id in (0..world.n_lights()).map(LightId::new) {
        if matches!(world.light(id), Light::Area(area) if area.lights_both_sides()) {
            of_turned += world.light_pmf(&at, id);
        }
    }
    assert!((of_turned - 2.0 / 3.0).abs() < 1e-5, "{of_turned}");
}
