//! Curves.

use glam::DVec3;
use tyndall_parser::diagnostic::Diagnostic;

use super::INSTEAD;
use crate::compile::assets::{Assets, lack_of_memory};
use crate::compile::reader::ParamReader;
use crate::shape::curve::{CurveSource, CurveStyle, MAX_SPLIT_DEPTH, spline};

/// Memory that a segment takes: its control points in double precision, and twice in single precision with its pieces.
const BYTES_PER_SEGMENT: u128 = 256;

pub(super) fn curve(p: &mut ParamReader, assets: &dyn Assets) -> Option<CurveSource> {
    let width = p.float("width");
    let widths = ["width0", "width1"].map(|name| p.optional_float(name).unwrap_or(width).into());
    let style = match p.choice("type") {
        "flat" => CurveStyle::Flat,
        "ribbon" => CurveStyle::Ribbon,
        _ => CurveStyle::Cylinder,
    };
    let split_depth = p.int("splitdepth").clamp(0, MAX_SPLIT_DEPTH as i32) as u32;
    let (basis, degree) = (p.strict_choice("basis"), p.int_choice("degree"));
    let (points_span, normals_span) = (p.span("P"), p.span("N"));
    let points = p.take_point3s("P");
    let normals = p.take_normals("N").unwrap_or_default();
    let (basis, degree, points) = (basis?, degree? as usize, points?);
    let is_finite = |v: &[f32; 3]| v.iter().all(|c| c.is_finite());
    if let Some(bad) = points.iter().position(|v| !is_finite(v)) {
        let message = format!("control point {bad} has a position that is not finite");
        p.report(Diagnostic::error("bad-vertex", points_span, message).with_label(INSTEAD));
        return None;
    }
    let wide = |v: &[f32; 3]| DVec3::from(v.map(f64::from));
    let n = points.len();
    // A Bézier curve has fewer segments than that.
    if let Some(lack) = lack_of_memory(n as u128 * BYTES_PER_SEGMENT, assets) {
        let message = format!("a curve of {n} control points {lack}");
        p.report(Diagnostic::error("too-large", points_span, message).with_label(INSTEAD));
        return None;
    }
    let points: Vec<DVec3> = points.iter().map(wide).collect();
    let segments = if basis == "bspline" {
        spline::b_spline(&points, degree)
    } else {
        spline::bezier(&points, degree)
    };
    let Some(segments) = segments else {
        let (first, more) = (degree + 1, degree);
        let message = match basis {
            "bspline" => {
                format!("a B-spline of degree {degree} needs {first} points or more, not {n}")
            }
            _ => format!(
                "a Bézier curve of degree {degree} has {first} points and {more} for each further segment, not {n}"
            ),
        };
        p.report(Diagnostic::error("value-count", points_span, message).with_label(INSTEAD));
        return None;
    };
    let normals = match style {
        CurveStyle::Ribbon => {
            let (wanted, given) = (segments.len() + 1, normals.len());
            let usable = |v: &[f32; 3]| is_finite(v) && *v != [0.0; 3];
            if given != wanted || !normals.iter().all(usable) {
                let message = if given == wanted {
                    "a normal of the ribbon has no direction".to_owned()
                } else {
                    format!(
                        "a ribbon of {} segments needs {wanted} normals, not {given}",
                        wanted - 1
                    )
                };
                p.report(
                    Diagnostic::error("value-count", normals_span, message).with_label(INSTEAD),
                );
                return None;
            }
            normals.iter().map(wide).collect()
        }
        CurveStyle::Flat | CurveStyle::Cylinder => {
            if !normals.is_empty() {
                let message = "only ribbons have normals";
                p.report(Diagnostic::warning(
                    "unused-parameter",
                    normals_span,
                    message,
                ));
            }
            Vec::new()
        }
    };
    Some(CurveSource {
        style,
        segments,
        widths,
        split_depth,
        normals,
    })
}
