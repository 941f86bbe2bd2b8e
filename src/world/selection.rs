//! Which light a point asks: how the lights of a world are chosen among.
//!
//! Lights with a place are chosen by a [`LightTree`], those at infinity (distant, infinite) beside it by fixed
//! probabilities. Between the two groups the receiver decides: two thirds by the irradiance that each may bring there, one
//! third evenly among *sources* (a light, or all elements of an emitting shape), so that a lamp is found beside a sky that
//! outshines it.
//! Nothing of that depends on how far the scene reaches: what is out of sight changes no choice.
//!
//! Fixed probabilities compare the lights at infinity with others by a sphere around what the camera sees.

use std::f32::consts::{FRAC_PI_2, PI};

use crate::ids::LightId;
use crate::light::{AreaLight, Emitter, Light, LightChoice, LightTree};
use crate::math::{Bounds3, Point3, Vec3};
use crate::shape::{Emission, Shape};
use crate::spectrum::Rgb;
use crate::world::lamp_copies::SharedTrees;
use crate::world::{LampCopies, Receiver, World};

/// How a light is chosen.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum LightStrategy {
    /// All alike.
    Uniform,
    /// In proportion to power.
    Power,
    /// By what each may bring to the receiver.
    #[default]
    Spatial,
}

/// The choice among the lights of a world.
#[derive(Clone, Debug, Default)]
pub(super) struct LightSelection {
    /// Over all lights, or over those at infinity where there is a tree.
    table: LightChoice,
    tree: Option<Tree>,
}

#[derive(Clone, Debug)]
struct Tree {
    /// Over lamps that stand by themselves, then copies of others.
    tree: LightTree,
    /// See [`SharedTrees`].
    copies: SharedTrees,
    /// The lights with a place: one for each emitter, then those of the copies.
    near: Vec<LightId>,
    /// The light of each entry of the table.
    far: Vec<LightId>,
    /// For each light its place in `near` or, with [`FAR`], its entry.
    places: Vec<u32>,
    /// Irradiance from infinity over the sum of the intensities of the others, per square of a render-space length.
    far_irradiance: f32,
    /// The part of all sources that is in the tree.
    near_sources: f32,
}

const FAR: u32 = 1 << 31;
/// In the place of lights whose place is found later: as copies, or at all.
const COPIED: u32 = u32::MAX - 1;
const NOWHERE: u32 = u32::MAX;
/// Share of the mean power that a light counts at least: colours with negative channels may have none.
const MIN_POWER: f64 = 1e-6;
/// Part of the choice between the lights with a place and those at infinity that is made evenly among sources: what hides
/// either is not known.
const EVENLY: f32 = 1.0 / 3.0;
/// Least probability of the lights with a place, and of those at infinity, where there are both.
const MIN_SHARE: f32 = 1e-6;

impl LightSelection {
    /// A light and its probability, for `u` in [0, 1). `None` when there are no lights.
    #[inline]
    pub(super) fn choose(&self, at: &Receiver, u: f64) -> Option<(LightId, f32)> {
        let Some(tree) = &self.tree else {
            let (index, pmf) = self.table.sample(u)?;
            return Some((LightId::new(index), pmf));
        };
        let share = tree.share_at(at);
        let split = f64::from(share);
        if u < split {
            let (emitter, pmf, rest) = tree.tree.choose(at.p, at.ng, u / split);
            let (place, within) = tree.copies.choose(emitter, at, rest);
            Some((tree.near[place], share * pmf * within))
        } else {
            let (entry, pmf) = self.table.sample((u - split) / (1.0 - split))?;
            Some((tree.far[entry], (1.0 - share) * pmf))
        }
    }

    /// Probability with which [`LightSelection::choose`] finds a light.
    #[inline]
    pub(super) fn pmf(&self, at: &Receiver, light: LightId) -> f32 {
        let Some(tree) = &self.tree else {
            return self.table.pmf(light.index());
        };
        let place = tree.places[light.index()];
        let share = tree.share_at(at);
        if place & FAR == 0 {
            let (emitter, within) = tree.copies.pmf(place as usize, at);
            share * tree.tree.pmf(at.p, at.ng, emitter) * within
        } else {
            (1.0 - share) * self.table.pmf((place & !FAR) as usize)
        }
    }
}

impl Tree {
    /// Probability of the tree.
    #[inline]
    fn share_at(&self, at: &Receiver) -> f32 {
        if self.far.is_empty() {
            return 1.0;
        }
        let near = self.tree.bound(at.p, at.ng);
        if near > 0.0 {
            let by_irradiance = near / (near + self.far_irradiance);
            let mixed = by_irradiance + EVENLY * (self.near_sources - by_irradiance);
            mixed.clamp(MIN_SHARE, 1.0 - MIN_SHARE)
        } else {
            0.0
        }
    }
}

impl World {
    /// A choice among all lights for paths that start there: it knows no receiver, `Spatial` chooses half by power
    /// and half evenly among sources.
    pub fn light_choice(&self, strategy: LightStrategy) -> LightChoice {
        LightChoice::new(&self.light_weights(strategy))
    }

    pub(super) fn light_weights(&self, strategy: LightStrategy) -> Vec<f64> {
        match strategy {
            LightStrategy::Uniform => vec![1.0; self.lights.len()],
            LightStrategy::Power => self.power_weights(self.view_radius),
            LightStrategy::Spatial => self.mixed_weights(&self.powers(self.view_radius)),
        }
    }

    /// Powers of all lights; of those at infinity, what passes through a sphere of the given radius.
    fn powers(&self, radius: f64) -> Vec<f64> {
        let power = |light| self.power_through(light, radius).max(0.0);
        self.lights.iter().map(power).collect()
    }

    /// The same; none is 0.
    pub(super) fn power_weights(&self, radius: f64) -> Vec<f64> {
        let powers = self.powers(radius);
        let least = MIN_POWER * powers.iter().sum::<f64>() / powers.len() as f64;
        powers.iter().map(|p| p.max(least)).collect()
    }

    /// A choice among the lights that are points, for segments of paths, before the receiver is known: half by power,
    /// half evenly.
    pub(super) fn point_choice(&self) -> LightChoice {
        let is_point = |light: &&Light| light.position().is_some();
        let power = |light: &Light| self.power(light).max(0.0);
        let powers: Vec<f64> = self
            .lights
            .iter()
            .map(|light| Some(light).filter(is_point).map_or(0.0, power))
            .collect();
        let mut weights = self.mixed_weights(&powers);
        for (weight, light) in weights.iter_mut().zip(&self.lights) {
            if !is_point(&light) {
                *weight = 0.0;
            }
        }
        LightChoice::new(&weights)
    }

    /// The choice by a strategy.
    pub(super) fn light_selection(
        &self,
        strategy: LightStrategy,
        copies: &[LampCopies],
    ) -> LightSelection {
        let tree = match strategy {
            LightStrategy::Uniform | LightStrategy::Power => None,
            LightStrategy::Spatial => self.tree_selection(copies),
        };
        tree.unwrap_or_else(|| LightSelection::fixed(&self.light_weights(strategy)))
    }

    /// The light that stands for the source a light is part of.
    fn source(&self, light: usize) -> usize {
        match &self.lights[light] {
            Light::Area(area) => self.geometry(area.geometry).first_light.index(),
            _ => light,
        }
    }

    /// The power of all sources, each in the place of the light that stands for it, and how many have any.
    fn sources(&self, powers: &[f64]) -> (Vec<f64>, usize) {
        let mut source_power = vec![0.0; powers.len()];
        for (i, power) in powers.iter().enumerate() {
            source_power[self.source(i)] += power;
        }
        let n_sources = source_power.iter().filter(|power| **power > 0.0).count();
        (source_power, n_sources)
    }

    /// Half by power, half evenly among sources.
    fn mixed_weights(&self, powers: &[f64]) -> Vec<f64> {
        let total: f64 = powers.iter().sum();
        let (source_power, n_sources) = self.sources(powers);
        let share = |power: f64, of: f64| if of > 0.0 { power / of } else { 0.0 };
        let least = MIN_POWER / powers.len().max(1) as f64;
        (0..powers.len())
            .map(|i| {
                let by_power = share(powers[i], total);
                let by_source = share(powers[i], source_power[self.source(i)]) / n_sources as f64;
                (by_power + by_source).max(least)
            })
            .collect()
    }

    /// With a tree; `None` where a fixed choice is as good.
    fn tree_selection(&self, copies: &[LampCopies]) -> Option<LightSelection> {
        let sharing = self.share_lamps(copies);
        let mut emitters = Vec::new();
        let (mut near, mut far) = (Vec::new(), Vec::new());
        let mut places = vec![NOWHERE; self.lights.len()];
        // What those at infinity bring to a receiver, and what others emit.
        let (mut irradiances, mut intensities) = (Vec::new(), vec![0.0; self.lights.len()]);
        for &(copied, intensity) in &sharing.lights {
            places[copied.index()] = COPIED;
            intensities[copied.index()] = intensity;
        }
        for (index, light) in self.lights.iter().enumerate() {
            if places[index] == COPIED {
                continue;
            }
            let id = LightId::new(index);
            match self.emitter(light) {
                Some(emitter) => {
                    places[index] = near.len() as u32;
                    intensities[index] = emitter.intensity;
                    emitters.push(emitter);
                    near.push(id);
                }
                None => {
                    places[index] = far.len() as u32 | FAR;
                    irradiances.push(irradiance(light).max(0.0));
                    far.push(id);
                }
            }
        }
        emitters.extend(&sharing.emitters);
        if far.is_empty() && emitters.len() < 2 {
            return None;
        }
        let (_, n_near) = self.sources(&intensities);
        let n_far = irradiances.iter().filter(|e| **e > 0.0).count();
        let n_sources = (n_near + n_far).max(1);
        let far_total: f64 = irradiances.iter().sum();
        let near_total: f64 = emitters.iter().map(|emitter| emitter.intensity).sum();
        let least = MIN_POWER / far.len().max(1) as f64;
        let far_weights: Vec<f64> = irradiances
            .iter()
            .map(|&e| {
                let evenly = if e > 0.0 { 1.0 / n_sources as f64 } else { 0.0 };
                (e / far_total.max(f64::MIN_POSITIVE) + evenly).max(least)
            })
            .collect();
        if emitters.is_empty() {
            return Some(LightSelection::fixed(&far_weights));
        }
        let n_alone = near.len();
        for &(copied, _) in &sharing.lights {
            places[copied.index()] = near.len() as u32;
            near.push(copied);
        }
        let far_irradiance = far_total / near_total.max(f64::MIN_POSITIVE);
        Some(LightSelection {
            table: LightChoice::new(&far_weights),
            tree: Some(Tree {
                tree: LightTree::new(&emitters)?,
                copies: sharing.behind(n_alone),
                near,
                far,
                places,
                far_irradiance: far_irradiance.clamp(1e-37, 1e37) as f32,
                near_sources: (n_near as f64 / n_sources as f64) as f32,
            }),
        })
    }

    /// Where a light is and whereto it shines; `None` at infinity, and for elements without area.
    pub(super) fn emitter(&self, light: &Light) -> Option<Emitter> {
        let at_point = |p: Point3, (axis, spread): (Vec3, f32), intensity: f64| Emitter {
            bounds: Bounds3::EMPTY.with_point(p),
            axis,
            spread,
            reach: 0.0,
            two_sided: false,
            intensity,
        };
        const ALL_ROUND: (Vec3, f32) = (Vec3::new(0.0, 0.0, 1.0), PI);
        let emitter = match light {
            Light::Point(point) => at_point(point.p, ALL_ROUND, brightness(point.intensity)),
            Light::Spot(spot) => at_point(spot.position(), spot.cone(), spot.axis_intensity()),
            Light::Projection(projection) => at_point(
                projection.position(),
                projection.cone(),
                projection.mean_intensity(),
            ),
            Light::Goniometric(goniometric) => at_point(
                goniometric.position(),
                ALL_ROUND,
                goniometric.power() / (4.0 * std::f64::consts::PI),
            ),
            Light::Area(area) => self.area_emitter(area),
            Light::Distant(_) | Light::Infinite(_) => return None,
        };
        let (bounds, i) = (emitter.bounds, emitter.intensity);
        let is_sound = !bounds.is_empty() && bounds.min.is_finite() && bounds.max.is_finite();
        (is_sound && i >= 0.0 && i.is_finite()).then_some(emitter)
    }

    fn area_emitter(&self, area: &AreaLight) -> Emitter {
        let shape: &Shape = &self.geometry(area.geometry).shape;
        let flux = shape.area(area.element) * brightness(area.radiance);
        let (axis, spread, intensity) = match shape.emission(area.element) {
            Emission::Flat(ng) => (ng.into(), 0.0, flux),
            // Seen from anywhere, a convex surface shows a quarter of its area.
            Emission::Round => (Vec3::new(0.0, 0.0, 1.0), PI, 0.25 * flux),
        };
        Emitter {
            bounds: shape.bounds(area.element),
            axis,
            spread,
            reach: FRAC_PI_2,
            two_sided: area.lights_both_sides(),
            intensity,
        }
    }
}

/// What a light at infinity brings to a receiver by light samples, roughly: the luminance of its irradiance. Of a sky, most is
/// found by directions, so that only a part counts. 0 for lights that only lack an area.
fn irradiance(light: &Light) -> f64 {
    match light {
        Light::Distant(distant) => brightness(distant.radiance),
        Light::Infinite(infinite) => infinite.irradiance() * std::f64::consts::FRAC_1_PI,
        _ => 0.0,
    }
}

/// Luminance, had all channels the sign that counts.
fn brightness(rgb: Rgb) -> f64 {
    f64::from(rgb.map(f32::abs).luminance())
}

impl LightSelection {
    /// With fixed probabilities.
    fn fixed(weights: &[f64]) -> Self {
        Self {
            table: LightChoice::new(weights),
            tree: None,
        }
    }
}
