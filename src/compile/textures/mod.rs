//! Textures, built when something that is used reads them. Constants are folded away, and an image that several
//! textures share is decoded once.

mod classes;
mod images;
mod kind;
mod mappings;
mod nesting;
mod ptex;
#[cfg(test)]
mod tests;

use std::collections::HashMap;

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};

use crate::compile::assets::Assets;
use crate::compile::lookup;
use crate::compile::reader::{SpectrumValue, Textured};
use crate::compile::space::RenderSpace;
use crate::describe::description::{Frame, TextureEntity, TextureRef};
use crate::ids::PtexId;
use crate::spectrum::Rgb;
use crate::texture::{FloatSource, Source, SpectrumSource, Textures};
use classes::Directive;
use images::Images;
pub(super) use images::read_image;
use kind::Kind;
use nesting::Nesting;

/// What happens without a texture.
const INSTEAD: &str = "the default is used";

/// What was built of one value type.
struct Memo<V> {
    /// What textures have become; `None` for those that could not be built, which was reported.
    textures: HashMap<TextureRef, Option<Source<V>>>,
    images: Images<V>,
}

impl<V> Default for Memo<V> {
    fn default() -> Self {
        Self {
            textures: HashMap::new(),
            images: HashMap::new(),
        }
    }
}

/// The textures of a frame on their way into the world.
pub(super) struct TextureBuilder<'a> {
    entities: Vec<TextureEntity>,
    nesting: Vec<Nesting>,
    float: Memo<f32>,
    spectrum: Memo<Rgb>,
    /// Ptex files by their names; `None` for those that cannot be shown.
    ptex_files: HashMap<String, Option<PtexId>>,
    ptex_bytes_left: u64,
    textures: Textures,
    space: RenderSpace,
    assets: &'a dyn Assets,
}

impl<'a> TextureBuilder<'a> {
    pub(super) fn new(frame: &mut Frame, space: &RenderSpace, assets: &'a dyn Assets) -> Self {
        let entities = std::mem::take(&mut frame.textures);
        Self {
            nesting: nesting::of(&entities),
            entities,
            float: Memo::default(),
            spectrum: Memo::default(),
            ptex_files: HashMap::new(),
            ptex_bytes_left: ptex::BYTES_MAX,
            textures: Textures::new(space.scale() as f32),
            space: *space,
            assets,
        }
    }

    /// Names of those that nothing has led to.
    pub(super) fn skipped(&self) -> Vec<String> {
        let is_built = |texture: &TextureRef| {
            self.float.textures.contains_key(texture)
                || self.spectrum.textures.contains_key(texture)
        };
        let skipped = self.entities.iter().zip((0..).map(TextureRef));
        let skipped = skipped.filter(|(_, texture)| !is_built(texture));
        skipped
            .map(|(entity, _)| entity.name.value.clone())
            .collect()
    }

    pub(super) fn finish(self) -> Textures {
        self.textures
    }

    /// A scalar parameter; `default` where neither file nor schema has one.
    pub(super) fn float_source(
        &mut self,
        value: Textured<f32>,
        default: f32,
        diagnostics: &mut Diagnostics,
    ) -> FloatSource {
        self.source(value, default, diagnostics)
    }

    /// Where files come from.
    pub(super) fn assets(&self) -> &'a dyn Assets {
        self.assets
    }

    /// A colour parameter; `default` where neither file nor schema has one.
    pub(super) fn spectrum_source(
        &mut self,
        value: Textured<SpectrumValue>,
        default: f32,
        diagnostics: &mut Diagnostics,
    ) -> SpectrumSource {
        // Spectra may leave the gamut; who writes a colour with a negative part means something else.
        if let Textured::Constant(constant) = &value
            && let SpectrumValue::Rgb(rgb) = constant.value
            && rgb.iter().any(|c| *c < 0.0)
        {
            let message = "a colour with a negative part reflects nothing there";
            diagnostics.push(
                Diagnostic::warning("negative-colour", constant.span, message)
                    .with_label("counts as 0"),
            );
        }
        self.source(value, Rgb::splat(default), diagnostics)
    }

    fn source<V: Kind>(
        &mut self,
        value: Textured<V::Written>,
        default: V,
        diagnostics: &mut Diagnostics,
    ) -> Source<V> {
        match value {
            Textured::Constant(value) => {
                Source::Constant(V::value(&value, self.assets, diagnostics))
            }
            Textured::Default => Source::Constant(default),
            Textured::Texture(texture) => self
                .texture(texture, diagnostics)
                .unwrap_or(Source::Constant(default)),
        }
    }

    /// A texture, built when it is first asked for. Calls itself for the inputs, as deep as [`nesting`] allows.
    fn texture<V: Kind>(
        &mut self,
        texture: TextureRef,
        diagnostics: &mut Diagnostics,
    ) -> Option<Source<V>> {
        if let Some(source) = V::memo(self).textures.get(&texture) {
            return *source;
        }
        let source = self.build(texture, diagnostics);
        V::memo(self).textures.insert(texture, source);
        source
    }

    fn build<V: Kind>(
        &mut self,
        texture: TextureRef,
        diagnostics: &mut Diagnostics,
    ) -> Option<Source<V>> {
        let entity = self.entities[texture.0 as usize].clone();
        debug_assert_eq!(entity.value_type, V::TYPE);
        let kind = &entity.entity.kind;
        let plugin = lookup(V::FAMILY, kind, INSTEAD, diagnostics)?;
        if let Err(message) = self.nesting[texture.0 as usize].check() {
            let error = Diagnostic::error("deep-texture", entity.name.span, message);
            diagnostics.push(error.with_label(INSTEAD));
            return None;
        }
        let source: Source<V> = self.class(Directive {
            plugin,
            entity: &entity,
            diagnostics: &mut *diagnostics,
        })?;
        if let Source::Constant(value) = source
            && !value.is_finite()
        {
            let message = "the value of this texture is too large for single precision";
            let error = Diagnostic::error("bad-texture", entity.name.span, message);
            diagnostics.push(error.with_label(INSTEAD));
            return None;
        }
        Some(source)
    }
}
