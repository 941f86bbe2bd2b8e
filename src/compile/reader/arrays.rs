//! Arrays: moved out of the list where the reader may, copied otherwise.

use super::{Access, ParamReader, Source};
use std::mem::take;
use tyndall_parser::diagnostic::Diagnostic;
use tyndall_parser::params::{ParamClass, ParamValue};
use tyndall_parser::schema::{Count, ParamSchema, Type};
use tyndall_parser::source::Span;

/// `None` stands for an absent or empty list; a missing required one is reported. Values are not looked at.
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
