//! PNG, TGA, JPEG and Radiance HDR, through the `image` crate.

use std::io::Cursor;

use ::image::{DynamicImage, ExtendedColorType, ImageFormat, ImageReader, Limits};

use crate::image::codec::DecodeOptions;
use crate::image::{Image, ImageError, codec, hdr, srgb};

/// Channels whose memory a picture takes while it is decoded: three of floats, and the codes that they are made of.
const DECODED_CHANNELS: usize = 4;

/// Decodes a file to its stored values: 8-bit codes over 255, HDR as is. 16-bit channels lose their low byte unless
/// `options` want them whole; alpha is dropped; grey stays grey.
pub(super) fn decode(
    bytes: &[u8],
    format: ImageFormat,
    options: &DecodeOptions,
) -> Result<Image, ImageError> {
    let plain;
    let bytes = if format == ImageFormat::Hdr {
        plain = hdr::normalised(bytes)?;
        plain.as_slice()
    } else {
        bytes
    };
    let reader = || ImageReader::with_format(Cursor::new(bytes), format);
    // What is decoded, and the samples made of it, exist at once.
    let (width, height) = reader().into_dimensions().map_err(decoding_error)?;
    options.fits(width as usize, height as usize, DECODED_CHANNELS)?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(codec::sample_budget(bytes.len()) as u64);
    let mut reader = reader();
    reader.limits(limits);
    let decoded = reader.decode().map_err(decoding_error)?;
    let from_u16 = if options.full_depth {
        from_whole_u16
    } else {
        from_u16
    };
    let (width, height) = (decoded.width() as usize, decoded.height() as usize);
    let (channels, data) = match decoded {
        DynamicImage::ImageLuma8(pixels) => (1, keep(&pixels, 1, 1, from_u8)),
        DynamicImage::ImageLumaA8(pixels) => (1, keep(&pixels, 2, 1, from_u8)),
        DynamicImage::ImageRgb8(pixels) => (3, keep(&pixels, 3, 3, from_u8)),
        DynamicImage::ImageRgba8(pixels) => (3, keep(&pixels, 4, 3, from_u8)),
        DynamicImage::ImageLuma16(pixels) => (1, keep(&pixels, 1, 1, from_u16)),
        DynamicImage::ImageLumaA16(pixels) => (1, keep(&pixels, 2, 1, from_u16)),
        DynamicImage::ImageRgb16(pixels) => (3, keep(&pixels, 3, 3, from_u16)),
        DynamicImage::ImageRgba16(pixels) => (3, keep(&pixels, 4, 3, from_u16)),
        DynamicImage::ImageRgb32F(pixels) => (3, pixels.into_raw()),
        DynamicImage::ImageRgba32F(pixels) => (3, keep(&pixels, 4, 3, |sample| sample)),
        other => {
            return Err(ImageError::Unsupported(format!(
                "pixels of type {:?} are not read",
                other.color()
            )));
        }
    };
    Image::new(width, height, channels, data)
}

/// Encodes linear values as 8-bit sRGB, grey or RGB.
pub(super) fn encode(image: &Image, format: ImageFormat) -> Result<Vec<u8>, ImageError> {
    let too_large = |_| {
        ImageError::TooLarge(format!(
            "{}x{} pixels do not fit the format",
            image.width(),
            image.height()
        ))
    };
    let width = u32::try_from(image.width()).map_err(too_large)?;
    let height = u32::try_from(image.height()).map_err(too_large)?;
    let codes: Vec<u8> = image
        .data()
        .iter()
        .map(|&sample| srgb::to_byte(sample))
        .collect();
    let colour = if image.channels() == 1 {
        ExtendedColorType::L8
    } else {
        ExtendedColorType::Rgb8
    };
    let mut bytes = Cursor::new(Vec::new());
    ::image::write_buffer_with_format(&mut bytes, &codes, width, height, colour, format)
        .map_err(|error| ImageError::TooLarge(error.to_string()))?;
    Ok(bytes.into_inner())
}

/// The first `kept` of every `stride` samples, converted.
fn keep<T: Copy>(
    samples: &[T],
    stride: usize,
    kept: usize,
    convert: impl Fn(T) -> f32,
) -> Vec<f32> {
    if kept == stride {
        return samples.iter().map(|&sample| convert(sample)).collect();
    }
    // Their number is known: the memory need not grow.
    let mut converted = Vec::with_capacity(samples.len() / stride * kept);
    for pixel in samples.chunks_exact(stride) {
        converted.extend(pixel[..kept].iter().map(|&sample| convert(sample)));
    }
    converted
}

fn from_u8(code: u8) -> f32 {
    f32::from(code) / 255.0
}

fn from_whole_u16(code: u16) -> f32 {
    f32::from(code) / 65535.0
}

/// As the scene format has it.
fn from_u16(code: u16) -> f32 {
    from_u8((code >> 8) as u8)
}

fn decoding_error(error: ::image::ImageError) -> ImageError {
    match error {
        ::image::ImageError::Unsupported(error) => ImageError::Unsupported(error.to_string()),
        ::image::ImageError::Limits(_) => {
            ImageError::TooLarge("the picture claims more pixels than its bytes can hold".into())
        }
        error => ImageError::Invalid(error.to_string()),
    }
}
