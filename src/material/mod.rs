//! Materials: from a surface point to a scattering function. One file for each scene-file material.
//!
//! The null material, an invisible boundary between media, is [`crate::ids::MaterialId::NONE`].

pub mod glass;
pub mod hair;
pub mod matte;
pub mod mirror;

use crate::ids::MaterialId;
use crate::math::Frame;
use crate::scatter::Bsdf;
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::texture::{FloatSource, SpectrumSource, TextureContext, Textures};
pub use glass::Glass;
pub use hair::Hair;
pub use matte::Matte;
pub use mirror::Mirror;

/// The family of a material, with its inputs.
#[derive(Clone, Debug)]
pub enum Model {
    /// Diffuse.
    Matte(Matte),
    /// Perfect mirror.
    Mirror(Mirror),
    /// Smooth dielectric.
    Glass(Glass),
    /// Hair fibre.
    Hair(Hair),
}

/// A material.
#[derive(Clone, Debug)]
pub struct Material {
    /// What it scatters.
    pub model: Model,
}

/// All materials of a world.
#[derive(Clone, Debug, Default)]
pub struct Materials {
    /// The materials, addressed by [`MaterialId`].
    pub list: Vec<Material>,
}

/// Where a material is evaluated, and the textures it reads.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    surface: &'a SurfacePoint,
    ctx: &'a TextureContext,
    textures: &'a Textures,
}

impl Inputs<'_> {
    /// A scalar input.
    #[inline]
    fn float(&self, source: FloatSource) -> f32 {
        self.textures.float(source, self.ctx)
    }

    /// A reflectance, transmittance or similar colour: clamped to ≥ 0, not above.
    #[inline]
    fn reflectance(&self, source: SpectrumSource) -> Rgb {
        self.textures.spectrum(source, self.ctx).clamp_negative()
    }
}

impl Materials {
    /// The scattering function at a surface point.
    pub fn bsdf(
        &self,
        id: MaterialId,
        surface: &SurfacePoint,
        ctx: &TextureContext,
        textures: &Textures,
    ) -> Bsdf {
        let at = Inputs {
            surface,
            ctx,
            textures,
        };
        let frame = Frame::from_normal_tangent(at.surface.ns, at.surface.tangent);
        let mut bsdf = Bsdf::new(frame, surface.ng);
        self.scatter(id, &at, &mut bsdf);
        bsdf
    }

    fn scatter(&self, id: MaterialId, at: &Inputs, bsdf: &mut Bsdf) {
        match &self.list[id.index()].model {
            Model::Matte(matte) => matte.scatter(at, bsdf),
            Model::Mirror(mirror) => mirror.scatter(at, bsdf),
            Model::Glass(glass) => glass.scatter(at, bsdf),
            Model::Hair(hair) => hair.scatter(at, bsdf),
        }
    }

    /// Whether any input of any material needs the footprint of the camera's pixel.
    pub fn need_footprint(&self) -> bool {
        self.list
            .iter()
            .any(|material| material.model.needs_footprint())
    }
}

impl Model {
    /// Whether any input needs the footprint of the camera's pixel.
    fn needs_footprint(&self) -> bool {
        let spectrum = |s: SpectrumSource| matches!(s, SpectrumSource::Texture(_));
        let float = |s: FloatSource| matches!(s, FloatSource::Texture(_));
        match self {
            Self::Matte(m) => spectrum(m.kd) || float(m.sigma),
            Self::Mirror(m) => spectrum(m.kr),
            Self::Glass(m) => spectrum(m.kr) || spectrum(m.kt) || float(m.eta),
            Self::Hair(m) => m.needs_footprint(),
        }
    }
}
