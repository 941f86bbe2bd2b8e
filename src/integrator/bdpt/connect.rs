//! The strategies: how a path is found as a whole from two parts.

use crate::camera::{Arrival, Camera};
use crate::integrator::bdpt::strategy::Contribution;
use crate::integrator::bdpt::subpath::{End, lamp_factor};
use crate::integrator::bdpt::vertex::{Kind, Vertex};
use crate::integrator::bdpt::weights::{Density, Ends, weight};
use crate::integrator::bdpt::{Numbers, Tracer};
use crate::integrator::footprint::texture_context;
use crate::light::Light;
use crate::math::{Ray, Vec3};
use crate::world::Hit;

impl<'a> Tracer<'a> {
    /// The camera path meets a light: no vertex of the light path.
    pub(super) fn end(&mut self, index: usize) -> Contribution {
        let End {
            light,
            n_before,
            p,
            ng,
            d,
            radiance,
            pdf_own,
            is_endless,
        } = self.ends[index];
        let found = |weight: f64| Contribution {
            carried: radiance,
            factor: 1.0,
            weighted_factor: weight,
        };
        if n_before == 1 {
            return found(1.0);
        }
        let before = &self.camera_path[n_before - 1];
        if is_endless {
            let pdf_scattering = || before.pdf_in_pbrt(before.wo, d);
            let weights = self.world.endless_weights(light, d, pdf_scattering);
            let of_scattering = weights.map_or(1.0, |[_, of_scattering]| of_scattering);
            return found(if before.specular {
                1.0
            } else {
                of_scattering.into()
            });
        }
        let (emitted, other) = self.emission_densities(light, p, ng, before, -d);
        let ends = Ends {
            direct: self.direct_density(light, p, ng, before, d),
            emitted,
            is_delta_light: false,
            reaches_film: self.film.is_some(),
            steadiness: 1.0,
        };
        self.densities.clear();
        self.densities.push(Density {
            light: 0.0,
            camera: pdf_own,
            specular: false,
            one_way: false,
        });
        self.push_camera_path(n_before);
        self.densities[1].light = other;
        found(weight(&self.densities, &ends, 0))
    }

    /// The last of `t` vertices of the camera path looks for a point on a light.
    pub(super) fn direct(&mut self, t: usize, numbers: &mut impl Numbers) -> Contribution {
        let (u_light, u) = (numbers.get_1d_fine(), numbers.get_2d());
        if t >= self.max_depth + 2 || !self.camera_path[t - 1].connects() {
            return Contribution::NONE;
        }
        let vertex = &self.camera_path[t - 1];
        let at = vertex.receiver(self.time);
        let Some((light, pmf)) = self.world.choose_light(&at, u_light) else {
            return Contribution::NONE;
        };
        let Some(sample) = self.world.sample_on_light(light, pmf, &at, u) else {
            return Contribution::NONE;
        };
        let (wi, wo) = (sample.wi, vertex.wo);
        let pdf_scattering = || vertex.pdf_in_pbrt(wo, wi);
        let lit = sample.radiance * sample.radiance_factor(pdf_scattering);
        let found = vertex.beta * vertex.passes_from(wi) * lit;
        if found.is_black() {
            return Contribution::NONE;
        }
        let (emitted, other) = self.emission_densities(light, sample.p, sample.ng, vertex, -wi);
        let direct = self.direct_density(light, sample.p, sample.ng, vertex, wi);
        let steadiness = if t == 2 {
            self.steadiness(light, vertex, direct)
        } else {
            1.0
        };
        let ends = Ends {
            direct,
            emitted,
            is_delta_light: sample.is_hidden_from_rays(),
            reaches_film: self.film.is_some(),
            steadiness,
        };
        let kind = Kind::of_light(self.world, light);
        let mut on_light = Vertex::start(kind, sample.p, vertex.medium);
        on_light.ng = sample.ng;
        let camera = on_light.density(vertex.p, vertex.pdf_w(wo, wi));
        let back = vertex.pdf_w(wi, wo);
        let mut medium = vertex.medium_toward(self.world, wi);
        self.densities.clear();
        self.densities.push(Density {
            light: 0.0,
            camera,
            specular: false,
            one_way: false,
        });
        self.push_camera_path(t);
        self.densities[1].light = other;
        self.densities[1].specular = false;
        self.set_back(t, 1, back);
        let pdf = f64::from(sample.pdf);
        let mut weight = weight(&self.densities, &ends, 1);
        if weight / pdf == 0.0 {
            return Contribution::NONE;
        }
        let (rng, tally) = (&mut self.rng, &mut self.counters.shadow);
        let tr = self.world.transmittance(&sample, &mut medium, rng, tally);
        if self.world.is_endless(medium) {
            let vertex = &self.camera_path[t - 1];
            let pdf_scattering = || vertex.pdf_in_pbrt(wo, wi);
            let endless = sample.endless_weight(self.world, pdf_scattering);
            weight = endless.map_or(weight, f64::from);
        }
        Contribution {
            carried: found * tr,
            factor: 1.0 / pdf,
            weighted_factor: weight / pdf,
        }
    }

    /// Joins the last of `s` ≥ 2 vertices of the light path with the last of `t` ≥ 2 of the camera path.
    pub(super) fn connect(&mut self, s: usize, t: usize) -> Contribution {
        let (light, camera) = (&self.light_path[s - 1], &self.camera_path[t - 1]);
        if !light.connects() || !camera.connects() {
            return Contribution::NONE;
        }
        let Some(wi) = (light.p - camera.p).try_normalize() else {
            return Contribution::NONE;
        };
        let passed = camera.passes_from(wi) * light.passes_to(-wi);
        let found = passed * light.beta * camera.beta * self.factor_of_start(s, light, -wi);
        if found.is_black() {
            return Contribution::NONE;
        }
        let d = light.p.to_f64() - camera.p.to_f64();
        let to_camera = camera.density(light.p, light.pdf_w(light.wo, -wi));
        let (pdf_on, pdf_behind) = (camera.pdf_w(camera.wo, wi), light.pdf_w(-wi, light.wo));
        if !(pdf_on > 0.0) || s > 2 && !(pdf_behind > 0.0) {
            return Contribution::NONE;
        }
        let to_light = light.density(camera.p, pdf_on);
        let camera_back = camera.pdf_w(wi, camera.wo);
        let light_back = self.light_path[s - 2].density(light.p, pdf_behind);
        let segment = camera.segment_to(light, self.time);
        let medium = camera.medium_toward(self.world, wi);
        let ends = self.light_ends();
        self.push_light_path(s);
        self.densities[s - 1].camera = to_light;
        self.densities[s - 1].specular = false;
        self.densities[s - 2].camera = light_back;
        self.push_camera_path(t);
        self.densities[s].light = to_camera;
        self.densities[s].specular = false;
        self.set_back(t, s, camera_back);
        let weighted_factor = weight(&self.densities, &ends, s) / d.length_squared();
        let (Some(segment), true) = (segment, weighted_factor > 0.0) else {
            return Contribution::NONE;
        };
        let tally = &mut self.counters.shadow;
        let tr = self
            .world
            .transmittance_along(&segment, &mut { medium }, &mut self.rng, tally);
        Contribution {
            carried: found * tr,
            factor: 1.0 / d.length_squared(),
            weighted_factor,
        }
    }

    /// The last of `s` ≥ 2 vertices of the light path looks for the camera: where on the film, and what it adds to the
    /// mean over the frame.
    pub(super) fn splat(
        &mut self,
        s: usize,
        numbers: &mut impl Numbers,
    ) -> Option<([f64; 2], Contribution)> {
        let u_lens = numbers.get_2d();
        let camera = self.film?;
        let vertex = &self.light_path[s - 1];
        if !vertex.connects() {
            return None;
        }
        let arrival = camera
            .sample_arrival(vertex.p, u_lens, self.time)
            .filter(|arrival| arrival.in_frame)?;
        let w = (arrival.p - vertex.p).try_normalize()?;
        let seen = self.seen_by(camera, &arrival, u_lens, s, w);
        let vertex = seen.as_ref().unwrap_or(&self.light_path[s - 1]);
        let found = vertex.beta * vertex.passes_to(w) * self.factor_of_start(s, vertex, w);
        if found.is_black() {
            return None;
        }
        let d = vertex.p.to_f64() - arrival.p.to_f64();
        let from_camera = vertex.density(arrival.p, arrival.pdf_w);
        let pdf_behind = vertex.pdf_w(w, vertex.wo);
        if s > 2 && !(pdf_behind > 0.0) {
            return None;
        }
        let back = self.light_path[s - 2].density(vertex.p, pdf_behind);
        let medium = self.world.camera_medium();
        let lens = Vertex::start(Kind::Camera, arrival.p, medium);
        let segment = lens.segment_to(vertex, self.time);
        let mut ends = self.light_ends();
        if s == 2
            && let Kind::Light(light) | Kind::FarLight(light) = self.light_path[0].kind
        {
            ends.steadiness = self.steadiness(light, vertex, ends.direct);
        }
        self.push_light_path(s);
        self.densities[s - 1].camera = from_camera;
        self.densities[s - 1].specular = false;
        self.densities[s - 2].camera = back;
        self.densities.push(Density {
            light: 0.0,
            camera: 0.0,
            specular: false,
            one_way: false,
        });
        let importance = arrival.pdf_w / d.length_squared();
        let weighted_factor = weight(&self.densities, &ends, s) * importance;
        let segment = segment?;
        if weighted_factor == 0.0 {
            return None;
        }
        let tally = &mut self.counters.shadow;
        let tr = self
            .world
            .transmittance_along(&segment, &mut { medium }, &mut self.rng, tally);
        let found = Contribution {
            carried: found * tr,
            factor: importance,
            weighted_factor,
        };
        (!found.weighted().is_black()).then_some((arrival.raster, found))
    }

    /// The last of `s` vertices of the light path as the camera sees it, from the direction `w`: with the footprint of
    /// the pixel it comes to. `None` if it is as it is without.
    fn seen_by(
        &self,
        camera: &Camera,
        arrival: &Arrival,
        u_lens: [f32; 2],
        s: usize,
        w: Vec3,
    ) -> Option<Vertex<'a>> {
        let step = self.footprint_step?;
        let world = self.world;
        let vertex = &self.light_path[s - 1];
        let (_, surface) = self.light_surfaces.iter().find(|(i, _)| *i == s - 1)?;
        let material_of = |hit: Hit| world.geometry(hit.target.geometry).material;
        let material = material_of(vertex.hit?);
        // Footprints are not known behind null surfaces.
        if world.facts().has_null_surfaces {
            let ray = Ray {
                o: arrival.p,
                d: -w,
                time: self.time,
            };
            let first = world.closest(&ray, (vertex.p - arrival.p).length());
            if first.is_some_and(|hit| !material_of(hit).is_some()) {
                return None;
            }
        }
        let differential = camera.differential_at(arrival.raster, u_lens, self.time, step)?;
        let ctx = texture_context(surface, Some(&differential));
        let bsdf = world
            .materials()
            .bsdf(material, surface, &ctx, world.textures());
        Some(Vertex {
            kind: Kind::Surface(bsdf),
            ..vertex.clone()
        })
    }

    /// What the light path counts where `vertex`, its last of `s`, sends light toward `w`: an asymmetric lamp counts a part of
    /// its radiance at the second.
    fn factor_of_start(&self, s: usize, vertex: &Vertex, w: Vec3) -> f32 {
        if s != 2 || !self.world.facts().has_asymmetric_lamps {
            return 1.0;
        }
        let start = &self.light_path[0];
        lamp_factor(self.world, start, self.starts_in_hole, vertex, w, false)
    }

    /// What is particular at the ends of paths that start with the first two vertices of the light path.
    fn light_ends(&self) -> Ends {
        let (start, next) = (&self.light_path[0], &self.light_path[1]);
        let (emitted, is_delta_light) = match start.kind {
            Kind::Light(light) | Kind::FarLight(light) => {
                let (emitted, _) =
                    self.emission_densities(light, start.p, start.ng, next, -start.wo);
                let is_delta =
                    !matches!(self.world.light(light), Light::Area(_) | Light::Infinite(_));
                (emitted, is_delta || self.starts_in_hole)
            }
            Kind::Camera | Kind::Surface(_) | Kind::Medium(_) => (0.0, true),
        };
        Ends {
            direct: self.light_direct,
            emitted,
            is_delta_light,
            reaches_film: self.film.is_some(),
            steadiness: 1.0,
        }
    }

    /// Starts the list of densities with `s` vertices of the light path.
    fn push_light_path(&mut self, s: usize) {
        self.densities.clear();
        let vertices = self.light_path[..s].iter();
        self.densities.extend(vertices.map(|vertex| Density {
            light: vertex.pdf_own,
            camera: vertex.pdf_other,
            specular: vertex.specular,
            one_way: vertex.one_way,
        }));
    }

    /// Ends it with `t` vertices of the camera path.
    fn push_camera_path(&mut self, t: usize) {
        let vertices = self.camera_path[..t].iter().rev();
        self.densities.extend(vertices.map(|vertex| Density {
            light: vertex.pdf_other,
            camera: vertex.pdf_own,
            specular: vertex.specular,
            one_way: vertex.one_way,
        }));
    }

    /// The density of the second of the last `t` vertices, which follow `s` others, for a path that comes from those
    /// and scatters at the first with density `pdf_w`.
    fn set_back(&mut self, t: usize, s: usize, pdf_w: f64) {
        if t > 2 {
            let (before, vertex) = (&self.camera_path[t - 2], &self.camera_path[t - 1]);
            self.densities[s + 1].light = before.density(vertex.p, pdf_w);
        }
    }
}
