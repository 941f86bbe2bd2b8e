//! The matrices of the transform directives, in double precision, with the degenerate ones refused.

use crate::math::transform::is_tame;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::source::Span;

/// Relative size of what rounding leaves of a quantity that is zero in exact arithmetic.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// A refused directive.
pub(super) type Refused = Box<Diagnostic>;

/// Refuses numbers that are not finite.
///
/// # Errors
/// `not-finite`, at the directive.
pub(super) fn finite(numbers: &[f64], keyword: &str, span: Span) -> Result<(), Refused> {
    match numbers.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(index) => Err(Box::new(
            Diagnostic::error(
                "not-finite",
                span,
                format!("number {} of {keyword} is {}", index + 1, numbers[index]),
            )
            .with_label("this transform is left out"),
        )),
    }
}

/// `Translate`.
///
/// # Errors
/// Numbers that are not finite.
pub(super) fn translate(delta: [f64; 3], span: Span) -> Result<DMat4, Refused> {
    finite(&delta, "Translate", span)?;
    Ok(DMat4::from_translation(DVec3::from_array(delta)))
}

/// `Scale`.
///
/// # Errors
/// Numbers that are not finite, a factor of zero.
pub(super) fn scale(factors: [f64; 3], span: Span) -> Result<DMat4, Refused> {
    finite(&factors, "Scale", span)?;
    match factors.iter().position(|x| *x == 0.0) {
        None => Ok(DMat4::from_scale(DVec3::from_array(factors))),
        Some(axis) => Err(Box::new(
            Diagnostic::error(
                "singular-transform",
                span,
                format!(
                    "Scale by zero along {} flattens space",
                    ["x", "y", "z"][axis]
                ),
            )
            .with_label("this transform is left out")
            .with_help("a flat shape needs no scale: disk and trianglemesh are flat by themselves"),
        )),
    }
}

/// `Rotate`: by the right-hand rule about an axis of any length above zero.
///
/// # Errors
/// Numbers that are not finite, an axis of length zero.
pub(super) fn rotate(degrees: f64, axis: [f64; 3], span: Span) -> Result<DMat4, Refused> {
    finite(&[degrees, axis[0], axis[1], axis[2]], "Rotate", span)?;
    let axis = direction(DVec3::from_array(axis)).ok_or_else(|| {
        Box::new(
            Diagnostic::error("zero-axis", span, "Rotate about an axis of length zero")
                .with_label("this transform is left out")
                .with_help("the axis follows the angle, e.g. `Rotate 90 0 0 1`"),
        )
    })?;
    Ok(DMat4::from_axis_angle(axis, degrees.to_radians()))
}

/// `LookAt`: camera from world, left-handed (+x right, +y up, +z forward). The second part warns of an up
/// direction that was replaced because it is zero or parallel to the view.
///
/// # Errors
/// Numbers that are not finite, a target that is the eye.
pub(super) fn look_at(
    eye: [f64; 3],
    target: [f64; 3],
    up: [f64; 3],
    span: Span,
) -> Result<(DMat4, Option<Diagnostic>), Refused> {
    finite(&[eye, target, up].concat(), "LookAt", span)?;
    let (eye, target, up) = (
        DVec3::from_array(eye),
        DVec3::from_array(target),
        DVec3::from_array(up),
    );
    let forward = direction(target - eye).ok_or_else(|| {
        Box::new(
            Diagnostic::error("degenerate-look-at", span, "LookAt from a point to itself")
                .with_label("eye and target are the same; this transform is left out"),
        )
    })?;
    let side = direction(up)
        .map(|up| up.cross(forward))
        .filter(|side| side.length() > ROUNDING);
    let (right, warning) = match side {
        Some(side) => (side.normalize(), None),
        None => {
            let warning = Diagnostic::warning(
                "degenerate-look-at",
                span,
                "the up direction of LookAt is zero or parallel to the view",
            )
            .with_label("some perpendicular direction is up instead");
            (forward.any_orthonormal_vector(), Some(warning))
        }
    };
    let world_from_camera = DMat3::from_cols(right, forward.cross(right), forward);
    let camera_from_world = world_from_camera.transpose();
    let matrix = DMat4::from_mat3(camera_from_world) * DMat4::from_translation(-eye);
    Ok((matrix, warning))
}

/// The matrix of `Transform` and `ConcatTransform`, column-major. The second part reports a projective matrix,
/// whose last row is then taken as 0 0 0 1.
///
/// # Errors
/// Numbers that are not finite, a matrix without an inverse.
pub(super) fn matrix(
    numbers: [f64; 16],
    keyword: &str,
    span: Span,
) -> Result<(DMat4, Option<Diagnostic>), Refused> {
    finite(&numbers, keyword, span)?;
    let singular = || {
        Box::new(
            Diagnostic::error(
                "singular-transform",
                span,
                format!("the matrix of {keyword} has no inverse"),
            )
            .with_label("this transform is left out"),
        )
    };
    let raw = DMat4::from_cols_array(&numbers);
    let last_row = raw.row(3);
    // Homogeneous coordinates: a matrix and its multiples are the same transform.
    let mut affine = if last_row.w == 0.0 {
        raw
    } else {
        raw * (1.0 / last_row.w)
    };
    let warning = (last_row.truncate() != DVec3::ZERO || last_row.w == 0.0).then(|| {
        Diagnostic::error(
            "projective-transform",
            span,
            format!("the matrix of {keyword} is projective: its last row is not 0 0 0 1"),
        )
        .with_label("the last row is taken as 0 0 0 1")
        .with_help("matrices are written column by column: the translation is numbers 13 to 15")
    });
    for column in 0..4 {
        affine.col_mut(column).w = if column == 3 { 1.0 } else { 0.0 };
    }
    if !affine.is_finite() || is_singular(&affine) {
        return Err(singular());
    }
    Ok((affine, warning))
}

/// Whether the linear part has no inverse: its determinant is nothing but rounding, measured against the lengths
/// of its columns.
fn is_singular(affine: &DMat4) -> bool {
    if is_tame(&DAffine3::from_mat4(*affine)) {
        return false;
    }
    let columns = [affine.x_axis, affine.y_axis, affine.z_axis].map(|c| direction(c.truncate()));
    match columns {
        [Some(x), Some(y), Some(z)] => DMat3::from_cols(x, y, z).determinant().abs() <= ROUNDING,
        _ => true,
    }
}

/// Whether a transform and its inverse stay within single precision, in which geometry is kept. Far inside what
/// double precision can invert, so the inverse of such a transform is such a transform.
pub(super) fn is_usable(matrix: &DMat4) -> bool {
    // No entry of the inverse then exceeds 10³⁷.
    if is_tame(&DAffine3::from_mat4(*matrix)) {
        return true;
    }
    let fits = |matrix: &DMat4| {
        let largest = f64::from(f32::MAX);
        matrix
            .to_cols_array()
            .iter()
            .all(|entry| entry.abs() <= largest)
    };
    fits(matrix) && fits(&matrix.inverse())
}

/// A vector of any finite length above zero, normalised without overflow or underflow.
fn direction(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    (largest > 0.0 && largest.is_finite()).then(|| (v / largest).normalize())
}
