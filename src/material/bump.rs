//! Bump mapping: the shading normal of a surface displaced along its normal (pbrt 3e §9.3).
//!
//! Derivatives of the displacement are differences over half the footprint of the camera's pixel, as in pbrt-v3, so
//! that bumps finer than a pixel fade. How strong bumps look depends on the parametrisation, or, on meshes with normals
//! or tangents, on the unit of the space in which they were defined, where they also point inward.

use glam::DVec3;

use crate::math::{Normal3, Vec3};
use crate::shape::SurfacePoint;
use crate::texture::{FloatSource, TextureContext, Textures};

/// Step in u and v where there is no footprint.
const DEFAULT_STEP: f32 = 0.0005;

/// Least step, relative to the coordinate it is added to: with it the sum still has 8 bits of the step.
const LEAST_STEP: f32 = 1.0 / 65536.0;

/// The surface with the shading normal and tangent of the displaced one; `ns` stays on the side of `ng`.
///
/// `height` is in world units. A surface that cannot be displaced, because a derivative is not finite or the result has
/// no normal, is returned as it is.
pub fn bumped(
    surface: &SurfacePoint,
    height: FloatSource,
    ctx: &TextureContext,
    textures: &Textures,
) -> SurfacePoint {
    let here = textures.height(height, ctx);
    let ns = surface.ns.to_f64();
    let derivatives = [surface.tangent, surface.bitangent];
    let bent = |axis: usize, dn: Vec3| {
        let dp = derivatives[axis];
        let step = step(ctx, axis);
        let mut there = *ctx;
        there.p = ctx.p + dp * step;
        there.uv[axis] += step;
        let slope = f64::from(textures.height(height, &there) - here) / f64::from(step);
        dp.to_f64() + ns * slope + dn.to_f64() * f64::from(here)
    };
    let dpdu = bent(0, surface.dndu);
    let dpdv = bent(1, surface.dndv);
    match normal(dpdu, dpdv) {
        Some(n) => SurfacePoint {
            ns: Normal3::from_f64(n).face_forward(surface.ng),
            tangent: Vec3::from_f64(dpdu),
            ..*surface
        },
        None => *surface,
    }
}

/// The distance in u (axis 0) or v (axis 1) over which the displacement is compared: exactly what `uv` changes by.
fn step(ctx: &TextureContext, axis: usize) -> f32 {
    let footprint = 0.5 * (ctx.duv_dx[axis].abs() + ctx.duv_dy[axis].abs());
    let wanted = if footprint > 0.0 && footprint.is_finite() {
        footprint
    } else {
        DEFAULT_STEP
    };
    let here = ctx.uv[axis];
    let step = (here + wanted.max(here.abs() * LEAST_STEP)) - here;
    // Parameters may be anything; the displacement of a finite one is.
    if step > 0.0 { step } else { DEFAULT_STEP }
}

/// The direction across both; `None` if there is none.
fn normal(dpdu: DVec3, dpdv: DVec3) -> Option<DVec3> {
    // Only directions matter, and lengths are all over the place.
    dpdu.try_normalize()?
        .cross(dpdv.try_normalize()?)
        .try_normalize()
}
