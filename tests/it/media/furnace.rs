//! A medium that absorbs nothing changes nothing in a uniform light.

use crate::common::probe::assert_mean;
use crate::common::solids::{
    V, environment, homogeneous, null_box, null_sphere, translate, volpath,
};
use crate::media::nebula::Nebula;

const ONE: V = [1.0; 3];
const NOTHING: V = [0.0; 3];
const EYE: V = [0.13, 0.21, -5.0];
const AHEAD: V = [0.0, 0.0, 1.0];
/// Depth that no path reaches.
const UNLIMITED: u32 = 1_000_000;

fn furnace(medium: &str, n: u32, what: &str) {
    let world = medium.to_owned() + &environment(ONE) + &null_box([-1.0; 3], ONE, "fog", "");
    assert_mean(&volpath(UNLIMITED, EYE, AHEAD, &world), n, ONE, what);
}

#[test]
fn homogeneous_media_conserve_energy_for_every_lobe() {
    for g in [0.0, 0.9, -0.9, 1e-4, 0.99999, -0.9999999, 1.0, -1.0] {
        for sigma in [1.0, 10.0] {
            let fog = homogeneous("fog", NOTHING, [sigma; 3], g);
            furnace(&fog, 4000, &format!("g = {g}, sigma = {sigma}"));
        }
    }
}

#[test]
fn coloured_homogeneous_media_conserve_energy() {
    for sigma in [[1.0, 0.5, 0.1], [0.0, 1.0, 10.0], [10.0, 5.0, 1.0]] {
        for g in [0.0, 0.9, -0.9] {
            let fog = homogeneous("fog", NOTHING, sigma, g);
            furnace(&fog, 20_000, &format!("g = {g}, sigma = {sigma:?}"));
        }
    }
}

#[test]
fn grids_conserve_energy_for_every_lobe() {
    let nebula = Nebula::ragged([4, 5, 3], [-0.9; 3], [0.8; 3]);
    for g in [0.0, 0.9, -0.9] {
        for sigma in [1.0, 10.0] {
            let fog = nebula.medium("fog", NOTHING, [sigma; 3], g);
            furnace(&fog, 4000, &format!("g = {g}, sigma = {sigma}"));
        }
    }
}

#[test]
fn v09_coloured_grids_conserve_energy() {
    let nebula = Nebula::ragged([4, 5, 3], [-0.9; 3], [0.8; 3]);
    for sigma in [[1.0, 0.5, 0.1], [0.0, 1.0, 10.0], [5.0, 3.0, 1.0]] {
        for g in [0.0, 0.9] {
            let fog = nebula.medium("fog", NOTHING, sigma, g);
            furnace(&fog, 20_000, &format!("g = {g}, sigma = {sigma:?}"));
        }
    }
}

#[test]
fn v13_thick_spheres_conserve_energy() {
    for (sigma, n) in [(1.0, 4000), (10.0, 4000), (100.0, 2000), (1000.0, 300)] {
        let world = homogeneous("fog", NOTHING, [sigma; 3], 0.0)
            + &environment(ONE)
            + &null_sphere([0.0; 3], 1.0, "fog", "");
        let scene = volpath(UNLIMITED, EYE, AHEAD, &world);
        assert_mean(&scene, n, ONE, &format!("sigma = {sigma}"));
    }
}

#[test]
fn v01_no_walk_leaks_through_a_boundary_far_from_the_origin() {
    for far in [0.0, 3e3, 3e4, 1e5, 1e6] {
        let world = homogeneous("fog", NOTHING, ONE, 0.0)
            + &environment(ONE)
            + &translate([far, 0.0, 0.0])
            + &null_box([-0.5; 3], [0.5; 3], "fog", "");
        let eye = [far + 0.13, 0.21, -5.0];
        let scene = volpath(UNLIMITED, eye, AHEAD, &world);
        assert_mean(&scene, 4000, ONE, &format!("at {far}"));
    }
}

#[test]
fn nested_media_and_a_mirror_inside_conserve_energy() {
    let world = homogeneous("fog", NOTHING, [1.0, 2.0, 3.0], 0.6)
        + &homogeneous("mist", NOTHING, [4.0, 1.0, 0.5], -0.3)
        + &environment(ONE)
        + &null_box([-1.0; 3], ONE, "fog", "")
        + &null_sphere([0.1, 0.0, 0.0], 0.7, "mist", "fog")
        + "AttributeBegin Material \"mirror\" \"rgb Kr\" [1 1 1] MediumInterface \"\" \"mist\"\n\
           Shape \"sphere\" \"float radius\" 0.4 AttributeEnd\n";
    let scene = volpath(UNLIMITED, EYE, AHEAD, &world);
    assert_mean(&scene, 20_000, ONE, "mirror in mist in fog");
}
