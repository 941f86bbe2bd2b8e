//! Objects and their placements: two levels of hierarchy, so that a thousand copies cost one.

use crate::accel::Bvh;
use crate::ids::ObjectId;
use crate::math::{Bounds3, Motion, Point3, Ray, Vec3};
use crate::world::{Geometry, items};

/// Geometry in a space of its own, shared by instances.
#[derive(Clone, Debug)]
pub struct Object {
    n_elements: usize,
    bvh: Bvh,
}

/// A placement of an object.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What is placed.
    pub object: ObjectId,
    /// Where.
    pub render_from_object: Motion,
    /// Length in render space of one unit of the world, over that in the space of the object.
    pub growth: f64,
}

impl Object {
    /// One object for each id below `n_objects`, from the geometries that name it.
    pub(super) fn build_all(geometries: &[Geometry], n_objects: usize) -> Vec<Self> {
        let mut parts = vec![Vec::new(); n_objects];
        for (index, geometry) in geometries.iter().enumerate() {
            if geometry.object.is_some() {
                parts[geometry.object.index()].push(index);
            }
        }
        parts
            .into_iter()
            .map(|part| Self {
                n_elements: items::n_elements(geometries, &part),
                bvh: items::hierarchy(items::items_of(geometries, &part), geometries),
            })
            .collect()
    }

    pub(super) fn n_elements(&self) -> usize {
        self.n_elements
    }

    #[inline]
    pub(super) fn bvh(&self) -> &Bvh {
        &self.bvh
    }
}

impl Instance {
    /// Whether its place depends on the time.
    pub(super) fn is_moving(&self) -> bool {
        matches!(self.render_from_object, Motion::Moving(_))
    }

    /// Box around everything the instance reaches while the shutter is open.
    pub(super) fn bounds(&self, object: &Object, shutter: [f64; 2]) -> Bounds3 {
        let bounds = object.bvh.bounds();
        if bounds.is_empty() {
            return Bounds3::EMPTY;
        }
        let of = [bounds.min.to_f64(), bounds.max.to_f64()];
        let [lo, hi] = self.render_from_object.bounds(of, shutter);
        Bounds3::around(lo, hi)
    }

    /// The ray in the object's space at its time; `None` in the moment in which a motion is singular.
    #[inline]
    pub(super) fn object_ray(&self, ray: &Ray) -> Option<Ray> {
        let object_from_render = self.render_from_object.at(ray.time)?.inverse();
        Some(Ray {
            o: Point3::from_f64(object_from_render.point(ray.o.to_f64())),
            d: Vec3::from_f64(object_from_render.vector(ray.d.to_f64())),
            time: ray.time,
        })
    }
}
