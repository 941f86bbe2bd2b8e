//! Quadrics.

use glam::DVec3;
use tyndall_parser::diagnostic::Diagnostic;

use super::INSTEAD;
use crate::compile::reader::ParamReader;
use crate::shape::quadric::{self, Disk, Form, Paraboloid, Sphere};

/// The angle that is swept, in radians.
fn phi_max(p: &mut ParamReader) -> f64 {
    f64::from(p.float("phimax")).to_radians()
}

pub(super) fn sphere(p: &mut ParamReader) -> Form {
    let radius = f64::from(p.float("radius"));
    let z_min = p.optional_float("zmin").map_or(-radius, f64::from);
    let z_max = p.optional_float("zmax").map_or(radius, f64::from);
    Form::Sphere(Sphere::new(radius, z_min, z_max, phi_max(p)))
}

pub(super) fn disk(p: &mut ParamReader) -> Form {
    let [height, radius, inner] = floats(p, ["height", "radius", "innerradius"]);
    Form::Disk(Disk::new(height, radius, inner, phi_max(p)))
}

pub(super) fn cylinder(p: &mut ParamReader) -> Form {
    let [radius, z_min, z_max] = floats(p, ["radius", "zmin", "zmax"]);
    Form::Sweep(quadric::cylinder(radius, z_min, z_max, phi_max(p)))
}

pub(super) fn cone(p: &mut ParamReader) -> Option<Form> {
    let [radius, height] = floats(p, ["radius", "height"]);
    let form = quadric::cone(radius, height, phi_max(p));
    if height < 0.0 {
        let message = format!("a cone of height {height} has its tip below its base");
        let span = p.span("height");
        p.report(Diagnostic::warning("no-area", span, message).with_label(INSTEAD));
        return None;
    }
    Some(Form::Sweep(form))
}

pub(super) fn paraboloid(p: &mut ParamReader) -> Form {
    let [radius, z_min, z_max] = floats(p, ["radius", "zmin", "zmax"]);
    Form::Paraboloid(Paraboloid::new(radius, z_min, z_max, phi_max(p)))
}

pub(super) fn hyperboloid(p: &mut ParamReader) -> Form {
    let [p1, p2] = ["p1", "p2"].map(|name| DVec3::from(p.point3(name).map(f64::from)));
    quadric::hyperboloid(p1, p2, phi_max(p))
}

fn floats<const N: usize>(p: &mut ParamReader, names: [&str; N]) -> [f64; N] {
    names.map(|name| f64::from(p.float(name)))
}
