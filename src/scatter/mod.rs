//! Scattering at a point: lobes of surfaces, Fresnel equations, phase functions. Knows no textures, no scene.
//!
//! Directions are unit vectors that leave the point; `wo` is toward the viewer, `wi` is the sampled one. Lobes work
//! in the shading frame, where the shading normal is +z.

pub mod bsdf;
pub mod bssrdf;
pub mod diffuse;
pub mod diffusion;
pub mod disney;
pub mod fourier;
pub mod fresnel;
pub mod fresnel_blend;
pub mod hair;
pub mod microfacet;
pub mod phase;
pub mod rough_dielectric;
pub mod rough_reflection;
pub mod specular;

pub use bsdf::{Bsdf, BsdfSample, Bxdf, LobeSample, Seen, Sides, TransportMode};
pub use bssrdf::Bssrdf;
pub use phase::HenyeyGreenstein;
pub use specular::SpecularPart;

use crate::math::Vec3;

/// Whether two directions of the shading frame lie on the same side of the surface.
#[inline]
fn same_hemisphere(a: Vec3, b: Vec3) -> bool {
    a.z() * b.z() > 0.0
}
