//! The hair material: which of its three ways to say what it absorbs counts.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};

use crate::compile::reader::{ParamReader, Textured};
use crate::compile::textures::TextureBuilder;
use crate::material::hair::Pigment;
use crate::material::{Hair, Model};
use crate::texture::FloatSource;

/// Eumelanin where nothing is said about what a fibre absorbs: brown.
const BROWN: f32 = 1.3;

pub(super) fn read(
    p: &mut ParamReader,
    textures: &mut TextureBuilder,
    later: &mut Diagnostics,
) -> Model {
    let pigment = pigment(p, textures, later);
    let mut float =
        |name: &str, default: f32| textures.float_source(p.float_texture(name), default, later);
    Model::Hair(Hair {
        pigment,
        eta: float("eta", 1.55),
        beta_m: float("beta_m", 0.3),
        beta_n: float("beta_n", 0.3),
        alpha: float("alpha", 2.0),
    })
}

fn pigment(p: &mut ParamReader, textures: &mut TextureBuilder, later: &mut Diagnostics) -> Pigment {
    let sigma_a = p.spectrum_texture("sigma_a");
    if sigma_a != Textured::Default {
        without_effect(p, &["color", "eumelanin", "pheomelanin"], "sigma_a");
        return Pigment::Absorption(textures.spectrum_source(sigma_a, 0.0, later));
    }
    let color = p.spectrum_texture("color");
    if color != Textured::Default {
        without_effect(p, &["eumelanin", "pheomelanin"], "color");
        return Pigment::Color(textures.spectrum_source(color, 0.5, later));
    }
    let (eumelanin, pheomelanin) = (p.float_texture("eumelanin"), p.float_texture("pheomelanin"));
    if (&eumelanin, &pheomelanin) == (&Textured::Default, &Textured::Default) {
        return Pigment::Melanin(FloatSource::Constant(BROWN), FloatSource::Constant(0.0));
    }
    Pigment::Melanin(
        textures.float_source(eumelanin, 0.0, later),
        textures.float_source(pheomelanin, 0.0, later),
    )
}

fn without_effect(p: &mut ParamReader, losers: &[&str], winner: &str) {
    for name in losers
        .iter()
        .filter(|name| p.is_given(name))
        .collect::<Vec<_>>()
    {
        let message = format!("\"{name}\" has no effect beside \"{winner}\"");
        let diagnostic = Diagnostic::warning("unused-parameter", p.span(name), message);
        p.report(diagnostic.with_note(p.span(winner), "this one is used"));
    }
}
