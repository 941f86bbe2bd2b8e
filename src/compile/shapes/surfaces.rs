//! Surfaces that become meshes: subdivided, height fields and patches.

use glam::{DVec3, DVec4};
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::source::Span;

use super::{INSTEAD, checked_triangles, drop_non_finite};
use crate::compile::assets::{Assets, lack_of_memory};
use crate::compile::reader::ParamReader;
use crate::shape::Mesh;
use crate::shape::heightfield;
use crate::shape::nurbs::{KnotVector, N_DICED, Patch};
use crate::shape::subdivision::loop_limit;

/// Most triangles a subdivided mesh may have, about a gigabyte of them.
const MAX_TRIANGLES: usize = 1 << 24;

/// Memory that a triangle takes while its mesh is subdivided: its corners, half edges and half a vertex, with those of the
/// level before.
const BYTES_PER_FACE: u128 = 128;

fn report(p: &mut ParamReader, code: &'static str, span: Span, message: String) {
    p.report(Diagnostic::error(code, span, message).with_label(INSTEAD));
}

pub(super) fn subdivision(p: &mut ParamReader, assets: &dyn Assets) -> Option<Mesh> {
    let (positions_span, indices_span) = (p.span("P"), p.span("indices"));
    let levels_span = p.span("levels");
    let wanted = p.int("levels").max(0) as u32;
    p.choice("scheme");
    let (positions, indices) = (p.take_point3s("P"), p.take_ints("indices"));
    let (positions, indices) = (positions?, indices?);
    let triangles = checked_triangles(p, &indices, indices_span, positions.len())?;
    let cage = Mesh {
        positions,
        triangles,
        ..Mesh::default()
    };
    let cage = drop_non_finite(cage, positions_span, p);
    let mut levels = wanted;
    while levels > 0 && cage.n_triangles() << (2 * levels) > MAX_TRIANGLES {
        levels -= 1;
    }
    if levels < wanted {
        let message = format!("{wanted} levels make more than {MAX_TRIANGLES} triangles");
        p.report(
            Diagnostic::warning("too-fine", levels_span, message)
                .with_label(format!("{levels} are used instead")),
        );
    }
    let n_bytes = (cage.n_triangles() as u128) << (2 * levels);
    if let Some(lack) = lack_of_memory(n_bytes * BYTES_PER_FACE, assets) {
        let message = format!("a mesh subdivided {levels} times {lack}");
        report(p, "too-large", levels_span, message);
        return None;
    }
    match loop_limit(&cage.positions, &cage.triangles, levels) {
        Ok(mesh) => Some(mesh),
        Err(error) => {
            report(p, "not-a-surface", indices_span, error.to_string());
            None
        }
    }
}

/// A required number of something along one side of a grid.
fn count(p: &mut ParamReader, name: &str) -> Option<usize> {
    p.optional_int(name).and_then(|n| usize::try_from(n).ok())
}

/// Memory that a vertex of a grid takes with its part of the triangles.
const BYTES_PER_VERTEX: u128 = 64;

/// Whether there is memory for a grid of so many vertices; if not, that is reported.
fn grid_fits(p: &mut ParamReader, n_vertices: usize, span: Span, assets: &dyn Assets) -> bool {
    let lack = lack_of_memory(n_vertices as u128 * BYTES_PER_VERTEX, assets);
    if let Some(lack) = &lack {
        let message = format!("a mesh of {n_vertices} vertices {lack}");
        report(p, "too-large", span, message);
    }
    lack.is_none()
}

pub(super) fn heightfield(p: &mut ParamReader, assets: &dyn Assets) -> Option<Mesh> {
    let span = p.span("Pz");
    let (nu, nv, heights) = (count(p, "nu"), count(p, "nv"), p.take_floats("Pz"));
    let (nu, nv, heights) = (nu?, nv?, heights?);
    if nu < 2 || nv < 2 || nu.checked_mul(nv) != Some(heights.len()) {
        let message = format!("{nu} by {nv} heights are not {}", heights.len());
        report(p, "value-count", span, message);
        return None;
    }
    if !grid_fits(p, heights.len(), span, assets) {
        return None;
    }
    let mesh = heightfield::heightfield(&heights, nu, nv);
    Some(drop_non_finite(mesh, span, p))
}

pub(super) fn nurbs(p: &mut ParamReader, assets: &dyn Assets) -> Option<Mesh> {
    let [nu, nv] = ["nu", "nv"].map(|name| count(p, name));
    let u = knots(p, nu, "uorder", "uknots");
    let v = knots(p, nv, "vorder", "vknots");
    let points_span = p.span(if p.is_given("P") { "P" } else { "Pw" });
    let points = control_points(p);
    let (u, v, points) = (u?, v?, points?);
    let (nu, nv) = (nu?, nv?);
    if nu.checked_mul(nv) != Some(points.len()) {
        let message = format!("{nu} by {nv} control points are not {}", points.len());
        report(p, "value-count", points_span, message);
        return None;
    }
    let [u0, u1] = part(p, &u, ["u0", "u1"])?;
    let [v0, v1] = part(p, &v, ["v0", "v1"])?;
    if !grid_fits(p, N_DICED * N_DICED, points_span, assets) {
        return None;
    }
    let mesh = Patch { u, v, points }.diced([u0, v0], [u1, v1]);
    Some(drop_non_finite(mesh, points_span, p))
}

fn knots(
    p: &mut ParamReader,
    n_points: Option<usize>,
    order: &str,
    knots: &str,
) -> Option<KnotVector> {
    let span = p.span(knots);
    let (order, knots) = (count(p, order), p.take_floats(knots));
    match KnotVector::new(&knots?, order?, n_points?) {
        Ok(vector) => Some(vector),
        Err(error) => {
            report(p, "bad-knots", span, error.to_string());
            None
        }
    }
}

/// Control points in homogeneous coordinates.
fn control_points(p: &mut ParamReader) -> Option<Vec<DVec4>> {
    let span = p.span("Pw");
    if let Some(points) = p.take_point3s("P") {
        let wide = |point: [f32; 3]| DVec3::from(point.map(f64::from)).extend(1.0);
        return Some(points.into_iter().map(wide).collect());
    }
    let Some(numbers) = p.take_floats("Pw") else {
        let message = "shape \"nurbs\" needs control points, \"P\" or \"Pw\"".to_owned();
        report(p, "missing-parameter", p.kind_span(), message);
        return None;
    };
    let (points, rest) = numbers.as_chunks::<4>();
    if !rest.is_empty() {
        let message = format!("{} numbers are not points of four", numbers.len());
        report(p, "value-count", span, message);
        return None;
    }
    let wide = |point: &[f32; 4]| DVec4::from(point.map(f64::from));
    Some(points.iter().map(wide).collect())
}

/// The part of the parameter range that is asked for.
fn part(p: &mut ParamReader, knots: &KnotVector, names: [&str; 2]) -> Option<[f64; 2]> {
    let range = knots.range();
    let mut ends = range;
    for (end, name) in ends.iter_mut().zip(names) {
        let Some(given) = p.optional_float(name).map(f64::from) else {
            continue;
        };
        if !(given >= range[0] && given <= range[1]) {
            let message = format!(
                "{name} is {given}, but the knots go from {} to {}",
                range[0], range[1]
            );
            let span = p.span(name);
            report(p, "out-of-range", span, message);
            return None;
        }
        *end = given;
    }
    Some(ends)
}
