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
use crate::integrator::footprint::{after_specular, texture_context};
use crate::integrator::visible::nearest_visible;
use crate::light::Light;
use crate::math::{Ray, Vec3};
use crate::sampler::Sampler;
use crate::sampling::mis::power_heuristic;
use crate::scatter::bsdf::MAX_SPECULAR_PARTS;
use crate::scatter::{Bsdf, SpecularPart, TransportMode};
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::texture::TextureContext;
use crate::world::{LightSample, Receiver, World, spawn_ray};

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

/// A surface of a chain that light falls on.
struct Vertex<'a> {
    at: Receiver,
    bsdf: &'a Bsdf<'a>,
    wo: Vec3,
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
        let bsdf = world
            .materials()
            .bsdf(material, surface, &ctx, world.textures());
        if bsdf.has_non_specular() {
            let vertex = Vertex {
                at: Receiver {
                    p: surface.p,
                    p_err: surface.p_err,
                    ng: surface.ng,
                    time: branch.ray.time,
                },
                bsdf: &bsdf,
                wo,
            };
            radiance += state.direct_light(self.lights, &vertex);
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
    fn direct_light(&mut self, lights: LightSampling, vertex: &Vertex) -> Rgb {
        let world = self.world;
        let ids = || (0..world.n_lights()).map(LightId::new);
        let mut sum = Rgb::BLACK;
        match lights {
            LightSampling::Each => {
                for light in ids() {
                    let u = self.sampler.get_2d();
                    let sample = world.sample_on_light(light, 1.0, &vertex.at, u);
                    sum += self.arriving(vertex, sample, 0.0);
                }
            }
            LightSampling::One => {
                let (u_light, u) = (self.sampler.get_1d_fine(), self.sampler.get_2d());
                let sample = world.sample_light(&vertex.at, u_light, u);
                sum += self.arriving(vertex, sample, 1.0);
                let u = (self.sampler.get_1d(), self.sampler.get_2d());
                sum += self.found(vertex, u, 1.0, |light| world.light_pmf(&vertex.at, light));
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
                        let u = points.get_2d(i);
                        let sample = world.sample_on_light(light, n as f32, &vertex.at, u);
                        sum += self.arriving(vertex, sample, n_found as f32);
                    }
                }
                let (lobes, points) = (self.sampler.array(n_found), self.sampler.array(n_found));
                for i in 0..n_found {
                    let u = (lobes.get_1d(i), points.get_2d(i));
                    let number = |light| world.light_samples(light) as f32;
                    sum += self.found(vertex, u, n_found as f32, number);
                }
            }
        }
        sum
    }

    /// What a light sample contributes, of which as many are drawn as its density is scaled by, beside `n_found`
    /// directions of the surface.
    fn arriving(&mut self, vertex: &Vertex, sample: Option<LightSample>, n_found: f32) -> Rgb {
        let Some(sample) = sample else {
            return Rgb::BLACK;
        };
        let Vertex { bsdf, wo, .. } = *vertex;
        let f = bsdf.f(wo, sample.wi, TransportMode::Radiance) * bsdf.abs_cos(sample.wi);
        if f.is_black() {
            return Rgb::BLACK;
        }
        let weight = if sample.is_delta || n_found == 0.0 {
            1.0
        } else {
            power_heuristic(sample.pdf, n_found * bsdf.pdf(wo, sample.wi))
        };
        let contribution = f * sample.radiance * (weight / sample.pdf);
        if contribution.is_black() {
            return Rgb::BLACK;
        }
        self.counters.shadow.rays += 1;
        if self.world.is_occluded(&sample) {
            return Rgb::BLACK;
        }
        contribution
    }

    /// Light found in one of `n_found` directions drawn from the surface by `u`, against `n_samples` points drawn on
    /// each light, as a mean.
    fn found(
        &mut self,
        vertex: &Vertex,
        (u_lobe, u): (f32, [f32; 2]),
        n_found: f32,
        n_samples: impl Fn(LightId) -> f32,
    ) -> Rgb {
        let Vertex { at, bsdf, wo } = vertex;
        let drawn = bsdf.sample(*wo, u_lobe, u, TransportMode::Radiance);
        let Some(drawn) = drawn.filter(|drawn| !drawn.specular && !drawn.weight.is_black()) else {
            return Rgb::BLACK;
        };
        let weight = |light: LightId, pdf_light: f32| {
            power_heuristic(n_found * drawn.pdf_w, n_samples(light) * pdf_light)
        };
        let world = self.world;
        let mut ray = spawn_ray(at.p, at.p_err, at.ng, drawn.wi, at.time);
        let mut light = Rgb::BLACK;
        // The ray passes what casts no shadow.
        for _ in 0..=world.max_crossings() {
            self.counters.rays += 1;
            let Some(hit) = world.closest(&ray, f32::INFINITY) else {
                for (id, infinite) in world.infinite_lights() {
                    let (le, pdf_w) = infinite.le_and_pdf(ray.d);
                    light += le * weight(id, pdf_w);
                }
                break;
            };
            let surface = world.surface(&ray, &hit);
            if let Some((id, le)) = world.emitted(&hit, &surface, -ray.d)
                && !le.is_black()
            {
                light += le * weight(id, world.pdf_toward_hit(&hit, &surface, at));
            }
            if !world.casts_no_shadow(hit.target, &hit.at, &ray) {
                break;
            }
            ray = spawn_ray(surface.p, surface.p_err, surface.ng, ray.d, ray.time);
        }
        drawn.weight * light * (1.0 / n_found)
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
