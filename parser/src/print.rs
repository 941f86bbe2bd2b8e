//! Directives to canonical pbrt-v3 text. Parsing the text gives the same directives again.
//!
//! One directive a line, indented by its block; each parameter on a line of its own; values in brackets; numbers with
//! the fewest digits that read back as the same value. Comments are not directives and are not kept. Includes are
//! already spliced in.

use std::fmt::{self, Display, Write};

use crate::directive::{Directive, SceneFile};
use crate::params::{Param, ParamValue};

/// Columns after which a long list of values goes on in the next line.
const WIDTH: usize = 100;
/// Spaces for each block and for parameters under their directive.
const INDENT: usize = 4;
/// Deepest block that is still indented further: files may nest without end.
const MAX_INDENT: usize = 20 * INDENT;

/// The canonical text of a scene.
///
/// It reads back as the same scene if the scene came from a parser. A directive made by hand can hold what no text
/// says: a negative integer or a coordinate that is no `f32`, an empty list of strings, a name with a space in it.
pub fn print(scene: &SceneFile) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write(scene, &mut text);
    text
}

/// Writes the canonical text of a scene; fails only if `out` does.
pub fn write(scene: &SceneFile, out: &mut impl Write) -> fmt::Result {
    let mut depth = 0_usize;
    for directive in &scene.directives {
        let (opens, closes) = blocks(&directive.value);
        depth = depth.saturating_sub(closes);
        write_directive(
            &directive.value,
            depth.saturating_mul(INDENT).min(MAX_INDENT),
            out,
        )?;
        out.write_char('\n')?;
        depth += opens;
    }
    Ok(())
}

impl Display for Directive {
    /// The canonical text without a line end behind it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_directive(self, 0, f)
    }
}

/// How many blocks a directive opens and closes.
fn blocks(directive: &Directive) -> (usize, usize) {
    match directive {
        Directive::WorldBegin
        | Directive::AttributeBegin
        | Directive::TransformBegin
        | Directive::ObjectBegin(_) => (1, 0),
        Directive::WorldEnd
        | Directive::AttributeEnd
        | Directive::TransformEnd
        | Directive::ObjectEnd => (0, 1),
        _ => (0, 0),
    }
}

fn write_directive(directive: &Directive, indent: usize, out: &mut impl Write) -> fmt::Result {
    let parts = directive.parts();
    write!(out, "{:indent$}{}", "", parts.keyword)?;
    if let Some(word) = parts.word {
        write!(out, " {word}")?;
    }
    for string in &parts.strings {
        write!(out, " {}", Quoted(&string.value))?;
    }
    let is_matrix = matches!(
        directive,
        Directive::Transform(_) | Directive::ConcatTransform(_)
    );
    out.write_str(if is_matrix { " [" } else { "" })?;
    for (i, number) in parts.numbers.iter().enumerate() {
        let gap = if is_matrix && i == 0 { "" } else { " " };
        write!(out, "{gap}{}", Double(*number))?;
    }
    out.write_str(if is_matrix { "]" } else { "" })?;
    for param in parts.params.into_iter().flatten() {
        out.write_char('\n')?;
        write_param(param, indent + INDENT, out)?;
    }
    Ok(())
}

fn write_param(param: &Param, indent: usize, out: &mut impl Write) -> fmt::Result {
    let declaration = format!("{} {}", param.value.param_type().word(), param.name);
    write!(out, "{:indent$}{} [", "", Quoted(&declaration))?;
    let mut line = Line {
        out,
        indent: indent + INDENT,
        used: indent + declaration.len() + 4,
        is_empty: true,
    };
    match &param.value {
        ParamValue::Integer(values) => line.items(values.iter())?,
        ParamValue::Bool(values) => line.items(
            values
                .iter()
                .map(|value| Quoted(if *value { "true" } else { "false" })),
        )?,
        ParamValue::String(values) | ParamValue::SpectrumFiles(values) => {
            line.items(values.iter().map(|value| Quoted(value)))?;
        }
        ParamValue::Texture(name) => line.items([Quoted(name)])?,
        numeric => line.items(
            numeric
                .numbers()
                .unwrap_or_default()
                .iter()
                .map(|value| Single(*value)),
        )?,
    }
    out.write_char(']')
}

/// A list of values broken into lines.
struct Line<'a, W> {
    out: &'a mut W,
    indent: usize,
    used: usize,
    is_empty: bool,
}

impl<W: Write> Line<'_, W> {
    fn items(&mut self, items: impl IntoIterator<Item = impl Display>) -> fmt::Result {
        let mut text = String::new();
        for item in items {
            text.clear();
            write!(text, "{item}")?;
            if !self.is_empty && self.used + 1 + text.len() > WIDTH {
                write!(self.out, "\n{:indent$}", "", indent = self.indent)?;
                self.used = self.indent;
            } else if !self.is_empty {
                self.out.write_char(' ')?;
                self.used += 1;
            }
            self.out.write_str(&text)?;
            self.used += text.len();
            self.is_empty = false;
        }
        Ok(())
    }
}

/// A string with quotes and escapes.
struct Quoted<'a>(&'a str);

impl Display for Quoted<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_char('"')?;
        for c in self.0.chars() {
            match c {
                '\u{8}' => f.write_str("\\b")?,
                '\u{c}' => f.write_str("\\f")?,
                '\n' => f.write_str("\\n")?,
                '\r' => f.write_str("\\r")?,
                '\t' => f.write_str("\\t")?,
                '\\' | '"' => write!(f, "\\{c}")?,
                _ => f.write_char(c)?,
            }
        }
        f.write_char('"')
    }
}

/// A number in single precision: the shortest text that reads back as itself.
struct Single(f32);

impl Display for Single {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(x) = *self;
        if x.is_nan() || x.is_infinite() {
            // Two characters at least, and C's spelling.
            let word = if x.is_nan() { "nan" } else { "inf" };
            return write!(f, "{}{word}", if x.is_sign_negative() { "-" } else { "" });
        }
        // Digits alone are read as an integer, which is exact far beyond 1e15.
        let size = x.abs();
        if size == 0.0 || (1e-4..1e15).contains(&size) {
            write!(f, "{x}")
        } else {
            write!(f, "{x:e}")
        }
    }
}

/// A number argument of a directive: an integer, or a real of single precision.
struct Double(f64);

impl Display for Double {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self(x) = *self;
        // Digits alone are read as an integer, so all of them have to be there and right.
        let is_integer = (0.0..1e15).contains(&x) && x.is_sign_positive() && x.fract() == 0.0;
        let single = x as f32;
        if !is_integer && (f64::from(single).to_bits() == x.to_bits() || x.is_nan()) {
            Single(single).fmt(f)
        } else {
            write!(f, "{x}")
        }
    }
}
