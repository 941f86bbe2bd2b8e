//! Images of textures: read, decoded, made linear and filtered down once for all textures that share them.

use std::collections::HashMap;

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::Spanned;

use crate::compile::assets::{Assets, extension, lack_of_memory, read_file};
use crate::compile::textures::TextureBuilder;
use crate::compile::textures::kind::Kind;
use crate::ids::ImageId;
use crate::image::codec::{DecodeOptions, Decoded};
use crate::image::mip::{MipMap, Wrap};
use crate::image::repair::{Samples, repair};
use crate::image::{Image, codec, srgb};

/// What stands in for an image that cannot be read, before gamma and scale.
const MISSING_IMAGE: f32 = 0.5;

/// An image as a texture names it.
pub(super) struct WrittenImage {
    pub(super) file: Spanned<String>,
    /// Whether samples are sRGB codes; by the kind of file where it is not said.
    pub(super) gamma: Option<bool>,
    pub(super) scale: f32,
    pub(super) wrap: Wrap,
}

/// What makes two images of one value type the same.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct ImageKey {
    path: String,
    gamma: bool,
    scale: u32,
    wrap: Wrap,
}

/// What an image has become.
#[derive(Clone, Copy)]
pub(super) enum Loaded<V> {
    /// The same everywhere, also beyond its border.
    Constant(V),
    /// Something to look up.
    Image(ImageId),
}

/// The images of one value type that were read so far.
pub(super) type Images<V> = HashMap<ImageKey, Loaded<V>>;

impl TextureBuilder<'_> {
    pub(super) fn image<V: Kind>(
        &mut self,
        image: WrittenImage,
        diagnostics: &mut Diagnostics,
    ) -> Loaded<V> {
        let WrittenImage {
            file,
            gamma,
            scale,
            wrap,
        } = image;
        let key = ImageKey {
            gamma: gamma.unwrap_or_else(|| codec::is_eight_bit(extension(&file.value))),
            path: file.value.clone(),
            scale: scale.to_bits(),
            wrap,
        };
        if let Some(loaded) = V::memo(self).images.get(&key) {
            return *loaded;
        }
        let pixels = V::pixels(&file, self.assets, diagnostics);
        let pixels = pixels.unwrap_or_else(|| Image::constant(MISSING_IMAGE));
        let loaded = self.load(pixels, &key);
        V::memo(self).images.insert(key, loaded);
        loaded
    }

    /// From samples as stored to a constant or a pyramid.
    fn load<V: Kind>(&mut self, mut image: Image, key: &ImageKey) -> Loaded<V> {
        if key.gamma {
            srgb::linearize(&mut image);
        }
        let scale = f32::from_bits(key.scale);
        if scale != 1.0 {
            for sample in image.data_mut() {
                *sample = (*sample * scale).clamp(f32::MIN, f32::MAX);
            }
        }
        let mut pixels = image.data().chunks_exact(image.channels());
        let first = image.pixel(0, 0);
        if key.wrap != Wrap::Black && pixels.all(|pixel| pixel == first) {
            return Loaded::Constant(V::from_samples(first));
        }
        image.flip_vertical();
        Loaded::Image(self.textures.add_image(MipMap::new(image, key.wrap)))
    }
}

/// Reads and decodes an image whose samples are made what `samples` says; faults are located at the file name.
pub(in crate::compile) fn read_image(
    file: &Spanned<String>,
    samples: Samples,
    assets: &dyn Assets,
    instead: &str,
    diagnostics: &mut Diagnostics,
) -> Option<Image> {
    let bytes = match read_file(file, assets) {
        Ok(bytes) => bytes,
        Err(missing) => {
            diagnostics.push(missing.with_label(instead));
            return None;
        }
    };
    let options = DecodeOptions {
        max_bytes: assets.memory_left(),
        ..DecodeOptions::default()
    };
    let mut image = match codec::decode_with((*bytes).as_ref(), extension(&file.value), &options) {
        Ok(Decoded {
            file: decoded,
            note,
        }) => {
            if let Some(note) = note {
                let message = format!("\"{}\" holds more than a picture: {note}", file.value);
                diagnostics.push(Diagnostic::warning("image-part", file.span, message));
            }
            decoded.image
        }
        Err(error) => {
            let message = format!("cannot decode \"{}\": {error}", file.value);
            let found = Diagnostic::error("bad-image", file.span, message);
            diagnostics.push(found.with_label(instead));
            return None;
        }
    };
    if let Some(lack) = lack_of_memory(bytes_of_pyramid(&image), assets) {
        let message = format!("a pyramid of \"{}\" {lack}", file.value);
        diagnostics.push(Diagnostic::error("too-large", file.span, message).with_label(instead));
        return None;
    }
    let repairs = repair(&mut image, samples);
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

/// Memory of the pyramid that is made of an image: its sides grow to powers of two, and the smaller levels are a third
/// more.
fn bytes_of_pyramid(image: &Image) -> u128 {
    let sides = [image.width(), image.height()].map(|side| side.next_power_of_two() as u128);
    let n_samples = sides[0] * sides[1] * image.channels() as u128;
    n_samples * size_of::<f32>() as u128 * 4 / 3
}
