//! Stochastic progressive photon mapping (Hachisuka and Jensen 2009; pbrt 3rd ed., section 16.2). Scene-file manual
//! (`sppm`):
//!
//! | parameter | default | meaning |
//! |---|---|---|
//! | `integer iterations` | 64 | camera paths for each pixel, and passes of photons |
//! | `integer maxdepth` | 5 | vertices of a camera path, and of a photon's path |
//! | `integer photonsperiteration` | −1 | photons of a pass; 0 or less is one for each pixel of the full frame |
//! | `float radius` | 1 | first search radius, in world units |
//! | `integer imagewritefrequency` | none | accepted; one picture is written, after the last iteration |
//!
//! Surfaces only: media are ignored, and null surfaces are passed by rays and block light sampling, as in `path`.
//!
//! This file knows one path of either kind, and how a pixel's estimate goes on from one iteration to the next. Photons
//! are stored, sorted, and looked up from the ends of camera paths, so that a pixel's sum has one order whatever else
//! is rendered, and nothing but the pixel itself is written to.

use crate::accel::PointTree;
use crate::camera::RayDifferential;
use crate::ids::LightId;
use crate::integrator::Counters;
use crate::integrator::direct_light::{LitPoint, OneLightNumbers};
use crate::integrator::footprint::texture_context;
use crate::integrator::visible::{Visible, nearest_visible};
use crate::light::LightChoice;
use crate::math::{Normal3, Point3, Ray, Vec3};
use crate::sampler::Sampler;
use crate::scatter::{Bsdf, TransportMode};
use crate::shape::SurfacePoint;
use crate::spectrum::Rgb;
use crate::world::{LampPoint, World, spawn_ray};

/// Camera paths of less throughput than this are subject to Russian roulette.
const ROULETTE_BELOW: f32 = 0.25;
/// Part of an iteration's photons that a pixel keeps: γ.
const KEPT: f64 = 2.0 / 3.0;

/// Settings of photon mapping.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sppm {
    /// Vertices of a path.
    pub max_depth: u32,
    /// Photons of an iteration; `None` is one for each pixel of the full frame.
    pub photons_per_iteration: Option<u32>,
    /// First search radius.
    pub radius: f32,
}

/// What a camera path found.
#[derive(Clone, Debug)]
pub struct CameraPath<'a> {
    /// Light seen directly, by specular reflection or refraction, or as direct light.
    pub radiance: Rgb,
    /// Where photons are wanted.
    pub visible_point: Option<VisiblePoint<'a>>,
}

/// The end of a camera path, where indirect light is what photons say.
#[derive(Clone, Debug)]
pub struct VisiblePoint<'a> {
    /// Position.
    pub p: Point3,
    /// Unit direction to where the path came from.
    pub wo: Vec3,
    /// How it scatters.
    pub bsdf: Bsdf<'a>,
    /// What its radiance counts.
    pub beta: Rgb,
}

/// Light that arrives at a surface.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where.
    pub p: Point3,
    /// Unit direction it comes from.
    pub wi: Vec3,
    /// Flux, times |cos| to the shading normal over |cos| to the geometric one: what a surface of the shading normal
    /// would receive.
    pub flux: Rgb,
}

/// Photons, sorted by place.
#[derive(Clone, Debug, Default)]
pub struct PhotonMap {
    tree: PointTree,
    photons: Vec<Photon>,
}

/// Light that photons bring to a visible point, not yet divided by the area they come from.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Gathered {
    /// Sum of flux times BSDF.
    pub phi: [f64; 3],
    /// Number of photons.
    pub n_photons: u64,
}

/// What a pixel knows of its indirect light.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PhotonStatistics {
    /// Search radius.
    radius: f64,
    /// Photons, as if all of them had been found within the radius.
    n_photons: f64,
    /// Their sum of throughput times flux times BSDF, likewise.
    tau: [f64; 3],
}

impl Sppm {
    /// Follows a camera ray to the first diffuse surface, or the last glossy one.
    ///
    /// Where a surface has specular lobes beside others, chance decides which of them the path goes on with.
    pub fn camera_path<'a>(
        &self,
        world: &'a World,
        ray: Ray,
        differential: Option<&RayDifferential>,
        sampler: &mut Sampler,
        counters: &mut Counters,
    ) -> CameraPath<'a> {
        let mut path = CameraPath {
            radiance: Rgb::BLACK,
            visible_point: None,
        };
        let (mut ray, mut differential) = (ray, differential);
        let mut beta = Rgb::ONE;
        // Whether no light sampling looked for what the ray finds.
        let mut is_certain = true;
        for depth in 1..=self.max_depth {
            let Some(seen) = nearest_visible(world, &mut ray, counters) else {
                if is_certain {
                    path.radiance += beta * world.environment(ray.d);
                }
                break;
            };
            if seen.is_behind_null {
                differential = None;
            }
            let Visible { hit, surface, .. } = seen;
            let wo = -ray.d;
            if is_certain && let Some((_, le)) = world.emitted(&hit, &surface, wo) {
                path.radiance += beta * le;
            }
            let material = world.geometry(hit.target.geometry).material;
            let ctx = texture_context(&surface, differential.take());
            let bsdf = world
                .materials()
                .bsdf(material, &surface, &ctx, world.textures());
            let numbers = OneLightNumbers::draw(sampler);
            if bsdf.has_non_specular() {
                let point = LitPoint::new(&ray, &surface, &bsdf);
                path.radiance += beta * point.one_light(world, &numbers, counters);
            }

            let is_last = depth == self.max_depth;
            let ends = bsdf.has_diffuse() || is_last && bsdf.has_non_specular();
            let (u_lobe, u) = (sampler.get_1d(), sampler.get_2d());
            if ends && !bsdf.draws_specular(wo, u_lobe) {
                path.visible_point = Some(VisiblePoint {
                    p: surface.p,
                    wo,
                    beta: beta / (1.0 - bsdf.specular_share(wo)),
                    bsdf,
                });
                break;
            }
            if is_last {
                break;
            }
            let Some(sample) = bsdf.sample(wo, u_lobe, u, TransportMode::Radiance) else {
                break;
            };
            beta *= sample.weight;
            let carried = beta.max_component();
            let u_roulette = sampler.get_1d();
            if carried < ROULETTE_BELOW {
                if !(u_roulette < carried) {
                    break;
                }
                beta *= 1.0 / carried;
            }
            is_certain = sample.specular;
            ray = leave(&surface, sample.wi, ray.time);
        }
        path
    }

    /// Follows a photon from a light chosen among `lights`, and stores it where it arrives indirectly. `shutter` is
    /// when it may fly.
    pub fn trace_photon(
        &self,
        world: &World,
        lights: &LightChoice,
        shutter: [f32; 2],
        sampler: &mut Sampler,
        photons: &mut Vec<Photon>,
        counters: &mut Counters,
    ) {
        let u_light = sampler.get_1d_fine();
        let (u_pos, u_dir, u_time) = (sampler.get_2d(), sampler.get_2d(), sampler.get_1d());
        let time = shutter[0] + (shutter[1] - shutter[0]) * u_time;
        let Some((light, pmf)) = lights.sample(u_light) else {
            return;
        };
        let Some(start) = world.sample_emission(LightId::new(light), u_pos, u_dir, time) else {
            return;
        };
        let cos = if start.ng == Normal3::ZERO {
            1.0
        } else {
            start.ng.abs_dot(start.d)
        };
        // One density after the other: their product may be out of range.
        let mut flux = start.radiance * (cos / start.pdf_dir / start.pdf_pos / pmf);
        let mut ray = spawn_ray(start.p, start.p_err, start.ng, start.d, time);
        for depth in 1..=self.max_depth {
            let Some(Visible { hit, surface, .. }) = nearest_visible(world, &mut ray, counters)
            else {
                return;
            };
            let material = world.geometry(hit.target.geometry).material;
            let ctx = texture_context(&surface, None);
            let bsdf = world
                .materials()
                .bsdf(material, &surface, &ctx, world.textures());
            let wo = -ray.d;
            if surface.shadows_itself(wo) {
                return;
            }
            // A beam is as wide as the geometric normal says, and scatters as the shading normal says (Veach 1997,
            // section 5.3).
            let bend = |w: Vec3| bsdf.abs_cos(w) / surface.n_surface.abs_dot(w);
            let arriving = flux * bend(wo);
            if !arriving.is_finite() {
                return;
            }
            if depth > 1 && bsdf.has_non_specular() {
                photons.push(Photon {
                    p: surface.p,
                    wi: wo,
                    flux: arriving,
                });
            }
            if depth == self.max_depth {
                return;
            }
            let (u_lobe, u) = (sampler.get_1d(), sampler.get_2d());
            let u_roulette = sampler.get_1d();
            let Some(sample) = bsdf.sample(wo, u_lobe, u, TransportMode::Importance) else {
                return;
            };
            let mut scattered = arriving * sample.weight * (1.0 / bend(sample.wi));
            if depth == 1 && world.facts().has_asymmetric_lamps {
                let lamp = LampPoint {
                    light: LightId::new(light),
                    p: start.p,
                    ng: start.ng,
                    is_hole: start.is_hole,
                };
                let pdf_scattering = || bsdf.pdf_in_pbrt(sample.wi, wo);
                let from = surface.p;
                scattered *= world.lamp_factor(&lamp, from, -wo, sample.specular, pdf_scattering);
            }
            // Photons of like flux tell most: what is absorbed ends paths instead of dimming them.
            let survival = (scattered.max_component() / flux.max_component()).min(1.0);
            if !(u_roulette < survival) {
                return;
            }
            flux = scattered * (1.0 / survival);
            ray = leave(&surface, sample.wi, time);
        }
    }
}

fn leave(surface: &SurfacePoint, d: Vec3, time: f32) -> Ray {
    spawn_ray(surface.p, surface.p_err, surface.n_surface, d, time)
}

impl PhotonMap {
    /// Sorts photons.
    pub fn new(photons: &[Photon]) -> Self {
        let places: Vec<Point3> = photons.iter().map(|photon| photon.p).collect();
        let (tree, order) = PointTree::build(&places);
        let photons = order.iter().map(|&i| photons[i as usize]).collect();
        Self { tree, photons }
    }

    /// Adds what the photons within `radius` of a visible point send along its path.
    pub fn gather(&self, at: &VisiblePoint, radius: f32, gathered: &mut Gathered) {
        self.tree.visit_within(at.p, radius, |place| {
            let photon = &self.photons[place];
            let f = at.bsdf.f(at.wo, photon.wi, TransportMode::Radiance);
            add(&mut gathered.phi, photon.flux * f);
            gathered.n_photons += 1;
        });
    }
}

impl PhotonStatistics {
    /// Nothing yet.
    pub fn new(radius: f32) -> Self {
        Self {
            radius: f64::from(radius),
            n_photons: 0.0,
            tau: [0.0; 3],
        }
    }

    /// Search radius of the next iteration.
    pub fn radius(&self) -> f32 {
        self.radius as f32
    }

    /// Adds what an iteration gathered at its visible point, whose radiance counts `beta`, and narrows the search: of
    /// the photons found now, a part is kept, and the radius is what that many need at the density found.
    pub fn update(&mut self, gathered: &Gathered, beta: [f64; 3]) {
        if gathered.n_photons == 0 {
            return;
        }
        let found = gathered.n_photons as f64;
        let n_photons = self.n_photons + KEPT * found;
        let shrinkage = n_photons / (self.n_photons + found);
        let added = beta.iter().zip(gathered.phi).map(|(beta, phi)| beta * phi);
        for (tau, added) in self.tau.iter_mut().zip(added) {
            *tau = (*tau + added) * shrinkage;
        }
        self.n_photons = n_photons;
        self.radius *= shrinkage.sqrt();
    }

    /// Radiance, if `n_emitted` photons were traced.
    pub fn radiance(&self, n_emitted: f64) -> [f64; 3] {
        let area = std::f64::consts::PI * self.radius * self.radius;
        self.tau.map(|c| c / (n_emitted * area))
    }
}

fn add(sum: &mut [f64; 3], rgb: Rgb) {
    for (sum, c) in sum.iter_mut().zip(rgb.to_array()) {
        *sum += f64::from(c);
    }
}
