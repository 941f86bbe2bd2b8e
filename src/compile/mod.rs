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
use tyndall_parser::source::{Span, Spanned};

use crate::accel::Bvh;
use crate::camera::{Camera, CameraSample};
use crate::compile::geometry::{Builders, Loaded};
use crate::compile::materials::MaterialBuilder;
use crate::compile::media::Media;
use crate::compile::options::IntegratorOptions;
use crate::compile::reader::ParamReader;
use crate::compile::space::RenderSpace;
use crate::compile::textures::TextureBuilder;
use crate::describe::description::Frame;
use crate::ids::{LightId, MediumId};
use crate::image::PixelRect;
use crate::integrator::Integrator;
use crate::integrator::bdpt::aim_light;
use crate::material::Materials;
use crate::math::{Ray, Transform};
use crate::render::Job;
use crate::world::{World, WorldParts};
use assets::lack_of_memory;
pub use assets::{Assets, NoAssets};
pub use geometry::Origins;
pub use options::EMPTY_CROP_WINDOW;

/// Most rays that one point of a surface sends for one purpose: nothing stops the rendering between them.
const MAX_RAYS: u32 = 4096;

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
    /// Where its geometries come from.
    pub origins: Origins,
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
    let (film, samples, integrator, camera) = (film?, samples?, integrator?, camera?);
    let view = camera.view(film.desc.resolution);
    let space = RenderSpace::new(loaded.world_bounds(), loaded.origin(&view));
    let contents = contents(frame, loaded, &space, &integrator, assets, diagnostics)?;
    let parts = WorldParts {
        light_strategy: integrator.light_strategy,
        shutter: camera.shutter(),
        ..contents.parts
    };
    let mut world = World::new(parts);
    let camera = camera.place(&space);
    world.note_view(view_rays(&camera, film.desc.resolution));
    let light_transport = integrator.integrator_at(space.scale());
    if let Some(max_depth) = light_transport.depth_of_light_paths() {
        aim_light(&mut world, &camera, film.desc.resolution, max_depth);
    }
    let job = Job {
        world,
        camera,
        pixel_bounds: integrator.pixel_bounds,
        integrator: light_transport,
        film: film.desc,
        spp: integrator.spp.unwrap_or(samples.spp),
        seed: options.seed,
        pixel_centers: samples.pixel_centers,
        sampler: samples.sampler,
    };
    let places = surroundings::Places {
        camera: frame.camera.entity.span,
        lights: contents.lights,
    };
    tell_of_overlaps(&job.world, &contents.origins, diagnostics);
    surroundings::check(&job, &contents.medium_names, &places, diagnostics);
    Some(Compiled {
        job,
        world_from_render: space.world_from_render(),
        origins: contents.origins,
        medium_names: contents.medium_names,
        filename: film.filename,
        frame: film.frame,
        integrator: integrator.name,
        skipped: contents.skipped,
    })
}

/// Rays of a camera to the whole of what it sees, whatever part of the picture is wanted.
fn view_rays(camera: &Camera, resolution: [u32; 2]) -> impl Iterator<Item = Ray> {
    const N: u32 = 16;
    // Off the lines of symmetry of scenes, where rounding would decide what is met.
    const OFFSET: [f64; 2] = [0.437, 0.561];
    (0..N * N).filter_map(move |k| {
        let cell = [k % N, k / N];
        let sample = CameraSample {
            raster: [0, 1].map(|axis| {
                f64::from(resolution[axis]) * (f64::from(cell[axis]) + OFFSET[axis]) / f64::from(N)
            }),
            time: 0.5,
            lens: [0.5; 2],
        };
        Some(camera.ray(&sample)?.ray)
    })
}

/// What stands in a world, in render space.
struct Contents {
    parts: WorldParts,
    origins: Origins,
    medium_names: Vec<String>,
    /// Lights that are no surfaces, and their places in the file.
    lights: Vec<(LightId, Span)>,
    skipped: Skipped,
}

/// Builds what shapes, camera and lights lead to. `None` if that is more than a world can hold.
fn contents(
    frame: &mut Frame,
    loaded: Loaded,
    space: &RenderSpace,
    integrator: &IntegratorOptions,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Contents> {
    let skipped_objects = loaded.skipped_objects(&frame.objects);
    let mut builders = Builders {
        media: Media::new(frame, space, assets, integrator.volumetric),
        textures: TextureBuilder::new(frame, space, assets),
        materials: MaterialBuilder::new(frame, space),
        assets,
        heeds_shadow_masks: matches!(
            integrator.integrator,
            Integrator::Path(_) | Integrator::Direct(_) | Integrator::Sppm(_)
        ),
    };
    let (mut parts, mut origins) = (WorldParts::default(), Origins::default());
    loaded.place(
        frame,
        space,
        &mut builders,
        &mut parts,
        &mut origins,
        diagnostics,
    );
    fit_in_hierarchies(&parts, frame.span, diagnostics)?;
    fit_in_memory(&parts, frame.span, assets, diagnostics)?;
    let Builders {
        mut media,
        textures,
        materials,
        ..
    } = builders;
    parts.camera_medium = match frame.camera.medium {
        Some(medium) => media.id(medium, diagnostics),
        None => MediumId::NONE,
    };
    let mut lights = lights::build(
        frame,
        space,
        assets,
        &mut media,
        &mut parts,
        &integrator.integrator,
        diagnostics,
    );
    let needs_light = !matches!(integrator.integrator, Integrator::AmbientOcclusion(_));
    let ids = parts.order_lights();
    for (light, _) in &mut lights {
        *light = ids[light.index()];
    }
    if parts.lights.is_empty() && needs_light {
        diagnostics.push(
            Diagnostic::warning("no-lights", frame.span, "the scene has no lights")
                .with_help("the picture will be black"),
        );
    }
    let skipped = Skipped {
        textures: textures.skipped(),
        materials: materials.skipped(),
        media: media.skipped(),
        objects: skipped_objects,
    };
    parts.materials = materials.finish(diagnostics);
    parts.textures = textures.finish();
    let kind = frame.integrator.kind.span;
    warn_of_ignored_scattering(integrator, kind, &media, &parts.materials, diagnostics);
    let medium_names;
    (parts.media, medium_names) = media.finish();
    parts.draws_light_in_media = integrator.integrator.asks_within_media();
    Some(Contents {
        parts,
        origins,
        medium_names,
        lights,
        skipped,
    })
}

/// Tells of scattering that the integrator, named at `kind`, leaves out.
fn warn_of_ignored_scattering(
    integrator: &IntegratorOptions,
    kind: Span,
    media: &Media,
    materials: &Materials,
    diagnostics: &mut Diagnostics,
) {
    let mut warn = |what: &str, instead: &str| {
        let message = format!("\"{}\" ignores {what}", integrator.name);
        diagnostics.push(
            Diagnostic::warning("ignored-scattering", kind, message)
                .with_help(format!("{instead} renders it")),
        );
    };
    if media.is_ignored() {
        warn("the media of the scene", "\"volpath\"");
    }
    let spreads_light = matches!(
        integrator.integrator,
        Integrator::Path(_) | Integrator::VolPath(_)
    );
    if !spreads_light && materials.let_light_in() {
        warn(
            "the light that spreads below surfaces",
            "\"path\" or \"volpath\"",
        );
    }
}

/// Tells of opaque surfaces that look different and lie in one place.
fn tell_of_overlaps(world: &World, origins: &Origins, diagnostics: &mut Diagnostics) {
    let pairs = world.overlaps();
    let Some([first, second]) = pairs.first() else {
        return;
    };
    let (Some(first), Some(second)) = (origins.of(*first), origins.of(*second)) else {
        return;
    };
    let message = match pairs.len() {
        1 => "this surface lies in the place of another that looks different".to_owned(),
        n => format!(
            "{n} pairs of surfaces that look different lie in one place; this is in the first"
        ),
    };
    diagnostics.push(
        Diagnostic::warning("surfaces-in-one-place", second, message)
            .with_note(first, "the other")
            .with_help(
                "one of them is seen, whatever their order; move the other, or leave it out",
            ),
    );
}

/// Refuses more shapes than a hierarchy has numbers for.
fn fit_in_hierarchies(
    parts: &WorldParts,
    frame: Span,
    diagnostics: &mut Diagnostics,
) -> Option<()> {
    let (n_items, most) = (parts.items_of_largest_hierarchy(), Bvh::MAX_ITEMS);
    if n_items <= most {
        return Some(());
    }
    let message = format!(
        "{n_items} triangles, other shapes and instances are in one place; {most} are the most"
    );
    diagnostics.push(
        Diagnostic::fatal("too-many-shapes", frame, message)
            .with_label("nothing is rendered")
            .with_help(
                "what is made an object and placed as an instance, twice or more, counts by itself",
            ),
    );
    None
}

/// Memory that an item of a hierarchy takes while that is built: its box, its number, its part of the nodes, and a
/// triangle's corners.
const BYTES_PER_ITEM: u128 = 160;

/// Refuses more shapes than there is memory to build hierarchies of.
fn fit_in_memory(
    parts: &WorldParts,
    frame: Span,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<()> {
    let of_shapes: usize = parts.geometries.iter().map(|g| g.shape.n_elements()).sum();
    let n_items = of_shapes + parts.instances.len();
    let Some(lack) = lack_of_memory(n_items as u128 * BYTES_PER_ITEM, assets) else {
        return Some(());
    };
    let message = format!("a hierarchy of {n_items} triangles, other shapes and instances {lack}");
    diagnostics
        .push(Diagnostic::fatal("too-large", frame, message).with_label("nothing is rendered"));
    None
}

/// The number of rays that a parameter asks for, within bounds.
fn ray_count(p: &mut ParamReader, name: &str) -> u32 {
    let wanted = u32::try_from(p.int(name)).unwrap_or(1).max(1);
    if wanted > MAX_RAYS {
        let message = format!("{wanted} rays from one point are too many: {MAX_RAYS} are sent");
        p.report(
            Diagnostic::warning("many-samples", p.span(name), message)
                .with_help("samples of the pixel find the same light"),
        );
    }
    wanted.min(MAX_RAYS)
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
fn unsupported(what: &str, span: Span, instead: &str) -> Diagnostic {
    Diagnostic::error("unsupported", span, format!("{what} is not supported yet"))
        .with_label(instead)
}

#[cfg(test)]
mod tests {
    use tyndall_parser::source::Sources;

    use super::*;
    use crate::ids::{MaterialId, ObjectId};
    use crate::shape::{Mesh, Shape};
    use crate::world::{Cutout, Geometry};

    #[test]
    fn more_triangles_than_a_hierarchy_has_numbers_for_are_a_located_error() {
        // Memory of zeros that nobody reads costs nothing.
        let triangles = |n| Geometry {
            shape: Shape::Mesh(Mesh {
                triangles: vec![[0; 3]; n],
                ..Mesh::default()
            }),
            material: MaterialId::NONE,
            media: None,
            cutout: Cutout::default(),
            first_light: LightId::NONE,
            object: ObjectId::NONE,
        };
        let span = Span::new(Sources::new().add_text("scene", "WorldBegin"), 0, 10);
        let half = Bvh::MAX_ITEMS / 2;
        let mut parts = WorldParts {
            geometries: vec![triangles(half), triangles(half)],
            n_objects: 1,
            ..WorldParts::default()
        };
        let mut found = Diagnostics::default();
        assert!(fit_in_hierarchies(&parts, span, &mut found).is_some());
        parts.geometries.push(triangles(1));
        assert!(fit_in_hierarchies(&parts, span, &mut found).is_none());
        assert!(found.has_fatal() && found.list[0].span == Some(span));
        // In an object it is alone.
        parts.geometries[2].object = ObjectId::new(0);
        assert!(fit_in_hierarchies(&parts, span, &mut found).is_some());
    }
}
