//! The Disney material.

use super::ModelReader;
use crate::material::disney::Interior;
use crate::material::{Disney, Model};

impl ModelReader<'_, '_, '_> {
    pub(super) fn disney(&mut self) -> Model {
        let interior = if self.params.bool("thin") {
            Interior::Thin(self.float("flatness"), self.float("difftrans"))
        } else {
            Interior::Solid(
                self.spectrum("scatterdistance"),
                self.diffusion.scale() as f32,
            )
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
}
