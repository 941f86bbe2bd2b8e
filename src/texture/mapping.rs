//! From a surface point to texture coordinates. Scene-file manual, for classes over (s, t):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `string mapping` | `uv` | `uv`, `spherical`, `cylindrical` or `planar` |
//! | `float uscale`, `vscale` | 1, 1 | `uv`: factors of u and v |
//! | `float udelta`, `vdelta` | 0, 0 | `uv` and `planar`: added to s and t |
//! | `vector v1`, `v2` | (1, 0, 0), (0, 1, 0) | `planar`: s and t are the products of these with the world-space position |
//!
//! `spherical` and `cylindrical` look at the position in the space that the current transform at the `Texture`
//! directive leads from. Classes over space have no parameters here; they look at the world-space position to which
//! that transform is applied once more: as in pbrt-v3, it acts forward, so that `Scale 2` doubles the frequency.
//!
//! Coordinates are f64, so that scenes far from the origin keep their texture, and finite whatever comes in.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec2, DVec3, Vec2};

use crate::texture::TextureContext;

/// Coordinates are kept within this of 0. Beyond it f64 has no fraction, which is all that textures look at.
const FARTHEST: f64 = (1_u64 << 52) as f64;

/// Changes of coordinates per pixel are kept within this of 0: nothing is left to average beyond.
const WIDEST: f64 = (1_u64 << 40) as f64;

/// Scaled and shifted surface parameters.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct UvMapping {
    /// Factors of u and v.
    pub scale: Vec2,
    /// Added after scaling.
    pub delta: Vec2,
}

/// How a surface point becomes (s, t).
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Mapping2 {
    /// By surface parameters.
    Uv(UvMapping),
    /// By direction from the origin: s is the angle from +z over π, t the azimuth over 2π.
    Spherical {
        /// From render space to the space of the sphere.
        sphere_from_render: DAffine3,
    },
    /// By azimuth around z, and by the z of the direction from the origin.
    Cylindrical {
        /// From render space to the space of the cylinder.
        cylinder_from_render: DAffine3,
    },
    /// By distances from two planes.
    Planar {
        /// Maps a point in render space to s in x and t in y; z is not used.
        st_from_render: DAffine3,
    },
}

/// How a surface point becomes a point of texture space.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Mapping3 {
    /// From render space to texture space.
    pub texture_from_render: DAffine3,
}

/// Texture coordinates with their change per pixel. All finite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TexturePoint2 {
    /// Coordinates.
    pub st: DVec2,
    /// Change to the next pixel on the right.
    pub dst_dx: Vec2,
    /// Change to the next pixel below.
    pub dst_dy: Vec2,
}

/// A point of texture space with its change per pixel. All finite.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TexturePoint3 {
    /// The point.
    pub p: DVec3,
    /// Change to the next pixel on the right.
    pub dp_dx: DVec3,
    /// Change to the next pixel below.
    pub dp_dy: DVec3,
}

impl Mapping2 {
    /// Maps a surface point.
    pub fn map(&self, ctx: &TextureContext) -> TexturePoint2 {
        let (st, [dst_dx, dst_dy]) = match self {
            Self::Uv(uv) => uv.map(ctx),
            Self::Spherical { sphere_from_render } => by_direction(sphere_from_render, ctx, sphere),
            Self::Cylindrical {
                cylinder_from_render,
            } => by_direction(cylinder_from_render, ctx, cylinder),
            Self::Planar { st_from_render } => (
                st_from_render.transform_point3(ctx.p.to_f64()).truncate(),
                [ctx.dp_dx, ctx.dp_dy].map(|dp| {
                    let dst = st_from_render.transform_vector3(dp.to_f64());
                    dst.truncate()
                }),
            ),
        };
        let bounded = |v: DVec2, bound| DVec2::new(within(v.x, bound), within(v.y, bound));
        TexturePoint2 {
            st: bounded(st, FARTHEST),
            dst_dx: bounded(dst_dx, WIDEST).as_vec2(),
            dst_dy: bounded(dst_dy, WIDEST).as_vec2(),
        }
    }
}

impl UvMapping {
    /// Leaves the surface parameters as they are.
    pub const IDENTITY: Self = Self {
        scale: Vec2::ONE,
        delta: Vec2::ZERO,
    };

    #[inline]
    fn map(&self, ctx: &TextureContext) -> (DVec2, [DVec2; 2]) {
        let scaled = |uv: [f32; 2]| Vec2::from(uv).as_dvec2() * self.scale.as_dvec2();
        (
            scaled(ctx.uv) + self.delta.as_dvec2(),
            [scaled(ctx.duv_dx), scaled(ctx.duv_dy)],
        )
    }
}

impl Mapping3 {
    /// Maps a surface point.
    pub fn map(&self, ctx: &TextureContext) -> TexturePoint3 {
        let m = &self.texture_from_render;
        let bounded = |v: DVec3, bound| {
            DVec3::new(within(v.x, bound), within(v.y, bound), within(v.z, bound))
        };
        let change = |dp: crate::math::Vec3| bounded(m.transform_vector3(dp.to_f64()), WIDEST);
        TexturePoint3 {
            p: bounded(m.transform_point3(ctx.p.to_f64()), FARTHEST),
            dp_dx: change(ctx.dp_dx),
            dp_dy: change(ctx.dp_dy),
        }
    }
}

/// `x` kept in [-bound, bound]; 0 if it is not a number.
#[inline]
fn within(x: f64, bound: f64) -> f64 {
    if x.is_nan() {
        0.0
    } else {
        x.clamp(-bound, bound)
    }
}

/// Coordinates that depend on the direction from the origin of a space, with their exact derivatives: a seam in the
/// coordinates is none in the footprint.
fn by_direction(
    local_from_render: &DAffine3,
    ctx: &TextureContext,
    coordinates: fn(DVec3, [DVec3; 2]) -> (DVec2, [DVec2; 2]),
) -> (DVec2, [DVec2; 2]) {
    coordinates(
        local_from_render.transform_point3(ctx.p.to_f64()),
        [ctx.dp_dx, ctx.dp_dy].map(|dp| local_from_render.transform_vector3(dp.to_f64())),
    )
}

fn sphere(q: DVec3, dq: [DVec3; 2]) -> (DVec2, [DVec2; 2]) {
    let rho = q.truncate().length();
    let turns = q.y.atan2(q.x) / TAU;
    let st = DVec2::new(
        rho.atan2(q.z) / PI,
        if turns < 0.0 { turns + 1.0 } else { turns },
    );
    let change = |d: DVec3| {
        let d_rho = if rho > 0.0 {
            q.truncate().dot(d.truncate()) / rho
        } else {
            d.truncate().length() // Away from a pole in any direction.
        };
        let d_theta = (q.z * d_rho - rho * d.z) / q.length_squared();
        change_of(d, DVec2::new(d_theta / PI, d_turns(q, d)))
    };
    (st, dq.map(change))
}

fn cylinder(q: DVec3, dq: [DVec3; 2]) -> (DVec2, [DVec2; 2]) {
    let unit = q.normalize_or_zero();
    let st = DVec2::new(0.5 + q.y.atan2(q.x) / TAU, unit.z);
    let change = |d: DVec3| {
        let dz = (d.z - unit.z * unit.dot(d)) / q.length();
        change_of(d, DVec2::new(d_turns(q, d), dz))
    };
    (st, dq.map(change))
}

/// Change of the azimuth, in turns, as `q` changes by `d`.
fn d_turns(q: DVec3, d: DVec3) -> f64 {
    (q.x * d.y - q.y * d.x) / q.truncate().length_squared() / TAU
}

/// Near the axis one pixel spans many turns; once around is all there is to see.
fn change_of(d: DVec3, dst: DVec2) -> DVec2 {
    if d == DVec3::ZERO {
        return DVec2::ZERO;
    }
    let at_most_once = |x: f64| match x {
        x if x.abs() < 1.0 => x,
        x if x < 0.0 => -1.0,
        _ => 1.0,
    };
    DVec2::new(at_most_once(dst.x), at_most_once(dst.y))
}
