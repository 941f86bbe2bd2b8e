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
use std::mem::take;
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::params::{Param, ParamClass, ParamList, ParamValue};
use tyndall_parser::schema::{self, Count, Default, Family, ParamSchema, PluginRef, Type};
use tyndall_parser::source::{Span, Spanned};

#[cfg(test)]
mod tests;

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
                    schema::count_of(&param.value),
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

/// Arrays. `None` when absent or empty; a missing required one is reported. Values are not looked at.
impl ParamReader<'_> {
    /// A list of `float`.
    pub fn take_floats(&mut self, name: &str) -> Option<Vec<f32>> {
        self.array(name, ParamClass::Float, |value| match value {
            ParamValue::Float(items) => Some(items),
            _ => None,
        })
    }

    /// A list of `integer`.
    pub fn take_ints(&mut self, name: &str) -> Option<Vec<i32>> {
        self.array(name, ParamClass::Integer, |value| match value {
            ParamValue::Integer(items) => Some(items),
            _ => None,
        })
    }

    /// A list of `point3`.
    pub fn take_point3s(&mut self, name: &str) -> Option<Vec<[f32; 3]>> {
        self.array(name, ParamClass::Point3, |value| match value {
            ParamValue::Point3(items) => Some(items),
            _ => None,
        })
    }

    /// A list of `vector3`.
    pub fn take_vector3s(&mut self, name: &str) -> Option<Vec<[f32; 3]>> {
        self.array(name, ParamClass::Vector3, |value| match value {
            ParamValue::Vector3(items) => Some(items),
            _ => None,
        })
    }

    /// A list of `normal`.
    pub fn take_normals(&mut self, name: &str) -> Option<Vec<[f32; 3]>> {
        self.array(name, ParamClass::Normal, |value| match value {
            ParamValue::Normal(items) => Some(items),
            _ => None,
        })
    }

    /// A list of `point2`, or of `float` taken in pairs; an odd last number is dropped with a warning.
    pub fn take_point2s_or_floats(&mut self, name: &str) -> Option<Vec<[f32; 2]>> {
        let points = self.array(name, ParamClass::Point2, |value| match value {
            ParamValue::Point2(items) => Some(items),
            _ => None,
        });
        if points.is_some() {
            return points;
        }
        let span = self.span(name);
        let numbers = self.take_floats(name)?;
        let (pairs, rest) = numbers.as_chunks::<2>();
        if !rest.is_empty() {
            self.report(
                Diagnostic::warning(
                    "value-count",
                    span,
                    format!("{name} has an odd number of values"),
                )
                .with_label("the last one is dropped"),
            );
        }
        Some(pairs.to_vec())
    }

    /// Exactly `N` numbers of type `float`, all finite; anything else is reported and ignored.
    pub fn floats<const N: usize>(&mut self, name: &str) -> Option<[f32; N]> {
        let schema = self.typed(name, |kind| kind == Type::Floats(Count::Exactly(N)));
        let span = self.span(name);
        let values: [f32; N] = self.exactly(schema, span, Self::take_floats)?;
        if values.iter().all(|x| x.is_finite()) {
            return Some(values);
        }
        self.report_not_finite(schema, span);
        None
    }

    /// Exactly `N` numbers of type `integer`; anything else is reported and ignored.
    pub fn ints<const N: usize>(&mut self, name: &str) -> Option<[i32; N]> {
        let schema = self.typed(name, |kind| kind == Type::Ints(Count::Exactly(N)));
        let span = self.span(name);
        self.exactly(schema, span, Self::take_ints)
    }

    fn exactly<T: Copy, const N: usize>(
        &mut self,
        schema: &'static ParamSchema,
        span: Span,
        take: fn(&mut Self, &str) -> Option<Vec<T>>,
    ) -> Option<[T; N]> {
        let given = self.is_given(schema.name);
        let values = take(self, schema.name).unwrap_or_default();
        let array = values.as_slice().try_into().ok();
        if array.is_none() && given {
            self.report(
                Diagnostic::error(
                    "value-count",
                    span,
                    format!("{} takes {N} values, not {}", schema.name, values.len()),
                )
                .with_label("it has no effect"),
            );
        }
        array
    }

    /// Moves an array out of the list, or copies it from a shared one.
    fn array<T: Clone>(
        &mut self,
        name: &str,
        class: ParamClass,
        items: fn(&mut ParamValue) -> Option<&mut Vec<T>>,
    ) -> Option<Vec<T>> {
        let family = self.plugin.family;
        let schema = self.typed(name, |kind| {
            !kind.is_single() && kind.classes(family).contains(&class)
        });
        for alias in schema.names() {
            let Some((index, _)) = self.find(Source::Own, alias, class) else {
                continue;
            };
            let array = match &mut self.params {
                Access::Taking(list) => items(&mut list.params[index].value).map(take),
                Access::Shared(list) => items(&mut list.params[index].value.clone()).map(take),
            };
            if let Some(array) = array.filter(|array| !array.is_empty()) {
                return Some(array);
            }
        }
        self.report_missing(schema);
        None
    }
}

/// What has no effect.
impl ParamReader<'_> {
    /// Reports every parameter that has no effect: unknown to the plugin, of a type it does not read, or beside
    /// another one that wins. Parameters that the plugin has are fine whether they were asked for or not.
    pub fn finish(self) {
        let plugin = self.plugin;
        self.finish_for(&[plugin]);
    }

    /// The same for a shape that overrides parameters of its material: those have an effect, too.
    pub fn finish_with_material(self, material: PluginRef) {
        let plugin = self.plugin;
        self.finish_for(&[plugin, material]);
    }

    fn finish_for(self, plugins: &[PluginRef]) {
        if self.shape.is_some() {
            return;
        }
        let list = self.params.list();
        self.diagnostics.list.extend(
            list.params
                .iter()
                .filter_map(|param| without_effect(param, list, plugins)),
        );
    }
}

/// Why a parameter of a list has no effect on any of the plugins; `None` when it has one.
fn without_effect(param: &Param, list: &ParamList, plugins: &[PluginRef]) -> Option<Diagnostic> {
    let class = schema::class_of(&param.value);
    let warning =
        |message: String| Diagnostic::warning("unused-parameter", param.decl_span, message);
    let known = |plugin: &PluginRef| Some((*plugin, plugin.schema.param_called(&param.name)?));
    let readers = || plugins.iter().filter_map(known);
    // Read: unless another parameter of the list wins.
    if let Some((plugin, schema)) =
        readers().find(|(plugin, schema)| schema.accepts(class, plugin.family))
    {
        let winner = list
            .params
            .iter()
            .find(|other| wins_over(other, param, schema, plugin.family))?;
        return Some(
            warning(format!(
                "\"{}\" has no effect beside {}",
                param.name,
                declaration(winner)
            ))
            .with_note(winner.decl_span, "this one is used"),
        );
    }
    // Known, but not in this type.
    if let Some((plugin, schema)) = readers().next() {
        let expected = schema.type_words(plugin.family);
        let message = format!(
            "{} has no effect on {}",
            declaration(param),
            quoted(plugins)
        );
        let warning = warning(message).with_label(format!("{} is a {expected}", param.name));
        return Some(match declaration_to_write(param, schema, plugin.family) {
            Some(text) => warning.with_help(format!("write {text}")),
            None => warning,
        });
    }
    // Unknown.
    let mut unknown = warning(format!(
        "\"{}\" has no effect on {}",
        param.name,
        quoted(plugins)
    ));
    let names = plugins
        .iter()
        .flat_map(|plugin| plugin.schema.param_names());
    unknown.help = schema::did_you_mean(&param.name, names);
    Some(unknown)
}

/// Whether `other` is read instead of `param`, which is a value of the same parameter.
fn wins_over(other: &Param, param: &Param, schema: &ParamSchema, family: Family) -> bool {
    let class = schema::class_of(&other.value);
    if !schema.accepts(class, family) {
        return false;
    }
    let rank = |name: &str| {
        schema
            .fallbacks
            .iter()
            .position(|fallback| *fallback == name)
            .map_or(0, |i| i + 1)
    };
    let is_name = |name: &str| name == schema.name || schema.fallbacks.contains(&name);
    let texture_wins = other.name == param.name
        && class == ParamClass::Texture
        && schema::class_of(&param.value) != ParamClass::Texture;
    texture_wins || (is_name(&other.name) && rank(&other.name) < rank(&param.name))
}

/// A declaration of the parameter that would be read, for the common case of a wrong type word.
fn declaration_to_write(param: &Param, schema: &ParamSchema, family: Family) -> Option<String> {
    let class = schema.types.first()?.classes(family).last()?;
    let name = &param.name;
    Some(match (class, &param.value) {
        (ParamClass::Spectrum, ParamValue::Float(values)) => match values.as_slice() {
            [x] => format!("\"rgb {name}\" [{x} {x} {x}]"),
            _ => format!("\"rgb {name}\""),
        },
        (ParamClass::Spectrum, _) => format!("\"rgb {name}\""),
        (ParamClass::Integer, _) => format!("\"integer {name}\""),
        (ParamClass::Float, _) => format!("\"float {name}\""),
        (ParamClass::Bool, _) => format!("\"bool {name}\""),
        (ParamClass::String, _) => format!("\"string {name}\""),
        (ParamClass::Point2, _) => format!("\"point2 {name}\""),
        (ParamClass::Point3, _) => format!("\"point3 {name}\""),
        (ParamClass::Vector3, _) => format!("\"vector3 {name}\""),
        (ParamClass::Normal, _) => format!("\"normal {name}\""),
        (ParamClass::Texture | ParamClass::Vector2, _) => return None,
    })
}

fn declaration(param: &Param) -> String {
    format!("\"{} {}\"", schema::type_word(&param.value), param.name)
}

fn quoted(plugins: &[PluginRef]) -> String {
    let names = plugins
        .iter()
        .map(|plugin| format!("{} \"{}\"", plugin.family.noun(), plugin.schema.name));
    names.collect::<Vec<_>>().join(" and ")
}

/// Looking up.
impl ParamReader<'_> {
    fn schema(&self, name: &str) -> &'static ParamSchema {
        self.plugin.schema.param(name).unwrap_or_else(|| {
            panic!(
                "the schema of {} has no parameter {name}",
                self.plugin.schema.name
            )
        })
    }

    fn typed(&self, name: &str, fits: impl Fn(Type) -> bool) -> &'static ParamSchema {
        let schema = self.schema(name);
        if !schema.types.iter().any(|kind| fits(*kind)) {
            self.wrong_question(name, "this getter");
        }
        schema
    }

    fn wrong_question(&self, name: &str, getter: &str) -> ! {
        panic!(
            "{getter} does not suit the schema of {} {name}",
            self.plugin.schema.name
        )
    }

    fn number_default(&self, name: &str) -> f32 {
        match self.schema(name).default {
            Default::Number(default) => default,
            _ => self.wrong_question(name, "float"),
        }
    }

    fn find(&self, source: Source, name: &str, class: ParamClass) -> Option<(usize, &Param)> {
        let list = match source {
            Source::Shape => &self.shape?.params,
            Source::Own => self.params.list(),
        };
        list.params
            .iter()
            .enumerate()
            .find(|(_, param)| param.name == name && schema::class_of(&param.value) == class)
    }

    fn bindings(&self, source: Source) -> &[TextureBinding] {
        match (source, self.shape) {
            (Source::Shape, Some(shape)) => &shape.textures,
            _ => self.textures,
        }
    }

    /// The parameter in any type that is read, in the order of the types, names and lists.
    fn given(&self, schema: &'static ParamSchema) -> Option<&Param> {
        let classes = schema
            .types
            .iter()
            .flat_map(|kind| kind.classes(self.plugin.family));
        classes
            .flat_map(|class| schema.names().map(move |name| (class, name)))
            .flat_map(|(class, name)| {
                [Source::Shape, Source::Own].map(|source| (class, name, source))
            })
            .find_map(|(class, name, source)| self.find(source, name, *class))
            .map(|(_, param)| param)
    }

    /// The one value of a parameter. More or fewer are reported, and the search goes on, as in pbrt-v3.
    fn single_if_given<T>(
        &mut self,
        schema: &'static ParamSchema,
        class: ParamClass,
        first: fn(&ParamValue) -> Option<T>,
    ) -> Option<Spanned<T>> {
        for name in schema.names() {
            for source in [Source::Shape, Source::Own] {
                let Some((_, param)) = self.find(source, name, class) else {
                    continue;
                };
                let (count, span) = (schema::count_of(&param.value), param.value_span);
                if count == 1 {
                    return first(&param.value).map(|value| Spanned::new(value, span));
                }
                self.report_count(schema, count, span);
            }
        }
        None
    }

    /// The same, and a missing required one is reported.
    fn single<T>(
        &mut self,
        schema: &'static ParamSchema,
        class: ParamClass,
        first: fn(&ParamValue) -> Option<T>,
    ) -> Option<Spanned<T>> {
        let value = self.single_if_given(schema, class, first);
        if value.is_none() {
            self.report_missing(schema);
        }
        value
    }
}

/// Checking.
impl ParamReader<'_> {
    /// The number if it makes sense, else the nearest that does, else `None`: the default holds.
    fn in_range(&mut self, schema: &'static ParamSchema, value: f64, span: Span) -> Option<f64> {
        let Some(range) = schema.range else {
            if value.is_finite() {
                return Some(value);
            }
            self.report_not_finite(schema, span);
            return None;
        };
        if range.contains(value) {
            return Some(value);
        }
        if !value.is_finite() {
            self.report_not_finite(schema, span);
            return None;
        }
        let nearest = range.nearest(value);
        let message = format!(
            "{} is {}, but should be {range}",
            schema.name,
            shortest(value)
        );
        let label = match nearest {
            Some(nearest) => format!("{nearest} is used instead"),
            None => "the default is used instead".to_owned(),
        };
        let diagnostic = if range.clamped {
            Diagnostic::warning("out-of-range", span, message)
        } else {
            Diagnostic::error("out-of-range", span, message)
        };
        self.report(diagnostic.with_label(label));
        nearest
    }

    fn sensible_spectrum(
        &mut self,
        schema: &'static ParamSchema,
        value: SpectrumValue,
        span: Span,
    ) -> Option<SpectrumValue> {
        let finite = match &value {
            SpectrumValue::Rgb(triple) | SpectrumValue::Xyz(triple) => {
                triple.iter().all(|x| x.is_finite())
            }
            SpectrumValue::Blackbody { kelvin, scale } => kelvin.is_finite() && scale.is_finite(),
            SpectrumValue::Samples(samples) => samples.as_flattened().iter().all(|x| x.is_finite()),
            SpectrumValue::File(_) => true,
        };
        if !finite {
            self.report_not_finite(schema, span);
            return None;
        }
        if let SpectrumValue::Blackbody { kelvin, .. } = value
            && kelvin <= 0.0
        {
            let message = format!(
                "the temperature of {} is {kelvin}, but should be > 0",
                schema.name
            );
            self.report(
                Diagnostic::error("out-of-range", span, message)
                    .with_label("the default is used instead"),
            );
            return None;
        }
        Some(value)
    }

    fn report_not_finite(&mut self, schema: &'static ParamSchema, span: Span) {
        let message = format!("{} is not a finite number", schema.name);
        self.report(
            Diagnostic::error("not-finite", span, message)
                .with_label("the default is used instead"),
        );
    }

    /// Reports a number of values other than one. Texture-valued parameters use the first of several.
    fn report_count(&mut self, schema: &'static ParamSchema, count: usize, span: Span) {
        let takes_first = schema.types.iter().any(|kind| {
            matches!(
                kind,
                Type::FloatTexture | Type::SpectrumTexture | Type::OwnTexture
            )
        });
        let label = if takes_first && count > 1 {
            "only the first one is used"
        } else {
            "it has no effect"
        };
        let message = format!("{} takes one value, not {count}", schema.name);
        self.report(Diagnostic::warning("value-count", span, message).with_label(label));
    }

    fn report_missing(&mut self, schema: &'static ParamSchema) {
        if schema.default == Default::Required {
            let family = self.plugin.family;
            let message = format!(
                "{} \"{}\" needs \"{}\"",
                family.noun(),
                self.plugin.schema.name,
                schema.name
            );
            let help = format!("{} is a {}", schema.name, schema.type_words(family));
            self.report(Diagnostic::error("missing-parameter", self.kind, message).with_help(help));
        }
    }
}

/// A number as it was written: most were read in single precision.
fn shortest(value: f64) -> String {
    let single = value as f32;
    if f64::from(single) == value {
        single.to_string()
    } else {
        value.to_string()
    }
}

fn unknown_texture(
    param: &Param,
    binding: Option<&TextureBinding>,
    value_type: TextureType,
) -> Diagnostic {
    let (wanted, other) = match value_type {
        TextureType::Float => ("float", "spectrum"),
        TextureType::Spectrum => ("spectrum", "float"),
    };
    let name = match &param.value {
        ParamValue::Texture(name) => name.as_str(),
        _ => "",
    };
    let message = format!("there is no {wanted} texture \"{name}\" here");
    let diagnostic = Diagnostic::error("unknown-texture", param.value_span, message)
        .with_label(format!("the default of {} is used instead", param.name));
    match binding {
        Some(TextureBinding {
            near_miss: Some(near),
            ..
        }) => diagnostic
            .with_help(format!("did you mean \"{}\"?", near.value))
            .with_note(near.span, format!("\"{}\" is defined here", near.value)),
        Some(binding) if binding.float.is_some() || binding.spectrum.is_some() => {
            diagnostic.with_help(format!("\"{name}\" is a {other} texture"))
        }
        _ => diagnostic,
    }
}

fn spectrum_default(schema: &ParamSchema) -> Option<SpectrumValue> {
    match schema.default {
        Default::Number(value) => Some(SpectrumValue::Rgb([value; 3])),
        Default::Rgb(rgb) => Some(SpectrumValue::Rgb(rgb)),
        _ => None,
    }
}

fn first_float(value: &ParamValue) -> Option<f32> {
    match value {
        ParamValue::Float(items) => items.first().copied(),
        _ => None,
    }
}

fn first_int(value: &ParamValue) -> Option<i32> {
    match value {
        ParamValue::Integer(items) => items.first().copied(),
        _ => None,
    }
}

fn first_bool(value: &ParamValue) -> Option<bool> {
    match value {
        ParamValue::Bool(items) => items.first().copied(),
        _ => None,
    }
}

fn first_string(value: &ParamValue) -> Option<String> {
    match value {
        ParamValue::String(items) => items.first().cloned(),
        _ => None,
    }
}

fn first_triple(value: &ParamValue) -> Option<[f32; 3]> {
    match value {
        ParamValue::Point3(items) | ParamValue::Vector3(items) => items.first().copied(),
        _ => None,
    }
}

fn first_spectrum(value: &ParamValue) -> Option<SpectrumValue> {
    match value {
        ParamValue::Rgb(items) => items.first().map(|rgb| SpectrumValue::Rgb(*rgb)),
        ParamValue::Xyz(items) => items.first().map(|xyz| SpectrumValue::Xyz(*xyz)),
        ParamValue::Blackbody(items) => {
            items
                .first()
                .map(|[kelvin, scale]| SpectrumValue::Blackbody {
                    kelvin: *kelvin,
                    scale: *scale,
                })
        }
        ParamValue::Spectrum(samples) if !samples.is_empty() => {
            Some(SpectrumValue::Samples(samples.clone()))
        }
        ParamValue::SpectrumFiles(files) => {
            files.first().map(|file| SpectrumValue::File(file.clone()))
        }
        _ => None,
    }
}
