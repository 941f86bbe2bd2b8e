//! Surfaces finer than a pixel: what the camera sees directly has the footprint of its pixel in every strategy that
//! finds it.

use crate::bidirectional::setup::{CAMERA, LIGHTS, compare, job};

const BDPT: &str = "\"bdpt\" \"integer maxdepth\" 3";
const MLT: &str =
    "\"mlt\" \"integer maxdepth\" 3 \"integer bootstrapsamples\" 4000 \"integer chains\" 100";
const PATH: &str = "\"path\" \"integer maxdepth\" 3";

/// Displacements and roughnesses that look otherwise from far away.
const FINE: &[(&str, &str)] = &[
    (
        "fbm",
        "Texture \"fine\" \"float\" \"fbm\" \"integer octaves\" 8 \"float roughness\" .9\n\
         Texture \"height\" \"float\" \"scale\" \"texture tex1\" \"fine\" \"float tex2\" 1\n",
    ),
    (
        "a board",
        "Texture \"fine\" \"float\" \"checkerboard\" \"float uscale\" 300 \"float vscale\" 300 \
         \"float tex1\" .01 \"float tex2\" .9\n\
         Texture \"height\" \"float\" \"scale\" \"texture tex1\" \"fine\" \"float tex2\" .01\n",
    ),
];

/// A floor and a ball, bumpy, and a board that is smooth and rough by turns.
fn fine(textures: &str, light: &str) -> String {
    format!(
        "{textures}AttributeBegin Material \"matte\" \"rgb Kd\" [.7 .6 .5] \"texture bumpmap\" \"height\"\n\
         Shape \"trianglemesh\" \"point P\" [-3 0 -3  -3 0 3  3 0 3  3 0 -3] \"float uv\" [0 0 0 1 1 1 1 0] \
         \"integer indices\" [0 1 2 0 2 3]\n\
         Translate -.8 .6 0 Shape \"sphere\" \"float radius\" .6 AttributeEnd\n\
         AttributeBegin Material \"plastic\" \"rgb Kd\" [.3 .4 .5] \"rgb Ks\" [.5 .5 .5] \"texture roughness\" \"fine\"\n\
         Shape \"trianglemesh\" \"point P\" [0 0 1  0 2 1  2 2 .5  2 0 .5] \"float uv\" [0 0 0 1 1 1 1 0] \
         \"integer indices\" [0 1 2 0 2 3] AttributeEnd\n{light}"
    )
}

#[test]
fn what_is_finer_than_a_pixel_looks_the_same() {
    for (texture, textures) in FINE {
        for (light, text) in LIGHTS {
            if matches!(*light, "point" | "sphere" | "infinite") {
                let world = fine(textures, text);
                compare(job(BDPT, CAMERA, 16, &world), job(PATH, CAMERA, 16, &world))
                    .assert_accepted(&format!("{texture}, {light}"));
            }
        }
    }
}

#[test]
fn mlt_sees_what_is_finer_than_a_pixel_like_bdpt() {
    let world = fine(FINE[0].1, LIGHTS[0].1);
    let samples = "\"integer mutationsperpixel\" 64";
    let chains = job(&format!("{MLT} {samples}"), CAMERA, 1, &world);
    compare(chains, job(PATH, CAMERA, 64, &world)).assert_accepted("mlt");
}

#[test]
fn footprints_end_at_null_surfaces_from_both_ends() {
    let shell = "AttributeBegin Material \"\" Translate 0 1 -4 Shape \"sphere\" \"float radius\" .5 AttributeEnd\n";
    let world = format!("{}{shell}", fine(FINE[0].1, LIGHTS[0].1));
    let volpath = PATH.replace("path", "volpath");
    compare(
        job(BDPT, CAMERA, 16, &world),
        job(&volpath, CAMERA, 16, &world),
    )
    .assert_accepted("behind a shell");
}
