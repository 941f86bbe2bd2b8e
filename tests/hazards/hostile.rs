//! Counts that are made to keep a renderer busy for ever, and lengths next to nothing: scenes load at once, a first part
//! of the picture is there at once, and rendering stops when asked to.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use tyndall::render::{Progress, Unwatched, render};

use crate::loaded::{Found, load};

/// Whoever asks for more gets no answer in this time; the slowest takes a tenth of it.
const PATIENCE: Duration = Duration::from_secs(10);

/// Has enough as soon as something is done.
struct Impatient(AtomicBool);

impl Progress for Impatient {
    fn samples_done(&self, _done: u64, _total: u64) {
        self.0.store(true, Ordering::Relaxed);
    }
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

/// What is said about a scene whose rendering begins and ends in time. Without a job nothing is rendered.
#[track_caller]
fn begun(scene: &str) -> Vec<Found> {
    let started = Instant::now();
    let (compiled, found) = load(scene, None);
    let loaded = started.elapsed();
    assert!(loaded < PATIENCE, "{loaded:?} to load\n{scene}");
    if let Some(compiled) = compiled {
        let job = compiled.job;
        assert!(job.bytes_needed() < 1 << 30, "{scene}");
        let impatient = Impatient(AtomicBool::new(false));
        let rendered = render(&job, &impatient, &impatient.0);
        let spent = started.elapsed();
        assert!(spent < PATIENCE, "{spent:?} to begin\n{scene}");
        assert_eq!(rendered.report.bad_samples, 0, "{scene}");
        let data = rendered.image.data();
        assert!(data.iter().all(|c| c.is_finite()), "{scene}");
    }
    found
}

#[track_caller]
fn assert_silent(scene: &str) {
    let found = begun(scene);
    assert!(found.is_empty(), "{found:?}\n{scene}");
}

#[track_caller]
fn assert_told(scene: &str) {
    let found = begun(scene);
    assert!(found.iter().any(|f| f.is_located), "{found:?}\n{scene}");
}

const BILLION: i32 = 1_000_000_000;

#[test]
fn a_billion_samples_begin_at_once() {
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
fn integrators_asked_for_a_billion_of_everything_begin_at_once() {
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
        format!("\"mlt\" \"integer mutationsperpixel\" {n} \"integer bootstrapsamples\" 1000"),
        format!("\"mlt\" \"integer bootstrapsamples\" {n} \"integer maxdepth\" {n}"),
        format!("\"mlt\" \"integer chains\" {n} \"integer bootstrapsamples\" 1000"),
        "\"mlt\" \"float sigma\" 1e-30 \"integer bootstrapsamples\" 1000".to_owned(),
    ] {
        for world in ["", "Material \"mirror\"", "Material \"glass\""] {
            begun(&scene(&format!("Integrator {integrator}"), world));
        }
    }
}

#[test]
fn lights_and_textures_asked_for_a_billion_of_everything_begin_at_once() {
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
        begun(&scene(direct, &world));
    }
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
            begun(&scene(&options, ""));
        }
    }
}

#[test]
fn an_impatient_look_is_cut_short() {
    // That the other tests stop early at all: this many samples would take a day.
    let many = "Sampler \"random\" \"integer pixelsamples\" 1000000000";
    let (compiled, _) = load(&scene(many, ""), None);
    let job = compiled.expect("a job").job;
    let impatient = Impatient(AtomicBool::new(false));
    assert!(render(&job, &impatient, &impatient.0).report.cancelled);
    let (compiled, _) = load(&scene("", ""), None);
    let mut job = compiled.expect("a job").job;
    job.spp = 1;
    let whole = render(&job, &Unwatched, &AtomicBool::new(false));
    assert!(!whole.report.cancelled);
}
