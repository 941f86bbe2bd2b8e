//! Holes in meshes: where the alpha mask is exactly 0 there is no surface, and where the shadow mask is, none that
//! shadows (`alpha`, `shadowalpha`). Masks are looked up at a point, without a footprint.

use crate::math::{Point3, Ray};
use crate::shape::{ElementHit, Shape};
use crate::texture::{FloatSource, TextureContext};
use crate::world::{ElementRef, World};

/// The masks of a mesh. A constant that is not 0 is no mask.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Cutout {
    /// No ray meets the surface where this is 0.
    pub alpha: Option<FloatSource>,
    /// No shadow ray of an integrator that ignores media meets the surface where this is 0.
    pub shadow_alpha: Option<FloatSource>,
}

impl World {
    /// Whether an element has a hole where `ray` would meet it.
    #[inline]
    pub(super) fn is_hole(&self, target: ElementRef, at: &ElementHit, ray: &Ray) -> bool {
        self.facts.has_holes && self.is_hole_at(target, at.barycentric, ray.at(at.t))
    }

    /// Whether an element has a hole at a point, which is in render space.
    pub(super) fn is_hole_at(&self, target: ElementRef, barycentric: [f32; 2], p: Point3) -> bool {
        let mask = self.geometry(target.geometry).cutout.alpha;
        mask.is_some_and(|mask| self.is_zero(mask, target, barycentric, p))
    }

    /// Whether an element is left out of shadows where `ray` meets it.
    #[inline]
    pub fn casts_no_shadow(&self, target: ElementRef, at: &ElementHit, ray: &Ray) -> bool {
        if !self.facts.has_shadow_holes {
            return false;
        }
        let mask = self.geometry(target.geometry).cutout.shadow_alpha;
        mask.is_some_and(|mask| self.is_zero(mask, target, at.barycentric, ray.at(at.t)))
    }

    fn is_zero(
        &self,
        mask: FloatSource,
        target: ElementRef,
        barycentric: [f32; 2],
        p: Point3,
    ) -> bool {
        let Shape::Mesh(mesh) = &self.geometry(target.geometry).shape else {
            return false;
        };
        let uv = mesh.uv(target.element, barycentric);
        self.textures.float(mask, &TextureContext::at_point(p, uv)) == 0.0
    }
}
