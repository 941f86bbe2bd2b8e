//! Objects and their placements: two levels of hierarchy, so that a thousand copies cost one.

use crate::accel::Bvh;
use crate::ids::{GeometryId, ObjectId};
use crate::math::animated::corners_of;
use crate::math::{Bounds3, Motion, Point3, Ray, Vec3};
use crate::world::{ElementRef, Geometry, elements_of};

/// Geometry in a space of its own, shared by instances.
#[derive(Clone, Debug)]
pub struct Object {
    elements: Vec<ElementRef>,
    bvh: Bvh,
}

/// A placement of an object.
#[derive(Clone, Debug)]
pub struct Instance {
    /// What is placed.
    pub object: ObjectId,
    /// Where.
    pub render_from_object: Motion,
}

impl Object {
    /// One object for each id below `n_objects`, from the geometries that name it.
    pub(super) fn build_all(geometries: &[Geometry], n_objects: usize) -> Vec<Self> {
        let mut parts = vec![(Vec::new(), Vec::new()); n_objects];
        for (index, geometry) in geometries.iter().enumerate() {
            if geometry.object.is_some() {
                let (boxes, elements) = &mut parts[geometry.object.index()];
                for (bounds, element) in elements_of(GeometryId::new(index), geometry) {
                    boxes.push(bounds);
                    elements.push(element);
                }
            }
        }
        parts
            .into_iter()
            .map(|(boxes, elements)| {
                let (bvh, order) = Bvh::build(&boxes);
                Self {
                    elements: order.into_iter().map(|i| elements[i as usize]).collect(),
                    bvh,
                }
            })
            .collect()
    }

    pub(super) fn n_elements(&self) -> usize {
        self.elements.len()
    }

    #[inline]
    pub(super) fn closest(
        &self,
        ray: &Ray,
        t_max: f32,
        mut hit: impl FnMut(ElementRef, f32) -> Option<f32>,
    ) {
        self.bvh.closest(ray, t_max, |slot, t_max| {
            hit(self.elements[slot as usize], t_max)
        });
    }

    #[inline]
    pub(super) fn any(
        &self,
        ray: &Ray,
        t_max: f32,
        mut hit: impl FnMut(ElementRef) -> bool,
    ) -> bool {
        self.bvh
            .any(ray, t_max, |slot| hit(self.elements[slot as usize]))
    }
}

impl Instance {
    /// Box around everything the instance reaches while the shutter is open.
    pub(super) fn bounds(&self, object: &Object, shutter: [f64; 2]) -> Bounds3 {
        let bounds = object.bvh.bounds();
        if bounds.is_empty() {
            return Bounds3::EMPTY;
        }
        let corners = corners_of([bounds.min.to_f64(), bounds.max.to_f64()]);
        let [lo, hi] = self.render_from_object.bounds(&corners, shutter);
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
