//! What was typed: pbrt-v3's options unchanged, and ours. Says nothing about what follows from them; see
//! [`plan`](super::plan).

use std::ffi::OsString;
use std::fmt::Display;
use std::path::PathBuf;
use std::str::FromStr;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};

use super::compare::EXIT_STATUS_HELP as COMPARE_EXIT_STATUS_HELP;
use super::outcome::EXIT_STATUS_HELP;

/// More than any machine has cores: tens of thousands would bring it to a halt before they render a pixel.
pub(super) const MAX_THREADS: u16 = 1024;

const INPUT_HELP: &str = "\
Without FILE, or for the FILE -, standard input is read. Several files are one stream of directives;
relative paths in each start at its own directory. If the first FILE is the word check, the scene is
checked and not rendered (write ./check for a file of that name). Options may have one dash or two,
and values may follow an = sign.

tyndall compare A B measures how far two pictures are apart; see tyndall compare --help.
tyndall bench SUITE measures error and time beside other renderers; see tyndall bench --help.";

/// The word that, before everything else, asks for a comparison.
const COMPARE: &str = "compare";
/// The same for a benchmark.
const BENCH: &str = "bench";

const BENCH_HELP: &str = "\
The results go to DIR: report.md, report.json, runs.csv and a plot for each scene. Suites are described
in docs/bench/README.md.

Exit status:
  0    every run was measured
  1    the suite has errors, or the results cannot be written
  2    the command line is wrong
  3    a run failed or a scene was skipped; the report says which
  130  interrupted; the results are those until then";

/// The command line as typed.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Command {
    /// Something is done with a scene.
    Scene(LowArgs),
    /// Two pictures are compared.
    Compare(CompareArgs),
    /// A suite is measured.
    Bench(BenchArgs),
}

/// The command line of everything that is done with a scene.
#[derive(Parser, Clone, PartialEq, Debug, Default)]
#[command(
    name = "tyndall",
    version,
    about = "Renders pbrt-v3 scene files.",
    override_usage = "tyndall [OPTIONS] [FILE]...\n       tyndall check [OPTIONS] [FILE]...\n       tyndall compare A B [OPTIONS]\n       tyndall bench SUITE [OPTIONS]",
    after_help = format!("{INPUT_HELP}\n\n{EXIT_STATUS_HELP}"),
    args_override_self = true,
    disable_help_flag = true,
    disable_version_flag = true
)]
pub(super) struct LowArgs {
    /// Scene files
    #[arg(value_name = "FILE")]
    pub(super) files: Vec<PathBuf>,

    /// Write the picture to F (exr, pfm, png or tga) instead of the film's filename
    #[arg(long, value_name = "F")]
    pub(super) outfile: Option<PathBuf>,

    /// Render with N threads, 0 for one per core
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
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) spp: Option<u32>,

    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    pub(super) seed: u64,

    /// Store 16-bit numbers in EXR files instead of 32-bit ones
    #[arg(long)]
    pub(super) half: bool,

    /// Render nothing if there is anything to report about the scene, be it a warning
    #[arg(long)]
    pub(super) strict: bool,

    /// Read and build the scene, report, and render nothing
    #[arg(long, conflicts_with_all = ["cat", "toply"])]
    pub(super) check: bool,

    /// Print the scene in canonical form, includes spliced in, and render nothing
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

    /// Print this help
    #[arg(short, long, action = clap::ArgAction::Help)]
    help: Option<bool>,

    /// Print the version
    #[arg(short = 'V', long, action = clap::ArgAction::Version)]
    version: Option<bool>,
}

/// The command line of `compare`, behind that word.
#[derive(Parser, Clone, PartialEq, Debug)]
#[command(
    bin_name = "tyndall compare",
    about = "Measures how far picture A is from picture B, the reference.",
    override_usage = "tyndall compare A B [OPTIONS]",
    after_help = COMPARE_EXIT_STATUS_HELP,
    args_override_self = true,
    disable_help_flag = true
)]
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
    #[arg(long)]
    pub(super) same_window: bool,

    /// Peak of the PSNR, instead of the largest value of B
    #[arg(long, value_name = "X", value_parser = above_zero)]
    pub(super) peak: Option<f64>,

    /// Write a picture of the errors of luminance to FILE.png
    #[arg(long, value_name = "FILE.png", value_parser = png_file)]
    pub(super) map: Option<PathBuf>,

    /// The error that is white in the map, instead of the largest one
    #[arg(long, value_name = "X", value_parser = above_zero, requires = "map")]
    pub(super) map_max: Option<f64>,

    /// Write the numbers in machine-readable form to FILE, or to standard output for -
    #[arg(long, value_name = "FILE", allow_hyphen_values = true)]
    pub(super) json: Option<PathBuf>,

    /// Print no table
    #[arg(long)]
    pub(super) quiet: bool,

    /// Print this help
    #[arg(short, long, action = clap::ArgAction::Help)]
    help: Option<bool>,
}

/// The command line of `bench`, behind that word.
#[derive(Parser, Clone, PartialEq, Debug)]
#[command(
    bin_name = "tyndall bench",
    about = "Measures error, time and memory over a suite of scenes, beside other renderers.",
    override_usage = "tyndall bench SUITE [OPTIONS]",
    after_help = BENCH_HELP,
    args_override_self = true,
    disable_help_flag = true
)]
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

    /// Write the machine-readable report to FILE as well, or to standard output for -
    #[arg(long, value_name = "FILE", allow_hyphen_values = true)]
    pub(super) json: Option<PathBuf>,

    /// Print neither runs nor tables
    #[arg(long)]
    pub(super) quiet: bool,

    /// Print this help
    #[arg(short, long, action = clap::ArgAction::Help)]
    help: Option<bool>,
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
    if args.get(1).is_some_and(|arg| arg == COMPARE) {
        args.remove(1);
        return CompareArgs::try_parse_from(args).map(Command::Compare);
    }
    if args.get(1).is_some_and(|arg| arg == BENCH) {
        args.remove(1);
        return BenchArgs::try_parse_from(args).map(Command::Bench);
    }
    let args = LowArgs::try_parse_from(args)?;
    for (word, operands) in [(COMPARE, "A B"), (BENCH, "SUITE")] {
        let is_word = |file: &PathBuf| file.as_os_str() == word;
        if args.files.first().is_some_and(is_word) {
            // Its options are others, so those that were read may be wrong.
            let message = format!(
                "the word {word} comes before all options: tyndall {word} {operands} [OPTIONS] \
                 (write ./{word} for a file of that name)"
            );
            return Err(LowArgs::command().error(ErrorKind::ArgumentConflict, message));
        }
    }
    Ok(Command::Scene(args))
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

    use clap::CommandFactory;

    use super::{BenchArgs, Command, CompareArgs, LowArgs, parse};

    fn command(line: &str) -> Result<Command, clap::Error> {
        let args = ["tyndall"].into_iter().chain(line.split_whitespace());
        parse(args.map(OsString::from))
    }

    fn typed(line: &str) -> LowArgs {
        match command(line).expect("the line is right") {
            Command::Scene(args) => args,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_definition_of_the_command_line_is_sound() {
        LowArgs::command().debug_assert();
        CompareArgs::command().debug_assert();
        BenchArgs::command().debug_assert();
    }

    #[test]
    fn compare_is_a_word_at_the_start_and_a_file_with_a_path() {
        let Ok(Command::Compare(args)) = command("compare a.exr -max-mse=.5 b.exr") else {
            panic!("it is a comparison");
        };
        assert_eq!(args.test, std::path::Path::new("a.exr"));
        assert_eq!(args.reference, std::path::Path::new("b.exr"));
        assert_eq!(args.max_mse, Some(0.5));
        assert_eq!(
            typed("./compare").files,
            ["./compare".into()] as [std::path::PathBuf; 1]
        );
        assert_eq!(typed("a.pbrt compare").files.len(), 2);
        let error = command("--quick compare a.exr b.exr").expect_err("the word comes late");
        assert!(error.to_string().contains("./compare"), "{error}");
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
        assert_eq!(
            typed("-- -quick").files,
            ["-quick".into()] as [std::path::PathBuf; 1]
        );
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
