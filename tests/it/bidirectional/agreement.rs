//! The same expectation as path tracing.

use glam::{DAffine3, DVec3};
use tyndall::camera::{Camera, Perspective, Projection, ThinLens};
use tyndall::integrator::{Bdpt, Integrator};
use tyndall::math::{Motion, Transform};

use crate::bidirectional::setup::{CAMERA, LIGHTS, ROOM, compare, job};

const BDPT: &str = "\"bdpt\" \"integer maxdepth\" 4";
const PATH: &str = "\"path\" \"integer maxdepth\" 4";
const VOLPATH: &str = "\"volpath\" \"integer maxdepth\" 4";

#[track_caller]
fn assert_agree(reference: &str, camera: &str, world: &str, what: &str) {
    compare(
        job(BDPT, camera, 16, world),
        job(reference, camera, 32, world),
    )
    .assert_accepted(what);
}

/// The fog of the room, with a small cloud on a grid.
fn fog(light: &str) -> String {
    format!(
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"float g\" .4 \
         \"rgb sigma_a\" [.05 .1 .02] \"rgb sigma_s\" [.3 .2 .4]\n\
         MakeNamedMedium \"cloud\" \"string type\" \"heterogeneous\" \"rgb sigma_a\" [.5 .5 .5] \
         \"rgb sigma_s\" [4 4 4] \"integer nx\" 2 \"integer ny\" 2 \"integer nz\" 2 \
         \"point p0\" [-.6 .2 -1.2] \"point p1\" [.6 1.2 -.4] \"float density\" [1 .5 .5 2 .25 4 1 1]\n\
         AttributeBegin Material \"\" MediumInterface \"cloud\" \"fog\" Translate 0 .7 -.8\n\
         Shape \"sphere\" \"float radius\" .6 AttributeEnd\n\
         MediumInterface \"\" \"fog\"\n\
         AttributeBegin MediumInterface \"fog\" \"\" Material \"\" Translate 0 1 0\n\
         Shape \"sphere\" \"float radius\" 8 AttributeEnd\n\
         MediumInterface \"fog\" \"fog\"\n{ROOM}{light}"
    )
}

#[test]
fn bdpt_is_path_tracing_under_lights_of_every_kind() {
    for (name, light) in LIGHTS {
        let reference = if *name == "invisible" { VOLPATH } else { PATH };
        assert_agree(reference, CAMERA, &format!("{ROOM}{light}"), name);
    }
}

/// Lamps that light sampling and rays see differently.
const ASYMMETRIC_LAMPS: &[(&str, &str)] = &[
    (
        "alpha 0",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]\n\
         Shape \"trianglemesh\" \"point P\" [-1 1.5 -1  0 2 -1  0 1.5 .5] \"integer indices\" [0 1 2] \"float alpha\" 0\n\
         AttributeEnd\n",
    ),
    (
        "partly cut out, reversed normals",
        "Texture \"mask\" \"float\" \"checkerboard\" \"float uscale\" 3 \"float vscale\" 3 \"float tex1\" 0 \"float tex2\" 1\n\
         AttributeBegin ReverseOrientation AreaLightSource \"diffuse\" \"rgb L\" [9 8 7]\n\
         Shape \"trianglemesh\" \"point P\" [-1 1.5 -1  0 2 -1  0 1.5 .5] \"integer indices\" [0 1 2]\n\
         \"normal N\" [0 -1 0 0 -1 0 0 -1 0] \"texture alpha\" \"mask\" AttributeEnd\n",
    ),
    (
        "mirrored sphere",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4] Translate .3 1.8 -.3 Scale -1 1 1\n\
         Shape \"sphere\" \"float radius\" .3 AttributeEnd\n",
    ),
    (
        "mirrored part of a sphere",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4] Translate .3 1.6 -.3 Rotate 80 1 0 0 Scale -1 1 1\n\
         Shape \"sphere\" \"float radius\" .5 \"float zmax\" .3 AttributeEnd\n",
    ),
    (
        "mirrored, reversed cylinder",
        "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [6 5 4] Translate .3 1.6 -.3 Scale -1 1 1 ReverseOrientation\n\
         Shape \"cylinder\" \"float radius\" .4 \"float zmin\" -.4 \"float zmax\" .4 AttributeEnd\n",
    ),
];

/// A ball of rough glass before the others, which sends light of lamps on to both sides.
const ROUGH_BALL: &str = "AttributeBegin Material \"glass\" \"float uroughness\" .3 \"float vroughness\" .3\n\
     Translate 0 .4 -1 Shape \"sphere\" \"float radius\" .35 AttributeEnd\n";

#[test]
fn asymmetric_lamps_agree_from_both_ends() {
    for (name, lamp) in ASYMMETRIC_LAMPS {
        assert_agree(PATH, CAMERA, &format!("{ROOM}{ROUGH_BALL}{lamp}"), name);
    }
}

#[test]
fn asymmetric_lamps_in_fog_agree() {
    for (name, lamp) in ASYMMETRIC_LAMPS {
        assert_agree(VOLPATH, CAMERA, &fog(lamp), name);
    }
}

#[test]
fn the_comparison_sees_a_strategy_that_is_missing() {
    // Two scattering events less are as if the longest paths, some percent of the light, had been forgotten.
    let world = format!("{ROOM}{}", LIGHTS[5].1);
    let mut lacking = job(BDPT, CAMERA, 16, &world);
    if let Integrator::Bdpt(Bdpt { max_depth, .. }) = &mut lacking.integrator {
        *max_depth -= 2;
    }
    let verdict = compare(lacking, job(PATH, CAMERA, 32, &world));
    assert!(!verdict.accepted(), "{}", verdict.explanation);
}

#[test]
fn bdpt_is_path_tracing_behind_glass() {
    let ball = "AttributeBegin Material \"glass\" Translate 0 .8 -1 Shape \"sphere\" \"float radius\" .5\n\
                Translate .9 -.4 0 Material \"mirror\" Shape \"sphere\" \"float radius\" .3\n\
                Translate -1.8 0 0 Material \"glass\" \"float uroughness\" .3 \"float vroughness\" .3\n\
                Shape \"sphere\" \"float radius\" .35 AttributeEnd\n";
    for (name, light) in LIGHTS {
        if matches!(*name, "infinite" | "sphere" | "panel") {
            assert_agree(PATH, CAMERA, &format!("{ROOM}{ball}{light}"), name);
        }
    }
}

#[test]
fn l09_bumps_and_vertex_normals_look_the_same_from_both_ends() {
    let world = "\
        Texture \"slope\" \"float\" \"bilerp\" \"float v00\" 0 \"float v01\" 0 \"float v10\" 2 \"float v11\" 2\n\
        AttributeBegin Material \"matte\" \"rgb Kd\" [.7 .7 .7] \"texture bumpmap\" \"slope\"\n\
        Shape \"trianglemesh\" \"point P\" [-3 0 -3  -3 0 3  3 0 3  3 0 -3] \"float uv\" [0 0 0 1 1 1 1 0] \
        \"integer indices\" [0 1 2 0 2 3] AttributeEnd\n\
        AttributeBegin Material \"matte\" \"rgb Kd\" [.6 .6 .8]\n\
        Shape \"trianglemesh\" \"point P\" [-2 0 1  0 2.5 1.5  2 0 1  0 0 -1] \
        \"normal N\" [-.8 -.3 -.5  0 .3 -1  .8 -.3 -.5  0 .2 -1] \"integer indices\" [0 1 3 3 1 2] AttributeEnd\n";
    for (name, light) in LIGHTS {
        if matches!(*name, "point" | "sphere" | "infinite") {
            assert_agree(PATH, CAMERA, &format!("{world}{light}"), name);
        }
    }
}

#[test]
fn l11_a_finite_lens_sees_the_same_from_both_ends() {
    let camera = "LookAt 0 1 -4  0 .6 0  0 1 0 \
                  Camera \"perspective\" \"float fov\" 50 \"float lensradius\" .3 \"float focaldistance\" 4";
    let edge = "AttributeBegin Material \"matte\" \"rgb Kd\" [.05 .05 .05]\n\
                Shape \"trianglemesh\" \"point P\" [-3 -1 -2  -3 3 -2  -.3 3 -2  -.3 -1 -2] \
                \"integer indices\" [0 1 2 0 2 3] AttributeEnd\n";
    let world = format!("{ROOM}{edge}{}", LIGHTS[0].1);
    assert_agree(PATH, camera, &world, "bright beyond an edge");
}

/// Flat and round curves turn toward the ray that meets them. Nothing is near: rays leave a curve two widths away from it,
/// and what they pass depends on where they start.
#[test]
fn curves_of_every_style_look_the_same_from_both_ends() {
    for (style, normal) in [
        ("flat", ""),
        ("cylinder", ""),
        ("ribbon", "\"normal N\" [.4 .2 -1  -.3 .1 -1]"),
    ] {
        let curve = format!(
            "Material \"matte\" \"rgb Kd\" [.8 .6 .5]\n\
             Shape \"curve\" \"string type\" \"{style}\" {normal} \"float width\" .8 \
             \"point3 P\" [-.6 -.4 0  0 .3 0  .3 .6 0  .2 1.6 0]\n"
        );
        for (name, light) in LIGHTS {
            if matches!(*name, "point" | "distant" | "infinite") {
                assert_agree(
                    PATH,
                    CAMERA,
                    &format!("{light}{curve}"),
                    &format!("{style}, {name}"),
                );
            }
        }
    }
}

#[test]
fn placements_that_stretch_space_see_the_same_from_both_ends() {
    let world = format!("{ROOM}{}", LIGHTS[0].1);
    let stretched = |integrator: &str, spp: u32| {
        let mut job = job(integrator, CAMERA, spp, &world);
        let window = [-1.0, 1.0, -1.0, 1.0];
        let pinhole = ThinLens {
            radius: 0.0,
            focal_distance: 1e6,
        };
        let perspective = Perspective::new(1.0, window, [12, 12], pinhole);
        // At the place of the camera of the scene, which is the origin of render space; wider than high.
        let placed = Transform::from_affine(DAffine3::from_scale(DVec3::new(2.0, 1.0, 0.5)));
        job.camera = Camera::new(
            Projection::Perspective(perspective),
            Motion::Still(placed.expect("it has an inverse")),
            [0.0, 1.0],
        );
        job
    };
    let verdict = compare(stretched(BDPT, 16), stretched(PATH, 32));
    verdict.assert_accepted("stretched");
}

#[test]
fn cameras_without_importance_and_all_round_ones_show_the_same() {
    let world = format!("{ROOM}{}", LIGHTS[9].1);
    for camera in [
        "LookAt 0 1 -4  0 .6 0  0 1 0 Camera \"orthographic\"",
        "LookAt 0 1 -1.5  0 .6 0  0 1 0 Camera \"environment\"",
    ] {
        assert_agree(PATH, camera, &world, camera);
    }
}

#[test]
fn light_that_comes_to_the_film_counts_once_at_its_border() {
    // Samples beside the frame count in its outer pixels, light that comes there does not.
    let camera = "PixelFilter \"box\" \"float xwidth\" 1.5 \"float ywidth\" 1.5\n\
                  LookAt 0 0 0  0 0 1  0 1 0 Camera \"perspective\" \"float fov\" 40";
    // Falling off evenly, so that light is nearly the same wherever it comes in a pixel's reach.
    let wall = "LightSource \"spot\" \"rgb I\" [50 50 50] \"point from\" [0 0 -1] \"point to\" [0 0 4] \
                \"float coneangle\" 40 \"float conedeltaangle\" 40 Material \"matte\" \"rgb Kd\" [.5 .5 .5]\n\
                Translate 0 0 4 Shape \"disk\" \"float radius\" 20";
    compare(job(BDPT, camera, 256, wall), job(PATH, camera, 256, wall))
        .assert_accepted("a wall through a wide filter");
}

/// A light that is not in the fog.
fn in_vacuum(light: &str) -> String {
    format!("AttributeBegin MediumInterface \"\" \"\"\n{light}AttributeEnd\n")
}

#[test]
fn v15_fog_looks_the_same_from_both_ends_under_lights_of_every_kind() {
    // Next to a point of light in fog a path's light sampling has no finite variance: those shine from bubbles.
    let bubbles = [
        ("point", ".5 2.5 -1"),
        ("spot", "1 3 -1"),
        ("projection", "0 2 -3"),
        ("goniometric", "0 2 -1"),
    ];
    for (name, light) in LIGHTS {
        let center = bubbles
            .iter()
            .find(|(of, _)| of == name)
            .map(|(_, center)| center);
        let world = if let Some(center) = center {
            let bubble = format!(
                "AttributeBegin Material \"\" MediumInterface \"\" \"fog\" Translate {center}\n\
                 Shape \"sphere\" \"float radius\" .65 AttributeEnd\n"
            );
            fog(&(bubble + &in_vacuum(light)))
        } else if matches!(*name, "distant" | "infinite") {
            // From beyond the fog.
            fog(&in_vacuum(light))
        } else if *name == "several" {
            continue;
        } else {
            fog(light)
        };
        compare(
            job(BDPT, CAMERA, 32, &world),
            job(VOLPATH, CAMERA, 128, &world),
        )
        .assert_accepted(name);
    }
}

#[test]
fn mlt_is_path_tracing_in_the_mean() {
    let settings = "\"mlt\" \"integer maxdepth\" 4 \"integer bootstrapsamples\" 4000 \"integer chains\" 40 \
                    \"integer mutationsperpixel\" 60";
    let ball = "AttributeBegin Material \"glass\" Translate 0 .8 -1 Shape \"sphere\" \"float radius\" .5 AttributeEnd\n";
    for (name, light) in LIGHTS {
        let (world, reference) = match *name {
            "point" | "invisible" => (format!("{ROOM}{light}"), VOLPATH),
            "infinite" | "sphere" => (format!("{ROOM}{ball}{light}"), PATH),
            "panel" => (fog(light), VOLPATH),
            _ => continue,
        };
        compare(
            job(settings, CAMERA, 1, &world),
            job(reference, CAMERA, 64, &world),
        )
        .assert_accepted(name);
    }
}

/// Both ends of a connection are known to within rounding: neither surface may stand in its own light. A wide floor
/// under a narrow spot shows most of its light by light paths that look for the camera.
#[test]
fn connections_are_not_stopped_by_the_surface_they_end_on() {
    let camera = "LookAt 0 5 -5  0 0 0  0 1 0 Camera \"perspective\" \"float fov\" 50";
    let world = "LightSource \"spot\" \"point from\" [0 4 2] \"point to\" [0 0 0] \"rgb I\" [30 30 30]\n\
                 Material \"matte\" \"rgb Kd\" [.6 .6 .6]\n\
                 Shape \"trianglemesh\" \"integer indices\" [0 2 1 0 3 2] \
                 \"point P\" [-9 0 -9  9 0 -9  9 0 9  -9 0 9]\n";
    assert_agree(PATH, camera, world, "floor");
    let instance = format!(
        "ObjectBegin \"floor\"\n{}ObjectEnd\nTranslate .1 0 .2 ObjectInstance \"floor\"\n\
         Translate 0 1 1 ObjectInstance \"floor\"\n",
        &world[world.find("Material").expect("a material")..]
    );
    let light = &world[..world.find("Material").expect("a material")];
    assert_agree(PATH, camera, &format!("{light}{instance}"), "instances");
}
