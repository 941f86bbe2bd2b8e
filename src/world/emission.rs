//! Rays that leave lights, for integrators that follow light.
//!
//! A ray is a point and a direction. Its flux is estimated by `radiance` × |cos(`ng`, `d`)| / (`pdf_pos` × `pdf_dir`),
//! without the cosine where `ng` is zero. Measures, all in render space:
//!
//! | light | `pdf_pos` | `pdf_dir` | `ng` |
//! |---|---|---|---|
//! | area | per area of the surface | sr⁻¹ | the surface's |
//! | point, spot, projection, goniometric | 1: the position is certain | sr⁻¹ | zero; `radiance` is an intensity |
//! | distant | per area of a disk across `d`, as wide as the scene | 1: the direction is certain | `d`; `radiance` is an irradiance |
//! | infinite | the same | sr⁻¹ | `d` |
//!
//! A lamp that lights otherwise than it shows (see [`crate::world::lamps`]) emits its radiance to both sides, from its holes
//! as well; what arrives is that times a factor that depends on who receives it.
//!
//! On curves the direction is drawn first, and `pdf_pos` is conditional on it.

use std::f32::consts::FRAC_1_PI;
use std::f64::consts::PI;

use crate::ids::{LightId, MediumId};
use crate::light::{AreaLight, Light, Wanted};
use crate::math::error::EPSILON;
use crate::math::{Bounds3, Frame, Normal3, Point3, Ray, Vec3};
use crate::sampling::warp::{
    UNIFORM_SPHERE_PDF, concentric_disk, cosine_hemisphere, cosine_hemisphere_pdf, uniform_sphere,
};
use crate::shape::{Place, Shape};
use crate::spectrum::Rgb;
use crate::world::{ElementRef, World};

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

/// A disk of the scene's size: rays that cross it may meet the scene.
struct SceneDisk {
    radius: f64,
    p: Point3,
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
            let disk = self.scene_disk(d, u_pos);
            EmissionSample {
                p: disk.p,
                p_err: Vec3::ZERO,
                ng: d.into(),
                d,
                radiance,
                pdf_pos: disk.pdf(),
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
        let (_, radius) = self.bounding_sphere();
        let pdf_disk = (1.0 / (PI * radius * radius)) as f32;
        match self.light(light) {
            Light::Point(_) => (0.0, UNIFORM_SPHERE_PDF),
            Light::Spot(spot) => (0.0, spot.pdf_direction(d)),
            Light::Projection(projection) => (0.0, projection.pdf_direction(d)),
            Light::Goniometric(goniometric) => (0.0, goniometric.pdf_direction(d)),
            Light::Distant(_) => (pdf_disk, 0.0),
            Light::Infinite(infinite) => (pdf_disk, infinite.pdf_w(-d, Wanted::All)),
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
            o: on_disk(bounds.center().to_f64(), radius, d, u_pos, radius),
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

    /// A point of the disk in front of the scene for rays toward `d`.
    fn scene_disk(&self, d: Vec3, u: [f32; 2]) -> SceneDisk {
        let (center, radius) = self.bounding_sphere();
        SceneDisk {
            radius,
            p: on_disk(center, radius, d, u, -radius),
        }
    }
}

impl SceneDisk {
    fn pdf(&self) -> f32 {
        (1.0 / (PI * self.radius * self.radius)) as f32
    }
}

/// A point of a disk across `d`, whose centre lies `ahead` along `d` from `center`.
fn on_disk(center: glam::DVec3, radius: f64, d: Vec3, u: [f32; 2], ahead: f64) -> Point3 {
    let frame = Frame::from_z(d);
    let [x, y] = concentric_disk(u).map(f64::from);
    let aside = frame.s.to_f64() * x + frame.t.to_f64() * y;
    Point3::from_f64(center + aside * radius + d.to_f64() * ahead)
}

/// Radius of the sphere around a box.
fn radius_around(bounds: &Bounds3) -> f64 {
    0.5 * f64::from(bounds.extent().length())
}
