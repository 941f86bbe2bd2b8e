//! What the reader promises. Rows of pbrt-v3's sharp edges are named by their number.

use super::{ParamReader, SpectrumValue, Textured};
use crate::describe::description::{Entity, TextureBinding, TextureRef};
use tyndall_parser::diagnostic::{Diagnostics, Severity};
use tyndall_parser::params::{Param, ParamList, ParamValue};
use tyndall_parser::schema::{Count, Default, Family, PluginRef, Type};
use tyndall_parser::source::{FileId, Span, Spanned};

fn at(lo: usize) -> Span {
    Span {
        file: FileId(0),
        lo: lo as u32,
        hi: lo as u32 + 1,
    }
}

/// An entity whose name stands at 1000 and whose parameter i stands at 10 i, its value at 10 i + 5. The texture `f`
/// is float texture 0, `s` is spectrum texture 1; other names have the near miss `fog`, defined at 7.
fn entity(params: impl IntoIterator<Item = (&'static str, ParamValue)>) -> Entity {
    let mut entity = Entity {
        kind: Spanned::new("kind".to_owned(), at(1000)),
        params: ParamList::default(),
        textures: Vec::new(),
        span: at(1000),
    };
    for (index, (name, value)) in params.into_iter().enumerate() {
        if let ParamValue::Texture(name) = &value {
            let float = (name == "f").then_some(TextureRef(0));
            let spectrum = (name == "s").then_some(TextureRef(1));
            let near = Box::new(Spanned::new("fog".to_owned(), at(7)));
            let near_miss = (float.is_none() && spectrum.is_none()).then_some(near);
            entity.textures.push(TextureBinding {
                param: index,
                float,
                spectrum,
                near_miss,
            });
        }
        let (decl_span, value_span) = (at(10 * index), at(10 * index + 5));
        entity.params.params.push(Param {
            name: name.to_owned(),
            value,
            decl_span,
            value_span,
        });
    }
    entity
}

fn plugin(family: Family, name: &str) -> PluginRef {
    family.find(name).expect("a plugin of the schema")
}

fn float(value: f32) -> ParamValue {
    ParamValue::Float(vec![value])
}

fn rgb(grey: f32) -> ParamValue {
    ParamValue::Rgb(vec![[grey; 3]])
}

fn string(value: &str) -> ParamValue {
    ParamValue::String(vec![value.to_owned()])
}

fn texture(name: &str) -> ParamValue {
    ParamValue::Texture(name.to_owned())
}

/// Reads an entity and returns what was read and what was found, `finish` included.
fn read<T>(
    plugin: PluginRef,
    entity: &Entity,
    question: impl FnOnce(&mut ParamReader) -> T,
) -> (T, Diagnostics) {
    let mut diagnostics = Diagnostics::default();
    let mut reader = ParamReader::new(plugin, entity, &mut diagnostics);
    let answer = question(&mut reader);
    reader.finish();
    (answer, diagnostics)
}

/// (code, place) of every finding.
fn found(diagnostics: &Diagnostics) -> Vec<(&'static str, u32)> {
    diagnostics
        .list
        .iter()
        .map(|finding| (finding.code, finding.span.unwrap().lo))
        .collect()
}

fn constant<T>(value: Textured<T>) -> T {
    match value {
        Textured::Constant(value) => value.value,
        _ => panic!("not a constant"),
    }
}

#[test]
fn values_come_from_the_file_and_defaults_from_the_schema() {
    let camera = plugin(Family::Camera, "perspective");
    let (fov, diagnostics) = read(camera, &entity([("fov", float(30.0))]), |r| {
        (r.float("fov"), r.float("lensradius"))
    });
    assert_eq!((fov, found(&diagnostics)), ((30.0, 0.0), vec![]));

    let film = entity([
        ("xresolution", ParamValue::Integer(vec![64])),
        ("filename", string("a.exr")),
    ]);
    let (values, _) = read(plugin(Family::Film, "image"), &film, |r| {
        (
            r.int("xresolution"),
            r.int("yresolution"),
            r.string("filename"),
        )
    });
    assert_eq!(values, (64, 720, "a.exr".to_owned()));

    let light = entity([("twosided", ParamValue::Bool(vec![true]))]);
    let (values, _) = read(plugin(Family::AreaLight, "diffuse"), &light, |r| {
        (r.bool("twosided"), r.spectrum("L").value)
    });
    assert_eq!(values, (true, SpectrumValue::Rgb([1.0; 3])));

    let spot = entity([("from", ParamValue::Point3(vec![[1.0, 2.0, 3.0]]))]);
    let (values, _) = read(plugin(Family::Light, "spot"), &spot, |r| {
        (r.point3("from"), r.point3("to"))
    });
    assert_eq!(values, ([1.0, 2.0, 3.0], [0.0, 0.0, 1.0]));
}

#[test]
fn fallback_names_are_read_only_when_the_name_is_absent() {
    let glass = plugin(Family::Material, "glass");
    let eta = |params: Vec<(&'static str, ParamValue)>| {
        let (eta, diagnostics) = read(glass, &entity(params), |r| constant(r.float_texture("eta")));
        (eta, found(&diagnostics))
    };
    assert_eq!(eta(vec![]), (1.5, vec![]));
    assert_eq!(eta(vec![("index", float(1.3))]), (1.3, vec![]));
    assert_eq!(
        eta(vec![("index", float(1.3)), ("eta", float(1.7))]),
        (1.7, vec![("unused-parameter", 0)])
    );
    let samples = entity([("nsamples", ParamValue::Integer(vec![8]))]);
    assert_eq!(
        read(plugin(Family::Light, "infinite"), &samples, |r| r
            .int("samples"))
        .0,
        8
    );
}

#[test]
fn a_fallback_name_is_read_when_the_name_has_the_wrong_number_of_values() {
    let light = entity([
        ("samples", ParamValue::Integer(vec![2, 3])),
        ("nsamples", ParamValue::Integer(vec![8])),
    ]);
    let (samples, diagnostics) = read(plugin(Family::Light, "infinite"), &light, |r| {
        r.int("samples")
    });
    assert_eq!(
        (samples, found(&diagnostics)),
        (8, vec![("value-count", 5)])
    );
}

/// Quirk 6.
#[test]
fn q06_more_or_fewer_values_than_one_mean_the_default_and_warn() {
    let light = plugin(Family::Light, "point");
    for triples in [
        ParamValue::Rgb(vec![]),
        ParamValue::Rgb(vec![[2.0; 3], [3.0; 3]]),
        ParamValue::Spectrum(vec![]),
    ] {
        let (value, diagnostics) =
            read(light, &entity([("I", triples)]), |r| r.spectrum("I").value);
        assert_eq!(value, SpectrumValue::Rgb([1.0; 3]));
        assert_eq!(found(&diagnostics), [("value-count", 5)]);
        assert_eq!(diagnostics.list[0].severity, Severity::Warning);
    }
    let camera = entity([("fov", ParamValue::Float(vec![20.0, 30.0]))]);
    let (fov, diagnostics) = read(plugin(Family::Camera, "perspective"), &camera, |r| {
        r.float("fov")
    });
    assert_eq!((fov, found(&diagnostics)), (90.0, vec![("value-count", 5)]));
}

#[test]
fn sampled_data_is_one_value_however_long() {
    let samples = vec![[400.0, 1.0], [500.0, 2.0], [600.0, 3.0]];
    let light = entity([("I", ParamValue::Spectrum(samples.clone()))]);
    let (value, diagnostics) = read(plugin(Family::Light, "point"), &light, |r| r.spectrum("I"));
    assert_eq!(
        (value.value, value.span),
        (SpectrumValue::Samples(samples), at(5))
    );
    assert_eq!(found(&diagnostics), []);
}

#[test]
fn every_way_to_write_a_spectrum_is_kept_as_written() {
    for (written, read_as) in [
        (
            ParamValue::Xyz(vec![[1.0; 3]]),
            SpectrumValue::Xyz([1.0; 3]),
        ),
        (
            ParamValue::Blackbody(vec![[6500.0, 2.0]]),
            SpectrumValue::Blackbody {
                kelvin: 6500.0,
                scale: 2.0,
            },
        ),
        (
            ParamValue::SpectrumFiles(vec!["a.spd".into()]),
            SpectrumValue::File("a.spd".into()),
        ),
        (rgb(-1.0), SpectrumValue::Rgb([-1.0; 3])),
    ] {
        let (value, diagnostics) = read(
            plugin(Family::Light, "point"),
            &entity([("I", written)]),
            |r| r.spectrum("I"),
        );
        assert_eq!((value.value, found(&diagnostics)), (read_as, vec![]));
    }
}

/// Quirk 7.
#[test]
fn q07_a_float_scale_of_a_light_has_no_effect_and_the_finding_says_what_to_write() {
    let light = entity([("scale", float(3.0))]);
    let (value, diagnostics) = read(plugin(Family::Light, "point"), &light, |r| {
        r.spectrum("scale").value
    });
    assert_eq!(value, SpectrumValue::Rgb([1.0; 3]));
    assert_eq!(found(&diagnostics), [("unused-parameter", 0)]);
    let finding = &diagnostics.list[0];
    assert_eq!(
        finding.message,
        "\"float scale\" has no effect on light \"point\""
    );
    assert_eq!(
        finding.label,
        "scale is a spectrum (rgb, xyz, blackbody or spectrum)"
    );
    assert_eq!(finding.help.as_deref(), Some("write \"rgb scale\" [3 3 3]"));
}

/// Quirk 8.
#[test]
fn q08_an_unknown_texture_means_the_default_even_beside_a_constant() {
    let matte = entity([("Kd", rgb(0.9)), ("Kd", texture("fgo"))]);
    let (value, diagnostics) = read(plugin(Family::Material, "matte"), &matte, |r| {
        constant(r.spectrum_texture("Kd"))
    });
    assert_eq!(value, SpectrumValue::Rgb([0.5; 3]));
    assert_eq!(
        found(&diagnostics),
        [("unknown-texture", 15), ("unused-parameter", 0)]
    );
    let finding = &diagnostics.list[0];
    assert_eq!(finding.severity, Severity::Error);
    assert_eq!(finding.help.as_deref(), Some("did you mean \"fog\"?"));
    assert_eq!(finding.notes[0].0, at(7));
}

#[test]
fn a_texture_of_the_other_type_is_unknown_and_the_finding_says_so() {
    let matte = entity([("Kd", texture("f"))]);
    let (value, diagnostics) = read(plugin(Family::Material, "matte"), &matte, |r| {
        constant(r.spectrum_texture("Kd"))
    });
    assert_eq!(value, SpectrumValue::Rgb([0.5; 3]));
    assert_eq!(
        diagnostics.list[0].help.as_deref(),
        Some("\"f\" is a float texture")
    );
}

#[test]
fn textures_win_over_constants_of_the_same_name() {
    let matte = entity([("sigma", float(10.0)), ("sigma", texture("f"))]);
    let (value, diagnostics) = read(plugin(Family::Material, "matte"), &matte, |r| {
        r.float_texture("sigma")
    });
    assert_eq!(value, Textured::Texture(TextureRef(0)));
    assert_eq!(found(&diagnostics), [("unused-parameter", 0)]);
    assert!(
        diagnostics.list[0]
            .message
            .contains("beside \"texture sigma\"")
    );
}

#[test]
fn a_texture_valued_constant_takes_the_first_of_several_values() {
    let matte = entity([
        ("sigma", ParamValue::Float(vec![10.0, 20.0])),
        ("Kd", ParamValue::Rgb(vec![])),
    ]);
    let (value, diagnostics) = read(plugin(Family::Material, "matte"), &matte, |r| {
        (
            constant(r.float_texture("sigma")),
            constant(r.spectrum_texture("Kd")),
        )
    });
    assert_eq!(value, (10.0, SpectrumValue::Rgb([0.5; 3])));
    assert_eq!(
        found(&diagnostics),
        [("value-count", 5), ("value-count", 15)]
    );
}

#[test]
fn a_default_that_is_not_a_constant_is_left_to_the_plugin() {
    let metal = plugin(Family::Material, "metal");
    let ((eta, u), _) = read(metal, &entity([]), |r| {
        (r.spectrum_texture("eta"), r.float_texture("uroughness"))
    });
    assert_eq!((eta, u), (Textured::Default, Textured::Default));
    assert_eq!(
        read(plugin(Family::Shape, "sphere"), &entity([]), |r| r
            .optional_float("zmin"))
        .0,
        None
    );
}

fn overridden<T>(
    material: &Entity,
    shape: &Entity,
    question: impl FnOnce(&mut ParamReader) -> T,
) -> (T, Diagnostics) {
    let mut diagnostics = Diagnostics::default();
    let matte = plugin(Family::Material, "plastic");
    let mut reader =
        ParamReader::overridden(matte, material, &material.textures, shape, &mut diagnostics);
    let answer = question(&mut reader);
    reader.finish();
    (answer, diagnostics)
}

#[test]
fn a_shape_overrides_its_material_texture_first_then_constant() {
    let rough = |shape: Vec<(&'static str, ParamValue)>,
                 material: Vec<(&'static str, ParamValue)>| {
        overridden(&entity(material), &entity(shape), |r| {
            r.float_texture("roughness")
        })
        .0
    };
    let given = |x: f32, place: usize| Textured::Constant(Spanned::new(x, at(place)));
    let (f, name) = (Textured::Texture(TextureRef(0)), "roughness");
    assert_eq!(
        rough(
            vec![(name, float(0.5)), (name, texture("f"))],
            vec![(name, float(0.2))]
        ),
        f
    );
    assert_eq!(
        rough(vec![(name, float(0.5))], vec![(name, texture("f"))]),
        given(0.5, 5)
    );
    assert_eq!(
        rough(vec![], vec![(name, float(0.2)), (name, texture("f"))]),
        f
    );
    assert_eq!(rough(vec![], vec![(name, float(0.2))]), given(0.2, 5));
    assert_eq!(rough(vec![], vec![]), given(0.1, 1000));
}

/// Quirk 8, with two lists.
#[test]
fn q08_an_unknown_texture_of_a_shape_hides_the_constant_of_its_material() {
    let (value, _) = overridden(
        &entity([("roughness", float(0.2))]),
        &entity([("roughness", texture("fgo"))]),
        |r| constant(r.float_texture("roughness")),
    );
    assert_eq!(value, 0.1);
}

#[test]
fn scalars_of_a_shape_override_those_of_its_material() {
    let remap = |value| ("remaproughness", ParamValue::Bool(vec![value]));
    let (value, _) = overridden(&entity([remap(true)]), &entity([remap(false)]), |r| {
        r.bool("remaproughness")
    });
    assert!(!value);
    let twice = ("remaproughness", ParamValue::Bool(vec![true, true]));
    let (value, diagnostics) = overridden(&entity([remap(false)]), &entity([twice]), |r| {
        r.bool("remaproughness")
    });
    assert!(!value, "two values do not count: the material's one does");
    assert_eq!(found(&diagnostics), [("value-count", 5)]);
}

#[test]
fn a_shape_may_carry_parameters_of_its_material_without_a_warning() {
    let shape = entity([
        ("Kd", rgb(0.3)),
        ("Ks", float(0.1)),
        ("Kdd", rgb(0.1)),
        ("radius", float(2.0)),
    ]);
    let mut diagnostics = Diagnostics::default();
    let sphere = plugin(Family::Shape, "sphere");
    ParamReader::new(sphere, &shape, &mut diagnostics)
        .finish_with_material(plugin(Family::Material, "plastic"));
    assert_eq!(
        found(&diagnostics),
        [("unused-parameter", 10), ("unused-parameter", 20)]
    );
    assert!(diagnostics.list[0].label.contains("spectrum"));
    assert_eq!(
        diagnostics.list[1].help.as_deref(),
        Some("did you mean \"Kd\"?")
    );

    let mut diagnostics = Diagnostics::default();
    ParamReader::new(sphere, &shape, &mut diagnostics).finish();
    assert_eq!(diagnostics.list.len(), 3);
}

#[test]
fn finish_reports_misspelt_names_and_stays_silent_on_parameters_nobody_read() {
    let metal = entity([
        ("roughnes", float(0.1)),
        ("bumpmap", texture("f")),
        ("quux", float(1.0)),
    ]);
    let ((), diagnostics) = read(plugin(Family::Material, "metal"), &metal, |_| ());
    assert_eq!(
        found(&diagnostics),
        [("unused-parameter", 0), ("unused-parameter", 20)]
    );
    assert!(
        diagnostics
            .list
            .iter()
            .all(|finding| finding.severity == Severity::Warning)
    );
    assert_eq!(
        diagnostics.list[0].message,
        "\"roughnes\" has no effect on material \"metal\""
    );
    assert_eq!(
        diagnostics.list[0].help.as_deref(),
        Some("did you mean \"roughness\"?")
    );
    assert_eq!(diagnostics.list[1].help, None);
}

#[test]
fn constants_of_a_texture_have_its_own_type() {
    let (float_class, spectrum_class) = (
        plugin(Family::FloatTexture, "constant"),
        plugin(Family::SpectrumTexture, "constant"),
    );
    let both = entity([("value", float(2.0)), ("value", rgb(3.0))]);
    let (value, diagnostics) = read(float_class, &both, |r| r.float("value"));
    assert_eq!(
        (value, found(&diagnostics)),
        (2.0, vec![("unused-parameter", 10)])
    );
    let (value, diagnostics) = read(spectrum_class, &both, |r| r.spectrum("value").value);
    assert_eq!(
        (value, found(&diagnostics)),
        (SpectrumValue::Rgb([3.0; 3]), vec![("unused-parameter", 0)])
    );
    let scale = entity([("tex1", texture("s"))]);
    let (value, _) = read(plugin(Family::SpectrumTexture, "scale"), &scale, |r| {
        r.spectrum_texture("tex1")
    });
    assert_eq!(value, Textured::Texture(TextureRef(1)));
}

#[test]
fn numbers_outside_their_range_are_located_and_replaced() {
    let number = |family, kind, name: &'static str, value: f32| {
        let (read_as, diagnostics) =
            read(plugin(family, kind), &entity([(name, float(value))]), |r| {
                r.float(name)
            });
        assert_eq!(found(&diagnostics), [(diagnostics.list[0].code, 5)]);
        (
            read_as,
            diagnostics.list[0].code,
            diagnostics.list[0].severity,
        )
    };
    assert_eq!(
        number(Family::Shape, "sphere", "phimax", 400.0),
        (360.0, "out-of-range", Severity::Warning)
    );
    assert_eq!(
        number(Family::Shape, "sphere", "radius", -1.0),
        (0.0, "out-of-range", Severity::Error)
    );
    assert_eq!(
        number(Family::Camera, "perspective", "fov", 180.0),
        (90.0, "out-of-range", Severity::Error)
    );
    assert_eq!(
        number(Family::Shape, "sphere", "radius", f32::NAN),
        (1.0, "not-finite", Severity::Error)
    );
    assert_eq!(
        number(Family::Shape, "sphere", "radius", f32::INFINITY),
        (1.0, "not-finite", Severity::Error)
    );
    assert_eq!(
        number(Family::Film, "image", "scale", f32::INFINITY),
        (1.0, "not-finite", Severity::Error)
    );

    let none = entity([("pixelsamples", ParamValue::Integer(vec![0]))]);
    let (samples, diagnostics) = read(plugin(Family::Sampler, "halton"), &none, |r| {
        r.int("pixelsamples")
    });
    assert_eq!(
        (samples, found(&diagnostics)),
        (1, vec![("out-of-range", 5)])
    );
    assert_eq!(
        diagnostics.list[0].message,
        "pixelsamples is 0, but should be ≥ 1"
    );

    let glass = entity([("eta", float(-1.5))]);
    let (eta, _) = read(plugin(Family::Material, "glass"), &glass, |r| {
        constant(r.float_texture("eta"))
    });
    assert_eq!(eta, 1.5);
}

#[test]
fn infinity_is_fine_where_it_is_the_default() {
    let film = entity([("maxsampleluminance", float(f32::INFINITY))]);
    let (value, diagnostics) = read(plugin(Family::Film, "image"), &film, |r| {
        r.float("maxsampleluminance")
    });
    assert_eq!((value, found(&diagnostics)), (f32::INFINITY, vec![]));
}

#[test]
fn a_spectrum_that_is_no_light_is_located_and_replaced() {
    for (value, code) in [
        (ParamValue::Rgb(vec![[1.0, f32::NAN, 1.0]]), "not-finite"),
        (
            ParamValue::Spectrum(vec![[400.0, f32::INFINITY]]),
            "not-finite",
        ),
        (ParamValue::Blackbody(vec![[0.0, 1.0]]), "out-of-range"),
        (ParamValue::Blackbody(vec![[-5000.0, 1.0]]), "out-of-range"),
    ] {
        let (value, diagnostics) = read(
            plugin(Family::Light, "point"),
            &entity([("I", value)]),
            |r| r.spectrum("I").value,
        );
        assert_eq!(
            (value, found(&diagnostics)),
            (SpectrumValue::Rgb([1.0; 3]), vec![(code, 5)])
        );
    }
    let spot = entity([("from", ParamValue::Point3(vec![[f32::NAN; 3]]))]);
    let (from, diagnostics) = read(plugin(Family::Light, "spot"), &spot, |r| r.point3("from"));
    assert_eq!(
        (from, found(&diagnostics)),
        ([0.0; 3], vec![("not-finite", 5)])
    );
}

#[test]
fn an_unknown_choice_is_located_and_replaced_as_pbrt_does() {
    let curve = plugin(Family::Shape, "curve");
    let written = entity([
        ("type", string("flta")),
        ("basis", string("hermite")),
        ("degree", ParamValue::Integer(vec![4])),
    ]);
    let (values, diagnostics) = read(curve, &written, |r| {
        (
            r.choice("type"),
            r.strict_choice("basis"),
            r.int_choice("degree"),
        )
    });
    assert_eq!(values, ("cylinder", None, None));
    assert_eq!(
        found(&diagnostics),
        [
            ("unknown-choice", 5),
            ("unknown-choice", 15),
            ("unknown-choice", 25)
        ]
    );
    assert_eq!(
        diagnostics.list[0].help.as_deref(),
        Some("did you mean \"flat\"?")
    );
    assert_eq!(
        diagnostics.list[1].help.as_deref(),
        Some("known: bezier, bspline")
    );
    let (values, _) = read(curve, &entity([]), |r| {
        (
            r.choice("type"),
            r.strict_choice("basis"),
            r.int_choice("degree"),
        )
    });
    assert_eq!(values, ("flat", Some("bezier"), Some(3)));
    let medium = entity([("preset", string("skin1"))]);
    let (preset, diagnostics) = read(plugin(Family::Medium, "homogeneous"), &medium, |r| {
        r.choice("preset")
    });
    assert_eq!(
        (preset, diagnostics.list[0].help.as_deref()),
        ("", Some("did you mean \"Skin1\"?"))
    );
}

#[test]
fn splitdepth_is_read_as_float_before_integer() {
    let curve = plugin(Family::Shape, "curve");
    let both = entity([
        ("splitdepth", ParamValue::Integer(vec![2])),
        ("splitdepth", float(1.9)),
    ]);
    assert_eq!(read(curve, &both, |r| r.int("splitdepth")).0, 1);
    let int = entity([("splitdepth", ParamValue::Integer(vec![2]))]);
    assert_eq!(read(curve, &int, |r| r.int("splitdepth")).0, 2);
    assert_eq!(read(curve, &entity([]), |r| r.int("splitdepth")).0, 3);
}

#[test]
fn files_are_located_and_missing_ones_are_reported() {
    let ply = plugin(Family::Shape, "plymesh");
    let (file, _) = read(ply, &entity([("filename", string("a.ply"))]), |r| {
        r.file("filename")
    });
    assert_eq!(file, Some(Spanned::new("a.ply".to_owned(), at(5))));
    for written in [entity([]), entity([("filename", string(""))])] {
        let (file, diagnostics) = read(ply, &written, |r| r.file("filename"));
        assert_eq!(
            (file, found(&diagnostics)),
            (None, vec![("missing-parameter", 1000)])
        );
    }
    let (map, diagnostics) = read(plugin(Family::Light, "infinite"), &entity([]), |r| {
        r.file("mapname")
    });
    assert_eq!((map, found(&diagnostics)), (None, vec![]));
}

#[test]
fn arrays_are_moved_out_of_a_taken_entity_and_copied_from_a_shared_one() {
    let mesh = plugin(Family::Shape, "trianglemesh");
    let mut written = entity([
        ("P", ParamValue::Point3(vec![[1.0; 3]; 3])),
        ("indices", ParamValue::Integer(vec![0, 1, 2])),
    ]);
    let ParamValue::Point3(points) = &written.params.params[0].value else {
        panic!()
    };
    let address = points.as_ptr();
    let (copied, _) = read(mesh, &written, |r| r.take_point3s("P").unwrap());
    assert_ne!(copied.as_ptr(), address);

    let mut diagnostics = Diagnostics::default();
    let mut reader = ParamReader::taking(mesh, &mut written, &mut diagnostics);
    let moved = reader.take_point3s("P").unwrap();
    assert_eq!((moved.as_ptr(), moved.len()), (address, 3));
    assert_eq!(reader.take_ints("indices"), Some(vec![0, 1, 2]));
    assert_eq!(reader.take_normals("N"), None);
    assert_eq!(reader.take_vector3s("S"), None);
    reader.finish();
    assert_eq!(found(&diagnostics), []);
}

#[test]
fn missing_and_empty_required_arrays_are_reported() {
    let mesh = plugin(Family::Shape, "trianglemesh");
    for written in [entity([]), entity([("P", ParamValue::Point3(vec![]))])] {
        let (points, diagnostics) = read(mesh, &written, |r| r.take_point3s("P"));
        assert_eq!(
            (points, found(&diagnostics)),
            (None, vec![("missing-parameter", 1000)])
        );
        assert_eq!(
            diagnostics.list[0].message,
            "shape \"trianglemesh\" needs \"P\""
        );
    }
}

#[test]
fn texture_coordinates_are_found_in_the_order_of_pbrt() {
    let mesh = plugin(Family::Shape, "trianglemesh");
    let point = |name, x| (name, ParamValue::Point2(vec![[x; 2]]));
    let pair = |name, x| (name, ParamValue::Float(vec![x; 2]));
    let all = [
        point("uv", 1.0),
        point("st", 2.0),
        pair("uv", 3.0),
        pair("st", 4.0),
    ];
    for skip in 0..4 {
        let mut written: Vec<_> = all[skip..].to_vec();
        written.reverse();
        let (uv, _) = read(mesh, &entity(written), |r| r.take_point2s_or_floats("uv"));
        assert_eq!(uv, Some(vec![[skip as f32 + 1.0; 2]]));
    }
    let odd = entity([("uv", ParamValue::Float(vec![1.0, 2.0, 3.0]))]);
    let (uv, diagnostics) = read(mesh, &odd, |r| r.take_point2s_or_floats("uv"));
    assert_eq!(
        (uv, found(&diagnostics)),
        (Some(vec![[1.0, 2.0]]), vec![("value-count", 5)])
    );
}

#[test]
fn fixed_arrays_have_exactly_their_length_and_are_finite() {
    let film = plugin(Family::Film, "image");
    let crop = |values: Vec<f32>| {
        let (crop, diagnostics) = read(
            film,
            &entity([("cropwindow", ParamValue::Float(values))]),
            |r| r.floats::<4>("cropwindow"),
        );
        (crop, found(&diagnostics))
    };
    assert_eq!(
        crop(vec![0.0, 1.0, 0.0, 0.5]),
        (Some([0.0, 1.0, 0.0, 0.5]), vec![])
    );
    assert_eq!(crop(vec![0.0, 1.0]), (None, vec![("value-count", 5)]));
    assert_eq!(crop(vec![]), (None, vec![("value-count", 5)]));
    assert_eq!(
        crop(vec![0.0, f32::NAN, 0.0, 1.0]),
        (None, vec![("not-finite", 5)])
    );
    let bounds = entity([("pixelbounds", ParamValue::Integer(vec![0, 1, 2, 3]))]);
    let (bounds, _) = read(plugin(Family::Integrator, "path"), &bounds, |r| {
        r.ints::<4>("pixelbounds")
    });
    assert_eq!(bounds, Some([0, 1, 2, 3]));
    assert_eq!(
        read(film, &entity([]), |r| r.floats::<4>("cropwindow")),
        (None, Diagnostics::default())
    );
}

#[test]
fn spans_point_at_the_value_or_at_the_plugin() {
    let glass = entity([("index", float(1.2))]);
    let (places, _) = read(plugin(Family::Material, "glass"), &glass, |r| {
        (
            r.span("eta"),
            r.span("Kr"),
            r.is_given("eta"),
            r.is_given("Kr"),
        )
    });
    assert_eq!(places, (at(5), at(1000), true, false));
}

/// Every parameter of the table can be asked for by the getter of its type, absent or empty or badly given.
#[test]
fn every_parameter_of_the_schema_can_be_read() {
    for family in Family::ALL {
        for schema in family.plugins() {
            let plugin = PluginRef { family, schema };
            for param in schema.params() {
                let bad = entity([
                    (param.name, ParamValue::Float(vec![f32::NAN])),
                    (param.name, ParamValue::Integer(vec![])),
                    (param.name, string("nonsense")),
                    (param.name, texture("nonsense")),
                    (param.name, ParamValue::Blackbody(vec![[-1.0, 1.0]])),
                ]);
                for written in [entity([]), bad] {
                    read(plugin, &written, |r| {
                        ask(r, param.name, param.types[0], param.default)
                    });
                }
            }
        }
    }
}

fn ask(reader: &mut ParamReader, name: &str, kind: Type, default: Default) {
    match (kind, default) {
        (Type::Bool, Default::Bool(_)) => _ = reader.bool(name),
        (Type::Bool, _) => _ = reader.optional_bool(name),
        (Type::Int, Default::Int(_)) => _ = reader.int(name),
        (Type::Int, _) => _ = reader.optional_int(name),
        (Type::IntChoice(_), _) => _ = reader.int_choice(name),
        // `splitdepth`
        (Type::Float, Default::Int(_)) => _ = reader.int(name),
        (Type::Float, Default::Number(_)) => _ = reader.float(name),
        (Type::Float, _) => _ = reader.optional_float(name),
        (Type::String, Default::Text(_)) => _ = reader.string(name),
        // Read by the graphics state: the kind of a named material or medium, the parts of a mix.
        (Type::String, _) => {}
        (Type::File, _) => _ = reader.file(name),
        (Type::Choice(_), _) => _ = reader.strict_choice(name),
        (Type::Point3, _) => _ = reader.point3(name),
        (Type::Vector3, _) => _ = reader.vector3(name),
        (Type::Spectrum, Default::Number(_) | Default::Rgb(_)) => _ = reader.spectrum(name),
        (Type::Spectrum, _) => _ = reader.optional_spectrum(name),
        (Type::FloatTexture, _) => _ = reader.float_texture(name),
        (Type::SpectrumTexture, _) => _ = reader.spectrum_texture(name),
        (Type::OwnTexture, _) if reader.plugin().family == Family::FloatTexture => {
            _ = reader.float_texture(name)
        }
        (Type::OwnTexture, _) => _ = reader.spectrum_texture(name),
        (Type::OwnConstant, _) if reader.plugin().family == Family::FloatTexture => {
            _ = reader.float(name)
        }
        (Type::OwnConstant, _) => _ = reader.spectrum(name),
        (Type::Ints(Count::Exactly(_)), _) => _ = reader.ints::<4>(name),
        (Type::Floats(Count::Exactly(_)), _) => _ = reader.floats::<4>(name),
        (Type::Ints(_), _) => _ = reader.take_ints(name),
        (Type::Floats(_), _) => _ = reader.take_floats(name),
        (Type::Point2s, _) => _ = reader.take_point2s_or_floats(name),
        (Type::Point3s, _) => _ = reader.take_point3s(name),
        (Type::Vector3s, _) => _ = reader.take_vector3s(name),
        (Type::Normals, _) => _ = reader.take_normals(name),
    }
}
