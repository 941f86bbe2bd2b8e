//! Image files: what is written comes back, what others write is read, what is damaged is refused.

use std::io::Cursor;
use std::path::Path;

use tyndall::image::codec::{self, Attribute, DecodeOptions, ImageFile, Precision};
use tyndall::image::metrics::Comparison;
use tyndall::image::{Image, ImageError, PixelRect, srgb};
use tyndall_test_support::Uniform;

/// Smooth, all different, some above 1.
fn gradient(width: usize, height: usize, channels: usize) -> Image {
    let data = (0..width * height * channels)
        .map(|i| i as f32 * 0.37 + 0.01)
        .collect();
    Image::new(width, height, channels, data).unwrap()
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
    exr_compressed(names, blocks, exr::prelude::Compression::ZIP16)
}

fn exr_compressed(
    names: &[(&str, exr::prelude::SampleType)],
    blocks: exr::prelude::Blocks,
    compression: exr::prelude::Compression,
) -> Vec<u8> {
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Layer, LayerAttributes, LineOrder,
        SampleType, SmallVec, WritableImage, f16,
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
        compression,
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

/// Parts of 2x1 pixels, each with channels of value `10·part + channel`, and the decoded picture.
fn exr_of_parts(parts: &[(&str, &[&str])]) -> Result<codec::Decoded, ImageError> {
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
        Layer, LayerAttributes, SmallVec, WritableImage,
    };
    let part = |(part, (name, channels)): (usize, &(&str, &[&str]))| {
        let channel = |(channel, name): (usize, &&str)| {
            let value = (10 * part + channel) as f32;
            AnyChannel::new(*name, FlatSamples::F32(vec![value; 2]))
        };
        let list: SmallVec<_> = channels.iter().enumerate().map(channel).collect();
        let attributes = LayerAttributes::named(*name);
        Layer::new(
            (2, 1),
            attributes,
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(list),
        )
    };
    let layers: SmallVec<_> = parts.iter().enumerate().map(part).collect();
    let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((2, 1)));
    let mut bytes = Cursor::new(Vec::new());
    let image = Image::from_layers(attributes, layers);
    image
        .write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .unwrap();
    codec::decode_with(bytes.get_ref(), "exr", &DecodeOptions::default())
}

#[test]
fn exr_takes_the_colours_among_parts_and_layers() {
    let rgb = &["R", "G", "B"][..];
    let depth = ("depth", &["Z"][..]);
    let taken = |parts: &[(&str, &[&str])]| {
        let decoded = exr_of_parts(parts).unwrap_or_else(|error| panic!("{parts:?}: {error}"));
        (decoded.file.image.pixel(0, 0).to_vec(), decoded.note)
    };
    let note = |parts: &[(&str, &[&str])]| taken(parts).1.unwrap_or_default();
    assert_eq!(taken(&[("beauty", rgb)]), (vec![0.0, 1.0, 2.0], None));
    for before in [
        &["Z"][..],
        &["Y"],
        &["id"],
        &["N.X", "N.Y", "N.Z"],
        &["Z", "A"],
    ] {
        let parts = [("other", before), ("beauty", rgb)];
        assert_eq!(taken(&parts).0, [10.0, 11.0, 12.0], "{before:?}");
    }
    let said = note(&[depth, ("beauty", rgb)]);
    assert_eq!(
        said,
        "R G B of part \"beauty\" is read, not Z of part \"depth\""
    );
    // Layers, in one part or in several.
    let layer = &["light.R", "light.G", "light.B", "Z"][..];
    assert_eq!(taken(&[("all", layer)]).0, [0.0, 1.0, 2.0]);
    assert_eq!(note(&[("all", layer)]), "light.R light.G light.B is read");
    assert_eq!(taken(&[depth, ("all", layer)]).0, [10.0, 11.0, 12.0]);
    let both = &["R", "G", "B", "light.R", "light.G", "light.B"][..];
    assert_eq!(taken(&[("all", both)]).0, [0.0, 1.0, 2.0]);
    // Depth is a picture only where nothing else is.
    assert_eq!(taken(&[depth]), (vec![0.0], None));
    assert_eq!(taken(&[depth, ("grey", &["Y"])]).0, [10.0]);
}

#[test]
fn exr_pictures_that_serve_equally_well_are_refused() {
    let rgb = &["R", "G", "B"][..];
    for (parts, listed) in [
        (
            &[("left", rgb), ("right", rgb)][..],
            "R G B of part \"left\", R G B of part \"right\"",
        ),
        (
            &[("all", &["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"][..])],
            "a.R a.G a.B, b.R b.G b.B",
        ),
        (
            &[("z", &["Z"]), ("id", &["id"])],
            "Z of part \"z\", id of part \"id\"",
        ),
    ] {
        let Err(ImageError::Unsupported(why)) = exr_of_parts(parts) else {
            panic!("{parts:?} is ambiguous");
        };
        assert!(why.contains(listed), "{why}");
    }
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

#[test]
fn pfm_headers_end_their_lines_in_any_way_and_fit() {
    // The first byte of the samples is a line feed.
    let sample = f32::from_le_bytes([b'\n', 0, 0x20, 0x41]);
    for end in ["\n", "\r\n", "\r"] {
        let mut bytes = ["Pf", "2 1", "-1", ""].join(end).into_bytes();
        bytes.extend([sample, 2.0].into_iter().flat_map(f32::to_le_bytes));
        let image = codec::decode(&bytes, "pfm").unwrap().image;
        assert_eq!(image.data(), [sample, 2.0], "{end:?}");
        let longer = [bytes.as_slice(), &[0; 2]].concat();
        for bytes in [&bytes[..bytes.len() - 1], &longer] {
            let error = codec::decode(bytes, "pfm").unwrap_err();
            assert!(error.to_string().contains("take 8 bytes"), "{error}");
        }
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

#[test]
fn hdr_signatures_and_line_ends_are_of_any_kind() {
    // The first pixel begins with a line feed.
    let pixels = b"\x0a\x40\x20\x82\x00\x00\x00\x00";
    let expected = codec::decode(
        &[
            b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n",
            pixels.as_slice(),
        ]
        .concat(),
        "hdr",
    );
    let expected = expected.unwrap().image;
    for signature in [
        "#?RADIANCE",
        "#?RGBE",
        "#?RGBE made by hand",
        "#?AUTOPANO",
        "# none",
        "",
    ] {
        for end in ["\n", "\r\n", "\r"] {
            for facts in [
                &["FORMAT=32-bit_rle_rgbe", ""][..],
                &[
                    "# remark",
                    "EXPOSURE=1",
                    "FORMAT = 32-bit_rle_rgbe",
                    "no fact",
                    "",
                ],
                &["GAMMA=1"],
            ] {
                let mut lines: Vec<&str> = Vec::new();
                lines.extend(Some(signature).filter(|signature| !signature.is_empty()));
                lines.extend(facts);
                lines.extend(["-Y 1 +X 2", ""]);
                let bytes = [lines.join(end).as_bytes(), pixels].concat();
                let image = codec::decode(&bytes, "hdr").map(|file| file.image);
                assert_eq!(image, Ok(expected.clone()), "{lines:?} {end:?}");
                let cut = codec::decode(&bytes[..bytes.len() - 1], "hdr");
                assert!(cut.is_err(), "{lines:?} {end:?}");
            }
        }
    }
    for bytes in [b"".as_slice(), b"#?RGBE\n\n", b"\n\n\n", b"-Y 1 +X 2"] {
        assert!(codec::decode(bytes, "hdr").is_err());
    }
}

#[test]
fn sixteen_bits_are_read_whole_on_request() {
    let codes = [0x12ffu16, 0x3401, 0xffff];
    let samples: Vec<u8> = codes.into_iter().flat_map(u16::to_ne_bytes).collect();
    let mut png = Cursor::new(Vec::new());
    let (colour, format) = (image::ExtendedColorType::Rgb16, image::ImageFormat::Png);
    image::write_buffer_with_format(&mut png, &samples, 1, 1, colour, format).unwrap();
    let options = DecodeOptions {
        full_depth: true,
        ..DecodeOptions::default()
    };
    let whole = codec::decode_with(png.get_ref(), "png", &options).unwrap();
    let expected = codes.map(|code| f32::from(code) / 65535.0);
    assert_eq!(whole.file.image.data(), expected);
    let cut = codec::decode(png.get_ref(), "png").unwrap();
    assert_eq!(cut.image.data()[0], f32::from(0x12_u8) / 255.0);
}

#[test]
fn pictures_beyond_the_memory_left_are_refused() {
    for (extension, bytes) in samples_of_all_formats() {
        let decode = |max_bytes| {
            let options = DecodeOptions {
                max_bytes,
                ..DecodeOptions::default()
            };
            codec::decode_with(&bytes, extension, &options)
        };
        assert!(decode(1 << 20).is_ok(), "{extension}");
        let refused = decode(3);
        assert!(
            matches!(refused, Err(ImageError::TooLarge(_))),
            "{extension}: {refused:?}"
        );
    }
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
        codec::is_eight_bit("PNG") && codec::is_eight_bit("tga") && !codec::is_eight_bit("exr")
    );
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

fn samples_of_all_formats() -> Vec<(&'static str, Vec<u8>)> {
    use exr::prelude::{Blocks, Compression, SampleType::F16, SampleType::F32, Vec2};
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
    let other_codes = [
        Compression::RLE,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::DWAA(None),
        Compression::DWAB(None),
    ];
    let channels = [("R", F16), ("G", F16), ("B", F32)];
    let of = |compression| exr_compressed(&channels, Blocks::ScanLines, compression);
    samples.extend(other_codes.map(|compression| ("exr", of(compression))));
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
    let mut random = Uniform::new(1);
    let mut below = |n: usize| (random.bits() >> 16) as usize % n;
    for (extension, bytes) in samples_of_all_formats() {
        let mut n_errors = 0;
        for _ in 0..1500 {
            let mut damaged = bytes.clone();
            for _ in 0..=below(4) {
                let at = below(damaged.len());
                damaged[at] = if below(2) == 0 {
                    below(256) as u8
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
fn every_compression_of_exr_is_read() {
    use exr::prelude::{Blocks, Compression, SampleType, Vec2};
    let lossless = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
    ];
    let lossy = [
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::DWAA(None),
        Compression::DWAB(None),
    ];
    for sample_type in [SampleType::F16, SampleType::F32, SampleType::U32] {
        let channels = [("R", sample_type), ("G", sample_type), ("B", sample_type)];
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(8, 8))] {
            let read = |compression| {
                let bytes = exr_compressed(&channels, blocks, compression);
                codec::decode(&bytes, "exr")
                    .unwrap_or_else(|error| panic!("{compression:?}: {error}"))
                    .image
            };
            let original = read(Compression::Uncompressed);
            for compression in lossless {
                assert_eq!(read(compression), original, "{compression:?}");
            }
            for compression in lossy {
                let compared = Comparison::new(&read(compression), &original);
                let error = compared.unwrap().rel_mse;
                assert!(
                    error < 0.01,
                    "{compression:?} {blocks:?} {sample_type:?}: {error}"
                );
            }
        }
    }
}

#[test]
fn blocks_that_claim_more_than_they_hold_are_errors() {
    use exr::prelude::{Blocks, Compression, SampleType::F16};
    let channels = [("R", F16), ("G", F16), ("B", F16)];
    let bytes = exr_compressed(&channels, Blocks::ScanLines, Compression::DWAB(None));
    // Version 2 opens the only block; ten counters follow.
    let counters = find(&bytes, &2u64.to_le_bytes());
    for counter in 1..10 {
        let mut forged = bytes.clone();
        forged[counters + 8 * counter + 5] = 1;
        let error = codec::decode(&forged, "exr").unwrap_err();
        assert!(
            matches!(&error, ImageError::Invalid(text) if text.contains("claims more")),
            "{counter}: {error}"
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
#[expect(clippy::print_stderr, reason = "says that nothing was tested")]
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
                    file.image.data().iter().all(|sample| sample.is_finite()),
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
