//! Parameter lists: typed values of the `"type name" value` pairs that follow a directive.

use crate::source::Span;

/// The value of one parameter, typed by its declaration. Aliases (`color`, `point`, `vector`) are already resolved.
///
/// Numbers follow pbrt-v3: an all-digit literal is an integer, anything else is read in single precision.
#[derive(Clone, PartialEq, Debug)]
pub enum ParamValue {
    /// `integer`, truncated toward zero.
    Integer(Vec<i32>),
    /// `float`.
    Float(Vec<f32>),
    /// `bool`.
    Bool(Vec<bool>),
    /// `string`.
    String(Vec<String>),
    /// `texture`: the name of a texture.
    Texture(String),
    /// `point2`.
    Point2(Vec<[f32; 2]>),
    /// `vector2`.
    Vector2(Vec<[f32; 2]>),
    /// `point3` or `point`.
    Point3(Vec<[f32; 3]>),
    /// `vector3` or `vector`.
    Vector3(Vec<[f32; 3]>),
    /// `normal`.
    Normal(Vec<[f32; 3]>),
    /// `rgb` or `color`: linear RGB.
    Rgb(Vec<[f32; 3]>),
    /// `xyz`: CIE XYZ.
    Xyz(Vec<[f32; 3]>),
    /// `blackbody`: temperature in kelvin and a scale.
    Blackbody(Vec<[f32; 2]>),
    /// `spectrum` given as numbers: (wavelength in nm, value) pairs of one spectrum.
    Spectrum(Vec<[f32; 2]>),
    /// `spectrum` given as strings: one file name for each spectrum.
    SpectrumFiles(Vec<String>),
}

/// Storage classes of pbrt-v3: a later parameter replaces an earlier one of the same name *and class*.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum ParamClass {
    /// `integer`
    Integer,
    /// `float`
    Float,
    /// `bool`
    Bool,
    /// `string`
    String,
    /// `texture`
    Texture,
    /// `point2`
    Point2,
    /// `vector2`
    Vector2,
    /// `point3`, `point`
    Point3,
    /// `vector3`, `vector`
    Vector3,
    /// `normal`
    Normal,
    /// `rgb`, `color`, `xyz`, `blackbody`, `spectrum`
    Spectrum,
}

/// One parameter as written.
#[derive(Clone, PartialEq, Debug)]
pub struct Param {
    /// Name without the type.
    pub name: String,
    /// Typed value.
    pub value: ParamValue,
    /// The quoted `"type name"` string.
    pub decl_span: Span,
    /// The value, brackets included.
    pub value_span: Span,
}

/// The parameters of one directive in file order, with the duplicates of pbrt-v3 resolved (the later one wins).
#[derive(Clone, PartialEq, Debug, Default)]
pub struct ParamList {
    /// Parameters in file order.
    pub params: Vec<Param>,
}
