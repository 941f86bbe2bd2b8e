//! Named media, built when something refers to them.

use glam::{DAffine3, DVec3};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::schema::Family;

use crate::compile::assets::{Assets, lack_of_memory};
use crate::compile::reader::ParamReader;
use crate::compile::space::{self, RenderSpace};
use crate::compile::{lookup, spectra};
use crate::describe::description::{Frame, MediumEntity, MediumRef};
use crate::ids::MediumId;
use crate::math::Transform;

use crate::medium::grid::MAX_VOXELS;
use crate::medium::presets::preset;
use crate::medium::{DensityGrid, GridMedium, Homogeneous, Medium};
use crate::scatter::HenyeyGreenstein;
use crate::spectrum::Rgb;

/// Memory that a value of a grid takes beside the parameter: in the lattice, and its part of the bounds.
const BYTES_PER_VOXEL: u128 = 5;

/// The media of a frame on their way into the world.
pub(super) struct Media<'a> {
    entities: Vec<Option<MediumEntity>>,
    names: Vec<String>,
    /// `None` until something refers to it.
    ids: Vec<Option<MediumId>>,
    built: Vec<Medium>,
    space: RenderSpace,
    assets: &'a dyn Assets,
    /// Whether the integrator heeds media at all.
    needed: bool,
    /// Something refers to a medium, which is not needed.
    is_ignored: bool,
}

impl<'a> Media<'a> {
    pub(super) fn new(
        frame: &mut Frame,
        space: &RenderSpace,
        assets: &'a dyn Assets,
        needed: bool,
    ) -> Self {
        let entities = std::mem::take(&mut frame.media);
        let names = entities.iter().map(|m| m.name.value.clone()).collect();
        let entities: Vec<_> = entities.into_iter().map(Some).collect();
        let ids = vec![None; entities.len()];
        Self {
            entities,
            names,
            ids,
            built: Vec::new(),
            space: *space,
            assets,
            needed,
            is_ignored: false,
        }
    }

    /// The id of a medium, which is built on first use. `NONE` if it holds nothing, or cannot be built.
    pub(super) fn id(&mut self, medium: MediumRef, diagnostics: &mut Diagnostics) -> MediumId {
        let index = medium.0 as usize;
        if !self.needed {
            self.is_ignored = true;
            return MediumId::NONE;
        }
        if let Some(id) = self.ids[index] {
            return id;
        }
        let built = self.entities[index]
            .take()
            .and_then(|e| self.build(e, diagnostics));
        let id = match built {
            Some(medium) if !medium.is_empty() => {
                self.built.push(medium);
                MediumId::new(self.built.len() - 1)
            }
            _ => MediumId::NONE,
        };
        self.ids[index] = Some(id);
        id
    }

    /// Whether there are media that the integrator does not heed.
    pub(super) fn is_ignored(&self) -> bool {
        self.is_ignored
    }

    /// Names of those that nothing has led to.
    pub(super) fn skipped(&self) -> Vec<String> {
        let skipped = self.names.iter().zip(&self.ids);
        let skipped = skipped.filter(|(_, id)| id.is_none());
        skipped.map(|(name, _)| name.clone()).collect()
    }

    /// The media and their names.
    pub(super) fn finish(self) -> (Vec<Medium>, Vec<String>) {
        let mut names = vec![String::new(); self.built.len()];
        for (name, id) in self.names.into_iter().zip(self.ids) {
            if let Some(id) = id.filter(|id| id.is_some()) {
                names[id.index()] = name;
            }
        }
        (self.built, names)
    }

    fn build(&self, mut medium: MediumEntity, diagnostics: &mut Diagnostics) -> Option<Medium> {
        let plugin = lookup(
            Family::Medium,
            &medium.entity.kind,
            "vacuum is used",
            diagnostics,
        )?;
        let pair = medium.world_from_medium;
        let directive = medium.entity.span;
        let world_from_medium = space::transform(pair.start, directive, diagnostics)?;
        let coefficients = self.coefficients(plugin, &medium, diagnostics);
        let mut p = ParamReader::taking(plugin, &mut medium.entity, diagnostics);
        let g = p.float("g");
        let phase = HenyeyGreenstein {
            g: g.clamp(-1.0, 1.0),
        };
        let (sigma_a, sigma_s) = coefficients;
        if plugin.schema.name == "homogeneous" {
            p.finish();
            return Some(Medium::Homogeneous(Homogeneous::new(
                sigma_a, sigma_s, phase,
            )));
        }
        let n = [p.int("nx"), p.int("ny"), p.int("nz")];
        let (p0, p1) = (p.point3("p0"), p.point3("p1"));
        let density_span = p.span("density");
        let density = p.take_floats("density").unwrap_or_default();
        p.finish();
        let n = n.map(|n| usize::try_from(n).unwrap_or(0));
        let count = n.iter().try_fold(1usize, |count, &n| count.checked_mul(n));
        if count != Some(density.len()) || density.is_empty() {
            let message = format!(
                "a grid of {} x {} x {} needs {} densities, not {}",
                n[0],
                n[1],
                n[2],
                count.map_or_else(|| "too many".to_owned(), |count| count.to_string()),
                density.len()
            );
            diagnostics.push(
                Diagnostic::error("density-count", density_span, message)
                    .with_label("vacuum is used"),
            );
            return None;
        }
        if n.into_iter().any(|n| n > MAX_VOXELS) {
            let message = format!("a grid has at most {MAX_VOXELS} values along an axis");
            diagnostics.push(
                Diagnostic::error("grid-too-long", density_span, message)
                    .with_label("vacuum is used"),
            );
            return None;
        }
        // The lattice has a border of its own, which counts where a grid is thin; bounds of its cells are few.
        let n_padded: u128 = n.iter().map(|&n| n as u128 + 2).product();
        if let Some(lack) = lack_of_memory(n_padded * BYTES_PER_VOXEL, self.assets) {
            let message = format!("a grid of {} x {} x {} {lack}", n[0], n[1], n[2]);
            diagnostics.push(
                Diagnostic::error("too-large", density_span, message).with_label("vacuum is used"),
            );
            return None;
        }
        let density = repair(density, density_span, diagnostics)?;
        let [p0, p1] = [p0, p1].map(|p| DVec3::from(p.map(f64::from)));
        let medium_from_unit =
            Transform::from_affine(DAffine3::from_translation(p0) * DAffine3::from_scale(p1 - p0));
        let Some(medium_from_unit) = medium_from_unit else {
            let message = "the box from \"p0\" to \"p1\" has no volume";
            diagnostics.push(
                Diagnostic::error("empty-grid", directive, message).with_label("vacuum is used"),
            );
            return None;
        };
        let render_from_unit = self
            .space
            .place(&world_from_medium.compose(&medium_from_unit));
        Some(Medium::Grid(Box::new(GridMedium::new(
            DensityGrid::new(n, &density),
            &render_from_unit.inverse(),
            sigma_a,
            sigma_s,
            phase,
        ))))
    }

    /// Absorption and scattering per unit of render space: explicit ones before those of a preset.
    fn coefficients(
        &self,
        plugin: tyndall_parser::schema::PluginRef,
        medium: &MediumEntity,
        diagnostics: &mut Diagnostics,
    ) -> (Rgb, Rgb) {
        let mut p = ParamReader::new(plugin, &medium.entity, diagnostics);
        let preset = preset(p.choice("preset"));
        let values = [p.spectrum("sigma_a"), p.spectrum("sigma_s")];
        let given = [p.is_given("sigma_a"), p.is_given("sigma_s")];
        let scale = p.float("scale") as f64 / self.space.scale();
        let of_preset = preset.map(|preset| [preset.sigma_a, preset.sigma_s]);
        let [sigma_a, sigma_s] = [0, 1].map(|k| {
            let rgb = match of_preset {
                Some(preset) if !given[k] => preset[k],
                _ => spectra::to_rgb(&values[k], self.assets, diagnostics),
            };
            let scaled = rgb.map(|c| (c as f64 * scale) as f32);
            if scaled.has_negative() || !scaled.is_finite() {
                let what = ["absorption", "scattering"][k];
                let message =
                    format!("the {what} coefficient of a medium must be finite and not negative");
                diagnostics.push(
                    Diagnostic::error("bad-medium", values[k].span, message)
                        .with_label("such channels count as 0"),
                );
            }
            // Half the range, so that the sum of the two is finite as well.
            scaled.map(|c| {
                if c.is_finite() {
                    c.clamp(0.0, 0.5 * f32::MAX)
                } else {
                    0.0
                }
            })
        });
        (sigma_a, sigma_s)
    }
}

/// Infinite densities are refused; NaN and negative ones become 0, with one warning.
fn repair(
    mut density: Vec<f32>,
    span: tyndall_parser::source::Span,
    diagnostics: &mut Diagnostics,
) -> Option<Vec<f32>> {
    if density.contains(&f32::INFINITY) {
        let message = "a density is infinite: no light could ever pass";
        diagnostics.push(
            Diagnostic::error("infinite-density", span, message).with_label("vacuum is used"),
        );
        return None;
    }
    let mut n_bad = 0;
    for d in density.iter_mut().filter(|d| !(**d >= 0.0)) {
        *d = 0.0;
        n_bad += 1;
    }
    if n_bad > 0 {
        let message = format!("{n_bad} densities are negative or not numbers: they count as 0");
        diagnostics.push(Diagnostic::warning("bad-density", span, message));
    }
    Some(density)
}
