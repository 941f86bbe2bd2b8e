//! What reading a scalar texture and reading a colour texture differ in.

use tyndall_parser::diagnostic::Diagnostics;
use tyndall_parser::schema::Family;
use tyndall_parser::source::Spanned;

use crate::compile::assets::Assets;
use crate::compile::reader::{ParamReader, SpectrumValue, Textured};
use crate::compile::spectra;
use crate::compile::textures::images::read_image;
use crate::compile::textures::{Memo, TextureBuilder};
use crate::describe::description::TextureType;
use crate::image::Image;
use crate::image::repair::Samples;
use crate::spectrum::Rgb;
use crate::texture::Value;

/// What happens without an image.
const INSTEAD: &str = "grey is used";

/// A value type with its words in scene files.
pub(super) trait Kind: Value {
    /// A constant as the reader finds it.
    type Written: Clone;
    const FAMILY: Family;
    const TYPE: TextureType;

    /// A parameter of the texture's own type that takes no texture.
    fn constant(p: &mut ParamReader, name: &str) -> Spanned<Self::Written>;

    /// A parameter of the texture's own type.
    fn textured(p: &mut ParamReader, name: &str) -> Textured<Self::Written>;

    /// The value of a constant.
    fn value(
        written: &Spanned<Self::Written>,
        assets: &dyn Assets,
        diagnostics: &mut Diagnostics,
    ) -> Self;

    /// The samples of an image as stored, in no more channels than the value has; `None` if it cannot be read.
    fn pixels(
        file: &Spanned<String>,
        assets: &dyn Assets,
        diagnostics: &mut Diagnostics,
    ) -> Option<Image>;

    /// What was built so far.
    fn memo<'a>(builder: &'a mut TextureBuilder) -> &'a mut Memo<Self>;
}

impl Kind for f32 {
    type Written = f32;
    const FAMILY: Family = Family::FloatTexture;
    const TYPE: TextureType = TextureType::Float;

    fn constant(p: &mut ParamReader, name: &str) -> Spanned<f32> {
        Spanned::new(p.float(name), p.span(name))
    }

    fn textured(p: &mut ParamReader, name: &str) -> Textured<f32> {
        p.float_texture(name)
    }

    fn value(written: &Spanned<f32>, _: &dyn Assets, _: &mut Diagnostics) -> Self {
        written.value
    }

    fn pixels(
        file: &Spanned<String>,
        assets: &dyn Assets,
        diagnostics: &mut Diagnostics,
    ) -> Option<Image> {
        // Heights may be negative.
        read_image(file, Samples::Finite, assets, INSTEAD, diagnostics).map(Image::into_grey)
    }

    fn memo<'a>(builder: &'a mut TextureBuilder) -> &'a mut Memo<Self> {
        &mut builder.float
    }
}

impl Kind for Rgb {
    type Written = SpectrumValue;
    const FAMILY: Family = Family::SpectrumTexture;
    const TYPE: TextureType = TextureType::Spectrum;

    fn constant(p: &mut ParamReader, name: &str) -> Spanned<SpectrumValue> {
        p.spectrum(name)
    }

    fn textured(p: &mut ParamReader, name: &str) -> Textured<SpectrumValue> {
        p.spectrum_texture(name)
    }

    fn value(
        written: &Spanned<SpectrumValue>,
        assets: &dyn Assets,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        spectra::to_rgb(written, assets, diagnostics)
    }

    fn pixels(
        file: &Spanned<String>,
        assets: &dyn Assets,
        diagnostics: &mut Diagnostics,
    ) -> Option<Image> {
        read_image(file, Samples::NonNegative, assets, INSTEAD, diagnostics)
    }

    fn memo<'a>(builder: &'a mut TextureBuilder) -> &'a mut Memo<Self> {
        &mut builder.spectrum
    }
}
