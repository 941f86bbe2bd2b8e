//! Materials: from a surface point to a scattering function. One file for each scene-file material.
//!
//! The null material, an invisible boundary between media, is [`crate::ids::MaterialId::NONE`].

pub mod bump;
pub mod disney;
pub mod energy;
pub mod fourier;
pub mod glass;
pub mod hair;
pub mod kdsubsurface;
pub mod matte;
pub mod metal;
pub mod mirror;
pub mod mix;
pub mod plastic;
pub mod roughness;
pub mod substrate;
pub mod subsurface;
pub mod translucent;
pub mod uber;

use crate::ids::MaterialId;
use crate::math::Frame;
use crate::math::error::EPSILON;
use crate::scatter::diffusion::DiffusionTable;
use crate::scatter::fourier::FourierTable;
use crate::scatter::{Bsdf, Bssrdf};
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::texture::{FloatSource, SpectrumSource, TextureContext, Textures};
pub use disney::Disney;
pub use fourier::Fourier;
pub use glass::Glass;
pub use hair::Hair;
pub use kdsubsurface::KdSubsurface;
pub use matte::Matte;
pub use metal::Metal;
pub use mirror::Mirror;
pub use mix::Mix;
pub use plastic::Plastic;
pub use roughness::Roughness;
pub use substrate::Substrate;
pub use subsurface::Subsurface;
pub use translucent::Translucent;
pub use uber::Uber;

/// The family of a material, with its inputs.
#[derive(Clone, PartialEq, Debug)]
pub enum Model {
    /// Diffuse.
    Matte(Matte),
    /// Diffuse with a glossy coat.
    Plastic(Plastic),
    /// Thin sheet, reflecting and transmitting.
    Translucent(Translucent),
    /// Dielectric, smooth or rough.
    Glass(Glass),
    /// Perfect mirror.
    Mirror(Mirror),
    /// Conductor.
    Metal(Metal),
    /// Diffuse under a rough coat.
    Substrate(Substrate),
    /// A bit of everything.
    Uber(Uber),
    /// Translucent, by its coefficients.
    Subsurface(Subsurface),
    /// Translucent, by its colour.
    KdSubsurface(KdSubsurface),
    /// Hair fibre.
    Hair(Hair),
    /// Table.
    Fourier(Fourier),
    /// Many sliders.
    Disney(Disney),
    /// Two other materials.
    Mix(Mix),
}

/// A material.
#[derive(Clone, PartialEq, Debug)]
pub struct Material {
    /// What it scatters.
    pub model: Model,
    /// `"bumpmap"`: displacement in world units that bends the shading normal; mixtures have none.
    pub bump: Option<FloatSource>,
}

/// All materials of a world.
#[derive(Clone, Debug, Default)]
pub struct Materials {
    /// The materials, addressed by [`MaterialId`]. The parts of a mixture come before it.
    pub list: Vec<Material>,
    /// Tables of subsurface profiles, addressed by [`crate::ids::DiffusionTableId`].
    pub diffusion: Vec<DiffusionTable>,
    /// Tables of fourier materials, addressed by [`crate::ids::FourierTableId`].
    pub tables: Vec<FourierTable>,
}

/// Subsurface profiles narrower than this many times the uncertainty of a position are widened to it.
const NARROWEST_PROFILE: f32 = 64.0;
/// Largest extinction of subsurface media, in units of render space, where scenes are about one unit large: its square
/// is still finite.
const MAX_SIGMA_T: f32 = 1e15;

/// An input of a material, of either kind.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Input {
    /// Scalar.
    Float(FloatSource),
    /// Colour.
    Spectrum(SpectrumSource),
}

impl From<FloatSource> for Input {
    fn from(source: FloatSource) -> Self {
        Self::Float(source)
    }
}

impl From<SpectrumSource> for Input {
    fn from(source: SpectrumSource) -> Self {
        Self::Spectrum(source)
    }
}

/// Where a material is evaluated, and the textures it reads.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    ctx: &'a TextureContext,
    textures: &'a Textures,
}

impl Inputs<'_> {
    /// A scalar input.
    #[inline]
    fn float(&self, source: FloatSource) -> f32 {
        self.textures.float(source, self.ctx)
    }

    /// A colour input as it is.
    #[inline]
    fn spectrum(&self, source: SpectrumSource) -> Rgb {
        self.textures.spectrum(source, self.ctx)
    }

    /// A reflectance, transmittance or similar colour: clamped to ≥ 0, not above.
    #[inline]
    fn reflectance(&self, source: SpectrumSource) -> Rgb {
        self.spectrum(source).clamp_negative()
    }

    /// An index of refraction. A texture can say anything; without a possible index there is no interface.
    #[inline]
    fn index_of_refraction(&self, source: FloatSource) -> f32 {
        let eta = self.float(source);
        if eta > 0.0 && eta.is_finite() {
            eta
        } else {
            1.0
        }
    }
}

impl Materials {
    /// The scattering function at a surface point, whose shading normal a bump map may bend.
    pub fn bsdf<'a>(
        &'a self,
        id: MaterialId,
        surface: &SurfacePoint,
        ctx: &TextureContext,
        textures: &Textures,
    ) -> Bsdf<'a> {
        let frame = self.shading_frame(id, surface, ctx, textures);
        let mut bsdf = Bsdf::new(frame, surface.ng);
        self.add_lobes(id, ctx, textures, &mut bsdf);
        bsdf
    }

    /// The frame of [`Materials::bsdf`].
    pub fn shading_frame(
        &self,
        id: MaterialId,
        surface: &SurfacePoint,
        ctx: &TextureContext,
        textures: &Textures,
    ) -> Frame {
        match self.bump(id) {
            Some(height) => {
                let bumped = bump::bumped(surface, height, ctx, textures);
                Frame::from_normal_tangent(bumped.ns, bumped.tangent)
            }
            None => Frame::from_normal_tangent(surface.ns, surface.tangent),
        }
    }

    /// The lobes of [`Materials::bsdf`]: added in place, they need not be moved, which costs as much as to find them.
    pub fn add_lobes<'a>(
        &'a self,
        id: MaterialId,
        ctx: &TextureContext,
        textures: &Textures,
        bsdf: &mut Bsdf<'a>,
    ) {
        self.scatter(id, &Inputs { ctx, textures }, bsdf);
    }

    /// The bump map of a material; of a mixture, that of its first part.
    fn bump(&self, id: MaterialId) -> Option<FloatSource> {
        let material = &self.list[id.index()];
        match &material.model {
            Model::Mix(mix) => self.bump(mix.first),
            _ => material.bump,
        }
    }

    fn scatter<'a>(&'a self, id: MaterialId, at: &Inputs, bsdf: &mut Bsdf<'a>) {
        match &self.list[id.index()].model {
            Model::Matte(matte) => matte.scatter(at, bsdf),
            Model::Plastic(plastic) => plastic.scatter(at, bsdf),
            Model::Translucent(translucent) => translucent.scatter(at, bsdf),
            Model::Glass(glass) => glass.scatter(at, bsdf),
            Model::Mirror(mirror) => mirror.scatter(at, bsdf),
            Model::Metal(metal) => metal.scatter(at, bsdf),
            Model::Substrate(substrate) => substrate.scatter(at, bsdf),
            Model::Uber(uber) => uber.scatter(at, bsdf),
            Model::Subsurface(subsurface) => subsurface.boundary.scatter(at, bsdf),
            Model::KdSubsurface(subsurface) => subsurface.boundary.scatter(at, bsdf),
            Model::Hair(hair) => hair.scatter(at, bsdf),
            Model::Fourier(fourier) => fourier.scatter(&self.tables, bsdf),
            Model::Disney(disney) => disney.scatter(at, bsdf),
            Model::Mix(mix) => self.scatter_mix(mix, at, bsdf),
        }
    }

    fn scatter_mix<'a>(&'a self, mix: &Mix, at: &Inputs, bsdf: &mut Bsdf<'a>) {
        let first = at.reflectance(mix.amount);
        let second = (Rgb::ONE - first).clamp_negative();
        // The first material sets the index, whatever its weight.
        bsdf.scaled(first, |bsdf| self.scatter(mix.first, at, bsdf));
        let eta = bsdf.eta();
        bsdf.scaled(second, |bsdf| self.scatter(mix.second, at, bsdf));
        bsdf.set_eta(eta);
    }

    /// How light spreads below a surface, where the material lets it; in a mixture, where its first part does.
    pub fn bssrdf(
        &self,
        id: MaterialId,
        surface: &SurfacePoint,
        ctx: &TextureContext,
        textures: &Textures,
    ) -> Option<Bssrdf<'_>> {
        let at = Inputs { ctx, textures };
        let uncertainty = surface.p_err.0 + surface.p.0.abs() * EPSILON;
        let max_sigma_t = (1.0 / (NARROWEST_PROFILE * uncertainty.max_element())).min(MAX_SIGMA_T);
        match &self.list[id.index()].model {
            Model::Subsurface(m) => {
                Some(m.bssrdf(&at, &self.diffusion[m.table.index()], max_sigma_t))
            }
            Model::KdSubsurface(m) => {
                Some(m.bssrdf(&at, &self.diffusion[m.table.index()], max_sigma_t))
            }
            Model::Disney(m) => m.bssrdf(&at, 1.0 / max_sigma_t),
            Model::Mix(mix) => self.bssrdf(mix.first, surface, ctx, textures),
            _ => None,
        }
    }

    /// Whether light may spread below surfaces of any material.
    pub fn let_light_in(&self) -> bool {
        let mut models = self.list.iter().map(|material| &material.model);
        models.any(|model| self.spreads_light(model))
    }

    /// Whether light may spread below surfaces of a material: it comes back from those of this very material only.
    pub fn spreads_light(&self, model: &Model) -> bool {
        match model {
            Model::Subsurface(_) | Model::KdSubsurface(_) => true,
            Model::Disney(disney) => disney.may_spread_light(),
            Model::Mix(mix) => self.spreads_light(&self.list[mix.first.index()].model),
            Model::Matte(_)
            | Model::Plastic(_)
            | Model::Translucent(_)
            | Model::Glass(_)
            | Model::Mirror(_)
            | Model::Metal(_)
            | Model::Substrate(_)
            | Model::Uber(_)
            | Model::Hair(_)
            | Model::Fourier(_) => false,
        }
    }

    /// Whether any input of any material needs the footprint of the camera's pixel.
    pub fn need_footprint(&self, textures: &Textures) -> bool {
        self.list.iter().any(|material| {
            // The footprint is what displacements are compared over, whatever they are.
            let is_bumpy = material
                .bump
                .is_some_and(|bump| !matches!(bump, FloatSource::Constant(_)));
            let mut inputs = material.model.inputs().into_iter();
            is_bumpy
                || inputs.any(|input| match input {
                    Input::Float(source) => textures.needs_footprint(source),
                    Input::Spectrum(source) => textures.needs_footprint(source),
                })
        })
    }

    /// Most lobes a material adds to a scattering function.
    pub fn max_lobes(&self, id: MaterialId) -> usize {
        match &self.list[id.index()].model {
            Model::Matte(_)
            | Model::Glass(_)
            | Model::Mirror(_)
            | Model::Metal(_)
            | Model::Subsurface(_)
            | Model::KdSubsurface(_)
            | Model::Substrate(_)
            | Model::Hair(_)
            | Model::Fourier(_) => 1,
            Model::Plastic(_) => 2,
            Model::Translucent(_) => 3,
            Model::Uber(_) => 4,
            // Base, highlight, coat, refraction, and either diffuse transmission or what lets light in.
            Model::Disney(_) => 5,
            Model::Mix(mix) => self.max_lobes(mix.first) + self.max_lobes(mix.second),
        }
    }
}

impl Model {
    /// All inputs; of a mixture, its own.
    fn inputs(&self) -> Vec<Input> {
        match self {
            Self::Matte(matte) => matte.inputs(),
            Self::Plastic(plastic) => plastic.inputs(),
            Self::Translucent(translucent) => translucent.inputs(),
            Self::Glass(glass) => glass.inputs(),
            Self::Mirror(mirror) => mirror.inputs(),
            Self::Metal(metal) => metal.inputs(),
            Self::Substrate(substrate) => substrate.inputs(),
            Self::Uber(uber) => uber.inputs(),
            Self::Subsurface(subsurface) => subsurface.inputs(),
            Self::KdSubsurface(subsurface) => subsurface.inputs(),
            Self::Hair(hair) => hair.inputs(),
            Self::Fourier(_) => Vec::new(),
            Self::Disney(disney) => disney.inputs(),
            Self::Mix(mix) => vec![mix.amount.into()],
        }
    }
}
