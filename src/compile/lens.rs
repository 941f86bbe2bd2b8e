//! The realistic camera: its lens table and what can be wrong with it.

use tyndall_parser::diagnostic::{Diagnostic, Severity};
use tyndall_parser::source::Spanned;

use crate::camera::Realistic;
use crate::camera::lens::{Interface, Lens};
use crate::camera::realistic::Weighting;
use crate::compile::assets::{Assets, read_numbers};
use crate::compile::reader::ParamReader;

/// Lens tables are in millimetres, camera space is in metres.
const METRES: f64 = 1e-3;
/// Most interfaces of a lens. Every ray meets all of them.
const MAX_INTERFACES: usize = 1024;

/// Reads a realistic camera. What is wrong with it is reported; then nothing is rendered.
pub(super) fn realistic(
    p: &mut ParamReader<'_>,
    diagonal: f64,
    resolution: [u32; 2],
    shutter: [f32; 2],
    assets: &dyn Assets,
) -> Option<Realistic> {
    // Every parameter is read before anything fails, so that all faults are reported at once.
    let file = p.file("lensfile");
    let stop_radius = f64::from(p.float("aperturediameter")) * METRES * 0.5;
    let focus_distance = f64::from(p.float("focusdistance"));
    let weighting = if p.bool("simpleweighting") {
        Weighting::Simple
    } else {
        Weighting::Exposure(f64::from(shutter[1]) - f64::from(shutter[0]))
    };
    let file = file?;
    let mut interfaces = match table(p, &file, assets) {
        Ok(interfaces) => interfaces,
        Err(finding) => {
            let finding = Diagnostic {
                severity: Severity::Fatal,
                ..finding.with_label("nothing is rendered")
            };
            p.report(finding);
            return None;
        }
    };
    set_stop(p, &mut interfaces, stop_radius);
    let lens = match Lens::new(&interfaces).focused(focus_distance) {
        Ok(lens) => lens,
        Err(error) => {
            let span = p.span("focusdistance");
            p.report(
                Diagnostic::fatal("unfocused-lens", span, error.to_string())
                    .with_label("nothing is rendered"),
            );
            return None;
        }
    };
    let camera = Realistic::new(lens, diagonal * METRES, resolution, weighting);
    camera
        .map_err(|error| {
            let message = format!("{}: {error}", file.value);
            let diagnostic = Diagnostic::fatal("bad-lens", file.span, message);
            p.report(diagnostic.with_label("nothing is rendered"));
        })
        .ok()
}

/// The rows of a lens table, or why there are none.
fn table(
    p: &mut ParamReader<'_>,
    file: &Spanned<String>,
    assets: &dyn Assets,
) -> Result<Vec<Interface>, Box<Diagnostic>> {
    let numbers = read_numbers(file, assets)?;
    let path = &file.value;
    for warning in &numbers.warnings {
        let message = format!("{path}: {warning}");
        p.report(Diagnostic::warning("lens-file", file.span, message));
    }
    let bad = |what: String| {
        let message = format!("{path}: {what}");
        Box::new(Diagnostic::error("bad-lens", file.span, message))
    };
    let (rows, rest) = numbers.values.as_chunks::<4>();
    if rows.is_empty() || !rest.is_empty() {
        let n = numbers.values.len();
        return Err(bad(format!("{n} numbers make no rows of 4")));
    }
    if rows.len() > MAX_INTERFACES {
        return Err(bad(format!("more than {MAX_INTERFACES} interfaces")));
    }
    let row = |(k, row): (usize, &[f64; 4])| {
        let number = k + 1;
        // In single precision, as parameters are: the stop of the table and that of the scene compare as written.
        let [radius, thickness, eta, diameter] = row.map(|x| f64::from(x as f32));
        if ![radius, thickness, eta, diameter]
            .iter()
            .all(|x| x.is_finite())
        {
            return Err(bad(format!("interface {number} has an infinite number")));
        }
        if eta < 0.0 {
            return Err(bad(format!("interface {number} has the index {eta}")));
        }
        if !(diameter > 0.0) {
            return Err(bad(format!(
                "interface {number} has an aperture of {diameter} mm: nothing gets through"
            )));
        }
        Ok(Interface {
            curvature_radius: radius * METRES,
            thickness: thickness * METRES,
            // Tables write 0 for air, at stops above all.
            eta: if eta == 0.0 { 1.0 } else { eta },
            aperture_radius: diameter * METRES * 0.5,
        })
    };
    rows.iter().enumerate().map(row).collect()
}

/// Sets the aperture of the stop, which can be closed but not opened beyond the table's.
fn set_stop(p: &mut ParamReader<'_>, interfaces: &mut [Interface], radius: f64) {
    let mut n_stops = 0;
    for stop in interfaces.iter_mut().filter(|i| i.curvature_radius == 0.0) {
        n_stops += 1;
        if radius <= stop.aperture_radius {
            stop.aperture_radius = radius;
            continue;
        }
        let widest = 2.0 * stop.aperture_radius / METRES;
        let message = format!("the stop of this lens opens to {widest} mm at most");
        let span = p.span("aperturediameter");
        p.report(
            Diagnostic::warning("wide-aperture", span, message)
                .with_label(format!("{widest} is used instead")),
        );
    }
    if n_stops == 0 {
        let message = "the lens has no stop: \"aperturediameter\" has no effect";
        let span = p.span("lensfile");
        p.report(
            Diagnostic::warning("no-stop", span, message).with_help("a row of radius 0 is a stop"),
        );
    }
}
