//! The parameters of each material.

mod disney;
mod hair;

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::{Default, PluginRef};
use tyndall_parser::source::Spanned;

use super::subsurface::DiffusionTables;
use crate::compile::reader::{ParamReader, Textured};
use crate::compile::textures::TextureBuilder;
use crate::compile::unsupported;
use crate::describe::description::{Entity, ShapeEntity};
use crate::material::{
    Glass, Material, Matte, Metal, Mirror, Model, Plastic, Roughness, Substrate, Translucent, Uber,
};
use crate::scatter::microfacet::MIN_ALPHA;
use crate::spectrum::{Rgb, copper};
use crate::texture::{FloatSource, SpectrumSource};

/// What stands in for a material that cannot be had.
pub(super) fn default_matte() -> Material {
    Material {
        model: Model::Matte(Matte {
            kd: SpectrumSource::Constant(Rgb::splat(0.5)),
            sigma: FloatSource::Constant(0.0),
        }),
        bump: None,
    }
}

/// Reads the parameters of one material and builds the textures they name.
pub(super) struct ModelReader<'p, 't, 'a> {
    pub(super) params: ParamReader<'p>,
    textures: &'t mut TextureBuilder<'a>,
    pub(super) diffusion: &'t mut DiffusionTables,
    /// Findings of textures, which come after those of the reader: it borrows the list.
    later: Diagnostics,
}

impl<'p, 't, 'a> ModelReader<'p, 't, 'a> {
    /// For a material as it stands, or as a shape overrides it.
    pub(super) fn new(
        plugin: PluginRef,
        entity: &'p Entity,
        shape: Option<&'p ShapeEntity>,
        textures: &'t mut TextureBuilder<'a>,
        diffusion: &'t mut DiffusionTables,
        diagnostics: &'p mut Diagnostics,
    ) -> Self {
        let overriding = shape.and_then(|s| Some((s, s.private_material.as_ref()?)));
        let params = match overriding {
            Some((shape, bindings)) => {
                ParamReader::overridden(plugin, entity, bindings, &shape.entity, diagnostics)
            }
            None => ParamReader::new(plugin, entity, diagnostics),
        };
        Self {
            params,
            textures,
            diffusion,
            later: Diagnostics::default(),
        }
    }

    /// The material called `name` in the schema.
    pub(super) fn material(mut self, name: &str) -> Material {
        let model = match name {
            "matte" => self.matte(),
            "plastic" => self.plastic(),
            "translucent" => self.translucent(),
            "glass" => self.glass(),
            "mirror" => Model::Mirror(Mirror {
                kr: self.spectrum("Kr"),
            }),
            "metal" => self.metal(),
            "substrate" => self.substrate(),
            "uber" => self.uber(),
            "subsurface" => self.subsurface(),
            "kdsubsurface" => self.kdsubsurface(),
            "hair" => self.hair(),
            "disney" => self.disney(),
            name => {
                let what = format!("the material \"{name}\"");
                let span = self.params.kind_span();
                let diagnostic = unsupported(&what, span, "\"matte\" is used");
                self.params.report(diagnostic);
                return default_matte();
            }
        };
        let bump = self.bump();
        self.finish();
        Material { model, bump }
    }

    /// The weight of the first part of a mixture.
    pub(super) fn amount(mut self) -> SpectrumSource {
        let amount = self.spectrum("amount");
        self.finish();
        amount
    }

    /// The file of a table, if one is named, and the bump map.
    pub(super) fn table_file(mut self) -> (Option<Spanned<String>>, Option<FloatSource>) {
        let file = self.params.file("bsdffile");
        let bump = self.bump();
        self.finish();
        (file, bump)
    }

    /// A matte that stands in for a part of a mixture. Parameters that it does not have are no concern of it.
    pub(super) fn standing_in(mut self) -> Material {
        Material {
            model: self.matte(),
            bump: None,
        }
    }

    fn finish(mut self) {
        for diagnostic in self.later.list {
            self.params.report(diagnostic);
        }
        self.params.finish();
    }

    fn matte(&mut self) -> Model {
        Model::Matte(Matte {
            kd: self.spectrum("Kd"),
            sigma: self.float("sigma"),
        })
    }

    fn plastic(&mut self) -> Model {
        Model::Plastic(Plastic {
            kd: self.spectrum("Kd"),
            ks: self.spectrum("Ks"),
            roughness: self.uniform_roughness(),
        })
    }

    fn translucent(&mut self) -> Model {
        Model::Translucent(Translucent {
            kd: self.spectrum("Kd"),
            ks: self.spectrum("Ks"),
            reflect: self.spectrum("reflect"),
            transmit: self.spectrum("transmit"),
            roughness: self.uniform_roughness(),
        })
    }

    fn glass(&mut self) -> Model {
        let eta = self.index_of_refraction();
        Model::Glass(self.dielectric(eta))
    }

    /// The boundary of a dielectric.
    pub(super) fn dielectric(&mut self, eta: FloatSource) -> Glass {
        let (u, v) = (self.float("uroughness"), self.float("vroughness"));
        let remap = self.params.bool("remaproughness");
        let is_smooth = u == FloatSource::Constant(0.0) && v == u;
        Glass {
            kr: self.spectrum("Kr"),
            kt: self.spectrum("Kt"),
            eta,
            roughness: if is_smooth {
                Roughness { u, v, remap }
            } else {
                self.roughness([u, v], &["uroughness", "vroughness"])
            },
        }
    }

    fn metal(&mut self) -> Model {
        let roughness = self.float("roughness");
        let u = self.float_or("uroughness", roughness);
        let v = self.float_or("vroughness", roughness);
        Model::Metal(Metal {
            eta: self.spectrum_or("eta", copper::eta()),
            k: self.spectrum_or("k", copper::k()),
            roughness: self.roughness([u, v], &["roughness", "uroughness", "vroughness"]),
        })
    }

    fn substrate(&mut self) -> Model {
        let (u, v) = (self.float("uroughness"), self.float("vroughness"));
        Model::Substrate(Substrate {
            kd: self.spectrum("Kd"),
            ks: self.spectrum("Ks"),
            roughness: self.roughness([u, v], &["uroughness", "vroughness"]),
        })
    }

    fn uber(&mut self) -> Model {
        let roughness = self.float("roughness");
        let u = self.float_or("uroughness", roughness);
        let v = self.float_or("vroughness", u);
        Model::Uber(Uber {
            kd: self.spectrum("Kd"),
            ks: self.spectrum("Ks"),
            kr: self.spectrum("Kr"),
            kt: self.spectrum("Kt"),
            opacity: self.spectrum("opacity"),
            roughness: self.roughness([u, v], &["roughness", "uroughness", "vroughness"]),
            eta: self.index_of_refraction(),
        })
    }
}

/// Inputs.
impl ModelReader<'_, '_, '_> {
    /// The default of the schema, for a texture that cannot be had.
    fn default(&self, name: &str) -> f32 {
        let schema = self.params.plugin().schema.param(name);
        match schema.map(|schema| schema.default) {
            Some(Default::Number(value)) => value,
            _ => 0.0,
        }
    }

    pub(super) fn spectrum(&mut self, name: &str) -> SpectrumSource {
        let default = self.default(name);
        let value = self.params.spectrum_texture(name);
        self.textures
            .spectrum_source(value, default, &mut self.later)
    }

    fn spectrum_or(&mut self, name: &str, default: Rgb) -> SpectrumSource {
        match self.params.spectrum_texture(name) {
            Textured::Default => SpectrumSource::Constant(default),
            value => self.textures.spectrum_source(value, 0.0, &mut self.later),
        }
    }

    fn float(&mut self, name: &str) -> FloatSource {
        let default = self.default(name);
        let value = self.params.float_texture(name);
        self.textures.float_source(value, default, &mut self.later)
    }

    fn float_or(&mut self, name: &str, default: FloatSource) -> FloatSource {
        match self.params.float_texture(name) {
            Textured::Default => default,
            value => self.textures.float_source(value, 0.0, &mut self.later),
        }
    }

    /// `"bumpmap"`, of materials that have one.
    fn bump(&mut self) -> Option<FloatSource> {
        self.params.plugin().schema.param("bumpmap")?;
        match self.float_or("bumpmap", FloatSource::Constant(0.0)) {
            FloatSource::Constant(0.0) => None,
            height => Some(height),
        }
    }

    /// `"eta"`. The reader judges a constant that is written; one that comes from a texture is judged here.
    fn index_of_refraction(&mut self) -> FloatSource {
        let eta = self.float("eta");
        if let FloatSource::Constant(index) = eta
            && !(index > 0.0)
        {
            let span = self.params.span("eta");
            let message = format!("an index of refraction of {index} is impossible");
            let default = self.default("eta");
            self.params.report(
                Diagnostic::error("bad-index", span, message)
                    .with_label(format!("{default} is used")),
            );
            return FloatSource::Constant(default);
        }
        eta
    }

    /// `"roughness"` along both axes.
    fn uniform_roughness(&mut self) -> Roughness {
        let roughness = self.float("roughness");
        self.roughness([roughness; 2], &["roughness"])
    }

    /// Roughness along u and v, and `"remaproughness"`. `names` are the parameters to blame for values that are
    /// clamped.
    fn roughness(&mut self, [u, v]: [FloatSource; 2], names: &[&str]) -> Roughness {
        let remap = self.params.bool("remaproughness");
        let least = [u, v].into_iter().filter_map(|source| match source {
            FloatSource::Constant(value) => Some(value),
            FloatSource::Texture(_) => None,
        });
        let least = least.fold(f32::INFINITY, f32::min);
        if !remap && least < MIN_ALPHA {
            let to_blame = names.iter().find(|name| self.params.is_given(name));
            let span = to_blame.map_or(self.params.kind_span(), |name| self.params.span(name));
            let message = format!("without remapping, {least} is less than {MIN_ALPHA}");
            self.params.report(
                Diagnostic::warning("clamped-roughness", span, message)
                    .with_label(format!("{MIN_ALPHA} is used instead")),
            );
        }
        Roughness { u, v, remap }
    }
}
