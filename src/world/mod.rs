//! The compiled, frozen scene: arenas addressed by typed ids, ray queries, and light sampling with visibility.
//!
//! Immutable and shared by all threads. Space is *render space*: world space moved and scaled by a power of two so
//! that coordinates near the camera are small and lengths are near 1.

mod cloud;
pub mod cutout;
pub mod emission;
pub mod instance;
mod items;
mod lamp_copies;
pub mod lamps;
mod light_order;
pub mod lighting;
pub mod media;
pub mod segment;
pub mod selection;
pub mod skies;
mod stack;
mod veils;

use rayon::iter::{
    IndexedParallelIterator, IntoParallelRefIterator, ParallelExtend, ParallelIterator,
};

use glam::DVec3;

use crate::accel::{Bvh, RayShear};
use crate::ids::{GeometryId, InstanceId, LightId, MaterialId, MediumId, ObjectId};
use crate::light::{Light, LightChoice};
use crate::material::Materials;
use crate::math::error::offset_origin;
use crate::math::transform::power_of_two_near;
use crate::math::{Bounds3, Normal3, Point3, Ray, Vec3};
use crate::medium::Medium;
use crate::shape::{ElementHit, Place, Shape, SurfacePoint};
use crate::texture::Textures;
use cloud::Cloud;
pub use cutout::Cutout;
pub use emission::EmissionSample;
pub use instance::{Instance, Object};
use items::Slot;
pub use lamp_copies::{CopiedLamp, LampCopies};
pub use lamps::{LampPoint, LampVisibility};
pub use lighting::{LightSample, Receiver};
pub use media::{MediumInterface, ShadowTally};
pub use segment::{Aim, Segment};
use selection::LightSelection;
pub use selection::LightStrategy;
use stack::Stacks;
use veils::Veils;

/// A shape with everything that belongs to its surface.
#[derive(Clone, Debug)]
pub struct Geometry {
    /// Where it is.
    pub shape: Shape,
    /// What it looks like; `NONE` is the invisible null material.
    pub material: MaterialId,
    /// The media on its sides, if they differ.
    pub media: Option<MediumInterface>,
    /// The light of element 0; element i emits by the light i ids later. `NONE` if it does not emit.
    pub first_light: LightId,
    /// Where a mesh has holes, for all rays and for those toward lights.
    pub cutout: Cutout,
    /// The object it is part of, in whose space it is; `NONE` if it stands in render space by itself. Parts of
    /// objects do not emit.
    pub object: ObjectId,
}

/// One element of a geometry, as the hierarchy stores it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ElementRef {
    /// The geometry.
    pub geometry: GeometryId,
    /// Element of its shape.
    pub element: u32,
}

/// The nearest meeting of a ray with the world.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// What was hit.
    pub target: ElementRef,
    /// The instance it was hit in; `NONE` if it stands by itself.
    pub instance: InstanceId,
    /// Where.
    pub at: ElementHit,
}

/// Facts established once at load. They select specialised code and leave out what the scene does not need.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Facts {
    /// Some surface has the null material.
    pub has_null_surfaces: bool,
    /// Some surface separates two media, or the camera is in one.
    pub has_media: bool,
    /// Some material needs the footprint of the camera's pixel.
    pub needs_footprint: bool,
    /// Some mesh has holes.
    pub has_holes: bool,
    /// Some mesh has parts that cast no shadow.
    pub has_shadow_holes: bool,
    /// Some instance moves while the shutter is open.
    pub has_motion: bool,
    /// Some light is a point, and some homogeneous medium scatters.
    pub has_points_in_fog: bool,
    /// Some surface emits.
    pub has_lamps: bool,
    /// Some lamp is [asymmetric](lamps).
    pub has_asymmetric_lamps: bool,
    /// Rays may leave the scene in a medium without end, toward a light at infinity: see [`skies`].
    pub has_endless_media: bool,
    /// Some light is negative in some channel: so may radiances be, which are a sign of a fault elsewhere.
    pub has_negative_light: bool,
}

impl Facts {
    /// Whether pictures depend on densities of pbrt-v3's BSDF sampling, by an integrator that heeds media or does not.
    #[inline]
    pub fn needs_pdf_scattering(&self, heeds_media: bool) -> bool {
        self.has_asymmetric_lamps || heeds_media && self.has_endless_media
    }
}

/// Parts of a world, ready to be frozen.
#[derive(Clone, Debug, Default)]
pub struct WorldParts {
    /// Geometries, addressed by [`GeometryId`].
    pub geometries: Vec<Geometry>,
    /// Number of objects, addressed by [`ObjectId`].
    pub n_objects: usize,
    /// Placements of objects, addressed by [`InstanceId`].
    pub instances: Vec<Instance>,
    /// Times in which rays exist, for the boxes of what moves.
    pub shutter: [f64; 2],
    /// Materials.
    pub materials: Materials,
    /// Textures and images.
    pub textures: Textures,
    /// Media, addressed by [`MediumId`].
    pub media: Vec<Medium>,
    /// Lights, addressed by [`LightId`].
    pub lights: Vec<Light>,
    /// The medium each light shines into, unless its surface separates two; `NONE` for lights beyond the last.
    pub light_media: Vec<MediumId>,
    /// How often each light is sampled where every light is; once those beyond the last.
    pub light_samples: Vec<u32>,
    /// Lamps that stand in the world as copies of each other: they are chosen among by one tree for all copies.
    pub lamp_copies: Vec<LampCopies>,
    /// Medium around the camera.
    pub camera_medium: MediumId,
    /// How a light is chosen.
    pub light_strategy: LightStrategy,
    /// Light is drawn for points in media: skies are prepared for what comes through to those.
    pub draws_light_in_media: bool,
}

impl WorldParts {
    /// Items of the largest hierarchy, that of the world or of an object: elements of shapes, and placed objects.
    /// [`Bvh::MAX_ITEMS`] is the most there may be.
    pub fn items_of_largest_hierarchy(&self) -> usize {
        let mut of_objects = vec![0; self.n_objects];
        let mut of_world = self.instances.len();
        for geometry in &self.geometries {
            let n_items = if geometry.object.is_some() {
                &mut of_objects[geometry.object.index()]
            } else {
                &mut of_world
            };
            *n_items += geometry.shape.n_elements();
        }
        of_objects.into_iter().fold(of_world, usize::max)
    }
}

/// The frozen scene.
#[derive(Clone, Debug)]
pub struct World {
    geometries: Vec<Geometry>,
    materials: Materials,
    textures: Textures,
    media: Vec<Medium>,
    bounded_media: Vec<bool>,
    lights: Vec<Light>,
    light_media: Vec<MediumId>,
    light_samples: Vec<u32>,
    infinite_lights: Vec<LightId>,
    light_selection: LightSelection,
    /// Among lights that are points, where [`Facts::has_points_in_fog`].
    point_choice: LightChoice,
    camera_medium: MediumId,
    veils: Veils,
    /// See [`Cloud`].
    cloud: Option<Cloud>,
    /// See [`Stacks`].
    stacks: Option<Box<Stacks>>,
    shutter: [f64; 2],
    objects: Vec<Object>,
    instances: Vec<Instance>,
    bvh: Bvh,
    /// Elements of the world, those of each instance counted again.
    n_elements: usize,
    /// Where media end, for light sampling, that no surface bounds: twice the radius of a sphere around all surfaces.
    horizon: f32,
    /// Radius of a sphere around most of what the camera sees, for choices among lights; of one around all surfaces until
    /// the camera is known.
    view_radius: f64,
    light_strategy: LightStrategy,
    /// Where light from far away is sent, if not to the scene as a whole.
    far_aim: Option<emission::Ball>,
    facts: Facts,
}

impl World {
    /// Builds the hierarchies, none of more than [`Bvh::MAX_ITEMS`] items, and establishes the facts.
    pub fn new(mut parts: WorldParts) -> Self {
        let objects = Object::build_all(&parts.geometries, parts.n_objects);
        let stands = |&index: &usize| !parts.geometries[index].object.is_some();
        let standing: Vec<usize> = (0..parts.geometries.len()).filter(stands).collect();
        let mut items = items::items_of(&parts.geometries, &standing);
        let mut n_elements = items::n_elements(&parts.geometries, &standing);
        let object_of = |instance: &Instance| &objects[instance.object.index()];
        n_elements += parts
            .instances
            .iter()
            .map(|instance| object_of(instance).n_elements())
            .sum::<usize>();
        let instances = parts.instances.par_iter().with_min_len(1 << 10).enumerate();
        items.par_extend(instances.map(|(index, instance)| {
            let bounds = instance.bounds(object_of(instance), parts.shutter);
            items::instance(InstanceId::new(index), &bounds)
        }));
        let bvh = items::hierarchy(items, &parts.geometries);
        let mut bounded_media = vec![true; parts.media.len()];
        let outside = parts
            .geometries
            .iter()
            .filter_map(|g| Some(g.media?.outside));
        for medium in outside.chain([parts.camera_medium]) {
            if medium.is_some() {
                bounded_media[medium.index()] = false;
            }
        }
        let facts = Facts {
            has_null_surfaces: parts.geometries.iter().any(|g| !g.material.is_some()),
            has_media: parts.camera_medium.is_some()
                || parts.geometries.iter().any(|g| g.media.is_some()),
            needs_footprint: parts.materials.need_footprint(&parts.textures),
            has_holes: parts.geometries.iter().any(|g| g.cutout.alpha.is_some()),
            has_shadow_holes: parts
                .geometries
                .iter()
                .any(|g| g.cutout.shadow_alpha.is_some()),
            has_motion: parts
                .instances
                .iter()
                .any(|i| !i.render_from_object.is_still_within(parts.shutter)),
            has_points_in_fog: parts.lights.iter().any(|l| l.position().is_some())
                && parts.media.iter().any(Medium::is_fog),
            has_lamps: parts.geometries.iter().any(|g| g.first_light.is_some()),
            has_asymmetric_lamps: parts.lights.iter().any(Light::is_asymmetric),
            has_endless_media: skies::may_be_endless(&parts, &bounded_media),
            has_negative_light: parts.lights.iter().any(Light::is_partly_negative),
        };
        let veils = if parts.draws_light_in_media {
            Veils::new(&parts.media, &mut parts.lights)
        } else {
            Veils::default()
        };
        if facts.has_endless_media {
            for light in &mut parts.lights {
                if let Light::Infinite(infinite) = light {
                    infinite.prepare_pbrt_density();
                }
            }
        }
        let infinite_lights = (0..parts.lights.len())
            .filter(|&i| matches!(parts.lights[i], Light::Infinite(_)))
            .map(LightId::new)
            .collect();
        let mut world = Self {
            geometries: parts.geometries,
            materials: parts.materials,
            textures: parts.textures,
            media: parts.media,
            bounded_media,
            lights: parts.lights,
            light_media: parts.light_media,
            light_samples: parts.light_samples,
            infinite_lights,
            light_selection: LightSelection::default(),
            point_choice: LightChoice::default(),
            camera_medium: parts.camera_medium,
            veils,
            cloud: None,
            stacks: None,
            shutter: parts.shutter,
            objects,
            instances: parts.instances,
            bvh,
            n_elements,
            horizon: f32::INFINITY,
            view_radius: 1.0,
            light_strategy: parts.light_strategy,
            far_aim: None,
            facts,
        };
        world.cloud = world.find_cloud();
        world.stacks = world.find_stacks().map(Box::new);
        world.view_radius = world.bounding_sphere().1;
        world.horizon = (2.0 * world.view_radius) as f32;
        world.light_selection = world.light_selection(parts.light_strategy, &parts.lamp_copies);
        if world.facts.has_points_in_fog {
            world.point_choice = world.point_choice();
        }
        world
    }

    /// Tells what the camera sees, by rays from it: choices among lights then heed nothing that is out of sight.
    pub fn note_view(&mut self, rays: impl Iterator<Item = Ray>) {
        let mut seen: Vec<DVec3> = Vec::new();
        let mut to_origin = 0.0;
        for ray in rays {
            to_origin = ray.o.to_f64().length();
            if let Some(hit) = self.closest(&ray, f32::INFINITY) {
                seen.push((ray.o + ray.d * hit.at.t).to_f64());
            }
        }
        let n = seen.len().max(1) as f64;
        let middle = seen.iter().sum::<DVec3>() / n;
        let variance = seen.iter().map(|p| p.distance_squared(middle)).sum::<f64>() / n;
        // The origin is near what is before the camera, even if rays miss it.
        let radius = if seen.len() > 1 {
            (2.0 * variance).sqrt()
        } else {
            to_origin
        };
        if !(radius > 0.0 && radius.is_finite()) {
            return;
        }
        // By powers of two, so that rounding does not change it.
        self.view_radius = power_of_two_near(radius);
        if self.light_strategy == LightStrategy::Power {
            self.light_selection = self.light_selection(self.light_strategy, &[]);
        }
    }

    /// Facts established at load.
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// Number of elements, those of each instance counted again.
    pub fn n_elements(&self) -> usize {
        self.n_elements
    }

    /// Most surfaces a straight ray can pass: each element twice, as an ellipsoid is entered and left. A ray that
    /// crosses more of them is stuck.
    #[inline]
    pub fn max_crossings(&self) -> usize {
        2 * self.n_elements
    }

    /// Box around all surfaces; empty if there are none.
    pub fn bounds(&self) -> Bounds3 {
        self.bvh.bounds()
    }

    /// Medium around the camera.
    pub fn camera_medium(&self) -> MediumId {
        self.camera_medium
    }

    /// A geometry.
    #[inline]
    pub fn geometry(&self, id: GeometryId) -> &Geometry {
        &self.geometries[id.index()]
    }

    /// A medium.
    #[inline]
    pub fn medium(&self, id: MediumId) -> &Medium {
        &self.media[id.index()]
    }

    /// All materials.
    #[inline]
    pub fn materials(&self) -> &Materials {
        &self.materials
    }

    /// All textures.
    #[inline]
    pub fn textures(&self) -> &Textures {
        &self.textures
    }

    /// The nearest surface in (0, `t_max`); of several in one place that which is met first.
    #[inline]
    pub fn closest(&self, ray: &Ray, t_max: f32) -> Option<Hit> {
        self.first_where(ray, t_max, |_| true)
    }

    /// The same of those that satisfy `counts`.
    #[inline]
    fn first_where(&self, ray: &Ray, t_max: f32, counts: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let hit = self.closest_where(ray, t_max, &counts)?;
        if self.may_be_stacked(hit.target) {
            return Some(self.first_of_stack(ray, hit, counts));
        }
        Some(hit)
    }

    /// The nearest surface of a material in (0, `t_max`).
    pub fn closest_of_material(&self, ray: &Ray, t_max: f32, material: MaterialId) -> Option<Hit> {
        self.closest_where(ray, t_max, |hit| {
            self.geometry(hit.target.geometry).material == material
        })
    }

    /// The nearest surface in (0, `t_max`) that satisfies `counts`.
    #[inline]
    fn closest_where(&self, ray: &Ray, t_max: f32, counts: impl Fn(&Hit) -> bool) -> Option<Hit> {
        let hit = |target, instance, at: ElementHit| {
            let hit = Hit {
                target,
                instance,
                at,
            };
            (!self.is_hole(target, &at, ray) && counts(&hit)).then_some(hit)
        };
        let stands = InstanceId::NONE;
        let element = |target, instance, ray: &Ray, shear: &RayShear, limit| {
            let at = self.intersect(target, ray, shear, limit)?;
            Some((at.t, hit(target, instance, at)?))
        };
        let found = self.bvh.closest(
            ray,
            t_max,
            |key, at| hit(items::element_of(key), stands, (*at).into()),
            |key, limit, shear| match items::slot_of(key) {
                Slot::Element(target) => element(target, stands, ray, shear, limit),
                Slot::Instance(instance) => {
                    let (object, ray) = self.enter(instance, ray)?;
                    object.bvh().closest(
                        &ray,
                        limit,
                        |key, at| hit(items::element_of(key), instance, (*at).into()),
                        |key, limit, shear| {
                            element(items::element_of(key), instance, &ray, shear, limit)
                        },
                    )
                }
            },
        );
        found.map(|(_, hit)| hit)
    }

    /// Whether any surface in (0, `t_max`) satisfies `counts`.
    #[inline]
    fn any_where(&self, ray: &Ray, t_max: f32, counts: impl Fn(&Hit) -> bool) -> bool {
        let is_there = |target, instance, at: ElementHit| {
            let hit = Hit {
                target,
                instance,
                at,
            };
            !self.is_hole(target, &at, ray) && counts(&hit)
        };
        let stands = InstanceId::NONE;
        let element = |target, instance, ray: &Ray, shear: &RayShear| {
            self.intersect(target, ray, shear, t_max)
                .is_some_and(|at| is_there(target, instance, at))
        };
        self.bvh.any(
            ray,
            t_max,
            |key, at| is_there(items::element_of(key), stands, (*at).into()),
            |key, shear| match items::slot_of(key) {
                Slot::Element(target) => element(target, stands, ray, shear),
                Slot::Instance(instance) => {
                    self.enter(instance, ray).is_some_and(|(object, ray)| {
                        object.bvh().any(
                            &ray,
                            t_max,
                            |key, at| is_there(items::element_of(key), instance, (*at).into()),
                            |key, shear| element(items::element_of(key), instance, &ray, shear),
                        )
                    })
                }
            },
        )
    }

    #[inline]
    fn intersect(
        &self,
        target: ElementRef,
        ray: &Ray,
        shear: &RayShear,
        t_max: f32,
    ) -> Option<ElementHit> {
        self.geometry(target.geometry)
            .shape
            .intersect(target.element, ray, shear, t_max)
    }

    /// The object of an instance, and the ray in its space: distances along it stay what they are in render space,
    /// so its direction has no unit length.
    #[inline]
    fn enter(&self, instance: InstanceId, ray: &Ray) -> Option<(&Object, Ray)> {
        let instance = &self.instances[instance.index()];
        Some((
            &self.objects[instance.object.index()],
            instance.object_ray(ray)?,
        ))
    }

    /// The surface at a hit of `ray`.
    #[inline]
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let mut surface = self.bare_surface(ray, hit);
        if self.may_be_stacked(hit.target) {
            surface.p_err = self.widened(ray, hit, &surface.into());
        }
        surface
    }

    /// The same, whatever else is in its place.
    #[inline]
    fn bare_surface(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        let shape = &self.geometry(hit.target.geometry).shape;
        if hit.instance.is_some() {
            let instance = &self.instances[hit.instance.index()];
            if let Some(transform) = instance.render_from_object.at(ray.time)
                && let Some(object_ray) = instance.object_ray(ray)
            {
                return shape
                    .surface(hit.target.element, &object_ray, &hit.at)
                    .placed(&transform, instance.growth);
            }
        }
        shape.surface(hit.target.element, ray, &hit.at)
    }

    /// The same of where it was hit alone, to pass through.
    #[inline]
    pub fn place(&self, ray: &Ray, hit: &Hit) -> Place {
        let mut place = self.bare_place(ray, hit);
        if self.may_be_stacked(hit.target) {
            place.p_err = self.widened(ray, hit, &place);
        }
        place
    }

    #[inline]
    fn bare_place(&self, ray: &Ray, hit: &Hit) -> Place {
        if hit.instance.is_some() {
            return self.bare_surface(ray, hit).into();
        }
        let shape = &self.geometry(hit.target.geometry).shape;
        shape.place(hit.target.element, ray, &hit.at)
    }
}

/// A ray that leaves the surface point toward `d`.
#[inline]
pub fn spawn_ray(p: Point3, p_err: Vec3, ng: Normal3, d: Vec3, time: f32) -> Ray {
    Ray {
        o: offset_origin(p, p_err, ng, d),
        d,
        time,
    }
}
