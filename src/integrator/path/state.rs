//! A path on its way: light that it finds, and how it scatters.

use arrayvec::ArrayVec;

use crate::ids::{LightId, MaterialId, MediumId};
use crate::integrator::Counters;
use crate::integrator::fog::FogSegment;
use crate::integrator::path::forks::{Fork, MAX_FORKS};
use crate::integrator::path::junction::Junction;
use crate::integrator::subsurface::{Entry, sample_exit};
use crate::integrator::trace::{Event, Observer};
use crate::light::Wanted;
use crate::math::error::EPSILON;
use crate::math::{Frame, Normal3, Ray, Vec3};
use crate::sampler::Sampler;
use crate::sampling::mis::Heuristic;
use crate::sampling::rng::Rng;
use crate::scatter::{Bsdf, Bxdf, HenyeyGreenstein, TransportMode};
use crate::shape::{Place, SurfacePoint};
use crate::spectrum::Rgb;
use crate::texture::TextureContext;
use crate::world::{Hit, LightSample, Receiver, World, spawn_ray};

/// Part of a path's extent within which a collision may touch the wall ahead by rounding, down to grazing angles of
/// 10⁻⁵.
const NEAR_WALL: f32 = 1e-2;

/// How the current ray came about, for weighing the emission it finds.
#[derive(Clone, Copy)]
pub(super) enum Origin {
    /// From the camera or a specular bounce: light sampling cannot find what it finds.
    Certain,
    /// Drawn at a point with a density that light sampling competes with.
    Drawn {
        at: Receiver,
        pdf_w: f32,
        /// Density of the direction in pbrt-v3's BSDF sampling; 0 where no picture depends on it.
        pdf_scattering: f32,
    },
    /// Light was looked for by other rays, or the model lets none through.
    Hidden,
}

/// A path as far as it has been followed.
pub(super) struct State<'a, O> {
    pub(super) world: &'a World,
    pub(super) sampler: &'a mut Sampler,
    pub(super) counters: &'a mut Counters,
    pub(super) observer: &'a mut O,
    /// For loops of unknown length.
    pub(super) rng: Rng,
    pub(super) ray: Ray,
    pub(super) medium: MediumId,
    /// It has met a surface in a medium that this does not border on.
    pub(super) is_misled: bool,
    /// The medium is that of a cloud, wherever the path is, from beginning to end: it does not ask for walls.
    pub(super) past_walls: bool,
    /// The ray comes from a collision, and meets no surface before the next.
    pub(super) is_clear: bool,
    pub(super) origin: Origin,
    pub(super) radiance: Rgb,
    /// The cloud's paths can be shared.
    pub(super) may_be_joined: bool,
    /// Where it has, so far. From the second collision on `radiance` is that of its own, not this.
    pub(super) junction: Option<Junction>,
    pub(super) radiance_before: Rgb,
    pub(super) beta: Rgb,
    /// Undoes, for Russian roulette, the change of throughput by refraction.
    pub(super) eta_scale: f32,
    pub(super) bounces: u32,
    /// What the first vertex that is no mirror sends on: roughly how bright the path may be for its pixel. `None` before.
    pub(super) sent_first: Option<f32>,
    pub(super) forks: ArrayVec<Fork, MAX_FORKS>,
    /// Ways that may still be added.
    pub(super) ways_left: u32,
}

impl<O: Observer> State<'_, O> {
    /// Tells the observer.
    #[inline(always)]
    pub(super) fn see(&mut self, event: impl FnOnce(&Self) -> Event) {
        if O::LOOKS {
            let event = event(self);
            self.observer.see(event);
        }
    }

    /// Tells the observer why the path ends.
    #[inline(always)]
    pub(super) fn end(&mut self, why: &'static str) {
        self.see(|_| Event::Ended { why });
    }

    /// What the path carries, but for the change of radiance by refraction, which is undone where it comes out again.
    #[inline]
    pub(super) fn carried(&self) -> f32 {
        (self.beta * self.eta_scale).max_component()
    }

    /// Adds the light of the environment to a path that leaves the scene.
    pub(super) fn add_environment(&mut self) {
        let w = self.ray.d;
        let le = match self.origin {
            Origin::Certain => self.world.environment(w),
            Origin::Drawn {
                at,
                pdf_w,
                pdf_scattering,
            } => {
                let densities = (pdf_w, pdf_scattering);
                self.world.environment_onto(&at, densities, self.medium, w)
            }
            Origin::Hidden => return,
        };
        self.find(LightId::NONE, le, 1.0);
    }

    /// Adds light that the path has found.
    fn find(&mut self, light: LightId, le: Rgb, weight: f32) {
        let added = self.beta * le * weight;
        self.radiance += added;
        self.see(|_| Event::Found {
            light,
            radiance: le * weight,
            added,
        });
    }

    /// Adds the emission of the surface the path has met, and of null surfaces in its place.
    pub(super) fn add_emission(&mut self, hit: &Hit, surface: &SurfacePoint) {
        self.add_emission_of(hit, surface);
        let (world, ray) = (self.world, self.ray);
        world.for_other_lamps(&ray, hit, |lamp| {
            self.add_emission_of(lamp, &world.surface(&ray, lamp));
        });
    }

    fn add_emission_of(&mut self, hit: &Hit, surface: &SurfacePoint) {
        let (world, wo) = (self.world, -self.ray.d);
        let emitted = match &self.origin {
            Origin::Certain => world.emitted(hit, surface, wo),
            Origin::Drawn {
                at, pdf_scattering, ..
            } => world.emitted_onto(at, || *pdf_scattering, hit, surface, wo),
            Origin::Hidden => return,
        };
        let Some((light, le)) = emitted.filter(|(_, le)| !le.is_black()) else {
            return;
        };
        let weight = match self.origin {
            Origin::Drawn { at, pdf_w, .. } => {
                let pdf_light = world.pdf_of_hit(light, hit, surface, &at);
                Heuristic::Power.weight(pdf_w, pdf_light)
            }
            Origin::Certain | Origin::Hidden => 1.0,
        };
        self.find(light, le, weight);
    }

    /// The second half of the light sampling at the vertex, where it passes surfaces that cast no shadow: the
    /// continuation of the path meets them, and counts no light then.
    pub(super) fn look_for_light(&mut self) {
        let Origin::Drawn { .. } = self.origin else {
            return;
        };
        let ray = self.ray;
        let mut passed = 0;
        loop {
            if self.counters.next_ray() {
                break;
            }
            let Some(hit) = self.world.closest(&self.ray, f32::INFINITY) else {
                self.add_environment();
                break;
            };
            let surface = self.world.surface(&self.ray, &hit);
            self.add_emission(&hit, &surface);
            if !self.world.casts_no_shadow(hit.target, &hit.at, &self.ray) {
                break;
            }
            passed += 1;
            if passed > self.world.max_crossings() {
                self.counters.stuck_paths += 1;
                break;
            }
            self.ray = spawn_ray(surface.p, surface.p_err, surface.n_surface, ray.d, ray.time);
        }
        self.ray = ray;
        self.origin = Origin::Hidden;
    }

    /// Goes on behind a null surface.
    pub(super) fn cross<const VOLUMETRIC: bool>(&mut self, hit: &Hit, place: &Place) {
        let &Place {
            p,
            p_err,
            n_surface,
            ..
        } = place;
        let Ray { d, time, .. } = self.ray;
        if VOLUMETRIC {
            let (behind, n_mismatched) =
                self.world
                    .medium_behind_null(&self.ray, hit, place, self.medium);
            self.counters.mismatched_media += n_mismatched;
            self.medium = behind;
        } else if let Origin::Drawn { .. } = self.origin {
            self.origin = Origin::Hidden;
        }
        self.ray = spawn_ray(p, p_err, n_surface, d, time);
        self.see(|state| Event::Crossed {
            medium: state.medium,
        });
    }

    /// Adds light of a point that is scattered on the segment before the path goes on, at a distance of its own.
    pub(super) fn light_fog(&mut self, fog: &FogSegment<'_>, hit: Option<&Hit>) {
        let (u_light, u) = (self.rng.uniform_fine(), self.rng.uniform());
        let (world, ray, medium) = (self.world, self.ray, self.medium);
        let place = |t| hit.map_or(t, |hit| stay_inside(world, &ray, t, hit));
        if let Some(light) = fog.sample(u_light, u, place) {
            self.see(|_| Event::Lit { t: light.t });
            self.add_light::<true>(&light.sample, light.f, (light.weight, || 0.0), medium);
        }
    }

    /// Scatters in the current medium at distance `t`; `fog` is the segment if light of points is looked for along it.
    pub(super) fn scatter_in_medium(
        &mut self,
        t: f32,
        phase: HenyeyGreenstein,
        fog: Option<&FogSegment<'_>>,
    ) {
        let p = self.ray.at(t);
        let wo = -self.ray.d;
        if self.may_be_joined {
            self.note_junction(p);
        }
        let (u_light, u) = (self.sampler.get_1d_fine(), self.sampler.get_2d());
        let at = Receiver {
            p,
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wanted: self.world.wanted_in(self.medium, p),
            time: self.ray.time,
        };
        // What is found at first is no other path's to share: it is looked for twice, at places far apart.
        // That depends on the world alone, so that it makes no difference who follows the path.
        let n_lights = if self.may_be_joined && self.bounces == 0 {
            2
        } else {
            1
        };
        let per_light = 1.0 / n_lights as f32;
        for k in 0..n_lights {
            let shift = k as f32 * per_light;
            let u_light = (u_light + f64::from(shift)).fract();
            let u = u.map(|u| (u + shift).fract());
            let medium = self.medium;
            if !phase.is_delta()
                && let Some((light, pmf)) = self.world.choose_light(&at, u_light)
                && let Some(sample) = self.world.sample_on_light(light, pmf, &at, u)
            {
                let density = phase.p(wo, sample.wi);
                let weight = match fog {
                    Some(fog) if sample.is_delta => fog.weight_by_extinction(t, p, light, pmf),
                    _ => sample.mis_weight(density * per_light, || density),
                };
                let f = Rgb::splat(density);
                let weight = (weight * per_light, || density);
                self.add_light::<true>(&sample, f, weight, medium);
            }
        }
        let (wi, pdf_w) = phase.sample(wo, self.sampler.get_2d());
        // The density is the phase function itself: throughput stays as it is.
        self.origin = if phase.is_delta() {
            Origin::Certain
        } else {
            Origin::Drawn {
                at,
                // Beside so many samples of lights.
                pdf_w: pdf_w * per_light,
                pdf_scattering: pdf_w,
            }
        };
        self.ray = Ray {
            o: p,
            d: wi,
            time: self.ray.time,
        };
        self.sent_first.get_or_insert(1.0);
        self.is_clear = self.past_walls && self.world.is_clear_within(self.medium);
        self.bounces += 1;
        self.see(|state| Event::Scattered {
            wi,
            pdf_w: (!phase.is_delta()).then_some(pdf_w),
            weight: Rgb::ONE,
            transmitted: None,
            medium: state.medium,
        });
    }

    /// Scatters at a surface, and below it where the material lets light in. False where the path ends.
    pub(super) fn scatter_at_surface<const VOLUMETRIC: bool>(
        &mut self,
        material: MaterialId,
        hit: &Hit,
        surface: &SurfacePoint,
        ctx: &TextureContext,
        bsdf: &Bsdf,
    ) -> bool {
        let (wo, eta_scale) = (-self.ray.d, self.eta_scale);
        let through = self.medium_through::<VOLUMETRIC>(hit);
        if VOLUMETRIC && through.is_none() {
            let (met, d) = ((hit, surface.ng), self.ray.d);
            let (counters, is_misled) = (&mut *self.counters, &mut self.is_misled);
            counters.meet(self.world, met, d, self.medium, is_misled);
        }
        let scattered = self.scatter_by::<VOLUMETRIC>(hit, surface, bsdf, wo, through);
        let Some(transmitted) = scattered else {
            return false;
        };
        self.bounces += 1;
        if !transmitted {
            return true;
        }
        let (materials, textures) = (self.world.materials(), self.world.textures());
        let Some(bssrdf) = materials.bssrdf(material, surface, ctx, textures) else {
            return true;
        };
        let entry = Entry {
            surface,
            frame: bsdf.frame(),
            material,
            time: self.ray.time,
        };
        let exit = sample_exit(
            self.world,
            &entry,
            &bssrdf,
            self.beta,
            self.sampler,
            &mut self.rng,
            self.counters,
        );
        let Some(exit) = exit else {
            return false;
        };
        self.beta *= exit.weight;
        self.eta_scale = eta_scale;
        self.see(|_| Event::Surfaced {
            p: exit.surface.p,
            weight: exit.weight,
        });
        // Light leaves as from a diffuse surface, whatever way it came.
        let surface = &exit.surface;
        let frame = Frame::from_normal_tangent(surface.ns, surface.tangent);
        let mut bsdf = Bsdf::new(frame, surface.ng);
        bsdf.add(Bxdf::SubsurfaceExit(bssrdf.exit()));
        let wo = Vec3::from(surface.ns);
        let below = self.medium;
        let above = if VOLUMETRIC && !self.past_walls {
            self.world
                .medium_out_of_stack(&exit.ray, &exit.hit, wo, below)
        } else {
            None
        };
        if let Some(above) = above {
            self.medium = above;
        }
        let through = above.map(|_| below);
        self.scatter_by::<VOLUMETRIC>(&exit.hit, surface, &bsdf, wo, through)
            .is_some()
    }

    /// The medium behind a surface that is met, where boundaries lie in its place.
    #[inline]
    fn medium_through<const VOLUMETRIC: bool>(&self, hit: &Hit) -> Option<MediumId> {
        if !VOLUMETRIC || self.past_walls {
            return None;
        }
        self.world.medium_through_stack(&self.ray, hit, self.medium)
    }

    /// Adds direct light at a surface and draws the next direction: whether it was transmitted, or `None` where the
    /// path ends. `through` is the medium behind the surface where boundaries lie in its place.
    fn scatter_by<const VOLUMETRIC: bool>(
        &mut self,
        hit: &Hit,
        surface: &SurfacePoint,
        bsdf: &Bsdf,
        wo: Vec3,
        through: Option<MediumId>,
    ) -> Option<bool> {
        let world = self.world;
        let medium_toward = |w: Vec3, current: MediumId| {
            if VOLUMETRIC && let Some(behind) = through {
                if (surface.ng.dot(w) > 0.0) == (surface.ng.dot(wo) > 0.0) {
                    current
                } else {
                    behind
                }
            } else if VOLUMETRIC {
                world.medium_toward(hit.target, surface.ng, w, current)
            } else {
                MediumId::NONE
            }
        };
        let (u_light, u) = (self.sampler.get_1d_fine(), self.sampler.get_2d());
        let at = Receiver {
            p: surface.p,
            p_err: surface.p_err,
            ng: surface.ng,
            wanted: bsdf.facing(wo).map_or(Wanted::All, Wanted::Facing),
            time: self.ray.time,
        };
        let seen = bsdf.seen_from(wo);
        if bsdf.has_non_specular()
            && let Some(sample) = self.world.sample_light(&at, u_light, u)
        {
            let f = seen.f(sample.wi, TransportMode::Radiance) * bsdf.abs_cos(sample.wi);
            if !f.is_black() {
                let pdf_scattering = || seen.pdf_in_pbrt(sample.wi);
                let weight = sample.mis_weight(seen.pdf(sample.wi), pdf_scattering);
                let medium = medium_toward(sample.wi, self.medium);
                self.add_light::<VOLUMETRIC>(&sample, f, (weight, pdf_scattering), medium);
            }
        }
        let (u_lobe, u) = (self.sampler.get_1d(), self.sampler.get_2d());
        let sample = seen.sample(u_lobe, u, TransportMode::Radiance)?;
        self.beta *= sample.weight;
        if self.beta.is_black() {
            return None;
        }
        self.origin = if sample.specular {
            Origin::Certain
        } else {
            let sent = self.carried();
            self.sent_first.get_or_insert(sent);
            Origin::Drawn {
                at,
                pdf_w: sample.pdf_w,
                pdf_scattering: if world.facts().needs_pdf_scattering(VOLUMETRIC) {
                    seen.pdf_in_pbrt(sample.wi)
                } else {
                    0.0
                },
            }
        };
        self.eta_scale *= sample.eta_scale;
        self.medium = medium_toward(sample.wi, self.medium);
        self.ray = spawn_ray(
            surface.p,
            surface.p_err,
            surface.ng,
            sample.wi,
            self.ray.time,
        );
        self.see(|state| Event::Scattered {
            wi: sample.wi,
            pdf_w: (!sample.specular).then_some(sample.pdf_w),
            weight: sample.weight,
            transmitted: Some(sample.transmitted),
            medium: state.medium,
        });
        Some(sample.transmitted)
    }

    /// Adds light that was sampled, if it is seen, by its MIS weight and the density of the direction in pbrt-v3's BSDF
    /// sampling; `f` includes the cosine.
    fn add_light<const VOLUMETRIC: bool>(
        &mut self,
        sample: &LightSample,
        f: Rgb,
        (mut weight, pdf_scattering): (f32, impl FnOnce() -> f32),
        mut medium: MediumId,
    ) {
        let beta = self.beta;
        // First what is near 1: the product of all but the density may overflow.
        let weighed = |weight: f32| beta * f * (sample.radiance * (weight / sample.pdf));
        let mut contribution = weighed(weight);
        let mut transmittance = None;
        if !contribution.is_black() {
            let tr = self.transmittance::<VOLUMETRIC>(sample, &mut medium);
            if !tr.is_black() {
                if VOLUMETRIC
                    && self.world.is_endless(medium)
                    && let Some(endless) = sample.endless_weight(self.world, pdf_scattering)
                {
                    weight = endless;
                    contribution = weighed(weight);
                }
                self.radiance += contribution * tr;
            }
            transmittance = Some(tr);
        }
        self.see(|_| Event::Sampled {
            wi: sample.wi,
            radiance: sample.radiance,
            pdf: sample.pdf,
            f,
            weight,
            transmittance,
            added: transmittance.map_or(Rgb::BLACK, |tr| contribution * tr),
        });
    }

    /// The part of light that was sampled which arrives.
    #[inline]
    fn transmittance<const VOLUMETRIC: bool>(
        &mut self,
        sample: &LightSample,
        medium: &mut MediumId,
    ) -> Rgb {
        if VOLUMETRIC {
            let (world, rng) = (self.world, &mut self.rng);
            let tally = &mut self.counters.shadow;
            if self.past_walls {
                world.transmittance_past_walls(sample, *medium, rng, tally)
            } else {
                world.transmittance(sample, medium, rng, tally)
            }
        } else {
            self.counters.shadow.rays += 1;
            if self.world.is_occluded(sample) {
                Rgb::BLACK
            } else {
                Rgb::ONE
            }
        }
    }
}

/// Distance `t` to a collision before the wall at `hit`, moved off the wall where rounding could carry the point
/// through it: the path would go on in a medium it has left.
pub(in crate::integrator) fn stay_inside(world: &World, ray: &Ray, t: f32, hit: &Hit) -> f32 {
    let end = hit.at.t;
    let size = ray.o.0.abs().max_element() + end;
    // Far from the wall at any angle that matters: most collisions end here.
    if end - t > NEAR_WALL * size {
        return t;
    }
    let Place {
        p,
        p_err,
        n_surface,
        ..
    } = world.place(ray, hit);
    let rounding = p_err.0 + p.0.abs() * (2.0 * EPSILON) + size * (2.0 * EPSILON);
    let reach = n_surface.0.abs().dot(rounding) / n_surface.abs_dot(ray.d);
    if end - t > reach {
        t
    } else {
        (end - 2.0 * reach).max(0.5 * end)
    }
}
