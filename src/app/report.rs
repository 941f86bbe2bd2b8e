//! The facts of a run, for machines (`--json`) and for people (`--verbose`). `docs/cli.md` describes every field.

use serde::Serialize;
use tyndall_parser::diagnostic::{Counts, Diagnostic, Severity};
use tyndall_parser::source::{Location, Sources, Span};

use super::outcome::Outcome;
use crate::compile::{Compiled, Skipped};
use crate::render::RenderReport;

/// Version of the report: raised when a field is removed or changes its meaning, not when one is added.
const SCHEMA: u32 = 1;

/// A run.
#[derive(Serialize, Debug)]
pub(super) struct Report {
    schema: u32,
    version: &'static str,
    pub(super) scenes: Vec<String>,
    pub(super) task: &'static str,
    pub(super) outcome: Outcome,
    pub(super) exit_code: u8,
    pub(super) threads: usize,
    pub(super) seconds: Seconds,
    pub(super) peak_memory_bytes: Option<u64>,
    pub(super) counts: FindingCounts,
    pub(super) findings: Vec<Finding>,
    pub(super) pictures: Vec<PictureReport>,
}

/// Where the time of a run went.
#[derive(Serialize, Debug, Default)]
pub(super) struct Seconds {
    pub(super) wall: f64,
    /// Of all threads.
    pub(super) cpu: Option<f64>,
    /// Reading scene files and following their directives.
    pub(super) parse: f64,
    /// This and the following are sums over the pictures.
    pub(super) compile: f64,
    pub(super) render: f64,
    pub(super) write: f64,
}

/// How many findings there are.
#[derive(Serialize, Clone, Copy, Debug, Default)]
pub(super) struct FindingCounts {
    pub(super) fatal: usize,
    pub(super) errors: usize,
    pub(super) warnings: usize,
}

/// A diagnostic.
#[derive(Serialize, Debug)]
pub(super) struct Finding {
    severity: &'static str,
    code: &'static str,
    message: String,
    label: Option<String>,
    help: Option<String>,
    #[serde(flatten)]
    place: Option<Position>,
    notes: Vec<FindingNote>,
}

#[derive(Serialize, Debug)]
struct FindingNote {
    message: String,
    #[serde(flatten)]
    place: Position,
}

#[derive(Serialize, Debug)]
struct Position {
    file: String,
    line: usize,
    column: usize,
}

/// One picture of a run.
#[derive(Serialize, Debug, Default)]
pub(super) struct PictureReport {
    pub(super) outcome: Outcome,
    /// The file that was written.
    pub(super) file: Option<String>,
    /// Pictures of single strategies that were written beside it.
    pub(super) strategy_files: Vec<String>,
    pub(super) seconds: PictureSeconds,
    /// Absent if the scene could not be built.
    pub(super) job: Option<JobReport>,
    /// Absent if rendering did not start.
    pub(super) render: Option<RenderFacts>,
}

/// Where the time of a picture went.
#[derive(Serialize, Clone, Copy, Debug, Default)]
pub(super) struct PictureSeconds {
    pub(super) compile: f64,
    pub(super) render: f64,
    pub(super) write: f64,
}

/// What is to be rendered.
#[derive(Serialize, Debug)]
pub(super) struct JobReport {
    /// Width and height of the full frame.
    resolution: [usize; 2],
    /// Pixels of the picture: x0, x1, y0, y1.
    crop: [i64; 4],
    spp: u32,
    seed: u64,
    integrator: &'static str,
    /// Surfaces in the hierarchy, triangles counted one by one.
    elements: usize,
    has_media: bool,
    has_null_surfaces: bool,
    /// How much the picture does not need.
    skipped: SkippedReport<usize>,
    /// What that is.
    skipped_names: SkippedReport<Vec<String>>,
}

/// What nothing in the picture leads to.
#[derive(Serialize, Debug)]
struct SkippedReport<T> {
    textures: T,
    materials: T,
    media: T,
    objects: T,
}

/// Most names of one sort that are shown to people.
const MAX_NAMES: usize = 8;

/// What happened during rendering.
#[derive(Serialize, Debug)]
pub(super) struct RenderFacts {
    interrupted: bool,
    samples: u64,
    samples_per_second: f64,
    rays: u64,
    shadow_rays: u64,
    medium_scatterings: u64,
    stuck_paths: u64,
    stuck_shadow_rays: u64,
    leaked_paths: u64,
    mismatched_media: u64,
    one_sided_media: u64,
    bad_samples: u64,
    first_bad_sample: Option<BadSample>,
}

#[derive(Serialize, Debug)]
struct BadSample {
    pixel: [i32; 2],
    sample: u32,
}

impl Report {
    /// Nothing done yet.
    pub(super) fn new(task: &'static str) -> Self {
        Self {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            scenes: Vec::new(),
            task,
            outcome: Outcome::Complete,
            exit_code: 0,
            threads: 0,
            seconds: Seconds::default(),
            peak_memory_bytes: None,
            counts: FindingCounts::default(),
            findings: Vec::new(),
            pictures: Vec::new(),
        }
    }
}

impl FindingCounts {
    /// Adds the findings of one more phase.
    pub(super) fn add(&mut self, counts: Counts) {
        self.fatal += counts.fatal;
        self.errors += counts.errors;
        self.warnings += counts.warnings;
    }
}

impl Finding {
    /// With places as people count them.
    pub(super) fn new(diagnostic: &Diagnostic, sources: &Sources) -> Self {
        let notes = diagnostic.notes.iter().map(|(span, message)| FindingNote {
            message: message.clone(),
            place: Position::new(*span, sources),
        });
        Self {
            severity: match diagnostic.severity {
                Severity::Warning => "warning",
                Severity::Error => "error",
                Severity::Fatal => "fatal",
            },
            code: diagnostic.code,
            message: diagnostic.message.clone(),
            label: Some(diagnostic.label.clone()).filter(|label| !label.is_empty()),
            help: diagnostic.help.clone(),
            place: diagnostic.span.map(|span| Position::new(span, sources)),
            notes: notes.collect(),
        }
    }
}

impl Position {
    fn new(span: Span, sources: &Sources) -> Self {
        let Location { line, column } = sources.location(span);
        Self {
            file: sources.name(span.file).to_owned(),
            line,
            column,
        }
    }
}

impl JobReport {
    /// What a compiled scene will do.
    pub(super) fn new(compiled: &Compiled) -> Self {
        let (job, crop) = (&compiled.job, compiled.job.film.crop);
        let Skipped {
            textures,
            materials,
            media,
            objects,
        } = compiled.skipped.clone();
        let range =
            |start: i32, length: usize| [i64::from(start), i64::from(start) + length as i64];
        let ([x0, x1], [y0, y1]) = (range(crop.x0, crop.width), range(crop.y0, crop.height));
        Self {
            resolution: [compiled.frame.width, compiled.frame.height],
            crop: [x0, x1, y0, y1],
            spp: job.spp,
            seed: job.seed,
            integrator: compiled.integrator,
            elements: job.world.n_elements(),
            has_media: job.world.facts().has_media,
            has_null_surfaces: job.world.facts().has_null_surfaces,
            skipped: SkippedReport {
                textures: textures.len(),
                materials: materials.len(),
                media: media.len(),
                objects: objects.len(),
            },
            skipped_names: SkippedReport {
                textures,
                materials,
                media,
                objects,
            },
        }
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        let [x0, x1, y0, y1] = self.crop;
        let [width, height] = self.resolution;
        let media = match (self.has_media, self.has_null_surfaces) {
            (true, _) => "with media",
            (false, true) => "with null surfaces",
            (false, false) => "no media",
        };
        let SkippedReport {
            textures,
            materials,
            media: n_media,
            objects,
        } = self.skipped;
        let names = &self.skipped_names;
        let names = [
            ("textures", &names.textures),
            ("materials", &names.materials),
            ("media", &names.media),
            ("objects", &names.objects),
        ];
        let listed = |(what, names): (&str, &Vec<String>)| {
            let shown = names.iter().take(MAX_NAMES);
            let mut shown: Vec<String> = shown.map(|name| format!("\"{name}\"")).collect();
            if names.len() > MAX_NAMES {
                shown.push(format!("and {} more", names.len() - MAX_NAMES));
            }
            format!("\n             {what} {}", shown.join(", "))
        };
        let skipped = names.into_iter().filter(|(_, names)| !names.is_empty());
        let skipped: String = skipped.map(listed).collect();
        format!(
            "  frame      {width} x {height} pixels, of which x {x0} to {x1}, y {y0} to {y1}\n  \
               sampling   {} samples per pixel, seed {}, integrator \"{}\"\n  \
               world      {} surface elements, {media}\n  \
               unused     {textures} textures, {materials} materials, {n_media} media, {objects} objects{skipped}",
            self.spp, self.seed, self.integrator, self.elements,
        )
    }
}

impl RenderFacts {
    /// What a rendering of this many seconds reports.
    pub(super) fn new(report: &RenderReport, seconds: f64) -> Self {
        let counters = &report.counters;
        Self {
            interrupted: report.cancelled,
            samples: report.samples,
            samples_per_second: if seconds > 0.0 {
                report.samples as f64 / seconds
            } else {
                0.0
            },
            rays: counters.rays,
            shadow_rays: counters.shadow.rays,
            medium_scatterings: counters.medium_scatterings,
            stuck_paths: counters.stuck_paths,
            stuck_shadow_rays: counters.shadow.stuck,
            leaked_paths: counters.leaked_paths,
            mismatched_media: counters.mismatched(),
            one_sided_media: counters.one_sided,
            bad_samples: report.bad_samples,
            first_bad_sample: report
                .first_bad_sample
                .map(|(pixel, sample)| BadSample { pixel, sample }),
        }
    }

    /// For people.
    pub(super) fn text(&self) -> String {
        format!(
            "  samples    {} ({:.0} per second), of which bad {}\n  \
               rays       {} for surfaces, {} for light\n  \
               events     {} scatterings in media, {} paths and {} shadow rays given up, {} paths leaked\n  \
               media      {} boundaries crossed from a medium they do not border on",
            self.samples,
            self.samples_per_second,
            self.bad_samples,
            self.rays,
            self.shadow_rays,
            self.medium_scatterings,
            self.stuck_paths,
            self.stuck_shadow_rays,
            self.leaked_paths,
            self.mismatched_media,
        )
    }
}

impl Seconds {
    /// For people.
    pub(super) fn text(&self, peak_memory_bytes: Option<u64>) -> String {
        let mut text = format!(
            "  time       {:.3} s: parse {:.3}, compile {:.3}, render {:.3}, write {:.3}",
            self.wall, self.parse, self.compile, self.render, self.write
        );
        if let (Some(cpu), Some(bytes)) = (self.cpu, peak_memory_bytes) {
            let mebibytes = bytes as f64 / f64::from(1 << 20);
            text += &format!("\n  used       {cpu:.3} s of processors, at most {mebibytes:.1} MiB");
        }
        text
    }
}
