//! What a scene file may say: every directive, plugin and parameter of pbrt-v3 in one table.
//!
//! The table is the single source for defaults, checks, "did you mean" and the generated reference
//! (`docs/format.md`). It describes the language, not the renderer: plugins that are not rendered are in it too.
//! It reads no parameter lists and knows no scene.

mod directives;
mod lights;
mod markdown;
mod materials;
mod media;
mod options;
mod shapes;
mod suggest;
mod textures;
mod words;

#[cfg(test)]
mod tests;

use crate::diagnostic::{Diagnostic, Severity};
use crate::params::ParamClass;
use crate::source::Spanned;

pub use directives::{DIRECTIVES, DirectiveSchema, directive};
pub use markdown::markdown;
pub use suggest::{did_you_mean, nearest};

/// A kind of plugin: the name space a plugin name is looked up in.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Family {
    /// `Camera`
    Camera,
    /// `Sampler`
    Sampler,
    /// `PixelFilter`
    Filter,
    /// `Film`
    Film,
    /// `Accelerator`
    Accelerator,
    /// `Integrator`
    Integrator,
    /// `Shape`
    Shape,
    /// `Material` and `MakeNamedMaterial`
    Material,
    /// `Texture "…" "float"`
    FloatTexture,
    /// `Texture "…" "spectrum"`
    SpectrumTexture,
    /// `LightSource`
    Light,
    /// `AreaLightSource`
    AreaLight,
    /// `MakeNamedMedium`
    Medium,
}

/// What a parameter accepts.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Type {
    /// One `bool`.
    Bool,
    /// One `integer`.
    Int,
    /// One `integer` out of a few.
    IntChoice(&'static [i32]),
    /// One `float`.
    Float,
    /// One `string` without further meaning.
    String,
    /// One `string` that names a file.
    File,
    /// One `string` out of a few.
    Choice(&'static [&'static str]),
    /// One `point3`.
    Point3,
    /// One `vector3`.
    Vector3,
    /// One spectrum: `rgb`, `xyz`, `blackbody` or `spectrum`.
    Spectrum,
    /// A float texture or a constant `float`.
    FloatTexture,
    /// A spectrum texture or a constant spectrum.
    SpectrumTexture,
    /// A texture or a constant of the type of the texture that has this parameter.
    OwnTexture,
    /// A constant of the type of the texture that has this parameter.
    OwnConstant,
    /// Several `integer`.
    Ints(Count),
    /// Several `float`.
    Floats(Count),
    /// Several `point2`.
    Point2s,
    /// Several `point3`.
    Point3s,
    /// Several `vector3`.
    Vector3s,
    /// Several `normal`.
    Normals,
}

/// How many values an array holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Count {
    /// Any number.
    Any,
    /// Exactly this many.
    Exactly(usize),
}

/// What holds when a parameter is absent.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Default {
    /// Nothing: the plugin cannot be made without it.
    Required,
    /// Nothing: the feature is not used.
    Absent,
    /// A truth value.
    Bool(bool),
    /// An integer.
    Int(i32),
    /// A number; for a spectrum, this value in every channel.
    Number(f32),
    /// Linear RGB.
    Rgb([f32; 3]),
    /// A string.
    Text(&'static str),
    /// A point or vector.
    Triple([f32; 3]),
    /// Worked out by the plugin, told in words.
    Formula(&'static str),
}

/// The values that make sense for a number.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Range {
    /// Lower end.
    pub lo: f64,
    /// Upper end.
    pub hi: f64,
    /// Whether `lo` itself is outside.
    pub lo_open: bool,
    /// Whether `hi` itself is outside.
    pub hi_open: bool,
    /// pbrt-v3 itself moves a value from outside to the nearest end, so doing so is no error.
    pub clamped: bool,
}

/// One parameter of a plugin.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ParamSchema {
    /// Name without the type.
    pub name: &'static str,
    /// Names read, in order, when `name` is absent.
    pub fallbacks: &'static [&'static str],
    /// What it accepts, preferred type first.
    pub types: &'static [Type],
    /// What holds when it is absent.
    pub default: Default,
    /// Physical unit; empty when it has none.
    pub unit: &'static str,
    /// Which values make sense.
    pub range: Option<Range>,
    /// What an unknown choice stands for; `None`: the plugin cannot be made.
    pub otherwise: Option<&'static str>,
    /// What it does, in one line.
    pub meaning: &'static str,
}

/// One plugin of a family.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PluginSchema {
    /// Canonical name.
    pub name: &'static str,
    /// Other names of the same plugin.
    pub aliases: &'static [&'static str],
    /// What it is, in one line.
    pub meaning: &'static str,
    /// Its parameters, in groups so that plugins can share some.
    pub groups: &'static [&'static [ParamSchema]],
}

/// A plugin as looked up: the schema and the family it was found in.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PluginRef {
    /// The family; decides what [`Type::OwnTexture`] means.
    pub family: Family,
    /// The plugin.
    pub schema: &'static PluginSchema,
}

impl Family {
    /// Every family, in the order of the reference.
    pub const ALL: [Self; 13] = [
        Self::Camera,
        Self::Film,
        Self::Filter,
        Self::Sampler,
        Self::Accelerator,
        Self::Integrator,
        Self::Shape,
        Self::Material,
        Self::FloatTexture,
        Self::SpectrumTexture,
        Self::Light,
        Self::AreaLight,
        Self::Medium,
    ];

    /// The plugins of the family.
    pub fn plugins(self) -> &'static [PluginSchema] {
        match self {
            Self::Camera => options::CAMERAS,
            Self::Film => options::FILMS,
            Self::Filter => options::FILTERS,
            Self::Sampler => options::SAMPLERS,
            Self::Accelerator => options::ACCELERATORS,
            Self::Integrator => options::INTEGRATORS,
            Self::Shape => shapes::SHAPES,
            Self::Material => materials::MATERIALS,
            Self::FloatTexture => textures::FLOAT_TEXTURES,
            Self::SpectrumTexture => textures::SPECTRUM_TEXTURES,
            Self::Light => lights::LIGHTS,
            Self::AreaLight => lights::AREA_LIGHTS,
            Self::Medium => media::MEDIA,
        }
    }

    /// What one plugin of the family is called in a sentence.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Film => "film",
            Self::Filter => "filter",
            Self::Sampler => "sampler",
            Self::Accelerator => "accelerator",
            Self::Integrator => "integrator",
            Self::Shape => "shape",
            Self::Material => "material",
            Self::FloatTexture => "float texture class",
            Self::SpectrumTexture => "spectrum texture class",
            Self::Light => "light",
            Self::AreaLight => "area light",
            Self::Medium => "medium type",
        }
    }

    /// The plugin of that name or alias.
    pub fn find(self, name: &str) -> Option<PluginRef> {
        let schema = self
            .plugins()
            .iter()
            .find(|plugin| plugin.name == name || plugin.aliases.contains(&name))?;
        Some(PluginRef {
            family: self,
            schema,
        })
    }

    /// The plugin of that name or alias, or a located finding with a suggestion.
    ///
    /// # Errors
    /// `unknown-plugin`, an error; soften its severity where pbrt-v3 carries on with something else.
    pub fn lookup(self, name: &Spanned<String>) -> Result<PluginRef, Box<Diagnostic>> {
        self.find(&name.value).ok_or_else(|| {
            let mut diagnostic = Diagnostic::new(
                Severity::Error,
                "unknown-plugin",
                Some(name.span),
                format!("there is no {} \"{}\"", self.noun(), name.value),
            );
            let names = self
                .plugins()
                .iter()
                .flat_map(|plugin| std::iter::once(&plugin.name).chain(plugin.aliases));
            diagnostic.help = did_you_mean(&name.value, names.copied()).or_else(|| {
                Some(format!(
                    "known: {}",
                    self.plugins()
                        .iter()
                        .map(|p| p.name)
                        .collect::<Vec<_>>()
                        .join(", ")
                ))
            });
            Box::new(diagnostic)
        })
    }
}

impl PluginSchema {
    /// Its parameters.
    pub fn params(&self) -> impl Iterator<Item = &'static ParamSchema> + use<> {
        self.groups.iter().flat_map(|group| group.iter())
    }

    /// The parameter of that canonical name.
    pub fn param(&self, name: &str) -> Option<&'static ParamSchema> {
        self.params().find(|param| param.name == name)
    }

    /// The parameter that a file means by that name, fallback names included. Of two parameters that share a name
    /// the one whose own name it is wins.
    pub fn param_called(&self, name: &str) -> Option<&'static ParamSchema> {
        self.param(name)
            .or_else(|| self.params().find(|param| param.fallbacks.contains(&name)))
    }

    /// Every name a file may use, fallback names included.
    pub fn param_names(&self) -> impl Iterator<Item = &'static str> + use<> {
        self.params().flat_map(ParamSchema::names)
    }
}

impl ParamSchema {
    /// Its name and then its fallback names.
    pub fn names(&'static self) -> impl Iterator<Item = &'static str> {
        std::iter::once(self.name).chain(self.fallbacks.iter().copied())
    }

    /// Whether a value of that class is read, for a plugin of that family.
    pub fn accepts(&self, class: ParamClass, family: Family) -> bool {
        self.types
            .iter()
            .any(|kind| kind.classes(family).contains(&class))
    }

    /// The choices, for an enumeration.
    pub fn choices(&self) -> &'static [&'static str] {
        match self.types {
            [Type::Choice(choices)] => choices,
            _ => &[],
        }
    }

    /// What it accepts, in words.
    pub fn type_words(&self, family: Family) -> String {
        self.types
            .iter()
            .map(|kind| kind.words(family))
            .collect::<Vec<_>>()
            .join(" or ")
    }
}

impl Type {
    /// The storage classes that are read, preferred first.
    pub fn classes(self, family: Family) -> &'static [ParamClass] {
        match self {
            Self::Bool => &[ParamClass::Bool],
            Self::Int | Self::IntChoice(_) | Self::Ints(_) => &[ParamClass::Integer],
            Self::Float | Self::Floats(_) => &[ParamClass::Float],
            Self::String | Self::File | Self::Choice(_) => &[ParamClass::String],
            Self::Point3 | Self::Point3s => &[ParamClass::Point3],
            Self::Vector3 | Self::Vector3s => &[ParamClass::Vector3],
            Self::Point2s => &[ParamClass::Point2],
            Self::Normals => &[ParamClass::Normal],
            Self::Spectrum => &[ParamClass::Spectrum],
            Self::FloatTexture => &[ParamClass::Texture, ParamClass::Float],
            Self::SpectrumTexture => &[ParamClass::Texture, ParamClass::Spectrum],
            Self::OwnTexture if family == Family::FloatTexture => {
                Self::FloatTexture.classes(family)
            }
            Self::OwnTexture => Self::SpectrumTexture.classes(family),
            Self::OwnConstant if family == Family::FloatTexture => Self::Float.classes(family),
            Self::OwnConstant => Self::Spectrum.classes(family),
        }
    }

    /// The type in words, e.g. `a spectrum (rgb, xyz, blackbody or spectrum)`.
    pub fn words(self, family: Family) -> &'static str {
        match self {
            Self::Bool => "a bool",
            Self::Int | Self::IntChoice(_) => "an integer",
            Self::Float => "a float",
            Self::String | Self::Choice(_) => "a string",
            Self::File => "a string (file name)",
            Self::Point3 => "a point3",
            Self::Vector3 => "a vector3",
            Self::Spectrum => "a spectrum (rgb, xyz, blackbody or spectrum)",
            Self::FloatTexture => "a float texture or a float",
            Self::SpectrumTexture => {
                "a spectrum texture or a spectrum (rgb, xyz, blackbody or spectrum)"
            }
            Self::OwnTexture if family == Family::FloatTexture => Self::FloatTexture.words(family),
            Self::OwnTexture => Self::SpectrumTexture.words(family),
            Self::OwnConstant if family == Family::FloatTexture => Self::Float.words(family),
            Self::OwnConstant => Self::Spectrum.words(family),
            Self::Ints(_) => "a list of integer",
            Self::Floats(_) => "a list of float",
            Self::Point2s => "a list of point2",
            Self::Point3s => "a list of point3",
            Self::Vector3s => "a list of vector3",
            Self::Normals => "a list of normal",
        }
    }

    /// Whether one value is asked for, not a list.
    pub fn is_single(self) -> bool {
        !matches!(
            self,
            Self::Ints(_)
                | Self::Floats(_)
                | Self::Point2s
                | Self::Point3s
                | Self::Vector3s
                | Self::Normals
        )
    }
}

impl Range {
    /// Whether a value makes sense. NaN never does.
    pub fn contains(&self, value: f64) -> bool {
        let above = if self.lo_open {
            value > self.lo
        } else {
            value >= self.lo
        };
        let below = if self.hi_open {
            value < self.hi
        } else {
            value <= self.hi
        };
        above && below
    }

    /// The nearest value that makes sense; `None` when there is none because that end is open.
    pub fn nearest(&self, value: f64) -> Option<f64> {
        if value <= self.lo {
            (!self.lo_open).then_some(self.lo)
        } else if value >= self.hi {
            (!self.hi_open).then_some(self.hi)
        } else {
            Some(value)
        }
    }
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (open, close) = (
            if self.lo_open { ">" } else { "≥" },
            if self.hi_open { "<" } else { "≤" },
        );
        match (self.lo == f64::NEG_INFINITY, self.hi == f64::INFINITY) {
            (true, true) => write!(f, "any number"),
            (false, true) => write!(f, "{open} {}", self.lo),
            (true, false) => write!(f, "{close} {}", self.hi),
            (false, false) => write!(f, "{open} {} and {close} {}", self.lo, self.hi),
        }
    }
}
