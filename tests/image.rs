//! Codecs, pyramids and measures.

use std::io::Cursor;
use std::path::Path;

use glam::Vec2;
use tyndall::image::codec::{self, Attribute, ImageFile, Precision};
use tyndall::image::mip::{MipMap, Wrap};
use tyndall::image::{Image, ImageError, PixelRect, metrics, repair, srgb};
use tyndall::spectrum::Rgb;

/// Smooth, all different, some above 1.
fn gradient(width: usize, height: usize, channels: usize) -> Image {
    let data = (0..width * height * channels)
        .map(|i| i as f32 * 0.37 + 0.01)
        .collect();
    Image::new(width, height, channels, data).unwrap()
}

fn grey(width: usize, height: usize, data: &[f32]) -> Image {
    Image::new(width, height, 1, data.to_vec()).unwrap()
}

/// A small deterministic source of bytes (xorshift64*), independent of the renderer's.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() >> 16) as usize % n
    }
}

// --- EXR ---------------------------------------------------------------------------------------------------------

fn windowed(channels: usize) -> ImageFile {
    let mut image = gradient(37, 21, channels);
    image.data_mut()[..6].copy_from_slice(&[
        f32::MIN_POSITIVE,
        1e38,
        -3.5,
        0.1,
        f32::INFINITY,
        1e-45,
    ]);
    ImageFile {
        image,
        origin: (5, -3),
        display_window: PixelRect {
            x0: 0,
            y0: -10,
            width: 100,
            height: 80,
        },
        attributes: vec![
            ("camera".into(), Attribute::Text("perspective, 45°".into())),
            ("samplesPerPixel".into(), Attribute::Int(64)),
            ("seconds".into(), Attribute::Float(1.25)),
        ],
    }
}

#[test]
fn exr_floats_come_back_bit_for_bit_with_windows_and_attributes() {
    for channels in [1, 3] {
        let file = windowed(channels);
        let bytes = codec::encode(&file, "exr", Precision::Float).unwrap();
        assert_eq!(codec::decode(&bytes, "EXR").unwrap(), file);
    }
}

#[test]
fn exr_bytes_depend_on_nothing_but_the_picture() {
    let file = windowed(3);
    let first = codec::encode(&file, "exr", Precision::Float).unwrap();
    for _ in 0..10 {
        assert!(codec::encode(&file, "exr", Precision::Float).unwrap() == first);
    }
}

#[test]
fn exr_halves_are_clamped_and_eleven_bits_wide() {
    let image = Image::new(2, 1, 3, vec![1e6, -1e6, 0.1, f32::INFINITY, 65504.0, 0.0]).unwrap();
    let bytes = codec::encode(&ImageFile::new(image), "exr", Precision::Half).unwrap();
    let decoded = codec::decode(&bytes, "exr").unwrap().image;
    assert_eq!(
        decoded.data(),
        [65504.0, -65504.0, 0.099_975_586, 65504.0, 65504.0, 0.0]
    );
}

#[test]
fn exr_attribute_names_that_would_break_the_header_are_errors() {
    for name in ["", "a\0b", "channels", "type"] {
        let mut file = windowed(1);
        file.attributes.push((name.into(), Attribute::Int(0)));
        assert!(
            matches!(
                codec::encode(&file, "exr", Precision::Float),
                Err(ImageError::Invalid(_))
            ),
            "{name:?}"
        );
    }
}

/// Writes 20x13 pixels of arbitrary channels with value `10·channel + x + 100·y`.
fn exr_with(names: &[(&str, exr::prelude::SampleType)], blocks: exr::prelude::Blocks) -> Vec<u8> {
    use exr::prelude::{
        AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Layer, LayerAttributes,
        LineOrder, SampleType, SmallVec, WritableImage, f16,
    };
    let list: SmallVec<_> = names
        .iter()
        .enumerate()
        .map(|(channel, &(name, sample_type))| {
            let values = (0..20 * 13).map(|i| (10 * channel + i % 20 + 100 * (i / 20)) as f32);
            let samples = match sample_type {
                SampleType::F16 => FlatSamples::F16(values.map(f16::from_f32).collect()),
                SampleType::F32 => FlatSamples::F32(values.collect()),
                SampleType::U32 => FlatSamples::U32(values.map(|v| v as u32).collect()),
            };
            AnyChannel::new(name, samples)
        })
        .collect();
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new(
        (20, 13),
        LayerAttributes::named("part"),
        encoding,
        AnyChannels::sort(list),
    );
    let mut bytes = Cursor::new(Vec::new());
    exr::prelude::Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .unwrap();
    bytes.into_inner()
}

#[test]
fn exr_reads_any_channel_type_tiled_or_not() {
    use exr::prelude::{Blocks, SampleType, Vec2};
    let channels = [
        ("R", SampleType::F16),
        ("A", SampleType::F32),
        ("G", SampleType::U32),
        ("B", SampleType::F32),
    ];
    for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(8, 8))] {
        let image = codec::decode(&exr_with(&channels, blocks), "exr")
            .unwrap()
            .image;
        assert_eq!(
            (image.width(), image.height(), image.channels()),
            (20, 13, 3)
        );
        for (x, y) in [(0, 0), (19, 0), (7, 12), (19, 12)] {
            let base = (x + 100 * y) as f32;
            assert_eq!(image.pixel(x, y), [base, base + 20.0, base + 30.0]);
        }
    }
}

#[test]
fn exr_finds_the_picture_among_the_channels() {
    use exr::prelude::{Blocks, SampleType::F32};
    let decode = |names: &[&str]| {
        let channels: Vec<_> = names.iter().map(|&name| (name, F32)).collect();
        codec::decode(&exr_with(&channels, Blocks::ScanLines), "exr")
            .map(|file| file.image.pixel(0, 0).to_vec())
    };
    assert_eq!(decode(&["Z", "R", "G", "B"]), Ok(vec![10.0, 20.0, 30.0]));
    assert_eq!(decode(&["Y", "A"]), Ok(vec![0.0]));
    assert_eq!(
        decode(&["Z", "diffuse.B", "diffuse.G", "diffuse.R"]),
        Ok(vec![30.0, 20.0, 10.0])
    );
    assert_eq!(decode(&["G", "A"]), Ok(vec![0.0, 0.0, 0.0]));
    assert_eq!(decode(&["depth", "A"]), Ok(vec![0.0]));
    assert!(matches!(
        decode(&["depth", "id"]),
        Err(ImageError::Unsupported(_))
    ));
}

// --- PFM ---------------------------------------------------------------------------------------------------------

#[test]
fn pfm_comes_back_bit_for_bit() {
    for channels in [1, 3] {
        let file = ImageFile::new(gradient(5, 4, channels));
        let bytes = codec::encode(&file, "pfm", Precision::Float).unwrap();
        assert_eq!(codec::decode(&bytes, "pfm").unwrap(), file);
    }
}

#[test]
fn pfm_reads_both_byte_orders_multiplies_the_scale_and_starts_at_the_bottom() {
    for (scale, to_bytes) in [
        ("-2.5", f32::to_le_bytes as fn(f32) -> [u8; 4]),
        ("2.5", f32::to_be_bytes),
    ] {
        let mut bytes = format!("Pf 2 2\n{scale}\n").into_bytes();
        bytes.extend([1.0, 2.0, 3.0, 4.0].into_iter().flat_map(to_bytes));
        let image = codec::decode(&bytes, "pfm").unwrap().image;
        assert_eq!(image.data(), [7.5, 10.0, 2.5, 5.0]);
    }
}

#[test]
fn pfm_headers_that_lie_are_errors() {
    let headers = [
        "",
        "P6 1 1 1\n",
        "PF 0 1 -1\n",
        "PF -1 1 -1\n",
        "PF 1 1 0\n",
        "PF 1 1 nan\n",
        "PF 2 1 -1\n",
        "PF 1",
    ];
    let huge = "PF 4000000000 4000000000 -1\n";
    for header in headers
        .into_iter()
        .chain([huge, "PF 18446744073709551615 18446744073709551615 -1\n"])
    {
        let bytes = [header.as_bytes(), &[0; 12]].concat();
        assert!(
            matches!(codec::decode(&bytes, "pfm"), Err(ImageError::Invalid(_))),
            "{header:?}"
        );
    }
}

// --- 8-bit files -------------------------------------------------------------------------------------------------

#[test]
fn eight_bit_codes_follow_the_srgb_curve() {
    let linear = [
        -1.0,
        0.0,
        0.001,
        0.0031308,
        0.2140,
        0.5,
        1.0,
        7.0,
        f32::NAN,
        f32::INFINITY,
    ];
    let codes = [0, 0, 3, 10, 127, 188, 255, 255, 0, 255];
    for (linear, code) in linear.into_iter().zip(codes) {
        assert_eq!(srgb::to_byte(linear), code, "{linear}");
    }
    for code in 0..=255 {
        assert_eq!(
            srgb::to_byte(srgb::to_linear(f32::from(code) / 255.0)),
            code
        );
    }
    assert!(
        (srgb::to_linear(0.5) - 0.214_041).abs() < 1e-6,
        "a missing png is 0.214"
    );
}

#[test]
fn png_and_tga_come_back_as_their_codes() {
    for extension in ["png", "tga"] {
        for channels in [1, 3] {
            let data: Vec<f32> = (0..16 * 16 * channels)
                .map(|i| srgb::to_linear((i % 256) as f32 / 255.0))
                .collect();
            let image = Image::new(16, 16, channels, data).unwrap();
            let bytes =
                codec::encode(&ImageFile::new(image.clone()), extension, Precision::Float).unwrap();
            let mut decoded = codec::decode(&bytes, extension).unwrap().image;
            assert_eq!(decoded.channels(), channels, "{extension} keeps grey grey");
            srgb::linearize(&mut decoded);
            assert_eq!(decoded, image, "{extension}");
        }
    }
}

#[test]
fn sixteen_bit_png_loses_its_low_byte_and_alpha_is_dropped() {
    use image::{ExtendedColorType, ImageFormat};
    let pixel: Vec<u8> = [0x12ffu16, 0x3400, 0x5680, 0x0000]
        .into_iter()
        .flat_map(u16::to_ne_bytes)
        .collect();
    let mut png = Cursor::new(Vec::new());
    image::write_buffer_with_format(
        &mut png,
        &pixel,
        1,
        1,
        ExtendedColorType::Rgba16,
        ImageFormat::Png,
    )
    .unwrap();
    let decoded = codec::decode(png.get_ref(), "png").unwrap().image;
    assert_eq!(
        decoded.data(),
        [0x12, 0x34, 0x56].map(|code| f32::from(code as u8) / 255.0)
    );
}

/// A TGA header of 2x2 pixels: image type, colour map entries, bits per pixel, descriptor.
fn tga(image_type: u8, n_map: u8, bits: u8, descriptor: u8, payload: &[u8]) -> Vec<u8> {
    let map_bits = if n_map > 0 { 24 } else { 0 };
    let header = [
        0,
        u8::from(n_map > 0),
        image_type,
        0,
        0,
        n_map,
        0,
        map_bits,
        0,
        0,
        0,
        0,
        2,
        0,
        2,
        0,
        bits,
        descriptor,
    ];
    [&header, payload].concat()
}

#[test]
fn tga_honours_orientation_colour_maps_and_run_lengths() {
    let codes = |bytes: &[u8]| -> Vec<u8> {
        let image = codec::decode(bytes, "tga").unwrap().image;
        image
            .data()
            .iter()
            .map(|sample| (sample * 255.0).round() as u8)
            .collect()
    };
    assert_eq!(
        codes(&tga(3, 0, 8, 0x00, &[1, 2, 3, 4])),
        [3, 4, 1, 2],
        "bottom left first"
    );
    assert_eq!(
        codes(&tga(3, 0, 8, 0x20, &[1, 2, 3, 4])),
        [1, 2, 3, 4],
        "top left first"
    );
    assert_eq!(
        codes(&tga(3, 0, 8, 0x30, &[1, 2, 3, 4])),
        [2, 1, 4, 3],
        "top right first"
    );
    assert_eq!(
        codes(&tga(11, 0, 8, 0x20, &[0x83, 9])),
        [9; 4],
        "run of four"
    );
    let mapped = tga(1, 2, 8, 0x20, &[10, 20, 30, 40, 50, 60, 1, 0, 0, 1]);
    assert_eq!(
        codes(&mapped),
        [60, 50, 40, 30, 20, 10, 30, 20, 10, 60, 50, 40],
        "map entries are B, G, R"
    );
}

#[test]
fn jpeg_and_hdr_are_read() {
    let mut jpeg = Cursor::new(Vec::new());
    let colour = image::ExtendedColorType::L8;
    image::write_buffer_with_format(
        &mut jpeg,
        &[128; 64],
        8,
        8,
        colour,
        image::ImageFormat::Jpeg,
    )
    .unwrap();
    let decoded = codec::decode(jpeg.get_ref(), "jpg").unwrap().image;
    assert_eq!((decoded.channels(), decoded.data()[0]), (1, 128.0 / 255.0));

    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x40\x20\x82\x00\x00\x00\x00";
    let decoded = codec::decode(hdr, "hdr").unwrap().image;
    let expected = [2.0, 1.0, 0.5, 0.0, 0.0, 0.0];
    let close = decoded
        .data()
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() <= 0.01 * b);
    assert!(close, "{:?}", decoded.data());
}

// --- Front door --------------------------------------------------------------------------------------------------

#[test]
fn formats_that_are_unknown_or_read_only_say_so() {
    let file = ImageFile::new(Image::constant(1.0));
    for extension in ["", "gif", "exr2"] {
        assert!(matches!(
            codec::decode(&[], extension),
            Err(ImageError::Unsupported(_))
        ));
        assert!(matches!(
            codec::encode(&file, extension, Precision::Float),
            Err(ImageError::Unsupported(_))
        ));
    }
    assert!(matches!(
        codec::encode(&file, "jpg", Precision::Float),
        Err(ImageError::Unsupported(_))
    ));
    assert!(
        codec::is_gamma_encoded("PNG")
            && codec::is_gamma_encoded("tga")
            && !codec::is_gamma_encoded("exr")
    );
}

fn samples_of_all_formats() -> Vec<(&'static str, Vec<u8>)> {
    use exr::prelude::{Blocks, SampleType::F32, Vec2};
    let file = ImageFile::new(gradient(9, 7, 3));
    let mut samples: Vec<_> = ["exr", "pfm", "png", "tga"]
        .map(|extension| {
            (
                extension,
                codec::encode(&file, extension, Precision::Float).unwrap(),
            )
        })
        .into();
    samples.push((
        "exr",
        exr_with(
            &[("R", F32), ("G", F32), ("B", F32)],
            Blocks::Tiles(Vec2(8, 8)),
        ),
    ));
    samples.push((
        "tga",
        tga(1, 2, 8, 0x20, &[10, 20, 30, 40, 50, 60, 1, 0, 0, 1]),
    ));
    let mut jpeg = Cursor::new(Vec::new());
    let colour = image::ExtendedColorType::Rgb8;
    image::write_buffer_with_format(
        &mut jpeg,
        &[77; 192],
        8,
        8,
        colour,
        image::ImageFormat::Jpeg,
    )
    .unwrap();
    samples.push(("jpg", jpeg.into_inner()));
    samples
}

#[test]
fn truncated_files_are_errors() {
    for (extension, bytes) in samples_of_all_formats() {
        // The last bytes of PNG and TGA files are checksums and footers that a picture does not need.
        let essential = if matches!(extension, "exr" | "pfm") {
            bytes.len()
        } else {
            bytes.len() / 2
        };
        for length in 0..essential {
            assert!(
                codec::decode(&bytes[..length], extension).is_err(),
                "{extension} cut to {length} bytes"
            );
        }
    }
}

#[test]
fn damaged_files_never_panic() {
    let mut noise = Noise(0x9e37_79b9_7f4a_7c15);
    for (extension, bytes) in samples_of_all_formats() {
        let mut n_errors = 0;
        for _ in 0..3000 {
            let mut damaged = bytes.clone();
            for _ in 0..=noise.below(4) {
                let at = noise.below(damaged.len());
                damaged[at] = if noise.below(2) == 0 {
                    noise.next() as u8
                } else {
                    0xff
                };
            }
            match codec::decode(&damaged, extension) {
                Ok(file) => assert!(file.image.data().len() < 1 << 28),
                Err(_) => n_errors += 1,
            }
        }
        assert!(
            n_errors > 0 || extension == "pfm" || extension == "tga",
            "{extension} notices damage"
        );
    }
}

#[test]
fn a_small_file_cannot_ask_for_much_memory() {
    let mut png = codec::encode(
        &ImageFile::new(Image::constant(0.5)),
        "png",
        Precision::Float,
    )
    .unwrap();
    png[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
    let crc = crc32(&png[12..29]);
    png[29..33].copy_from_slice(&crc.to_be_bytes());
    assert!(
        matches!(codec::decode(&png, "png"), Err(ImageError::TooLarge(_))),
        "{:?}",
        codec::decode(&png, "png")
    );

    let mut tall = tga(3, 0, 32, 0, &[]);
    tall[12..16].copy_from_slice(&[0xff; 4]);
    assert!(codec::decode(&tall, "tga").is_err());

    let mut exr = codec::encode(
        &ImageFile::new(Image::constant(0.5)),
        "exr",
        Precision::Float,
    )
    .unwrap();
    let window = find(&exr, b"dataWindow\0box2i\0") + 17 + 4;
    exr[window + 8..window + 16].copy_from_slice(&[0xff, 0xff, 0xff, 0x0f, 0xff, 0xff, 0xff, 0x0f]);
    assert!(matches!(
        codec::decode(&exr, "exr"),
        Err(ImageError::TooLarge(_) | ImageError::Invalid(_))
    ));
}

fn find(bytes: &[u8], pattern: &[u8]) -> usize {
    bytes
        .windows(pattern.len())
        .position(|window| window == pattern)
        .unwrap()
}

/// The checksum of PNG chunks, so that a forged header is not refused for the wrong reason.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32| {
        if crc & 1 == 1 {
            0xedb8_8320 ^ (crc >> 1)
        } else {
            crc >> 1
        }
    };
    !bytes.iter().fold(!0, |crc, &byte| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| step(crc))
    })
}

#[test]
fn published_pictures_decode() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let mut folders = vec![shared.join("references"), shared.join("scenes")];
    let mut n_decoded = 0;
    while let Some(folder) = folders.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else {
            continue;
        };
        for path in entries.map(|entry| entry.unwrap().path()) {
            let extension = path
                .extension()
                .and_then(|e| e.to_str())
                .unwrap_or_default()
                .to_owned();
            if path.is_dir() {
                folders.push(path);
            } else if matches!(extension.as_str(), "exr" | "png" | "tga" | "pfm") {
                let decoded = codec::decode(&std::fs::read(&path).unwrap(), &extension);
                let file = decoded.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
                assert!(
                    metrics::mean(&file.image).iter().all(|m| m.is_finite()),
                    "{}",
                    path.display()
                );
                n_decoded += 1;
            }
        }
    }
    if n_decoded == 0 {
        eprintln!("skipped: no pictures under {}", shared.display());
    }
}

// --- Buffers -----------------------------------------------------------------------------------------------------

#[test]
fn images_of_impossible_shape_are_errors() {
    for (width, height, channels, n_samples) in
        [(0, 1, 1, 0), (1, 0, 3, 0), (1, 1, 2, 2), (2, 2, 1, 3)]
    {
        assert!(Image::new(width, height, channels, vec![0.0; n_samples]).is_err());
    }
    assert!(Image::new(usize::MAX, usize::MAX, 3, vec![0.0; 3]).is_err());
}

#[test]
fn flipping_twice_changes_nothing_and_once_swaps_the_rows() {
    for height in [1, 2, 5] {
        let image = gradient(3, height, 3);
        let mut flipped = image.clone();
        flipped.flip_vertical();
        for y in 0..height {
            assert_eq!(flipped.pixel(1, y), image.pixel(1, height - 1 - y));
        }
        flipped.flip_vertical();
        assert_eq!(flipped, image);
    }
}

#[test]
fn a_crop_is_addressed_in_the_frame() {
    let file = windowed(1);
    let window = PixelRect {
        x0: 7,
        y0: -2,
        width: 3,
        height: 2,
    };
    let crop = file.crop(window).unwrap();
    assert_eq!((crop.width(), crop.height()), (3, 2));
    assert_eq!(crop.pixel(0, 0), file.image.pixel(2, 1));
    assert_eq!(crop.pixel(2, 1), file.image.pixel(4, 2));
    assert_eq!(file.crop(file.data_window()).unwrap(), file.image);
    for (x0, y0, width) in [
        (4, -3, 1),
        (5, -4, 1),
        (5, -3, 38),
        (41, 0, 2),
        (i32::MIN, i32::MIN, 1),
        (5, -3, 0),
    ] {
        assert_eq!(
            file.crop(PixelRect {
                x0,
                y0,
                width,
                height: 1
            }),
            None,
            "{x0} {y0} {width}"
        );
    }
}

#[test]
fn grey_is_luminance() {
    let image = Image::new(1, 1, 3, vec![0.2, 0.5, 0.9]).unwrap();
    assert_eq!(
        image.into_grey().data(),
        [Rgb::new(0.2, 0.5, 0.9).luminance()]
    );
}

#[test]
fn impossible_texels_are_repaired_and_counted() {
    let mut image = grey(
        7,
        1,
        &[
            1.0,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            -5.0,
            3.0,
            -0.0,
        ],
    );
    let repairs = repair::repair(&mut image);
    assert_eq!(
        (
            repairs.nan,
            repairs.infinite,
            repairs.negative,
            repairs.total()
        ),
        (1, 1, 2, 4)
    );
    assert_eq!(image.data(), [1.0, 0.0, 3.0, 0.0, 0.0, 3.0, 0.0]);
    assert_eq!(repair::repair(&mut image).total(), 0);
    let mut hopeless = Image::constant(f32::INFINITY);
    repair::repair(&mut hopeless);
    assert_eq!(hopeless.data(), [0.0]);
}

// --- Pyramids ----------------------------------------------------------------------------------------------------

#[test]
fn powers_of_two_are_not_resampled() {
    let image = gradient(8, 4, 3);
    let mip = MipMap::new(image.clone(), Wrap::Repeat);
    assert_eq!(mip.level(0), &image);
    let sizes: Vec<_> = (0..mip.n_levels())
        .map(|l| (mip.level(l).width(), mip.level(l).height()))
        .collect();
    assert_eq!(sizes, [(8, 4), (4, 2), (2, 1), (1, 1)]);
}

#[test]
fn coarser_levels_are_box_averages() {
    let mip = MipMap::new(
        grey(4, 2, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]),
        Wrap::Clamp,
    );
    assert_eq!(mip.level(1).data(), [3.5, 5.5]);
    assert_eq!(mip.level(2).data(), [4.5]);
}

#[test]
fn black_borders_darken_levels_below_one_texel() {
    let narrow = grey(4, 1, &[1.0; 4]);
    assert_eq!(
        MipMap::new(narrow.clone(), Wrap::Repeat).level(1).data(),
        [1.0, 1.0]
    );
    assert_eq!(MipMap::new(narrow, Wrap::Black).level(1).data(), [0.5, 0.5]);
}

/// The resampling rule in f64, one axis, straight from its definition.
fn lanczos_row(row: &[f64], new: usize, wrap: Wrap) -> Vec<f64> {
    use std::f64::consts::PI;
    let lanczos = |x: f64| match x.abs() * PI {
        x if x < 1e-9 => 1.0,
        x if x > PI => 0.0,
        x => (2.0 * x).sin() / (2.0 * x) * x.sin() / x,
    };
    let n = row.len() as i64;
    let texel = |i: i64| match wrap {
        Wrap::Repeat => row[i.rem_euclid(n) as usize],
        Wrap::Clamp => row[i.clamp(0, n - 1) as usize],
        Wrap::Black => *row
            .get(usize::try_from(i).unwrap_or(usize::MAX))
            .unwrap_or(&0.0),
    };
    let sample = |i: usize| {
        let center = (i as f64 + 0.5) * row.len() as f64 / new as f64;
        let first = (center - 1.5).floor() as i64;
        let weights: Vec<f64> = (0..4)
            .map(|tap| lanczos(((first + tap) as f64 + 0.5 - center) / 2.0))
            .collect();
        let sum: f64 = weights.iter().sum();
        weights
            .iter()
            .zip(first..)
            .map(|(weight, i)| weight / sum * texel(i))
            .sum::<f64>()
    };
    (0..new).map(sample).collect()
}

#[test]
fn other_sizes_are_resampled_by_the_four_tap_lanczos_of_the_format() {
    let row = [0.3, 2.0, 0.7, 1.1, 0.9, 5.0];
    for wrap in [Wrap::Repeat, Wrap::Black, Wrap::Clamp] {
        let expected: Vec<f64> = lanczos_row(&row, 8, wrap)
            .into_iter()
            .map(|v| v.max(0.0))
            .collect();
        let samples = row.map(|v| v as f32);
        let across = MipMap::new(grey(6, 1, &samples), wrap);
        let down = MipMap::new(grey(1, 6, &samples), wrap);
        for (i, expected) in expected.iter().enumerate() {
            for actual in [across.level(0).data()[i], down.level(0).data()[i]] {
                assert!(
                    (f64::from(actual) - expected).abs() < 2e-6,
                    "{wrap:?} {i}: {actual} is not {expected}"
                );
            }
        }
    }
}

#[test]
fn resampling_keeps_constants_and_never_goes_below_zero() {
    let flat = Image::new(5, 7, 3, vec![0.75; 105]).unwrap();
    for wrap in [Wrap::Repeat, Wrap::Clamp] {
        let mip = MipMap::new(flat.clone(), wrap);
        assert_eq!((mip.level(0).width(), mip.level(0).height()), (8, 8));
        let worst = (0..mip.n_levels())
            .flat_map(|l| mip.level(l).data())
            .map(|v| (v - 0.75).abs())
            .fold(0.0, f32::max);
        assert!(worst < 1e-6, "{wrap:?}: {worst}");
    }
    assert!(
        MipMap::new(flat, Wrap::Black).level(0).pixel(0, 0)[0] < 0.75,
        "black comes in at the border"
    );
    let step = MipMap::new(grey(6, 1, &[0.0, 0.0, 0.0, 9.0, 9.0, 9.0]), Wrap::Clamp);
    assert!(
        step.level(0).data().iter().all(|&v| v >= 0.0)
            && step.level(0).data().iter().any(|&v| v > 9.0)
    );
}

#[test]
fn thread_counts_do_not_change_a_bit() {
    let image = gradient(300, 200, 3);
    let build = |n_threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .unwrap();
        let mip = pool.install(|| MipMap::new(image.clone(), Wrap::Repeat));
        (0..mip.n_levels())
            .map(|l| mip.level(l).clone())
            .collect::<Vec<_>>()
    };
    assert!(build(1) == build(4));
}

fn checker() -> Image {
    grey(4, 2, &[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
}

#[test]
fn bilinear_meets_texels_at_their_centres_and_blends_between() {
    let mip = MipMap::new(checker(), Wrap::Repeat);
    let at = |s: f32, t: f32| mip.bilinear::<f32>(0, Vec2::new(s, t));
    assert_eq!((at(0.125, 0.25), at(0.875, 0.75)), (0.0, 7.0));
    assert_eq!((at(0.25, 0.25), at(0.125, 0.5)), (0.5, 2.0));
    assert_eq!(
        at(0.0, 0.25),
        1.5,
        "the left neighbour of the first texel is the last"
    );
    assert_eq!(at(1.125, -0.75), 0.0);
    let clamped = MipMap::new(checker(), Wrap::Clamp);
    assert_eq!(clamped.bilinear::<f32>(0, Vec2::new(-3.0, 0.25)), 0.0);
    let black = MipMap::new(checker(), Wrap::Black);
    assert_eq!(black.bilinear::<f32>(0, Vec2::new(1.0, 0.25)), 1.5);
    assert_eq!(
        mip.bilinear::<f32>(99, Vec2::new(0.5, 0.5)),
        3.5,
        "levels beyond the last are the last"
    );
}

#[test]
fn trilinear_picks_levels_by_width() {
    let mip = MipMap::new(checker(), Wrap::Repeat);
    let st = Vec2::new(0.125, 0.25);
    let at = |width: f32| mip.trilinear::<f32>(st, width);
    assert_eq!((at(0.0), at(0.25)), (0.0, 0.0), "one texel wide is level 0");
    let level1 = mip.bilinear::<f32>(1, st);
    assert_eq!(at(0.5), level1);
    let halfway = at(0.25 * 2f32.sqrt());
    assert!((halfway - 0.5 * level1).abs() < 1e-6, "{halfway}");
    assert_eq!((at(1.0), at(50.0)), (3.5, 3.5));
    let footprint = mip.trilinear_footprint::<f32>(st, Vec2::new(0.01, -0.5), Vec2::new(0.2, 0.0));
    assert_eq!(footprint, level1);
}

#[test]
fn colour_and_number_read_the_same_texels() {
    let image = Image::new(2, 1, 3, vec![1.0, 2.0, 3.0, 5.0, 6.0, 7.0]).unwrap();
    let mip = MipMap::new(image, Wrap::Clamp);
    let st = Vec2::new(0.5, 0.5);
    let colour = mip.bilinear::<Rgb>(0, st);
    assert_eq!(colour, Rgb::new(3.0, 4.0, 5.0));
    assert!((mip.bilinear::<f32>(0, st) - colour.luminance()).abs() < 1e-6);
    let grey = MipMap::new(Image::constant(0.25), Wrap::Clamp);
    assert_eq!(grey.bilinear::<Rgb>(0, st), Rgb::splat(0.25));
}

/// The EWA rule in f64, from its definition: exact Gaussian, all texels of a repeating level.
fn ellipse_mean(image: &Image, st: [f64; 2], d0: [f64; 2], d1: [f64; 2]) -> f64 {
    let (w, h) = (image.width() as f64, image.height() as f64);
    let (x0, y0) = (st[0] * w - 0.5, st[1] * h - 0.5);
    let (d0, d1) = ([d0[0] * w, d0[1] * h], [d1[0] * w, d1[1] * h]);
    let a = d0[1] * d0[1] + d1[1] * d1[1] + 1.0;
    let b = -2.0 * (d0[0] * d0[1] + d1[0] * d1[1]);
    let c = d0[0] * d0[0] + d1[0] * d1[0] + 1.0;
    let f = a * c - 0.25 * b * b;
    let (mut sum, mut weights) = (0.0, 0.0);
    for y in -200i64..200 {
        for x in -200i64..200 {
            let (dx, dy) = (x as f64 - x0, y as f64 - y0);
            let r2 = (a * dx * dx + b * dx * dy + c * dy * dy) / f;
            if r2 < 1.0 {
                let weight = (-2.0 * r2).exp() - (-2f64).exp();
                let wrapped = (
                    x.rem_euclid(image.width() as i64),
                    y.rem_euclid(image.height() as i64),
                );
                sum += weight * f64::from(image.pixel(wrapped.0 as usize, wrapped.1 as usize)[0]);
                weights += weight;
            }
        }
    }
    sum / weights
}

#[test]
fn ewa_is_the_gaussian_mean_over_the_ellipse() {
    let mut noise = Noise(7);
    let data: Vec<f32> = (0..32 * 32)
        .map(|_| noise.below(1000) as f32 / 1000.0)
        .collect();
    let image = grey(32, 32, &data);
    let mip = MipMap::new(image.clone(), Wrap::Repeat);
    let texel = 1.0 / 32.0;
    // Minor axes of exactly one texel stay on level 0.
    let ellipses = [
        ([texel, 0.0], [0.0, texel]),
        ([4.0 * texel, 0.0], [0.0, texel]),
        ([0.0, -texel], [3.0 * texel, 0.0]),
    ];
    for (d0, d1) in ellipses {
        for st in [[0.3, 0.4], [0.01, 0.98], [0.5, 0.5]] {
            let v = |p: [f64; 2]| Vec2::new(p[0] as f32, p[1] as f32);
            let actual = f64::from(mip.ewa::<f32>(v(st), v(d0), v(d1), 8.0));
            let expected = ellipse_mean(&image, st, d0, d1);
            assert!(
                (actual - expected).abs() < 0.01,
                "{st:?} {d0:?} {d1:?}: {actual} is not {expected}"
            );
        }
    }
}

#[test]
fn ewa_limits_the_ratio_and_falls_back_to_bilinear() {
    let mip = MipMap::new(gradient(16, 16, 1), Wrap::Repeat);
    let st = Vec2::new(0.31, 0.72);
    let long = Vec2::new(0.5, 0.0);
    assert_eq!(
        mip.ewa::<f32>(st, long, Vec2::ZERO, 8.0),
        mip.bilinear(0, st)
    );
    let thin = mip.ewa::<f32>(st, long, Vec2::new(0.0, 1e-4), 4.0);
    let lengthened = mip.ewa::<f32>(st, long, Vec2::new(0.0, 0.125), 4.0);
    assert!(
        (thin - lengthened).abs() < 1e-3 * lengthened,
        "{thin} {lengthened}"
    );
    let swapped = mip.ewa::<f32>(st, Vec2::new(0.0, 0.125), long, 4.0);
    assert_eq!(swapped, lengthened);
    let everything = mip.ewa::<f32>(st, Vec2::new(4.0, 0.0), Vec2::new(0.0, 4.0), 8.0);
    assert_eq!(everything, mip.texel(mip.n_levels() - 1, 0, 0));
}

#[test]
fn look_ups_answer_to_any_input() {
    let extremes = [
        0.0,
        -1.0,
        1e-45,
        1e-20,
        1e-4,
        0.5,
        3.0,
        1e10,
        1e30,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
    ];
    let vectors = || {
        extremes
            .into_iter()
            .flat_map(|x| [Vec2::new(x, 0.25), Vec2::new(1e-3, -x)])
    };
    for wrap in [Wrap::Repeat, Wrap::Black, Wrap::Clamp] {
        for (width, height) in [(1, 1), (8, 1), (5, 16)] {
            let mip = MipMap::new(gradient(width, height, 3), wrap);
            for d0 in vectors() {
                for d1 in vectors() {
                    for ratio in [0.0, 8.0, 1e30, f32::NAN] {
                        let value = mip.ewa::<Rgb>(Vec2::new(0.4, 0.9), d0, d1, ratio);
                        assert!(value.is_finite(), "{d0} {d1} {ratio}: {value:?}");
                    }
                    let far = mip.trilinear_footprint::<Rgb>(d0, d1, d0);
                    let st_is_usable = d0.x.abs() < 1e4 && d0.y.abs() < 1e4;
                    assert!(far.is_finite() || !st_is_usable, "{d0} {d1}: {far:?}");
                }
            }
        }
    }
}

// --- Measures ----------------------------------------------------------------------------------------------------

#[test]
fn measures_have_their_defined_values() {
    let reference = grey(2, 2, &[1.0, 2.0, 3.0, 2.0]);
    let test = grey(2, 2, &[1.0, 2.5, 3.0, 1.0]);
    assert_eq!(metrics::mean(&test), [1.875]);
    assert_eq!(metrics::mse(&test, &reference), Ok((0.25 + 1.0) / 4.0));
    let rel_mse = metrics::rel_mse(&test, &reference).unwrap();
    assert!((rel_mse - 1.25 / 4.04 / 4.0).abs() < 1e-12, "{rel_mse}");
    let doubled = |image: &Image| {
        Image::new(2, 2, 1, image.data().iter().map(|v| v * 2.0).collect()).unwrap()
    };
    assert_eq!(
        metrics::rel_mse(&doubled(&test), &doubled(&reference)),
        Ok(rel_mse),
        "scale does not matter"
    );
    let black = grey(2, 2, &[0.0; 4]);
    assert_eq!(metrics::rel_mse(&black, &black), Ok(0.0));
    assert_eq!(metrics::rel_mse(&test, &black), Ok(f64::INFINITY));
}

#[test]
fn blocks_cover_the_image_once() {
    let image = gradient(5, 4, 3);
    let blocks = metrics::block_means(&image, &image, 2).unwrap();
    let corners: Vec<_> = blocks.iter().map(|block| (block.x, block.y)).collect();
    assert_eq!(corners, [(0, 0), (2, 0), (4, 0), (0, 2), (2, 2), (4, 2)]);
    let area = |x: usize| if x == 4 { 2.0 } else { 4.0 };
    for channel in 0..3 {
        let sum: f64 = blocks
            .iter()
            .map(|block| block.test[channel] * area(block.x))
            .sum();
        assert!((sum / 20.0 - metrics::mean(&image)[channel]).abs() < 1e-9);
    }
}

#[test]
fn images_of_different_shape_are_not_compared() {
    let error = metrics::mse(&gradient(2, 3, 1), &gradient(2, 3, 3)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the image has 2x3 pixels of 1 channels, the reference 2x3 pixels of 3 channels"
    );
    assert!(metrics::block_means(&gradient(2, 3, 1), &gradient(3, 2, 1), 1).is_err());
}
