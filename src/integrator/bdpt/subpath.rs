//! Paths from either end, through media and null surfaces.

use crate::camera::RayDifferential;
use crate::ids::{LightId, MediumId};
use crate::integrator::bdpt::vertex::{Kind, Vertex, density_at};
use crate::integrator::bdpt::{Numbers, Tracer};
use crate::integrator::footprint::texture_context;
use crate::integrator::path::stay_inside;
use crate::light::{Light, Wanted};
use crate::math::{Normal3, Point3, Ray, Vec3};
use crate::medium::MediumEvent;
use crate::scatter::TransportMode;
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::world::{Hit, LampPoint, World, spawn_ray};

/// Vertices after which Russian roulette may end a path. Weights need not know: each strategy keeps its expectation, and
/// the weights of all of them still sum to 1.
const ROULETTE_AFTER: usize = 16;
/// Greatest probability with which roulette lets a path live: paths among white walls end.
const MAX_SURVIVAL: f32 = 0.95;

/// A light that the camera path meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub(super) light: LightId,
    /// Vertices of the camera path before it.
    pub(super) n_before: usize,
    /// Where; meaningless for a light infinitely far away.
    pub(super) p: Point3,
    /// Normal of the surface there.
    pub(super) ng: Normal3,
    /// Direction of the path.
    pub(super) d: Vec3,
    /// What the path carries, times the radiance.
    pub(super) radiance: Rgb,
    /// Density with which the path meets it; per solid angle if infinitely far away.
    pub(super) pdf_own: f64,
    /// It is a sky beyond a medium without end.
    pub(super) is_endless: bool,
}

/// Which end a path starts at.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Side {
    Camera,
    Light,
}

/// The end of a path that grows.
struct Head<'d> {
    from: Side,
    ray: Ray,
    /// Its neighbours, until it first meets anything.
    differential: Option<&'d RayDifferential>,
    beta: Rgb,
    /// Density of its direction.
    pdf: f64,
    medium: MediumId,
    /// It has met a surface in a medium that this does not border on.
    is_misled: bool,
    /// Most vertices of the path.
    limit: usize,
    /// Lights that are met count, also behind the last vertex.
    looks_for_light: bool,
}

impl<'a> Tracer<'a> {
    /// A camera path of up to `limit` vertices, the camera included, and if `looks_for_light` the lights it meets.
    pub(super) fn trace_camera_to(
        &mut self,
        limit: usize,
        looks_for_light: bool,
        ray: Ray,
        differential: Option<&RayDifferential>,
        numbers: &mut impl Numbers,
    ) {
        let medium = self.world.camera_medium();
        self.camera_path
            .push(Vertex::start(Kind::Camera, ray.o, medium));
        let pdf_w = self.film.map_or(1.0, |camera| camera.pdf_w(&ray));
        let head = Head {
            from: Side::Camera,
            ray,
            differential,
            beta: Rgb::ONE,
            pdf: pdf_w,
            medium,
            is_misled: false,
            limit,
            looks_for_light: looks_for_light && self.emitters.any_met,
        };
        let mut path = std::mem::take(&mut self.camera_path);
        self.walk(head, &mut path, numbers);
        self.camera_path = path;
    }

    /// A light path of up to `limit` vertices, the point on the light included.
    pub(super) fn trace_light_to(&mut self, limit: usize, numbers: &mut impl Numbers) {
        let Some((index, pmf)) = self.emitters.choice.sample(numbers.get_1d_fine()) else {
            return;
        };
        let light = LightId::new(index);
        // What makes no difference takes no number: the first are the best laid out.
        let is_point = self.world.light(light).position().is_some();
        let u_pos = if is_point { [0.5; 2] } else { numbers.get_2d() };
        let u_dir = numbers.get_2d();
        let (world, emitters) = (self.world, self.emitters);
        let Some(sample) = emitters.sample_emission(world, light, u_pos, u_dir, self.time) else {
            return;
        };
        let kind = Kind::of_light(self.world, light);
        let is_far = matches!(kind, Kind::FarLight(_));
        if !self.world.sends_light_paths(light) {
            return;
        }
        self.starts_in_hole = sample.is_hole;
        let mut start = Vertex::start(kind, sample.p, sample.medium);
        (start.p_err, start.ng, start.wo) = (sample.p_err, sample.ng, -sample.d);
        self.light_path.push(start);
        let cos = if sample.ng == Normal3::ZERO {
            1.0
        } else {
            sample.ng.abs_dot(sample.d)
        };
        let density = f64::from(pmf) * f64::from(sample.pdf_pos) * f64::from(sample.pdf_dir);
        let mut beta = sample.radiance * ((f64::from(cos) / density) as f32);
        let ray = spawn_ray(sample.p, sample.p_err, sample.ng, sample.d, self.time);
        if is_far {
            // Light from far away has come through what fills all space before it gets where it starts.
            if sample.medium.is_some() {
                let back = Ray { d: -ray.d, ..ray };
                let medium = self.world.medium(sample.medium);
                beta *= medium.transmittance(&back, f32::INFINITY, &mut self.rng);
            }
        }
        let head = Head {
            from: Side::Light,
            ray,
            differential: None,
            beta,
            pdf: f64::from(sample.pdf_dir),
            medium: sample.medium,
            is_misled: false,
            limit,
            looks_for_light: false,
        };
        let mut path = std::mem::take(&mut self.light_path);
        self.walk(head, &mut path, numbers);
        if let [start, next, ..] = &mut path[..] {
            let toward = start.wo;
            self.light_direct = self.direct_density(light, start.p, start.ng, next, toward);
        }
        self.light_path = path;
    }

    fn walk(&mut self, mut head: Head, path: &mut Vec<Vertex<'a>>, numbers: &mut impl Numbers) {
        let world = self.world;
        let mut crossings = 0;
        while !head.beta.is_black() && (head.looks_for_light || path.len() < head.limit) {
            if self.counters.next_ray() {
                return;
            }
            let hit = world.closest(&head.ray, f32::INFINITY);
            if hit.is_none() && world.is_bounded(head.medium) {
                self.counters.leaked_paths += 1;
            }
            if head.medium.is_some() {
                let t_max = hit.map_or(f32::INFINITY, |hit| hit.at.t);
                let medium = world.medium(head.medium);
                match medium.sample(&head.ray, t_max, head.beta, None, &mut self.rng) {
                    MediumEvent::Pass { weight } => head.beta *= weight,
                    MediumEvent::Scatter { t, weight } => {
                        head.beta *= weight;
                        head.differential = None;
                        if path.len() >= head.limit || head.beta.is_black() {
                            return;
                        }
                        self.counters.medium_scatterings += 1;
                        let t = hit.map_or(t, |hit| stay_inside(world, &head.ray, t, &hit));
                        let p = head.ray.at(t);
                        let mut vertex =
                            Vertex::start(Kind::Medium(medium.phase()), p, head.medium);
                        (vertex.wo, vertex.beta) = (-head.ray.d, head.beta);
                        if !self.scatter(&mut head, path, vertex, numbers) {
                            return;
                        }
                        crossings = 0;
                        continue;
                    }
                }
                if head.beta.is_black() {
                    return;
                }
            }
            let Some(hit) = hit else {
                if head.looks_for_light {
                    self.meet_environment(&head, path.len());
                }
                return;
            };
            let surface = world.surface(&head.ray, &hit);
            if head.looks_for_light {
                self.meet_emitter(&head, &hit, &surface, path);
                world.for_other_lamps(&head.ray, &hit, |lamp| {
                    let surface = world.surface(&head.ray, lamp);
                    self.meet_emitter(&head, lamp, &surface, path);
                });
            }
            let geometry = world.geometry(hit.target.geometry);
            let material = geometry.material;
            if !material.is_some() {
                crossings += 1;
                // Footprints are not known behind null surfaces, as in pbrt-v3.
                head.differential = None;
                if crossings > world.max_crossings() {
                    self.counters.stuck_paths += 1;
                    return;
                }
                let (behind, n_mismatched) =
                    world.medium_behind_null(&head.ray, &hit, &surface.into(), head.medium);
                self.counters.mismatched_media += n_mismatched;
                head.medium = behind;
                let d = head.ray.d;
                head.ray = spawn_ray(
                    surface.p,
                    surface.p_err,
                    surface.n_surface,
                    d,
                    head.ray.time,
                );
                continue;
            }
            let one_way = geometry.shape.is_one_way();
            // Seen from here it is not the surface that the camera sees, or lets rays go elsewhere.
            if path.len() >= head.limit || one_way && matches!(head.from, Side::Light) {
                return;
            }
            crossings = 0;
            let ctx = texture_context(&surface, head.differential.take());
            if self.footprint_step.is_some() && matches!(head.from, Side::Light) {
                self.light_surfaces.push((path.len(), surface));
            }
            let bsdf = world
                .materials()
                .bsdf(material, &surface, &ctx, world.textures());
            let mut vertex = Vertex::start(Kind::Surface(bsdf), surface.p, head.medium);
            (vertex.p_err, vertex.ng) = (surface.p_err, surface.ng);
            (vertex.wo, vertex.beta) = (-head.ray.d, head.beta);
            vertex.hit = Some(hit);
            vertex.medium_through = world.medium_through_stack(&head.ray, &hit, head.medium);
            if vertex.medium_through.is_none() {
                let (met, d) = ((&hit, surface.ng), head.ray.d);
                let is_misled = &mut head.is_misled;
                self.counters.meet(world, met, d, head.medium, is_misled);
            }
            vertex.one_way = one_way;
            if !self.scatter(&mut head, path, vertex, numbers) {
                return;
            }
        }
    }

    /// Adds a vertex to a path and turns its head to a new direction. False where the path ends.
    fn scatter(
        &mut self,
        head: &mut Head,
        path: &mut Vec<Vertex<'a>>,
        mut vertex: Vertex<'a>,
        numbers: &mut impl Numbers,
    ) -> bool {
        let (wo, time) = (vertex.wo, head.ray.time);
        let (u_lobe, u) = (numbers.get_1d(), numbers.get_2d());
        let is_second = path.len() == 1;
        let Some(before) = path.last_mut() else {
            return false;
        };
        vertex.pdf_own = match before.kind {
            Kind::FarLight(_) => far_density(self.world, vertex.p, vertex.ng, head.ray.d),
            _ => vertex.density(before.p, head.pdf),
        };
        let next = match &vertex.kind {
            Kind::Surface(bsdf) => {
                let mode = match head.from {
                    Side::Camera => TransportMode::Radiance,
                    Side::Light => TransportMode::Importance,
                };
                bsdf.sample(wo, u_lobe, u, mode).map(|sample| {
                    let weight = match head.from {
                        Side::Camera => sample.weight,
                        Side::Light if sample.specular => {
                            let cos = bsdf.abs_cos(sample.wi);
                            let correction = vertex.adjoint_cos(bsdf, sample.wi) / cos;
                            if cos > 0.0 {
                                sample.weight * correction
                            } else {
                                Rgb::BLACK
                            }
                        }
                        Side::Light => vertex.passes_to(sample.wi) * (1.0 / sample.pdf_w),
                    };
                    (sample.wi, weight, f64::from(sample.pdf_w), sample.specular)
                })
            }
            Kind::Medium(phase) => {
                let (wi, pdf_w) = phase.sample(wo, u);
                Some((wi, Rgb::ONE, f64::from(pdf_w), phase.is_delta()))
            }
            Kind::Camera | Kind::Light(_) | Kind::FarLight(_) => None,
        };
        let Some((wi, weight, pdf_w, specular)) = next else {
            path.push(vertex);
            return false;
        };
        vertex.specular = specular;
        if matches!(head.from, Side::Light) && self.world.facts().has_asymmetric_lamps {
            head.beta *= lamp_factor(
                self.world,
                before,
                self.starts_in_hole,
                &vertex,
                wi,
                specular,
            );
        }
        before.pdf_other = if specular {
            0.0
        } else {
            let pdf_back = vertex.pdf_w(wi, wo);
            // Camera paths would not go on here: see the module.
            if matches!(head.from, Side::Light) && !is_second && !(pdf_back > 0.0) {
                path.push(vertex);
                return false;
            }
            before.density(vertex.p, pdf_back)
        };
        head.beta *= weight;
        head.pdf = pdf_w;
        head.medium = vertex.medium_toward(self.world, wi);
        head.ray = spawn_ray(vertex.p, vertex.p_err, vertex.ng, wi, time);
        path.push(vertex);
        self.survives(head, path)
    }

    /// Russian roulette for long paths.
    fn survives(&mut self, head: &mut Head, path: &[Vertex]) -> bool {
        if path.len() <= ROULETTE_AFTER {
            return true;
        }
        let reference = path[ROULETTE_AFTER / 2].beta.max_component();
        let survival = (head.beta.max_component() / reference).min(MAX_SURVIVAL);
        let lives = self.rng.uniform() < survival;
        if lives {
            head.beta *= 1.0 / survival;
        }
        lives
    }

    fn meet_environment(&mut self, head: &Head, n_before: usize) {
        for &light in &self.emitters.infinite {
            if let Light::Infinite(infinite) = self.world.light(light) {
                let radiance = head.beta * infinite.le(head.ray.d);
                if !radiance.is_black() {
                    self.ends.push(End {
                        light,
                        n_before,
                        p: head.ray.o,
                        ng: Normal3::ZERO,
                        d: head.ray.d,
                        radiance,
                        pdf_own: head.pdf,
                        is_endless: self.world.is_endless(head.medium),
                    });
                }
            }
        }
    }

    fn meet_emitter(&mut self, head: &Head, hit: &Hit, surface: &SurfacePoint, path: &[Vertex]) {
        let Some(before) = path.last() else {
            return;
        };
        let d = head.ray.d;
        let emitted =
            if path.len() == 1 || before.specular || !self.world.facts().has_asymmetric_lamps {
                self.world.emitted(hit, surface, -d)
            } else {
                let at = before.receiver(self.time);
                let pdf_scattering = || before.pdf_in_pbrt(before.wo, d);
                self.world
                    .emitted_onto(&at, pdf_scattering, hit, surface, -d)
            };
        if let Some((light, le)) = emitted
            && !le.is_black()
        {
            self.ends.push(End {
                light,
                n_before: path.len(),
                p: surface.p,
                ng: surface.n_surface,
                d,
                radiance: head.beta * le,
                pdf_own: density_at(surface.p, surface.n_surface, before.p, head.pdf),
                is_endless: false,
            });
        }
    }

    /// Density, at a place of the light, with which light sampling at `receiver` draws the point `p` of a light, in
    /// the unit direction `toward` it; per solid angle for a light infinitely far away.
    pub(super) fn direct_density(
        &self,
        light: LightId,
        p: Point3,
        ng: Normal3,
        receiver: &Vertex,
        toward: Vec3,
    ) -> f64 {
        let pmf = f64::from(self.world.light_pmf(&receiver.receiver(self.time), light));
        let density = match self.world.light(light) {
            Light::Infinite(infinite) => f64::from(infinite.pdf_w(toward, Wanted::All)),
            Light::Area(area) => {
                let shape = &self.world.geometry(area.geometry).shape;
                let pdf_w = shape.pdf_toward(area.element, receiver.p, p, ng);
                density_at(p, ng, receiver.p, f64::from(pdf_w))
            }
            Light::Point(_)
            | Light::Spot(_)
            | Light::Projection(_)
            | Light::Goniometric(_)
            | Light::Distant(_) => 1.0,
        };
        pmf * density
    }

    /// Densities with which a light path starts at `p`, where the normal is `ng`, and finds `next` in the unit
    /// direction `d`.
    pub(super) fn emission_densities(
        &self,
        light: LightId,
        p: Point3,
        ng: Normal3,
        next: &Vertex,
        d: Vec3,
    ) -> (f64, f64) {
        let pmf = f64::from(self.emitters.choice.pmf(light.index()));
        let (pdf_pos, pdf_dir) = self.emitters.pdf_emission(self.world, light, p, ng, d);
        let (pdf_pos, pdf_dir) = (f64::from(pdf_pos), f64::from(pdf_dir));
        let from_afar = || far_density(self.world, next.p, next.ng, d);
        match self.world.light(light) {
            _ if !self.world.sends_light_paths(light) => (0.0, 0.0),
            Light::Distant(_) => (pmf, from_afar()),
            Light::Infinite(_) => (pmf * pdf_dir, from_afar()),
            Light::Area(_) => (pmf * pdf_pos, next.density(p, pdf_dir)),
            Light::Point(_) | Light::Spot(_) | Light::Projection(_) | Light::Goniometric(_) => {
                (pmf, next.density(p, pdf_dir))
            }
        }
    }
}

/// The part of an asymmetric lamp's radiance that the second vertex of a light path sends on toward `wi`, specularly or not.
pub(super) fn lamp_factor(
    world: &World,
    start: &Vertex,
    is_hole: bool,
    vertex: &Vertex,
    wi: Vec3,
    specular: bool,
) -> f32 {
    let Kind::Light(light) = start.kind else {
        return 1.0;
    };
    let lamp = LampPoint {
        light,
        p: start.p,
        ng: start.ng,
        is_hole,
    };
    let pdf_scattering = || vertex.pdf_in_pbrt(wi, vertex.wo);
    world.lamp_factor(&lamp, vertex.p, -vertex.wo, specular, pdf_scattering)
}

/// Density of a point, per area where the normal is `ng` or per volume where it is zero, for light from far away.
fn far_density(world: &World, p: Point3, ng: Normal3, d: Vec3) -> f64 {
    if world.is_before_scene(p, d) {
        return 0.0;
    }
    let pdf_across = world.pdf_far_line(p, d);
    if ng == Normal3::ZERO {
        pdf_across
    } else {
        pdf_across * ng.to_f64().dot(d.to_f64()).abs()
    }
}
