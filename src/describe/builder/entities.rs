//! Directives that define things and set what is current: camera, media, textures, materials, lights.

use super::Builder;
use crate::describe::description::{
    AreaLightRef, CameraEntity, Entity, LightEntity, MaterialEntity, MaterialRef, MediumEntity,
    MediumPair, MediumRef, TextureBinding, TextureEntity, TextureRef, TextureType, TransformPair,
};
use crate::describe::names::Suggester;
use crate::describe::state::{CoordinateSystem, Ctm, Draft, Interface};
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::directive::Plugin;
use tyndall_parser::params::{ParamList, ParamValue};
use tyndall_parser::schema::{self, Family};
use tyndall_parser::source::{Span, Spanned};

impl Builder {
    pub(super) fn entity(&mut self, plugin: Plugin, span: Span) -> Entity {
        let textures = bindings(&plugin.params, &self.draft, &mut self.suggester);
        Entity {
            kind: plugin.name,
            params: plugin.params,
            textures,
            span,
        }
    }

    /// The media in force, looked up now. Unknown ones are vacuum; each place is reported once.
    pub(super) fn media(&mut self) -> MediumPair {
        let Some(interface) = self.draft.graphics.interface else {
            return MediumPair::default();
        };
        let names = &self.draft.interfaces[interface];
        let mut lookup = |name: &Spanned<String>| {
            if name.value.is_empty() {
                return None;
            }
            let medium = self.draft.named_media.get(&name.value).copied();
            if medium.is_none() && self.draft.reported_media.insert(name.span) {
                let known = self.draft.named_media.iter().map(|(name, medium)| {
                    (name.as_str(), self.draft.media[medium.0 as usize].name.span)
                });
                let diagnostic = self
                    .suggester
                    .unknown("unknown-medium", name, "medium", known);
                self.diagnostics
                    .push(diagnostic.with_label("vacuum is used instead"));
            }
            medium
        };
        MediumPair {
            inside: lookup(&names.inside),
            outside: lookup(&names.outside),
        }
    }

    pub(super) fn camera(&mut self, plugin: Plugin, span: Span) {
        if let Some(by) = self.draft.ctm.hidden_by() {
            self.diagnostics.push(
                Diagnostic::error(
                    "singular-transform",
                    by,
                    "this transform has no inverse: no camera can stand below it",
                )
                .with_label("all transforms above the camera are left out")
                .with_note(span, "the camera"),
            );
            self.draft.ctm = Ctm::default();
        }
        self.is_hidden("the camera", span);
        let ctm = self.draft.ctm.pair();
        let inverse = TransformPair {
            start: ctm.start.inverse(),
            end: ctm.end.inverse(),
        };
        // The limits of pbrt-v3 for a basis vector's squared length.
        let scaled = [inverse.start, inverse.end].iter().any(|matrix| {
            [matrix.x_axis, matrix.y_axis, matrix.z_axis]
                .iter()
                .any(|axis| !(0.999..=1.001).contains(&axis.truncate().length_squared()))
        });
        if scaled {
            self.diagnostics.push(
                Diagnostic::warning(
                    "scaled-camera",
                    span,
                    "the camera's transform contains a scale",
                )
                .with_help("undo it with Scale, or write the camera's distances in its own space"),
            );
        }
        let system = CoordinateSystem {
            pair: inverse,
            flaws: None,
            span,
        };
        self.draft
            .coordinate_systems
            .insert("camera".to_owned(), system);
        let entity = self.entity(plugin, span);
        self.draft.options.camera = Some(CameraEntity {
            entity,
            world_from_camera: inverse,
            medium: None,
        });
    }

    pub(super) fn make_named_medium(&mut self, plugin: Plugin, span: Span) {
        let Some(kind) = single_string(&plugin.params, "type") else {
            self.diagnostics.push(
                missing_type("MakeNamedMedium", &plugin.name).with_label("no medium is defined"),
            );
            return;
        };
        if let Err(diagnostic) = Family::Medium.lookup(&kind) {
            self.diagnostics
                .push(diagnostic.with_label("no medium is defined"));
            return;
        }
        self.warn_if_animated("a medium", span);
        let name = plugin.name;
        let entity = self.entity(
            Plugin {
                name: kind,
                params: plugin.params,
            },
            span,
        );
        self.draft
            .named_media
            .insert(name.value.clone(), MediumRef(next(&self.draft.media)));
        self.draft.media.push(MediumEntity {
            name,
            entity,
            world_from_medium: self.draft.ctm.pair(),
        });
    }

    pub(super) fn medium_interface(
        &mut self,
        inside: Spanned<String>,
        outside: Option<Spanned<String>>,
    ) {
        let outside = outside.unwrap_or_else(|| inside.clone());
        self.draft.graphics.interface = Some(self.draft.interfaces.len());
        self.draft.interfaces.push(Interface { inside, outside });
    }

    pub(super) fn texture(
        &mut self,
        name: Spanned<String>,
        value_type: &Spanned<String>,
        class: Plugin,
        span: Span,
    ) {
        let (value_type, family) = match value_type.value.as_str() {
            "float" => (TextureType::Float, Family::FloatTexture),
            "spectrum" | "color" => (TextureType::Spectrum, Family::SpectrumTexture),
            other => {
                let mut diagnostic = Diagnostic::error(
                    "unknown-texture-type",
                    value_type.span,
                    format!("there are no {other} textures"),
                )
                .with_label("no texture is defined");
                diagnostic.help = schema::did_you_mean(other, ["float", "spectrum", "color"])
                    .or_else(|| Some("known: float, spectrum, color".to_owned()));
                self.diagnostics.push(diagnostic);
                return;
            }
        };
        if let Err(mut diagnostic) = family.lookup(&class.name) {
            if Family::SpectrumTexture.find(&class.name.value).is_some() {
                diagnostic.help = Some("this class has spectrum textures only".to_owned());
            }
            self.diagnostics
                .push(diagnostic.with_label("no texture is defined"));
            return;
        }
        self.warn_if_animated("a texture", span);
        let entity = self.entity(class, span);
        let texture = TextureRef(next(&self.draft.textures));
        let names = match value_type {
            TextureType::Float => &mut self.draft.float_textures,
            TextureType::Spectrum => &mut self.draft.spectrum_textures,
        };
        if let Some(before) = names.define(&name.value, texture) {
            let before = self.draft.textures[before.0 as usize].name.span;
            self.diagnostics.push(redefined("texture", &name, before));
        }
        let world_from_texture = self.draft.ctm.pair();
        self.draft.textures.push(TextureEntity {
            name,
            value_type,
            entity,
            world_from_texture,
        });
    }

    /// Stores a material; `plugin` is named by its kind.
    pub(super) fn material(
        &mut self,
        name: Option<Spanned<String>>,
        mut plugin: Plugin,
        span: Span,
    ) -> MaterialRef {
        if let Err(diagnostic) = Family::Material.lookup(&plugin.name) {
            self.diagnostics
                .push(diagnostic.with_label("matte is used instead"));
            plugin.name.value = "matte".to_owned();
        }
        let materials = if plugin.name.value == "mix" {
            self.mixed_materials(&plugin)
        } else {
            Vec::new()
        };
        let entity = self.entity(plugin, span);
        let material = MaterialRef(next(&self.draft.materials));
        self.draft.materials.push(MaterialEntity {
            name,
            entity,
            materials,
        });
        material
    }

    /// The materials that a `mix` names.
    pub(super) fn mixed_materials(&mut self, plugin: &Plugin) -> Vec<(usize, Option<MaterialRef>)> {
        let mut materials = Vec::new();
        for key in ["namedmaterial1", "namedmaterial2"] {
            let index = plugin.params.params.iter().position(|param| {
                param.name == key
                    && matches!(&param.value, ParamValue::String(values) if values.len() == 1)
            });
            match (index, single_string(&plugin.params, key)) {
                (Some(index), Some(name)) => {
                    materials.push((index, self.find_material(&name, "matte is used instead")))
                }
                _ => self.diagnostics.push(
                    Diagnostic::error(
                        "missing-parameter",
                        plugin.name.span,
                        format!("a mix needs \"string {key}\""),
                    )
                    .with_label("matte is used instead"),
                ),
            }
        }
        materials
    }

    /// A named material, or an error that says what is done without it.
    pub(super) fn find_material(
        &mut self,
        name: &Spanned<String>,
        instead: &str,
    ) -> Option<MaterialRef> {
        let material = self.draft.named_materials.get(&name.value);
        if material.is_none() {
            let known = self.draft.named_materials.values().filter_map(|material| {
                let name = self.draft.materials[material.0 as usize].name.as_ref()?;
                Some((name.value.as_str(), name.span))
            });
            let diagnostic =
                self.suggester
                    .unknown("unknown-material", name, "named material", known);
            self.diagnostics.push(diagnostic.with_label(instead));
        }
        material
    }

    pub(super) fn make_named_material(&mut self, plugin: Plugin, span: Span) {
        let kind = single_string(&plugin.params, "type").unwrap_or_else(|| {
            self.diagnostics.push(
                missing_type("MakeNamedMaterial", &plugin.name)
                    .with_label("this name is a boundary without a surface"),
            );
            Spanned::new(String::new(), plugin.name.span)
        });
        let name = plugin.name;
        let material = self.material(
            Some(name.clone()),
            Plugin {
                name: kind,
                params: plugin.params,
            },
            span,
        );
        if let Some(before) = self.draft.named_materials.define(&name.value, material)
            && let Some(before) = &self.draft.materials[before.0 as usize].name
        {
            self.diagnostics
                .push(redefined("material", &name, before.span));
        }
    }

    pub(super) fn named_material(&mut self, plugin: &Plugin) {
        for param in &plugin.params.params {
            self.diagnostics.push(
                Diagnostic::warning(
                    "unused-parameter",
                    param.decl_span,
                    format!("\"{}\" has no effect", param.name),
                )
                .with_label("NamedMaterial takes no parameters"),
            );
        }
        if let Some(material) = self.find_material(&plugin.name, "the material stays as it is") {
            self.draft.graphics.material = material;
        }
    }

    pub(super) fn light_source(&mut self, plugin: Plugin, span: Span) {
        if self.is_hidden("a light", span) {
            return;
        }
        self.warn_if_animated("a light", span);
        let medium = self.media().outside;
        let entity = self.entity(plugin, span);
        self.draft.lights.push(LightEntity {
            entity,
            world_from_light: self.draft.ctm.pair(),
            medium,
        });
    }

    pub(super) fn area_light_source(&mut self, plugin: Plugin, span: Span) {
        // pbrt-v3 marks "no area light" by an empty name.
        if plugin.name.value.is_empty() {
            self.draft.graphics.area_light = None;
            return;
        }
        self.draft.graphics.area_light = Some(AreaLightRef(next(&self.draft.area_lights)));
        let entity = self.entity(plugin, span);
        self.draft.area_lights.push(entity);
    }
}

/// The index of the entry that is pushed next.
pub(super) fn next<T>(list: &[T]) -> u32 {
    // Each entry took at least one byte of a file whose offsets are u32.
    list.len() as u32
}

/// What the texture parameters of a list refer to at this point.
pub(super) fn bindings(
    params: &ParamList,
    draft: &Draft,
    suggester: &mut Suggester,
) -> Vec<TextureBinding> {
    let mut bindings = Vec::new();
    for (index, param) in params.params.iter().enumerate() {
        let ParamValue::Texture(name) = &param.value else {
            continue;
        };
        let float = draft.float_textures.get(name);
        let spectrum = draft.spectrum_textures.get(name);
        let near_miss = if float.is_none() && spectrum.is_none() {
            let names = draft
                .float_textures
                .values()
                .chain(draft.spectrum_textures.values());
            let known = names.map(|texture| {
                let name = &draft.textures[texture.0 as usize].name;
                (name.value.as_str(), name.span)
            });
            suggester
                .nearest(name, known)
                .map(|(name, span)| Box::new(Spanned::new(name.to_owned(), span)))
        } else {
            None
        };
        bindings.push(TextureBinding {
            param: index,
            float,
            spectrum,
            near_miss,
        });
    }
    bindings
}

/// The one value of a string parameter, at its place.
fn single_string(params: &ParamList, name: &str) -> Option<Spanned<String>> {
    params.params.iter().find_map(|param| match &param.value {
        ParamValue::String(values) if param.name == name => match values.as_slice() {
            [value] => Some(Spanned::new(value.clone(), param.value_span)),
            _ => None,
        },
        _ => None,
    })
}

fn missing_type(keyword: &str, name: &Spanned<String>) -> Diagnostic {
    Diagnostic::error(
        "missing-parameter",
        name.span,
        format!("{keyword} needs \"string type\" with one value"),
    )
}

fn redefined(what: &str, name: &Spanned<String>, before: Span) -> Diagnostic {
    Diagnostic::warning(
        "redefined",
        name.span,
        format!("{what} \"{}\" is defined again", name.value),
    )
    .with_label("later uses mean this one")
    .with_note(before, "it is defined here first")
}
