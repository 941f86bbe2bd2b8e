//! The results as JSON, CSV and Markdown. `docs/cli.md` describes every field.

use std::fmt::Write;

use serde::Serialize;

use super::contest::Run;
use super::fit::{Convergence, Verdict};
use super::suite::{OURS, Suite};
use super::summary::{Figures, MeanRatios, Ratios, RendererSummary, Rival, SceneSummary};
use crate::app::outcome::Outcome;

/// Version of the report: raised when a field is removed or changes its meaning, not when one is added.
const SCHEMA: u32 = 1;
/// What a table says where there is no number.
const NOTHING: &str = "–";

/// Everything that is known at the end.
#[derive(Serialize, Debug)]
pub(super) struct Report {
    schema: u32,
    version: &'static str,
    task: &'static str,
    pub(super) outcome: Outcome,
    pub(super) exit_code: u8,
    title: String,
    threads: u32,
    /// A child's peak memory is never reported below this.
    memory_floor_bytes: Option<u64>,
    renderers: Vec<RendererReport>,
    /// Scenes that were not rendered, and why.
    skipped: Vec<Skipped>,
    pub(super) means: Vec<MeanRatios>,
    pub(super) scenes: Vec<SceneSummary>,
    pub(super) runs: Vec<Run>,
}

#[derive(Serialize, Debug)]
struct RendererReport {
    name: String,
    version: Option<String>,
    command: Option<String>,
    known: Vec<KnownReport>,
}

#[derive(Serialize, Debug)]
struct KnownReport {
    name: String,
    source: String,
}

/// A scene without a file or a reference.
#[derive(Serialize, Clone, PartialEq, Eq, Debug)]
pub(super) struct Skipped {
    pub(super) scene: String,
    pub(super) why: String,
}

/// What a report is made of.
pub(super) struct Parts {
    pub(super) outcome: Outcome,
    pub(super) memory_floor_bytes: Option<u64>,
    /// One for each peer.
    pub(super) versions: Vec<Option<String>>,
    pub(super) skipped: Vec<Skipped>,
    pub(super) means: Vec<MeanRatios>,
    pub(super) scenes: Vec<SceneSummary>,
    pub(super) runs: Vec<Run>,
}

impl Report {
    pub(super) fn new(suite: &Suite, parts: Parts) -> Self {
        let ours = RendererReport {
            name: OURS.to_owned(),
            version: Some(env!("CARGO_PKG_VERSION").to_owned()),
            command: None,
            known: Vec::new(),
        };
        let peers = suite
            .peers
            .iter()
            .zip(parts.versions)
            .map(|(peer, version)| {
                let known = peer.known.iter().map(|known| KnownReport {
                    name: known.name.clone(),
                    source: known.source.clone(),
                });
                RendererReport {
                    name: peer.name.clone(),
                    version,
                    command: Some(peer.command.join(" ")),
                    known: known.collect(),
                }
            });
        Self {
            schema: SCHEMA,
            version: env!("CARGO_PKG_VERSION"),
            task: "bench",
            outcome: parts.outcome,
            exit_code: parts.outcome.code(),
            title: suite.title.clone(),
            threads: suite.threads,
            memory_floor_bytes: parts.memory_floor_bytes,
            renderers: std::iter::once(ours).chain(peers).collect(),
            skipped: parts.skipped,
            means: parts.means,
            scenes: parts.scenes,
            runs: parts.runs,
        }
    }

    /// A line for each run.
    ///
    /// # Errors
    /// None that memory does not make.
    pub(super) fn to_csv(&self) -> Result<Vec<u8>, String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for run in &self.runs {
            writer.serialize(run).map_err(|error| error.to_string())?;
        }
        writer.into_inner().map_err(|error| error.to_string())
    }

    /// For people: ratios, then figures, then what is to be said about them. `plots` are files by scene.
    pub(super) fn to_markdown(&self, plots: &[(String, String)], overview: Option<&str>) -> String {
        let mut text = String::new();
        if !self.title.is_empty() {
            let _ = writeln!(text, "# {}\n", self.title);
        }
        self.write_head(&mut text);
        if let Some(file) = overview {
            let _ = writeln!(text, "![Efficiency over other renderers]({file})\n");
        }
        self.write_ratios(&mut text);
        self.write_figures(&mut text);
        self.write_convergence(&mut text);
        self.write_remarks(&mut text);
        if !plots.is_empty() {
            text.push_str("## Error over processor time\n\n");
            for (scene, file) in plots {
                let _ = writeln!(text, "![{scene}]({file})\n");
            }
        }
        text
    }

    fn write_head(&self, text: &mut String) {
        for renderer in &self.renderers {
            let version = renderer.version.as_deref().unwrap_or("version unknown");
            let _ = write!(text, "- {}: {version}", renderer.name);
            if let Some(command) = &renderer.command {
                let _ = write!(text, ", `{command}`");
            }
            text.push('\n');
            for known in &renderer.known {
                let name = &known.name;
                let _ = writeln!(text, "- {name}, derived: {}", known.source);
            }
        }
        let _ = writeln!(
            text,
            "\n{} threads each; CPU seconds are those of the whole process, program and system. \
             Efficiency is 1 / (CPU seconds × MSE).\n",
            self.threads
        );
    }

    fn write_ratios(&self, text: &mut String) {
        if self.means.is_empty() {
            return;
        }
        let _ = writeln!(
            text,
            "## {OURS} over others\n\n\
             Ours divided by theirs at the same number of samples. Less than 1 is better for CPU, error and memory, \
             more than 1 for efficiency.\n"
        );
        for mean in &self.means {
            let _ = writeln!(text, "### Over {}\n", mean.rival.text());
            let columns = [
                "scene",
                "spp",
                "CPU",
                "MSE",
                "relMSE",
                "memory",
                "efficiency",
                "by relMSE",
            ];
            write_header(text, &columns, 2);
            for scene in &self.scenes {
                for row in scene.ratios.iter().filter(|row| row.rival == mean.rival) {
                    let cells = row.ratios.columns().map(significant);
                    write_row(text, &[&scene.scene, &row.spp.to_string()], &cells);
                }
            }
            let bold = |ratio| format!("**{}**", significant(ratio));
            let head = format!("**geometric mean of {}**", mean.n_scenes);
            write_row(text, &[&head, ""], &mean.ratios.columns().map(bold));
            text.push('\n');
        }
    }

    fn write_figures(&self, text: &mut String) {
        text.push_str("## Figures\n\nMedians of time and memory, means of errors.\n\n");
        let columns = [
            "scene",
            "renderer",
            "spp",
            "runs",
            "CPU s",
            "wall s",
            "load s",
            "MiB",
            "MSE",
            "relMSE",
            "mean / reference",
        ];
        write_header(text, &columns, 2);
        for scene in &self.scenes {
            for renderer in &scene.renderers {
                for figures in &renderer.figures {
                    let cells = figures.cells();
                    write_row(text, &[&scene.scene, &renderer.renderer], &cells);
                }
                for failure in &renderer.failures {
                    let _ = writeln!(
                        text,
                        "| {} | {} | failed: {} |",
                        scene.scene,
                        renderer.renderer,
                        in_a_cell(failure)
                    );
                }
            }
        }
        text.push('\n');
    }

    fn write_convergence(&self, text: &mut String) {
        let rows = || {
            self.scenes.iter().flat_map(|scene| {
                let fits = scene.renderers.iter();
                fits.filter_map(move |renderer| Some((scene, renderer, renderer.convergence?)))
            })
        };
        if rows().next().is_none() {
            return;
        }
        text.push_str(
            "## Convergence\n\n\
             Slope of ln MSE over ln spp: independent samples of the right picture have −1, well spread ones less. \
             That of the variance between seeds knows no reference, and no noise of it. The floor b of \
             MSE = a / spp + b is what more samples do not remove.\n\n",
        );
        let columns = [
            "scene",
            "renderer",
            "slope",
            "of variance",
            "floor",
            "share of MSE",
            "reference's noise",
            "verdict",
        ];
        write_header(text, &columns, 2);
        for (scene, renderer, fit) in rows() {
            let cells = [
                with_error(fit.slope.value, fit.slope.standard_error),
                fit.slope_of_variance.map_or(NOTHING.to_owned(), |slope| {
                    with_error(slope.value, slope.standard_error)
                }),
                with_error(fit.floor.value, fit.floor.standard_error),
                format!("{:.0} %", 100.0 * fit.floor_share.max(0.0)),
                significant(scene.reference_noise),
                fit.verdict.text().to_owned(),
            ];
            write_row(text, &[&scene.scene, &renderer.renderer], &cells);
        }
        text.push('\n');
    }

    fn write_remarks(&self, text: &mut String) {
        let mut lines = Vec::new();
        for scene in &self.scenes {
            for renderer in &scene.renderers {
                lines.extend(renderer.warning(&scene.scene));
                let (name, scene) = (&renderer.renderer, &scene.scene);
                let remarks = renderer.remarks.iter();
                lines.extend(remarks.map(|remark| format!("{scene}, {name}: {remark}")));
            }
        }
        let skipped = self.skipped.iter();
        lines.extend(skipped.map(|skipped| format!("{}: skipped: {}", skipped.scene, skipped.why)));
        if lines.is_empty() {
            return;
        }
        text.push_str("## Remarks\n\n");
        for line in lines {
            let _ = writeln!(text, "- {line}");
        }
        text.push('\n');
    }
}

impl Rival {
    /// For people.
    pub(super) fn text(&self) -> String {
        match &self.derived_via {
            Some(peer) => format!("{} (derived via {peer})", self.over),
            None => self.over.clone(),
        }
    }
}

impl Ratios {
    /// In the order of the table's columns.
    fn columns(&self) -> [Option<f64>; 6] {
        [
            self.cpu,
            self.mse,
            self.relmse,
            self.memory,
            self.efficiency,
            self.relative_efficiency,
        ]
    }
}

impl RendererSummary {
    /// What must not be overlooked about its convergence.
    pub(super) fn warning(&self, scene: &str) -> Option<String> {
        let Convergence {
            floor,
            floor_share,
            verdict,
            ..
        } = self.convergence?;
        let name = &self.renderer;
        match verdict {
            Verdict::Converges => None,
            Verdict::ReferenceNoise => Some(format!(
                "{scene}, {name}: the error flattens at {:.2e}, as the noise of the reference explains",
                floor.value
            )),
            Verdict::Flattens => Some(format!(
                "{scene}, {name}: the error flattens at {:.2e}, {:.0} % of what is left: \
                 the picture is biased, or the reference is",
                floor.value,
                100.0 * floor_share
            )),
        }
    }
}

impl Verdict {
    fn text(self) -> &'static str {
        match self {
            Self::Converges => "converges",
            Self::ReferenceNoise => "the reference's noise",
            Self::Flattens => "**flattens: bias**",
        }
    }
}

impl Figures {
    fn cells(&self) -> [String; 9] {
        let mebibytes = self
            .peak_memory_bytes
            .map(|bytes| bytes / f64::from(1 << 20));
        let ratio = self.mean_ratio.map(|ratio| format!("{ratio:.4}"));
        [
            self.spp.to_string(),
            self.n_runs.to_string(),
            significant(self.cpu_seconds),
            significant(self.wall_seconds),
            significant(self.load_seconds),
            significant(mebibytes),
            significant(Some(self.mse)),
            significant(self.relmse),
            ratio.unwrap_or_else(|| NOTHING.to_owned()),
        ]
    }
}

/// The first `n_left` columns are text, the others numbers.
fn write_header(text: &mut String, columns: &[&str], n_left: usize) {
    let _ = writeln!(text, "| {} |", columns.join(" | "));
    for i in 0..columns.len() {
        text.push_str(if i < n_left { "|---" } else { "|--:" });
    }
    text.push_str("|\n");
}

fn write_row(text: &mut String, names: &[&str], cells: &[String]) {
    for cell in names
        .iter()
        .copied()
        .chain(cells.iter().map(String::as_str))
    {
        let _ = write!(text, "| {cell} ");
    }
    text.push_str("|\n");
}

/// Whatever a program said, on one line and without bars.
fn in_a_cell(text: &str) -> String {
    text.replace('|', "/").replace(['\n', '\r'], " ")
}

/// Three digits that count.
fn significant(value: Option<f64>) -> String {
    let Some(value) = value else {
        return NOTHING.to_owned();
    };
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.2e}");
    }
    let n_integer_digits = magnitude.max(1e-3).log10().floor() as i32 + 1;
    let n_decimals = usize::try_from(3 - n_integer_digits).unwrap_or(0);
    format!("{value:.n_decimals$}")
}

fn with_error(value: f64, error: Option<f64>) -> String {
    let (value, error) = (
        significant(Some(value)),
        error.map(|error| significant(Some(error))),
    );
    match error {
        Some(error) => format!("{value} ± {error}"),
        None => value,
    }
}

#[cfg(test)]
mod tests {
    use super::{significant, with_error};

    #[test]
    fn numbers_have_three_digits() {
        let texts =
            [0.0123, 0.12345, 1.2345, 12.345, 123.45, 1234.5, 1.2e-5].map(|x| significant(Some(x)));
        assert_eq!(
            texts,
            ["0.0123", "0.123", "1.23", "12.3", "123", "1234", "1.20e-5"]
        );
        assert_eq!(significant(None), "–");
        assert_eq!(with_error(-1.0, Some(0.025)), "-1.00 ± 0.0250");
    }
}
