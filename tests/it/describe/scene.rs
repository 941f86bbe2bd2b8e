//! Scenes built by hand. Directive number i stands at bytes 100 i .. 100 i + 99; its name at 100 i + 10, its
//! parameters at 100 i + 20, 22, …, each with its value one byte later.

use glam::{DMat4, DVec3};
use tyndall::describe::describe;
use tyndall::describe::description::{Frame, SceneDescription};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::directive::{Directive, Plugin, SceneFile};
use tyndall_parser::params::{Param, ParamList, ParamValue};
use tyndall_parser::source::{FileId, Span, Spanned};

fn at(lo: usize) -> Span {
    Span {
        file: FileId(0),
        lo: lo as u32,
        hi: lo as u32 + 1,
    }
}

/// A name, to be located by [`run`].
pub(crate) fn name(text: &str) -> Spanned<String> {
    Spanned::new(text.to_owned(), at(0))
}

/// A plugin, to be located by [`run`].
pub(crate) fn plugin(text: &str, params: impl IntoIterator<Item = Param>) -> Plugin {
    Plugin {
        name: name(text),
        params: ParamList {
            params: params.into_iter().collect(),
        },
    }
}

fn param(name: &str, value: ParamValue) -> Param {
    Param {
        name: name.to_owned(),
        value,
        decl_span: at(0),
        value_span: at(0),
    }
}

pub(crate) fn float(name: &str, value: f32) -> Param {
    floats(name, &[value])
}

pub(crate) fn floats(name: &str, values: &[f32]) -> Param {
    param(name, ParamValue::Float(values.to_vec()))
}

pub(crate) fn int(name: &str, value: i32) -> Param {
    param(name, ParamValue::Integer(vec![value]))
}

pub(crate) fn bool(name: &str, value: bool) -> Param {
    param(name, ParamValue::Bool(vec![value]))
}

pub(crate) fn string(name: &str, value: &str) -> Param {
    param(name, ParamValue::String(vec![value.to_owned()]))
}

pub(crate) fn rgb(name: &str, grey: f32) -> Param {
    param(name, ParamValue::Rgb(vec![[grey; 3]]))
}

pub(crate) fn points(name: &str, count: usize) -> Param {
    param(name, ParamValue::Point3(vec![[0.0; 3]; count]))
}

pub(crate) fn texture_param(name: &str, texture: &str) -> Param {
    param(name, ParamValue::Texture(texture.to_owned()))
}

pub(crate) fn texture(
    text: &str,
    value_type: &str,
    class: &str,
    params: impl IntoIterator<Item = Param>,
) -> Directive {
    Directive::Texture {
        name: name(text),
        value_type: name(value_type),
        class: plugin(class, params),
    }
}

pub(crate) fn make_material(name: &str, params: impl IntoIterator<Item = Param>) -> Directive {
    Directive::MakeNamedMaterial(plugin(name, params))
}

pub(crate) fn make_medium(name: &str, params: impl IntoIterator<Item = Param>) -> Directive {
    Directive::MakeNamedMedium(plugin(name, params))
}

pub(crate) fn media(inside: &str, outside: &str) -> Directive {
    Directive::MediumInterface {
        inside: name(inside),
        outside: Some(name(outside)),
    }
}

pub(crate) fn sphere() -> Directive {
    Directive::Shape(plugin("sphere", []))
}

/// The directives between `WorldBegin` and `WorldEnd`; `WorldBegin` is number 0.
pub(crate) fn world(directives: impl IntoIterator<Item = Directive>) -> Vec<Directive> {
    let end = [Directive::WorldBegin, Directive::WorldEnd].map(Some);
    let [begin, end] = end;
    begin.into_iter().chain(directives).chain(end).collect()
}

fn locate(plugin: &mut Plugin, base: usize) {
    plugin.name.span = at(base + 10);
    for (i, param) in plugin.params.params.iter_mut().enumerate() {
        param.decl_span = at(base + 20 + 2 * i);
        param.value_span = at(base + 21 + 2 * i);
    }
}

fn locate_directive(directive: &mut Directive, base: usize) {
    match directive {
        Directive::PixelFilter(plugin)
        | Directive::Film(plugin)
        | Directive::Sampler(plugin)
        | Directive::Accelerator(plugin)
        | Directive::Integrator(plugin)
        | Directive::Camera(plugin)
        | Directive::MakeNamedMedium(plugin)
        | Directive::Material(plugin)
        | Directive::MakeNamedMaterial(plugin)
        | Directive::NamedMaterial(plugin)
        | Directive::LightSource(plugin)
        | Directive::AreaLightSource(plugin)
        | Directive::Shape(plugin) => locate(plugin, base),
        Directive::Texture {
            name,
            value_type,
            class,
        } => {
            locate(class, base);
            name.span = at(base + 10);
            value_type.span = at(base + 12);
            class.name.span = at(base + 14);
        }
        Directive::MediumInterface { inside, outside } => {
            inside.span = at(base + 10);
            if let Some(outside) = outside {
                outside.span = at(base + 12);
            }
        }
        Directive::CoordinateSystem(name)
        | Directive::CoordSysTransform(name)
        | Directive::ObjectBegin(name)
        | Directive::ObjectInstance(name) => name.span = at(base + 10),
        _ => {}
    }
}

/// Describes the directives.
pub(crate) fn run(directives: Vec<Directive>) -> (SceneDescription, Diagnostics) {
    let mut file = SceneFile::default();
    for (i, mut directive) in directives.into_iter().enumerate() {
        let base = 100 * i;
        locate_directive(&mut directive, base);
        let span = Span {
            file: FileId(0),
            lo: base as u32,
            hi: base as u32 + 99,
        };
        file.directives.push(Spanned::new(directive, span));
    }
    describe(file)
}

/// Describes directives that make one frame without any finding.
pub(crate) fn frame(directives: Vec<Directive>) -> Frame {
    let (mut description, diagnostics) = run(directives);
    assert_eq!(diagnostics.list, []);
    assert_eq!(description.frames.len(), 1);
    description.frames.remove(0)
}

/// The codes of all findings.
pub(crate) fn codes(diagnostics: &Diagnostics) -> Vec<&'static str> {
    diagnostics
        .list
        .iter()
        .map(|finding| finding.code)
        .collect()
}

/// The only finding, which has that code.
pub(crate) fn only<'a>(diagnostics: &'a Diagnostics, code: &str) -> &'a Diagnostic {
    assert_eq!(codes(diagnostics), [code]);
    &diagnostics.list[0]
}

/// Where a transform puts a point.
pub(crate) fn point_at(matrix: DMat4, p: [f64; 3]) -> [f64; 3] {
    matrix.transform_point3(DVec3::from_array(p)).to_array()
}
