//! The options block: film, filter, samples, integrator. The camera has a file of its own.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics, Severity};
use tyndall_parser::schema::Family;

use crate::compile::reader::ParamReader;
use crate::compile::{CompileOptions, lookup, ray_count};
use crate::describe::description::Frame;
use crate::film::{Film, FilmDesc, Filter, FilterTable};
use crate::image::PixelRect;
use crate::integrator::bdpt::Visualized;
use crate::integrator::{
    AmbientOcclusion, Bdpt, Direct, Integrator, LightSampling, Mlt, Path, Sppm,
};
use crate::sampler::SamplerKind;
use crate::world::LightStrategy;

/// The finding that a crop window of [`CompileOptions`] holds no pixel: a fault of who asked for it.
pub const EMPTY_CROP_WINDOW: &str = "empty-cropwindow";

/// A quick look divides the resolution by this.
const QUICK_DIVISOR: i32 = 4;
/// And the iterations of photon mapping by this.
const QUICK_ITERATIONS: u32 = 16;
/// Longest side of the full frame: crop windows are cut in single precision, which counts no further.
const MAX_SIDE: u32 = 1 << 24;
/// Most pixels of a picture.
const MAX_PIXELS: usize = 1 << 30;
/// Largest radius of a filter, in pixels: every block of pixels carries a border of this width.
const MAX_FILTER_RADIUS: f64 = 256.0;
/// Most bootstrap paths of all lengths.
const MAX_BOOTSTRAP: u64 = 1 << 26;
/// Most scattering events where single strategies are shown.
const MAX_VISUALIZED_DEPTH: u32 = 5;

pub(super) struct FilmOptions {
    pub(super) desc: FilmDesc,
    /// Size of the sensor in mm.
    pub(super) diagonal: f64,
    pub(super) filename: String,
    pub(super) frame: PixelRect,
}

pub(super) fn film(
    frame: &Frame,
    options: &CompileOptions,
    diagnostics: &mut Diagnostics,
) -> Option<FilmOptions> {
    let filter = filter(frame, diagnostics);
    let plugin = lookup(
        Family::Film,
        &frame.film.kind,
        "nothing is rendered",
        diagnostics,
    )?;
    let mut p = ParamReader::new(plugin, &frame.film, diagnostics);
    let mut resolution = [p.int("xresolution"), p.int("yresolution")];
    if options.quick {
        resolution = resolution.map(|r| (r / QUICK_DIVISOR).max(1));
    }
    let resolution = resolution.map(|r| u32::try_from(r).unwrap_or(0));
    let own_window = p.floats::<4>("cropwindow");
    // The scene is innocent of a window that it does not have.
    let is_asked_for = own_window.is_none() && options.crop_window.is_some();
    let window = own_window
        .or(options.crop_window)
        .unwrap_or([0.0, 1.0, 0.0, 1.0]);
    let crop = crop(window, resolution);
    let scale = p.float("scale") as f64;
    let max_sample_luminance = p
        .optional_float("maxsampleluminance")
        .unwrap_or(f32::INFINITY);
    let filename = p.string("filename");
    let diagonal = f64::from(p.float("diagonal"));
    let (window_span, resolution_span) = (p.span("cropwindow"), p.span("xresolution"));
    p.finish();
    let n_pixels = crop.width.saturating_mul(crop.height);
    if n_pixels > MAX_PIXELS || resolution.iter().any(|&side| side > MAX_SIDE) {
        let [width, height] = resolution;
        let gigabytes = n_pixels as f64 * Film::BYTES_PER_PIXEL as f64 / 1e9;
        let message = format!(
            "a frame of {width} x {height} pixels is too large: it would take {gigabytes:.0} GB"
        );
        diagnostics.push(
            Diagnostic::fatal("too-many-pixels", resolution_span, message)
                .with_label("nothing is rendered")
                .with_help("render crop windows one by one and assemble them"),
        );
        return None;
    }
    if resolution.contains(&0) || crop.width == 0 || crop.height == 0 {
        if is_asked_for && !resolution.contains(&0) {
            let [width, height] = resolution;
            let message = format!(
                "the crop window that is asked for holds no pixel of a frame of {width} x {height}"
            );
            diagnostics.push(Diagnostic::new(
                Severity::Fatal,
                EMPTY_CROP_WINDOW,
                None,
                message,
            ));
            return None;
        }
        let message = "the picture has no pixels";
        diagnostics.push(Diagnostic::fatal("no-pixels", window_span, message));
        return None;
    }
    let desc = FilmDesc {
        resolution,
        crop,
        filter: filter?,
        scale,
        max_sample_luminance,
    };
    let frame = PixelRect::from_size(resolution[0] as usize, resolution[1] as usize);
    Some(FilmOptions {
        desc,
        diagonal,
        filename,
        frame,
    })
}

/// Pixels of a crop window: ⌈resolution · fraction⌉ at both ends, in single precision as pbrt-v3 rounds it.
fn crop(window: [f32; 4], resolution: [u32; 2]) -> PixelRect {
    let range = |a: f32, b: f32, n: u32| {
        let pixel = |x: f32| (n as f32 * x.clamp(0.0, 1.0)).ceil() as i32;
        let (lo, hi) = (pixel(a.min(b)), pixel(a.max(b)));
        (lo, (hi - lo).max(0) as usize)
    };
    let (x0, width) = range(window[0], window[1], resolution[0]);
    let (y0, height) = range(window[2], window[3], resolution[1]);
    PixelRect {
        x0,
        y0,
        width,
        height,
    }
}

fn filter(frame: &Frame, diagnostics: &mut Diagnostics) -> Option<FilterTable> {
    let plugin = lookup(
        Family::Filter,
        &frame.filter.kind,
        "nothing is rendered",
        diagnostics,
    )?;
    let mut p = ParamReader::new(plugin, &frame.filter, diagnostics);
    let radius = [p.float("xwidth"), p.float("ywidth")].map(f64::from);
    let filter = match plugin.schema.name {
        "box" => Filter::Box,
        "triangle" => Filter::Triangle,
        "gaussian" => Filter::Gaussian {
            alpha: p.float("alpha") as f64,
        },
        "mitchell" => Filter::Mitchell {
            b: p.float("B") as f64,
            c: p.float("C") as f64,
        },
        _ => Filter::Sinc {
            tau: p.float("tau") as f64,
        },
    };
    let span = p.span("xwidth");
    p.finish();
    if radius.iter().any(|&r| r > MAX_FILTER_RADIUS) {
        let message = format!("a filter may reach {MAX_FILTER_RADIUS} pixels far, not more");
        diagnostics.push(
            Diagnostic::fatal("wide-filter", span, message).with_label("nothing is rendered"),
        );
        return None;
    }
    Some(FilterTable::new(filter, radius))
}

pub(super) struct SampleOptions {
    pub(super) spp: u32,
    pub(super) pixel_centers: bool,
    pub(super) sampler: SamplerKind,
}

/// Kind and count of samples. The count may be overridden: a grid then has as many cells as samples, or a few more.
pub(super) fn samples(
    frame: &Frame,
    options: &CompileOptions,
    diagnostics: &mut Diagnostics,
) -> Option<SampleOptions> {
    let plugin = lookup(
        Family::Sampler,
        &frame.sampler.kind,
        "nothing is rendered",
        diagnostics,
    )?;
    let mut p = ParamReader::new(plugin, &frame.sampler, diagnostics);
    let name = plugin.schema.name;
    let pixel_centers = name == "halton" && p.bool("samplepixelcenter");
    let at_least_1 = |n: i32| u32::try_from(n).unwrap_or(1).max(1);
    let (cells, jitter, mut spp) = if name == "stratified" {
        let [x, y] = ["xsamples", "ysamples"].map(|side| p.int(side));
        let cells = [x, y].map(at_least_1);
        if x.checked_mul(y).is_none() {
            let span = p.span("xsamples");
            let message = format!("{x} by {y} samples are too many: {} are taken", i32::MAX);
            p.report(Diagnostic::warning("many-samples", span, message));
        }
        (cells, p.bool("jitter"), at_least_1(x.saturating_mul(y)))
    } else {
        ([1; 2], true, at_least_1(p.int("pixelsamples")))
    };
    if matches!(name, "sobol" | "lowdiscrepancy" | "maxmindist") && !spp.is_power_of_two() {
        let rounded = spp.checked_next_power_of_two().unwrap_or(1 << 31);
        let span = p.span("pixelsamples");
        let message = format!("\"{name}\" takes powers of two: {spp} is rounded up to {rounded}");
        p.report(Diagnostic::warning("rounded-samples", span, message));
        spp = rounded;
    }
    p.finish();
    if options.quick && name != "random" {
        spp = 1;
    }
    let spp = options.spp.unwrap_or(spp).max(1);
    let sampler = match name {
        // Strata of powers of two are filled by points of base 2: Halton's had up to 2.8 times their squared error then.
        "halton" if !spp.is_power_of_two() => SamplerKind::Halton,
        "halton" | "sobol" => SamplerKind::Sobol,
        "maxmindist" => SamplerKind::max_min_dist(spp),
        "random" => SamplerKind::Random,
        "stratified" if cells[0].checked_mul(cells[1]) == Some(spp) => SamplerKind::Stratified {
            nx: cells[0],
            ny: cells[1],
            jitter,
        },
        "stratified" => SamplerKind::grid(spp, jitter),
        _ => SamplerKind::ZeroTwo,
    };
    Some(SampleOptions {
        spp,
        pixel_centers,
        sampler,
    })
}

pub(super) struct IntegratorOptions {
    pub(super) integrator: Integrator,
    pub(super) name: &'static str,
    pub(super) volumetric: bool,
    pub(super) light_strategy: LightStrategy,
    pub(super) pixel_bounds: Option<PixelRect>,
    /// Samples per pixel, where the integrator knows better than the sampler.
    pub(super) spp: Option<u32>,
}

impl IntegratorOptions {
    /// The integrator with its lengths in render space; `scale` is the length of one world unit there.
    pub(super) fn integrator_at(&self, scale: f64) -> Integrator {
        match self.integrator {
            Integrator::Sppm(sppm) => Integrator::Sppm(Sppm {
                radius: (f64::from(sppm.radius) * scale) as f32,
                ..sppm
            }),
            integrator => integrator,
        }
    }
}

pub(super) fn integrator(
    frame: &Frame,
    options: &CompileOptions,
    diagnostics: &mut Diagnostics,
) -> Option<IntegratorOptions> {
    let kind = &frame.integrator.kind;
    let plugin = lookup(Family::Integrator, kind, "nothing is rendered", diagnostics)?;
    let name = plugin.schema.name;
    if name == "sppm" {
        let p = ParamReader::new(plugin, &frame.integrator, diagnostics);
        return Some(photon_mapping(name, p, options));
    }
    let mut p = ParamReader::new(plugin, &frame.integrator, diagnostics);
    if name == "mlt" {
        let integrator = Integrator::Mlt(metropolis(&mut p));
        p.finish();
        return Some(IntegratorOptions {
            integrator,
            name,
            volumetric: true,
            light_strategy: LightStrategy::Power,
            pixel_bounds: None,
            spp: None,
        });
    }
    let count = |n: i32| u32::try_from(n).unwrap_or(0);
    let mut light_strategy = LightStrategy::Spatial;
    let integrator = match name {
        "whitted" => Integrator::Direct(Direct {
            max_depth: count(p.int("maxdepth")),
            lights: LightSampling::Each,
        }),
        "directlighting" => Integrator::Direct(Direct {
            max_depth: count(p.int("maxdepth")),
            lights: match p.choice("strategy") {
                "one" => LightSampling::One,
                _ => LightSampling::All,
            },
        }),
        "ambientocclusion" => Integrator::AmbientOcclusion(AmbientOcclusion {
            n_samples: ray_count(&mut p, "nsamples"),
            by_cosine: p.bool("cossample"),
        }),
        _ => {
            light_strategy = match p.choice("lightsamplestrategy") {
                "uniform" => LightStrategy::Uniform,
                "power" => LightStrategy::Power,
                _ => LightStrategy::Spatial,
            };
            let max_depth = count(p.int("maxdepth"));
            match name {
                "bdpt" => Integrator::Bdpt(bidirectional(&mut p, max_depth, light_strategy)),
                "volpath" => Integrator::VolPath(path(&mut p, max_depth)),
                _ => Integrator::Path(path(&mut p, max_depth)),
            }
        }
    };
    let pixel_bounds = p.ints::<4>("pixelbounds").map(|[x0, x1, y0, y1]| {
        let length = |a: i32, b: i32| usize::try_from(b as i64 - a as i64).unwrap_or(0);
        PixelRect {
            x0,
            y0,
            width: length(x0, x1),
            height: length(y0, y1),
        }
    });
    p.finish();
    Some(IntegratorOptions {
        volumetric: matches!(integrator, Integrator::VolPath(_) | Integrator::Bdpt(_)),
        integrator,
        name,
        light_strategy,
        pixel_bounds,
        spp: None,
    })
}

fn path(p: &mut ParamReader, max_depth: u32) -> Path {
    Path {
        max_depth,
        rr_threshold: p.float("rrthreshold"),
    }
}

fn bidirectional(p: &mut ParamReader, max_depth: u32, light_strategy: LightStrategy) -> Bdpt {
    let names = ["visualizestrategies", "visualizeweights"];
    // Of both, pbrt-v3 shows the latter.
    let visualized = match names.map(|name| p.bool(name)) {
        [_, true] => Some((Visualized::Weights, p.span(names[1]))),
        [true, false] => Some((Visualized::Strategies, p.span(names[0]))),
        [false, false] => None,
    };
    let mut bdpt = Bdpt {
        max_depth,
        light_strategy,
        visualized: visualized.map(|(shown, _)| shown),
    };
    if let Some((_, span)) = visualized
        && max_depth > MAX_VISUALIZED_DEPTH
    {
        bdpt.max_depth = MAX_VISUALIZED_DEPTH;
        let message = format!(
            "strategies are shown up to \"maxdepth\" {MAX_VISUALIZED_DEPTH}: {max_depth} is lowered"
        );
        p.report(Diagnostic::warning("lowered-depth", span, message));
    }
    bdpt
}

/// Stochastic progressive photon mapping, whose iterations are its samples per pixel.
fn photon_mapping(
    name: &'static str,
    mut p: ParamReader,
    options: &CompileOptions,
) -> IntegratorOptions {
    let mut iterations = u32::try_from(p.int("iterations")).unwrap_or(1).max(1);
    if options.quick {
        iterations = (iterations / QUICK_ITERATIONS).max(1);
    }
    let sppm = Sppm {
        max_depth: u32::try_from(p.int("maxdepth")).unwrap_or(0),
        photons_per_iteration: u32::try_from(p.int("photonsperiteration"))
            .ok()
            .filter(|&n| n > 0),
        radius: p.float("radius"),
    };
    if p.optional_int("imagewritefrequency")
        .is_some_and(|every| every.unsigned_abs() < iterations)
    {
        let span = p.span("imagewritefrequency");
        let message = "intermediate pictures are not written";
        p.report(
            Diagnostic::warning("one-picture", span, message)
                .with_help("the picture is written once, after the last iteration"),
        );
    }
    p.finish();
    IntegratorOptions {
        integrator: Integrator::Sppm(sppm),
        name,
        volumetric: false,
        light_strategy: LightStrategy::Spatial,
        pixel_bounds: None,
        spp: Some(options.spp.unwrap_or(iterations).max(1)),
    }
}

/// Metropolis light transport.
fn metropolis(p: &mut ParamReader) -> Mlt {
    let max_depth = u32::try_from(p.int("maxdepth")).unwrap_or(0);
    let wanted = u32::try_from(p.int("bootstrapsamples")).unwrap_or(1);
    // A bootstrap path of each length is kept.
    let most = (MAX_BOOTSTRAP / (u64::from(max_depth) + 1)).max(1) as u32;
    let mut settings = Mlt {
        max_depth: max_depth.min(MAX_BOOTSTRAP as u32 - 1),
        n_bootstrap: wanted.min(most),
        n_chains: u32::try_from(p.int("chains")).unwrap_or(1),
        mutations_per_pixel: u32::try_from(p.int("mutationsperpixel")).unwrap_or(1),
        large_step: p.float("largestepprobability"),
        sigma: p.float("sigma"),
    };
    settings.n_bootstrap = settings.n_bootstrap.max(1);
    if settings.n_bootstrap < wanted {
        let span = p.span("bootstrapsamples");
        let message = format!(
            "{wanted} bootstrap paths of each length are too many: {} are followed",
            settings.n_bootstrap
        );
        p.report(Diagnostic::warning("many-bootstrap-samples", span, message));
    }
    settings
}

/// One hierarchy serves all accelerators; their parameters are checked and have no effect.
pub(super) fn accelerator(frame: &Frame, diagnostics: &mut Diagnostics) {
    let entity = &frame.accelerator;
    if let Some(plugin) = lookup(
        Family::Accelerator,
        &entity.kind,
        "\"bvh\" is used",
        diagnostics,
    ) {
        ParamReader::new(plugin, entity, diagnostics).finish();
    }
}
