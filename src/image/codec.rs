//! The front door of the codecs: bytes to pixels and back, by file extension.
//!
//! | extension | read | write |
//! |---|---|---|
//! | `exr` | half, float or integer channels, scan lines or tiles, data window only | 32-bit float, or half on request |
//! | `pfm` | grey and RGB, both byte orders | little-endian float |
//! | `png` | to 8 bits per channel, or 16 on request | 8-bit sRGB |
//! | `tga` | grey, RGB, colour-mapped | 8-bit sRGB |
//! | `hdr`, `jpg`, `jpeg` | yes | no |
//!
//! Extensions are case-insensitive. Alpha is discarded. Values come as stored: nothing is linearised here.

use crate::image::{Image, ImageError, PixelRect, openexr, pfm, raster};

/// Pixels with what a file says around them.
#[derive(Clone, PartialEq, Debug)]
pub struct ImageFile {
    /// The pixels of the data window.
    pub image: Image,
    /// Left and top edge of the data window, in the coordinates of the display window.
    pub origin: (i32, i32),
    /// The frame the pixels are part of.
    pub display_window: PixelRect,
    /// Named facts; decoding sorts them by name.
    pub attributes: Vec<(String, Attribute)>,
}

/// A named fact in a file's header.
#[derive(Clone, PartialEq, Debug)]
pub enum Attribute {
    /// Text.
    Text(String),
    /// A number.
    Float(f32),
    /// A whole number.
    Int(i32),
}

/// Width of the samples of a written EXR.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Precision {
    /// 32 bits: what was computed is what is stored.
    #[default]
    Float,
    /// 16 bits: 11 significant ones, clamped to ±65504.
    Half,
}

/// What a reader wants of a file, and allows it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DecodeOptions {
    /// 16-bit PNG is read whole; otherwise its low bytes are lost, as the scene format has it.
    pub full_depth: bool,
    /// Bytes of memory that decoding may take.
    pub max_bytes: u64,
}

impl Default for DecodeOptions {
    fn default() -> Self {
        Self {
            full_depth: false,
            max_bytes: u64::MAX,
        }
    }
}

impl DecodeOptions {
    /// Refuses pictures of more samples than there may be memory for.
    pub(super) fn fits(
        &self,
        width: usize,
        height: usize,
        channels: usize,
    ) -> Result<(), ImageError> {
        let n_bytes = width as u128 * height as u128 * channels as u128 * size_of::<f32>() as u128;
        if n_bytes <= u128::from(self.max_bytes) {
            return Ok(());
        }
        Err(ImageError::TooLarge(format!(
            "{width}x{height} pixels take {} MiB of memory, more than the {} MiB that are left",
            n_bytes >> 20,
            self.max_bytes >> 20
        )))
    }
}

/// A decoded file, and what a reader should know of how it was understood.
#[derive(Clone, PartialEq, Debug)]
pub struct Decoded {
    /// The picture.
    pub file: ImageFile,
    /// Which of several pictures was taken.
    pub note: Option<String>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Exr,
    Pfm,
    Png,
    Tga,
    Hdr,
    Jpeg,
}

impl ImageFile {
    /// An image that fills its frame and says nothing more.
    pub fn new(image: Image) -> Self {
        let display_window = image.bounds();
        Self {
            image,
            origin: (0, 0),
            display_window,
            attributes: Vec::new(),
        }
    }

    /// Where the pixels lie, in the coordinates of the display window.
    pub fn data_window(&self) -> PixelRect {
        let (x0, y0) = self.origin;
        PixelRect {
            x0,
            y0,
            ..self.image.bounds()
        }
    }

    /// The pixels inside `window` (coordinates of the display window). `None` when the file does not cover it.
    pub fn crop(&self, window: PixelRect) -> Option<Image> {
        let x0 = window.x0.checked_sub(self.origin.0)?;
        let y0 = window.y0.checked_sub(self.origin.1)?;
        self.image.crop(PixelRect { x0, y0, ..window })
    }
}

/// Decodes a file's bytes; `extension` (without dot) names the format.
///
/// Memory is bounded by the length of the input: see [`ImageError::TooLarge`].
///
/// # Errors
/// [`ImageError`], by who must act.
pub fn decode(bytes: &[u8], extension: &str) -> Result<ImageFile, ImageError> {
    decode_with(bytes, extension, &DecodeOptions::default()).map(|decoded| decoded.file)
}

/// The same by `options`, and with a note.
///
/// # Errors
/// [`ImageError`], by who must act.
pub fn decode_with(
    bytes: &[u8],
    extension: &str,
    options: &DecodeOptions,
) -> Result<Decoded, ImageError> {
    use ::image::ImageFormat;
    let format = format_of(extension)?;
    let plain = |image| Decoded {
        file: ImageFile::new(image),
        note: None,
    };
    let raster = |format| raster::decode(bytes, format, options).map(plain);
    let decode = || match format {
        Format::Exr => openexr::decode(bytes, options),
        Format::Pfm => pfm::decode(bytes, options).map(plain),
        Format::Png => raster(ImageFormat::Png),
        Format::Tga => raster(ImageFormat::Tga),
        Format::Hdr => raster(ImageFormat::Hdr),
        Format::Jpeg => raster(ImageFormat::Jpeg),
    };
    // A damaged file must not end the program, and not every codec below is free of arithmetic that overflows on one.
    // Nothing outlives the call, so nothing is seen half-changed.
    std::panic::catch_unwind(decode).unwrap_or_else(|_| {
        Err(ImageError::Invalid(format!(
            "the {extension} decoder gave up on damaged data"
        )))
    })
}

/// Encodes a file; `extension` (without dot) names the format. The same input gives the same bytes.
///
/// Only EXR keeps windows and attributes and heeds `precision`; the 8-bit formats take linear values and store sRGB.
///
/// # Errors
/// [`ImageError::Unsupported`] for a format that is not written, [`ImageError::TooLarge`] when it has no room for the
/// resolution, [`ImageError::Invalid`] for attribute names EXR cannot hold.
pub fn encode(
    file: &ImageFile,
    extension: &str,
    precision: Precision,
) -> Result<Vec<u8>, ImageError> {
    match format_of(extension)? {
        Format::Exr => openexr::encode(file, precision),
        Format::Pfm => Ok(pfm::encode(&file.image)),
        Format::Png => raster::encode(&file.image, ::image::ImageFormat::Png),
        Format::Tga => raster::encode(&file.image, ::image::ImageFormat::Tga),
        Format::Hdr | Format::Jpeg => Err(ImageError::Unsupported(format!(
            "\"{extension}\" files are read, not written; use exr, pfm, png or tga"
        ))),
    }
}

/// True for the extensions whose files are read as 8-bit codes, which pictures hold in sRGB, so that `gamma` defaults
/// to true.
pub fn is_eight_bit(extension: &str) -> bool {
    matches!(
        format_of(extension),
        Ok(Format::Png | Format::Tga | Format::Jpeg)
    )
}

fn format_of(extension: &str) -> Result<Format, ImageError> {
    const FORMATS: [(&str, Format); 7] = [
        ("exr", Format::Exr),
        ("pfm", Format::Pfm),
        ("png", Format::Png),
        ("tga", Format::Tga),
        ("hdr", Format::Hdr),
        ("jpg", Format::Jpeg),
        ("jpeg", Format::Jpeg),
    ];
    let found = FORMATS
        .iter()
        .find(|(name, _)| extension.eq_ignore_ascii_case(name));
    found.map(|&(_, format)| format).ok_or_else(|| {
        ImageError::Unsupported(format!(
            "\"{extension}\" is not an image format known here: exr, pfm, png, tga, hdr, jpg"
        ))
    })
}

/// Most samples that a file of this length may unpack to.
///
/// Deflate, the densest code in use, shrinks at most 1032:1; a few small pictures' worth is free, so that tiny files
/// of one colour pass.
pub(super) fn sample_budget(n_bytes: usize) -> usize {
    const FREE: usize = 16 << 20;
    const DEFLATE_RATIO: usize = 1032;
    n_bytes.saturating_mul(DEFLATE_RATIO).saturating_add(FREE)
}

/// The error for a file that claims more than [`sample_budget`].
pub(super) fn too_large(width: usize, height: usize, n_bytes: usize) -> ImageError {
    ImageError::TooLarge(format!(
        "a file of {n_bytes} bytes cannot hold {width}x{height} pixels"
    ))
}
