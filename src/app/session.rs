//! A run from files to pictures. Phase by phase, and picture by picture: a world is dropped before the next is built.
//! What happens to a picture once it is built is in `picture`.

mod picture;

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::MutexGuard;
use std::time::Instant;

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics, Severity};
use tyndall_parser::directive::Directive;
use tyndall_parser::params::{ParamClass, ParamValue};
use tyndall_parser::source::{Sources, Span, Spanned};
use tyndall_parser::{FileId, SceneFile};

use super::console::{self, Console};
use super::files::{Files, are_one};
use super::interrupt::Interrupt;
use super::outcome::Outcome;
use super::output::{Output, Place};
use super::plan::{Destination, Input, Plan, Task};
use super::report::{Finding, FindingCounts, JobReport, PictureReport, Report};
use super::{Ending, resources};
use crate::compile::{Compiled, EMPTY_CROP_WINDOW, compile};
use crate::describe::Builder;
use crate::describe::description::Frame;
use crate::image::codec::{Attribute, Precision};
use crate::integrator::bdpt::Strategy;

/// Bytes that a pixel takes while it is encoded.
const ENCODED_BYTES_PER_PIXEL: u128 = 12;
/// Directives between two looks at the memory that is left.
const MANY_DIRECTIVES: u64 = 1 << 12;
/// Address space that a thread takes to start: its stack, and some for what it does first.
const THREAD_ROOM: usize = 9 << 18;
/// Threads that are asked about at most: they should all be short of room only where there is hardly any.
const MANY_THREADS: usize = 64;

/// A run in progress.
pub(super) struct Session<'a> {
    plan: &'a Plan,
    console: &'a mut Console,
    interrupt: &'a Interrupt,
    files: Files,
    sources: Sources,
    /// With the report, which a signal may end at any moment.
    ending: &'a Ending,
    /// Findings about other scenes, checked before this one.
    counts_before: FindingCounts,
    /// Whether the directives themselves had errors, which no single picture can be blamed for.
    is_substituted: bool,
    has_threads: bool,
    /// Files that earlier pictures went to.
    taken: HashSet<PathBuf>,
}

/// A picture ready to be rendered.
struct Picture {
    compiled: Compiled,
    /// `None` if it is only checked.
    output: Option<Outputs>,
    report: PictureReport,
}

/// Where a picture goes, and those of single strategies beside it.
struct Outputs {
    picture: Output,
    strategies: Vec<Output>,
}

/// Why nothing more can be done. It is reported already.
struct Stop;

impl<'a> Session<'a> {
    /// Nothing done yet.
    pub(super) fn new(
        plan: &'a Plan,
        console: &'a mut Console,
        interrupt: &'a Interrupt,
        ending: &'a Ending,
    ) -> Self {
        Self {
            plan,
            console,
            interrupt,
            files: Files::within(plan.bounds.clone(), ending.inputs.clone(), plan.max_memory),
            sources: Sources::new(),
            ending,
            counts_before: FindingCounts::default(),
            is_substituted: false,
            has_threads: false,
            taken: HashSet::new(),
        }
    }

    /// Does it all. The report's totals are left to the caller.
    pub(super) fn run(mut self) {
        let plan = self.plan;
        if plan.task != Task::Check {
            let done = self.work(&plan.inputs);
            return self.close(done);
        }
        for input in &plan.inputs {
            self.counts_before = self.report().counts;
            let done = self.work(std::slice::from_ref(input));
            self.close(done);
        }
    }

    fn close(&self, done: Result<(), Stop>) {
        if let Err(Stop) = done {
            self.raise(Outcome::Failed);
        }
    }

    fn report(&self) -> MutexGuard<'a, Report> {
        self.ending.report()
    }

    /// Does what is to be done with a scene, be it in several files.
    fn work(&mut self, inputs: &[Input]) -> Result<(), Stop> {
        if let (Task::Render, Some(outfile)) = (self.plan.task, &self.plan.outfile) {
            // Known before anything is read, so tried before anything is read.
            let place = Place::within(outfile, &self.plan.bounds);
            place.map_err(|why| self.stop("unwritable-output", None, why))?;
        }
        let roots = self.open(inputs)?;
        if self.plan.task == Task::Cat {
            let scene = self.parse(&roots);
            return self.cat(&scene);
        }
        let frames = self.describe(&roots)?;
        if frames.is_empty() {
            return Err(Stop);
        }
        self.start_threads()?;
        self.is_substituted = self.report().counts.errors > self.counts_before.errors;
        if self.plan.strict {
            // A finding in the last picture forbids the first.
            let mut pictures = Vec::new();
            for frame in frames {
                pictures.extend(self.compile(frame));
            }
            if self.report().outcome > Outcome::Complete {
                return Err(Stop);
            }
            for picture in pictures {
                self.finish(picture);
            }
        } else {
            for frame in frames {
                if self.interrupt.is_wanted() {
                    // The signal came while an earlier picture was rendered or written.
                    self.raise(Outcome::Interrupted);
                    break;
                }
                if let Some(picture) = self.compile(frame) {
                    self.finish(picture);
                }
            }
        }
        Ok(())
    }

    fn open(&mut self, inputs: &[Input]) -> Result<Vec<FileId>, Stop> {
        let mut roots = Vec::new();
        for input in inputs {
            if *input == Input::Stdin && console::stdin_is_terminal() {
                self.console.note("reading the scene from standard input");
            }
            let opened = self.files.open(input, &mut self.sources);
            let root = opened.map_err(|why| self.stop("unreadable-file", None, why))?;
            let name = self.sources.name(root).to_owned();
            self.report().scenes.push(name);
            roots.push(root);
        }
        Ok(roots)
    }

    fn parse(&mut self, roots: &[FileId]) -> SceneFile {
        let start = Instant::now();
        let (scene, found) = tyndall_parser::parse_all(&mut self.sources, roots, &self.files);
        self.report().seconds.parse += seconds_since(start);
        self.judge(found);
        scene
    }

    /// Follows directives as they are parsed.
    fn describe(&mut self, roots: &[FileId]) -> Result<Vec<Frame>, Stop> {
        let start = Instant::now();
        let mut builder = Builder::default();
        let mut named = HashSet::new();
        let (mut n_directives, mut exhausted) = (0_u64, None);
        let take = &mut |directive: Spanned<Directive>| {
            // Most directives name nothing.
            for name in names(&directive) {
                named.insert((name.clone(), directive.span.file));
            }
            n_directives += 1;
            if n_directives % MANY_DIRECTIVES == 0
                && exhausted.is_none()
                && self.files.is_exhausted()
            {
                exhausted = Some(directive.span);
            }
            // What nobody will render takes no more memory.
            if exhausted.is_none() {
                builder.directive(directive);
            }
        };
        let misread = tyndall_parser::parse_each(&mut self.sources, roots, &self.files, take);
        let (description, found) = builder.finish();
        if description.frames.len() > 1 {
            // What a later picture reads, an earlier one may not be written over.
            for (name, file) in &named {
                let top_level = self.sources.name(self.sources.top_level(*file));
                self.files.expect(name, top_level);
            }
        }
        self.report().seconds.parse += seconds_since(start);
        self.judge(misread);
        if exhausted.is_some() {
            let why = "what the scene says up to here takes all the memory that there is";
            return Err(self.stop("too-large", exhausted, why.to_owned()));
        }
        // Findings about what was not understood would mislead.
        self.go_on()?;
        self.judge(found);
        self.go_on()?;
        Ok(description.frames)
    }

    fn cat(&mut self, scene: &SceneFile) -> Result<(), Stop> {
        let spared = self.ending.inputs.spare_stdout();
        spared
            .and_then(|()| console::print(&tyndall_parser::print(scene)))
            .map_err(|why| self.stop("unwritable-output", None, why))
    }

    fn start_threads(&mut self) -> Result<(), Stop> {
        if std::mem::replace(&mut self.has_threads, true) {
            return Ok(());
        }
        let n_threads = match self.plan.n_threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            n_threads => n_threads,
        };
        let stop = |this: &mut Self, error: &dyn std::fmt::Display| {
            let why = format!("cannot start {n_threads} threads: {error}");
            this.stop("no-threads", None, why)
        };
        // A thread that starts, and then finds no memory to begin with, panics where nobody can catch it.
        let mut room: Vec<u8> = Vec::new();
        room.try_reserve_exact(n_threads.min(MANY_THREADS) * THREAD_ROOM)
            .map_err(|error| stop(self, &error))?;
        drop(std::hint::black_box(room));
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.plan.n_threads);
        // The global pool: whatever asks for threads gets these.
        pool.build_global().map_err(|error| stop(self, &error))?;
        self.report().threads = rayon::current_num_threads();
        Ok(())
    }

    /// Builds a picture and makes sure that it can be rendered and written. `None` if not; the report then says so.
    fn compile(&mut self, frame: Frame) -> Option<Picture> {
        let film = frame.film.span;
        let given = |name, class| {
            let param = frame.film.params.get(name, class);
            param.map(|param| param.value_span)
        };
        let film_filename = given("filename", ParamClass::String);
        let film_window = given("cropwindow", ParamClass::Float);
        let start = Instant::now();
        let assets = self.files.assets(&self.sources);
        let (compiled, found) = compile(frame, &self.plan.compile, &assets);
        let mut report = PictureReport::default();
        report.seconds.compile = seconds_since(start);
        self.report().seconds.compile += report.seconds.compile;
        drop(assets);
        let (is_fatal, has_errors) = (found.has_fatal(), found.has_errors());
        let asks_for_nothing = found
            .iter()
            .any(|finding| finding.code == EMPTY_CROP_WINDOW);
        self.judge(found);
        // Now that all that is read is known, and before anything is rendered.
        if let Err(why) = self.ending.spares_inputs() {
            self.stop("unwritable-output", None, why);
            report.outcome = Outcome::Failed;
            self.add(report);
            return None;
        }
        if let (Some(_), Some(span)) = (self.plan.compile.crop_window, film_window) {
            let message = "--cropwindow gives way to the film's cropwindow";
            self.tell(Diagnostic::warning("cropwindow-overridden", span, message));
        }
        if has_errors || self.is_substituted {
            report.outcome = Outcome::Substituted;
        }
        let picture = compiled.filter(|_| !is_fatal).and_then(|compiled| {
            report.job = Some(JobReport::new(&compiled));
            self.fit_in_memory(&compiled, film).ok()?;
            let output = match self.plan.task {
                Task::Render => Some(self.outputs(&compiled, film, film_filename).ok()?),
                Task::Check | Task::Cat | Task::Trace { .. } => None,
            };
            Some((compiled, output))
        });
        let Some((compiled, output)) = picture else {
            report.outcome = if asks_for_nothing {
                Outcome::Usage
            } else {
                Outcome::Failed
            };
            self.add(report);
            return None;
        };
        Some(Picture {
            compiled,
            output,
            report,
        })
    }

    /// Refuses pictures that no swap space would save.
    fn fit_in_memory(&mut self, compiled: &Compiled, film: Span) -> Result<(), Stop> {
        let crop = compiled.job.film.crop;
        let n_pixels = crop.width as u128 * crop.height as u128;
        let n_bytes = compiled.job.bytes_needed() + n_pixels * ENCODED_BYTES_PER_PIXEL;
        if resources::memory_left(self.plan.max_memory)
            .is_none_or(|memory| n_bytes <= memory.into())
        {
            return Ok(());
        }
        let why = format!(
            "a picture of {} x {} pixels by \"{}\" needs {} MiB of memory, more than there is",
            crop.width,
            crop.height,
            compiled.integrator,
            n_bytes >> 20
        );
        Err(self.stop("too-large", Some(film), why))
    }

    /// Decides where a picture and those beside it go, and makes sure that they can go there.
    fn outputs(
        &mut self,
        compiled: &Compiled,
        film: Span,
        film_filename: Option<Span>,
    ) -> Result<Outputs, Stop> {
        let picture = self.output(compiled, film, film_filename)?;
        let strategies = compiled.job.visualized_strategies();
        let strategies = strategies
            .into_iter()
            .map(|strategy| self.strategy_output(&picture, strategy, film))
            .collect::<Result<_, Stop>>()?;
        Ok(Outputs {
            picture,
            strategies,
        })
    }

    /// The same for the picture of a strategy.
    fn strategy_output(
        &mut self,
        picture: &Output,
        strategy: Strategy,
        film: Span,
    ) -> Result<Output, Stop> {
        let Strategy { s, t } = strategy;
        let name = format!("bdpt_d{:02}_s{s:02}_t{t:02}.exr", strategy.depth());
        let path = picture.place.name().with_file_name(name);
        let place = Place::within(&path, &self.plan.bounds);
        let place = place.and_then(|place| place.spare(&self.ending.inputs).map(|()| place));
        let place = place.map_err(|why| self.stop("unwritable-output", None, why))?;
        self.take(&path, film);
        Ok(Output {
            place,
            ..picture.clone()
        })
    }

    fn output(
        &mut self,
        compiled: &Compiled,
        film: Span,
        film_filename: Option<Span>,
    ) -> Result<Output, Stop> {
        let path = match &self.plan.outfile {
            Some(outfile) => outfile.as_path(),
            None => Path::new(&compiled.filename),
        };
        let place = match &self.plan.json {
            Some(Destination::File(report)) if are_one(report, path) => {
                let path = path.display();
                Err(format!(
                    "cannot write \"{path}\": --json puts the report there"
                ))
            }
            _ => Place::within(path, &self.plan.bounds),
        };
        let output = place.and_then(|place| {
            let output = Output {
                place,
                precision: self.plan.precision,
                frame: compiled.frame,
                crop: compiled.job.film.crop,
                attributes: self.attributes(compiled),
            };
            output.place.spare(&self.ending.inputs)?;
            output.check().map(|()| output)
        });
        let output = output.map_err(|why| {
            let span = film_filename.filter(|_| self.plan.outfile.is_none());
            self.stop("unwritable-output", span, why)
        })?;
        if self.plan.precision == Precision::Half && !output.is_exr() {
            let message = "--half means nothing to formats other than EXR".to_owned();
            self.tell(Diagnostic::new(
                Severity::Warning,
                "half-without-exr",
                None,
                message,
            ));
        }
        self.take(path, film);
        Ok(output)
    }

    /// Notes that a picture goes to `path`.
    fn take(&mut self, path: &Path, film: Span) {
        if !self.taken.insert(path.to_owned()) {
            let message = format!("\"{}\" already holds an earlier picture", path.display());
            self.tell(
                Diagnostic::warning("picture-overwritten", film, message)
                    .with_help("the earlier picture is replaced"),
            );
        }
    }

    /// Facts for the header of a picture. Nothing that differs between two runs of the same job.
    fn attributes(&self, compiled: &Compiled) -> Vec<(String, Attribute)> {
        let job = &compiled.job;
        let text = |name: &str, text: String| (name.to_owned(), Attribute::Text(text));
        let mut attributes = vec![
            text("tyndall/version", env!("CARGO_PKG_VERSION").to_owned()),
            text("tyndall/scene", self.report().scenes.join(" ")),
            text("tyndall/integrator", compiled.integrator.to_owned()),
            // Both exceed the integers of the format.
            text("tyndall/spp", job.spp.to_string()),
            text("tyndall/seed", job.seed.to_string()),
        ];
        let clamp = job.film.max_sample_luminance;
        if clamp.is_finite() {
            let name = "tyndall/max-sample-luminance".to_owned();
            attributes.push((name, Attribute::Float(clamp)));
        }
        attributes
    }

    /// Closes the books on a picture.
    fn add(&mut self, report: PictureReport) {
        self.raise(report.outcome);
        let mut all = self.report();
        all.seconds.render += report.seconds.render;
        all.seconds.write += report.seconds.write;
        all.pictures.push(report);
    }

    /// Takes the findings about the scene.
    fn judge(&mut self, mut found: Diagnostics) {
        if self.plan.strict {
            found.raise(Severity::Error);
        }
        match found.worst() {
            Some(Severity::Fatal) => self.raise(Outcome::Failed),
            Some(Severity::Error) if self.plan.strict => self.raise(Outcome::Failed),
            Some(Severity::Error) => self.raise(Outcome::Substituted),
            Some(Severity::Warning) | None => {}
        }
        self.record(&found);
    }

    /// Whether the scene can be understood so far. With `--strict` all findings are wanted before it is refused.
    fn go_on(&self) -> Result<(), Stop> {
        if self.report().counts.fatal > self.counts_before.fatal {
            Err(Stop)
        } else {
            Ok(())
        }
    }

    /// Reports why something cannot be done.
    fn stop(&mut self, code: &'static str, span: Option<Span>, why: String) -> Stop {
        self.tell(Diagnostic::new(Severity::Fatal, code, span, why));
        Stop
    }

    /// Reports a finding that is not about the scene: `--strict` does not mean it.
    fn tell(&mut self, diagnostic: Diagnostic) {
        let mut found = Diagnostics::new();
        found.push(diagnostic);
        self.record(&found);
    }

    fn record(&mut self, found: &Diagnostics) {
        self.console.show(found, &self.sources);
        let findings = found
            .iter()
            .cloned()
            .chain(found.left_out())
            .map(|diagnostic| Finding::new(&diagnostic, &self.sources));
        let mut report = self.report();
        report.counts.add(found.counts());
        report.findings.extend(findings);
    }

    fn raise(&self, outcome: Outcome) {
        let mut report = self.report();
        report.outcome = report.outcome.max(outcome);
    }
}

/// What may be names of files that a directive reads.
fn names(directive: &Spanned<Directive>) -> impl Iterator<Item = &String> {
    let plugin = match &directive.value {
        Directive::Camera(plugin)
        | Directive::MakeNamedMedium(plugin)
        | Directive::Texture { class: plugin, .. }
        | Directive::Material(plugin)
        | Directive::MakeNamedMaterial(plugin)
        | Directive::LightSource(plugin)
        | Directive::AreaLightSource(plugin)
        | Directive::Shape(plugin) => Some(plugin),
        _ => None,
    };
    let params = plugin.into_iter().flat_map(|plugin| plugin.params.iter());
    params.flat_map(|param| match &param.value {
        ParamValue::String(names) | ParamValue::SpectrumFiles(names) => names.as_slice(),
        _ => &[],
    })
}

fn seconds_since(start: Instant) -> f64 {
    start.elapsed().as_secs_f64()
}
