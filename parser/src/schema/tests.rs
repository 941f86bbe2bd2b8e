//! The table is sane.

use super::{DIRECTIVES, Default, Family, ParamSchema, PluginSchema, Type};
use crate::params::ParamClass;
use crate::source::{FileId, Span, Spanned};
use crate::{NoIncludes, Sources, parse};
use std::collections::HashSet;

fn everything() -> impl Iterator<Item = (Family, &'static PluginSchema, &'static ParamSchema)> {
    Family::ALL.into_iter().flat_map(|family| {
        family
            .plugins()
            .iter()
            .flat_map(move |plugin| plugin.params().map(move |param| (family, plugin, param)))
    })
}

fn spanned(text: &str) -> Spanned<String> {
    Spanned::new(
        text.into(),
        Span {
            file: FileId(0),
            lo: 3,
            hi: 7,
        },
    )
}

#[test]
fn plugin_names_and_aliases_are_unique_in_their_family() {
    for family in Family::ALL {
        let mut seen = HashSet::new();
        assert!(!family.plugins().is_empty());
        for plugin in family.plugins() {
            for name in std::iter::once(&plugin.name).chain(plugin.aliases) {
                assert!(seen.insert(*name), "{} {name} twice", family.noun());
                assert_eq!(family.find(name).unwrap().schema.name, plugin.name);
            }
        }
    }
}

#[test]
fn parameter_names_and_fallbacks_are_unique_in_their_plugin() {
    for family in Family::ALL {
        for plugin in family.plugins() {
            let mut seen = HashSet::new();
            for name in plugin.param_names() {
                assert!(seen.insert(name), "{} has {name} twice", plugin.name);
            }
        }
    }
}

#[test]
fn defaults_have_the_type_of_their_parameter() {
    for (_, plugin, param) in everything() {
        let fits = |kind: &Type| match (kind, param.default) {
            (_, Default::Absent | Default::Formula(_) | Default::Required) => true,
            (Type::Bool, Default::Bool(_)) | (Type::Int, Default::Int(_)) => true,
            (Type::Float | Type::FloatTexture, Default::Number(_)) => true,
            (Type::OwnTexture | Type::OwnConstant, Default::Number(_)) => true,
            (Type::Spectrum | Type::SpectrumTexture, Default::Number(_) | Default::Rgb(_)) => true,
            (Type::String, Default::Text(_)) => true,
            (Type::Point3 | Type::Vector3, Default::Triple(_)) => true,
            (Type::Choice(choices), Default::Text(text)) => choices.contains(&text),
            (Type::IntChoice(choices), Default::Int(value)) => choices.contains(&value),
            _ => false,
        };
        assert!(!param.types.is_empty());
        assert!(
            param.types.iter().any(fits),
            "{} {}",
            plugin.name,
            param.name
        );
    }
}

#[test]
fn an_unknown_choice_stands_for_a_known_one() {
    for (_, plugin, param) in everything() {
        if let Some(choice) = param.otherwise {
            assert!(
                param.choices().contains(&choice),
                "{} {}",
                plugin.name,
                param.name
            );
        }
    }
}

#[test]
fn defaults_lie_in_their_range() {
    for (_, plugin, param) in everything() {
        let value = match param.default {
            Default::Int(value) => f64::from(value),
            Default::Number(value) => f64::from(value),
            _ => continue,
        };
        if let Some(range) = param.range {
            assert!(
                range.contains(value),
                "{} {} {value}",
                plugin.name,
                param.name
            );
        }
    }
}

#[test]
fn ranges_belong_to_numbers_and_are_not_empty() {
    for (_, plugin, param) in everything() {
        let Some(range) = param.range else { continue };
        let number = |kind: &Type| matches!(kind, Type::Int | Type::Float | Type::FloatTexture);
        assert!(
            param.types.iter().any(number),
            "{} {}",
            plugin.name,
            param.name
        );
        assert!(range.lo < range.hi, "{} {}", plugin.name, param.name);
    }
}

#[test]
fn a_value_outside_a_closed_range_moves_to_its_end_and_outside_an_open_one_has_no_nearest() {
    let sigma = Family::Material
        .find("matte")
        .unwrap()
        .schema
        .param("sigma")
        .unwrap()
        .range
        .unwrap();
    assert_eq!(sigma.nearest(100.0), Some(90.0));
    assert!(!sigma.contains(f64::NAN));
    let fov = Family::Camera
        .find("perspective")
        .unwrap()
        .schema
        .param("fov")
        .unwrap()
        .range
        .unwrap();
    assert!(!fov.contains(180.0));
    assert_eq!(fov.nearest(180.0), None);
    assert_eq!(fov.to_string(), "> 0 and < 180");
}

#[test]
fn meanings_are_one_sentence() {
    let meanings = everything()
        .map(|(_, _, param)| param.meaning)
        .chain(DIRECTIVES.iter().map(|d| d.meaning));
    for meaning in meanings {
        assert!(
            meaning.ends_with('.') && !meaning.contains('\n'),
            "{meaning}"
        );
    }
}

#[test]
fn every_directive_is_in_the_table_and_says_where_it_may_stand() {
    let mut seen = HashSet::new();
    for entry in DIRECTIVES {
        assert!(seen.insert(entry.keyword), "{} twice", entry.keyword);
        assert!(entry.in_options || entry.in_world, "{}", entry.keyword);
    }
    assert_eq!(DIRECTIVES.len(), 37);
    let unknown = |keyword: &str| {
        let mut sources = Sources::new();
        let file = sources.add_text("scene.pbrt", keyword);
        let (_, found) = parse(&mut sources, file, &NoIncludes);
        found
            .iter()
            .any(|finding| finding.code == "unknown-directive")
    };
    assert!(unknown("Sphere"));
    for entry in DIRECTIVES {
        assert!(!unknown(entry.keyword), "{}", entry.keyword);
    }
}

#[test]
fn every_family_is_named_by_a_directive() {
    for family in Family::ALL {
        assert!(
            DIRECTIVES
                .iter()
                .any(|entry| entry.families.contains(&family)),
            "{}",
            family.noun()
        );
    }
}

#[test]
fn aliases_of_the_format_are_known() {
    for (family, alias, canonical) in [
        (Family::Sampler, "02sequence", "lowdiscrepancy"),
        (Family::Light, "exinfinite", "infinite"),
        (Family::AreaLight, "area", "diffuse"),
        (Family::Material, "", "none"),
    ] {
        assert_eq!(family.find(alias).unwrap().schema.name, canonical);
    }
    for (family, plugin, fallback, canonical) in [
        (Family::Shape, "trianglemesh", "st", "uv"),
        (Family::Shape, "loopsubdiv", "nlevels", "levels"),
        (Family::Light, "infinite", "nsamples", "samples"),
        (Family::AreaLight, "diffuse", "nsamples", "samples"),
        (Family::Integrator, "sppm", "numiterations", "iterations"),
        (Family::Material, "glass", "index", "eta"),
        (Family::Material, "uber", "index", "eta"),
    ] {
        let schema = family.find(plugin).unwrap().schema;
        assert_eq!(schema.param_called(fallback).unwrap().name, canonical);
        assert!(schema.param(fallback).is_none());
    }
}

/// Quirk 50: `subsurface` has no `index`.
#[test]
fn subsurface_does_not_read_index() {
    for name in ["subsurface", "kdsubsurface"] {
        assert!(
            Family::Material
                .find(name)
                .unwrap()
                .schema
                .param_called("index")
                .is_none()
        );
    }
}

/// Quirk 44: these classes have no float form.
#[test]
fn uv_and_marble_are_spectrum_textures_only() {
    for name in ["uv", "marble"] {
        assert!(Family::FloatTexture.find(name).is_none());
        assert!(Family::SpectrumTexture.find(name).is_some());
    }
}

#[test]
fn an_own_texture_has_the_type_of_its_family() {
    let tex1 = Family::FloatTexture
        .find("scale")
        .unwrap()
        .schema
        .param("tex1")
        .unwrap();
    assert!(tex1.accepts(ParamClass::Float, Family::FloatTexture));
    assert!(!tex1.accepts(ParamClass::Spectrum, Family::FloatTexture));
    assert!(tex1.accepts(ParamClass::Spectrum, Family::SpectrumTexture));
    assert!(!tex1.accepts(ParamClass::Float, Family::SpectrumTexture));
}

#[test]
fn an_unknown_plugin_is_located_and_has_a_suggestion() {
    let finding = Family::Shape.lookup(&spanned("trianglmesh")).unwrap_err();
    assert_eq!(finding.code, "unknown-plugin");
    assert_eq!(finding.span.unwrap().lo, 3);
    assert_eq!(
        finding.help.as_deref(),
        Some("did you mean \"trianglemesh\"?")
    );
    let finding = Family::Medium
        .lookup(&spanned("something else"))
        .unwrap_err();
    assert_eq!(
        finding.help.as_deref(),
        Some("known: homogeneous, heterogeneous")
    );
}
