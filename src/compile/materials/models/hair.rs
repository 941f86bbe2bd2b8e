//! The hair material: which of its three ways to say what it absorbs counts.

use tyndall_parser::diagnostic::Diagnostic;

use super::ModelReader;
use crate::compile::reader::Textured;
use crate::material::hair::Pigment;
use crate::material::{Hair, Model};
use crate::texture::FloatSource;

/// Eumelanin where nothing is said about what a fibre absorbs: brown.
const BROWN: f32 = 1.3;

impl ModelReader<'_, '_, '_> {
    pub(super) fn hair(&mut self) -> Model {
        Model::Hair(Hair {
            pigment: self.pigment(),
            eta: self.index_of_refraction(),
            beta_m: self.float("beta_m"),
            beta_n: self.float("beta_n"),
            alpha: self.float("alpha"),
        })
    }

    fn pigment(&mut self) -> Pigment {
        let given = |value: &Textured<_>| *value != Textured::Default;
        let sigma_a = self.params.spectrum_texture("sigma_a");
        if given(&sigma_a) {
            self.without_effect(&["color", "eumelanin", "pheomelanin"], "sigma_a");
            let (textures, later) = (&mut self.textures, &mut self.later);
            return Pigment::Absorption(textures.spectrum_source(sigma_a, 0.0, later));
        }
        let color = self.params.spectrum_texture("color");
        if given(&color) {
            self.without_effect(&["eumelanin", "pheomelanin"], "color");
            let (textures, later) = (&mut self.textures, &mut self.later);
            return Pigment::Color(textures.spectrum_source(color, 0.5, later));
        }
        let none = FloatSource::Constant(0.0);
        let is_read = |name: &&str| self.params.is_given(name);
        if !["eumelanin", "pheomelanin"].iter().any(is_read) {
            return Pigment::Melanin(FloatSource::Constant(BROWN), none);
        }
        Pigment::Melanin(
            self.float_or("eumelanin", none),
            self.float_or("pheomelanin", none),
        )
    }

    fn without_effect(&mut self, losers: &[&str], winner: &str) {
        for name in losers {
            if self.params.is_given(name) {
                let message = format!("\"{name}\" has no effect beside \"{winner}\"");
                let diagnostic =
                    Diagnostic::warning("unused-parameter", self.params.span(name), message)
                        .with_note(self.params.span(winner), "this one is used");
                self.params.report(diagnostic);
            }
        }
    }
}
