//! Materials: from a surface point to a scattering function. One file for each scene-file material.
//!
//! The null material, an invisible boundary between media, is [`crate::ids::MaterialId::NONE`].

pub mod bump;
pub mod glass;
pub mod matte;
pub mod mirror;

use crate::math::Frame;
use crate::scatter::Bsdf;
use crate::shape::SurfacePoint;
use crate::texture::{FloatSource, SpectrumSource, TextureContext, Textures};
pub use glass::Glass;
pub use matte::Matte;
pub use mirror::Mirror;

/// A material.
#[derive(Clone, Debug)]
pub enum Material {
    /// Diffuse.
    Matte(Matte),
    /// Perfect mirror.
    Mirror(Mirror),
    /// Smooth dielectric.
    Glass(Glass),
}

impl Material {
    /// The scattering function at a surface point.
    pub fn bsdf(&self, surface: &SurfacePoint, ctx: &TextureContext, textures: &Textures) -> Bsdf {
        let frame = Frame::from_normal_tangent(surface.ns, surface.tangent);
        match self {
            Self::Matte(matte) => matte.bsdf(frame, surface.ng, ctx, textures),
            Self::Mirror(mirror) => mirror.bsdf(frame, surface.ng, ctx, textures),
            Self::Glass(glass) => glass.bsdf(frame, surface.ng, ctx, textures),
        }
    }

    /// Whether any input needs the footprint of the camera's pixel.
    pub fn needs_footprint(&self, textures: &Textures) -> bool {
        let spectrum = |source: SpectrumSource| textures.needs_footprint(source);
        let float = |source: FloatSource| textures.needs_footprint(source);
        match self {
            Self::Matte(m) => spectrum(m.kd) || float(m.sigma),
            Self::Mirror(m) => spectrum(m.kr),
            Self::Glass(m) => spectrum(m.kr) || spectrum(m.kt) || float(m.eta),
        }
    }
}
