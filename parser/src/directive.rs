//! Directives: what the file says, one variant for each keyword of pbrt-v3.

use crate::params::ParamList;
use crate::source::Spanned;

/// Which of the two transforms later transform directives change.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ActiveTransform {
    /// Both.
    All,
    /// The one at the start of the motion.
    StartTime,
    /// The one at the end of the motion.
    EndTime,
}

/// A directive that names a plugin and carries parameters.
#[derive(Clone, PartialEq, Debug)]
pub struct Plugin {
    /// Plugin name, e.g. `sphere`; the material, medium or light name where the directive takes one.
    pub name: Spanned<String>,
    /// Its parameters.
    pub params: ParamList,
}

/// One directive of a scene file. `Include` never appears: it acts on the token stream.
///
/// Matrices are as written: sixteen numbers in column-major order. Angles are in degrees.
#[derive(Clone, PartialEq, Debug)]
pub enum Directive {
    /// `Identity`
    Identity,
    /// `Translate x y z`
    Translate([f64; 3]),
    /// `Scale x y z`
    Scale([f64; 3]),
    /// `Rotate angle x y z`
    Rotate {
        /// Angle in degrees.
        degrees: f64,
        /// Axis, not normalised.
        axis: [f64; 3],
    },
    /// `LookAt eye target up`
    LookAt {
        /// Eye point.
        eye: [f64; 3],
        /// Point looked at.
        target: [f64; 3],
        /// Up direction.
        up: [f64; 3],
    },
    /// `Transform [ m ]`
    Transform([f64; 16]),
    /// `ConcatTransform [ m ]`
    ConcatTransform([f64; 16]),
    /// `CoordinateSystem "name"`
    CoordinateSystem(Spanned<String>),
    /// `CoordSysTransform "name"`
    CoordSysTransform(Spanned<String>),
    /// `ActiveTransform All|StartTime|EndTime`
    ActiveTransform(ActiveTransform),
    /// `TransformTimes start end`
    TransformTimes([f64; 2]),
    /// `PixelFilter "name" …`
    PixelFilter(Plugin),
    /// `Film "name" …`
    Film(Plugin),
    /// `Sampler "name" …`
    Sampler(Plugin),
    /// `Accelerator "name" …`
    Accelerator(Plugin),
    /// `Integrator "name" …`
    Integrator(Plugin),
    /// `Camera "name" …`
    Camera(Plugin),
    /// `MakeNamedMedium "name" …`: `name` is the medium's name, its type is the parameter `string type`.
    MakeNamedMedium(Plugin),
    /// `MediumInterface "inside" ["outside"]`
    MediumInterface {
        /// Medium inside; `""` is vacuum.
        inside: Spanned<String>,
        /// Medium outside; `None` when the directive has one argument (it then stands for both sides).
        outside: Option<Spanned<String>>,
    },
    /// `WorldBegin`
    WorldBegin,
    /// `WorldEnd`
    WorldEnd,
    /// `AttributeBegin`
    AttributeBegin,
    /// `AttributeEnd`
    AttributeEnd,
    /// `TransformBegin`
    TransformBegin,
    /// `TransformEnd`
    TransformEnd,
    /// `Texture "name" "type" "class" …`
    Texture {
        /// Texture name.
        name: Spanned<String>,
        /// Value type as written: `float`, `spectrum` or `color`; anything else is kept for the diagnostic.
        value_type: Spanned<String>,
        /// Texture class and its parameters.
        class: Plugin,
    },
    /// `Material "name" …`
    Material(Plugin),
    /// `MakeNamedMaterial "name" …`: `name` is the material's name, its type is the parameter `string type`.
    MakeNamedMaterial(Plugin),
    /// `NamedMaterial "name"` (parameters are accepted and reported as unused)
    NamedMaterial(Plugin),
    /// `LightSource "name" …`
    LightSource(Plugin),
    /// `AreaLightSource "name" …`
    AreaLightSource(Plugin),
    /// `Shape "name" …`
    Shape(Plugin),
    /// `ReverseOrientation`
    ReverseOrientation,
    /// `ObjectBegin "name"`
    ObjectBegin(Spanned<String>),
    /// `ObjectEnd`
    ObjectEnd,
    /// `ObjectInstance "name"`
    ObjectInstance(Spanned<String>),
}

/// The directives of a scene in execution order, includes already spliced in.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct SceneFile {
    /// Each directive with the span from its keyword to the end of its last argument in the keyword's file.
    pub directives: Vec<Spanned<Directive>>,
}

/// A directive taken apart in the way it is written: keyword, then strings, numbers and parameters in this order.
#[derive(Clone, PartialEq, Debug)]
pub struct Parts<'a> {
    /// The keyword.
    pub keyword: &'static str,
    /// The argument without quotes that `ActiveTransform` has.
    pub word: Option<&'static str>,
    /// Quoted arguments.
    pub strings: Vec<&'a Spanned<String>>,
    /// Numeric arguments.
    pub numbers: Vec<f64>,
    /// The parameter list, for directives that take one.
    pub params: Option<&'a ParamList>,
}

impl ActiveTransform {
    /// The word of the scene file.
    pub fn word(self) -> &'static str {
        match self {
            Self::All => "All",
            Self::StartTime => "StartTime",
            Self::EndTime => "EndTime",
        }
    }
}

impl<'a> Parts<'a> {
    fn bare(keyword: &'static str) -> Self {
        Self {
            keyword,
            word: None,
            strings: Vec::new(),
            numbers: Vec::new(),
            params: None,
        }
    }

    fn numbers(keyword: &'static str, numbers: &[f64]) -> Self {
        Self {
            numbers: numbers.to_vec(),
            ..Self::bare(keyword)
        }
    }

    fn string(keyword: &'static str, string: &'a Spanned<String>) -> Self {
        Self {
            strings: vec![string],
            ..Self::bare(keyword)
        }
    }

    fn plugin(keyword: &'static str, plugin: &'a Plugin) -> Self {
        Self {
            params: Some(&plugin.params),
            ..Self::string(keyword, &plugin.name)
        }
    }
}

impl Directive {
    /// The keyword it is written with.
    pub fn keyword(&self) -> &'static str {
        match self {
            Self::Identity => "Identity",
            Self::Translate(_) => "Translate",
            Self::Scale(_) => "Scale",
            Self::Rotate { .. } => "Rotate",
            Self::LookAt { .. } => "LookAt",
            Self::Transform(_) => "Transform",
            Self::ConcatTransform(_) => "ConcatTransform",
            Self::CoordinateSystem(_) => "CoordinateSystem",
            Self::CoordSysTransform(_) => "CoordSysTransform",
            Self::ActiveTransform(_) => "ActiveTransform",
            Self::TransformTimes(_) => "TransformTimes",
            Self::PixelFilter(_) => "PixelFilter",
            Self::Film(_) => "Film",
            Self::Sampler(_) => "Sampler",
            Self::Accelerator(_) => "Accelerator",
            Self::Integrator(_) => "Integrator",
            Self::Camera(_) => "Camera",
            Self::MakeNamedMedium(_) => "MakeNamedMedium",
            Self::MediumInterface { .. } => "MediumInterface",
            Self::WorldBegin => "WorldBegin",
            Self::WorldEnd => "WorldEnd",
            Self::AttributeBegin => "AttributeBegin",
            Self::AttributeEnd => "AttributeEnd",
            Self::TransformBegin => "TransformBegin",
            Self::TransformEnd => "TransformEnd",
            Self::Texture { .. } => "Texture",
            Self::Material(_) => "Material",
            Self::MakeNamedMaterial(_) => "MakeNamedMaterial",
            Self::NamedMaterial(_) => "NamedMaterial",
            Self::LightSource(_) => "LightSource",
            Self::AreaLightSource(_) => "AreaLightSource",
            Self::Shape(_) => "Shape",
            Self::ReverseOrientation => "ReverseOrientation",
            Self::ObjectBegin(_) => "ObjectBegin",
            Self::ObjectEnd => "ObjectEnd",
            Self::ObjectInstance(_) => "ObjectInstance",
        }
    }

    /// Keyword and arguments in the order they are written.
    pub fn parts(&self) -> Parts<'_> {
        let keyword = self.keyword();
        match self {
            Self::Identity => Parts::bare(keyword),
            Self::Translate(numbers) => Parts::numbers(keyword, numbers),
            Self::Scale(numbers) => Parts::numbers(keyword, numbers),
            Self::Rotate {
                degrees,
                axis: [x, y, z],
            } => Parts::numbers(keyword, &[*degrees, *x, *y, *z]),
            Self::LookAt { eye, target, up } => {
                Parts::numbers(keyword, [*eye, *target, *up].as_flattened())
            }
            Self::Transform(matrix) => Parts::numbers(keyword, matrix),
            Self::ConcatTransform(matrix) => Parts::numbers(keyword, matrix),
            Self::CoordinateSystem(name) => Parts::string(keyword, name),
            Self::CoordSysTransform(name) => Parts::string(keyword, name),
            Self::ActiveTransform(which) => Parts {
                word: Some(which.word()),
                ..Parts::bare(keyword)
            },
            Self::TransformTimes(numbers) => Parts::numbers(keyword, numbers),
            Self::PixelFilter(plugin) => Parts::plugin(keyword, plugin),
            Self::Film(plugin) => Parts::plugin(keyword, plugin),
            Self::Sampler(plugin) => Parts::plugin(keyword, plugin),
            Self::Accelerator(plugin) => Parts::plugin(keyword, plugin),
            Self::Integrator(plugin) => Parts::plugin(keyword, plugin),
            Self::Camera(plugin) => Parts::plugin(keyword, plugin),
            Self::MakeNamedMedium(plugin) => Parts::plugin(keyword, plugin),
            Self::MediumInterface { inside, outside } => {
                let strings = std::iter::once(inside).chain(outside).collect();
                Parts {
                    strings,
                    ..Parts::bare(keyword)
                }
            }
            Self::WorldBegin => Parts::bare(keyword),
            Self::WorldEnd => Parts::bare(keyword),
            Self::AttributeBegin => Parts::bare(keyword),
            Self::AttributeEnd => Parts::bare(keyword),
            Self::TransformBegin => Parts::bare(keyword),
            Self::TransformEnd => Parts::bare(keyword),
            Self::Texture {
                name,
                value_type,
                class,
            } => Parts {
                strings: vec![name, value_type, &class.name],
                ..Parts::plugin(keyword, class)
            },
            Self::Material(plugin) => Parts::plugin(keyword, plugin),
            Self::MakeNamedMaterial(plugin) => Parts::plugin(keyword, plugin),
            Self::NamedMaterial(plugin) => Parts::plugin(keyword, plugin),
            Self::LightSource(plugin) => Parts::plugin(keyword, plugin),
            Self::AreaLightSource(plugin) => Parts::plugin(keyword, plugin),
            Self::Shape(plugin) => Parts::plugin(keyword, plugin),
            Self::ReverseOrientation => Parts::bare(keyword),
            Self::ObjectBegin(name) => Parts::string(keyword, name),
            Self::ObjectEnd => Parts::bare(keyword),
            Self::ObjectInstance(name) => Parts::string(keyword, name),
        }
    }

    /// Whether both say the same, wherever they stand; NaN equals NaN here.
    pub fn says_the_same(&self, other: &Self) -> bool {
        let (ours, theirs) = (self.parts(), other.parts());
        let same_number =
            |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
        ours.keyword == theirs.keyword
            && ours.word == theirs.word
            && ours
                .strings
                .iter()
                .map(|string| &string.value)
                .eq(theirs.strings.iter().map(|string| &string.value))
            && ours.numbers.len() == theirs.numbers.len()
            && ours.numbers.iter().zip(&theirs.numbers).all(same_number)
            && match (ours.params, theirs.params) {
                (Some(ours), Some(theirs)) => ours.says_the_same(theirs),
                (ours, theirs) => ours.is_none() && theirs.is_none(),
            }
    }
}

impl SceneFile {
    /// Whether both have the same directives in the same order, wherever they stand; NaN equals NaN here.
    pub fn says_the_same(&self, other: &Self) -> bool {
        let pairs = self.directives.iter().zip(&other.directives);
        self.directives.len() == other.directives.len()
            && pairs
                .into_iter()
                .all(|(a, b)| a.value.says_the_same(&b.value))
    }
}
