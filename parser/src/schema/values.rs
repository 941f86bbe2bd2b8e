//! How a written value relates to the types of the table.

use crate::params::{ParamClass, ParamValue};

/// The storage class of a value.
pub fn class_of(value: &ParamValue) -> ParamClass {
    match value {
        ParamValue::Integer(_) => ParamClass::Integer,
        ParamValue::Float(_) => ParamClass::Float,
        ParamValue::Bool(_) => ParamClass::Bool,
        ParamValue::String(_) => ParamClass::String,
        ParamValue::Texture(_) => ParamClass::Texture,
        ParamValue::Point2(_) => ParamClass::Point2,
        ParamValue::Vector2(_) => ParamClass::Vector2,
        ParamValue::Point3(_) => ParamClass::Point3,
        ParamValue::Vector3(_) => ParamClass::Vector3,
        ParamValue::Normal(_) => ParamClass::Normal,
        ParamValue::Rgb(_)
        | ParamValue::Xyz(_)
        | ParamValue::Blackbody(_)
        | ParamValue::Spectrum(_)
        | ParamValue::SpectrumFiles(_) => ParamClass::Spectrum,
    }
}

/// How many items a value holds: triples for a point list, one for sampled data however many samples it has.
pub fn count_of(value: &ParamValue) -> usize {
    match value {
        ParamValue::Integer(items) => items.len(),
        ParamValue::Float(items) => items.len(),
        ParamValue::Bool(items) => items.len(),
        ParamValue::String(items) | ParamValue::SpectrumFiles(items) => items.len(),
        ParamValue::Texture(_) => 1,
        ParamValue::Point2(items) | ParamValue::Vector2(items) | ParamValue::Blackbody(items) => {
            items.len()
        }
        ParamValue::Point3(items)
        | ParamValue::Vector3(items)
        | ParamValue::Normal(items)
        | ParamValue::Rgb(items)
        | ParamValue::Xyz(items) => items.len(),
        ParamValue::Spectrum(samples) => usize::from(!samples.is_empty()),
    }
}

/// The word a declaration uses for a value like this one.
pub fn type_word(value: &ParamValue) -> &'static str {
    match value {
        ParamValue::Integer(_) => "integer",
        ParamValue::Float(_) => "float",
        ParamValue::Bool(_) => "bool",
        ParamValue::String(_) => "string",
        ParamValue::Texture(_) => "texture",
        ParamValue::Point2(_) => "point2",
        ParamValue::Vector2(_) => "vector2",
        ParamValue::Point3(_) => "point3",
        ParamValue::Vector3(_) => "vector3",
        ParamValue::Normal(_) => "normal",
        ParamValue::Rgb(_) => "rgb",
        ParamValue::Xyz(_) => "xyz",
        ParamValue::Blackbody(_) => "blackbody",
        ParamValue::Spectrum(_) | ParamValue::SpectrumFiles(_) => "spectrum",
    }
}
