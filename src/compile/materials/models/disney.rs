//! The Disney material.

use super::ModelReader;
use crate::compile::unsupported;
use crate::material::disney::Interior;
use crate::material::{Disney, Model};
use crate::spectrum::Rgb;
use crate::texture::SpectrumSource;

impl ModelReader<'_, '_, '_> {
    pub(super) fn disney(&mut self) -> Model {
        let interior = if self.params.bool("thin") {
            Interior::Thin(self.float("flatness"), self.float("difftrans"))
        } else {
            Interior::Solid(self.scatter_distance())
        };
        Model::Disney(Disney {
            color: self.spectrum("color"),
            metallic: self.float("metallic"),
            eta: self.index_of_refraction(),
            roughness: self.float("roughness"),
            specular_tint: self.float("speculartint"),
            anisotropic: self.float("anisotropic"),
            sheen: self.float("sheen"),
            sheen_tint: self.float("sheentint"),
            clearcoat: self.float("clearcoat"),
            clearcoat_gloss: self.float("clearcoatgloss"),
            specular_transmission: self.float("spectrans"),
            interior,
        })
    }

    fn scatter_distance(&mut self) -> SpectrumSource {
        let black = SpectrumSource::Constant(Rgb::BLACK);
        if self.spectrum("scatterdistance") != black {
            let span = self.params.span("scatterdistance");
            let what = "\"scatterdistance\"";
            let diagnostic = unsupported(what, span, "the surface is diffuse");
            self.params.report(diagnostic);
        }
        black
    }
}
