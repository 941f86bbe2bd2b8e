//! The footprint of the camera's pixel on a surface (pbrt 3rd ed., section 10.1.1), and what mirrors and glass make of
//! the neighbouring rays (section 10.1.3; Igehy 1999, "Tracing Ray Differentials").

use crate::camera::RayDifferential;
use crate::math::{Ray, Vec3};
use crate::scatter::SpecularPart;
use crate::shape::SurfacePoint;
use crate::texture::TextureContext;

/// Where textures are evaluated on a surface; without a differential the footprint is a point.
pub fn texture_context(
    surface: &SurfacePoint,
    differential: Option<&RayDifferential>,
) -> TextureContext {
    let mut ctx = TextureContext {
        p: surface.p,
        uv: surface.uv,
        duv_dx: [0.0; 2],
        duv_dy: [0.0; 2],
        dp_dx: Vec3::ZERO,
        dp_dy: Vec3::ZERO,
        face: surface.face,
    };
    let Some(differential) = differential else {
        return ctx;
    };
    let (Some(dp_dx), Some(dp_dy)) = (
        offset_on_plane(surface, &differential.right),
        offset_on_plane(surface, &differential.below),
    ) else {
        return ctx;
    };
    (ctx.dp_dx, ctx.dp_dy) = (dp_dx, dp_dy);
    // The two axes in which the surface is seen largest make the best conditioned system.
    let n = surface.ng.abs();
    let (a, b) = if n.x() > n.y() && n.x() > n.z() {
        (1, 2)
    } else if n.y() > n.z() {
        (0, 2)
    } else {
        (0, 1)
    };
    let (dpdu, dpdv) = (surface.dpdu.0, surface.dpdv.0);
    let det = dpdu[a] * dpdv[b] - dpdv[a] * dpdu[b];
    let solve = |dp: Vec3| {
        let du = (dp.0[a] * dpdv[b] - dpdv[a] * dp.0[b]) / det;
        let dv = (dpdu[a] * dp.0[b] - dp.0[a] * dpdu[b]) / det;
        if du.is_finite() && dv.is_finite() {
            [du, dv]
        } else {
            [0.0; 2]
        }
    };
    (ctx.duv_dx, ctx.duv_dy) = (solve(dp_dx), solve(dp_dy));
    ctx
}

/// From the surface point to where a neighbouring ray meets its tangent plane.
fn offset_on_plane(surface: &SurfacePoint, ray: &Ray) -> Option<Vec3> {
    let t = surface.ng.dot(surface.p - ray.o) / surface.ng.dot(ray.d);
    let offset = ray.at(t) - surface.p;
    offset.is_finite().then_some(offset)
}

/// The neighbours of a ray that leaves a surface, which it met in direction −`wo`, by a specular part. `ns` is the
/// shading normal; `ctx` holds the footprint. Their directions have no unit length.
pub fn after_specular(
    differential: &RayDifferential,
    surface: &SurfacePoint,
    ctx: &TextureContext,
    ns: Vec3,
    wo: Vec3,
    part: &SpecularPart,
) -> RayDifferential {
    let (cos_o, cos_i) = (wo.dot(ns), part.wi.dot(ns));
    let [dndu, dndv] = surface.normal_derivatives();
    let leaving = |neighbour: &Ray, dp: Vec3, [du, dv]: [f32; 2]| {
        let dwo = -neighbour.d - wo;
        let dn = dndu * du + dndv * dv;
        let d_cos_o = dwo.dot(ns) + wo.dot(dn);
        let d_wi = match part.refraction {
            // wi = −wo + 2 cosₒ n
            None => (dn * cos_o + ns * d_cos_o) * 2.0 - dwo,
            // wi = −η wo + (η cosₒ + cosᵢ) n, with cosᵢ² = 1 − η² (1 − cosₒ²)
            Some(eta) => {
                let d_cos_i = eta * eta * (cos_o / cos_i) * d_cos_o;
                dn * (eta * cos_o + cos_i) + ns * (eta * d_cos_o + d_cos_i) - dwo * eta
            }
        };
        Ray {
            o: surface.p + dp,
            d: part.wi + d_wi,
            time: neighbour.time,
        }
    };
    RayDifferential {
        right: leaving(&differential.right, ctx.dp_dx, ctx.duv_dx),
        below: leaving(&differential.below, ctx.dp_dy, ctx.duv_dy),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{LightId, MaterialId, ObjectId};
    use crate::math::{Frame, Point3, Transform};
    use crate::scatter::specular::SmoothDielectric;
    use crate::scatter::{Bsdf, Bxdf, TransportMode};
    use crate::shape::quadric::{Form, Sphere};
    use crate::shape::{Quadric, Shape};
    use crate::spectrum::Rgb;
    use crate::world::{Cutout, Geometry, World, WorldParts};

    fn glass_ball() -> World {
        let sphere = Sphere::new(1.0, -1.0, 1.0, std::f64::consts::TAU);
        World::new(WorldParts {
            geometries: vec![Geometry {
                shape: Shape::Quadric(Quadric::new(
                    Form::Sphere(sphere),
                    Transform::IDENTITY,
                    false,
                )),
                material: MaterialId::NONE,
                media: None,
                cutout: Cutout::default(),
                first_light: LightId::NONE,
                object: ObjectId::NONE,
            }],
            ..WorldParts::default()
        })
    }

    /// Where a ray meets the ball, and the reflected and the refracted way from there.
    fn ways(world: &World, ray: &Ray) -> (SurfacePoint, [SpecularPart; 2]) {
        let hit = world.closest(ray, f32::INFINITY).expect("it hits");
        let surface = world.surface(ray, &hit);
        let frame = Frame::from_normal_tangent(surface.ns, surface.tangent);
        let mut bsdf = Bsdf::new(frame, surface.ng);
        bsdf.add(Bxdf::SmoothDielectric(SmoothDielectric {
            kr: Rgb::ONE,
            kt: Rgb::ONE,
            eta: 1.5,
        }));
        let parts = bsdf.specular_parts(-ray.d, TransportMode::Radiance);
        (surface, [parts[0], parts[1]])
    }

    #[test]
    fn neighbours_leave_a_ball_as_if_they_were_traced() {
        let world = glass_ball();
        let step = 2e-3;
        // From outside, and from inside below the critical angle.
        for o in [Point3::new(0.5, 0.3, -4.0), Point3::new(0.2, 0.3, 0.0)] {
            let ray = |dx: f32, dy: f32| Ray {
                o,
                d: Vec3::new(dx - 0.05, dy + 0.02, 1.0).normalize(),
                time: 0.0,
            };
            let differential = RayDifferential {
                right: ray(step, 0.0),
                below: ray(0.0, step),
            };
            let (surface, parts) = ways(&world, &ray(0.0, 0.0));
            let ctx = texture_context(&surface, Some(&differential));
            for (way, part) in parts.iter().enumerate() {
                let ns = Vec3::from(surface.ns);
                let wo = -ray(0.0, 0.0).d;
                let leaving = after_specular(&differential, &surface, &ctx, ns, wo, part);
                for (of, neighbour) in [
                    (leaving.right, differential.right),
                    (leaving.below, differential.below),
                ] {
                    let (traced, traced_parts) = ways(&world, &neighbour);
                    let moved = traced.p - surface.p;
                    let turned = traced_parts[way].wi - part.wi;
                    let off = [(of.o - surface.p) - moved, (of.d - part.wi) - turned];
                    assert!(off[0].length() < 0.03 * moved.length(), "{way}: {off:?}");
                    assert!(off[1].length() < 0.03 * turned.length(), "{way}: {off:?}");
                }
            }
        }
    }
}
