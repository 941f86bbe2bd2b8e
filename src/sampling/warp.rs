//! Warps of the unit square to the domains of light transport, each with its density.

use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

use crate::math::{Vec3, sin_cos_of_turns};

/// A point of the unit disk, area-uniform, that keeps strata compact (Shirley and Chiu 1997).
#[inline]
pub fn concentric_disk(u: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0];
    }
    let (r, theta) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, FRAC_PI_2 - FRAC_PI_4 * (a / b))
    };
    let (sin, cos) = theta.sin_cos();
    [r * cos, r * sin]
}

/// A direction of the upper hemisphere (+z) with density cos θ / π (Malley's method).
#[inline]
pub fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let [x, y] = concentric_disk(u);
    // 1 − r² from the two factors, so that nothing cancels near the rim.
    let r = (x * x + y * y).sqrt();
    let z = ((1.0 - r) * (1.0 + r)).max(0.0).sqrt();
    Vec3::new(x, y, z)
}

/// Density of [`cosine_hemisphere`] in sr⁻¹.
#[inline]
pub fn cosine_hemisphere_pdf(cos_theta: f32) -> f32 {
    cos_theta.max(0.0) * FRAC_1_PI
}

/// A direction of the whole sphere with density 1/(4π).
#[inline]
pub fn uniform_sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let r = 2.0 * (u[0] * (1.0 - u[0])).sqrt(); // sin θ without 1 − z².
    let (sin, cos) = sin_cos_of_turns(u[1]);
    Vec3::new(r * cos, r * sin, z)
}

/// Density of [`uniform_sphere`] in sr⁻¹.
pub const UNIFORM_SPHERE_PDF: f32 = 0.25 * FRAC_1_PI;

/// A direction of the upper hemisphere (+z) with density 1/(2π).
#[inline]
pub fn uniform_hemisphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - u[0];
    let r = (u[0] * (2.0 - u[0])).sqrt(); // sin θ without 1 − z².
    let (sin, cos) = sin_cos_of_turns(u[1]);
    Vec3::new(r * cos, r * sin, z)
}

/// Density of [`uniform_hemisphere`] in sr⁻¹.
pub const UNIFORM_HEMISPHERE_PDF: f32 = 0.5 * FRAC_1_PI;

/// Barycentric coordinates (b0, b1) of a triangle, area-uniform.
#[inline]
pub fn uniform_triangle(u: [f32; 2]) -> [f32; 2] {
    // Folds the square along its diagonal; neither stretches like the square root nor loses precision
    // (Heitz 2019, "A Low-Distortion Map Between Triangle and Square").
    if u[0] < u[1] {
        let b0 = 0.5 * u[0];
        [b0, u[1] - b0]
    } else {
        let b1 = 0.5 * u[1];
        [u[0] - b1, b1]
    }
}
