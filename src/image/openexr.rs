//! OpenEXR, through the `exr` crate, block by block: the pixels exist once.

use std::io::Cursor;

use ::exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock};
use ::exr::block::reader::ChunksReader;
use ::exr::block::writer::ChunksWriter;
use ::exr::block::{self, BlockIndex, UncompressedBlock, lines::LineRef, lines::LineRefMut};
use ::exr::meta::header::{Header, LayerAttributes};
use ::exr::meta::{BlockDescription, MetaData};
use ::exr::prelude::{
    AttributeValue, ChannelDescription, Compression, Error, IntegerBounds, LineOrder, SampleType,
    SmallVec, Text, Vec2, f16,
};
use half::slice::HalfFloatSliceExt;

use crate::image::codec::{self, Attribute, DecodeOptions, Decoded, ImageFile, Precision};
use crate::image::{Image, ImageError, PixelRect, sample_count};

/// The largest finite half.
const MAX_HALF: f32 = 65504.0;

/// Attributes that belong to the format itself and are not handed on.
const STRUCTURAL: [&str; 8] = [
    "chunkCount",
    "dwaCompressionLevel",
    "maxSamplesPerPixel",
    "name",
    "pixelAspectRatio",
    "screenWindowWidth",
    "type",
    "version",
];

/// Decodes the part that shows the picture; see [`Picture::find`]. Only the highest resolution is read.
pub(super) fn decode(bytes: &[u8], options: &DecodeOptions) -> Result<Decoded, ImageError> {
    let reader = block::read(Cursor::new(bytes), false).map_err(exr_error)?;
    let (picture, note) = Picture::find(reader.headers())?;
    let header = reader.headers()[picture.part].clone();
    let (width, height) = (header.layer_size.width(), header.layer_size.height());
    let channels = picture.channels;
    let n_samples = sample_count(width, height, channels)
        .filter(|&count| count <= codec::sample_budget(bytes.len()));
    let n_samples = n_samples.ok_or_else(|| codec::too_large(width, height, bytes.len()))?;
    options.fits(width, height, channels)?;
    check_blocks(reader.headers(), bytes.len())?;

    // Zeroed memory costs nothing until a block is written to it.
    let mut data = vec![0.0; n_samples];
    let mut chunks = reader
        .filter_chunks(false, |_, tile, block| {
            block.layer == picture.part && tile.is_largest_resolution_level()
        })
        .map_err(exr_error)?;
    while let Some(chunk) = chunks.read_next_chunk() {
        let chunk = chunk.map_err(exr_error)?;
        if chunk.layer_index != picture.part {
            return Err(misplaced_block());
        }
        check_chunk(&chunk, &header)?;
        let block = UncompressedBlock::decompress_chunk(chunk, chunks.meta_data(), false)
            .map_err(exr_error)?;
        if block.index.level != Vec2(0, 0) {
            return Err(misplaced_block());
        }
        for line in block.lines(&header.channels) {
            let Some(slot) = picture.slots[line.location.channel] else {
                continue;
            };
            let start =
                (line.location.position.y() * width + line.location.position.x()) * channels;
            let pixels = data.get_mut(start..start + line.location.sample_count * channels);
            let pixels = pixels.ok_or_else(misplaced_block)?;
            read_line(
                &line,
                header.channels.list[line.location.channel].sample_type,
                Slots {
                    pixels,
                    channels,
                    slot,
                },
            );
        }
    }

    let display = header.shared_attributes.display_window;
    let origin = header.own_attributes.layer_position;
    let file = ImageFile {
        image: Image::new(width, height, channels, data)?,
        origin: (origin.x(), origin.y()),
        display_window: PixelRect {
            x0: display.position.x(),
            y0: display.position.y(),
            width: display.size.width(),
            height: display.size.height(),
        },
        attributes: attributes_of(&header),
    };
    Ok(Decoded { file, note })
}

/// A block is not the one its table says.
fn misplaced_block() -> ImageError {
    ImageError::Invalid("EXR: a block lies outside the picture".into())
}

/// Refuses headers whose blocks the input cannot hold, before anything is sized by them.
fn check_blocks(headers: &[Header], n_bytes: usize) -> Result<(), ImageError> {
    for header in headers {
        // Every block has an eight-byte entry in the offset table.
        if header.chunk_count > n_bytes / 8 {
            return Err(ImageError::Invalid(
                "the file is too short for its table of blocks".into(),
            ));
        }
        if let BlockDescription::Tiles(tiles) = header.blocks {
            let (width, height) = (tiles.tile_size.width(), tiles.tile_size.height());
            let n_samples = sample_count(width, height, header.channels.list.len());
            if n_samples.is_none_or(|count| count > codec::sample_budget(n_bytes)) {
                return Err(codec::too_large(width, height, n_bytes));
            }
        }
    }
    Ok(())
}

/// Refuses blocks whose own counters exceed what a block of the image can hold: DWA blocks begin with ten of them, and
/// their decoder sizes memory by them unseen.
fn check_chunk(chunk: &Chunk, header: &Header) -> Result<(), ImageError> {
    if !matches!(
        header.compression,
        Compression::DWAA(_) | Compression::DWAB(_)
    ) {
        return Ok(());
    }
    let (CompressedBlock::ScanLine(CompressedScanLineBlock {
        compressed_pixels_le: bytes,
        ..
    })
    | CompressedBlock::Tile(CompressedTileBlock {
        compressed_pixels_le: bytes,
        ..
    })) = &chunk.compressed_block
    else {
        return Ok(());
    };
    let place = header
        .get_block_data_indices(&chunk.compressed_block)
        .map_err(exr_error)?;
    let size = header
        .get_absolute_block_pixel_coordinates(place)
        .map_err(exr_error)?
        .size;
    if bytes.len() == size.area() * header.channels.bytes_per_pixel {
        // Stored as is, because compression did not help.
        return Ok(());
    }
    const N_COUNTERS: usize = 10;
    // The codec works on squares of 8x8 pixels and keeps some counters in bytes, some in pairs of them.
    let area = size.width().next_multiple_of(8) * size.height().next_multiple_of(8);
    let most = 4 * (area * header.channels.list.len()) as u64;
    let counters = bytes
        .as_chunks::<8>()
        .0
        .iter()
        .take(N_COUNTERS)
        .map(|&counter| u64::from_le_bytes(counter));
    // The first counter is a version.
    if counters.skip(1).any(|counter| counter > most) {
        return Err(ImageError::Invalid(
            "EXR: a compressed block claims more than a block can hold".into(),
        ));
    }
    Ok(())
}

/// The same sample of each of some pixels.
struct Slots<'a> {
    pixels: &'a mut [f32],
    /// 1 or 3.
    channels: usize,
    slot: usize,
}

impl Slots<'_> {
    /// Fills as many as there are stored samples, at most [`AT_ONCE`] at a time.
    fn fill<const N: usize>(self, stored: &[u8], convert: impl Fn(&[[u8; N]], &mut [f32])) {
        let mut values = [0.0; AT_ONCE];
        let pixels = self.pixels.chunks_mut(AT_ONCE * self.channels);
        for (pixels, stored) in pixels.zip(stored.as_chunks().0.chunks(AT_ONCE)) {
            let values = &mut values[..stored.len()];
            convert(stored, values);
            // A known stride makes for a short loop.
            if self.channels == 1 {
                for (sample, &value) in pixels.iter_mut().zip(&*values) {
                    *sample = value;
                }
            } else {
                for (pixel, &value) in pixels.as_chunks_mut::<3>().0.iter_mut().zip(&*values) {
                    pixel[self.slot] = value;
                }
            }
        }
    }
}

/// Samples converted at a time: few enough for the stack.
const AT_ONCE: usize = 256;

/// One line of one channel, converted to f32. Samples of decompressed lines are in the byte order of this machine.
fn read_line(line: &LineRef<'_>, sample_type: SampleType, slots: Slots<'_>) {
    match sample_type {
        SampleType::F16 => slots.fill(line.value, |stored, values| {
            let mut halves = [f16::ZERO; AT_ONCE];
            let halves = &mut halves[..stored.len()];
            for (half, &bytes) in halves.iter_mut().zip(stored) {
                *half = f16::from_ne_bytes(bytes);
            }
            halves.convert_to_f32_slice(values);
        }),
        SampleType::F32 => slots.fill(line.value, |stored, values| {
            each(stored, values, f32::from_ne_bytes);
        }),
        SampleType::U32 => slots.fill(line.value, |stored, values| {
            each(stored, values, |bytes| u32::from_ne_bytes(bytes) as f32);
        }),
    }
}

fn each<const N: usize>(stored: &[[u8; N]], values: &mut [f32], value: impl Fn([u8; N]) -> f32) {
    for (sample, &bytes) in values.iter_mut().zip(stored) {
        *sample = value(bytes);
    }
}

/// How well channels serve as the picture, best first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// `R`, `G` and `B`.
    Colour,
    /// Some of them; the others are 0.
    PartOfColour,
    /// `Y` without chroma.
    Luminance,
    /// A channel of any other name, alone in its part. Depth is one.
    Other,
}

/// A part, and which of its channels make a picture.
struct Picture {
    part: usize,
    rank: Rank,
    /// What stands before the names of its channels: empty, or a layer and a dot.
    layer: String,
    /// 1 or 3.
    channels: usize,
    /// For every channel of the part, its place in a pixel.
    slots: Vec<Option<usize>>,
}

impl Picture {
    /// The picture among all parts: `R`, `G`, `B`; else some of them; else `Y`; else a single channel of any name but
    /// `A`, if the file has no other picture. Channels without a layer come before those of layers (`diffuse.R`).
    /// Several that serve equally well are refused. And a note, if others were left aside.
    fn find(headers: &[Header]) -> Result<(Self, Option<String>), ImageError> {
        let flat = headers
            .iter()
            .enumerate()
            .filter(|(_, header)| !header.deep);
        let mut found: Vec<Self> = flat
            .flat_map(|(part, header)| Self::in_part(part, header))
            .collect();
        let Some(best) = found.iter().map(Self::order).min() else {
            let all_deep = headers.iter().all(|header| header.deep);
            return Err(ImageError::Unsupported(
                if all_deep && !headers.is_empty() {
                    "deep images are not read".into()
                } else {
                    "the file has no channels R, G, B or Y, and more than one other".into()
                },
            ));
        };
        let names: Vec<String> = found.iter().map(|picture| picture.name(headers)).collect();
        let mut equal = (0..found.len()).filter(|&i| found[i].order() == best);
        let taken = equal.next().expect("the best is among them");
        if equal.next().is_some() {
            let equal = (0..found.len()).filter(|&i| found[i].order() == best);
            let equal: Vec<&str> = equal.map(|i| names[i].as_str()).collect();
            return Err(ImageError::Unsupported(format!(
                "the file has several pictures: {}; keep one of them",
                equal.join(", ")
            )));
        }
        let others: Vec<&str> = (0..found.len())
            .filter(|&i| i != taken)
            .map(|i| names[i].as_str())
            .collect();
        let is_plain = others.is_empty() && found[taken].layer.is_empty();
        let note = (!is_plain).then(|| {
            let others = if others.is_empty() {
                String::new()
            } else {
                format!(", not {}", others.join(", "))
            };
            format!("{} is read{others}", names[taken])
        });
        Ok((found.swap_remove(taken), note))
    }

    fn order(&self) -> (Rank, bool) {
        (self.rank, !self.layer.is_empty())
    }

    /// What a person calls it.
    fn name(&self, headers: &[Header]) -> String {
        let header = &headers[self.part];
        let channels = header.channels.list.iter().zip(&self.slots);
        let mut channels: Vec<_> = channels
            .filter_map(|(channel, slot)| Some((slot.as_ref()?, channel.name.to_string())))
            .collect();
        channels.sort();
        let channels: Vec<String> = channels.into_iter().map(|(_, name)| name).collect();
        let channels = channels.join(" ");
        match &header.own_attributes.layer_name {
            Some(part) if headers.len() > 1 => format!("{channels} of part \"{part}\""),
            _ if headers.len() > 1 => format!("{channels} of part {}", self.part + 1),
            _ => channels,
        }
    }

    /// Every picture that a part holds.
    fn in_part(part: usize, header: &Header) -> Vec<Self> {
        let names: Vec<String> = header
            .channels
            .list
            .iter()
            .map(|channel| channel.name.to_string())
            .collect();
        let mut layers: Vec<String> = names
            .iter()
            .filter_map(|name| name.rsplit_once('.'))
            .map(|(layer, _)| format!("{layer}."))
            .collect();
        layers.push(String::new());
        layers.sort();
        layers.dedup();
        let mut found: Vec<Self> = layers
            .into_iter()
            .filter_map(|layer| Self::in_layer(part, &names, layer))
            .collect();
        if found.is_empty() {
            let mut colours = (0..names.len()).filter(|&i| !is_alpha(&names[i]));
            if let (Some(only), None) = (colours.next(), colours.next()) {
                found.push(Self {
                    part,
                    rank: Rank::Other,
                    layer: String::new(),
                    channels: 1,
                    slots: (0..names.len()).map(|i| (i == only).then_some(0)).collect(),
                });
            }
        }
        found
    }

    fn in_layer(part: usize, names: &[String], layer: String) -> Option<Self> {
        let place = |wanted: &[&str]| -> Vec<Option<usize>> {
            let slot = |name: &String| {
                let name = name.strip_prefix(&*layer)?;
                wanted.iter().position(|wanted| *wanted == name)
            };
            names.iter().map(slot).collect()
        };
        let count = |slots: &[Option<usize>]| slots.iter().flatten().count();
        let (rgb, grey) = (place(&["R", "G", "B"]), place(&["Y"]));
        // Chroma needs a conversion; a place, or a normal, has a Y as well.
        let is_other = count(&place(&["RY", "BY", "X"])) > 0;
        let (rank, channels, slots) = match count(&rgb) {
            3 => (Rank::Colour, 3, rgb),
            1 | 2 => (Rank::PartOfColour, 3, rgb),
            _ if count(&grey) > 0 && !is_other => (Rank::Luminance, 1, grey),
            _ => return None,
        };
        Some(Self {
            part,
            rank,
            layer,
            channels,
            slots,
        })
    }
}

/// Whether a channel is coverage.
fn is_alpha(name: &str) -> bool {
    name.rsplit('.').next() == Some("A")
}

/// Text, float and integer attributes, sorted by name.
fn attributes_of(header: &Header) -> Vec<(String, Attribute)> {
    let mut attributes: Vec<(String, Attribute)> = header
        .all_named_attributes()
        .filter_map(|(name, value)| {
            let value = match value {
                AttributeValue::Text(text) => {
                    Attribute::Text(String::from_utf8_lossy(text.as_slice()).into_owned())
                }
                AttributeValue::F32(value) => Attribute::Float(value),
                AttributeValue::I32(value) => Attribute::Int(value),
                _ => return None,
            };
            Some((String::from_utf8_lossy(name).into_owned(), value))
        })
        .filter(|(name, _)| !STRUCTURAL.contains(&name.as_str()))
        .collect();
    attributes.sort_by(|a, b| a.0.cmp(&b.0));
    attributes
}

/// Encodes scan lines with lossless ZIP compression; grey goes to channel `Y`.
pub(super) fn encode(file: &ImageFile, precision: Precision) -> Result<Vec<u8>, ImageError> {
    let header = header_for(file, precision)?;
    let channels = header.channels.clone();
    let mut bytes = Cursor::new(Vec::new());
    block::write(
        &mut bytes,
        SmallVec::from_iter([header]),
        false,
        |meta: MetaData, writer| {
            let blocks = block::enumerate_ordered_header_block_indices(&meta.headers).map(
                |(index, block): (_, BlockIndex)| {
                    (
                        index,
                        UncompressedBlock::from_lines(&channels, block, |line| {
                            write_line(&file.image, precision, line)
                        }),
                    )
                },
            );
            // The compressor borrows the writer, which must outlive the loop.
            let mut compressor = writer.sequential_blocks_compressor(&meta);
            for (index, block) in blocks {
                compressor.compress_block(index, block)?;
            }
            Ok(())
        },
    )
    .map_err(exr_error)?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

fn header_for(file: &ImageFile, precision: Precision) -> Result<Header, ImageError> {
    let image = &file.image;
    let sample_type = match precision {
        Precision::Float => SampleType::F32,
        Precision::Half => SampleType::F16,
    };
    let names: &[&str] = if image.channels() == 1 {
        &["Y"]
    } else {
        &["B", "G", "R"]
    };
    let channels = names
        .iter()
        .map(|&name| ChannelDescription::new(name, sample_type, false))
        .collect();
    let display = file.display_window;
    // The format keeps every coordinate within ±2^30.
    let fits = |rect: PixelRect| {
        let fits = |start: i32, length: usize| {
            length < 1 << 30 && start > -(1 << 30) && i64::from(start) + (length as i64) < 1 << 30
        };
        fits(rect.x0, rect.width) && fits(rect.y0, rect.height)
    };
    if !fits(display) || !fits(file.data_window()) {
        return Err(ImageError::TooLarge(
            "the windows of an EXR file stay within 2^30 pixels of the origin".into(),
        ));
    }
    let mut own = LayerAttributes {
        layer_position: Vec2(file.origin.0, file.origin.1),
        ..Default::default()
    };
    for (name, value) in &file.attributes {
        if name.is_empty() || name.len() > 255 || name.contains('\0') || is_reserved(name) {
            return Err(ImageError::Invalid(format!(
                "\"{}\" cannot name an EXR attribute",
                name.escape_debug()
            )));
        }
        let value = match value {
            Attribute::Text(text) => {
                AttributeValue::Text(Text::from_slice_unchecked(text.as_bytes()))
            }
            Attribute::Float(value) => AttributeValue::F32(*value),
            Attribute::Int(value) => AttributeValue::I32(*value),
        };
        if own
            .other
            .insert(Text::from_slice_unchecked(name.as_bytes()), value)
            .is_some()
        {
            return Err(ImageError::Invalid(format!(
                "two attributes are named \"{name}\""
            )));
        }
    }
    let mut header = Header::new(Text::from(""), (image.width(), image.height()), channels)
        .with_encoding(
            Compression::ZIP16,
            BlockDescription::ScanLines,
            LineOrder::Increasing,
        )
        .with_attributes(own);
    header.shared_attributes.display_window =
        IntegerBounds::new((display.x0, display.y0), (display.width, display.height));
    Ok(header)
}

/// True for names the format gives a meaning of its own.
fn is_reserved(name: &str) -> bool {
    const TYPED: [&str; 7] = [
        "channels",
        "compression",
        "dataWindow",
        "displayWindow",
        "lineOrder",
        "screenWindowCenter",
        "tiles",
    ];
    STRUCTURAL.contains(&name) || TYPED.contains(&name)
}

fn write_line(image: &Image, precision: Precision, line: LineRefMut<'_>) {
    let Vec2(x, y) = line.location.position;
    // Channels are stored in alphabetical order, so B, G, R.
    let slot = image.channels() - 1 - line.location.channel;
    let sample = |i: usize| image.pixel(x + i, y)[slot];
    let written = match precision {
        Precision::Float => line.write_samples(sample),
        Precision::Half => {
            line.write_samples(|i| f16::from_f32(sample(i).clamp(-MAX_HALF, MAX_HALF)))
        }
    };
    written.expect("a line has room for its samples");
}

/// Puts the attributes of a written header in order of name. The encoder keeps them in a hash map, and two files of the
/// same picture should be the same bytes.
fn sort_attributes(bytes: &mut [u8]) {
    const MAGIC_AND_VERSION: usize = 8;
    let text_end = |start: usize| {
        start
            + bytes[start..]
                .iter()
                .position(|&b| b == 0)
                .expect("header texts end")
    };
    let mut attributes: Vec<&[u8]> = Vec::new();
    let mut at = MAGIC_AND_VERSION;
    while bytes[at] != 0 {
        let size_at = text_end(text_end(at) + 1) + 1;
        let size = bytes[size_at..]
            .first_chunk()
            .map(|&size| u32::from_le_bytes(size))
            .expect("a size follows");
        let end = size_at + 4 + size as usize;
        attributes.push(&bytes[at..end]);
        at = end;
    }
    // Names are unique and end in 0, so comparing the whole encoding compares the names.
    attributes.sort_unstable();
    let sorted = attributes.concat();
    bytes[MAGIC_AND_VERSION..at].copy_from_slice(&sorted);
}

fn exr_error(error: Error) -> ImageError {
    match error {
        Error::NotSupported(text) => ImageError::Unsupported(format!("EXR: {text}")),
        other => ImageError::Invalid(format!("EXR: {other}")),
    }
}
