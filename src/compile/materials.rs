//! Materials, built when a shape uses them.

mod fourier;
mod models;
mod subsurface;

use std::collections::{HashMap, HashSet};

use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use tyndall_parser::diagnostic::{Diagnostic, Diagnostics, Severity};
use tyndall_parser::schema::{Family, PluginRef};
use tyndall_parser::source::Span;

use crate::compile::lookup;
use crate::compile::space::RenderSpace;
use crate::compile::textures::TextureBuilder;
use crate::describe::description::{Frame, MaterialEntity, MaterialRef, ShapeEntity};
use crate::ids::{FourierTableId, MaterialId};
use crate::material::{Material, Materials, Mix, Model};
use crate::scatter::bsdf::MAX_LOBES;
use models::ModelReader;
use subsurface::DiffusionTables;

/// The directional albedo above which a material is too bright to be true.
const BRIGHTEST: f64 = 1.01;

/// Materials that are looked at together.
const LOOKED_AT_ONCE: usize = 64;
/// Bright materials from which on no others are looked for: that takes a millisecond for each.
const ENOUGH_BRIGHT: usize = 50;
/// Directions that are drawn at most, all materials together: some tenths of a second.
const ENOUGH_DRAWN: u64 = 1 << 21;

/// The materials of a frame on their way into the world.
pub(super) struct MaterialBuilder {
    entities: Vec<MaterialEntity>,
    /// By entity: `None` until a shape uses it as it is.
    ids: Vec<Option<MaterialId>>,
    /// By entity: the latest copy for shapes that override parameters.
    private: Vec<Option<MaterialId>>,
    /// By entity: what a mixture is mixed of, for it and all its copies.
    parts: HashMap<usize, [MaterialId; 2]>,
    /// What was said of materials, so that copies do not say it again.
    said: Said,
    /// By file name.
    tables: HashMap<String, FourierTableId>,
    built: Materials,
    /// Where the materials that shapes have were named, by id; of equal ones, the first.
    spans: HashMap<MaterialId, Span>,
    diffusion: DiffusionTables,
}

impl MaterialBuilder {
    pub(super) fn new(frame: &mut Frame, space: &RenderSpace) -> Self {
        let entities = std::mem::take(&mut frame.materials);
        Self {
            ids: vec![None; entities.len()],
            private: vec![None; entities.len()],
            parts: HashMap::new(),
            said: Said::default(),
            entities,
            tables: HashMap::new(),
            built: Materials::default(),
            spans: HashMap::new(),
            diffusion: DiffusionTables::new(space.scale()),
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
        // A shape may override parameters: then it has a material of its own. The shared one is still read, once, so
        // that what is wrong with it is reported once.
        let shared = self.shared(index, textures, diagnostics);
        if !shared.is_some() {
            return shared;
        }
        let Some(material) = self.private_copy(index, shape, textures, diagnostics) else {
            self.note_use(shared, index);
            return shared;
        };
        // Most private copies differ in nothing from the shared material, or from the copy of the shape before.
        let known = [Some(shared), self.private[index]];
        let same = |id: &MaterialId| self.built.list[id.index()] == material;
        let twin = known.into_iter().flatten().find(same);
        // Light that spreads below a surface comes back where the material is the same one, not an equal one.
        let is_told_apart = self.built.spreads_light(&material.model);
        match twin {
            Some(twin) => {
                self.note_use(twin, index);
                if is_told_apart {
                    self.push(material)
                } else {
                    twin
                }
            }
            None => {
                let id = self.push(material);
                self.private[index] = Some(id);
                self.note_use(id, index);
                id
            }
        }
    }

    /// Remembers where a material that some shape has was named.
    fn note_use(&mut self, id: MaterialId, index: usize) {
        let span = self.entities[index].entity.kind.span;
        self.spans.entry(id).or_insert(span);
    }

    /// The material as a shape overrides it; `None` if the shape has the shared one.
    fn private_copy(
        &mut self,
        index: usize,
        shape: &ShapeEntity,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> Option<Material> {
        shape.private_material.as_ref()?;
        // What the shape shares with the material was reported with it; what only the shape names was not.
        let mut found = Diagnostics::default();
        let material = self.material(index, Some(shape), textures, &mut found);
        self.said.add(found, diagnostics);
        // A mixture of too many lobes is too large as a copy as well.
        material.filter(|material| match &material.model {
            Model::Mix(mix) => self.lobes_of(mix) <= MAX_LOBES,
            _ => true,
        })
    }

    /// The material of an entity as it stands, after all those that it is mixed of.
    fn shared(
        &mut self,
        index: usize,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> MaterialId {
        let mut wanted = vec![index];
        let mut next = 0;
        while let Some(&mix) = wanted.get(next) {
            next += 1;
            if self.ids[mix].is_none() {
                // Parts are defined before the mixture.
                let parts = self.entities[mix].materials.iter();
                let parts = parts.filter_map(|(_, part)| Some(part.as_ref()?.0 as usize));
                let parts: Vec<_> = parts
                    .filter(|part| *part < mix && self.ids[*part].is_none())
                    .collect();
                wanted.extend(parts);
                wanted[next..].sort_unstable_by(|a, b| b.cmp(a));
                wanted.dedup();
            }
        }
        for &index in wanted.iter().rev() {
            if self.ids[index].is_none() {
                let id = match self.material(index, None, textures, diagnostics) {
                    Some(material) => self.push(material),
                    None => MaterialId::NONE,
                };
                self.ids[index] = Some(self.within_limits(id, index, diagnostics));
            }
        }
        self.ids[index].unwrap_or(MaterialId::NONE)
    }

    /// Names of those that nothing has led to.
    pub(super) fn skipped(&self) -> Vec<String> {
        let skipped = self.entities.iter().zip(&self.ids);
        let skipped = skipped.filter(|(_, id)| id.is_none());
        let name = |entity: &MaterialEntity| {
            let name = entity.name.as_ref().unwrap_or(&entity.entity.kind);
            name.value.clone()
        };
        skipped.map(|(entity, _)| name(entity)).collect()
    }

    pub(super) fn finish(mut self, diagnostics: &mut Diagnostics) -> Materials {
        let mut spans: Vec<_> = self.spans.into_iter().collect();
        spans.sort_unstable_by_key(|(id, _)| *id);
        let mut n_bright = 0;
        let mut n_seen = 0;
        let mut n_drawn = 0;
        for some in spans.chunks(LOOKED_AT_ONCE) {
            if n_bright >= ENOUGH_BRIGHT || n_drawn >= ENOUGH_DRAWN {
                break;
            }
            n_seen += some.len();
            let albedos: Vec<(Option<f64>, u32)> = some
                .par_iter()
                .map(|(id, _)| self.built.albedo_above(*id, BRIGHTEST))
                .collect();
            for ((albedo, drawn), (_, span)) in albedos.into_iter().zip(some) {
                n_drawn += u64::from(drawn);
                if let Some(albedo) = albedo {
                    n_bright += 1;
                    diagnostics.push(bright_material(*span, albedo));
                }
            }
        }
        if n_bright > 0 && n_seen < spans.len() {
            let message = format!(
                "{n_bright} of {n_seen} materials send back more light than they receive: {} more were not looked at",
                spans.len() - n_seen
            );
            diagnostics.push(Diagnostic::new(
                Severity::Warning,
                "bright-material",
                None,
                message,
            ));
        }
        self.built.diffusion = self.diffusion.finish();
        self.built
    }

    fn push(&mut self, material: Material) -> MaterialId {
        self.built.list.push(material);
        MaterialId::new(self.built.list.len() - 1)
    }

    /// Builds a material; `None` is the null material.
    fn material(
        &mut self,
        index: usize,
        shape: Option<&ShapeEntity>,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> Option<Material> {
        let entity = &self.entities[index].entity;
        Some(match entity.kind.value.as_str() {
            "" | "none" => return None,
            "mix" => self.mix(index, shape, textures, diagnostics),
            "fourier" => self.fourier(index, shape, textures, diagnostics),
            _ => {
                let instead = "\"matte\" is used";
                match lookup(Family::Material, &entity.kind, instead, diagnostics) {
                    Some(plugin) => self
                        .reader(plugin, index, shape, textures, diagnostics)
                        .material(plugin.schema.name),
                    None => models::default_matte(),
                }
            }
        })
    }

    /// The parameters of a material as it stands, or as a shape overrides it.
    fn reader<'a, 't>(
        &'a mut self,
        plugin: PluginRef,
        index: usize,
        shape: Option<&'a ShapeEntity>,
        textures: &'a mut TextureBuilder<'t>,
        diagnostics: &'a mut Diagnostics,
    ) -> ModelReader<'a, 'a, 't> {
        let entity = &self.entities[index].entity;
        let diffusion = &mut self.diffusion;
        ModelReader::new(plugin, entity, shape, textures, diffusion, diagnostics)
    }

    fn mix(
        &mut self,
        index: usize,
        shape: Option<&ShapeEntity>,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> Material {
        let [first, second] = match self.parts.get(&index) {
            Some(parts) => *parts,
            None => {
                let parts = ["namedmaterial1", "namedmaterial2"]
                    .map(|name| self.part(index, name, textures, diagnostics));
                self.parts.insert(index, parts);
                parts
            }
        };
        let Some(plugin) = Family::Material.find("mix") else {
            return models::default_matte();
        };
        let amount = self
            .reader(plugin, index, shape, textures, diagnostics)
            .amount();
        Material {
            model: Model::Mix(Mix {
                first,
                second,
                amount,
            }),
            bump: None,
        }
    }

    /// A part of a mixture. One that is unknown, or null, is a matte with the parameters of the mixture.
    fn part(
        &mut self,
        index: usize,
        name: &str,
        textures: &mut TextureBuilder,
        diagnostics: &mut Diagnostics,
    ) -> MaterialId {
        let mix = &self.entities[index];
        let params = &mix.entity.params.params;
        let named = mix.materials.iter().find(|(i, _)| params[*i].name == name);
        // What is unknown was reported where names are resolved.
        if let Some((i, Some(MaterialRef(part)))) = named {
            match self.ids.get(*part as usize) {
                Some(&Some(id)) if id.is_some() => return id,
                _ => diagnostics.push(null_part(params[*i].value_span)),
            }
        }
        let matte = match Family::Material.find("matte") {
            Some(plugin) => {
                // Its own findings would speak of parameters that the mixture is checked for.
                let mut silent = Diagnostics::default();
                self.reader(plugin, index, None, textures, &mut silent)
                    .standing_in()
            }
            None => models::default_matte(),
        };
        self.push(matte)
    }

    /// Most lobes of a mixture.
    fn lobes_of(&self, mix: &Mix) -> usize {
        self.built.max_lobes(mix.first) + self.built.max_lobes(mix.second)
    }

    /// The material itself, or the first part of a mixture of too many lobes.
    fn within_limits(
        &self,
        id: MaterialId,
        index: usize,
        diagnostics: &mut Diagnostics,
    ) -> MaterialId {
        if !id.is_some() {
            return id;
        }
        let Model::Mix(mix) = &self.built.list[id.index()].model else {
            return id;
        };
        let n_lobes = self.lobes_of(mix);
        if n_lobes <= MAX_LOBES {
            return id;
        }
        let message = format!(
            "this mixture has {n_lobes} lobes, more than the {MAX_LOBES} that a surface may have"
        );
        let span = self.entities[index].entity.kind.span;
        diagnostics.push(
            Diagnostic::error("too-many-lobes", span, message)
                .with_label("its first material is used alone"),
        );
        mix.first
    }
}

/// Findings by what they say of which place.
#[derive(Default)]
struct Said {
    /// Findings of the whole list that are known here.
    n_known: usize,
    known: HashSet<(&'static str, Option<Span>, String)>,
}

impl Said {
    /// Adds those of the findings to the whole list that say something new. It must be the same list each time.
    fn add(&mut self, findings: Diagnostics, all: &mut Diagnostics) {
        let key = |finding: &Diagnostic| (finding.code, finding.span, finding.message.clone());
        if findings.is_empty() {
            return;
        }
        self.known.extend(all.list[self.n_known..].iter().map(key));
        for finding in findings {
            if self.known.insert(key(&finding)) {
                all.push(finding);
            }
        }
        self.n_known = all.len();
    }
}

fn bright_material(span: Span, albedo: f64) -> Diagnostic {
    let message = format!("this material sends back up to {albedo:.2} times the light it receives");
    Diagnostic::warning("bright-material", span, message)
        .with_help("reflectances that add up to at most 1 keep long paths from growing brighter")
}

fn null_part(span: Span) -> Diagnostic {
    Diagnostic::error("null-in-mix", span, "the null material cannot be mixed")
        .with_label("matte is used instead")
        .with_help("\"uber\" with an \"opacity\" lets light pass in part")
}
