//! Materials, built when a shape uses them.

mod hair;

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::Family;

use crate::compile::reader::ParamReader;
use crate::compile::textures::TextureBuilder;
use crate::compile::{lookup, unsupported};
use crate::describe::description::{Frame, MaterialEntity, MaterialRef, ShapeEntity};
use crate::ids::MaterialId;
use crate::material::{Glass, Material, Materials, Matte, Mirror, Model};
use crate::spectrum::Rgb;
use crate::texture::{FloatSource, SpectrumSource};

/// The materials of a frame on their way into the world.
pub(super) struct MaterialBuilder {
    entities: Vec<MaterialEntity>,
    /// `None` until a shape uses it as it is.
    ids: Vec<Option<MaterialId>>,
    built: Vec<Material>,
}

impl MaterialBuilder {
    pub(super) fn new(frame: &mut Frame) -> Self {
        let entities = std::mem::take(&mut frame.materials);
        let ids = vec![None; entities.len()];
        Self {
            entities,
            ids,
            built: Vec::new(),
        }
    }

    /// The id of a shape's material; `NONE` for the null material.
    pub(super) fn id(
        &mut self,
        shape: &ShapeEntity,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> MaterialId {
        let MaterialRef(index) = shape.material;
        let index = index as usize;
        if shape.private_material.is_some() {
            // The shape overrides parameters: a material of its own. The shared one is still read once, so that
            // what is wrong with it is reported once.
            self.shared(index, textures, diagnostics);
            let mut silent = Diagnostics::default();
            return self.build(index, Some(shape), textures, &mut silent);
        }
        self.shared(index, textures, diagnostics)
    }

    fn shared(
        &mut self,
        index: usize,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> MaterialId {
        if let Some(id) = self.ids[index] {
            return id;
        }
        let id = self.build(index, None, textures, diagnostics);
        self.ids[index] = Some(id);
        id
    }

    pub(super) fn skipped(&self) -> usize {
        self.ids.iter().filter(|id| id.is_none()).count()
    }

    pub(super) fn finish(self) -> Materials {
        Materials { list: self.built }
    }

    fn build(
        &mut self,
        index: usize,
        shape: Option<&ShapeEntity>,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> MaterialId {
        let entity = &self.entities[index].entity;
        let model = match entity.kind.value.as_str() {
            "" | "none" => return MaterialId::NONE,
            _ => model(entity, shape, textures, diagnostics),
        };
        self.built.push(Material { model });
        MaterialId::new(self.built.len() - 1)
    }
}

fn model(
    entity: &crate::describe::description::Entity,
    shape: Option<&ShapeEntity>,
    textures: &mut TextureBuilder,
    diagnostics: &mut Diagnostics,
) -> Model {
    const INSTEAD: &str = "\"matte\" is used";
    let default_matte = Model::Matte(Matte {
        kd: SpectrumSource::Constant(Rgb::splat(0.5)),
        sigma: FloatSource::Constant(0.0),
    });
    let Some(plugin) = lookup(Family::Material, &entity.kind, INSTEAD, diagnostics) else {
        return default_matte;
    };
    // Findings of texture look-ups come after those of the reader, which borrows the list.
    let mut later = Diagnostics::default();
    let mut p = match shape.and_then(|s| s.private_material.as_ref().map(|t| (s, t))) {
        Some((shape, bindings)) => {
            ParamReader::overridden(plugin, entity, bindings, &shape.entity, diagnostics)
        }
        None => ParamReader::new(plugin, entity, diagnostics),
    };
    let model = match plugin.schema.name {
        "matte" => Model::Matte(Matte {
            kd: textures.spectrum_source(p.spectrum_texture("Kd"), 0.5, &mut later),
            sigma: textures.float_source(p.float_texture("sigma"), 0.0, &mut later),
        }),
        "mirror" => Model::Mirror(Mirror {
            kr: textures.spectrum_source(p.spectrum_texture("Kr"), 0.9, &mut later),
        }),
        "glass" => glass(&mut p, textures, &mut later),
        "hair" => hair::read(&mut p, textures, &mut later),
        name => {
            let what = format!("the material \"{name}\"");
            p.report(unsupported(&what, entity.kind.span, INSTEAD));
            default_matte
        }
    };
    if matches!(plugin.schema.name, "matte" | "mirror" | "glass") && p.is_given("bumpmap") {
        let span = p.span("bumpmap");
        p.report(unsupported("\"bumpmap\"", span, "the surface stays smooth"));
    }
    p.finish();
    for diagnostic in later.list {
        diagnostics.push(diagnostic);
    }
    model
}

fn glass(p: &mut ParamReader, textures: &mut TextureBuilder, later: &mut Diagnostics) -> Model {
    for name in ["uroughness", "vroughness"] {
        let value = p.float_texture(name);
        if textures.float_source(value, 0.0, later) != FloatSource::Constant(0.0) {
            let span = p.span(name);
            p.report(unsupported("rough glass", span, "smooth glass is used"));
        }
    }
    let mut eta = textures.float_source(p.float_texture("eta"), 1.5, later);
    if let FloatSource::Constant(index) = eta
        && !(index > 0.0)
    {
        let span = p.span("eta");
        let message = format!("an index of refraction of {index} is impossible");
        p.report(Diagnostic::error("bad-index", span, message).with_label("1.5 is used"));
        eta = FloatSource::Constant(1.5);
    }
    Model::Glass(Glass {
        kr: textures.spectrum_source(p.spectrum_texture("Kr"), 1.0, later),
        kt: textures.spectrum_source(p.spectrum_texture("Kt"), 1.0, later),
        eta,
    })
}
