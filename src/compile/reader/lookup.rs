//! From a name to what the schema says of it and to what the lists hold under it.

use super::values::count_of;
use super::{ParamReader, Source};
use crate::describe::description::TextureBinding;
use tyndall_parser::params::{Param, ParamClass, ParamValue};
use tyndall_parser::schema::{Default, ParamSchema, Type};
use tyndall_parser::source::Spanned;

impl ParamReader<'_> {
    pub(super) fn schema(&self, name: &str) -> &'static ParamSchema {
        self.plugin.schema.param(name).unwrap_or_else(|| {
            panic!(
                "the schema of {} has no parameter {name}",
                self.plugin.schema.name
            )
        })
    }

    pub(super) fn typed(&self, name: &str, fits: impl Fn(Type) -> bool) -> &'static ParamSchema {
        let schema = self.schema(name);
        if !schema.types.iter().any(|kind| fits(*kind)) {
            self.wrong_question(name, "this getter");
        }
        schema
    }

    pub(super) fn wrong_question(&self, name: &str, getter: &str) -> ! {
        panic!(
            "{getter} does not suit the schema of {} {name}",
            self.plugin.schema.name
        )
    }

    pub(super) fn number_default(&self, name: &str) -> f32 {
        match self.schema(name).default {
            Default::Number(default) => default,
            _ => self.wrong_question(name, "float"),
        }
    }

    pub(super) fn find(
        &self,
        source: Source,
        name: &str,
        class: ParamClass,
    ) -> Option<(usize, &Param)> {
        let list = match source {
            Source::Shape => &self.shape?.params,
            Source::Own => self.params.list(),
        };
        list.params
            .iter()
            .enumerate()
            .find(|(_, param)| param.name == name && param.value.class() == class)
    }

    pub(super) fn bindings(&self, source: Source) -> &[TextureBinding] {
        match (source, self.shape) {
            (Source::Shape, Some(shape)) => &shape.textures,
            _ => self.textures,
        }
    }

    /// The parameter in any type that is read, in the order of the types, names and lists.
    pub(super) fn given(&self, schema: &'static ParamSchema) -> Option<&Param> {
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
    pub(super) fn single_if_given<T>(
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
                let (count, span) = (count_of(&param.value), param.value_span);
                if count == 1 {
                    return first(&param.value).map(|value| Spanned::new(value, span));
                }
                self.report_count(schema, count, span);
            }
        }
        None
    }

    /// The same, and a missing required one is reported.
    pub(super) fn single<T>(
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
