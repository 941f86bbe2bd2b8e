//! Textures, built when a material that is used reads them. Constants are folded away, and an image that several
//! textures share is decoded once.

use std::collections::HashMap;

use glam::Vec2;
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::{Family, PluginRef};
use tyndall_parser::source::Spanned;

use crate::compile::assets::{Assets, extension};
use crate::compile::reader::{ParamReader, SpectrumValue, Textured};
use crate::compile::{lookup, spectra, unsupported};
use crate::describe::description::{Frame, TextureEntity, TextureRef, TextureType};
use crate::ids::{FloatTextureId, ImageId, SpectrumTextureId};
use crate::image::mip::{MipMap, Wrap};
use crate::image::repair::repair;
use crate::image::{Image, codec, srgb};
use crate::spectrum::Rgb;
use crate::texture::{
    Filter, FloatSource, FloatTexture, ImageTexture, SpectrumSource, SpectrumTexture, Textures,
    UvMapping,
};

/// What stands in for an image that cannot be read, before gamma and scale.
const MISSING_IMAGE: f32 = 0.5;

/// What makes two images the same: file, grey or colour, gamma, scale, wrap.
#[derive(PartialEq, Eq, Hash)]
struct ImageKey {
    path: String,
    grey: bool,
    gamma: bool,
    scale: u32,
    wrap: Wrap,
}

/// The textures of a frame on their way into the world.
pub(super) struct TextureBuilder<'a> {
    entities: Vec<TextureEntity>,
    float: HashMap<TextureRef, Option<FloatSource>>,
    spectrum: HashMap<TextureRef, Option<SpectrumSource>>,
    images: HashMap<ImageKey, ImageId>,
    built: Textures,
    assets: &'a dyn Assets,
}

impl<'a> TextureBuilder<'a> {
    pub(super) fn new(frame: &mut Frame, assets: &'a dyn Assets) -> Self {
        Self {
            entities: std::mem::take(&mut frame.textures),
            float: HashMap::new(),
            spectrum: HashMap::new(),
            images: HashMap::new(),
            built: Textures::default(),
            assets,
        }
    }

    pub(super) fn skipped(&self) -> usize {
        self.entities.len() - self.float.len() - self.spectrum.len()
    }

    pub(super) fn finish(self) -> Textures {
        self.built
    }

    /// A scalar parameter of a material; `default` where neither file nor schema has one.
    pub(super) fn float_source(
        &mut self,
        value: Textured<f32>,
        default: f32,
        diagnostics: &mut Diagnostics,
    ) -> FloatSource {
        match value {
            Textured::Constant(value) => FloatSource::Constant(value.value),
            Textured::Default => FloatSource::Constant(default),
            Textured::Texture(texture) => self
                .float(texture, diagnostics)
                .unwrap_or(FloatSource::Constant(default)),
        }
    }

    /// A colour parameter of a material; `default` where neither file nor schema has one.
    pub(super) fn spectrum_source(
        &mut self,
        value: Textured<SpectrumValue>,
        default: f32,
        diagnostics: &mut Diagnostics,
    ) -> SpectrumSource {
        let default = SpectrumSource::Constant(Rgb::splat(default));
        match value {
            Textured::Constant(value) => {
                SpectrumSource::Constant(spectra::to_rgb(&value, self.assets, diagnostics))
            }
            Textured::Default => default,
            Textured::Texture(texture) => self.spectrum(texture, diagnostics).unwrap_or(default),
        }
    }

    fn float(&mut self, texture: TextureRef, diagnostics: &mut Diagnostics) -> Option<FloatSource> {
        if let Some(source) = self.float.get(&texture) {
            return *source;
        }
        let source = self.build_float(texture, diagnostics);
        self.float.insert(texture, source);
        source
    }

    fn spectrum(
        &mut self,
        texture: TextureRef,
        diagnostics: &mut Diagnostics,
    ) -> Option<SpectrumSource> {
        if let Some(source) = self.spectrum.get(&texture) {
            return *source;
        }
        let source = self.build_spectrum(texture, diagnostics);
        self.spectrum.insert(texture, source);
        source
    }

    fn build_float(
        &mut self,
        texture: TextureRef,
        diagnostics: &mut Diagnostics,
    ) -> Option<FloatSource> {
        let entity = self.entities[texture.0 as usize].clone();
        debug_assert_eq!(entity.value_type, TextureType::Float);
        let kind = &entity.entity.kind;
        let plugin = lookup(
            Family::FloatTexture,
            kind,
            "the default is used",
            diagnostics,
        )?;
        match plugin.schema.name {
            "constant" => {
                let mut p = ParamReader::new(plugin, &entity.entity, diagnostics);
                let value = p.float("value");
                p.finish();
                Some(FloatSource::Constant(value))
            }
            "imagemap" => {
                let image = self.image_texture(plugin, &entity, true, diagnostics)?;
                self.built.float.push(FloatTexture::Image(image));
                Some(FloatSource::Texture(FloatTextureId::new(
                    self.built.float.len() - 1,
                )))
            }
            name => {
                let what = format!("the texture class \"{name}\"");
                diagnostics.push(unsupported(&what, kind.span, "the default is used"));
                None
            }
        }
    }

    fn build_spectrum(
        &mut self,
        texture: TextureRef,
        diagnostics: &mut Diagnostics,
    ) -> Option<SpectrumSource> {
        let entity = self.entities[texture.0 as usize].clone();
        debug_assert_eq!(entity.value_type, TextureType::Spectrum);
        let kind = &entity.entity.kind;
        let plugin = lookup(
            Family::SpectrumTexture,
            kind,
            "the default is used",
            diagnostics,
        )?;
        match plugin.schema.name {
            "constant" => {
                let mut p = ParamReader::new(plugin, &entity.entity, diagnostics);
                let value = p.spectrum("value");
                p.finish();
                Some(SpectrumSource::Constant(spectra::to_rgb(
                    &value,
                    self.assets,
                    diagnostics,
                )))
            }
            "imagemap" => {
                let image = self.image_texture(plugin, &entity, false, diagnostics)?;
                self.built.spectrum.push(SpectrumTexture::Image(image));
                Some(SpectrumSource::Texture(SpectrumTextureId::new(
                    self.built.spectrum.len() - 1,
                )))
            }
            name => {
                let what = format!("the texture class \"{name}\"");
                diagnostics.push(unsupported(&what, kind.span, "the default is used"));
                None
            }
        }
    }

    fn image_texture(
        &mut self,
        plugin: PluginRef,
        entity: &TextureEntity,
        grey: bool,
        diagnostics: &mut Diagnostics,
    ) -> Option<ImageTexture> {
        let mut p = ParamReader::new(plugin, &entity.entity, diagnostics);
        let mapping = uv_mapping(&mut p);
        let wrap = match p.choice("wrap") {
            "black" => Wrap::Black,
            "clamp" => Wrap::Clamp,
            _ => Wrap::Repeat,
        };
        let max_anisotropy = p.float("maxanisotropy");
        let filter = if p.bool("trilinear") {
            Filter::Trilinear
        } else {
            Filter::Ewa { max_anisotropy }
        };
        let scale = p.float("scale");
        let file = p.file("filename");
        let gamma = p.optional_bool("gamma");
        p.finish();
        let file = file?;
        let gamma = gamma.unwrap_or_else(|| codec::is_gamma_encoded(extension(&file.value)));
        let key = ImageKey {
            path: file.value.clone(),
            grey,
            gamma,
            scale: scale.to_bits(),
            wrap,
        };
        let image = match self.images.get(&key) {
            Some(&image) => image,
            None => {
                let pyramid = self.load(&file, &key, scale, diagnostics);
                self.built.images.push(pyramid);
                let id = ImageId::new(self.built.images.len() - 1);
                self.images.insert(key, id);
                id
            }
        };
        Some(ImageTexture {
            image,
            mapping,
            filter,
        })
    }

    fn load(
        &self,
        file: &Spanned<String>,
        key: &ImageKey,
        scale: f32,
        diagnostics: &mut Diagnostics,
    ) -> MipMap {
        let mut image = read_image(file, self.assets, "grey is used", diagnostics)
            .unwrap_or(Image::constant(MISSING_IMAGE));
        if key.grey {
            image = image.into_grey();
        }
        if key.gamma {
            srgb::linearize(&mut image);
        }
        for value in image.data_mut() {
            *value *= scale;
        }
        image.flip_vertical();
        MipMap::new(image, key.wrap)
    }
}

/// Reads and decodes an image whose texels are made finite and non-negative; faults are located at the file name.
pub(super) fn read_image(
    file: &Spanned<String>,
    assets: &dyn Assets,
    instead: &str,
    diagnostics: &mut Diagnostics,
) -> Option<Image> {
    let mut fail = |code: &'static str, message: String| {
        diagnostics.push(Diagnostic::error(code, file.span, message).with_label(instead));
    };
    let bytes = match assets.read(file) {
        Ok(bytes) => bytes,
        Err(error) => {
            fail(
                "missing-file",
                format!("cannot read \"{}\": {error}", file.value),
            );
            return None;
        }
    };
    let mut image = match codec::decode((*bytes).as_ref(), extension(&file.value)) {
        Ok(decoded) => decoded.image,
        Err(error) => {
            fail(
                "bad-image",
                format!("cannot decode \"{}\": {error}", file.value),
            );
            return None;
        }
    };
    let repairs = repair(&mut image);
    if repairs.total() > 0 {
        let message = format!(
            "\"{}\" holds {} values that are negative, infinite or not numbers: they are repaired",
            file.value,
            repairs.total()
        );
        diagnostics.push(Diagnostic::warning("bad-texels", file.span, message));
    }
    Some(image)
}

fn uv_mapping(p: &mut ParamReader) -> UvMapping {
    if p.choice("mapping") != "uv" {
        let span = p.span("mapping");
        p.report(unsupported("this mapping", span, "\"uv\" is used"));
    }
    UvMapping {
        scale: Vec2::new(p.float("uscale"), p.float("vscale")),
        delta: Vec2::new(p.float("udelta"), p.float("vdelta")),
    }
}
