//! The matrices of the transform directives, in double precision: which are refused, and which have no inverse.

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

/// `Scale`. By zero it has no inverse.
///
/// # Errors
/// Numbers that are not finite.
pub(super) fn scale(factors: [f64; 3], span: Span) -> Result<DMat4, Refused> {
    finite(&factors, "Scale", span)?;
    Ok(DMat4::from_scale(DVec3::from_array(factors)))
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

/// What the last row of a matrix does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum LastRow {
    /// It is 0 0 0 1, or a multiple of it.
    Affine,
    /// It is not, but what it does is lost in single precision.
    Rounding,
    /// It bends space.
    Projective,
}

/// The matrix of `Transform` and `ConcatTransform`, column-major, its last row taken as 0 0 0 1; and what that row was.
///
/// # Errors
/// Numbers that are not finite.
pub(super) fn matrix(
    numbers: [f64; 16],
    keyword: &str,
    span: Span,
) -> Result<(DMat4, LastRow), Refused> {
    finite(&numbers, keyword, span)?;
    let raw = DMat4::from_cols_array(&numbers);
    let last_row = raw.row(3);
    // Homogeneous coordinates: a matrix and its multiples are the same transform.
    let mut affine = if last_row.w == 0.0 {
        raw
    } else {
        raw * (1.0 / last_row.w)
    };
    let projective = affine.row(3).truncate();
    for column in 0..4 {
        affine.col_mut(column).w = if column == 3 { 1.0 } else { 0.0 };
    }
    if !affine.is_finite() {
        let message = format!("the last number of {keyword} is too small to divide the others by");
        return Err(Box::new(
            Diagnostic::error("not-finite", span, message).with_label("this transform is left out"),
        ));
    }
    let row = if last_row.w == 0.0 {
        LastRow::Projective
    } else if projective == DVec3::ZERO {
        LastRow::Affine
    } else if is_rounding(projective, &affine) {
        LastRow::Rounding
    } else {
        LastRow::Projective
    };
    Ok((affine, row))
}

/// Whether a last row `projective`, 1 leaves points where they are, to single precision: those of an object of about
/// one unit, as far from its origin as that is from the world's.
fn is_rounding(projective: DVec3, affine: &DMat4) -> bool {
    let reach = if is_singular(affine) {
        1.0
    } else {
        let inverse = affine.inverse().w_axis.truncate();
        inverse.length().max(1.0)
    };
    projective.length() * reach <= f64::from(f32::EPSILON)
}

/// Reports a projective matrix at the directive `span`: what is below it is not what the file asks for, where
/// `has_effect`.
pub(super) fn projective(span: Span, has_effect: bool) -> Diagnostic {
    let message = "this matrix is projective: its last row is not 0 0 0 1";
    let found = if has_effect {
        Diagnostic::error("projective-transform", span, message)
            .with_label("the last row is taken as 0 0 0 1")
    } else {
        Diagnostic::warning("projective-transform", span, message)
            .with_label("the last row is left out, which changes nothing")
    };
    found.with_help("matrices are written column by column: the translation is numbers 13 to 15")
}

/// Whether the linear part has no inverse: its determinant is nothing but rounding, measured against the lengths
/// of its columns.
pub(super) fn is_singular(affine: &DMat4) -> bool {
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
    is_in_range(matrix) && is_in_range(&matrix.inverse())
}

/// Whether a transform itself stays within single precision.
pub(super) fn is_in_range(matrix: &DMat4) -> bool {
    let largest = f64::from(f32::MAX);
    let fits = |entry: &f64| entry.abs() <= largest;
    matrix.to_cols_array().iter().all(fits)
}

/// A vector of any finite length above zero, normalised without overflow or underflow.
fn direction(v: DVec3) -> Option<DVec3> {
    let largest = v.abs().max_element();
    (largest > 0.0 && largest.is_finite()).then(|| (v / largest).normalize())
}
