//! `tyndall compare`: how far picture A is from picture B, the reference.
//!
//! Pictures are compared where their data windows overlap, both being parts of one frame (the display window). The
//! measures are those of [`metrics`]; what is 8-bit is made linear first. `docs/cli.md` is the manual.

use std::fmt::Write;
use std::path::Path;

use serde::Serialize;

use super::args::CompareArgs;
use super::console::{self, Console};
use super::files::{self, Bounds};
use super::interrupt::Interrupt;
use super::outcome::Outcome;
use super::output::Place;
use super::plan::{Destination, Verbosity};
use super::{ReportSink, resources, to_json};
use crate::image::codec::{self, DecodeOptions, Decoded, ImageFile, Precision};
use crate::image::metrics::{self, Comparison};
use crate::image::{Image, PixelRect, srgb};

/// Version of the report: raised when a field is removed or changes its meaning, not when one is added.
const SCHEMA: u32 = 1;

/// How a comparison ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Verdict {
    /// Every limit is kept.
    Within,
    /// A limit is exceeded, or the picture under test has pixels that are not finite.
    Exceeded,
    /// There is no answer.
    Incomparable,
}

impl Verdict {
    /// The exit status.
    pub(super) fn code(self) -> u8 {
        let outcome = match self {
            Self::Within => Outcome::Complete,
            Self::Exceeded => Outcome::Failed,
            Self::Incomparable => Outcome::Substituted,
        };
        outcome.code()
    }
}

/// Everything that is known at the end, as `--json` writes it.
#[derive(Serialize)]
struct Report {
    schema: u32,
    version: &'static str,
    task: &'static str,
    outcome: Verdict,
    exit_code: u8,
    error: Option<String>,
    #[serde(flatten)]
    finding: Option<Finding>,
}

/// Two pictures, compared.
#[derive(Serialize)]
struct Finding {
    test: Side,
    reference: Side,
    compared: Compared,
    measures: Measures,
    limits: Vec<Limit>,
    map: Option<Map>,
}

/// One of the two pictures.
#[derive(Serialize)]
struct Side {
    file: String,
    resolution: [usize; 2],
    window: Window,
    channels: usize,
    made_linear: bool,
    /// Pixels within the common window.
    non_finite: usize,
}

/// Pixels x0, x1, y0, y1 of the frame; x1 and y1 are the first ones behind it.
#[derive(Serialize)]
struct Window([i64; 4]);

/// Where the measures come from.
#[derive(Serialize)]
struct Compared {
    resolution: [usize; 2],
    window: Window,
    channels: usize,
    /// Those that are finite in both pictures.
    pixels: usize,
}

/// JSON has no infinity and no NaN: they become null.
#[derive(Serialize)]
struct Measures {
    mse: f64,
    rmse: f64,
    relmse: f64,
    mae: f64,
    psnr: f64,
    peak: f64,
    mean_ratio: Vec<f64>,
    mean_ratio_error: f64,
}

/// A limit that was given.
#[derive(Serialize)]
struct Limit {
    measure: &'static str,
    value: f64,
    limit: f64,
    exceeded: bool,
}

/// The picture of the errors.
#[derive(Serialize)]
struct Map {
    file: String,
    /// The error that is white.
    max: f64,
}

/// Compares, and says what came out.
pub(super) fn run(args: CompareArgs, interrupt: &Interrupt) -> Verdict {
    let console = Console::new(if args.quiet {
        Verbosity::Quiet
    } else {
        Verbosity::Normal
    });
    let destination = args.json.clone().map(Destination::new);
    if let Some(why) = lost_file(&args, destination.as_ref()) {
        console.say(&format!("fatal: {why}"));
        return Verdict::Incomparable;
    }
    let bounds = Bounds::new(args.confine.as_deref());
    let opened = bounds.and_then(|bounds| {
        let json = destination
            .as_ref()
            .map(|json| ReportSink::new(json, &bounds));
        Ok((json.transpose()?, bounds))
    });
    let (json, bounds) = match opened {
        Ok(opened) => opened,
        Err(why) => {
            console.say(&format!("fatal: {why}"));
            return Verdict::Incomparable;
        }
    };
    let mut report = Report::new(compare(&args, &bounds, &console));
    // What comes out is told as a whole.
    interrupt.conclude();
    if let Some(why) = &report.error {
        console.say(&format!("fatal: {why}"));
    }
    let mut printed = Ok(());
    if let Some(finding) = &report.finding {
        if !args.quiet && destination != Some(Destination::Stdout) {
            printed = console::print(&finding.table(args.peak.is_some()));
        }
        for complaint in finding.complaints() {
            console.note(&complaint);
        }
    }
    if let Err(why) = printed {
        report.fail(why, &console);
    }
    let written = json.map_or(Ok(()), |json| json.write(&to_json(&report)));
    if let Err(why) = written {
        report.fail(why, &console);
    }
    report.outcome
}

/// Why a file that is read, or written, would be written over.
fn lost_file(args: &CompareArgs, json: Option<&Destination>) -> Option<&'static str> {
    let json = match json {
        Some(Destination::File(file)) => Some(file.as_path()),
        Some(Destination::Stdout) | None => None,
    };
    let pictures = [&args.test, &args.reference];
    let is_picture = |file: &Path| pictures.iter().any(|picture| files::are_one(file, picture));
    let map = args.map.as_deref();
    if json.is_some_and(is_picture) {
        Some("--json would replace a picture that is compared")
    } else if map.is_some_and(is_picture) {
        Some("--map would replace a picture that is compared")
    } else if json
        .zip(map)
        .is_some_and(|(json, map)| files::are_one(json, map))
    {
        Some("--json and --map name one file")
    } else {
        None
    }
}

/// Reads both pictures, measures, and writes the map.
fn compare(args: &CompareArgs, bounds: &Bounds, console: &Console) -> Result<Finding, String> {
    let map = args.map.as_deref();
    let map_place = map.map(|map| Place::within(map, bounds)).transpose()?;
    let mut test = read(&args.test, bounds, console)?;
    let reference = read(&args.reference, bounds, console)?;
    if args.same_window {
        place_like(&mut test, &reference)?;
    }
    let window = common_window(&test, &reference)?;
    let channels = test.image.channels().max(reference.image.channels());
    let part = |file: &ImageFile| {
        let part = file
            .crop(window)
            .map(|image| with_channels(image, channels));
        part.ok_or("the pictures do not cover the common window".to_owned())
    };
    let (a, b) = (part(&test)?, part(&reference)?);
    let comparison = Comparison::new(&a, &b).map_err(|error| error.to_string())?;
    if comparison.n_compared == 0 && comparison.n_non_finite_test == 0 {
        return Err(format!(
            "no pixel of \"{}\" is finite where the pictures overlap",
            args.reference.display()
        ));
    }
    let map = match map_place {
        Some(place) => {
            let errors = metrics::luminance_errors(&a, &b).map_err(|error| error.to_string())?;
            let largest = errors.iter().flatten().copied().fold(0.0, f64::max);
            let max = args.map_max.unwrap_or(largest);
            write_map(&place, &errors, max, window)?;
            let file = place.name().display().to_string();
            Some(Map { file, max })
        }
        None => None,
    };
    let measures = Measures::new(&comparison, args.peak.unwrap_or(comparison.peak));
    Ok(Finding {
        test: Side::new(&args.test, &test, comparison.n_non_finite_test),
        reference: Side::new(
            &args.reference,
            &reference,
            comparison.n_non_finite_reference,
        ),
        compared: Compared {
            resolution: [window.width, window.height],
            window: Window::new(window),
            channels,
            pixels: comparison.n_compared,
        },
        limits: limits(args, &measures),
        measures,
        map,
    })
}

/// Reads a picture and makes it linear.
fn read(path: &Path, bounds: &Bounds, console: &Console) -> Result<ImageFile, String> {
    let refusal = |why: String| format!("cannot read \"{}\": {why}", path.display());
    let extension = extension(path);
    let bytes = files::read(path, bounds).map_err(refusal)?;
    let options = DecodeOptions {
        full_depth: true,
        max_bytes: resources::memory_left(None).unwrap_or(u64::MAX),
    };
    let Decoded { mut file, note } = codec::decode_with(&bytes, &extension, &options)
        .map_err(|error| refusal(error.to_string()))?;
    if let Some(note) = note {
        console.note(&format!("\"{}\": {note}", path.display()));
    }
    if codec::is_eight_bit(&extension) {
        srgb::linearize(&mut file.image);
    }
    Ok(file)
}

fn extension(path: &Path) -> String {
    let extension = path.extension().unwrap_or_default();
    extension.to_string_lossy().into_owned()
}

/// Puts a picture whose file does not say which part of the frame it is where the other one is.
fn place_like(test: &mut ImageFile, reference: &ImageFile) -> Result<(), String> {
    let size = |file: &ImageFile| [file.image.width(), file.image.height()];
    let ([wide, high], [b_wide, b_high]) = (size(test), size(reference));
    if [wide, high] != [b_wide, b_high] {
        return Err(format!(
            "the pictures show no part of the same size: A has {wide}x{high} pixels, B {b_wide}x{b_high}"
        ));
    }
    test.origin = reference.origin;
    test.display_window = reference.display_window;
    Ok(())
}

/// The pixels of the frame that both pictures have.
fn common_window(test: &ImageFile, reference: &ImageFile) -> Result<PixelRect, String> {
    let (a, b) = (test.display_window, reference.display_window);
    if a != b {
        return Err(format!(
            "the pictures are parts of different frames: that of A has {}, that of B {}",
            place_of(&Window::new(a)),
            place_of(&Window::new(b))
        ));
    }
    let (a, b) = (test.data_window(), reference.data_window());
    a.intersection(&b).ok_or_else(|| {
        format!(
            "the pictures do not overlap: A has {}, B {}",
            place_of(&Window::new(a)),
            place_of(&Window::new(b))
        )
    })
}

/// Grey counts for all channels where the other picture has colours.
fn with_channels(image: Image, channels: usize) -> Image {
    if image.channels() == channels {
        return image;
    }
    let (width, height) = (image.width(), image.height());
    let data = image.into_data().into_iter();
    let data = data.flat_map(|grey| [grey; 3]).collect();
    Image::new(width, height, channels, data).expect("three samples for each grey one")
}

fn limits(args: &CompareArgs, measures: &Measures) -> Vec<Limit> {
    let all = [
        ("mse", measures.mse, args.max_mse),
        ("rmse", measures.rmse, args.max_rmse),
        ("relmse", measures.relmse, args.max_relmse),
        ("mae", measures.mae, args.max_mae),
        (
            "mean_ratio_error",
            measures.mean_ratio_error,
            args.max_mean_ratio_error,
        ),
    ];
    let given = all.into_iter().filter_map(|(measure, value, limit)| {
        limit.map(|limit| Limit {
            measure,
            value,
            limit,
            // What is not a number keeps no limit.
            exceeded: !(value <= limit),
        })
    });
    given.collect()
}

/// Writes the map: `max` and above are white, pixels without an error green.
fn write_map(
    place: &Place,
    errors: &[Option<f64>],
    max: f64,
    window: PixelRect,
) -> Result<(), String> {
    let colour = |error: &Option<f64>| match error {
        // No error at all is black also where the largest one is 0.
        Some(error) if *error == 0.0 => ramp(0.0),
        Some(error) => ramp(error / max),
        None => [0.0, 1.0, 0.0],
    };
    let samples = errors.iter().flat_map(colour).collect();
    let picture = Image::new(window.width, window.height, 3, samples).and_then(|image| {
        codec::encode(
            &ImageFile::new(image),
            &extension(place.name()),
            Precision::default(),
        )
    });
    let bytes =
        picture.map_err(|error| format!("cannot write \"{}\": {error}", place.name().display()))?;
    place.write(&bytes)
}

/// Black, blue, red, yellow, white in equal steps from 0 to 1, straight lines between their sRGB codes. Linear RGB.
fn ramp(t: f64) -> [f32; 3] {
    const STOPS: [[f32; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [1.0, 1.0, 1.0],
    ];
    let last = STOPS.len() - 1;
    let place = t.clamp(0.0, 1.0) as f32 * last as f32;
    let below = (place as usize).min(last - 1);
    let (low, high) = (STOPS[below], STOPS[below + 1]);
    let weight = place - below as f32;
    std::array::from_fn(|channel| {
        srgb::to_linear(low[channel] + weight * (high[channel] - low[channel]))
    })
}

impl Report {
    fn new(result: Result<Finding, String>) -> Self {
        let (outcome, finding, error) = match result {
            Ok(finding) => (finding.verdict(), Some(finding), None),
            Err(error) => (Verdict::Incomparable, None, Some(error)),
        };
        Self {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            task: "compare",
            outcome,
            exit_code: outcome.code(),
            error,
            finding,
        }
    }

    /// An output could not be written.
    fn fail(&mut self, why: String, console: &Console) {
        console.say(&format!("fatal: {why}"));
        self.outcome = Verdict::Incomparable;
        self.exit_code = self.outcome.code();
        self.error = Some(why);
    }
}

impl Finding {
    fn verdict(&self) -> Verdict {
        if self.test.non_finite > 0 || self.limits.iter().any(|limit| limit.exceeded) {
            Verdict::Exceeded
        } else {
            Verdict::Within
        }
    }

    /// Why the verdict is not the best one, a line for each reason.
    fn complaints(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.test.non_finite > 0 {
            lines.push(format!(
                "\"{}\" has pixels that are not finite: {}",
                self.test.file, self.test.non_finite
            ));
        }
        for limit in self.limits.iter().filter(|limit| limit.exceeded) {
            lines.push(format!(
                "{} is {:e}, above the limit {:?}",
                limit.measure, limit.value, limit.limit
            ));
        }
        lines
    }

    /// For people.
    fn table(&self, peak_is_given: bool) -> String {
        let measures = &self.measures;
        let mut rows = vec![
            ("A", self.test.description()),
            ("B (reference)", self.reference.description()),
        ];
        let mut compared = place_of(&self.compared.window);
        if self.compared.pixels < self.compared.resolution.iter().product() {
            let (n_a, n_b) = (self.test.non_finite, self.reference.non_finite);
            let _ = write!(
                compared,
                ", without those not finite ({n_a} in A, {n_b} in B)"
            );
        }
        rows.push(("compared", compared));
        for (name, key, value) in [
            ("MSE", "mse", measures.mse),
            ("RMSE", "rmse", measures.rmse),
            ("relMSE", "relmse", measures.relmse),
            ("MAE", "mae", measures.mae),
        ] {
            rows.push((name, format!("{value:.6e}{}", self.limit_text(key))));
        }
        let peak_is = if peak_is_given {
            "as given"
        } else {
            "the largest value of B"
        };
        rows.push((
            "PSNR",
            format!(
                "{:.4} dB, peak {:.6e} ({peak_is})",
                measures.psnr, measures.peak
            ),
        ));
        let ratios = measures.mean_ratio.iter();
        let ratios: Vec<String> = ratios.map(|ratio| format!("{ratio:.6}")).collect();
        let limit = self.limit_text("mean_ratio_error");
        rows.push(("mean A / mean B", format!("{}{limit}", ratios.join(" "))));
        if let Some(map) = &self.map {
            rows.push((
                "map",
                format!(
                    "{}: luminance error, black 0 to white {:.6e}",
                    map.file, map.max
                ),
            ));
        }
        let mut text = String::new();
        for (name, value) in rows {
            let _ = writeln!(text, "{name:<17}{value}");
        }
        text
    }

    fn limit_text(&self, measure: &str) -> String {
        let limit = self.limits.iter().find(|limit| limit.measure == measure);
        limit.map_or(String::new(), |limit| {
            let verdict = if limit.exceeded { "EXCEEDED" } else { "ok" };
            format!("  (limit {:?}: {verdict})", limit.limit)
        })
    }
}

impl Side {
    fn new(path: &Path, file: &ImageFile, non_finite: usize) -> Self {
        Self {
            file: path.display().to_string(),
            resolution: [file.image.width(), file.image.height()],
            window: Window::new(file.data_window()),
            channels: file.image.channels(),
            made_linear: codec::is_eight_bit(&extension(path)),
            non_finite,
        }
    }

    fn description(&self) -> String {
        let linear = if self.made_linear {
            ", sRGB made linear"
        } else {
            ""
        };
        let colours = if self.channels == 1 { "grey" } else { "RGB" };
        let place = place_of(&self.window);
        format!("{}: {place}, {colours}{linear}", self.file)
    }
}

impl Measures {
    fn new(comparison: &Comparison, peak: f64) -> Self {
        Self {
            mse: comparison.mse,
            rmse: comparison.rmse(),
            relmse: comparison.rel_mse,
            mae: comparison.mae,
            psnr: comparison.psnr(peak),
            peak,
            mean_ratio: comparison.mean_ratios(),
            mean_ratio_error: comparison.mean_ratio_error(),
        }
    }
}

impl Window {
    fn new(rect: PixelRect) -> Self {
        let (x0, y0) = (i64::from(rect.x0), i64::from(rect.y0));
        Self([x0, x0 + rect.width as i64, y0, y0 + rect.height as i64])
    }
}

/// For people: size and corner.
fn place_of(window: &Window) -> String {
    let Window([x0, x1, y0, y1]) = window;
    format!("{}x{} pixels at ({x0}, {y0})", x1 - x0, y1 - y0)
}
