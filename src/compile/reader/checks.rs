//! Values that make no sense: reported where they stand, and what is used instead.

use super::{ParamReader, SpectrumValue};
use crate::describe::description::{TextureBinding, TextureType};
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::params::{Param, ParamValue};
use tyndall_parser::schema::{Default, ParamSchema, Type};
use tyndall_parser::source::Span;

impl ParamReader<'_> {
    /// The number if it makes sense, else the nearest that does, else `None`: the default holds.
    pub(super) fn in_range(
        &mut self,
        schema: &'static ParamSchema,
        value: f64,
        span: Span,
    ) -> Option<f64> {
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

    pub(super) fn sensible_spectrum(
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

    pub(super) fn report_not_finite(&mut self, schema: &'static ParamSchema, span: Span) {
        let message = format!("{} is not a finite number", schema.name);
        self.report(
            Diagnostic::error("not-finite", span, message)
                .with_label("the default is used instead"),
        );
    }

    /// Reports a number of values other than one. Texture-valued parameters use the first of several.
    pub(super) fn report_count(&mut self, schema: &'static ParamSchema, count: usize, span: Span) {
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

    pub(super) fn report_missing(&mut self, schema: &'static ParamSchema) {
        if schema.default == Default::Required {
            let family = self.plugin.family;
            let message = format!(
                "{} \"{}\" needs \"{}\"",
                family.noun(),
                self.plugin.schema.name,
                schema.name
            );
            let help = format!("{} is {}", schema.name, schema.type_words(family));
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

pub(super) fn unknown_texture(
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
