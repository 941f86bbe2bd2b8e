//! The command line: the only room that reads arguments and the environment, opens files, listens to signals and
//! prints.
//!
//! `args` holds what was typed, `plan` what follows from it, `session` does it, `report` remembers it; `compare`
//! measures pictures that are there already, `bench` measures time and error over many runs. Refuses to know anything
//! about plugins or light. `docs/cli.md` is the manual.

mod args;
mod bench;
mod compare;
mod console;
mod files;
mod interrupt;
mod outcome;
mod output;
mod plan;
mod progress;
mod report;
mod resources;
mod session;
mod trace;

use std::ffi::OsString;
use std::time::Instant;

use serde::Serialize;

use args::Command;
use console::Console;
use interrupt::Interrupt;
use outcome::Outcome;
use output::Place;
use plan::{Destination, Plan};
use report::Report;
use session::Session;

/// Runs the program with its arguments, program name included, and returns the exit status.
pub fn run(args: impl IntoIterator<Item = OsString>) -> u8 {
    interrupt::fail_on_abort();
    let run = |command| match command {
        Command::Scene(args) => Plan::new(args).map(|plan| carry_out(&plan).code()),
        Command::Compare(args) => Ok(compare::run(args).code()),
        Command::Bench(args) => Ok(bench::run(args).code()),
    };
    args::parse(args).and_then(run).unwrap_or_else(|message| {
        // Help and version go to standard output, faults to standard error; whoever closed either does not want to
        // hear of it.
        let _ = message.print();
        let outcome = if message.use_stderr() {
            Outcome::Usage
        } else {
            Outcome::Complete
        };
        outcome.code()
    })
}

fn carry_out(plan: &Plan) -> Outcome {
    let start = Instant::now();
    let mut console = Console::new(plan.verbosity);
    for option in &plan.without_effect {
        console.note(&format!("note: {option} has no effect"));
    }
    let json = match plan.json.as_ref().map(ReportSink::new).transpose() {
        Ok(json) => json,
        Err(why) => {
            console.say(&format!("fatal: {why}"));
            return Outcome::Failed;
        }
    };
    let interrupt = Interrupt::listen();
    let mut report = Session::new(plan, &mut console, &interrupt).run();
    report.exit_code = report.outcome.code();
    report.peak_memory_bytes = resources::peak_memory();
    report.seconds.cpu = resources::cpu_seconds();
    report.seconds.wall = start.elapsed().as_secs_f64();
    console.detail(&report.seconds.text(report.peak_memory_bytes));
    sum_up(&report, &console);

    let written = json.map_or(Ok(()), |json| json.write(&to_json(&report)));
    match written {
        Ok(()) => report.outcome,
        Err(why) => {
            console.say(&format!("fatal: {why}"));
            report.outcome.max(Outcome::Failed)
        }
    }
}

/// Where the report goes; known to be writable.
enum ReportSink {
    Stdout,
    File(Place),
}

impl ReportSink {
    fn new(destination: &Destination) -> Result<Self, String> {
        match destination {
            Destination::Stdout => Ok(Self::Stdout),
            Destination::File(path) => Place::new(path).map(Self::File),
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
