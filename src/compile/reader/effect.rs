//! Parameters that have no effect, and why.

use super::ParamReader;
use super::values::count_of;
use tyndall_parser::diagnostic::{Diagnostic, MAX_PER_KIND};
use tyndall_parser::params::{Param, ParamClass, ParamList, ParamValue};
use tyndall_parser::schema::{self, Family, ParamSchema, PluginRef};

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
        let mut n_unknown = 0;
        let findings = list.params.iter().filter_map(|param| {
            // What was meant is asked of every name there is: not for more than anybody reads.
            let suggests = n_unknown < MAX_PER_KIND;
            let found = without_effect(param, list, plugins, suggests)?;
            n_unknown += 1;
            Some(found)
        });
        self.diagnostics.extend(findings);
    }
}

/// Why a parameter of a list has no effect on any of the plugins; `None` when it has one.
fn without_effect(
    param: &Param,
    list: &ParamList,
    plugins: &[PluginRef],
    suggests: bool,
) -> Option<Diagnostic> {
    let class = param.value.class();
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
        let warning = warning(message).with_label(format!("{} is {expected}", param.name));
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
    if suggests {
        unknown.help = schema::did_you_mean(&param.name, names);
    }
    Some(unknown)
}

/// Whether `other` is read instead of `param`, which is a value of the same parameter.
fn wins_over(other: &Param, param: &Param, schema: &ParamSchema, family: Family) -> bool {
    let class = other.value.class();
    let takes_one = schema
        .types
        .iter()
        .all(|kind| kind.is_single() && !kind.classes(family).contains(&ParamClass::Texture));
    if !schema.accepts(class, family) || (takes_one && count_of(&other.value) != 1) {
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
        && param.value.class() != ParamClass::Texture;
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
    format!("\"{} {}\"", param.value.param_type().word(), param.name)
}

fn quoted(plugins: &[PluginRef]) -> String {
    let names = plugins
        .iter()
        .map(|plugin| format!("{} \"{}\"", plugin.family.noun(), plugin.schema.name));
    names.collect::<Vec<_>>().join(" and ")
}
