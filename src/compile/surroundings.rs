//! Whether the camera and the lights are in the media that they are declared to be in, by the boundaries around them.
//! Pictures are those of the declarations, as in pbrt-v3; what contradicts them is told.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::Span;

use crate::camera::{CameraRay, CameraSample};
use crate::ids::{LightId, MediumId};
use crate::integrator::Integrator;
use crate::math::Point3;
use crate::render::Job;

/// Where the things that have surroundings stand in the scene.
pub(super) struct Places {
    pub(super) camera: Span,
    /// Lights that are no surfaces.
    pub(super) lights: Vec<(LightId, Span)>,
}

/// Tells of the camera, and of lights where paths start at them. `names` are those of the media.
pub(super) fn check(job: &Job, names: &[String], places: &Places, diagnostics: &mut Diagnostics) {
    let world = &job.world;
    if !world.facts().has_media {
        return;
    }
    let middle = CameraSample {
        raster: job.film.resolution.map(|length| 0.5 * f64::from(length)),
        time: 0.0,
        lens: [0.5; 2],
    };
    let open = job.camera.shutter()[0];
    let mut look = |p: Point3, declared: MediumId, what: &str, span: Span, mend: &str| {
        let Some(found) = world.surroundings(p, open).filter(|m| *m != declared) else {
            return;
        };
        let name = |medium: MediumId| {
            let name = names.get(medium.index());
            name.map_or_else(|| "no medium".to_owned(), |name| format!("\"{name}\""))
        };
        let message = format!(
            "the boundaries around the {what} say that it is in {}, but it is declared to be in {}",
            name(found),
            name(declared)
        );
        let word = names.get(found.index()).map_or("", String::as_str);
        diagnostics.push(
            Diagnostic::warning("surroundings", span, message)
                .with_label(format!("rendered in {}", name(declared)))
                .with_help(format!(
                    "MediumInterface \"\" \"{word}\" in force {mend} says what they say"
                )),
        );
    };
    if let Some(CameraRay { ray, .. }) = job.camera.ray(&middle) {
        let declared = world.camera_medium();
        look(ray.o, declared, "camera", places.camera, "at WorldEnd");
    }
    if !matches!(job.integrator, Integrator::Bdpt(_) | Integrator::Mlt(_)) {
        return;
    }
    for &(light, span) in &places.lights {
        if let Some(p) = world.light(light).position() {
            look(p, world.light_medium(light), "light", span, "there");
        }
    }
}
