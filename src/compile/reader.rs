//! The only door to parameters: typed, checked against the schema, with every oddity reported where it stands.
//!
//! A [`ParamReader`] is made for one plugin and asked for parameters by name. Defaults, fallback names, choices and
//! ranges come from [`tyndall_parser::schema`]; asking for a name or a type that the schema does not have is a
//! mistake in the program and panics. What the *file* gets wrong never panics: it is reported, and the default or
//! the nearest sensible value is used. [`ParamReader::finish`] reports parameters that have no effect.
//!
//! The rules are pbrt-v3's: a parameter that takes one value is only found when exactly one is given; texture-valued
//! parameters prefer textures to constants and the shape's list to the material's; an unknown texture means the
//! default.

use crate::describe::description::{Entity, TextureBinding, TextureRef, TextureType};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::params::{ParamClass, ParamList, ParamValue};
use tyndall_parser::schema::{self, Default, ParamSchema, PluginRef, Type};
use tyndall_parser::source::{Span, Spanned};

mod arrays;
mod checks;
mod effect;
mod lookup;
#[cfg(test)]
mod tests;
mod values;

use checks::unknown_texture;
use values::{
    count_of, first_bool, first_float, first_int, first_spectrum, first_string, first_triple,
    spectrum_default,
};

/// A spectrum as written. Finite; conversion to colour is up to the caller.
#[derive(Clone, PartialEq, Debug)]
pub enum SpectrumValue {
    /// Linear RGB.
    Rgb([f32; 3]),
    /// CIE XYZ.
    Xyz([f32; 3]),
    /// A black body, its peak scaled to 1 and then by `scale`.
    Blackbody {
        /// Temperature, above 0.
        kelvin: f32,
        /// Factor.
        scale: f32,
    },
    /// (wavelength in nm, value) pairs in the order of the file; at least one.
    Samples(Vec<[f32; 2]>),
    /// A file of such pairs.
    File(String),
}

/// The value of a texture-valued parameter.
#[derive(Clone, PartialEq, Debug)]
pub enum Textured<T> {
    /// A texture.
    Texture(TextureRef),
    /// A constant: given, or the schema's default (then located at the plugin's name).
    Constant(Spanned<T>),
    /// Nothing is given and the default is not a constant: the plugin knows what to do.
    Default,
}

/// Reads the parameters of one plugin.
pub struct ParamReader<'a> {
    plugin: PluginRef,
    kind: Span,
    params: Access<'a>,
    textures: &'a [TextureBinding],
    /// The shape whose parameters come before the material's.
    shape: Option<&'a Entity>,
    diagnostics: &'a mut Diagnostics,
}

/// Whether arrays may be moved out of the list.
enum Access<'a> {
    Shared(&'a ParamList),
    Taking(&'a mut ParamList),
}

impl Access<'_> {
    fn list(&self) -> &ParamList {
        match self {
            Self::Shared(list) => list,
            Self::Taking(list) => list,
        }
    }
}

/// One of the lists a reader looks into.
#[derive(Clone, Copy)]
enum Source {
    Shape,
    Own,
}

impl<'a> ParamReader<'a> {
    /// Reads an entity and leaves it as it is; arrays are copied.
    pub fn new(plugin: PluginRef, entity: &'a Entity, diagnostics: &'a mut Diagnostics) -> Self {
        let (params, textures) = (Access::Shared(&entity.params), entity.textures.as_slice());
        Self {
            plugin,
            kind: entity.kind.span,
            params,
            textures,
            shape: None,
            diagnostics,
        }
    }

    /// Reads an entity and moves arrays out of it: each can be read once.
    pub fn taking(
        plugin: PluginRef,
        entity: &'a mut Entity,
        diagnostics: &'a mut Diagnostics,
    ) -> Self {
        let (params, textures) = (
            Access::Taking(&mut entity.params),
            entity.textures.as_slice(),
        );
        Self {
            plugin,
            kind: entity.kind.span,
            params,
            textures,
            shape: None,
            diagnostics,
        }
    }

    /// Reads a material for a shape that overrides some of its parameters. `textures` are the bindings of the
    /// material's parameters as seen from the shape (`ShapeEntity::private_material`).
    ///
    /// Its [`finish`](Self::finish) reports nothing: the shape's reader and the material's own one do.
    pub fn overridden(
        plugin: PluginRef,
        material: &'a Entity,
        textures: &'a [TextureBinding],
        shape: &'a Entity,
        diagnostics: &'a mut Diagnostics,
    ) -> Self {
        let params = Access::Shared(&material.params);
        Self {
            plugin,
            kind: material.kind.span,
            params,
            textures,
            shape: Some(shape),
            diagnostics,
        }
    }

    /// The plugin.
    pub fn plugin(&self) -> PluginRef {
        self.plugin
    }

    /// Where the plugin's name stands.
    pub fn kind_span(&self) -> Span {
        self.kind
    }

    /// Where the value of a parameter stands; where the plugin's name stands when the parameter is absent.
    pub fn span(&self, name: &str) -> Span {
        self.given(self.schema(name))
            .map_or(self.kind, |param| param.value_span)
    }

    /// Whether a parameter is given in a type that is read.
    pub fn is_given(&self, name: &str) -> bool {
        self.given(self.schema(name)).is_some()
    }

    /// Records a finding of the plugin's own.
    pub fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }
}

/// Single values.
impl ParamReader<'_> {
    /// A `float` with a default. `float`-typed values of float textures (class `constant`, `bilerp`) too.
    pub fn float(&mut self, name: &str) -> f32 {
        let default = self.number_default(name);
        self.optional_float(name).unwrap_or(default)
    }

    /// A `float` without a constant default. A missing required one is reported.
    pub fn optional_float(&mut self, name: &str) -> Option<f32> {
        let schema = self.typed(name, |kind| matches!(kind, Type::Float | Type::OwnConstant));
        let value = self.single(schema, ParamClass::Float, first_float)?;
        self.in_range(schema, f64::from(value.value), value.span)
            .map(|x| x as f32)
    }

    /// An `integer` with a default.
    pub fn int(&mut self, name: &str) -> i32 {
        let Default::Int(default) = self.schema(name).default else {
            self.wrong_question(name, "int")
        };
        self.optional_int(name).unwrap_or(default)
    }

    /// An `integer` without a constant default. A missing required one is reported. A parameter that may also be a
    /// `float` is read as one first and cut toward zero.
    pub fn optional_int(&mut self, name: &str) -> Option<i32> {
        let schema = self.typed(name, |kind| kind == Type::Int);
        if schema.types.contains(&Type::Float)
            && let Some(value) = self.single_if_given(schema, ParamClass::Float, first_float)
        {
            return self
                .in_range(schema, f64::from(value.value), value.span)
                .map(|x| x as i32);
        }
        let value = self.single(schema, ParamClass::Integer, first_int)?;
        self.in_range(schema, f64::from(value.value), value.span)
            .map(|x| x as i32)
    }

    /// An `integer` out of a few. `None`: it is another one, which is reported; nothing should be made.
    pub fn int_choice(&mut self, name: &str) -> Option<i32> {
        let schema = self.typed(name, |kind| matches!(kind, Type::IntChoice(_)));
        let (&[Type::IntChoice(choices)], Default::Int(default)) = (schema.types, schema.default)
        else {
            self.wrong_question(name, "int_choice")
        };
        let Some(value) = self.single(schema, ParamClass::Integer, first_int) else {
            return Some(default);
        };
        if choices.contains(&value.value) {
            return Some(value.value);
        }
        let known = choices
            .iter()
            .map(i32::to_string)
            .collect::<Vec<_>>()
            .join(", ");
        self.report(
            Diagnostic::error(
                "unknown-choice",
                value.span,
                format!("{name} cannot be {}", value.value),
            )
            .with_help(format!("known: {known}")),
        );
        None
    }

    /// A `bool` with a default.
    pub fn bool(&mut self, name: &str) -> bool {
        let Default::Bool(default) = self.schema(name).default else {
            self.wrong_question(name, "bool")
        };
        self.optional_bool(name).unwrap_or(default)
    }

    /// A `bool` without a constant default.
    pub fn optional_bool(&mut self, name: &str) -> Option<bool> {
        let schema = self.typed(name, |kind| kind == Type::Bool);
        self.single(schema, ParamClass::Bool, first_bool)
            .map(|value| value.value)
    }

    /// A `string` with a default.
    pub fn string(&mut self, name: &str) -> String {
        let schema = self.typed(name, |kind| kind == Type::String);
        let Default::Text(default) = schema.default else {
            self.wrong_question(name, "string")
        };
        self.single(schema, ParamClass::String, first_string)
            .map_or_else(|| default.to_owned(), |value| value.value)
    }

    /// A `string` out of a few; an unknown one is reported and replaced as the schema says.
    pub fn choice(&mut self, name: &str) -> &'static str {
        let Some(otherwise) = self.schema(name).otherwise else {
            self.wrong_question(name, "choice")
        };
        self.strict_choice(name).unwrap_or(otherwise)
    }

    /// A `string` out of a few; `None` for an unknown one, which is reported.
    pub fn strict_choice(&mut self, name: &str) -> Option<&'static str> {
        let schema = self.typed(name, |kind| matches!(kind, Type::Choice(_)));
        let Default::Text(default) = schema.default else {
            self.wrong_question(name, "choice")
        };
        let Some(value) = self.single(schema, ParamClass::String, first_string) else {
            return Some(default);
        };
        let choices = schema.choices();
        if let Some(choice) = choices.iter().find(|choice| **choice == value.value) {
            return Some(choice);
        }
        let message = format!("{name} cannot be \"{}\"", value.value);
        let mut diagnostic = match schema.otherwise {
            Some("") => Diagnostic::warning("unknown-choice", value.span, message)
                .with_label("it has no effect"),
            Some(instead) => Diagnostic::warning("unknown-choice", value.span, message)
                .with_label(format!("\"{instead}\" is used instead")),
            None => Diagnostic::error("unknown-choice", value.span, message),
        };
        diagnostic.help = schema::did_you_mean(&value.value, choices.iter().copied())
            .or_else(|| (choices.len() <= 8).then(|| format!("known: {}", choices.join(", "))));
        self.report(diagnostic);
        None
    }

    /// A file name, as written. An empty one counts as absent; a missing required one is reported.
    pub fn file(&mut self, name: &str) -> Option<Spanned<String>> {
        let schema = self.typed(name, |kind| kind == Type::File);
        let value = self
            .single_if_given(schema, ParamClass::String, first_string)
            .filter(|value| !value.value.is_empty());
        if value.is_none() {
            self.report_missing(schema);
        }
        value
    }

    /// A `point3` with a default.
    pub fn point3(&mut self, name: &str) -> [f32; 3] {
        let schema = self.typed(name, |kind| kind == Type::Point3);
        self.triple(schema, ParamClass::Point3)
    }

    /// A `vector3` with a default.
    pub fn vector3(&mut self, name: &str) -> [f32; 3] {
        let schema = self.typed(name, |kind| kind == Type::Vector3);
        self.triple(schema, ParamClass::Vector3)
    }

    /// A spectrum with a constant default.
    pub fn spectrum(&mut self, name: &str) -> Spanned<SpectrumValue> {
        let Some(default) = spectrum_default(self.schema(name)) else {
            self.wrong_question(name, "spectrum")
        };
        let kind = self.kind;
        self.optional_spectrum(name)
            .unwrap_or_else(|| Spanned::new(default, kind))
    }

    /// A spectrum, `None` when absent.
    pub fn optional_spectrum(&mut self, name: &str) -> Option<Spanned<SpectrumValue>> {
        let schema = self.typed(name, |kind| {
            matches!(kind, Type::Spectrum | Type::OwnConstant)
        });
        let value = self.single(schema, ParamClass::Spectrum, first_spectrum)?;
        self.sensible_spectrum(schema, value.value, value.span)
            .map(|sensible| Spanned::new(sensible, value.span))
    }

    fn triple(&mut self, schema: &'static ParamSchema, class: ParamClass) -> [f32; 3] {
        let Default::Triple(default) = schema.default else {
            self.wrong_question(schema.name, "point3 or vector3")
        };
        let Some(value) = self.single(schema, class, first_triple) else {
            return default;
        };
        if value.value.iter().all(|x| x.is_finite()) {
            return value.value;
        }
        self.report_not_finite(schema, value.span);
        default
    }
}

/// Texture-valued parameters.
impl ParamReader<'_> {
    /// A float texture or a constant.
    pub fn float_texture(&mut self, name: &str) -> Textured<f32> {
        let schema = self.typed(name, |kind| {
            matches!(kind, Type::FloatTexture | Type::OwnTexture)
        });
        self.textured(
            schema,
            TextureType::Float,
            first_float,
            |reader, value, span| {
                reader
                    .in_range(schema, f64::from(value), span)
                    .map(|x| x as f32)
            },
        )
        .unwrap_or_else(|| match schema.default {
            Default::Number(value) => Textured::Constant(Spanned::new(value, self.kind)),
            _ => Textured::Default,
        })
    }

    /// A spectrum texture or a constant.
    pub fn spectrum_texture(&mut self, name: &str) -> Textured<SpectrumValue> {
        let schema = self.typed(name, |kind| {
            matches!(kind, Type::SpectrumTexture | Type::OwnTexture)
        });
        self.textured(
            schema,
            TextureType::Spectrum,
            first_spectrum,
            |reader, value, span| reader.sensible_spectrum(schema, value, span),
        )
        .unwrap_or_else(|| match spectrum_default(schema) {
            Some(value) => Textured::Constant(Spanned::new(value, self.kind)),
            None => Textured::Default,
        })
    }

    /// Texture before constant, shape before material, name before fallback name. An unknown texture ends the
    /// search for its name: not even a constant beside it is used.
    fn textured<T>(
        &mut self,
        schema: &'static ParamSchema,
        value_type: TextureType,
        first: fn(&ParamValue) -> Option<T>,
        sensible: impl Fn(&mut Self, T, Span) -> Option<T>,
    ) -> Option<Textured<T>> {
        let class = match value_type {
            TextureType::Float => ParamClass::Float,
            TextureType::Spectrum => ParamClass::Spectrum,
        };
        for name in schema.names() {
            for source in [Source::Shape, Source::Own] {
                if let Some((index, param)) = self.find(source, name, ParamClass::Texture) {
                    let binding = self
                        .bindings(source)
                        .iter()
                        .find(|binding| binding.param == index);
                    let texture = binding.and_then(|binding| match value_type {
                        TextureType::Float => binding.float,
                        TextureType::Spectrum => binding.spectrum,
                    });
                    if let Some(texture) = texture {
                        return Some(Textured::Texture(texture));
                    }
                    let diagnostic = unknown_texture(param, binding, value_type);
                    self.report(diagnostic);
                    break;
                }
                let Some((_, param)) = self.find(source, name, class) else {
                    continue;
                };
                let (value, count, span) = (
                    first(&param.value),
                    count_of(&param.value),
                    param.value_span,
                );
                if count != 1 {
                    self.report_count(schema, count, span);
                }
                if let Some(value) = value {
                    let value = sensible(self, value, span)?;
                    return Some(Textured::Constant(Spanned::new(value, span)));
                }
            }
        }
        None
    }
}
