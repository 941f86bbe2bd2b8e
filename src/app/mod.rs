//! The command line: the only room that reads arguments and the environment, opens files, listens to signals and
//! prints.
//!
//! `args` holds what was typed, `plan` what follows from it, `session` does it, `report` remembers it; `compare`
//! measures pictures that are there already, `bench` measures time and error over many runs; `manual` prints what follows
//! from the tree of commands. Refuses to know anything
//! about plugins or light. `docs/cli.md` is the manual.

mod args;
mod bench;
mod compare;
mod console;
mod files;
mod interrupt;
mod manual;
mod outcome;
mod output;
mod plan;
mod progress;
mod report;
mod resources;
mod session;
mod trace;

use std::ffi::OsString;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use serde::Serialize;

use args::{Command, SceneArgs};
use console::Console;
use files::{Bounds, Inputs};
use interrupt::Interrupt;
use outcome::Outcome;
use output::Place;
use plan::{Destination, Plan, Task, Verbosity};
use report::Report;
use session::Session;

/// Runs the program with its arguments, program name included, and returns the exit status.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    interrupt::fail_on_abort();
    let interrupt = Interrupt::listen();
    let run = |command| match command {
        Command::Render(args) => carry_out(Task::Render, args, &interrupt),
        Command::Check(args) => carry_out(Task::Check, args, &interrupt),
        Command::Cat(args) => carry_out(Task::Cat, args, &interrupt),
        Command::Compare(args) => Ok(compare::run(args, &interrupt).code()),
        Command::Bench(args) => Ok(bench::run(args, &interrupt).code()),
        Command::Completions { shell } => Ok(told(manual::completions(shell))),
        Command::Man { directory } => Ok(told(manual::man(directory.as_deref()))),
    };
    args::parse(args).and_then(run).unwrap_or_else(|message| {
        if message.use_stderr() {
            // Whoever closed standard error does not want to hear of it.
            let _ = message.print();
            return Outcome::Usage.code();
        }
        let text = message.render();
        told(console::print(&if console::stdout_is_terminal() {
            text.ansi().to_string()
        } else {
            text.to_string()
        }))
    })
}

/// The tables of `docs/cli.md`, by name.
pub fn manual_tables() -> Vec<(&'static str, String)> {
    manual::tables()
}

/// The exit status of a command that only prints.
fn told(result: Result<(), String>) -> u8 {
    let outcome = match result {
        Ok(()) => Outcome::Complete,
        Err(why) => {
            Console::new(Verbosity::Quiet).say(&format!("fatal: {why}"));
            Outcome::Failed
        }
    };
    outcome.code()
}

fn carry_out(task: Task, args: SceneArgs, interrupt: &Interrupt) -> Result<u8, clap::Error> {
    let start = Instant::now();
    let plan = Plan::new(task, args)?;
    let mut console = Console::new(plan.verbosity);
    for option in &plan.without_effect {
        console.note(&format!("note: {option} has no effect"));
    }
    let json = plan.json.as_ref();
    let json = match json
        .map(|json| ReportSink::new(json, &plan.bounds))
        .transpose()
    {
        Ok(json) => json,
        Err(why) => {
            console.say(&format!("fatal: {why}"));
            return Ok(Outcome::Failed.code());
        }
    };
    let report = Arc::new(Mutex::new(Report::new(task_name(plan.task))));
    let ending = Arc::new(Ending {
        report: Arc::clone(&report),
        json,
        inputs: Inputs::default(),
        verbosity: plan.verbosity,
        start,
    });
    let heard = Arc::clone(&ending);
    interrupt.leave(move || {
        heard.close(Some(Outcome::Interrupted));
    });
    Session::new(&plan, &mut console, interrupt, &ending).run();
    // A report is written once: a signal that comes now comes too late.
    interrupt.conclude();
    Ok(ending.close(None).code())
}

fn task_name(task: Task) -> &'static str {
    match task {
        Task::Render => "render",
        Task::Check => "check",
        Task::Cat => "cat",
        Task::Trace { .. } => "trace",
    }
}

/// What is left to be done at the end of a run, whatever ends it.
struct Ending {
    report: Arc<Mutex<Report>>,
    json: Option<ReportSink>,
    /// What was read until then.
    inputs: Inputs,
    verbosity: Verbosity,
    start: Instant,
}

impl Ending {
    fn report(&self) -> MutexGuard<'_, Report> {
        self.report.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes sure that the report will not be written over what was read.
    fn spares_inputs(&self) -> Result<(), String> {
        match &self.json {
            Some(json) => json.spare(&self.inputs),
            None => Ok(()),
        }
    }

    /// Sums up, and writes the report. `cause` is what ended the run before its time.
    fn close(&self, cause: Option<Outcome>) -> Outcome {
        let console = Console::new(self.verbosity);
        let mut report = self.report();
        report.outcome = report.outcome.max(cause.unwrap_or_default());
        report.exit_code = report.outcome.code();
        report.peak_memory_bytes = resources::peak_memory();
        report.seconds.cpu = resources::cpu_seconds();
        report.seconds.wall = self.start.elapsed().as_secs_f64();
        let written = match &self.json {
            Some(json) => {
                let spared = self.spares_inputs();
                spared.and_then(|()| json.write(&to_json(&*report)))
            }
            None => Ok(()),
        };
        if let Err(why) = written {
            console.say(&format!("fatal: {why}"));
            report.outcome = report.outcome.max(Outcome::Failed);
            report.exit_code = report.outcome.code();
        }
        console.detail(&report.seconds.text(report.peak_memory_bytes));
        sum_up(&report, &console);
        report.outcome
    }
}

/// Where the report goes; known to be writable.
enum ReportSink {
    Stdout,
    File(Place),
}

impl ReportSink {
    fn new(destination: &Destination, bounds: &Bounds) -> Result<Self, String> {
        match destination {
            Destination::Stdout => Ok(Self::Stdout),
            Destination::File(path) => Place::within(path, bounds).map(Self::File),
        }
    }

    /// Makes sure that it is none of the files that were read.
    fn spare(&self, inputs: &Inputs) -> Result<(), String> {
        match self {
            Self::Stdout => inputs.spare_stdout(),
            Self::File(place) => place.spare(inputs),
        }
    }

    fn write(&self, text: &str) -> Result<(), String> {
        match self {
            Self::Stdout => console::print(text),
            Self::File(place) => place.write(text.as_bytes()),
        }
    }
}

/// A report as text with a line feed at the end.
fn to_json(report: &impl Serialize) -> String {
    // Trees of numbers and strings, every key a name: there is nothing to go wrong.
    let mut text = serde_json::to_string_pretty(report).unwrap_or_default();
    text.push('\n');
    text
}

/// One line at the end: how many findings, and how it ended.
fn sum_up(report: &Report, console: &Console) {
    let counts = report.counts;
    let parts = [
        (counts.fatal, "fatal error"),
        (counts.errors, "error"),
        (counts.warnings, "warning"),
    ];
    let parts: Vec<String> = parts
        .into_iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{n} {what}{}", if n == 1 { "" } else { "s" }))
        .collect();
    if parts.is_empty() && report.outcome == Outcome::Complete && report.task != "check" {
        return;
    }
    let found = if parts.is_empty() {
        "no findings".to_owned()
    } else {
        parts.join(", ")
    };
    let (how, code) = (report.outcome.explanation(), report.exit_code);
    let line = format!("tyndall: {found}; {how} (exit status {code})");
    if report.outcome == Outcome::Complete {
        console.note(&line);
    } else {
        console.say(&line);
    }
}
