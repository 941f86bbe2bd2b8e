//! Counts that are made to keep a renderer busy for ever, and lengths next to nothing: scenes load at once, and
//! rendering stops when it is asked to.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tyndall::render::{Job, Rendered, Unwatched, render};

use crate::hazards::loaded::{Found, load};

/// Nothing may take longer; the slowest takes a tenth of it.
const PATIENCE: Duration = Duration::from_secs(20);
/// What is rendered of each picture.
const A_WHILE: Duration = Duration::from_millis(100);

/// Renders for a while.
fn rendered_for_a_while(job: &Job) -> Rendered {
    let stop = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            std::thread::sleep(A_WHILE);
            stop.store(true, Ordering::Relaxed);
        });
        render(job, &Unwatched, &stop)
    })
}

/// A matte ball under a lamp and a sky, with other options.
fn scene(options: &str, world: &str) -> String {
    format!(
        "LookAt 0 0 5 0 0 0 0 1 0 Camera \"perspective\"\n\
         Film \"image\" \"integer xresolution\" 4 \"integer yresolution\" 4\n{options}\n\
         WorldBegin LightSource \"infinite\" LightSource \"point\" \"point from\" [0 3 3]\n\
         {world}\nShape \"sphere\"\nWorldEnd\n"
    )
}

/// What is said about a scene that loads and stops in time. Without a job nothing is rendered.
#[track_caller]
fn found_about(scene: &str) -> Vec<Found> {
    let started = Instant::now();
    let (compiled, found) = load(scene, None);
    let loaded = started.elapsed();
    assert!(loaded < PATIENCE, "{loaded:?} to load\n{scene}");
    if let Some(compiled) = compiled {
        let job = compiled.job;
        let n_bytes = job.bytes_needed();
        assert!(n_bytes < 1 << 32, "{n_bytes} bytes\n{scene}");
        let rendered = rendered_for_a_while(&job);
        let spent = started.elapsed();
        assert!(spent < PATIENCE, "{spent:?} to stop\n{scene}");
        assert_eq!(rendered.report.bad_samples, 0, "{scene}");
        let data = rendered.image.data();
        assert!(data.iter().all(|c| c.is_finite()), "{data:?}\n{scene}");
    }
    found
}

#[track_caller]
fn assert_silent(scene: &str) {
    let found = found_about(scene);
    assert!(found.is_empty(), "{found:?}\n{scene}");
}

#[track_caller]
fn assert_told(scene: &str) {
    let found = found_about(scene);
    assert!(found.iter().any(|f| f.is_located), "{found:?}\n{scene}");
}

const BILLION: i32 = 1_000_000_000;

#[test]
fn a_billion_samples_stop_when_asked_to() {
    for sampler in [
        format!("\"halton\" \"integer pixelsamples\" {BILLION}"),
        format!("\"random\" \"integer pixelsamples\" {BILLION}"),
        "\"sobol\" \"integer pixelsamples\" 1073741824".to_owned(),
        "\"02sequence\" \"integer pixelsamples\" 1073741824".to_owned(),
        "\"maxmindist\" \"integer pixelsamples\" 1073741824".to_owned(),
        format!("\"stratified\" \"integer xsamples\" {BILLION} \"integer ysamples\" 1"),
        format!("\"stratified\" \"integer xsamples\" 1 \"integer ysamples\" {BILLION}"),
        "\"stratified\" \"integer xsamples\" 40000 \"integer ysamples\" 40000".to_owned(),
    ] {
        assert_silent(&scene(&format!("Sampler {sampler}"), ""));
    }
}

#[test]
fn counts_that_cannot_be_are_told_where_they_stand() {
    for sampler in [
        format!("\"sobol\" \"integer pixelsamples\" {BILLION}"),
        format!("\"stratified\" \"integer xsamples\" {BILLION} \"integer ysamples\" {BILLION}"),
        format!("\"stratified\" \"integer xsamples\" -{BILLION} \"integer ysamples\" -{BILLION}"),
        format!("\"halton\" \"integer pixelsamples\" -{BILLION}"),
        format!("\"random\" \"integer pixelsamples\" {BILLION}0"),
        "\"halton\" \"integer pixelsamples\" nan".to_owned(),
    ] {
        assert_told(&scene(&format!("Sampler {sampler}"), ""));
    }
}

#[test]
fn integrators_asked_for_a_billion_of_everything_stop_when_asked_to() {
    let n = BILLION;
    for integrator in [
        format!("\"path\" \"integer maxdepth\" {n} \"float rrthreshold\" 0"),
        format!("\"volpath\" \"integer maxdepth\" {n} \"float rrthreshold\" 0"),
        format!("\"bdpt\" \"integer maxdepth\" {n}"),
        format!("\"directlighting\" \"integer maxdepth\" {n}"),
        format!("\"whitted\" \"integer maxdepth\" {n}"),
        format!("\"ambientocclusion\" \"integer nsamples\" {n}"),
        format!("\"sppm\" \"integer iterations\" {n} \"integer maxdepth\" {n}"),
        format!("\"sppm\" \"integer photonsperiteration\" {n} \"float radius\" 1e-30"),
        "\"sppm\" \"integer photonsperiteration\" 1000 \"float radius\" 1e30".to_owned(),
        format!("\"mlt\" \"integer mutationsperpixel\" {n} \"integer chains\" 100000"),
        format!("\"mlt\" \"integer bootstrapsamples\" {n} \"integer maxdepth\" {n}"),
        format!("\"mlt\" \"integer chains\" {n} \"integer bootstrapsamples\" 1000"),
        "\"mlt\" \"float sigma\" 1e-30 \"integer bootstrapsamples\" 1000".to_owned(),
    ] {
        for world in ["", "Material \"mirror\"", "Material \"glass\""] {
            found_about(&scene(&format!("Integrator {integrator}"), world));
        }
    }
}

#[test]
fn lights_and_textures_asked_for_a_billion_of_everything_stop_when_asked_to() {
    let n = BILLION;
    let direct = "Integrator \"directlighting\"";
    let lamp = |kind: &str| {
        format!(
            "AttributeBegin AreaLightSource \"diffuse\" \"integer {kind}\" {n} Translate 3 0 0 Shape \"disk\" AttributeEnd"
        )
    };
    let noise = |kind: &str| {
        format!(
            "Texture \"t\" \"color\" \"{kind}\" \"integer octaves\" {n} \"float roughness\" 1\n\
             Material \"matte\" \"texture Kd\" \"t\""
        )
    };
    for world in [
        lamp("samples"),
        lamp("nsamples"),
        format!("LightSource \"infinite\" \"integer samples\" {n}"),
        noise("fbm"),
        noise("wrinkled"),
        noise("marble"),
    ] {
        found_about(&scene(direct, &world));
    }
}

#[test]
fn lamps_times_instances_are_bounded() {
    let triangles = "0 1 2 ".repeat(4096);
    let lamp = format!(
        "ObjectBegin \"lamp\" AreaLightSource \"diffuse\" Shape \"trianglemesh\" \
         \"integer indices\" [{triangles}] \"point P\" [0 0 0 1 0 0 0 1 0] ObjectEnd\n{}",
        "Translate 0 0 1 ObjectInstance \"lamp\"\n".repeat(1024)
    );
    let (compiled, found) = load(&scene("", &lamp), None);
    assert!(
        found
            .iter()
            .any(|f| f.code == "too-many-lights" && f.is_error && f.is_located),
        "{found:?}"
    );
    let n_triangles = compiled.expect("a job").job.world.n_elements();
    assert!(
        (3 << 20..=(3 << 20) + 4096).contains(&n_triangles),
        "{n_triangles}"
    );
}

#[test]
fn next_to_nothing_is_rendered_or_told() {
    for least in ["1e-30", "1e-44"] {
        for options in [
            format!("PixelFilter \"box\" \"float xwidth\" {least} \"float ywidth\" {least}"),
            format!("PixelFilter \"gaussian\" \"float xwidth\" {least} \"float ywidth\" {least}"),
            format!("PixelFilter \"mitchell\" \"float xwidth\" {least} \"float ywidth\" {least}"),
            format!("PixelFilter \"triangle\" \"float xwidth\" {least}"),
            format!("PixelFilter \"sinc\" \"float tau\" {least}"),
            format!("PixelFilter \"gaussian\" \"float alpha\" {least}"),
            format!("Camera \"perspective\" \"float lensradius\" {least}"),
            format!(
                "Camera \"perspective\" \"float lensradius\" 1 \"float focaldistance\" {least}"
            ),
            format!("Camera \"perspective\" \"float fov\" {least}"),
            format!("Camera \"perspective\" \"float frameaspectratio\" {least}"),
            format!("Camera \"perspective\" \"float screenwindow\" [0 {least} 0 {least}]"),
            format!("Camera \"orthographic\" \"float screenwindow\" [0 {least} 0 {least}]"),
            format!(
                "ActiveTransform EndTime Translate 1 0 0 ActiveTransform All TransformTimes 0 {least}\n\
                 Camera \"perspective\" \"float shutterclose\" {least}"
            ),
        ] {
            found_about(&scene(&options, ""));
        }
    }
}

#[test]
fn what_the_other_tests_render_is_cut_short() {
    // This many samples would take days.
    let many = "Sampler \"random\" \"integer pixelsamples\" 1000000000";
    let (compiled, _) = load(&scene(many, ""), None);
    let rendered = rendered_for_a_while(&compiled.expect("a job").job);
    assert!(rendered.report.cancelled && rendered.report.samples > 0);
}
