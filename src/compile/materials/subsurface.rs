//! The materials that let light in: coefficients in units of render space, and one table of profiles for each pair of
//! index and anisotropy.

use std::collections::HashMap;

use tyndall_parser::diagnostic::Diagnostic;

use super::models::ModelReader;
use crate::ids::DiffusionTableId;
use crate::material::{Glass, KdSubsurface, Model, Subsurface};
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

    /// Length in render space of one world unit.
    pub(super) fn scale(&self) -> f64 {
        self.scale
    }

    pub(super) fn finish(self) -> Vec<DiffusionTable> {
        self.built
    }

    fn id(&mut self, g: f32, eta: f32) -> DiffusionTableId {
        *self
            .ids
            .entry([g.to_bits(), eta.to_bits()])
            .or_insert_with(|| {
                let table = DiffusionTable::new(f64::from(g), f64::from(eta));
                self.built.push(table);
                DiffusionTableId::new(self.built.len() - 1)
            })
    }
}

impl ModelReader<'_, '_, '_> {
    pub(super) fn subsurface(&mut self) -> Model {
        let preset = preset(self.params.choice("name"));
        let eta = self.params.float("eta");
        // The coefficients of a preset are reduced: they stand for isotropic scattering.
        let g = self.params.float("g");
        let g = if preset.is_some() { 0.0 } else { g };
        let scale = f64::from(self.params.float("scale")) / self.diffusion.scale;
        let sigma_a = self.coefficient("sigma_a", preset.map(|preset| preset.sigma_a));
        let sigma_s = self.coefficient("sigma_s", preset.map(|preset| preset.sigma_s));
        let black = |source: SpectrumSource| match source {
            SpectrumSource::Constant(value) => value.clamp_negative().is_black(),
            SpectrumSource::Texture(_) => false,
        };
        if scale == 0.0 || black(sigma_s) || g.abs() == 1.0 {
            self.warn_that_nothing_comes_back();
        }
        Model::Subsurface(Subsurface {
            boundary: self.boundary(eta),
            sigma_a,
            sigma_s,
            scale: (scale as f32).min(f32::MAX),
            eta,
            table: self.diffusion.id(g, eta),
        })
    }

    pub(super) fn kdsubsurface(&mut self) -> Model {
        let (eta, g) = (self.params.float("eta"), self.params.float("g"));
        let scale = f64::from(self.params.float("scale")) * self.diffusion.scale;
        let (kd, mfp) = (self.spectrum("Kd"), self.spectrum("mfp"));
        if g.abs() == 1.0 {
            self.warn_that_nothing_comes_back();
        }
        Model::KdSubsurface(KdSubsurface {
            boundary: self.boundary(eta),
            kd,
            mfp,
            scale: (scale as f32).min(f32::MAX),
            eta,
            table: self.diffusion.id(g, eta),
        })
    }

    fn coefficient(&mut self, name: &str, of_preset: Option<Rgb>) -> SpectrumSource {
        let given = self.params.is_given(name);
        match of_preset {
            Some(rgb) if !given => SpectrumSource::Constant(rgb),
            _ => self.spectrum(name),
        }
    }

    fn boundary(&mut self, eta: f32) -> Glass {
        self.dielectric(FloatSource::Constant(eta))
    }

    fn warn_that_nothing_comes_back(&mut self) {
        let message = "nothing scatters light back out of this material: its inside is black";
        let span = self.params.kind_span();
        let diagnostic = Diagnostic::warning("black-subsurface", span, message);
        self.params.report(diagnostic);
    }
}
