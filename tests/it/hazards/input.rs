//! Family I, and the rows of other families that loading decides: what no picture can be made of is told at its place.

use std::sync::atomic::AtomicBool;

use tyndall::render::{Unwatched, render};

use crate::hazards::loaded::{load, load_with};

/// A ball under a sky, with other options or another world.
fn scene(options: &str, world: &str) -> String {
    format!(
        "LookAt 0 0 5 0 0 0 0 1 0 Camera \"perspective\"\n\
         Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\n{options}\n\
         WorldBegin LightSource \"infinite\"\n{world} Shape \"sphere\"\nWorldEnd\n"
    )
}

/// The error is told, and what is left is rendered, if there is anything.
#[track_caller]
fn assert_told(scene: &str, code: &str, is_error: bool) {
    let compiled = load_with(scene, None, code, is_error);
    if let Some(compiled) = compiled {
        let mut job = compiled.job;
        job.spp = job.spp.min(4);
        let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
        assert_eq!(rendered.report.bad_samples, 0, "{scene}");
        assert!(
            rendered
                .image
                .data()
                .iter()
                .all(|c| c.is_finite() && *c >= 0.0)
        );
    }
}

#[test]
fn i05_frames_without_pixels_are_errors() {
    let film = |rest: &str| scene(&format!("Film \"image\" {rest}"), "");
    for rest in [
        "\"integer xresolution\" 0",
        "\"integer yresolution\" -4",
        "\"float cropwindow\" [0 1 nan 1]",
    ] {
        let (_, found) = load(&film(rest), None);
        let told = found.iter().any(|f| f.is_error && f.is_located);
        assert!(told, "{rest}: {found:?}");
    }
    assert_told(
        &film("\"float cropwindow\" [.5 .5 .5 .5]"),
        "no-pixels",
        true,
    );
}

#[test]
fn i06_frames_and_filters_beyond_any_memory_are_errors() {
    let huge = "Film \"image\" \"integer xresolution\" 65536 \"integer yresolution\" 65536";
    let (job, found) = load(&scene(huge, ""), None);
    assert!(job.is_none());
    assert!(
        found
            .iter()
            .any(|f| f.code == "too-many-pixels" && f.message.contains("GB")),
        "{found:?}"
    );
    let wide = "PixelFilter \"box\" \"float xwidth\" 2147483300";
    let (job, found) = load(&scene(wide, ""), None);
    assert!(job.is_none());
    assert!(found.iter().any(|f| f.code == "wide-filter"), "{found:?}");
}

#[test]
fn n18_filters_without_width_are_errors_and_have_their_default() {
    for filter in [
        "\"mitchell\" \"float xwidth\" [0] \"float ywidth\" [0]",
        "\"gaussian\" \"float xwidth\" -1",
        "\"box\" \"float ywidth\" nan",
        "\"sinc\" \"float tau\" 0",
    ] {
        let (job, found) = load(&scene(&format!("PixelFilter {filter}"), ""), None);
        let told = found.iter().any(|f| f.is_error && f.is_located);
        assert!(told, "{filter}: {found:?}");
        let rendered = render(
            &job.expect("a job").job,
            &Unwatched,
            &AtomicBool::new(false),
        );
        let image = rendered.image;
        assert!(image.data().iter().all(|c| *c > 0.0), "{filter}: {image:?}");
    }
}

#[test]
fn n16_reflectances_that_make_no_sense_are_told_and_bounded() {
    // Below 0 counts as 0, above 1 is kept, as in pbrt-v3, amounts of mixtures included; what is no number is replaced.
    let pixel = |material: &str| {
        let narrow = "Integrator \"path\" \"integer maxdepth\" 1";
        let scene = scene(narrow, material);
        let scene = scene.replace("\"perspective\"", "\"perspective\" \"float fov\" 5");
        let (job, found) = load(&scene, None);
        let mut job = job.expect("a job").job;
        job.spp = 64;
        let rendered = render(&job, &Unwatched, &AtomicBool::new(false));
        assert_eq!(rendered.report.bad_samples, 0, "{material}");
        (rendered.image.pixel(1, 1)[0], found)
    };
    let grey = "MakeNamedMaterial \"a\" \"string type\" \"matte\" \"rgb Kd\" [1 1 1]\n\
                MakeNamedMaterial \"b\" \"string type\" \"matte\" \"rgb Kd\" [0 0 0]\n";
    let mix = |amount: &str| {
        format!(
            "{grey} Material \"mix\" \"string namedmaterial1\" \"a\" \"string namedmaterial2\" \"b\" \"rgb amount\" [{amount}]"
        )
    };
    let (black, found) = pixel("Material \"matte\" \"rgb Kd\" [-1 -1 -1]");
    assert_eq!((black, found[0].code), (0.0, "negative-colour"));
    let (white, found) = pixel("Material \"matte\" \"rgb Kd\" [1 1 1]");
    assert!(found.is_empty());
    let (gaining, _) = pixel("Material \"matte\" \"rgb Kd\" [2 2 2]");
    assert!((gaining / white - 2.0).abs() < 1e-4, "{gaining} {white}");
    let (nan, found) = pixel("Material \"matte\" \"rgb Kd\" [nan nan nan]");
    assert!(
        nan.is_finite() && found.iter().any(|f| f.is_error),
        "{found:?}"
    );
    let (over, found) = pixel(&mix("3 3 3"));
    assert!(
        (over / white - 3.0).abs() < 1e-3,
        "{over} {white} {found:?}"
    );
}

#[test]
fn n27_phase_functions_beyond_their_range_are_errors_and_clamped() {
    for g in ["1.5", "-1.5", "nan"] {
        let fog = format!(
            "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"float g\" {g} \
             MediumInterface \"fog\" \"\" Material \"\""
        );
        let (job, found) = load(&scene("Integrator \"volpath\"", &fog), None);
        let told = found.iter().any(|f| f.is_error && f.is_located);
        assert!(told, "{g}: {found:?}");
        let rendered = render(
            &job.expect("a job").job,
            &Unwatched,
            &AtomicBool::new(false),
        );
        assert_eq!(rendered.report.bad_samples, 0, "{g}");
    }
}

#[test]
fn l04_emitters_without_area_are_told_and_light_nothing() {
    for shape in [
        "Shape \"sphere\" \"float radius\" 0",
        "Shape \"disk\" \"float radius\" 0",
        "Shape \"cylinder\" \"float radius\" 0",
        "Shape \"cylinder\" \"float zmin\" 1",
        "Shape \"sphere\" \"float zmin\" 1 \"float zmax\" 1",
    ] {
        let lamp = format!("AttributeBegin AreaLightSource \"diffuse\" {shape} AttributeEnd");
        let world = format!("{lamp} Material \"matte\" \"rgb Kd\" [1 1 1]");
        let dark = scene("Integrator \"path\"", &world).replace("LightSource \"infinite\"", "");
        let compiled = load_with(&dark, None, "no-area", false).expect("a job");
        let rendered = render(&compiled.job, &Unwatched, &AtomicBool::new(false));
        assert_eq!(rendered.report.bad_samples, 0, "{shape}");
        assert!(rendered.image.data().iter().all(|c| *c == 0.0), "{shape}");
    }
}

#[test]
fn g19_lights_without_a_direction_are_errors_and_left_out() {
    for light in ["spot", "distant"] {
        let light =
            format!("LightSource \"{light}\" \"point from\" [1 2 3] \"point to\" [1 2 3]\n");
        assert_told(&scene("", &light), "bad-light", true);
    }
}

#[test]
fn g21_motions_through_a_mirror_are_told_and_finite() {
    for (directive, world) in [
        (
            "",
            "ActiveTransform EndTime Scale -1 1 1 ActiveTransform All",
        ),
        (
            "ActiveTransform EndTime Scale -1 1 1 ActiveTransform All TransformTimes 0 1 Camera \"perspective\" \"float shutterclose\" 1",
            "",
        ),
    ] {
        let text = scene(directive, world);
        let (job, found) = load(&text, None);
        assert!(!found.is_empty(), "{text}");
        if let Some(compiled) = job {
            let rendered = render(&compiled.job, &Unwatched, &AtomicBool::new(false));
            assert_eq!(rendered.report.bad_samples, 0, "{text}");
        }
    }
}

#[test]
fn n10_impossible_texels_of_a_sky_are_told_and_repaired() {
    let mut texels = vec![1f32; 8 * 4 * 3];
    for (i, bad) in [f32::NAN, f32::INFINITY, -5.0].into_iter().enumerate() {
        texels[3 * i..3 * i + 3].fill(bad);
    }
    let mut file = b"PF\n8 4\n-1.0\n".to_vec();
    file.extend(texels.iter().flat_map(|x| x.to_le_bytes()));
    let text = scene("", "").replace(
        "\"infinite\"",
        "\"infinite\" \"string mapname\" \"sky.pfm\"",
    );
    let compiled = load_with(&text, Some(&file), "bad-texels", false).expect("a job");
    let (_, found) = load(&text, Some(&file));
    assert!(found.iter().any(|f| f.message.contains('9')), "{found:?}");
    let rendered = render(&compiled.job, &Unwatched, &AtomicBool::new(false));
    assert_eq!(rendered.report.bad_samples, 0);
    assert!(
        rendered
            .image
            .data()
            .iter()
            .all(|c| (0.0..=1.01).contains(c))
    );
    // A texel of the largest numbers there are is fine.
    texels.fill(1.0);
    texels[0..3].fill(1e38);
    let mut file = b"PF\n8 4\n-1.0\n".to_vec();
    file.extend(texels.iter().flat_map(|x| x.to_le_bytes()));
    let (job, found) = load(&text, Some(&file));
    assert!(found.is_empty(), "{found:?}");
    let rendered = render(
        &job.expect("a job").job,
        &Unwatched,
        &AtomicBool::new(false),
    );
    assert_eq!(rendered.report.bad_samples, 0);
}
