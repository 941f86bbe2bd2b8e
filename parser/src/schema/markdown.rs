//! The reference of the scene format, written from the table.

use super::{Count, DIRECTIVES, Default, Family, ParamSchema, PluginSchema, Type};
use std::fmt::Write;

const INTRODUCTION: &str = "\
# Scene format

Generated from the table in `parser/src/schema/`; do not edit by hand
(`UPDATE_EXPECT=1 cargo test --test it format_doc::` writes it anew).

The language is pbrt-v3's.
A parameter is written `\"type name\" value`; a single value needs no brackets.

- *spectrum* stands for `rgb` (alias `color`, linear), `xyz`, `blackbody` (kelvin, scale) or `spectrum` (wavelengths in nm and values, or a file name).
- *float texture* and *spectrum texture* stand for `texture` with the name of one, or for a constant `float` or spectrum.
- A parameter that takes one value is only found when exactly one is given; otherwise its default holds, with a warning.
- A parameter of a type that is not in the table has no effect, with a warning.
- A parameter with fallback names reads those when its own name is absent.
- *required* means that nothing is made without it; `-` means that the feature is not used when it is absent.
";

/// The reference of the scene format, as Markdown.
pub fn markdown() -> String {
    let mut out = String::from(INTRODUCTION);
    directives(&mut out);
    for family in Family::ALL {
        // The classes of float textures are those of spectrum textures but for a few, which say so.
        if family != Family::FloatTexture {
            section(&mut out, family);
        }
    }
    out
}

fn directives(out: &mut String) {
    out.push_str("\n## Directives\n\n");
    out.push_str("CTM is the pair of current transforms, one for each end of the motion.\n\n");
    out.push_str("| Directive | Arguments | Options | World | Effect |\n|---|---|:-:|:-:|---|\n");
    for entry in DIRECTIVES {
        let mark = |allowed: bool| if allowed { "yes" } else { "-" };
        let arguments = if entry.arguments.is_empty() {
            String::new()
        } else {
            code(entry.arguments)
        };
        line(
            out,
            &[
                &code(entry.keyword),
                &arguments,
                mark(entry.in_options),
                mark(entry.in_world),
                entry.meaning,
            ],
        );
    }
}

fn section(out: &mut String, family: Family) {
    let title = match family {
        Family::SpectrumTexture | Family::FloatTexture => "Texture classes",
        Family::Camera => "Cameras",
        Family::Film => "Films",
        Family::Filter => "Filters",
        Family::Sampler => "Samplers",
        Family::Accelerator => "Accelerators",
        Family::Integrator => "Integrators",
        Family::Shape => "Shapes",
        Family::Material => "Materials",
        Family::Light => "Lights",
        Family::AreaLight => "Area lights",
        Family::Medium => "Media",
    };
    out.push_str(&format!("\n## {title}\n"));
    for plugin in family.plugins() {
        plugin_page(out, family, plugin);
    }
}

fn plugin_page(out: &mut String, family: Family, plugin: &PluginSchema) {
    out.push_str(&format!("\n### `{}`\n\n{}\n", plugin.name, plugin.meaning));
    if !plugin.aliases.is_empty() {
        let names: Vec<_> = plugin
            .aliases
            .iter()
            .map(|alias| format!("`\"{alias}\"`"))
            .collect();
        out.push_str(&format!("Also called {}.\n", names.join(", ")));
    }
    if family == Family::SpectrumTexture && Family::FloatTexture.find(plugin.name).is_none() {
        out.push_str("Only for spectrum textures.\n");
    }
    if plugin.params().next().is_none() {
        return;
    }
    out.push_str(
        "\n| Parameter | Type | Default | Unit | Range | Meaning |\n|---|---|---|---|---|---|\n",
    );
    for param in plugin.params() {
        let range = param
            .range
            .map(|range| range.to_string())
            .unwrap_or_default();
        line(
            out,
            &[
                &name(param),
                &types(param),
                &default(param),
                param.unit,
                &range,
                param.meaning,
            ],
        );
    }
}

fn name(param: &ParamSchema) -> String {
    let mut text = code(param.name);
    for fallback in param.fallbacks {
        let _ = write!(text, " (or {})", code(fallback));
    }
    text
}

fn types(param: &ParamSchema) -> String {
    let one = |kind: &Type| match kind {
        Type::Choice(choices) => choices
            .iter()
            .filter(|choice| !choice.is_empty())
            .map(|choice| code(choice))
            .collect::<Vec<_>>()
            .join(", "),
        Type::IntChoice(choices) => {
            format!(
                "integer: {}",
                choices
                    .iter()
                    .map(i32::to_string)
                    .collect::<Vec<_>>()
                    .join(", ")
            )
        }
        Type::Ints(Count::Exactly(n)) => format!("{n} integer"),
        Type::Floats(Count::Exactly(n)) => format!("{n} float"),
        Type::Spectrum => "spectrum".into(),
        Type::FloatTexture => "float texture".into(),
        Type::SpectrumTexture => "spectrum texture".into(),
        Type::OwnTexture => "texture of its own type".into(),
        Type::OwnConstant => "float or spectrum, its own type".into(),
        other => {
            let words = other.words(Family::SpectrumTexture);
            words
                .split_once(' ')
                .map_or(words, |(_article, rest)| rest)
                .into()
        }
    };
    param.types.iter().map(one).collect::<Vec<_>>().join(" or ")
}

fn default(param: &ParamSchema) -> String {
    let triple = |v: [f32; 3]| format!("({}, {}, {})", v[0], v[1], v[2]);
    match param.default {
        Default::Required => "*required*".into(),
        Default::Absent => "-".into(),
        Default::Bool(value) => value.to_string(),
        Default::Int(value) => value.to_string(),
        Default::Number(f32::INFINITY) => "∞".into(),
        Default::Number(value) if value.abs() >= 1e6 => format!("{value:e}"),
        Default::Number(value) => value.to_string(),
        Default::Rgb(rgb) | Default::Triple(rgb) => triple(rgb),
        Default::Text("") => "none".into(),
        Default::Text(value) => code(value),
        Default::Formula(words) => words.into(),
    }
}

fn code(text: &str) -> String {
    format!("`{text}`")
}

fn line(out: &mut String, cells: &[&str]) {
    for cell in cells {
        let _ = write!(out, "| {} ", cell.replace('|', "\\|"));
    }
    out.push_str("|\n");
}
