//! Scenes written for other versions of pbrt: recognised by words that pbrt-v3 does not have.

use crate::diagnostic::Diagnostic;
use crate::directive::{Directive, Plugin};
use crate::params::{ParamClass, ParamValue};
use crate::source::{Span, excerpt};

/// Another version of the scene format.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Version {
    V2,
    V4,
}

/// What showed first that a scene is written for another version.
#[derive(Default)]
pub(crate) struct Dialect(Option<(Version, Span, String)>);

impl Dialect {
    /// Looks at a word that is no directive of pbrt-v3; whether it is one of another version.
    pub(crate) fn see_word(&mut self, word: &[u8], span: Span) -> bool {
        let version = match word {
            b"Attribute" | b"ColorSpace" | b"Import" | b"Option" => Version::V4,
            b"Renderer" | b"SurfaceIntegrator" | b"Volume" | b"VolumeIntegrator" => Version::V2,
            _ => return false,
        };
        self.note(version, span, || {
            format!("the directive `{}`", excerpt(word))
        });
        true
    }

    /// Looks at a directive of pbrt-v3: at the name of its plugin, and at parameters that have changed their names.
    pub(crate) fn see_directive(&mut self, directive: &Directive) {
        let (plugin, version) = match directive {
            Directive::Accelerator(plugin) => (
                plugin,
                one_of(plugin, &["grid", "bruteforce"]).then_some(Version::V2),
            ),
            Directive::Camera(plugin) => (
                plugin,
                one_of(plugin, &["spherical"]).then_some(Version::V4),
            ),
            Directive::Film(plugin) => (
                plugin,
                one_of(plugin, &["rgb", "gbuffer", "spectral"]).then_some(Version::V4),
            ),
            Directive::Integrator(plugin) => {
                let names = [
                    "function",
                    "lightpath",
                    "randomwalk",
                    "simplepath",
                    "simplevolpath",
                ];
                (plugin, one_of(plugin, &names).then_some(Version::V4))
            }
            Directive::Sampler(plugin) => {
                let v4 = ["independent", "paddedsobol", "pmj02bn", "zsobol"];
                let version = if one_of(plugin, &v4) {
                    Some(Version::V4)
                } else {
                    one_of(plugin, &["adaptive", "bestcandidate"]).then_some(Version::V2)
                };
                (plugin, version)
            }
            Directive::Material(plugin) => (plugin, of_material(&plugin.name.value)),
            Directive::MakeNamedMaterial(plugin) => {
                let kind = plugin.params.get("type", ParamClass::String);
                let kind = kind.and_then(|param| match &param.value {
                    ParamValue::String(values) => values.first(),
                    _ => None,
                });
                (plugin, kind.and_then(|kind| of_material(kind)))
            }
            Directive::LightSource(plugin) => (plugin, None),
            Directive::Shape(plugin) => {
                if one_of(plugin, &["bilinearmesh"]) {
                    self.see_plugin(directive, plugin, Version::V4);
                }
                return;
            }
            _ => return,
        };
        if let Some(version) = version {
            self.see_plugin(directive, plugin, version);
        }
        let names: &[&str] = match directive {
            Directive::Material(_) | Directive::MakeNamedMaterial(_) => &["reflectance"],
            Directive::LightSource(_) => &["illuminance", "power"],
            Directive::Film(_) => &["iso", "sensor"],
            _ => return,
        };
        let is_of_v4 = |name: &str| names.contains(&name);
        if let Some(param) = plugin.params.iter().find(|param| is_of_v4(&param.name)) {
            self.note(Version::V4, param.decl_span, || {
                let keyword = directive.keyword();
                format!("the parameter \"{}\" of {keyword}", param.name)
            });
        }
    }

    fn see_plugin(&mut self, directive: &Directive, plugin: &Plugin, version: Version) {
        self.note(version, plugin.name.span, || {
            format!("{} \"{}\"", directive.keyword(), plugin.name.value)
        });
    }

    fn note(&mut self, version: Version, span: Span, what: impl Fn() -> String) {
        self.0.get_or_insert_with(|| (version, span, what()));
    }

    /// The finding that names the version.
    pub(crate) fn finding(self) -> Option<Diagnostic> {
        let (version, span, what) = self.0?;
        let (name, help) = match version {
            Version::V2 => (
                "pbrt-v2",
                "pbrt-v3 has Integrator instead of SurfaceIntegrator, VolumeIntegrator and Renderer, and \
                 MakeNamedMedium instead of Volume",
            ),
            Version::V4 => (
                "pbrt-v4",
                "most scenes of pbrt-v4 are published for pbrt-v3 as well; materials, lights and films have other \
                 names and parameters there",
            ),
        };
        let message = format!("this scene is written for {name}: {what} is not of pbrt-v3");
        Some(
            Diagnostic::error("other-version", span, message)
                .with_label("the rest is read as pbrt-v3 does")
                .with_help(help),
        )
    }
}

fn one_of(plugin: &Plugin, names: &[&str]) -> bool {
    names.contains(&plugin.name.value.as_str())
}

/// The version that has a material of this kind, if pbrt-v3 does not.
fn of_material(kind: &str) -> Option<Version> {
    match kind {
        "coatedconductor"
        | "coateddiffuse"
        | "conductor"
        | "dielectric"
        | "diffuse"
        | "diffusetransmission"
        | "interface"
        | "thindielectric" => Some(Version::V4),
        "measured" | "shinymetal" => Some(Version::V2),
        _ => None,
    }
}
