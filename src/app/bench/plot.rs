//! The plots: error over processor time for each scene, and one of all efficiencies. Log-log, SVG.

use std::error::Error;
use std::ops::Range;

use plotters::chart::ChartContext;
use plotters::coord::cartesian::Cartesian2d;
use plotters::coord::ranged1d::Ranged;
use plotters::prelude::{
    BLACK, ChartBuilder, Circle, Color, IntoDrawingArea, IntoLogRange, IntoSegmentedCoord,
    LineSeries, RGBColor, SVGBackend, SegmentValue, SeriesLabelPosition, TRANSPARENT, WHITE,
};

use super::contest::Run;
use super::suite::OURS;
use super::summary::{Rival, SceneSummary};

/// Pixels of a scene's plot.
const SIZE: (u32, u32) = (640, 420);
/// Pixels of a row of the plot of all, and of what is above and below the rows.
const ROW: u32 = 26;
const FRAME: u32 = 120;
const WIDTH: u32 = 760;
/// Most lines along an axis; those of 1, 2, 3 and 5 are labelled.
const N_LINES: usize = 40;
const FONT: &str = "sans-serif";
const GREY: RGBColor = RGBColor(120, 120, 120);

/// Colours that the colour-blind tell apart (Okabe and Ito, "Color universal design", 2008): ours first.
const COLOURS: [RGBColor; 7] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];

/// Why there is no plot.
type Failure = Box<dyn Error + Send + Sync>;

/// A point of a log-log plot.
type Point = (f64, f64);

/// A renderer's runs, and the line through the means at each sample count.
struct Series<'a> {
    name: &'a str,
    runs: Vec<Point>,
    line: Vec<Point>,
}

/// Mean squared error over processor seconds. `None` if nothing was measured.
pub(super) fn scene(summary: &SceneSummary, runs: &[Run]) -> Result<Option<String>, Failure> {
    let series: Vec<Series<'_>> = summary
        .renderers
        .iter()
        .map(|renderer| Series {
            name: &renderer.renderer,
            runs: runs
                .iter()
                .filter(|run| run.renderer == renderer.renderer && run.scene == summary.scene)
                .filter_map(|run| point(run.cpu_seconds?, run.mse?))
                .collect(),
            line: renderer
                .figures
                .iter()
                .filter_map(|figures| point(figures.cpu_seconds?, figures.mse))
                .collect(),
        })
        .collect();
    let points = || {
        series
            .iter()
            .flat_map(|series| series.runs.iter().chain(&series.line))
    };
    let (Some(x), Some(y)) = (
        range(points().map(|point| point.0)),
        range(points().map(|point| point.1)),
    ) else {
        return Ok(None);
    };
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(&summary.scene, (FONT, 20))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(70)
            .build_cartesian_2d(x.log_scale(), y.log_scale())?;
        chart
            .configure_mesh()
            .x_desc("processor seconds")
            .y_desc("mean squared error")
            .x_label_formatter(&|x| label(*x))
            .y_label_formatter(&|y| label(*y))
            .label_style((FONT, 13))
            .axis_desc_style((FONT, 14))
            .bold_line_style(GREY.mix(0.35))
            .light_line_style(TRANSPARENT)
            .x_labels(N_LINES)
            .y_labels(N_LINES)
            .draw()?;
        for (series, colour) in series.iter().zip(COLOURS.iter().cycle()) {
            if series.line.is_empty() {
                continue;
            }
            let line = LineSeries::new(series.line.iter().copied(), colour.stroke_width(2));
            chart
                .draw_series(line)?
                .label(series.name)
                .legend(move |(x, y)| Circle::new((x + 10, y), 4, colour.filled()));
            let means = series.line.iter();
            chart.draw_series(means.map(|&at| Circle::new(at, 4, colour.filled())))?;
            let runs = series.runs.iter();
            chart.draw_series(runs.map(|&at| Circle::new(at, 2, colour.mix(0.6))))?;
        }
        draw_legend(&mut chart)?;
        root.present()?;
    }
    Ok(Some(svg))
}

/// Our efficiency over that of each other renderer, a row for each scene. `None` if there is nothing to compare.
pub(super) fn efficiencies(
    scenes: &[SceneSummary],
    rivals: &[&Rival],
) -> Result<Option<String>, Failure> {
    let all = || scenes.iter().flat_map(|scene| &scene.ratios);
    let values = all().filter_map(|row| row.ratios.efficiency);
    // The line of equal efficiency is always in sight.
    let Some(x) = range(values.chain([1.0])).filter(|_| all().next().is_some()) else {
        return Ok(None);
    };
    // The legend has rows of its own on top; then comes the first scene.
    let n_rows = scenes.len() as i32;
    let n_all = n_rows + rivals.len() as i32;
    let row_of = |i: usize| SegmentValue::CenterOf(n_rows - 1 - i as i32);
    let mut svg = String::new();
    {
        let size = (WIDTH, FRAME + ROW * n_all.unsigned_abs());
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&root)
            .caption(format!("Efficiency of {OURS} over others"), (FONT, 20))
            .margin(12)
            .margin_right(24)
            .x_label_area_size(44)
            .y_label_area_size(190)
            .build_cartesian_2d(x.clone().log_scale(), (0..n_all).into_segmented())?;
        let name_of_row = |value: &SegmentValue<i32>| match value {
            SegmentValue::CenterOf(row) => usize::try_from(n_rows - 1 - row)
                .ok()
                .and_then(|i| scenes.get(i))
                .map_or_else(String::new, |scene| scene.scene.clone()),
            SegmentValue::Exact(_) | SegmentValue::Last => String::new(),
        };
        chart
            .configure_mesh()
            .disable_y_mesh()
            .x_labels(N_LINES)
            .y_labels(n_all.unsigned_abs() as usize + 1)
            .x_desc("ratio of 1 / (processor seconds x mean squared error); right is better")
            .x_label_formatter(&|x| label(*x))
            .y_label_formatter(&name_of_row)
            .label_style((FONT, 13))
            .axis_desc_style((FONT, 14))
            .bold_line_style(GREY.mix(0.35))
            .light_line_style(TRANSPARENT)
            .draw()?;
        let equal = [SegmentValue::Exact(0), SegmentValue::Last].map(|row| (1.0, row));
        chart.draw_series(LineSeries::new(equal, BLACK.stroke_width(2)))?;
        for (rival, colour) in rivals.iter().zip(COLOURS.iter().skip(1).cycle()) {
            let rows = scenes.iter().enumerate().filter_map(|(i, scene)| {
                let row = scene.ratios.iter().find(|row| row.rival == **rival)?;
                Some((row.ratios.efficiency?, row_of(i)))
            });
            let style = match rival.derived_via {
                Some(_) => colour.stroke_width(2),
                None => colour.filled(),
            };
            chart
                .draw_series(rows.map(|at| Circle::new(at, 5, style)))?
                .label(rival.text())
                .legend(move |(x, y)| Circle::new((x + 10, y), 5, style));
        }
        draw_legend(&mut chart)?;
        root.present()?;
    }
    Ok(Some(svg))
}

/// The names of all series, in a corner.
fn draw_legend<'a, X, Y>(
    chart: &mut ChartContext<'a, SVGBackend<'a>, Cartesian2d<X, Y>>,
) -> Result<(), Failure>
where
    X: Ranged,
    Y: Ranged,
{
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .label_font((FONT, 14))
        .background_style(WHITE.mix(0.85))
        .border_style(GREY.mix(0.4))
        .draw()?;
    Ok(())
}

/// What logarithms can show.
fn point(x: f64, y: f64) -> Option<Point> {
    (x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite()).then_some((x, y))
}

/// From the least to the greatest, with some room on either side. `None` of nothing.
fn range(values: impl Iterator<Item = f64> + Clone) -> Option<Range<f64>> {
    const ROOM: f64 = 1.5;
    let least = values.clone().reduce(f64::min)?;
    let greatest = values.reduce(f64::max)?;
    Some(least / ROOM..greatest * ROOM)
}

/// The number beside a line of a logarithmic axis; nothing where it would be too close to the next.
fn label(value: f64) -> String {
    let digit = (value / 10f64.powf(value.log10().floor())).round();
    // A power of ten may have been rounded down.
    if [1.0, 2.0, 3.0, 5.0, 10.0].contains(&digit) {
        number(value)
    } else {
        String::new()
    }
}

/// As short as it can be.
fn number(value: f64) -> String {
    if (1e-3..1e4).contains(&value) {
        // Ticks are computed, and must not show their last bits.
        let text = format!("{value:.4}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{value:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::{label, number, range};

    #[test]
    fn labels_are_short() {
        assert_eq!(number(0.1 + 0.2), "0.3");
        assert_eq!(number(20.0), "20");
        assert_eq!(number(1e-5), "1e-5");
        let labels = [0.01, 0.02, 0.04, 0.1 + 0.2, 7.0, 1000.0].map(label);
        assert_eq!(labels, ["0.01", "0.02", "", "0.3", "", "1000"]);
    }

    #[test]
    fn ranges_leave_room() {
        assert_eq!(range([3.0, 1.5, 6.0].into_iter()), Some(1.0..9.0));
        assert_eq!(range(std::iter::empty()), None);
    }
}
