//! Direct light where media do not exist: points drawn on lights and directions drawn by the surface, weighed by
//! multiple importance sampling (Veach and Guibas 1995).

use crate::ids::LightId;
use crate::integrator::Counters;
use crate::light::Wanted;
use crate::math::Ray;
use crate::sampler::Sampler;
use crate::scatter::{Bsdf, Seen, TransportMode};
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::world::{LightSample, Receiver, World, spawn_ray};

/// A surface that light falls on.
pub(super) struct LitPoint<'a> {
    pub(super) at: Receiver,
    bsdf: &'a Bsdf<'a>,
    /// From the direction that light is scattered to.
    seen: Seen<'a, 'a>,
}

/// Random numbers for one point on one light and one direction of the surface.
pub(super) struct OneLightNumbers {
    u_light: f64,
    u: [f32; 2],
    u_lobe: f32,
    u_direction: [f32; 2],
}

impl OneLightNumbers {
    pub(super) fn draw(sampler: &mut Sampler) -> Self {
        Self {
            u_light: sampler.get_1d_fine(),
            u: sampler.get_2d(),
            u_lobe: sampler.get_1d(),
            u_direction: sampler.get_2d(),
        }
    }
}

impl<'a> LitPoint<'a> {
    /// The point at which `ray` met a surface.
    pub(super) fn new(ray: &Ray, surface: &SurfacePoint, bsdf: &'a Bsdf<'a>) -> Self {
        Self {
            at: Receiver {
                p: surface.p,
                p_err: surface.p_err,
                ng: surface.ng,
                wanted: bsdf.facing(-ray.d).map_or(Wanted::All, Wanted::Facing),
                time: ray.time,
            },
            bsdf,
            seen: bsdf.seen_from(-ray.d),
        }
    }

    /// Light of one light that is chosen at random, scattered by lobes with a density.
    pub(super) fn one_light(
        &self,
        world: &World,
        numbers: &OneLightNumbers,
        counters: &mut Counters,
    ) -> Rgb {
        let &OneLightNumbers {
            u_light,
            u,
            u_lobe,
            u_direction,
        } = numbers;
        let sample = world.sample_light(&self.at, u_light, u);
        let arriving = self.arriving(world, sample, 1.0, counters);
        let pmf = |light| world.light_pmf(&self.at, light);
        arriving + self.found(world, (u_lobe, u_direction), 1.0, pmf, counters)
    }

    /// What a light sample contributes, of which as many are drawn as its density is scaled by, beside `n_found`
    /// directions of the surface.
    pub(super) fn arriving(
        &self,
        world: &World,
        sample: Option<LightSample>,
        n_found: f32,
        counters: &mut Counters,
    ) -> Rgb {
        let Some(sample) = sample else {
            return Rgb::BLACK;
        };
        let Self { bsdf, seen, .. } = self;
        let f = seen.f(sample.wi, TransportMode::Radiance) * bsdf.abs_cos(sample.wi);
        if f.is_black() {
            return Rgb::BLACK;
        }
        let weight = if n_found == 0.0 {
            sample.light_sampling_only_factor()
        } else {
            sample.mis_weight(n_found * seen.pdf(sample.wi), || {
                seen.pdf_in_pbrt(sample.wi)
            })
        };
        let contribution = f * sample.radiance * (weight / sample.pdf);
        if contribution.is_black() {
            return Rgb::BLACK;
        }
        counters.shadow.rays += 1;
        if world.is_occluded(&sample) {
            return Rgb::BLACK;
        }
        contribution
    }

    /// Light found in one of `n_found` directions drawn from the surface by `u`, against `n_samples` points drawn on
    /// each light, as a mean.
    pub(super) fn found(
        &self,
        world: &World,
        (u_lobe, u): (f32, [f32; 2]),
        n_found: f32,
        n_samples: impl Fn(LightId) -> f32,
        counters: &mut Counters,
    ) -> Rgb {
        let Self { at, seen, .. } = self;
        let drawn = seen.sample(u_lobe, u, TransportMode::Radiance);
        let Some(drawn) = drawn.filter(|drawn| !drawn.specular && !drawn.weight.is_black()) else {
            return Rgb::BLACK;
        };
        let weight = |light: LightId, pdf_light: f32| {
            let pdf_light = n_samples(light) * pdf_light;
            world
                .heuristic(light)
                .weight(n_found * drawn.pdf_w, pdf_light)
        };
        let pdf_scattering = if world.facts().needs_pdf_scattering(false) {
            seen.pdf_in_pbrt(drawn.wi)
        } else {
            0.0
        };
        let ray = spawn_ray(at.p, at.p_err, at.ng, drawn.wi, at.time);
        let light = light_along(
            world,
            (at, pdf_scattering),
            ray,
            world.max_crossings(),
            weight,
            counters,
        );
        drawn.weight * light * (1.0 / n_found)
    }
}

/// Light along a ray from the receiver `at`, past at most `max_crossings` surfaces that cast no shadow, each light
/// times its `weight`, a function of its density in solid angle. In pbrt-v3 the ray has density `pdf_scattering`.
fn light_along(
    world: &World,
    (at, pdf_scattering): (&Receiver, f32),
    mut ray: Ray,
    max_crossings: usize,
    weight: impl Fn(LightId, f32) -> f32,
    counters: &mut Counters,
) -> Rgb {
    let mut light = Rgb::BLACK;
    for _ in 0..=max_crossings {
        if counters.next_ray() {
            return Rgb::BLACK;
        }
        let Some(hit) = world.closest(&ray, f32::INFINITY) else {
            for (id, infinite) in world.infinite_lights() {
                let (le, pdf_w) = infinite.le_and_pdf(ray.d, at.wanted);
                light += le * weight(id, pdf_w);
            }
            return light;
        };
        let surface = world.surface(&ray, &hit);
        if let Some((id, le)) = world.emitted_onto(at, || pdf_scattering, &hit, &surface, -ray.d)
            && !le.is_black()
        {
            light += le * weight(id, world.pdf_toward_hit(&hit, &surface, at));
        }
        world.for_other_lamps(&ray, &hit, |lamp| {
            let surface = world.surface(&ray, lamp);
            if let Some((id, le)) = world.emitted(lamp, &surface, -ray.d) {
                light += le * weight(id, world.pdf_toward_hit(lamp, &surface, at));
            }
        });
        if !world.casts_no_shadow(hit.target, &hit.at, &ray) {
            return light;
        }
        ray = spawn_ray(surface.p, surface.p_err, surface.n_surface, ray.d, ray.time);
    }
    counters.stuck_paths += 1;
    light
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{MaterialId, ObjectId};
    use crate::light::{InfiniteLight, Light};
    use crate::math::{Normal3, Point3, Vec3};
    use crate::shape::{Mesh, Shape};
    use crate::texture::Source;
    use crate::world::{Cutout, Geometry, WorldParts};

    #[test]
    fn rays_that_pass_more_shadowless_surfaces_than_there_are_are_given_up_and_counted() {
        let sheet = |z: f32| Geometry {
            shape: Shape::Mesh(Mesh {
                positions: vec![[-1.0, -1.0, z], [1.0, -1.0, z], [0.0, 1.0, z]],
                triangles: vec![[0, 1, 2]],
                ..Mesh::default()
            }),
            material: MaterialId::NONE,
            media: None,
            cutout: Cutout {
                alpha: None,
                shadow_alpha: Some(Source::Constant(0.0)),
            },
            first_light: LightId::NONE,
            object: ObjectId::NONE,
        };
        let world = World::new(WorldParts {
            geometries: [1.0, 2.0, 3.0].map(sheet).into(),
            lights: vec![Light::Infinite(Box::new(InfiniteLight::constant(Rgb::ONE)))],
            ..WorldParts::default()
        });
        let at = Receiver {
            p: Point3::ZERO,
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wanted: Wanted::All,
            time: 0.0,
        };
        let d = Vec3::new(0.0, 0.0, 1.0);
        let found = |max_crossings: usize| {
            let mut counters = Counters::default();
            let ray = spawn_ray(at.p, at.p_err, at.ng, d, at.time);
            let light = light_along(
                &world,
                (&at, 0.0),
                ray,
                max_crossings,
                |_, _| 1.0,
                &mut counters,
            );
            (light, counters.rays, counters.stuck_paths)
        };
        assert_eq!(found(world.max_crossings()), (Rgb::ONE, 4, 0));
        assert_eq!(found(3), (Rgb::ONE, 4, 0));
        assert_eq!(found(2), (Rgb::BLACK, 3, 1));
    }
}
