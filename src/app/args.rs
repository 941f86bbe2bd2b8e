//! What was typed: one tree of commands, pbrt-v3's options unchanged, and ours. Says nothing about what follows from
//! them; see [`plan`](super::plan). Help, completions, manual pages and the tables of `docs/cli.md` are made from it.

use std::ffi::{OsStr, OsString};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::error::ErrorKind;
use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};
use clap_complete::Shell;
use tyndall_parser::schema::nearest;

use super::outcome::Family;

/// More than any machine has cores: tens of thousands would bring it to a halt before they render a pixel.
pub(super) const MAX_THREADS: u16 = 1024;

const INPUT_HELP: &str = "\
Without FILE, or for the FILE -, standard input is read. Several files are one stream of directives;
relative paths in each start at its own directory. Options may have one dash or two, and values may
follow an = sign. Write ./check for a scene of that name; behind --, everything is a FILE.";

/// The command that is meant where none is named.
const DEFAULT: &str = "render";

/// The command line.
#[derive(Parser, Debug)]
#[command(
    name = "tyndall",
    version,
    about = "Renders pbrt-v3 scene files.",
    override_usage = "tyndall [OPTIONS] [FILE]...\n       tyndall COMMAND ...",
    after_help = format!("{INPUT_HELP}\n\nThe options are those of render, which is what is done without a COMMAND.\n\n{}", Family::Scene.help()),
    subcommand_value_name = "COMMAND",
    subcommand_help_heading = "Commands",
    propagate_version = true,
    args_override_self = true
)]
pub(super) struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    /// Shown, and completed; parsed as those of the default command.
    #[command(flatten)]
    _scene: SceneArgs,
}

/// What is to be done.
#[derive(Subcommand, Clone, PartialEq, Debug)]
pub(super) enum Command {
    /// Render scenes: what is done without a command
    #[command(after_help = format!("{INPUT_HELP}\n\n{}", Family::Scene.help()))]
    Render(SceneArgs),

    /// Read and build scenes, report, and render nothing
    #[command(
        long_about = "Read and build scenes, report, and render nothing. Each FILE is a scene by itself; the exit status \
            is the worst of all. Options that only matter to pictures are accepted, so that any command line can \
            be checked."
    )]
    #[command(after_help = Family::Scene.help())]
    Check(SceneArgs),

    /// Print a scene in canonical form, includes spliced in
    #[command(after_help = format!("{INPUT_HELP}\n\n{}", Family::Scene.help()))]
    Cat(SceneArgs),

    /// Measure how far picture A is from picture B, the reference
    #[command(
        override_usage = "tyndall compare A B [OPTIONS]",
        after_help = Family::Compare.help()
    )]
    Compare(CompareArgs),

    /// Measure error, time and memory over a suite of scenes, beside other renderers
    #[command(
        long_about = "Measure error, time and memory over a suite of scenes, beside other renderers. The results go to \
            DIR: report.md, report.json, runs.csv and a plot for each scene. Suites are described in \
            docs/bench/README.md."
    )]
    #[command(
        override_usage = "tyndall bench SUITE [OPTIONS]",
        after_help = Family::Bench.help()
    )]
    Bench(BenchArgs),

    /// Print what makes a shell complete commands and options
    Completions {
        /// The shell
        #[arg(value_name = "SHELL")]
        shell: Shell,
    },

    /// Print the manual page, or write those of all commands to a directory
    Man {
        /// Where the pages go: tyndall.1, tyndall-render.1 and so on
        #[arg(value_name = "DIR")]
        directory: Option<PathBuf>,
    },
}

/// Options about pictures: they mean nothing where none is rendered.
const FOR_PICTURES: [&str; 2] = ["outfile", "half"];
/// Options that say what is done, as commands do.
const FOR_TASKS: [&str; 5] = ["check", "cat", "toply", "pixel", "sample"];
/// Options about what is built: they mean nothing to who only reads.
const FOR_BUILDING: [&str; 5] = ["nthreads", "cropwindow", "quick", "spp", "seed"];

/// An option that is accepted without being offered if it is one of these.
fn hidden(arg: clap::Arg, groups: &[&[&str]]) -> clap::Arg {
    let is_hidden = groups
        .iter()
        .any(|group| group.contains(&arg.get_id().as_str()));
    if is_hidden { arg.hide(true) } else { arg }
}

/// The command line of everything that is done with a scene.
#[derive(Args, Clone, PartialEq, Debug, Default)]
pub(super) struct SceneArgs {
    /// Scene files
    #[arg(value_name = "FILE")]
    pub(super) files: Vec<PathBuf>,

    /// Write the picture to F (exr, pfm, png or tga) instead of the film's filename
    #[arg(long, value_name = "F")]
    pub(super) outfile: Option<PathBuf>,

    /// Use N threads, 0 for one per core
    #[arg(
        long_help = "Use N threads, at most 1024; 0, the default, is one per core. The picture does not depend on it, not \
            in one bit"
    )]
    #[arg(
        long,
        value_name = "N",
        default_value_t = 0,
        hide_default_value = true,
        value_parser = clap::value_parser!(u16).range(..=i64::from(MAX_THREADS))
    )]
    pub(super) nthreads: u16,

    /// Render a part of the frame, in fractions of its size, unless the film has a cropwindow
    #[arg(
        long_help = "Render a part of the frame, in fractions of its size: four separate values. A cropwindow of the film \
            wins, with a warning. The pixels are those of the full picture, bit for bit"
    )]
    #[arg(
        long,
        num_args = 4,
        action = clap::ArgAction::Set,
        value_names = ["X0", "X1", "Y0", "Y1"],
        allow_negative_numbers = true,
        value_parser = finite
    )]
    pub(super) cropwindow: Option<Vec<f32>>,

    /// A quick look: a quarter of the resolution, one sample per pixel
    #[arg(long)]
    pub(super) quick: bool,

    /// Take N samples per pixel, whatever the scene says
    #[arg(
        long_help = "Take N samples per pixel, at least 1, whatever scene and --quick say; the grid of a stratified \
            sampler becomes the squarest that has as many cells"
    )]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,

    /// Seed of all random numbers
    #[arg(long_help = "Seed of all random numbers, a 64-bit number; 0 if not given")]
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    pub(super) seed: u64,

    /// Store 16-bit numbers in EXR files instead of 32-bit ones
    #[arg(
        long_help = "Store 16-bit numbers in EXR files instead of 32-bit ones; values are clamped to ±65504"
    )]
    #[arg(long)]
    pub(super) half: bool,

    /// Render nothing if there is anything to report about the scene, be it a warning
    #[arg(
        long_help = "Warnings about the scene become errors, and nothing is rendered if there is any"
    )]
    #[arg(long)]
    pub(super) strict: bool,

    /// The same as the command check
    #[arg(long, conflicts_with_all = ["cat", "toply"])]
    pub(super) check: bool,

    /// The same as the command cat
    #[arg(
        long_help = "The same as the command cat: print the scene in canonical form and render nothing. Unlike in \
            pbrt-v3, includes are followed: their directives are printed in their place, and paths in them still \
            start at the directory of the FILE"
    )]
    #[arg(long)]
    pub(super) cat: bool,

    /// The same as --cat: meshes stay in the scene
    #[arg(long)]
    pub(super) toply: bool,

    /// Write a machine-readable report to FILE, or to standard output for -
    #[arg(long, value_name = "FILE", allow_hyphen_values = true)]
    pub(super) json: Option<PathBuf>,

    /// Take no more memory than SIZE, as in 500M or 4G: what would is refused. By default, what the machine and the
    /// limits on this process allow
    #[arg(long, value_name = "SIZE", value_parser = super::resources::size)]
    pub(super) max_memory: Option<u64>,

    /// Show errors only: no warnings, no progress, no summary unless there are errors
    #[arg(long, conflicts_with = "verbose")]
    pub(super) quiet: bool,

    /// Say what was built, what was skipped, and where the time went
    #[arg(long)]
    pub(super) verbose: bool,

    /// Render nothing, but follow the path of one sample of the pixel X,Y and tell what happens to it
    #[arg(
        long_help = "Render nothing, but follow the path of one sample of the pixel X,Y of the full frame, and print what \
            happens to it"
    )]
    #[arg(
        long,
        value_name = "X,Y",
        allow_hyphen_values = true,
        value_parser = pixel,
        conflicts_with_all = ["check", "cat", "toply"]
    )]
    pub(super) pixel: Option<[i32; 2]>,

    /// The number of the sample that --pixel follows, from 0
    #[arg(
        long,
        value_name = "N",
        requires = "pixel",
        default_value_t = 0,
        hide_default_value = true
    )]
    pub(super) sample: u32,

    /// Read and write nothing outside of DIR
    #[arg(
        long_help = "Read and write nothing outside of DIR, wherever links lead: scenes, what they include and name, \
            pictures, reports. What a scene names elsewhere counts as missing"
    )]
    #[arg(long, value_name = "DIR")]
    pub(super) confine: Option<PathBuf>,

    /// Accepted for pbrt-v3's sake; there are no log files
    #[arg(long, value_name = "DIR", hide_short_help = true)]
    pub(super) logdir: Option<OsString>,

    /// Accepted for pbrt-v3's sake
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub(super) minloglevel: Option<OsString>,

    /// Accepted for pbrt-v3's sake
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub(super) v: Option<OsString>,

    /// Accepted for pbrt-v3's sake
    #[arg(long, hide_short_help = true)]
    pub(super) logtostderr: bool,
}

/// The command line of `compare`.
#[derive(Args, Clone, PartialEq, Debug)]
pub(super) struct CompareArgs {
    /// The picture under test (exr, pfm, png, tga, hdr or jpg)
    #[arg(value_name = "A")]
    pub(super) test: PathBuf,

    /// The reference
    #[arg(value_name = "B")]
    pub(super) reference: PathBuf,

    /// Fail if the mean squared error is above X
    #[arg(long, value_name = "X", value_parser = not_negative)]
    pub(super) max_mse: Option<f64>,

    /// Fail if the root of the mean squared error is above X
    #[arg(long, value_name = "X", value_parser = not_negative)]
    pub(super) max_rmse: Option<f64>,

    /// Fail if the relative mean squared error is above X
    #[arg(long, value_name = "X", value_parser = not_negative)]
    pub(super) max_relmse: Option<f64>,

    /// Fail if the mean absolute error is above X
    #[arg(long, value_name = "X", value_parser = not_negative)]
    pub(super) max_mae: Option<f64>,

    /// Fail if the mean of a channel of A, over that of B, is further than X from 1
    #[arg(long, value_name = "X", value_parser = not_negative)]
    pub(super) max_mean_ratio_error: Option<f64>,

    /// Take A for the part of the frame that B shows, whatever its file says; sizes must agree
    #[arg(
        long_help = "Take A for the part of the frame that B shows, whatever its file says of frame and window; for \
            renderers that do not say. The sizes must agree"
    )]
    #[arg(long)]
    pub(super) same_window: bool,

    /// Peak of the PSNR, instead of the largest value of B
    #[arg(
        long_help = "Peak of the PSNR, instead of the largest value of B where the pictures overlap"
    )]
    #[arg(long, value_name = "X", value_parser = above_zero)]
    pub(super) peak: Option<f64>,

    /// Write a picture of the errors of luminance to FILE.png
    #[arg(
        long_help = "Write a picture of the errors of luminance to FILE.png, of the size of the common rectangle"
    )]
    #[arg(long, value_name = "FILE.png", value_parser = png_file)]
    pub(super) map: Option<PathBuf>,

    /// The error that is white in the map, instead of the largest one
    #[arg(long, value_name = "X", value_parser = above_zero, requires = "map")]
    pub(super) map_max: Option<f64>,

    /// Write the numbers in machine-readable form to FILE, or to standard output, in place of the table, for -
    #[arg(long, value_name = "FILE", allow_hyphen_values = true)]
    pub(super) json: Option<PathBuf>,

    /// Print neither the table nor which limits are exceeded
    #[arg(long)]
    pub(super) quiet: bool,

    /// Read and write nothing outside of DIR
    #[arg(long_help = "Read and write nothing outside of DIR, wherever links lead")]
    #[arg(long, value_name = "DIR")]
    pub(super) confine: Option<PathBuf>,
}

/// The command line of `bench`.
#[derive(Args, Clone, PartialEq, Debug)]
pub(super) struct BenchArgs {
    /// The suite (toml)
    #[arg(value_name = "SUITE")]
    pub(super) suite: PathBuf,

    /// Look for scenes in DIR instead of where the suite says
    #[arg(long, value_name = "DIR")]
    pub(super) scenes: Option<PathBuf>,

    /// Look for references in DIR instead of where the suite says
    #[arg(long, value_name = "DIR")]
    pub(super) references: Option<PathBuf>,

    /// Write the results to DIR, which is made if it is not there
    #[arg(long, value_name = "DIR", default_value = "bench-results")]
    pub(super) outdir: PathBuf,

    /// Measure only this scene; may be given several times
    #[arg(long, value_name = "SCENE", action = clap::ArgAction::Append)]
    pub(super) only: Vec<String>,

    /// Run no other renderers
    #[arg(long)]
    pub(super) no_peers: bool,

    /// Write the report to FILE as well, or to standard output, in place of the page, for -
    #[arg(long, value_name = "FILE", allow_hyphen_values = true)]
    pub(super) json: Option<PathBuf>,

    /// Print neither runs nor the page
    #[arg(long)]
    pub(super) quiet: bool,

    /// Read and write nothing outside of DIR
    #[arg(
        long_help = "Read and write nothing outside of DIR, wherever links lead: the suite, scenes, references, results, \
            and pictures while they are measured. Other renderers cannot be held to that: a suite that has any is refused \
            without --no-peers"
    )]
    #[arg(long, value_name = "DIR")]
    pub(super) confine: Option<PathBuf>,
}

/// The tree of commands.
fn definition() -> clap::Command {
    Cli::command()
        .mut_subcommand("check", |command| {
            command.mut_args(|arg| hidden(arg, &[&FOR_PICTURES, &FOR_TASKS]))
        })
        .mut_subcommand("cat", |command| {
            command.mut_args(|arg| hidden(arg, &[&FOR_PICTURES, &FOR_TASKS, &FOR_BUILDING]))
        })
}

/// The tree of commands, with everything that follows from it filled in.
pub(super) fn tree() -> clap::Command {
    let mut tree = definition();
    tree.build();
    tree
}

/// A fault of the command line that the definitions of single options cannot tell.
pub(super) fn conflict(message: &str) -> clap::Error {
    definition().error(ErrorKind::ArgumentConflict, message)
}

/// Reads the command line, program name included.
///
/// # Errors
/// Wrong options, and the wish for help or the version: what to print, and where to.
pub(super) fn parse(args: impl IntoIterator<Item = OsString>) -> Result<Command, clap::Error> {
    let mut is_option = true;
    let mut args: Vec<OsString> = args
        .into_iter()
        .map(|arg| {
            is_option &= arg != "--";
            if is_option { with_two_dashes(arg) } else { arg }
        })
        .collect();
    let words = Words::new();
    // Of the program as a whole.
    let asks = |arg: &OsString| {
        ["-h", "--help", "-V", "--version"]
            .iter()
            .any(|it| arg == it)
    };
    if args.get(1).is_none_or(|arg| !words.hold(arg) && !asks(arg)) {
        if args.is_empty() {
            args.push("tyndall".into());
        }
        args.insert(1, DEFAULT.into());
        let n_before_files = args.iter().position(|arg| arg == "--");
        let before = &args[..n_before_files.unwrap_or(args.len())];
        return match parsed(&args)? {
            Command::Render(scene) => words.sort_out(scene, before),
            other => Ok(other),
        };
    }
    parsed(&args)
}

fn parsed(args: &[OsString]) -> Result<Command, clap::Error> {
    let matches = definition().try_get_matches_from(args)?;
    let cli = Cli::from_arg_matches(&matches)?;
    cli.command.ok_or_else(|| conflict("there is no command"))
}

/// The words that are commands.
struct Words(Vec<String>);

impl Words {
    fn new() -> Self {
        let tree = tree();
        let names = tree
            .get_subcommands()
            .map(|command| command.get_name().to_owned());
        Self(names.collect())
    }

    fn hold(&self, word: &OsStr) -> bool {
        self.0.iter().any(|name| word == name.as_str())
    }

    /// What is meant by files of which the first may be a command, behind its options or misspelt. `before` is what was
    /// typed in front of `--`.
    fn sort_out(&self, mut scene: SceneArgs, before: &[OsString]) -> Result<Command, clap::Error> {
        let Some(first) = scene.files.first() else {
            return Ok(Command::Render(scene));
        };
        let word = first.as_os_str().to_owned();
        if !before.contains(&word) {
            return Ok(Command::Render(scene));
        }
        if self.hold(&word) {
            let command = match word.to_str() {
                Some("render") => Command::Render,
                Some("check") => Command::Check,
                Some("cat") => Command::Cat,
                // Its options are others, so those that were read may be wrong.
                _ => {
                    let word = word.display();
                    return Err(conflict(&format!(
                        "the word {word} comes before all options: tyndall {word} ... (write ./{word} for a file of \
                         that name)"
                    )));
                }
            };
            scene.files.remove(0);
            return Ok(command(scene));
        }
        match self.misspelt(first) {
            Some(message) => Err(definition().error(ErrorKind::InvalidSubcommand, message)),
            None => Ok(Command::Render(scene)),
        }
    }

    /// What is to be said of a word that is no file and nearly a command.
    fn misspelt(&self, path: &Path) -> Option<String> {
        let word = path.to_str()?;
        let is_word = word
            .chars()
            .all(|c| c.is_alphanumeric() || c == '-' || c == '_');
        if !is_word || word == "-" || path.symlink_metadata().is_ok() {
            return None;
        }
        let near = nearest(word, self.0.iter().map(String::as_str))?;
        Some(format!(
            "there is neither a command nor a file \"{word}\"; did you mean \"{near}\"? (write ./{word} for a file of \
             that name)"
        ))
    }
}

/// `-outfile` to `--outfile`. Numbers, `-`, and the options of one letter stay what they are.
fn with_two_dashes(arg: OsString) -> OsString {
    let bytes = arg.as_encoded_bytes();
    let is_long = match bytes {
        [b'-', first, rest @ ..] => {
            first.is_ascii_alphabetic() && (!rest.is_empty() || *first == b'v')
        }
        _ => false,
    };
    if is_long {
        let mut long = OsString::from("-");
        long.push(arg);
        long
    } else {
        arg
    }
}

fn pixel(text: &str) -> Result<[i32; 2], String> {
    let numbers: Result<Vec<i32>, _> = text.split(',').map(str::parse).collect();
    numbers
        .ok()
        .and_then(|numbers| numbers.try_into().ok())
        .ok_or_else(|| "a pixel is two integers, X,Y".to_owned())
}

fn finite(text: &str) -> Result<f32, String> {
    number(text, "it must be finite", |value: &f32| value.is_finite())
}

fn not_negative(text: &str) -> Result<f64, String> {
    number(text, "it must be 0 or more, and finite", |value: &f64| {
        value.is_finite() && *value >= 0.0
    })
}

fn above_zero(text: &str) -> Result<f64, String> {
    number(text, "it must be above 0, and finite", |value: &f64| {
        value.is_finite() && *value > 0.0
    })
}

/// A number for which `condition` holds; `demand` says which numbers those are.
fn number<T>(text: &str, demand: &str, condition: impl Fn(&T) -> bool) -> Result<T, String>
where
    T: FromStr<Err: Display>,
{
    match text.parse() {
        Ok(value) if condition(&value) => Ok(value),
        Ok(_) => Err(demand.to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

fn png_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    let extension = path.extension().unwrap_or_default();
    if extension.eq_ignore_ascii_case("png") {
        Ok(path)
    } else {
        Err("the map is a png file".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use std::ffi::OsString;
    use std::path::{Path, PathBuf};

    use super::{Command, SceneArgs, parse, tree};

    fn command(line: &str) -> Result<Command, clap::Error> {
        let args = ["tyndall"].into_iter().chain(line.split_whitespace());
        parse(args.map(OsString::from))
    }

    fn typed(line: &str) -> SceneArgs {
        match command(line).expect("the line is right") {
            Command::Render(args) => args,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_definition_of_the_command_line_is_sound() {
        tree().debug_assert();
    }

    #[test]
    fn compare_is_a_word_at_the_start_and_a_file_with_a_path() {
        let Ok(Command::Compare(args)) = command("compare a.exr -max-mse=.5 b.exr") else {
            panic!("it is a comparison");
        };
        assert_eq!(args.test, Path::new("a.exr"));
        assert_eq!(args.reference, Path::new("b.exr"));
        assert_eq!(args.max_mse, Some(0.5));
        assert_eq!(typed("./compare").files, [PathBuf::from("./compare")]);
        assert_eq!(typed("a.pbrt compare").files.len(), 2);
        for word in ["compare a.exr b.exr", "bench", "man", "help"] {
            let error = command(&format!("--quick {word}")).expect_err("the word comes late");
            assert!(error.to_string().contains("(write ./"), "{error}");
        }
    }

    #[test]
    fn words_of_the_same_options_stand_anywhere_before_files() {
        let check = command("--quick -spp 3 check a.pbrt b.pbrt");
        assert_eq!(
            check.ok(),
            command("check a.pbrt --quick b.pbrt --spp=3").ok()
        );
        assert!(matches!(command("--quiet cat a.pbrt"), Ok(Command::Cat(_))));
        assert_eq!(typed("render a.pbrt -quick"), typed("-quick a.pbrt"));
        assert_eq!(typed("--quick render a.pbrt"), typed("-quick a.pbrt"));
        assert_eq!(typed("--quick -- check").files, [PathBuf::from("check")]);
        assert_eq!(typed("--quick -- chekc").files, [PathBuf::from("chekc")]);
    }

    #[test]
    fn misspelt_commands_are_told_and_odd_files_are_not() {
        for (line, near) in [
            ("rendr a.pbrt", "\"render\""),
            ("--quick chekc a.pbrt", "\"check\""),
            ("comapre a b", "\"compare\""),
            ("completion", "\"completions\""),
        ] {
            let error = command(line).expect_err("there is no such command");
            assert!(error.to_string().contains(near), "{line}: {error}");
            assert!(error.use_stderr());
        }
        for file in ["rendr.pbrt", "./rendr", "scenes/chekc", "scene", "-"] {
            assert_eq!(typed(file).files, [PathBuf::from(file)]);
        }
    }

    #[test]
    fn one_dash_two_dashes_and_equal_signs_say_the_same() {
        let want = typed("--outfile a.exr --nthreads 3 --v 2 scene.pbrt");
        assert_eq!(want.nthreads, 3);
        assert_eq!(want.v, Some("2".into()));
        assert_eq!(typed("-outfile a.exr -nthreads 3 -v 2 scene.pbrt"), want);
        assert_eq!(typed("scene.pbrt --outfile=a.exr -nthreads=3 -v=2"), want);
    }

    #[test]
    fn behind_two_dashes_everything_is_a_file() {
        assert_eq!(typed("-- -quick").files, [PathBuf::from("-quick")]);
    }

    #[test]
    fn the_last_of_several_counts() {
        assert_eq!(typed("--spp 3 --spp 4").spp, Some(4));
        assert_eq!(
            typed("--cropwindow 0 1 0 1 --cropwindow -1 .5 0 1").cropwindow,
            Some(vec![-1.0, 0.5, 0.0, 1.0])
        );
    }
}
