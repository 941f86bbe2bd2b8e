//! Textures: values that vary over surfaces. Knows images and mappings, no materials and no files.

pub mod imagemap;
pub mod mapping;

use crate::ids::{FloatTextureId, ImageId, SpectrumTextureId};
use crate::image::mip::MipMap;
use crate::math::{Point3, Vec3};
use crate::spectrum::Rgb;
pub use imagemap::{Filter, ImageTexture};
pub use mapping::UvMapping;

/// Where a texture is evaluated: a surface point with the footprint of the camera's pixel on it.
#[derive(Clone, Copy, Debug)]
pub struct TextureContext {
    /// The point, in render space.
    pub p: Point3,
    /// Surface parameters.
    pub uv: [f32; 2],
    /// Change of `uv` from one pixel to the next on the right; 0 where unknown, which selects the finest detail.
    pub duv_dx: [f32; 2],
    /// Change of `uv` from one pixel to the next below.
    pub duv_dy: [f32; 2],
    /// Change of `p` from one pixel to the next on the right.
    pub dp_dx: Vec3,
    /// Change of `p` from one pixel to the next below.
    pub dp_dy: Vec3,
}

impl TextureContext {
    /// A point without a footprint: the finest detail.
    pub fn at_point(p: Point3, uv: [f32; 2]) -> Self {
        Self {
            p,
            uv,
            duv_dx: [0.0; 2],
            duv_dy: [0.0; 2],
            dp_dx: Vec3::ZERO,
            dp_dy: Vec3::ZERO,
        }
    }
}

/// A scalar input of a material: folded to a constant at load wherever it is one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum FloatSource {
    /// The same everywhere.
    Constant(f32),
    /// Looked up at each point.
    Texture(FloatTextureId),
}

/// A colour input of a material: folded to a constant at load wherever it is one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum SpectrumSource {
    /// The same everywhere.
    Constant(Rgb),
    /// Looked up at each point.
    Texture(SpectrumTextureId),
}

/// A scalar texture.
#[derive(Clone, Debug)]
pub enum FloatTexture {
    /// Image.
    Image(ImageTexture),
}

/// A colour texture.
#[derive(Clone, Debug)]
pub enum SpectrumTexture {
    /// Image.
    Image(ImageTexture),
}

/// All textures of a world and the images behind them.
#[derive(Clone, Debug, Default)]
pub struct Textures {
    /// Scalar textures.
    pub float: Vec<FloatTexture>,
    /// Colour textures.
    pub spectrum: Vec<SpectrumTexture>,
    /// Images, already linear and scaled, bottom row first.
    pub images: Vec<MipMap>,
}

impl Textures {
    /// Value of a scalar input.
    #[inline]
    pub fn float(&self, source: FloatSource, ctx: &TextureContext) -> f32 {
        match source {
            FloatSource::Constant(value) => value,
            FloatSource::Texture(id) => match &self.float[id.index()] {
                FloatTexture::Image(texture) => texture.evaluate(self.image(texture.image), ctx),
            },
        }
    }

    /// Value of a colour input.
    #[inline]
    pub fn spectrum(&self, source: SpectrumSource, ctx: &TextureContext) -> Rgb {
        match source {
            SpectrumSource::Constant(value) => value,
            SpectrumSource::Texture(id) => match &self.spectrum[id.index()] {
                SpectrumTexture::Image(texture) => texture.evaluate(self.image(texture.image), ctx),
            },
        }
    }

    fn image(&self, id: ImageId) -> &MipMap {
        &self.images[id.index()]
    }
}
