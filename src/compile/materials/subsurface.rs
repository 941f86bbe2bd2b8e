//! The materials that let light in: coefficients in units of render space, and one table of profiles for each pair of
//! index and anisotropy.

use std::collections::HashMap;

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};

use crate::compile::materials::glass;
use crate::compile::reader::ParamReader;
use crate::compile::textures::TextureBuilder;
use crate::ids::DiffusionTableId;
use crate::material::{KdSubsurface, Subsurface};
use crate::medium::presets::preset;
use crate::scatter::diffusion::DiffusionTable;
use crate::spectrum::Rgb;
use crate::texture::{FloatSource, SpectrumSource};

/// The tables on their way into the world.
pub(super) struct DiffusionTables {
    ids: HashMap<[u32; 2], DiffusionTableId>,
    built: Vec<DiffusionTable>,
    /// Length in render space of one world unit.
    scale: f64,
}

impl DiffusionTables {
    pub(super) fn new(scale: f64) -> Self {
        Self {
            ids: HashMap::new(),
            built: Vec::new(),
            scale,
        }
    }

    pub(super) fn finish(self) -> Vec<DiffusionTable> {
        self.built
    }

    fn id(&mut self, g: f32, eta: f32) -> DiffusionTableId {
        *self
            .ids
            .entry([g.to_bits(), eta.to_bits()])
            .or_insert_with(|| {
                self.built
                    .push(DiffusionTable::new(f64::from(g), f64::from(eta)));
                DiffusionTableId::new(self.built.len() - 1)
            })
    }

    pub(super) fn subsurface(
        &mut self,
        p: &mut ParamReader,
        textures: &mut TextureBuilder,
        later: &mut Diagnostics,
    ) -> Subsurface {
        let preset = preset(p.choice("name"));
        let eta = p.float("eta");
        // The coefficients of a preset are reduced: they stand for isotropic scattering.
        let g = p.float("g");
        let g = if preset.is_some() { 0.0 } else { g };
        let scale = f64::from(p.float("scale")) / self.scale;
        let mut coefficient = |name: &str, of_preset: Option<Rgb>, p: &mut ParamReader| {
            let given = p.is_given(name);
            let value = p.spectrum_texture(name);
            match of_preset {
                Some(rgb) if !given => SpectrumSource::Constant(rgb),
                _ => textures.spectrum_source(value, 0.0, later),
            }
        };
        let sigma_a = coefficient("sigma_a", preset.map(|preset| preset.sigma_a), p);
        let sigma_s = coefficient("sigma_s", preset.map(|preset| preset.sigma_s), p);
        let black = |source: SpectrumSource| match source {
            SpectrumSource::Constant(value) => value.clamp_negative().is_black(),
            SpectrumSource::Texture(_) => false,
        };
        if scale == 0.0 || black(sigma_s) || g.abs() == 1.0 {
            nothing_comes_back(p);
        }
        Subsurface {
            boundary: glass(p, FloatSource::Constant(eta), textures, later),
            sigma_a,
            sigma_s,
            scale: (scale as f32).min(f32::MAX),
            eta,
            table: self.id(g, eta),
        }
    }

    pub(super) fn kdsubsurface(
        &mut self,
        p: &mut ParamReader,
        textures: &mut TextureBuilder,
        later: &mut Diagnostics,
    ) -> KdSubsurface {
        let eta = p.float("eta");
        let g = p.float("g");
        let scale = f64::from(p.float("scale")) * self.scale;
        let kd = textures.spectrum_source(p.spectrum_texture("Kd"), 0.5, later);
        let mfp = textures.spectrum_source(p.spectrum_texture("mfp"), 1.0, later);
        if g.abs() == 1.0 {
            nothing_comes_back(p);
        }
        KdSubsurface {
            boundary: glass(p, FloatSource::Constant(eta), textures, later),
            kd,
            mfp,
            scale: (scale as f32).min(f32::MAX),
            eta,
            table: self.id(g, eta),
        }
    }
}

/// Warns of a medium that swallows what enters.
fn nothing_comes_back(p: &mut ParamReader) {
    let message = "nothing scatters light back out of this material: its inside is black";
    let span = p.kind_span();
    p.report(Diagnostic::warning("black-subsurface", span, message));
}
