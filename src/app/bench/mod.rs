//! `tyndall bench`: how good the pictures are for the time they take, and how that compares with other renderers.
//!
//! `suite` says what is wanted (`keys` reads it), `contest` runs it, each `run` being a child process measured from
//! outside; `fit` and `summary` judge, `report` and `plot` show. Refuses to render or to open pictures itself: ours are
//! made by the same program in a process of its own, measured like any other. `docs/bench/README.md` is the manual.

mod contest;
mod fit;
mod keys;
mod plot;
mod report;
mod run;
mod suite;
mod summary;

use std::collections::HashSet;
use std::fs;
use std::path::Path;

use tyndall_parser::source::Sources;

use super::args::BenchArgs;
use super::console::{self, Console};
use super::files::{Bounds, Inputs, reason};
use super::interrupt::Interrupt;
use super::outcome::Outcome;
use super::output::Place;
use super::plan::{Destination, Verbosity};
use super::{ReportSink, resources, to_json};
use contest::Contest;
use report::{Parts, Report, Skipped};
use suite::{Directories, Scene, Suite};
use summary::Rival;

/// Runs the suite and writes the results.
pub(super) fn run(args: BenchArgs, interrupt: &Interrupt) -> Outcome {
    let mut console = Console::new(match args.quiet {
        true => Verbosity::Quiet,
        false => Verbosity::Normal,
    });
    bench(&args, &mut console, interrupt).unwrap_or_else(|why| {
        console.say(&format!("fatal: {why}"));
        Outcome::Failed
    })
}

fn bench(
    args: &BenchArgs,
    console: &mut Console,
    interrupt: &Interrupt,
) -> Result<Outcome, String> {
    let bounds = Bounds::new(args.confine.as_deref())?;
    let Some(mut suite) = read_suite(args, &bounds, console)? else {
        return Ok(Outcome::Failed);
    };
    if args.no_peers {
        suite.peers.clear();
    }
    if bounds.directory().is_some() && !suite.peers.is_empty() {
        return Err(
            "--confine holds no other renderers: leave them out with --no-peers".to_owned(),
        );
    }
    for name in &args.only {
        if !suite.scenes.iter().any(|scene| scene.name == *name) {
            return Err(format!("the suite has no scene \"{name}\""));
        }
    }
    if !args.only.is_empty() {
        suite.scenes.retain(|scene| args.only.contains(&scene.name));
    }
    // Known to be writable before hours are spent on what is written.
    let destination = args.json.clone().map(Destination::new);
    let json = destination
        .as_ref()
        .map(|json| ReportSink::new(json, &bounds));
    let json = json.transpose()?;
    let inputs = Inputs::default();
    inputs.expect(&args.suite);
    for scene in &suite.scenes {
        for file in [&scene.file, &scene.reference] {
            let refusal = |why| format!("cannot read \"{}\": {why}", file.display());
            bounds.admit(file).map_err(refusal)?;
            inputs.expect(file);
        }
    }
    if let Some(json) = &json {
        json.spare(&inputs)?;
    }
    let shelf = Shelf::new(&args.outdir, inputs, &bounds)?;

    let (scenes, skipped) = sort_out(&suite);
    for skipped in &skipped {
        console.note(&format!("{}: skipped: {}", skipped.scene, skipped.why));
    }
    let versions = suite.peers.iter().map(|peer| {
        let words = peer.version.as_ref()?;
        run::first_line(words)
    });
    let versions = versions.collect();
    // From here on there are results to write.
    interrupt.conclude();
    let contest = Contest::new(&suite, &bounds, console, interrupt)?;
    let runs = contest.run(&scenes);

    let summaries = summary::summarize(&suite, &scenes, &runs);
    let is_complete = skipped.is_empty()
        && runs
            .iter()
            .all(|run| run.failure.is_none() && run.remark.is_none());
    let outcome = match (interrupt.is_wanted(), is_complete) {
        (true, _) => Outcome::Interrupted,
        (false, true) => Outcome::Complete,
        (false, false) => Outcome::Substituted,
    };
    let parts = Parts {
        outcome,
        memory_floor_bytes: resources::peak_memory(),
        versions,
        skipped,
        means: summary::means(&summaries),
        scenes: summaries,
        runs,
    };
    let report = Report::new(&suite, parts);
    let markdown = shelf.fill(&report)?;
    if let Some(json) = json {
        json.write(&to_json(&report))?;
    }
    if destination != Some(Destination::Stdout) && !args.quiet {
        console::print(&markdown)?;
    }
    for scene in &report.scenes {
        for renderer in &scene.renderers {
            if let Some(warning) = renderer.warning(&scene.scene) {
                console.note(&format!("warning: {warning}"));
            }
        }
    }
    if outcome > Outcome::Complete {
        let code = outcome.code();
        let how = match outcome {
            Outcome::Interrupted => "interrupted; the results are those until then",
            _ => "some runs failed or were skipped; the report says which",
        };
        console.say(&format!("tyndall bench: {how} (exit status {code})"));
    }
    Ok(outcome)
}

/// `None` if the suite has errors, which are shown.
fn read_suite(
    args: &BenchArgs,
    bounds: &Bounds,
    console: &mut Console,
) -> Result<Option<Suite>, String> {
    let directories = Directories {
        scenes: args.scenes.clone(),
        references: args.references.clone(),
    };
    let mut sources = Sources::new();
    let (suite, found) = Suite::read(&args.suite, bounds, &directories, &mut sources)?;
    console.show(&found, &sources);
    Ok(suite)
}

/// The scenes that can be rendered, and those that cannot.
fn sort_out(suite: &Suite) -> (Vec<&Scene>, Vec<Skipped>) {
    let (mut scenes, mut skipped) = (Vec::new(), Vec::new());
    for scene in &suite.scenes {
        let mut files = [&scene.file, &scene.reference].into_iter();
        match files.find(|file| !file.is_file()) {
            Some(file) => skipped.push(Skipped {
                scene: scene.name.clone(),
                why: format!("there is no file \"{}\"", file.display()),
            }),
            None => scenes.push(scene),
        }
    }
    (scenes, skipped)
}

/// The directory of the results.
struct Shelf<'a> {
    directory: &'a Path,
    /// What is measured: none of it may be written over.
    inputs: Inputs,
    bounds: &'a Bounds,
}

impl<'a> Shelf<'a> {
    /// Makes the directory, unless it is there, and sees whether files can be made in it.
    fn new(directory: &'a Path, inputs: Inputs, bounds: &'a Bounds) -> Result<Self, String> {
        let refusal = |why| format!("cannot write to \"{}\": {why}", directory.display());
        bounds.admit(directory).map_err(refusal)?;
        if !directory.is_dir() {
            let made = fs::create_dir(directory);
            made.map_err(|error| {
                format!(
                    "cannot make \"{}\": {}",
                    directory.display(),
                    reason(&error)
                )
            })?;
        }
        for name in [PAGE, TABLE, REPORT] {
            Place::within(&directory.join(name), bounds)?.spare(&inputs)?;
        }
        Ok(Self {
            directory,
            inputs,
            bounds,
        })
    }

    /// Writes everything, and returns the page for people.
    fn fill(&self, report: &Report) -> Result<String, String> {
        let mut plots = Vec::new();
        let mut taken = HashSet::new();
        for scene in &report.scenes {
            let plot = plot::scene(scene, &report.runs);
            let plot = plot.map_err(|error| format!("cannot plot {}: {error}", scene.scene))?;
            if let Some(svg) = plot {
                let file = plot_name(&scene.scene, &mut taken);
                self.write(&file, svg.as_bytes())?;
                plots.push((scene.scene.clone(), file));
            }
        }
        let rivals: Vec<&Rival> = report.means.iter().map(|mean| &mean.rival).collect();
        let overview = plot::efficiencies(&report.scenes, &rivals);
        let overview = overview.map_err(|error| format!("cannot plot efficiencies: {error}"))?;
        if let Some(svg) = &overview {
            self.write(OVERVIEW, svg.as_bytes())?;
        }
        let markdown = report.to_markdown(&plots, overview.as_ref().map(|_| OVERVIEW));
        self.write(PAGE, markdown.as_bytes())?;
        self.write(TABLE, &report.to_csv()?)?;
        self.write(REPORT, to_json(report).as_bytes())?;
        Ok(markdown)
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), String> {
        let place = Place::within(&self.directory.join(name), self.bounds)?;
        place.spare(&self.inputs)?;
        place.write(bytes)
    }
}

/// The page for people.
const PAGE: &str = "report.md";
/// All runs.
const TABLE: &str = "runs.csv";
/// The machine-readable results.
const REPORT: &str = "report.json";
/// The plot of all scenes.
const OVERVIEW: &str = "efficiency.svg";

/// A file name that no other scene has: letters, digits and dashes.
fn plot_name(scene: &str, taken: &mut HashSet<String>) -> String {
    let plain: String = scene
        .chars()
        .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
        .collect();
    let mut name = format!("{plain}.svg");
    let mut n = 1;
    while name == OVERVIEW || !taken.insert(name.clone()) {
        n += 1;
        name = format!("{plain}-{n}.svg");
    }
    name
}
