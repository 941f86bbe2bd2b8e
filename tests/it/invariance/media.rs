//! One medium written in two ways.

use proptest::prelude::*;
use proptest::test_runner::TestCaseError;

use crate::common::solids::{V, environment, homogeneous, null_box, volpath};
use crate::invariance::compared::{assert_same_mean, for_all};

/// Coefficients, asymmetry, and densities of a grid of 4 × 2 × 2.
type Cloud = ([u8; 3], [u8; 3], i8, Vec<u8>);

fn cloud() -> impl Strategy<Value = Cloud> {
    let colour = || [0u8..=16, 0u8..=16, 0u8..=16];
    (
        colour(),
        colour(),
        -7i8..=7,
        proptest::collection::vec(0u8..=8, 16),
    )
}

fn sigma(c: [u8; 3]) -> V {
    c.map(|c| f64::from(c) / 8.0)
}

/// Lit by a sky and a lamp, seen from the front.
fn scene(world: &str) -> String {
    let lights = environment([0.5, 0.4, 0.3])
        + "LightSource \"point\" \"point from\" [1 5 -3] \"rgb I\" [20 20 20]\n";
    "Film \"image\" \"integer xresolution\" 12 \"integer yresolution\" 8\nPixelFilter \"box\"\n\
     Sampler \"halton\" \"integer pixelsamples\" 32\n"
        .to_owned()
        + &volpath(5, [0.3, 0.4, -3.5], [-0.3, -0.4, 3.5], &(lights + world))
}

/// A grid over the box from x0 to x1, −1 to 1 along y and z.
fn grid(name: &str, cloud: &Cloud, [x0, x1]: [f64; 2], density: &[u8]) -> String {
    let (sigma_a, sigma_s, g, _) = cloud;
    let nx = density.len() / 4;
    let density: Vec<f64> = density.iter().map(|d| f64::from(*d) / 4.0).collect();
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"heterogeneous\" \"float g\" {} \
         \"rgb sigma_a\" {:?} \"rgb sigma_s\" {:?} \"integer nx\" {nx} \"integer ny\" 2 \"integer nz\" 2 \
         \"point p0\" [{x0} -1 -1] \"point p1\" [{x1} 1 1] \"float density\" {density:?}\n",
        f64::from(*g) / 8.0,
        sigma(*sigma_a),
        sigma(*sigma_s),
    )
    .replace(',', "")
}

/// Columns of a grid of 4 × 2 × 2.
fn columns(density: &[u8], range: std::ops::Range<usize>) -> Vec<u8> {
    density
        .chunks(4)
        .flat_map(|row| row[range.clone()].to_vec())
        .collect()
}

/// The box from −2 to 2 along x and −1 to 1 along y and z, cut at x = 0 by a wall between "left" and "right".
fn halves() -> String {
    let corners = "-2 -1 -1  0 -1 -1  2 -1 -1  -2 1 -1  0 1 -1  2 1 -1  -2 -1 1  0 -1 1  2 -1 1  -2 1 1  0 1 1  2 1 1";
    let mesh = |media: &str, faces: &str| {
        format!(
            "AttributeBegin Material \"\" MediumInterface {media} Shape \"trianglemesh\" \
             \"point P\" [{corners}] \"integer indices\" [{faces}] AttributeEnd\n"
        )
    };
    // Two triangles for each face, counter-clockwise seen from outside.
    let quad = |[a, b, c, d]: [u8; 4]| format!("{a} {b} {c}  {a} {c} {d}  ");
    let sides = |a: u8, b: u8| {
        quad([a, a + 3, b + 3, b])
            + &quad([a + 6, b + 6, b + 9, a + 9])
            + &quad([a, b, b + 6, a + 6])
            + &quad([a + 3, a + 9, b + 9, b + 3])
    };
    mesh("\"left\" \"\"", &(sides(0, 1) + &quad([0, 6, 9, 3])))
        + &mesh("\"right\" \"\"", &(sides(1, 2) + &quad([2, 5, 11, 8])))
        // Its normal points along +x, where the right half lies.
        + &mesh("\"left\" \"right\"", &quad([1, 4, 10, 7]))
}

fn splitting(cloud: Cloud) -> Result<(), TestCaseError> {
    let density = &cloud.3;
    let whole = grid("fog", &cloud, [-2.0, 2.0], density)
        + &null_box([-2.0, -1.0, -1.0], [2.0, 1.0, 1.0], "fog", "");
    // Each half reaches a column beyond the cut, whose values interpolation needs up to it.
    let halved = grid("left", &cloud, [-2.0, 1.0], &columns(density, 0..3))
        + &grid("right", &cloud, [-1.0, 2.0], &columns(density, 1..4))
        + &halves();
    assert_same_mean(&scene(&whole), &scene(&halved), "halves")
}

#[test]
fn a_grid_in_two_halves_is_the_grid() {
    for_all(30, false, cloud(), splitting);
}

#[test]
#[ignore = "long"]
fn many_grids_in_two_halves_are_the_grids() {
    for_all(30, true, cloud(), splitting);
}

fn levelling((mut cloud, level): (Cloud, u8)) -> Result<(), TestCaseError> {
    // On the plateau of an even grid: the outer half cells, where it fades, lie outside the boundary.
    cloud.3 = vec![level; 16];
    let density = f64::from(level) / 4.0;
    let [sigma_a, sigma_s] = [cloud.0, cloud.1].map(|c| sigma(c).map(|s| s * density));
    let boundary = null_box([-1.4, -0.45, -0.45], [1.4, 0.45, 0.45], "fog", "");
    let even = homogeneous("fog", sigma_a, sigma_s, f64::from(cloud.2) / 8.0) + &boundary;
    let gridded = grid("fog", &cloud, [-2.0, 2.0], &cloud.3.clone()) + &boundary;
    assert_same_mean(&scene(&even), &scene(&gridded), "an even grid")
}

#[test]
fn an_even_grid_is_a_homogeneous_medium() {
    for_all(30, false, (cloud(), 1u8..=8), levelling);
}

#[test]
#[ignore = "long"]
fn many_even_grids_are_homogeneous_media() {
    for_all(30, true, (cloud(), 1u8..=8), levelling);
}

#[test]
fn the_comparison_rejects_a_medium_of_a_third_more() {
    let fog = |sigma: f64| {
        let world = homogeneous("fog", [0.5 * sigma; 3], [0.5 * sigma; 3], 0.0)
            + &null_box([-2.0, -1.0, -1.0], [2.0, 1.0, 1.0], "fog", "");
        scene(&world)
    };
    assert!(assert_same_mean(&fog(1.0), &fog(1.33), "planted").is_err());
}
