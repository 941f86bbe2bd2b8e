//! Directives: what the file says, one variant for each keyword of pbrt-v3.

use crate::params::ParamList;
use crate::source::{Span, Spanned};

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

impl<T> Spanned<T> {
    /// Pairs a value with its place.
    pub fn new(value: T, span: Span) -> Self {
        Self { value, span }
    }
}
