//! Direct light: choosing a light, drawing a point on it, and whether it is seen.

use glam::DVec3;

use crate::ids::{InstanceId, LightId, MediumId};
use crate::light::{AreaLight, InfiniteLight, Light, Wanted};
use crate::math::error::offset_origin;
use crate::math::{Normal3, Point3, Ray, Vec3};
use crate::sampling::mis::Heuristic;
use crate::sampling::rng::Rng;
use crate::shape::{Place, SurfacePoint};
use crate::spectrum::Rgb;
use crate::world::lamps::{LampPoint, LampVisibility};
use crate::world::segment::{Aim, Segment};
use crate::world::skies;
use crate::world::{ElementRef, Hit, ShadowTally, World};

/// A point that receives light: on a surface, or in a medium.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// The point.
    pub p: Point3,
    /// Error box of `p`; zero in a medium.
    pub p_err: Vec3,
    /// Geometric normal; zero in a medium.
    pub ng: Normal3,
    /// What it wants of the light that surrounds the scene.
    pub wanted: Wanted,
    /// Time.
    pub time: f32,
}

/// Light that may arrive at a receiver.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit direction from the receiver.
    pub wi: Vec3,
    /// Radiance, or for a delta light the irradiance on a perpendicular surface.
    pub radiance: Rgb,
    /// Density in sr⁻¹, probability of the light included; for a delta light only that probability.
    pub pdf: f32,
    /// No other strategy can find this light.
    pub is_delta: bool,
    rule: MisRule,
    /// The point aimed at; meaningless for light from infinitely far away.
    pub p: Point3,
    /// The emitting surface's normal there; zero off surfaces.
    pub ng: Normal3,
    /// What must be free.
    shadow: Segment,
}

/// How light samples are weighed beside directions that find the light.
#[derive(Clone, Copy, Debug)]
enum MisRule {
    /// By the densities of both.
    Densities,
    /// The same for a sky, which may be beyond a medium without end.
    Sky(LightId),
    /// A point of an asymmetric lamp. Directions do not find what is cut out.
    AsymmetricLamp {
        visibility: LampVisibility,
        is_hole: bool,
    },
}

impl LightSample {
    /// MIS weight beside a direction drawn with density `pdf_w`, in sr⁻¹, times the part of the radiance that an asymmetric
    /// lamp lights the receiver with. `pdf_scattering` is the density of the direction in pbrt-v3's BSDF sampling.
    #[inline]
    pub fn mis_weight(&self, pdf_w: f32, pdf_scattering: impl FnOnce() -> f32) -> f32 {
        if self.is_delta {
            return 1.0;
        }
        match &self.rule {
            MisRule::Densities => Heuristic::Power.weight(self.pdf, pdf_w),
            MisRule::Sky(_) => skies::HEURISTIC.weight(self.pdf, pdf_w),
            MisRule::AsymmetricLamp {
                visibility,
                is_hole,
            } => {
                let weight = if *is_hole {
                    1.0
                } else {
                    Heuristic::Power.weight(self.pdf, pdf_w)
                };
                weight * visibility.radiance_factor(pdf_scattering)
            }
        }
    }

    /// MIS weight of a sample whose shadow ray has left the scene in a medium without end: `None` where that does not
    /// matter. See [`crate::world::skies`].
    #[inline]
    pub fn endless_weight(
        &self,
        world: &World,
        pdf_scattering: impl FnOnce() -> f32,
    ) -> Option<f32> {
        let MisRule::Sky(light) = self.rule else {
            return None;
        };
        let [of_light, _] = world.endless_weights(light, self.wi, pdf_scattering)?;
        Some(of_light)
    }

    /// The part of its radiance that counts in an integrator that samples lights alone: pbrt-v3's sees what light
    /// sampling sees.
    #[inline]
    pub fn light_sampling_only_factor(&self) -> f32 {
        match &self.rule {
            MisRule::AsymmetricLamp { visibility, .. } if !visibility.to_light_sampling => 0.0,
            _ => 1.0,
        }
    }

    /// The part of its radiance with which it lights the receiver, by all strategies together.
    #[inline]
    pub fn radiance_factor(&self, pdf_scattering: impl FnOnce() -> f32) -> f32 {
        match &self.rule {
            MisRule::AsymmetricLamp { visibility, .. } => {
                visibility.radiance_factor(pdf_scattering)
            }
            MisRule::Densities | MisRule::Sky(_) => 1.0,
        }
    }

    /// Whether no direction finds it: it is a delta, or cut out of a lamp.
    #[inline]
    pub fn is_hidden_from_rays(&self) -> bool {
        let is_hole = matches!(self.rule, MisRule::AsymmetricLamp { is_hole: true, .. });
        self.is_delta || is_hole
    }

    /// What must be free for the light to arrive.
    pub(super) fn segment(&self) -> &Segment {
        &self.shadow
    }
}

impl World {
    /// The MIS heuristic for samples of a light and directions that find it.
    #[inline]
    pub fn heuristic(&self, light: LightId) -> Heuristic {
        match self.light(light) {
            Light::Infinite(_) => skies::HEURISTIC,
            _ => Heuristic::Power,
        }
    }

    /// Power of a light in render-space units, for choosing among lights: of one at infinity, what passes through a sphere as
    /// wide as what the camera sees.
    pub(super) fn power(&self, light: &Light) -> f64 {
        self.power_through(light, self.view_radius)
    }

    /// The same with a sphere of the given radius.
    pub(super) fn power_through(&self, light: &Light, radius: f64) -> f64 {
        use std::f64::consts::PI;
        match light {
            Light::Point(point) => 4.0 * PI * point.intensity.luminance() as f64,
            Light::Spot(spot) => spot.power(),
            Light::Projection(projection) => projection.power(),
            Light::Goniometric(goniometric) => goniometric.power(),
            Light::Distant(distant) => PI * radius * radius * distant.radiance.luminance() as f64,
            Light::Infinite(infinite) => radius * radius * infinite.irradiance(),
            Light::Area(area) => {
                let sides = if area.lights_both_sides() { 2.0 } else { 1.0 };
                let shape = &self.geometry(area.geometry).shape;
                sides * PI * shape.area(area.element) * area.radiance.luminance() as f64
            }
        }
    }

    /// Centre and radius of a sphere around all surfaces; of radius 1 around the origin if there are none.
    pub fn bounding_sphere(&self) -> (DVec3, f64) {
        let bounds = self.bounds();
        if bounds.is_empty() {
            return (DVec3::ZERO, 1.0);
        }
        let (min, max) = (bounds.min.to_f64(), bounds.max.to_f64());
        ((min + max) * 0.5, (max - min).length() * 0.5)
    }

    /// Number of lights.
    pub fn n_lights(&self) -> usize {
        self.lights.len()
    }

    /// A light.
    #[inline]
    pub fn light(&self, id: LightId) -> &Light {
        &self.lights[id.index()]
    }

    /// How often a light is sampled where every light is; at least 1.
    #[inline]
    pub fn light_samples(&self, id: LightId) -> u32 {
        self.light_samples.get(id.index()).map_or(1, |&n| n.max(1))
    }

    /// Chooses a light for a receiver by `u` in [0, 1): the light and its probability, positive. `None` when there
    /// are no lights.
    #[inline]
    pub fn choose_light(&self, at: &Receiver, u: f64) -> Option<(LightId, f32)> {
        self.light_selection.choose(at, u)
    }

    /// Probability with which [`World::choose_light`] chooses `light` for the same receiver. Positive wherever the
    /// light can contribute.
    #[inline]
    pub fn light_pmf(&self, at: &Receiver, light: LightId) -> f32 {
        self.light_selection.pmf(at, light)
    }

    /// Chooses a light that is a point by `u` in [0, 1), before a receiver is known: the light and its probability.
    /// There is one where [`Facts::has_points_in_fog`](crate::world::Facts::has_points_in_fog).
    #[inline]
    pub fn choose_point_light(&self, u: f64) -> Option<(LightId, f32)> {
        let (index, pmf) = self.point_choice.sample(u)?;
        Some((LightId::new(index), pmf))
    }

    /// Probability with which [`World::choose_point_light`] chooses `light`; 0 if it is no point.
    #[inline]
    pub fn point_light_pmf(&self, light: LightId) -> f32 {
        self.point_choice.pmf(light.index())
    }

    /// Chooses a light by `u_light` and a point on it by `u`. `None` where nothing can arrive.
    pub fn sample_light(&self, at: &Receiver, u_light: f64, u: [f32; 2]) -> Option<LightSample> {
        let (light, pmf) = self.choose_light(at, u_light)?;
        self.sample_on_light(light, pmf, at, u)
    }

    /// Draws a point on a light that was chosen with probability `pmf`.
    pub fn sample_on_light(
        &self,
        light: LightId,
        pmf: f32,
        at: &Receiver,
        u: [f32; 2],
    ) -> Option<LightSample> {
        match self.light(light) {
            Light::Point(point) => {
                self.sample_position(light, at, point.p, pmf, |_| point.intensity)
            }
            Light::Spot(spot) => {
                self.sample_position(light, at, spot.position(), pmf, |w| spot.intensity(w))
            }
            Light::Projection(projection) => {
                self.sample_position(light, at, projection.position(), pmf, |w| {
                    projection.intensity(w)
                })
            }
            Light::Goniometric(goniometric) => {
                self.sample_position(light, at, goniometric.position(), pmf, |w| {
                    goniometric.intensity(w)
                })
            }
            Light::Distant(distant) => {
                let wi = distant.direction;
                Some(Self::delta(
                    wi,
                    distant.radiance,
                    pmf,
                    Segment::to_infinity(at, wi),
                ))
            }
            Light::Infinite(infinite) => {
                let sample = infinite.sample(u, at.wanted)?;
                let wi = sample.wi;
                Some(LightSample {
                    wi,
                    radiance: sample.radiance,
                    pdf: sample.pdf_w * pmf,
                    is_delta: false,
                    rule: MisRule::Sky(light),
                    p: Point3::ZERO,
                    ng: Normal3::ZERO,
                    shadow: Segment::to_infinity(at, wi),
                })
            }
            Light::Area(area) => self.sample_area_light(light, area, at, u, pmf),
        }
        .filter(|sample| !sample.radiance.is_black())
    }

    /// Light from a point at `p` of an intensity by direction.
    fn sample_position(
        &self,
        light: LightId,
        at: &Receiver,
        p: Point3,
        pmf: f32,
        intensity: impl Fn(Vec3) -> Rgb,
    ) -> Option<LightSample> {
        let to_light = p - at.p;
        let wi = to_light.try_normalize()?;
        let radiance = intensity(-wi) * (1.0 / to_light.length_squared());
        let mut shadow = Segment::new(at, p, wi, None);
        shadow.light = self.may_lie_on_surface(light).then_some(p);
        Some(LightSample {
            p,
            ..Self::delta(wi, radiance, pmf, shadow)
        })
    }

    fn delta(wi: Vec3, radiance: Rgb, pmf: f32, shadow: Segment) -> LightSample {
        LightSample {
            wi,
            radiance,
            pdf: pmf,
            is_delta: true,
            rule: MisRule::Densities,
            p: Point3::ZERO,
            ng: Normal3::ZERO,
            shadow,
        }
    }

    fn sample_area_light(
        &self,
        light: LightId,
        area: &AreaLight,
        at: &Receiver,
        u: [f32; 2],
        pmf: f32,
    ) -> Option<LightSample> {
        let shape = &self.geometry(area.geometry).shape;
        let sample = shape.sample_toward(area.element, at.p, u)?;
        let target = ElementRef {
            geometry: area.geometry,
            element: area.element,
        };
        let is_hole = self.is_hole_at(target, sample.barycentric, sample.p);
        if is_hole && !area.has_holes {
            return None;
        }
        let wi = (sample.p - at.p).try_normalize()?;
        let (mut radiance, mut rule) = (area.le(sample.ng, -wi), MisRule::Densities);
        if area.is_asymmetric() {
            let lamp = LampPoint {
                light,
                p: sample.p,
                ng: sample.ng,
                is_hole,
            };
            let visibility = self.visibility_of(area, &lamp, at.p, -wi);
            radiance = if visibility.to_light_sampling || visibility.to_rays {
                area.radiance
            } else {
                Rgb::BLACK
            };
            rule = MisRule::AsymmetricLamp {
                visibility,
                is_hole,
            };
        }
        let place = Place {
            p: sample.p,
            p_err: sample.p_err,
            ng: sample.ng,
            n_surface: sample.ng,
            ns: sample.ng,
        };
        let p_err = self.widened_on(target, &place, sample.barycentric, wi, at.time);
        let end = offset_origin(sample.p, p_err, sample.ng, -wi);
        let aim = Aim {
            target,
            instance: InstanceId::NONE,
            from_behind: sample.ng.dot(wi) > 0.0,
        };
        Some(LightSample {
            wi,
            radiance,
            pdf: sample.pdf_w * pmf,
            is_delta: false,
            rule,
            p: sample.p,
            ng: sample.ng,
            shadow: Segment::new(at, end, wi, Some(aim)),
        })
    }

    /// Whether any surface, null surfaces included, stands in the way and casts a shadow.
    pub fn is_occluded(&self, sample: &LightSample) -> bool {
        let segment = &sample.shadow;
        self.any_where(&segment.ray, segment.t_max, |hit| {
            self.stands_between(segment, hit)
                && !self.casts_no_shadow(hit.target, &hit.at, &segment.ray)
        })
    }

    /// Whether any surface, null surfaces included, stands anywhere on a ray and casts a shadow.
    pub fn is_blocked(&self, ray: &Ray) -> bool {
        self.any_where(ray, f32::INFINITY, |hit| {
            !self.casts_no_shadow(hit.target, &hit.at, ray)
        })
    }

    /// Unbiased estimate of the part of the light that arrives through media and null surfaces, for a receiver in
    /// `medium`, which is the medium at the other end afterwards. What it met is added to `tally`.
    pub fn transmittance(
        &self,
        sample: &LightSample,
        medium: &mut MediumId,
        rng: &mut Rng,
        tally: &mut ShadowTally,
    ) -> Rgb {
        self.transmittance_along(&sample.shadow, medium, rng, tally)
    }

    /// Emission toward `wo` of the surface hit, if it is a light: the light and the radiance.
    #[inline]
    pub fn emitted(&self, hit: &Hit, surface: &SurfacePoint, wo: Vec3) -> Option<(LightId, Rgb)> {
        let first = self.geometry(hit.target.geometry).first_light;
        if !first.is_some() {
            return None;
        }
        let id = LightId(first.0 + hit.target.element);
        match &self.lights[id.index()] {
            Light::Area(area) => Some((id, area.le(surface.n_surface, wo))),
            _ => None,
        }
    }

    /// Radiance that the nearest surface along a ray emits toward where it comes from; `None` if there is no surface.
    pub fn lamp_seen(&self, ray: &Ray) -> Option<Rgb> {
        let hit = self.closest(ray, f32::INFINITY)?;
        if !self.geometry(hit.target.geometry).first_light.is_some() {
            return Some(Rgb::BLACK);
        }
        let surface = self.surface(ray, &hit);
        let emitted = self.emitted(&hit, &surface, -ray.d);
        Some(emitted.map_or(Rgb::BLACK, |(_, le)| le))
    }

    /// Density with which [`World::sample_light`] draws, for a receiver, the point of an area light that was hit.
    pub fn pdf_of_hit(
        &self,
        light: LightId,
        hit: &Hit,
        surface: &SurfacePoint,
        at: &Receiver,
    ) -> f32 {
        self.pdf_toward_hit(hit, surface, at) * self.light_pmf(at, light)
    }

    /// Density with which [`World::sample_on_light`] draws, for a receiver, the point of an area light that was hit,
    /// if the light is certain.
    pub fn pdf_toward_hit(&self, hit: &Hit, surface: &SurfacePoint, at: &Receiver) -> f32 {
        let shape = &self.geometry(hit.target.geometry).shape;
        shape.pdf_toward(hit.target.element, at.p, surface.p, surface.n_surface)
    }

    /// Radiance of the infinite lights from the unit direction `w`.
    #[inline]
    pub fn environment(&self, w: Vec3) -> Rgb {
        self.infinite_lights().map(|(_, light)| light.le(w)).sum()
    }

    /// Light that is seen along a ray without anything scattering it, where there are neither media nor null surfaces:
    /// that of a lamp or from infinity.
    pub fn light_seen(&self, ray: &Ray) -> Rgb {
        self.lamp_seen(ray)
            .unwrap_or_else(|| self.environment(ray.d))
    }

    /// The lights that surround the scene.
    #[inline]
    pub fn infinite_lights(&self) -> impl Iterator<Item = (LightId, &InfiniteLight)> {
        self.infinite_lights
            .iter()
            .filter_map(|&id| match &self.lights[id.index()] {
                Light::Infinite(light) => Some((id, &**light)),
                _ => None,
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::{GeometryId, MaterialId, ObjectId};
    use crate::math::Transform;
    use crate::shape::quadric::{Form, Sphere};
    use crate::shape::{Quadric, Shape};
    use crate::world::{Cutout, Geometry, WorldParts};

    #[test]
    fn a_distant_ellipsoid_does_not_shine_through_its_own_near_side() {
        let (radius, stretch, distance) = (0.01, 2.0, 50.0);
        let sphere = Sphere::new(radius, -radius, radius, std::f64::consts::TAU);
        let stretched = glam::DAffine3::from_scale(glam::DVec3::new(1.0, 1.0, stretch));
        let placed = Transform::from_affine(stretched).expect("it has an inverse");
        let world = World::new(WorldParts {
            geometries: vec![Geometry {
                shape: Shape::Quadric(Quadric::new(Form::Sphere(sphere), placed, false)),
                material: MaterialId::NONE,
                media: None,
                cutout: Cutout::default(),
                first_light: LightId::new(0),
                object: ObjectId::NONE,
            }],
            lights: vec![Light::Area(AreaLight {
                geometry: GeometryId::new(0),
                element: 0,
                radiance: Rgb::ONE,
                two_sided: true,
                is_turned: false,
                has_holes: false,
            })],
            ..WorldParts::default()
        });
        let at = Receiver {
            p: Point3::new(distance, 0.0, 0.0),
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wanted: Wanted::All,
            time: 0.0,
        };
        let mut rng = Rng::new(1);
        let n = 100_000;
        let (mut sum, mut sum2) = (0.0, 0.0);
        for _ in 0..n {
            let sample = world.sample_light(&at, 0.5, rng.uniform2());
            let seen = sample.filter(|sample| !world.is_occluded(sample));
            let value = seen.map_or(0.0, |sample| (sample.radiance.r() / sample.pdf) as f64);
            (sum, sum2) = (sum + value, sum2 + value * value);
        }
        let mean = sum / n as f64;
        let sigma = ((sum2 / n as f64 - mean * mean) / n as f64).sqrt();
        let solid_angle =
            std::f64::consts::PI * radius * radius * stretch / f64::from(distance).powi(2);
        assert!(
            (mean - solid_angle).abs() < 4.0 * sigma + 1e-3 * solid_angle,
            "{mean} +- {sigma} for {solid_angle}"
        );
    }
}
