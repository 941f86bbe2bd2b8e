//! Rays that leave lights, for integrators that follow light.
//!
//! A ray is a point and a direction. Its flux is estimated by `radiance` × |cos(`ng`, `d`)| / (`pdf_pos` × `pdf_dir`),
//! without the cosine where `ng` is zero. Measures, all in render space:
//!
//! | light | `pdf_pos` | `pdf_dir` | `ng` |
//! |---|---|---|---|
//! | area | per area of the surface | sr⁻¹ | the surface's |
//! | point, spot, projection, goniometric | 1: the position is certain | sr⁻¹ | zero; `radiance` is an intensity |
//! | distant | per area across `d` | 1: the direction is certain | `d`; `radiance` is an irradiance |
//! | infinite | the same | sr⁻¹ | `d` |
//!
//! Light from far away is sent across a disk as wide as the scene or, most of it, across one around what camera paths get
//! to ([`World::aim_far_light`]). Its density is the sum over both: of its line alone, wherever on it the ray starts.
//!
//! An asymmetric lamp (see [`crate::world::lamps`]) emits its radiance to both sides, from its holes as well; what arrives is
//! that times a factor that depends on who receives it.
//!
//! On curves the direction is drawn first, and `pdf_pos` is conditional on it.

use std::f32::consts::FRAC_1_PI;
use std::f64::consts::PI;

use glam::DVec3;

use crate::ids::{LightId, MediumId};
use crate::light::{AreaLight, Light, LightChoice, Wanted};
use crate::math::error::EPSILON;
use crate::math::{Bounds3, Frame, Normal3, Point3, Ray, Vec3};
use crate::sampling::warp::{
    UNIFORM_SPHERE_PDF, concentric_disk, cosine_hemisphere, cosine_hemisphere_pdf, uniform_sphere,
};
use crate::shape::{Place, Shape};
use crate::spectrum::Rgb;
use crate::world::{ElementRef, LightStrategy, World, spawn_ray};

/// A ray that leaves a light.
#[derive(Clone, Copy, Debug)]
pub struct EmissionSample {
    /// Where it starts.
    pub p: Point3,
    /// Error box of `p`; zero off surfaces.
    pub p_err: Vec3,
    /// Normal of the surface, or of the disk the ray crosses, along which cosines are measured; zero for a point.
    pub ng: Normal3,
    /// Unit direction.
    pub d: Vec3,
    /// Radiance along the ray; see the module for lights without area or extent.
    pub radiance: Rgb,
    /// Density of the position.
    pub pdf_pos: f32,
    /// Density of the direction.
    pub pdf_dir: f32,
    /// The medium it starts in.
    pub medium: MediumId,
    /// It starts where a mask cuts a hole into a lamp.
    pub is_hole: bool,
}

/// Part of the light from far away that is sent to where camera paths get to.
const AIMED: f32 = 0.95;
/// Spheres that are smaller than that around the scene by less than this are not worth aiming at.
const ABOUT_THE_SAME: f64 = 0.97;
/// In scenes up to so many times as wide as that sphere, rays from far away keep their digits.
const WIDE: f64 = 16.0;
/// Surfaces that may be looked for beyond where light is aimed at.
const MOST_BEYOND: usize = 16;

/// A sphere. Lines that meet it cross the disk through its centre.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    center: DVec3,
    radius: f64,
}

impl Ball {
    /// Area of the disk.
    fn area(&self) -> f64 {
        PI * self.radius * self.radius
    }

    /// Density over that disk of a line toward `d` through `p`, if lines are spread evenly over it. Single precision is
    /// what light paths carry.
    fn pdf(&self, p: DVec3, d: DVec3) -> f64 {
        let offset = p - self.center;
        let aside_squared = (offset - d * offset.dot(d)).length_squared();
        if aside_squared > self.radius * self.radius {
            0.0
        } else {
            f64::from((1.0 / self.area()) as f32)
        }
    }
}

impl World {
    /// Draws a ray that leaves `light` at `time`. `None` where none does.
    pub fn sample_emission(
        &self,
        light: LightId,
        u_pos: [f32; 2],
        u_dir: [f32; 2],
        time: f32,
    ) -> Option<EmissionSample> {
        let from_point = |p: Point3, (d, intensity, pdf_dir): (Vec3, Rgb, f32)| {
            self.emission_from_point(light, p, time, (d, intensity, pdf_dir))
        };
        let from_afar = |d: Vec3, radiance: Rgb, pdf_dir: f32| {
            let (p, pdf_pos) = self.sample_far_line(light, d, u_pos, time);
            EmissionSample {
                p,
                p_err: Vec3::ZERO,
                ng: d.into(),
                d,
                radiance,
                pdf_pos,
                pdf_dir,
                medium: self.light_medium(light),
                is_hole: false,
            }
        };
        let sample = match self.light(light) {
            Light::Point(point) => {
                let d = uniform_sphere(u_dir);
                from_point(point.p, (d, point.intensity, UNIFORM_SPHERE_PDF))
            }
            Light::Spot(spot) => from_point(spot.position(), spot.sample_direction(u_dir)?),
            Light::Projection(projection) => {
                from_point(projection.position(), projection.sample_direction(u_dir)?)
            }
            Light::Goniometric(goniometric) => {
                from_point(goniometric.position(), goniometric.sample_direction(u_dir)?)
            }
            Light::Distant(distant) => from_afar(-distant.direction, distant.radiance, 1.0),
            Light::Infinite(infinite) => {
                let sample = infinite.sample(u_dir, Wanted::All)?;
                from_afar(-sample.wi, sample.radiance, sample.pdf_w)
            }
            Light::Area(area) => self.sample_area_emission(light, area, u_pos, u_dir, time)?,
        };
        let is_sound = sample.pdf_pos > 0.0
            && sample.pdf_pos.is_finite()
            && sample.pdf_dir > 0.0
            && sample.pdf_dir.is_finite();
        (is_sound && !sample.radiance.is_black()).then_some(sample)
    }

    /// The ray that leaves a light in the unit direction `d`, which was drawn with density `pdf_dir`. `None` where none
    /// does, and if the light is no point.
    pub fn emission_toward(
        &self,
        light: LightId,
        d: Vec3,
        pdf_dir: f32,
        time: f32,
    ) -> Option<EmissionSample> {
        let (p, intensity) = (
            self.light(light).position()?,
            self.light(light).intensity(d)?,
        );
        let is_sound = pdf_dir > 0.0 && pdf_dir.is_finite() && !intensity.is_black();
        is_sound.then(|| self.emission_from_point(light, p, time, (d, intensity, pdf_dir)))
    }

    fn emission_from_point(
        &self,
        light: LightId,
        p: Point3,
        time: f32,
        (d, intensity, pdf_dir): (Vec3, Rgb, f32),
    ) -> EmissionSample {
        let p = if self.may_lie_on_surface(light) {
            self.off_surfaces(p, d, time)
        } else {
            p
        };
        EmissionSample {
            p,
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            d,
            radiance: intensity,
            pdf_pos: 1.0,
            pdf_dir,
            medium: self.light_medium(light),
            is_hole: false,
        }
    }

    /// Densities, of position and of direction, with which [`World::sample_emission`] draws the ray from `p`, where
    /// the normal is `ng`, in the unit direction `d`. What is certain has density 0: no ray found otherwise is it.
    pub fn pdf_emission(&self, light: LightId, p: Point3, ng: Normal3, d: Vec3) -> (f32, f32) {
        match self.light(light) {
            Light::Point(_) => (0.0, UNIFORM_SPHERE_PDF),
            Light::Spot(spot) => (0.0, spot.pdf_direction(d)),
            Light::Projection(projection) => (0.0, projection.pdf_direction(d)),
            Light::Goniometric(goniometric) => (0.0, goniometric.pdf_direction(d)),
            Light::Distant(_) => (self.pdf_far_line(p, d) as f32, 0.0),
            Light::Infinite(infinite) => {
                let pdf_dir = infinite.pdf_w(-d, Wanted::All);
                (self.pdf_far_line(p, d) as f32, pdf_dir)
            }
            Light::Area(area) => {
                let shape = &self.geometry(area.geometry).shape;
                if let Shape::Curves(_) = shape {
                    let radius = radius_around(&shape.bounds(area.element));
                    let pdf_disk = (1.0 / (PI * radius * radius)) as f32;
                    return (pdf_disk * ng.abs_dot(d), UNIFORM_SPHERE_PDF);
                }
                let cos = ng.dot(d);
                let pdf_dir = match (area.lights_both_sides(), cos > 0.0) {
                    (true, _) => 0.5 * cosine_hemisphere_pdf(cos.abs()),
                    (false, true) => cosine_hemisphere_pdf(cos),
                    (false, false) => 0.0,
                };
                (shape.pdf_area(area.element, p) as f32, pdf_dir)
            }
        }
    }

    fn sample_area_emission(
        &self,
        light: LightId,
        area: &AreaLight,
        u_pos: [f32; 2],
        u_dir: [f32; 2],
        time: f32,
    ) -> Option<EmissionSample> {
        let geometry = self.geometry(area.geometry);
        let Some(at) = geometry.shape.sample_area(area.element, u_pos) else {
            return self.sample_curve_emission(light, area, u_pos, u_dir, time);
        };
        let target = ElementRef {
            geometry: area.geometry,
            element: area.element,
        };
        let is_hole = self.is_hole_at(target, at.barycentric, at.p);
        if is_hole && !area.has_holes {
            return None;
        }
        let (mut u_dir, mut side, mut share) = (u_dir, Vec3::from(at.ng), 1.0);
        if area.lights_both_sides() {
            share = 0.5;
            let u = 2.0 * u_dir[0];
            (u_dir[0], side) = if u < 1.0 { (u, side) } else { (u - 1.0, -side) };
        }
        let local = cosine_hemisphere(u_dir);
        let d = Frame::from_z(side).to_world(local);
        let place = Place {
            p: at.p,
            p_err: at.p_err,
            ng: at.ng,
            n_surface: at.ng,
            ns: at.ng,
        };
        let declared = self.light_medium(light);
        Some(EmissionSample {
            p: at.p,
            p_err: self.widened_on(target, &place, at.barycentric, d, time),
            ng: at.ng,
            d,
            radiance: area.radiance,
            pdf_pos: at.pdf_area as f32,
            pdf_dir: share * local.z() * FRAC_1_PI,
            medium: self.medium_off_lamp(target, &place, at.barycentric, d, time, declared),
            is_hole,
        })
    }

    /// A curve has no surface of its own: a line in a random direction is met where it comes from the curve last.
    fn sample_curve_emission(
        &self,
        light: LightId,
        area: &AreaLight,
        u_pos: [f32; 2],
        u_dir: [f32; 2],
        time: f32,
    ) -> Option<EmissionSample> {
        let bounds = self.geometry(area.geometry).shape.bounds(area.element);
        if bounds.is_empty() {
            return None;
        }
        let d = uniform_sphere(u_dir);
        let radius = radius_around(&bounds);
        let back = Ray {
            o: Point3::from_f64(on_disk(bounds.center().to_f64(), radius, d, u_pos, radius)),
            d: -d,
            time,
        };
        // Pieces of a curve overlap at bends, and rays leave them at a distance: of the pieces on a line only the
        // last one emits along it.
        let hit = self.closest_where(&back, f32::INFINITY, |hit| {
            hit.target.geometry == area.geometry
        })?;
        if hit.target.element != area.element {
            return None;
        }
        let (target, surface) = (hit.target, self.surface(&back, &hit));
        let cos = surface.ng.abs_dot(d);
        // Rays leave a curve at the distance of its width. Along the ray, not along the normal, which need not be near
        // it: the line is what was drawn.
        let p = surface.p + d * surface.p_err.length();
        Some(EmissionSample {
            p,
            p_err: Vec3(p.0.abs() * (4.0 * EPSILON)),
            ng: surface.ng,
            d,
            radiance: area.le(surface.ng, d),
            pdf_pos: (f64::from(cos) / (PI * radius * radius)) as f32,
            pdf_dir: UNIFORM_SPHERE_PDF,
            medium: self.medium_toward(target, surface.ng, d, self.light_medium(light)),
            is_hole: false,
        })
    }

    /// The medium a light is declared to be in.
    pub fn light_medium(&self, light: LightId) -> MediumId {
        let declared = self.light_media.get(light.index());
        declared.copied().unwrap_or(MediumId::NONE)
    }

    /// Sends most light from far away across the disks through the centre of a sphere: around what camera paths get to,
    /// it does not depend on what they do not.
    pub fn aim_far_light(&mut self, center: DVec3, radius: f64) {
        let aim = Ball { center, radius };
        let is_smaller = radius < ABOUT_THE_SAME * self.scene_ball().radius;
        // Light paths carry densities in single precision.
        let is_in_range = ((1.0 / aim.area()) as f32).is_finite();
        self.far_aim = (is_smaller && is_in_range).then_some(aim);
    }

    /// Chooses lights that light paths start from. Of light from far away what counts is what is sent where it is aimed
    /// at, however wide the scene is.
    pub fn emitter_choice(
        &self,
        strategy: LightStrategy,
        sends: impl Fn(LightId) -> bool,
    ) -> LightChoice {
        let mut weights = match strategy {
            LightStrategy::Power => self.power_weights(self.reach().1),
            LightStrategy::Uniform | LightStrategy::Spatial => self.light_weights(strategy),
        };
        for (index, weight) in weights.iter_mut().enumerate() {
            if !sends(LightId::new(index)) {
                *weight = 0.0;
            }
        }
        LightChoice::new(&weights)
    }

    /// Centre and radius of a sphere around what camera paths get to; around all surfaces if that is not known.
    pub fn reach(&self) -> (DVec3, f64) {
        let Ball { center, radius } = self.far_aim.unwrap_or_else(|| self.scene_ball());
        (center, radius)
    }

    fn scene_ball(&self) -> Ball {
        let (center, radius) = self.bounding_sphere();
        Ball { center, radius }
    }

    /// Whether `p` is before the scene for light from far away toward `d`, which starts behind it: a medium may reach
    /// there.
    pub fn is_before_scene(&self, p: Point3, d: Vec3) -> bool {
        let scene = self.scene_ball();
        (p.to_f64() - scene.center).dot(d.to_f64()) < -scene.radius
    }

    /// Density per area across `d` with which a line through `p` is drawn for light from far away toward `d`.
    pub fn pdf_far_line(&self, p: Point3, d: Vec3) -> f64 {
        let (p, d) = (p.to_f64(), d.to_f64());
        let scene = self.scene_ball();
        match &self.far_aim {
            Some(aim) => mixed(aim.pdf(p, d), scene.pdf(p, d)),
            None => scene.pdf(p, d),
        }
    }

    /// Draws a line of light from far away toward `d`: where on it a ray starts, and its density.
    fn sample_far_line(
        &self,
        light: LightId,
        d: Vec3,
        mut u: [f32; 2],
        time: f32,
    ) -> (Point3, f32) {
        let scene = self.scene_ball();
        let Some(aim) = &self.far_aim else {
            let p = on_disk(scene.center, scene.radius, d, u, -scene.radius);
            return (Point3::from_f64(p), (1.0 / scene.area()) as f32);
        };
        let is_aimed = u[0] < AIMED;
        let across = if is_aimed {
            u[0] /= AIMED;
            aim
        } else {
            u[0] = (u[0] - AIMED) / (1.0 - AIMED);
            &scene
        };
        let p = on_disk(across.center, across.radius, d, u, -across.radius);
        let d = d.to_f64();
        // What was drawn is within its own disk, whatever rounding makes of its border.
        let [own, other] = if is_aimed {
            [aim, &scene]
        } else {
            [&scene, aim]
        };
        let (own, other) = (1.0 / own.area(), other.pdf(p, d));
        let pdf = if is_aimed {
            mixed(own, other)
        } else {
            mixed(other, own)
        };
        let start = is_aimed
            .then(|| self.start_near(light, p, d, aim.radius, time))
            .flatten();
        let p = start.unwrap_or_else(|| p - d * ((p - scene.center).dot(d) + scene.radius));
        (Point3::from_f64(p), pdf as f32)
    }

    /// Where a ray of light from far away may start that comes to `near` in direction `d`: there or, in wide scenes, not
    /// far beyond the surfaces behind it. Its digits are then those of what it is aimed at. `None` where it is to start
    /// beyond the scene.
    fn start_near(
        &self,
        light: LightId,
        near: DVec3,
        d: DVec3,
        room: f64,
        time: f32,
    ) -> Option<DVec3> {
        // A medium dims what comes from further away.
        if self.light_medium(light) != MediumId::NONE {
            return None;
        }
        let back = Vec3::from_f64(-d);
        let mut ray = Ray {
            o: Point3::from_f64(near),
            d: back,
            time,
        };
        let is_wide = self.scene_ball().radius > WIDE * room;
        let most = if is_wide { MOST_BEYOND } else { 0 };
        for n_surfaces in 0..=most {
            let Some(hit) = self.closest(&ray, f32::INFINITY) else {
                let beyond = match n_surfaces {
                    0 => 0.0,
                    _ => room + (near - ray.o.to_f64()).dot(d),
                };
                return Some(near - d * beyond);
            };
            let surface = self.surface(&ray, &hit);
            ray = spawn_ray(surface.p, surface.p_err, surface.n_surface, back, time);
        }
        None
    }
}

/// The density of the mixture of both disks.
fn mixed(aimed: f64, anywhere: f64) -> f64 {
    let share = f64::from(AIMED);
    share * aimed + (1.0 - share) * anywhere
}

/// A point of a disk across `d`, whose centre lies `ahead` along `d` from `center`.
fn on_disk(center: DVec3, radius: f64, d: Vec3, u: [f32; 2], ahead: f64) -> DVec3 {
    let frame = Frame::from_z(d);
    let [x, y] = concentric_disk(u).map(f64::from);
    let aside = frame.s.to_f64() * x + frame.t.to_f64() * y;
    center + aside * radius + d.to_f64() * ahead
}

/// Radius of the sphere around a box.
fn radius_around(bounds: &Bounds3) -> f64 {
    0.5 * f64::from(bounds.extent().length())
}
