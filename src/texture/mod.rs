//! Textures: values that vary over surfaces. Knows images and mappings, no materials and no files.
//!
//! One file for each class of the scene format. Scalar and colour textures share their shape: what differs between
//! them is [`Value`]. Class `constant` is [`Source::Constant`].

pub mod bilerp;
pub mod checkerboard;
pub mod dots;
pub mod fbm;
pub mod imagemap;
pub mod mapping;
pub mod marble;
pub mod mix;
pub mod noise;
mod permutation;
pub mod ptex;
pub mod scale;
pub mod uv;
mod value;
pub mod windy;
pub mod wrinkled;

use crate::ids::{ImageId, PtexId, TextureId};
use crate::image::mip::MipMap;
use crate::image::ptex::Ptex;
use crate::math::{Point3, Vec3};
use crate::spectrum::Rgb;
pub use bilerp::Bilerp;
pub use checkerboard::{Checkerboard2, Checkerboard3, Smoothing};
pub use dots::Dots;
pub use fbm::Fbm;
pub use imagemap::{Filter, ImageTexture};
pub use mapping::{Mapping2, Mapping3, UvMapping};
pub use marble::Marble;
pub use mix::Mix;
pub use ptex::PtexTexture;
pub use scale::Scale;
pub use uv::Uv;
pub use value::Value;
pub use windy::Windy;
pub use wrinkled::Wrinkled;

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
    /// Number of the face among those of a Ptex file.
    pub face: u32,
}

impl TextureContext {
    /// A point of face 0 without a footprint: the finest detail.
    pub fn at_point(p: Point3, uv: [f32; 2]) -> Self {
        Self {
            p,
            uv,
            duv_dx: [0.0; 2],
            duv_dy: [0.0; 2],
            dp_dx: Vec3::ZERO,
            dp_dy: Vec3::ZERO,
            face: 0,
        }
    }
}

/// An input of a material or of another texture: folded to a constant at load wherever it is one.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Source<V> {
    /// The same everywhere.
    Constant(V),
    /// Looked up at each point.
    Texture(TextureId),
}

/// A scalar input.
pub type FloatSource = Source<f32>;

/// A colour input.
pub type SpectrumSource = Source<Rgb>;

/// A texture that varies. The scene format has the last two for colours only.
#[derive(Clone, Debug)]
pub enum Texture<V> {
    /// Product.
    Scale(Scale<V>),
    /// Blend.
    Mix(Mix<V>),
    /// Corner values, interpolated.
    Bilerp(Bilerp<V>),
    /// Image.
    Image(ImageTexture),
    /// An image for each face.
    Ptex(PtexTexture),
    /// Squares.
    Checkerboard2(Checkerboard2<V>),
    /// Cubes.
    Checkerboard3(Checkerboard3<V>),
    /// Random dots.
    Dots(Dots<V>),
    /// Layers of noise.
    Fbm(Fbm),
    /// Layers of absolute noise.
    Wrinkled(Wrinkled),
    /// Waves.
    Windy(Windy),
    /// Texture coordinates as colours.
    Uv(Uv),
    /// Veins.
    Marble(Marble),
}

/// The textures of one value type, inputs before those that use them.
#[derive(Clone, Debug)]
pub struct Arena<V> {
    textures: Vec<Texture<V>>,
    /// Whether each looks at the footprint, itself or through an input.
    needs_footprint: Vec<bool>,
}

impl<V> Default for Arena<V> {
    fn default() -> Self {
        Self {
            textures: Vec::new(),
            needs_footprint: Vec::new(),
        }
    }
}

/// All textures of a world and the images behind them.
#[derive(Clone, Debug)]
pub struct Textures {
    /// Length in render space of one world unit.
    unit: f32,
    float: Arena<f32>,
    spectrum: Arena<Rgb>,
    /// Already linear and scaled, bottom row first.
    images: Vec<MipMap>,
    ptex: Vec<Ptex>,
}

impl Default for Textures {
    /// No textures, where render space is as large as the world.
    fn default() -> Self {
        Self::new(1.0)
    }
}

impl Textures {
    /// No textures. `unit` is the length in render space of one world unit.
    pub fn new(unit: f32) -> Self {
        Self {
            unit,
            float: Arena::default(),
            spectrum: Arena::default(),
            images: Vec::new(),
            ptex: Vec::new(),
        }
    }

    /// A displacement of the surface, written in world units, in those of render space.
    pub fn height(&self, source: FloatSource, ctx: &TextureContext) -> f32 {
        self.float(source, ctx) * self.unit
    }

    /// Adds a texture. Its inputs and its image must come from the same `Textures`.
    pub fn add<V: Value>(&mut self, texture: Texture<V>) -> Source<V> {
        let needs_footprint = texture.needs_footprint(self);
        let arena = V::arena_mut(self);
        arena.textures.push(texture);
        arena.needs_footprint.push(needs_footprint);
        Source::Texture(TextureId::new(arena.textures.len() - 1))
    }

    /// Adds an image: linear and scaled, bottom row first.
    pub fn add_image(&mut self, image: MipMap) -> ImageId {
        self.images.push(image);
        ImageId::new(self.images.len() - 1)
    }

    /// Adds a Ptex file of one or three channels.
    pub fn add_ptex(&mut self, file: Ptex) -> PtexId {
        debug_assert!(matches!(file.channels(), 1 | 3));
        self.ptex.push(file);
        PtexId::new(self.ptex.len() - 1)
    }

    /// Value of a scalar input.
    #[inline]
    pub fn float(&self, source: FloatSource, ctx: &TextureContext) -> f32 {
        self.evaluate(source, ctx)
    }

    /// Value of a colour input.
    #[inline]
    pub fn spectrum(&self, source: SpectrumSource, ctx: &TextureContext) -> Rgb {
        self.evaluate(source, ctx)
    }

    /// Value of any input.
    #[inline]
    pub fn evaluate<V: Value>(&self, source: Source<V>, ctx: &TextureContext) -> V {
        match source {
            Source::Constant(value) => value,
            Source::Texture(id) => V::arena(self).textures[id.index()].evaluate(ctx, self),
        }
    }

    /// Whether an input looks at the footprint of the camera's pixel. Where none does, none need be computed.
    pub fn needs_footprint<V: Value>(&self, source: Source<V>) -> bool {
        match source {
            Source::Constant(_) => false,
            Source::Texture(id) => V::arena(self).needs_footprint[id.index()],
        }
    }

    fn image(&self, id: ImageId) -> &MipMap {
        &self.images[id.index()]
    }
}

impl<V: Value> Texture<V> {
    /// Calls itself as deep as textures are nested, which is bounded at load.
    fn evaluate(&self, ctx: &TextureContext, textures: &Textures) -> V {
        match self {
            Self::Scale(scale) => scale.evaluate(ctx, textures),
            Self::Mix(mix) => mix.evaluate(ctx, textures),
            Self::Bilerp(bilerp) => bilerp.evaluate(ctx),
            Self::Image(image) => image.evaluate(textures.image(image.image), ctx),
            Self::Ptex(ptex) => ptex.evaluate(&textures.ptex[ptex.file.index()], ctx),
            Self::Checkerboard2(board) => board.evaluate(ctx, textures),
            Self::Checkerboard3(board) => board.evaluate(ctx, textures),
            Self::Dots(dots) => dots.evaluate(ctx, textures),
            Self::Fbm(fbm) => V::splat(fbm.evaluate(ctx)),
            Self::Wrinkled(wrinkled) => V::splat(wrinkled.evaluate(ctx)),
            Self::Windy(windy) => V::splat(windy.evaluate(ctx)),
            Self::Uv(uv) => V::from_rgb(uv.evaluate(ctx)),
            Self::Marble(marble) => V::from_rgb(marble.evaluate(ctx)),
        }
    }

    fn needs_footprint(&self, textures: &Textures) -> bool {
        let any = |inputs: &[Source<V>]| inputs.iter().any(|&s| textures.needs_footprint(s));
        match self {
            Self::Scale(scale) => any(&scale.factors),
            Self::Mix(mix) => any(&mix.ends) || textures.needs_footprint(mix.amount),
            Self::Bilerp(_) | Self::Uv(_) => false,
            Self::Checkerboard2(board) => {
                board.smoothing == Smoothing::ClosedForm || any(&board.fields)
            }
            Self::Checkerboard3(board) => any(&board.fields),
            Self::Dots(dots) => any(&[dots.ground, dots.dot]),
            Self::Image(_) | Self::Ptex(_) | Self::Fbm(_) | Self::Wrinkled(_) => true,
            Self::Windy(_) | Self::Marble(_) => true,
        }
    }
}
