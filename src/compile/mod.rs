//! Scene description in, job out: the only room that knows plugin names, parameters, defaults and files.
//!
//! Works backward from what the picture needs: shapes first, then only the materials, textures, images, media and
//! lights they lead to. What nothing leads to is neither opened nor decoded nor built.

mod assets;
mod camera;
mod geometry;
mod lens;
mod lights;
mod materials;
mod media;
mod options;
mod placement;
pub mod reader;
mod shapes;
mod space;
mod spectra;
mod surroundings;
mod textures;

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics, Severity};
use tyndall_parser::schema::{Family, PluginRef};
use tyndall_parser::source::Spanned;

use crate::describe::description::Frame;
use crate::ids::MediumId;
use crate::image::PixelRect;
use crate::integrator::Integrator;
use crate::math::Transform;
use crate::render::Job;
use crate::world::{World, WorldParts};
pub use assets::{Assets, NoAssets};

/// What the command line changes about a scene.
#[derive(Clone, Debug, Default)]
pub struct CompileOptions {
    /// Crop window x0, x1, y0, y1 in fractions of the frame; the film's own takes precedence.
    pub crop_window: Option<[f32; 4]>,
    /// A quick look: a quarter of the resolution, one sample.
    pub quick: bool,
    /// Samples per pixel instead of the scene's.
    pub spp: Option<u32>,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// A picture ready to be rendered.
#[derive(Debug)]
pub struct Compiled {
    /// What to render.
    pub job: Job,
    /// The way back from render space, in which the job is.
    pub world_from_render: Transform,
    /// Names of the job's media.
    pub medium_names: Vec<String>,
    /// The film's file name as written, relative to the working directory.
    pub filename: String,
    /// The full frame; the picture is its crop window.
    pub frame: PixelRect,
    /// Name of the integrator.
    pub integrator: &'static str,
    /// What the scene defines and the picture does not need.
    pub skipped: Skipped,
}

/// Names of things that were left alone because nothing leads to them, in the order of their definitions.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Skipped {
    /// Textures.
    pub textures: Vec<String>,
    /// Materials; those without a name of their own by that of their plugin.
    pub materials: Vec<String>,
    /// Media.
    pub media: Vec<String>,
    /// Object definitions.
    pub objects: Vec<String>,
}

/// Builds the job of a frame. `None` if there is nothing sensible to render; the diagnostics then say why.
pub fn compile(
    mut frame: Frame,
    options: &CompileOptions,
    assets: &dyn Assets,
) -> (Option<Compiled>, Diagnostics) {
    let mut diagnostics = Diagnostics::default();
    let compiled = build(&mut frame, options, assets, &mut diagnostics);
    (compiled, diagnostics)
}

fn build(
    frame: &mut Frame,
    options: &CompileOptions,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Compiled> {
    // Read every option even if one is missing, so that all faults are reported at once.
    let film = options::film(frame, options, diagnostics);
    let samples = options::samples(frame, options, diagnostics);
    let integrator = options::integrator(frame, options, diagnostics);
    options::accelerator(frame, diagnostics);
    let camera = camera::camera(frame, film.as_ref(), assets, diagnostics);

    let loaded = geometry::load(frame, assets, diagnostics);
    let skipped_objects = loaded.skipped_objects(&frame.objects);
    let (film, samples, integrator, camera) = (film?, samples?, integrator?, camera?);
    let space = space::RenderSpace::new(loaded.world_bounds(), camera.position());

    let mut builders = geometry::Builders {
        media: media::Media::new(frame, &space, assets, integrator.volumetric),
        textures: textures::TextureBuilder::new(frame, &space, assets),
        materials: materials::MaterialBuilder::new(frame, &space),
        assets,
        heeds_shadow_masks: matches!(
            integrator.integrator,
            Integrator::Path(_) | Integrator::Direct(_) | Integrator::Sppm(_)
        ),
    };
    let mut parts = WorldParts {
        light_strategy: integrator.light_strategy,
        shutter: camera.shutter(),
        ..WorldParts::default()
    };
    loaded.place(frame, &space, &mut builders, &mut parts, diagnostics);
    parts.camera_medium = match frame.camera.medium {
        Some(medium) => builders.media.id(medium, diagnostics),
        None => MediumId::NONE,
    };
    let lights = lights::build(
        frame,
        &space,
        assets,
        &mut builders.media,
        &mut parts,
        diagnostics,
    );
    let needs_light = !matches!(integrator.integrator, Integrator::AmbientOcclusion(_));
    if parts.lights.is_empty() && needs_light {
        diagnostics.push(
            Diagnostic::warning("no-lights", frame.span, "the scene has no lights")
                .with_help("the picture will be black"),
        );
    }

    let geometry::Builders {
        media,
        textures,
        materials,
        ..
    } = builders;
    let skipped = Skipped {
        textures: textures.skipped(),
        materials: materials.skipped(),
        media: media.skipped(),
        objects: skipped_objects,
    };
    parts.materials = materials.finish(diagnostics);
    parts.textures = textures.finish();
    let ignores_media = media.is_ignored();
    let (media, medium_names) = media.finish();
    parts.media = media;
    let kind = &frame.integrator.kind;
    let name = integrator.name;
    let mut warn_of_ignored = |what: &str, instead: &str| {
        diagnostics.push(
            Diagnostic::warning(
                "ignored-scattering",
                kind.span,
                format!("\"{name}\" ignores {what}"),
            )
            .with_help(format!("{instead} renders it")),
        );
    };
    if ignores_media {
        warn_of_ignored("the media of the scene", "\"volpath\"");
    }
    let spreads_light = matches!(
        integrator.integrator,
        Integrator::Path(_) | Integrator::VolPath(_)
    );
    if !spreads_light && parts.materials.let_light_in() {
        warn_of_ignored(
            "the light that spreads below surfaces",
            "\"path\" or \"volpath\"",
        );
    }
    let job = Job {
        world: World::new(parts),
        camera: camera.place(&space),
        pixel_bounds: integrator.pixel_bounds,
        integrator: integrator.integrator_at(space.scale()),
        film: film.desc,
        spp: integrator.spp.unwrap_or(samples.spp),
        seed: options.seed,
        pixel_centers: samples.pixel_centers,
        sampler: samples.sampler,
    };
    let places = surroundings::Places {
        camera: frame.camera.entity.span,
        lights,
    };
    surroundings::check(&job, &medium_names, &places, diagnostics);
    Some(Compiled {
        job,
        world_from_render: space.world_from_render(),
        medium_names,
        filename: film.filename,
        frame: film.frame,
        integrator: integrator.name,
        skipped,
    })
}

/// Looks up a plugin. Where pbrt-v3 goes on without it, so do we, with an error.
fn lookup(
    family: Family,
    kind: &Spanned<String>,
    instead: &str,
    diagnostics: &mut Diagnostics,
) -> Option<PluginRef> {
    match family.lookup(kind) {
        Ok(plugin) => Some(plugin),
        Err(mut diagnostic) => {
            diagnostic.severity = Severity::Error;
            diagnostic.label = instead.to_owned();
            diagnostics.push(*diagnostic);
            None
        }
    }
}

/// Reports a plugin or feature that this version does not have.
fn unsupported(what: &str, span: tyndall_parser::source::Span, instead: &str) -> Diagnostic {
    Diagnostic::error("unsupported", span, format!("{what} is not supported yet"))
        .with_label(instead)
}
