//! Files of other programs, other versions and other systems, as a user meets them.

use crate::room::{Room, ball};

/// A scene with `world` before its end.
fn with(world: &str) -> String {
    ball("WorldEnd", &format!("{world}\nWorldEnd"))
}

#[test]
fn scenes_of_other_versions_are_named_first() {
    let room = Room::new();
    let v4 = "Option \"bool disablepixeljitter\" true\nFilm \"rgb\"\nWorldBegin\nAttribute \"shape\" \"float radius\" 1";
    let v2 = "SurfaceIntegrator \"path\"\nRenderer \"sampler\"\nWorldBegin\nVolume \"homogeneous\"\nWorldEnd";
    let material = with("Material \"diffuse\" \"rgb reflectance\" [.5 .5 .5]\nShape \"sphere\"");
    let film = ball("Film \"image\"", "Film \"gbuffer\"");
    for (scene, name) in [
        (v4, "pbrt-v4"),
        (v2, "pbrt-v2"),
        (&material, "pbrt-v4"),
        (&film, "pbrt-v4"),
    ] {
        room.put("other.pbrt", scene);
        let report = room.report("check other.pbrt");
        let findings = report["findings"].as_array().expect("a list");
        let is_it = |finding: &&serde_json::Value| finding["code"] == "other-version";
        assert_eq!(findings.iter().filter(is_it).count(), 1, "{scene}");
        let first = findings[0]["message"].as_str().unwrap_or_default();
        assert!(first.contains(name), "{first}");
    }
    let report = room.report("check ball.pbrt");
    assert_eq!(report["counts"]["errors"], 0);
}

#[test]
fn backslashes_in_a_missing_path_get_their_hint() {
    let room = Room::new();
    let written = "textures\\\\wood.png";
    let texture =
        format!("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{written}\"");
    let worlds = [
        format!("{texture} Material \"matte\" \"texture Kd\" \"t\" Shape \"sphere\""),
        format!("Shape \"plymesh\" \"string filename\" \"{written}\""),
        format!("LightSource \"infinite\" \"string mapname\" \"{written}\""),
        format!("Material \"metal\" \"spectrum eta\" \"{written}\" Shape \"sphere\""),
        format!("Material \"fourier\" \"string bsdffile\" \"{written}\" Shape \"sphere\""),
        format!("Include \"{written}\""),
    ];
    for world in worlds {
        room.put("ball.pbrt", &with(&world));
        let run = room.run("check ball.pbrt").ends_with(3);
        run.says("directories are separated by / here: write \"textures/wood.png\"");
    }
    room.put(
        "ball.pbrt",
        &with("Shape \"plymesh\" \"string filename\" \"no.ply\""),
    );
    let run = room.run("check ball.pbrt").ends_with(3);
    assert!(!run.stderr.contains("separated"), "{}", run.stderr);
}

#[test]
fn a_spectrum_of_no_visible_wavelength_is_a_warning() {
    let room = Room::new();
    for (samples, says) in [
        ("0.4 1.6\n0.7 0.2\n", Some("they look like micrometres")),
        ("4000 1.6\n7000 0.2\n", Some("they look like Ångström")),
        ("4e-7 1.6\n7e-7 0.2\n", Some("they look like metres")),
        ("800 1\n2000 2\n", Some("no wavelength is visible")),
        ("1 1\n", Some("no wavelength is visible")),
        ("400 1.6\n700 0.2\n", None),
        ("300 1.6\n900 0.2\n", None),
        ("555 1\n", None),
    ] {
        room.put("eta.spd", samples);
        let numbers = samples.replace('\n', " ");
        for value in ["\"eta.spd\"".to_owned(), format!("[{numbers}]")] {
            let metal = format!("Material \"metal\" \"spectrum eta\" {value} Shape \"sphere\"");
            room.put("ball.pbrt", &with(&metal));
            let run = room.run("check ball.pbrt").ends_with(0);
            let is_told = run.stderr.contains("warning[invisible-spectrum]");
            assert_eq!(is_told, says.is_some(), "{samples}: {}", run.stderr);
            if let Some(says) = says {
                run.says(says);
            }
        }
    }
}

#[test]
fn what_is_below_a_singular_transform_is_not_rendered() {
    let room = Room::new();
    let picture = |room: &Room, world: &str, code: i32| {
        room.put("ball.pbrt", &with(world));
        room.run("--quiet --spp 1 --outfile ball.exr ball.pbrt")
            .ends_with(code);
        room.picture("ball.exr").image
    };
    let without = picture(&room, "", 0);
    let sphere = "Shape \"sphere\" \"float radius\" 20";
    for hidden in [
        "Scale 0 0 0",
        "Scale 1 0 1",
        "Transform [1 0 0 0  0 1 0 0  0 0 0 0  2 1 0 1]",
    ] {
        let world = format!("AttributeBegin {hidden} {sphere} AttributeEnd");
        assert_eq!(picture(&room, &world, 0), without, "{hidden}");
    }
    assert_ne!(picture(&room, sphere, 0), without);
}

#[test]
fn the_picture_that_is_taken_of_several_is_told() {
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
        Layer, LayerAttributes, SmallVec, WritableImage,
    };
    let part = |name: &str, channels: &[&str], value: f32| {
        let channel = |name: &&str| AnyChannel::new(*name, FlatSamples::F32(vec![value; 4]));
        let list: SmallVec<_> = channels.iter().map(channel).collect();
        let attributes = LayerAttributes::named(name);
        Layer::new(
            (2, 2),
            attributes,
            Encoding::UNCOMPRESSED,
            AnyChannels::sort(list),
        )
    };
    let room = Room::new();
    let write = |name: &str, layers: Vec<Layer<AnyChannels<FlatSamples>>>| {
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions((2, 2)));
        let image = Image::from_layers(attributes, SmallVec::<[_; 2]>::from_vec(layers));
        image
            .write()
            .non_parallel()
            .to_file(room.path(name))
            .expect("a file");
    };
    let rgb = ["R", "G", "B"];
    write(
        "two.exr",
        vec![part("depth", &["Z"], 9.0), part("beauty", &rgb, 0.5)],
    );
    write("one.exr", vec![part("beauty", &rgb, 0.5)]);
    write(
        "left.exr",
        vec![part("left", &rgb, 0.5), part("right", &rgb, 0.5)],
    );
    let note = "R G B of part \"beauty\" is read, not Z of part \"depth\"";
    let run = room.run("compare --max-mse 0 two.exr one.exr").ends_with(0);
    run.says(note);
    let texture = |file: &str| {
        let texture =
            format!("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"{file}\"");
        with(&format!(
            "{texture} Material \"matte\" \"texture Kd\" \"t\" Shape \"sphere\""
        ))
    };
    room.put("ball.pbrt", &texture("two.exr"));
    room.run("check ball.pbrt").ends_with(0).says(note);
    room.put("ball.pbrt", &texture("left.exr"));
    room.run("check ball.pbrt")
        .ends_with(3)
        .says("several pictures");
}
