//! Boundaries: invisible ones, glass ones, nested ones, and what passes through them.

use std::f64::consts::PI;

use crate::common::probe::{Probe, assert_exact, assert_mean};
use crate::common::solids::{
    V, box_shape, environment, homogeneous, null_box, null_sphere, seen_by, translate, volpath,
};
use crate::media::nebula::Nebula;

const ONE: V = [1.0; 3];
const NOTHING: V = [0.0; 3];
const EYE: V = [0.13, 0.21, -5.0];
const AHEAD: V = [0.0, 0.0, 1.0];

/// Two scenes have the same mean.
fn assert_same(a: &str, b: &str, n: u32, what: &str) {
    let (a, b) = (Probe::new(a).means(n), Probe::new(b).means(n));
    for (a, b) in a.iter().zip(&b) {
        a.agrees_with_mean(b).assert_accepted(what);
    }
}

#[test]
fn v19_coincident_boundaries_are_one_boundary() {
    let sigma = [0.5, 1.0, 2.0];
    for far in [0.0, 1e3, 1e6] {
        let sphere = null_sphere([far, 0.0, 0.0], 1.0, "fog", "");
        let world = homogeneous("fog", sigma, NOTHING, 0.0) + &environment(ONE) + &sphere + &sphere;
        // Through the centre the way is exactly 2, and does not change to first order beside it.
        let scene = volpath(5, [far, 0.0, -5.0], AHEAD, &world);
        assert_exact(
            &scene,
            sigma.map(|s: f64| (-2.0 * s).exp()),
            &format!("at {far}"),
        );
    }
}

#[test]
fn v19_boundaries_within_one_medium_change_nothing() {
    let fog = homogeneous("fog", [0.1, 0.2, 0.3], [2.0, 1.0, 0.5], 0.4)
        + &environment(ONE)
        + "LightSource \"point\" \"point from\" [2 3 -4] \"rgb I\" [9 9 9]\n"
        + &null_box([-1.0; 3], ONE, "fog", "");
    let nested = fog.clone()
        + &null_box([-0.8; 3], [0.8; 3], "fog", "fog")
        + &null_sphere([0.1, 0.0, 0.2], 0.7, "fog", "fog")
        + &null_sphere([0.1, 0.0, 0.2], 0.7, "fog", "fog")
        + &null_sphere([0.0; 3], 2.0, "", "");
    let (plain, nested) = (
        volpath(50, EYE, AHEAD, &fog),
        volpath(50, EYE, AHEAD, &nested),
    );
    assert_same(&plain, &nested, 100_000, "nested null surfaces");
}

#[test]
fn a_mirrored_boundary_and_a_reversed_one_keep_their_sides() {
    // A mirroring transform flips the normal, ReverseOrientation flips it back: inside stays inside. Either one alone
    // swaps the sides.
    let sigma = [0.5, 1.0, 2.0];
    let expected = sigma.map(|s: f64| (-2.0 * s).exp());
    let boundary = |change: &str, media: &str| {
        homogeneous("fog", sigma, NOTHING, 0.0)
            + &environment(ONE)
            + &format!(
                "AttributeBegin Material \"\" MediumInterface {media} {change}\n\
                 Shape \"sphere\" AttributeEnd\n"
            )
    };
    for (change, media) in [
        ("", "\"fog\" \"\""),
        ("Scale -1 1 1 ReverseOrientation", "\"fog\" \"\""),
        ("ReverseOrientation", "\"\" \"fog\""),
        ("Scale 1 1 -1", "\"\" \"fog\""),
    ] {
        let scene = volpath(5, [0.0, 0.0, -5.0], AHEAD, &boundary(change, media));
        assert_exact(&scene, expected, &format!("{change} {media}"));
    }
}

#[test]
fn a_glass_pane_full_of_dye_before_an_absorber_follows_the_airy_sums() {
    // A pane of index 1.5: reflectance R of one face, absorption a of one pass; all inner reflections summed.
    let (dye, fog) = ([0.1, 0.7, 2.0], [1.0, 0.3, 0.2]);
    let world = homogeneous("dye", dye, NOTHING, 0.0)
        + &homogeneous("fog", fog, NOTHING, 0.0)
        + &environment(ONE)
        + "AttributeBegin Material \"glass\" \"float eta\" 1.5 MediumInterface \"dye\" \"\"\n"
        + &box_shape([-9.0, -9.0, 0.0], [9.0, 9.0, 0.5])
        + "AttributeEnd\n"
        + &null_box([-9.0, -9.0, 1.0], [9.0, 9.0, 2.0], "fog", "");
    let r: f64 = 0.04;
    let expected = [0, 1, 2].map(|k| {
        let a = (-0.5 * dye[k]).exp();
        let through = (1.0 - r).powi(2) * a / (1.0 - r * r * a * a);
        let back = r + (1.0 - r).powi(2) * r * a * a / (1.0 - r * r * a * a);
        back + through * (-fog[k]).exp()
    });
    assert_mean(&volpath(200, EYE, AHEAD, &world), 200_000, expected, "pane");
}

#[test]
fn a_grid_on_its_plateau_is_a_homogeneous_medium() {
    // The cells' centres of the outer layer are 0.25 inside the grid's box: the boundary keeps to the plateau.
    let nebula = Nebula::uniform([8; 3], 1.5, [-2.0; 3], [2.0; 3]);
    let (sigma_a, sigma_s) = ([0.1, 0.2, 0.4], [0.3, 0.9, 1.6]);
    let scaled = |sigma: V| sigma.map(|s| 1.5 * s);
    let rest = environment(ONE) + &null_box([-1.7; 3], [1.7; 3], "fog", "");
    let grid = nebula.medium("fog", sigma_a, sigma_s, 0.5) + &rest;
    let even = homogeneous("fog", scaled(sigma_a), scaled(sigma_s), 0.5) + &rest;
    let scene = |world: &str| volpath(50, EYE, AHEAD, world);
    assert_same(&scene(&grid), &scene(&even), 50_000, "plateau");
}

#[test]
fn a_cloud_in_a_box_looks_as_it_does_among_other_media() {
    // Where it is the only medium, its walls are not asked for: not when they cut off some of its grid, nor if surfaces
    // are in the box, nor if the camera is. A grid beside the box is nowhere.
    let lamp = "LightSource \"point\" \"point from\" [2 3 -3] \"rgb I\" [9 9 9]\n";
    let ball =
        "AttributeBegin Translate 0.3 0.2 0.4 Shape \"sphere\" \"float radius\" 0.5 AttributeEnd\n";
    let glass =
        "AttributeBegin Material \"glass\" Translate 0 0 -2.5 Shape \"sphere\" AttributeEnd\n";
    let other =
        homogeneous("other", ONE, ONE, 0.0) + &null_sphere([50.0, 0.0, 0.0], 0.1, "other", "");
    let (cut, whole, beside) = (
        [[-1.3; 3], [1.2; 3]],
        [[-0.9; 3], [0.8; 3]],
        [[1.05, -1.0, -1.0], [3.0, 1.0, 1.0]],
    );
    let (outside, inside) = (EYE, [0.13, 0.21, -0.8]);
    let (short, all) = (
        &[("volpath", 2)][..],
        &[("volpath", 0), ("volpath", 2), ("volpath", 30), ("bdpt", 3)][..],
    );
    for (what, grid, rest, eye, medium, integrators) in [
        ("from outside", cut, "", outside, "", all),
        ("around a ball", cut, ball, outside, "", all),
        ("behind glass", cut, glass, outside, "", all),
        ("from inside", whole, "", inside, "cloud", all),
        (
            "around a ball, from inside",
            whole,
            ball,
            inside,
            "cloud",
            all,
        ),
        ("from inside, cut", cut, "", inside, "cloud", short),
        ("beside its box", beside, "", outside, "", short),
    ] {
        let nebula = Nebula::ragged([5, 4, 6], grid[0], grid[1]);
        let cloud = nebula.medium("cloud", [0.1, 0.2, 0.3], [1.5, 1.0, 2.0], 0.3);
        let world =
            environment([0.5, 1.0, 0.7]) + lamp + rest + &null_box([-1.0; 3], ONE, "cloud", "");
        for &(integrator, max_depth) in integrators {
            let scene = |more: &str| {
                // What is in force at the end is what the camera is in.
                let world = format!("{cloud}{world}{more}MediumInterface \"\" \"{medium}\"");
                seen_by(integrator, max_depth, eye, AHEAD, &world)
            };
            let what = format!("{what}: {integrator} to {max_depth}");
            assert_same(&scene(""), &scene(&other), 20_000, &what);
        }
    }
}

#[test]
fn textures_behind_a_cloud_in_a_box_look_as_they_do_among_other_media() {
    // A fine pattern that is one grey where footprints are known, and two where they are not.
    let cloud = Nebula::ragged([5, 4, 6], [-0.9; 3], [0.8; 3]);
    let cloud = cloud.medium("cloud", [0.01; 3], [0.01; 3], 0.3);
    let board = "Texture \"fine\" \"spectrum\" \"checkerboard\" \"float uscale\" 400 \"float vscale\" 400\n\
        AttributeBegin Material \"matte\" \"texture Kd\" \"fine\"\n\
        Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [-9 -9 3 9 -9 3 9 9 3 -9 9 3]\n\
        \"float uv\" [0 0 1 0 1 1 0 1] AttributeEnd\n";
    let world = environment(ONE) + board + &null_box([-1.0; 3], ONE, "cloud", "");
    let other =
        homogeneous("other", ONE, ONE, 0.0) + &null_sphere([50.0, 0.0, 0.0], 0.1, "other", "");
    let scene = |more: &str| seen_by("volpath", 1, EYE, AHEAD, &format!("{cloud}{world}{more}"));
    assert_same(&scene(""), &scene(&other), 20_000, "board");
}

/// A matte floor seen from below three slabs of different media, nested in each other.
struct Nest {
    slabs: String,
    sigma: [V; 3],
}

const FLOOR: &str = "AttributeBegin Material \"matte\" \"rgb Kd\" [.5 .5 .5] Shape \"disk\" \"float radius\" 50 AttributeEnd\n";
const FLOOR_EYE: V = [0.4, 0.3, 0.5];
const FLOOR_TOWARD: V = [-0.1, 0.05, -0.5];
/// Where the camera's ray meets the floor.
const RECEIVER: V = [0.3, 0.35, 0.0];

impl Nest {
    fn new() -> Self {
        let sigma = [[0.3, 0.1, 0.9], [0.5, 1.5, 0.2], [0.2, 0.6, 1.1]];
        let mut slabs = String::new();
        for (i, sigma) in sigma.iter().enumerate() {
            slabs += &homogeneous(&format!("m{i}"), *sigma, NOTHING, 0.0);
        }
        // m0 holds m1 and m2; heights 1.0, 0.4 and 0.2.
        let wide = |side: f64, z0: f64, z1: f64, inside: &str, outside: &str| {
            null_box([-side, -side, z0], [side, side, z1], inside, outside)
        };
        slabs += &wide(400.0, 1.0, 2.6, "m0", "");
        slabs += &wide(390.0, 1.2, 1.6, "m1", "m0");
        slabs += &wide(390.0, 1.9, 2.1, "m2", "m0");
        Self { slabs, sigma }
    }

    /// Transmittance along a direction whose cosine to the vertical is `cos`.
    fn transmittance(&self, cos: f64) -> V {
        let heights = [1.0, 0.4, 0.2];
        [0, 1, 2].map(|k| {
            let tau: f64 = (0..3).map(|i| self.sigma[i][k] * heights[i]).sum();
            (-tau / cos).exp()
        })
    }

    /// Radiance of the floor for pieces of light: (cosine at the floor, radiance times solid angle).
    fn radiance(&self, pieces: impl Iterator<Item = (f64, f64)>) -> V {
        let mut sum = [0.0; 3];
        for (cos, weight) in pieces {
            let tr = self.transmittance(cos);
            for k in 0..3 {
                sum[k] += 0.5 / PI * cos * weight * tr[k];
            }
        }
        sum
    }

    fn scene(&self, light: &str) -> String {
        let world = self.slabs.clone() + FLOOR + light;
        volpath(1, FLOOR_EYE, FLOOR_TOWARD, &world)
    }
}

fn grid(n: usize) -> impl Iterator<Item = (f64, f64)> {
    let mid = move |i: usize| (i as f64 + 0.5) / n as f64;
    (0..n * n).map(move |i| (mid(i % n), mid(i / n)))
}

#[test]
fn delta_lights_pass_nested_boundaries_by_the_product_of_transmittances() {
    let nest = Nest::new();
    let [x, y, _] = RECEIVER;
    let point = format!(
        "LightSource \"point\" \"point from\" [{} {y} 4] \"rgb I\" [7 7 7]\n",
        x + 3.0
    );
    let expected = nest.radiance([(0.8, 7.0 / 25.0)].into_iter());
    assert_exact(&nest.scene(&point), expected, "point");
    let distant = "LightSource \"distant\" \"point from\" [0.6 0 0.8] \"point to\" [0 0 0] \"rgb L\" [3 3 3]\n";
    let expected = nest.radiance([(0.8, 3.0)].into_iter());
    assert_exact(&nest.scene(distant), expected, "distant");
}

#[test]
fn a_sky_passes_nested_boundaries_by_the_product_of_transmittances() {
    let nest = Nest::new();
    const N: usize = 1000;
    let pieces = (0..N).map(|i| ((i as f64 + 0.5) / N as f64, 2.0 * PI / N as f64));
    let expected = nest.radiance(pieces);
    assert_mean(&nest.scene(&environment(ONE)), 100_000, expected, "sky");
}

#[test]
fn area_lights_pass_nested_boundaries_by_the_product_of_transmittances() {
    let nest = Nest::new();
    let [x, y, _] = RECEIVER;
    // A disk of radius 1.5 at height 4, seen through all slabs, off to a side by 1.
    let flat = |points: Box<dyn Iterator<Item = (f64, f64)>>, area: f64| {
        let pieces: Vec<_> = points
            .map(|(px, py)| {
                let d2: f64 = px * px + py * py + 16.0;
                let cos = 4.0 / d2.sqrt();
                (cos, cos / d2)
            })
            .collect();
        let each = area / pieces.len() as f64;
        nest.radiance(pieces.into_iter().map(|(cos, w)| (cos, w * each)))
    };
    let on_disk = grid(200).map(|(u, v)| {
        let (sin, cos) = (2.0 * PI * u).sin_cos();
        (1.0 + 1.5 * v.sqrt() * cos, 1.5 * v.sqrt() * sin)
    });
    let lamp = |shape: &str| {
        format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n\
             Translate {} {y} 4 {shape}\nAttributeEnd\n",
            x + 1.0
        )
    };
    let disk = lamp("Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 1.5");
    let expected = flat(Box::new(on_disk), 2.25 * PI);
    assert_mean(&nest.scene(&disk), 100_000, expected, "disk");
    let square = lamp(
        "Shape \"trianglemesh\" \"point P\" [-1 -1 0  -1 1 0  1 1 0  1 -1 0] \"integer indices\" [0 1 2 0 2 3]",
    );
    let on_square = grid(200).map(|(u, v)| (2.0 * u, 2.0 * v - 1.0));
    let expected = flat(Box::new(on_square), 4.0);
    assert_mean(&nest.scene(&square), 100_000, expected, "two triangles");
    // A sphere of radius 1 with its centre straight above at height 4.
    let ball = format!(
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n\
         Translate {x} {y} 4 Shape \"sphere\" AttributeEnd\n"
    );
    const N: usize = 1000;
    let cos_max = (1.0 - 1.0 / 16.0f64).sqrt();
    let solid_angle = 2.0 * PI * (1.0 - cos_max);
    let cap = (0..N).map(|i| {
        let v = (i as f64 + 0.5) / N as f64;
        (1.0 - v * (1.0 - cos_max), solid_angle / N as f64)
    });
    assert_mean(&nest.scene(&ball), 100_000, nest.radiance(cap), "sphere");
}

#[test]
fn a_boundary_thousands_of_times_larger_than_a_light_does_not_hide_its_limb() {
    let [x, y, _] = RECEIVER;
    let world = FLOOR.to_owned()
        + &null_box([-4000.0, -4000.0, 0.6], [4000.0, 4000.0, 0.7], "", "")
        + &format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1]\n\
             Translate {x} {y} 2 Shape \"sphere\" AttributeEnd\n"
        );
    // Irradiance of a sphere overhead: pi sin^2 of its half angle.
    let expected = 0.5 * 0.25;
    let scene = volpath(1, FLOOR_EYE, FLOOR_TOWARD, &world);
    assert_mean(&scene, 100_000, [expected; 3], "sphere");
}

#[test]
fn grids_in_the_way_of_light_sampling_dim_by_their_column() {
    let nebula = Nebula::ragged([3, 4, 5], [-1.0, -1.0, 1.0], [1.5, 1.5, 2.5]);
    let sigma = [0.4, 1.0, 2.0];
    let [x, y, _] = RECEIVER;
    // Next to nothing is scattered, so that the grid is tracked and not integrated.
    let world = nebula.medium("fog", sigma, [1e-7; 3], 0.0)
        + &null_box([-1.1, -1.1, 0.9], [1.6, 1.6, 2.6], "fog", "")
        + FLOOR
        + &format!(
            "LightSource \"point\" \"point from\" [{} {y} 4] \"rgb I\" [7 7 7]\n",
            x + 0.5
        );
    let column = nebula.column(RECEIVER, [0.5, 0.0, 4.0]);
    let d2: f64 = 16.25;
    let expected = sigma.map(|s| 0.5 / PI * 7.0 / d2 * 4.0 / d2.sqrt() * (-s * column).exp());
    let scene = volpath(1, FLOOR_EYE, FLOOR_TOWARD, &world);
    assert_mean(&scene, 200_000, expected, "grid");
}

#[test]
fn quirk_57_path_ignores_media_and_lets_null_surfaces_block_light_sampling() {
    let fog = homogeneous("fog", [5.0; 3], NOTHING, 0.0);
    let shell = null_box([-60.0, -60.0, 1.0], [60.0, 60.0, 2.0], "fog", "");
    let closed = null_sphere([0.0; 3], 100.0, "", "fog");
    let [x, y, _] = RECEIVER;
    let lamp = format!("LightSource \"point\" \"point from\" [{x} {y} 4] \"rgb I\" [16 16 16]\n");
    let at_floor =
        |integrator: &str, world: &str| seen_by(integrator, 5, FLOOR_EYE, FLOOR_TOWARD, world);
    let lit = fog.clone() + FLOOR + &lamp;
    assert_exact(&at_floor("path", &lit), [0.5 / PI; 3], "nothing in the way");
    let behind = lit.clone() + &shell;
    assert_exact(
        &at_floor("path", &behind),
        [0.0; 3],
        "a null surface in the way",
    );
    let expected = 0.5 / PI * (-5f64).exp();
    assert_exact(
        &at_floor("volpath", &behind),
        [expected; 3],
        "fog in the way",
    );
    let sky = fog.clone() + FLOOR + &environment(ONE) + &closed;
    assert_exact(
        &at_floor("path", &sky),
        [0.0; 3],
        "a null surface before the sky",
    );
    // The camera itself, and a mirror, see through null surfaces, and see no fog.
    let mirror = "AttributeBegin Material \"mirror\" \"rgb Kr\" [1 1 1] Shape \"disk\" \"float radius\" 50 AttributeEnd\n";
    let through = fog + mirror + &environment(ONE) + &shell;
    let above = seen_by("path", 3, [0.2, 0.3, 5.0], [0.1, 0.05, -1.0], &through);
    assert_exact(&above, ONE, "a mirror behind a null surface");
}

#[test]
fn v14_null_crossings_are_no_bounces() {
    // Ten boundaries on the way to the floor, as many on the way to the light.
    let [x, y, _] = RECEIVER;
    let mut shells = String::new();
    for i in 0..5 {
        let (z, h) = (0.1 + 0.08 * f64::from(i), 0.04);
        shells += &null_box([-90.0, -90.0, z], [90.0, 90.0, z + h], "", "");
        shells += &null_box([-90.0, -90.0, z + 1.0], [90.0, 90.0, z + 1.0 + h], "", "");
    }
    let lamp = format!("LightSource \"point\" \"point from\" [{x} {y} 4] \"rgb I\" [16 16 16]\n");
    let world = shells.clone() + FLOOR + &lamp;
    let scene = volpath(1, FLOOR_EYE, FLOOR_TOWARD, &world);
    assert_exact(&scene, [0.5 / PI; 3], "point");
    // The second half of light sampling, too, sees through them at the last bounce: a sky is wholly there.
    let world = shells + FLOOR + &environment(ONE);
    let scene = volpath(1, FLOOR_EYE, FLOOR_TOWARD, &world);
    assert_mean(&scene, 20_000, [0.5; 3], "sky");
}

#[test]
fn maxdepth_counts_collisions_and_surfaces_alike() {
    // A conservative cube in a uniform sky: with d bounces the missing energy is that of paths with more.
    let cube = |depth: u32| {
        let world = homogeneous("fog", NOTHING, ONE, 0.0)
            + &environment(ONE)
            + &null_box([-1.0; 3], ONE, "fog", "");
        Probe::new(&volpath(depth, EYE, AHEAD, &world)).means(40_000)[0]
    };
    let unscattered = (-2f64).exp();
    let one = cube(1).value;
    let two = cube(2).value;
    assert!(unscattered < one && one < two && two < 1.0, "{one} {two}");
    // Depth 0 ends at the first boundary: emitters in view only.
    assert_eq!(cube(0).value, 0.0);
    // A lamp behind two mirrors that face each other is two bounces away.
    let mirrors = |depth: u32| {
        let world = "AttributeBegin Material \"mirror\" \"rgb Kr\" [1 1 1]\n".to_owned()
            + &translate([0.0, 0.0, 1.0])
            + "Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 0.9\n\
               Rotate 180 1 0 0 Translate 1 0 -4 Shape \"disk\" \"float radius\" 0.9\nAttributeEnd\n"
            + &environment(ONE);
        let toward = [1.0, 0.0, 4.0];
        Probe::new(&volpath(depth, [-1.0, 0.0, -3.0], toward, &world)).means(2)[0].value
    };
    assert_eq!([0, 1, 2, 3].map(mirrors), [0.0, 0.0, 1.0, 1.0]);
}
