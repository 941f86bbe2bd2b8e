//! What to do: the command line with everything decided that can be decided without reading the scene.

use std::path::PathBuf;

use super::args::{SceneArgs, conflict};
use super::files::{Bounds, are_one};
use crate::compile::CompileOptions;
use crate::image::codec::Precision;

/// A source of directives.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Input {
    Stdin,
    File(PathBuf),
}

/// What is done with the scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Task {
    Render,
    Check,
    Cat,
    /// One path is followed.
    Trace {
        pixel: [i32; 2],
        sample: u32,
    },
}

impl Task {
    /// What the options make of the command that was named, `said`.
    fn new(said: Self, args: &SceneArgs) -> Result<Self, clap::Error> {
        let (cats, checks) = (args.cat || args.toply, args.check);
        match (said, args.pixel) {
            (Self::Check, _) if cats => Err(conflict("check and --cat exclude each other")),
            (Self::Cat, _) if checks => Err(conflict("cat and --check exclude each other")),
            (Self::Check, Some(_)) => Err(conflict("check and --pixel exclude each other")),
            (Self::Cat, Some(_)) => Err(conflict("cat and --pixel exclude each other")),
            (Self::Render, Some(pixel)) => Ok(Self::Trace {
                pixel,
                sample: args.sample,
            }),
            (Self::Render, None) if cats => Ok(Self::Cat),
            (Self::Render, None) if checks => Ok(Self::Check),
            (said, _) => Ok(said),
        }
    }

    /// Refuses a report on standard output where the task itself writes there.
    fn leaves_stdout(self) -> Result<(), clap::Error> {
        let option = match self {
            Self::Cat => "--cat",
            Self::Trace { .. } => "--pixel",
            Self::Render | Self::Check => return Ok(()),
        };
        let message = format!("{option} and --json - both write to standard output");
        Err(conflict(&message))
    }
}

/// How much is said on standard error.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Verbosity {
    Quiet,
    Normal,
    Verbose,
}

/// Where the report goes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum Destination {
    Stdout,
    File(PathBuf),
}

impl Destination {
    /// As typed: `-` is standard output.
    pub(super) fn new(path: PathBuf) -> Self {
        if path.as_os_str() == "-" {
            Self::Stdout
        } else {
            Self::File(path)
        }
    }
}

/// A run, decided.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) task: Task,
    pub(super) inputs: Vec<Input>,
    pub(super) outfile: Option<PathBuf>,
    /// 0 for one per core.
    pub(super) n_threads: usize,
    pub(super) compile: CompileOptions,
    pub(super) precision: Precision,
    pub(super) strict: bool,
    /// Bytes of memory that may be taken.
    pub(super) max_memory: Option<u64>,
    pub(super) json: Option<Destination>,
    /// Where files may be read and written.
    pub(super) bounds: Bounds,
    pub(super) verbosity: Verbosity,
    /// Options that were accepted and do nothing.
    pub(super) without_effect: Vec<&'static str>,
}

impl Plan {
    /// Decides.
    ///
    /// # Errors
    /// Options that contradict each other.
    pub(super) fn new(said: Task, args: SceneArgs) -> Result<Self, clap::Error> {
        let without_effect = [
            ("--logdir", args.logdir.is_some()),
            ("--minloglevel", args.minloglevel.is_some()),
            ("--v", args.v.is_some()),
            ("--logtostderr", args.logtostderr),
        ];
        let task = Task::new(said, &args)?;
        let bounds = Bounds::new(args.confine.as_deref()).map_err(|why| conflict(&why))?;
        let json = args.json.map(Destination::new);
        if json == Some(Destination::Stdout) {
            task.leaves_stdout()?;
        }
        let inputs = inputs(args.files)?;
        if let Some(Destination::File(report)) = &json {
            let is_scene =
                |input: &Input| matches!(input, Input::File(file) if are_one(file, report));
            if inputs.iter().any(is_scene) {
                return Err(conflict("--json would replace the scene"));
            }
            if args
                .outfile
                .as_ref()
                .is_some_and(|file| are_one(file, report))
            {
                return Err(conflict("--json and --outfile name one file"));
            }
        }
        Ok(Self {
            task,
            inputs,
            outfile: args.outfile,
            n_threads: args.nthreads.into(),
            compile: CompileOptions {
                crop_window: args.cropwindow.and_then(|window| window.try_into().ok()),
                quick: args.quick,
                spp: args.spp,
                seed: args.seed,
            },
            precision: if args.half {
                Precision::Half
            } else {
                Precision::Float
            },
            strict: args.strict,
            max_memory: args.max_memory,
            json,
            bounds,
            verbosity: match (args.quiet, args.verbose) {
                (true, _) => Verbosity::Quiet,
                (_, true) => Verbosity::Verbose,
                _ => Verbosity::Normal,
            },
            without_effect: without_effect
                .into_iter()
                .filter_map(|(option, is_given)| is_given.then_some(option))
                .collect(),
        })
    }
}

impl Plan {
    /// The command line that follows one path of this run.
    pub(super) fn replay_command(&self, [x, y]: [i32; 2], sample: u32) -> String {
        let mut words = vec!["tyndall".to_owned()];
        if self.compile.quick {
            words.push("--quick".to_owned());
        }
        if let Some(spp) = self.compile.spp {
            words.push(format!("--spp {spp}"));
        }
        if self.compile.seed != 0 {
            words.push(format!("--seed {}", self.compile.seed));
        }
        words.extend(self.inputs.iter().map(|input| match input {
            Input::Stdin => "-".to_owned(),
            Input::File(path) => quoted(&path.to_string_lossy()),
        }));
        words.push(format!("--pixel {x},{y} --sample {sample}"));
        words.join(" ")
    }
}

/// Standard input where no file is named.
fn inputs(files: Vec<PathBuf>) -> Result<Vec<Input>, clap::Error> {
    if files.is_empty() {
        return Ok(vec![Input::Stdin]);
    }
    let input = |file: PathBuf| {
        if file.as_os_str() == "-" {
            Input::Stdin
        } else {
            Input::File(file)
        }
    };
    let inputs: Vec<Input> = files.into_iter().map(input).collect();
    let is_stdin = |input: &&Input| **input == Input::Stdin;
    if inputs.iter().filter(is_stdin).count() > 1 {
        return Err(conflict("standard input can be read only once"));
    }
    Ok(inputs)
}

/// As a POSIX shell takes it for one word.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
