//! Boxes and media as scene text.

pub(crate) use crate::common::seen::{V, environment, seen_by};

/// A closed triangle box with outward normals.
pub(crate) fn box_shape(lo: V, hi: V) -> String {
    let mut points = String::new();
    for k in 0..8 {
        let pick = |axis: usize| {
            if k >> axis & 1 == 0 {
                lo[axis]
            } else {
                hi[axis]
            }
        };
        points += &format!("{} {} {}  ", pick(0), pick(1), pick(2));
    }
    let mut indices = String::new();
    for a in 0..3 {
        let (b, c) = (1 << ((a + 1) % 3), 1 << ((a + 2) % 3));
        let high = 1 << a;
        // Counter-clockwise seen from outside on the high side, and the other way round on the low side.
        for [p, q, r] in [[0, b, b + c], [0, b + c, c]] {
            indices += &format!("{} {} {}  ", p + high, q + high, r + high);
            indices += &format!("{p} {r} {q}  ");
        }
    }
    format!("Shape \"trianglemesh\" \"point P\" [{points}] \"integer indices\" [{indices}]\n")
}

/// An invisible boundary around a box.
pub(crate) fn null_box(lo: V, hi: V, inside: &str, outside: &str) -> String {
    format!(
        "AttributeBegin Material \"\" MediumInterface \"{inside}\" \"{outside}\"\n{}AttributeEnd\n",
        box_shape(lo, hi)
    )
}

/// An invisible boundary around a sphere.
pub(crate) fn null_sphere(center: V, radius: f64, inside: &str, outside: &str) -> String {
    format!(
        "AttributeBegin Material \"\" MediumInterface \"{inside}\" \"{outside}\" {}\
         Shape \"sphere\" \"float radius\" {radius} AttributeEnd\n",
        translate(center)
    )
}

/// A `Translate` directive.
pub(crate) fn translate([x, y, z]: V) -> String {
    format!("Translate {x} {y} {z} ")
}

/// A named homogeneous medium.
pub(crate) fn homogeneous(name: &str, sigma_a: V, sigma_s: V, g: f64) -> String {
    format!(
        "MakeNamedMedium \"{name}\" \"string type\" \"homogeneous\" \"float g\" {g} {}\n",
        coefficients(sigma_a, sigma_s)
    )
}

/// `sigma_a` and `sigma_s` of a medium.
pub(crate) fn coefficients(sigma_a: V, sigma_s: V) -> String {
    format!("\"rgb sigma_a\" {sigma_a:?} \"rgb sigma_s\" {sigma_s:?}").replace(',', "")
}

/// A volpath scene: the options, a camera at `eye` that looks along `toward`, then the world.
pub(crate) fn volpath(max_depth: u32, eye: V, toward: V, world: &str) -> String {
    seen_by("volpath", max_depth, eye, toward, world)
}
