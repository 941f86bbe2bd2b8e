//! Family M: materials and textures.

use crate::common::probe::{Probe, assert_exact};
use crate::common::seen::{environment, seen_by};

#[test]
fn m14_masks_that_are_not_0_are_opaque() {
    // As in pbrt-v3: two black sheets of alpha 0.5 before a white sky let nothing pass, of alpha 0 everything.
    let sheets = |alpha: &str| {
        let sheet = |z: i32| {
            format!(
                "Shape \"trianglemesh\" \"point P\" [-9 -9 {z}  9 -9 {z}  9 9 {z}  -9 9 {z}] \
                 \"integer indices\" [0 1 2 0 2 3] \"float alpha\" {alpha}\n"
            )
        };
        let world = environment([1.0; 3])
            + "Material \"matte\" \"rgb Kd\" [0 0 0]\n"
            + &sheet(0)
            + &sheet(1);
        seen_by("path", 5, [0.1, 0.2, -3.0], [0.0, 0.0, 1.0], &world)
    };
    assert_exact(&sheets("0.5"), [0.0; 3], "half");
    assert_exact(&sheets("0"), [1.0; 3], "nothing");
}

#[test]
fn rough_textures_below_0_are_smooth() {
    let world = environment([1.0; 3])
        + "Texture \"bumpy\" \"float\" \"fbm\" Texture \"rough\" \"float\" \"scale\"\n\
           \"texture tex1\" \"bumpy\" \"float tex2\" 4\n\
           Material \"disney\" \"texture roughness\" \"rough\" \"spectrum scatterdistance\" [400 1 700 1]\n\
           Shape \"disk\" \"float radius\" 9\n";
    let scene = seen_by("path", 3, [0.4, 0.3, 4.0], [0.1, 0.2, -1.0], &world);
    for sample in Probe::new(&scene).samples_within(64.0, 0, 4000) {
        assert!(
            sample.iter().all(|c| c.is_finite() && *c >= 0.0),
            "{sample:?}"
        );
    }
}

#[test]
fn m10_m11_textures_far_out_render_finite() {
    for texture in [
        "\"marble\" \"float scale\" 1e12",
        "\"fbm\"",
        "\"wrinkled\"",
        "\"windy\"",
        "\"checkerboard\" \"float uscale\" 1e12 \"float vscale\" 1e12",
        "\"dots\" \"float uscale\" 1e12",
    ] {
        let kind = if texture.contains("marble")
            || texture.contains("check")
            || texture.contains("dots")
        {
            "spectrum"
        } else {
            "float"
        };
        let used = if kind == "spectrum" { "Kd" } else { "sigma" };
        let world = environment([1.0; 3])
            + &format!(
                "Scale 1e12 1e12 1e12 Texture \"t\" \"{kind}\" {texture} Scale 1e-12 1e-12 1e-12\n"
            )
            + &format!("Material \"matte\" \"texture {used}\" \"t\" Shape \"sphere\"\n");
        let scene = seen_by("path", 1, [0.1, 0.2, -3.0], [0.0, 0.0, 1.0], &world);
        for sample in Probe::new(&scene).samples(500) {
            assert!(
                sample.iter().all(|c| c.is_finite() && *c >= 0.0),
                "{texture}: {sample:?}"
            );
        }
    }
}
