//! The first of the values of a parameter, if it has the type asked for.

use super::SpectrumValue;
use tyndall_parser::params::ParamValue;
use tyndall_parser::schema::{Default, ParamSchema};

pub(super) fn spectrum_default(schema: &ParamSchema) -> Option<SpectrumValue> {
    match schema.default {
        Default::Number(value) => Some(SpectrumValue::Rgb([value; 3])),
        Default::Rgb(rgb) => Some(SpectrumValue::Rgb(rgb)),
        _ => None,
    }
}

/// How many values a parameter has: tuples count as one, and so does sampled data unless it has no sample.
pub(super) fn count_of(value: &ParamValue) -> usize {
    match value {
        ParamValue::Spectrum(samples) if samples.is_empty() => 0,
        _ => value.len(),
    }
}

pub(super) fn first_float(value: &ParamValue) -> Option<f32> {
    match value {
        ParamValue::Float(items) => items.first().copied(),
        _ => None,
    }
}

pub(super) fn first_int(value: &ParamValue) -> Option<i32> {
    match value {
        ParamValue::Integer(items) => items.first().copied(),
        _ => None,
    }
}

pub(super) fn first_bool(value: &ParamValue) -> Option<bool> {
    match value {
        ParamValue::Bool(items) => items.first().copied(),
        _ => None,
    }
}

pub(super) fn first_string(value: &ParamValue) -> Option<String> {
    match value {
        ParamValue::String(items) => items.first().cloned(),
        _ => None,
    }
}

pub(super) fn first_triple(value: &ParamValue) -> Option<[f32; 3]> {
    match value {
        ParamValue::Point3(items) | ParamValue::Vector3(items) => items.first().copied(),
        _ => None,
    }
}

pub(super) fn first_spectrum(value: &ParamValue) -> Option<SpectrumValue> {
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
