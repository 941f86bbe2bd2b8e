//! Direct light, seen in mirrors and through glass. Scene-file manual (`directlighting`, `whitted`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer maxdepth` | 5 | surfaces of a specular chain, the first one included; 0 counts as 1 |
//! | `string strategy` | `all` | `directlighting`: every light with its `samples`, or `one` at random |
//! | `integer[4] pixelbounds` | film | pixels that are rendered |
//!
//! The integrand is pbrt-v3's: at every surface of the chain its emission and direct light; from there on both mirror
//! reflection and refraction. Media do not exist, null surfaces are passed but block light, and do not show what they
//! emit; light does not spread below surfaces.
//!
//! The two differ in how lights are sampled. `whitted` draws one point on each light; `directlighting` also lets the
//! surface choose, and weighs the two by multiple importance sampling: one ray finds whatever light there is, and
//! serves all of them.
//!
//! A chain splits at its first surfaces; further on one way is drawn, so that many levels between sheets of glass cost
//! time in proportion to their number instead of two to its power.

use arrayvec::ArrayVec;

use crate::camera::RayDifferential;
use crate::ids::LightId;
use crate::integrator::Counters;
use crate::integrator::direct_light::{LitPoint, OneLightNumbers};
use crate::integrator::footprint::{after_specular, texture_context};
use crate::integrator::visible::nearest_visible;
use crate::light::{Light, Wanted};
use crate::math::Ray;
use crate::sampler::Sampler;
use crate::scatter::bsdf::MAX_SPECULAR_PARTS;
use crate::scatter::{Bsdf, SpecularPart, TransportMode};
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::stop;
use crate::texture::TextureContext;
use crate::world::{Receiver, World, spawn_ray};

/// Settings of direct lighting.
#[derive(Clone, Copy, Debug)]
pub struct Direct {
    /// Surfaces of a specular chain, the first one included; 0 counts as 1.
    pub max_depth: u32,
    /// How lights are sampled.
    pub lights: LightSampling,
}

/// How lights are sampled.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum LightSampling {
    /// One point on each light.
    Each,
    /// Every light with its number of samples, and the surface with the largest of these numbers.
    All,
    /// One light and one direction of the surface.
    One,
}

/// Surfaces at which a chain splits.
const SPLITTING: u32 = 6;
/// A chain that no longer splits may end at random once it carries less than this.
const ROULETTE_BELOW: f32 = 0.05;
/// Branches that can wait: at each split all but the one that is followed first.
const MAX_PENDING: usize = SPLITTING as usize * (MAX_SPECULAR_PARTS - 1) + 1;

/// A chain on its way to the next surface.
#[derive(Clone, Copy)]
struct Branch {
    ray: Ray,
    differential: Option<RayDifferential>,
    beta: Rgb,
    /// Surfaces met so far.
    depth: u32,
}

struct State<'a> {
    world: &'a World,
    sampler: &'a mut Sampler,
    counters: &'a mut Counters,
    pending: ArrayVec<Branch, MAX_PENDING>,
}

impl Direct {
    /// Radiance along a camera ray.
    pub fn li(
        &self,
        world: &World,
        ray: Ray,
        differential: Option<&RayDifferential>,
        sampler: &mut Sampler,
        counters: &mut Counters,
    ) -> Rgb {
        let mut state = State {
            world,
            sampler,
            counters,
            pending: ArrayVec::new(),
        };
        let mut radiance = Rgb::BLACK;
        let mut next = Some(Branch {
            ray,
            differential: differential.copied(),
            beta: Rgb::ONE,
            depth: 0,
        });
        while let Some(branch) = next {
            radiance += branch.beta * self.follow(&mut state, branch);
            // A segment may ask for millions of points on lights.
            if stop::is_requested() {
                break;
            }
            next = state.pending.pop();
        }
        radiance
    }

    /// Radiance from the next surface of a chain, but for what comes to it by mirror and glass: those ways are left
    /// pending.
    fn follow(&self, state: &mut State, mut branch: Branch) -> Rgb {
        let world = state.world;
        let Some(seen) = nearest_visible(world, &mut branch.ray, state.counters) else {
            return world.environment(branch.ray.d);
        };
        if seen.is_behind_null {
            branch.differential = None;
        }
        let surface = &seen.surface;
        let wo = -branch.ray.d;
        let emitted = world.emitted(&seen.hit, surface, wo);
        let mut radiance = emitted.map_or(Rgb::BLACK, |(_, le)| le);
        let ctx = texture_context(surface, branch.differential.as_ref());
        let material = world.geometry(seen.hit.target.geometry).material;
        let (materials, textures) = (world.materials(), world.textures());
        let frame = materials.shading_frame(material, surface, &ctx, textures);
        let mut bsdf = Bsdf::new(frame, surface.ng);
        materials.add_lobes(material, &ctx, textures, &mut bsdf);
        if bsdf.has_non_specular() {
            let point = LitPoint::new(&branch.ray, surface, &bsdf);
            radiance += state.direct_light(self.lights, &point);
        }
        branch.depth += 1;
        if branch.depth < self.max_depth {
            state.split(&branch, surface, &ctx, &bsdf);
        }
        radiance
    }
}

impl State<'_> {
    /// Light that lobes with a density scatter along the chain.
    fn direct_light(&mut self, lights: LightSampling, point: &LitPoint) -> Rgb {
        let (world, counters) = (self.world, &mut *self.counters);
        let ids = || (0..world.n_lights()).map(LightId::new);
        let mut sum = Rgb::BLACK;
        let mut n_drawn = 0;
        let mut is_given_up = || {
            n_drawn += 1;
            stop::is_requested_after(n_drawn)
        };
        match lights {
            LightSampling::Each => {
                let at = Receiver {
                    wanted: Wanted::All,
                    ..point.at
                };
                for light in ids() {
                    if is_given_up() {
                        break;
                    }
                    let u = self.sampler.get_2d();
                    let sample = world.sample_on_light(light, 1.0, &at, u);
                    sum += point.arriving(world, sample, 0.0, counters);
                }
            }
            LightSampling::One => {
                let numbers = OneLightNumbers::draw(self.sampler);
                sum += point.one_light(world, &numbers, counters);
            }
            LightSampling::All => {
                let is_extended =
                    |light| matches!(world.light(light), Light::Area(_) | Light::Infinite(_));
                let extended = ids().filter(|&light| is_extended(light));
                let n_found = extended.map(|light| world.light_samples(light)).max();
                let n_found = n_found.unwrap_or(0);
                for light in ids() {
                    let n = world.light_samples(light);
                    let points = self.sampler.array(n);
                    for i in 0..n {
                        if is_given_up() {
                            return sum;
                        }
                        let u = points.get_2d(i);
                        let sample = world.sample_on_light(light, n as f32, &point.at, u);
                        sum += point.arriving(world, sample, n_found as f32, counters);
                    }
                }
                let (lobes, points) = (self.sampler.array(n_found), self.sampler.array(n_found));
                for i in 0..n_found {
                    if is_given_up() {
                        break;
                    }
                    let u = (lobes.get_1d(i), points.get_2d(i));
                    let number = |light| world.light_samples(light) as f32;
                    sum += point.found(world, u, n_found as f32, number, counters);
                }
            }
        }
        sum
    }

    /// Leaves the ways pending that mirrors and glass open at the end of `branch`; of a long chain, one of them.
    fn split(
        &mut self,
        branch: &Branch,
        surface: &SurfacePoint,
        ctx: &TextureContext,
        bsdf: &Bsdf,
    ) {
        let wo = -branch.ray.d;
        let mut parts = bsdf.specular_parts(wo, TransportMode::Radiance);
        parts.retain(|part| !(branch.beta * part.weight).is_black());
        if branch.depth > SPLITTING {
            parts = self.one_of(branch.beta, &parts).into_iter().collect();
        }
        let differential = branch.differential.as_ref();
        let ns = bsdf.frame().n;
        self.pending.extend(parts.iter().map(|part| Branch {
            ray: spawn_ray(
                surface.p,
                surface.p_err,
                surface.ng,
                part.wi,
                branch.ray.time,
            ),
            differential: differential.map(|rays| after_specular(rays, surface, ctx, ns, wo, part)),
            beta: branch.beta * part.weight,
            depth: branch.depth,
        }));
    }

    /// One of the parts, drawn in proportion to what it carries, or none; in its weight it stands for all of them.
    fn one_of(&mut self, beta: Rgb, parts: &[SpecularPart]) -> Option<SpecularPart> {
        let carried = |part: &SpecularPart| (beta * part.weight).max_component().max(0.0);
        let total: f32 = parts.iter().map(carried).sum();
        let p_survives = (total / ROULETTE_BELOW).min(1.0);
        let mut place = self.sampler.get_1d() * total / p_survives;
        if place >= total {
            return None;
        }
        let last = parts.iter().rposition(|part| carried(part) > 0.0)?;
        for (i, part) in parts.iter().enumerate() {
            let share = carried(part);
            // The last part takes what rounding leaves.
            if place < share || i == last {
                let scale = total / (share * p_survives);
                return Some(SpecularPart {
                    weight: part.weight * scale,
                    ..*part
                });
            }
            place -= share;
        }
        None
    }
}
