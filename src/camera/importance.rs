//! Cameras as receivers of light: where on the film light from a point of the scene arrives, and how much it counts.
//!
//! A camera's importance is normalised to the full frame: over all film positions and points of the lens it
//! integrates to 1. That makes it the density with which rays are drawn from a point of the lens when film positions
//! are uniform over the frame, cosine at the lens included (pbrt 3rd ed., section 16.1.1).

use crate::camera::{Camera, Projection};
use crate::math::{Point3, Ray, Vec3};

/// Light from a point of the scene on its way to the film.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Arrival {
    /// The point of the lens it falls on, in render space.
    pub p: Point3,
    /// Where it arrives, in raster space: in the full frame or beside it.
    pub raster: [f64; 2],
    /// It is in the full frame.
    pub in_frame: bool,
    /// Importance per solid angle of render space at `p`: the density of the ray from there.
    pub pdf_w: f64,
}

impl Camera {
    /// Whether light can be followed from the scene to the film.
    pub fn receives_light(&self) -> bool {
        matches!(
            self.projection,
            Projection::Perspective(_) | Projection::Environment(_)
        )
    }

    /// Density in sr⁻¹ of a ray among those that start at its origin, for film positions uniform over the full frame.
    /// 0 for cameras that receive no light.
    pub fn pdf_w(&self, ray: &Ray) -> f64 {
        let placed = self.placed_at(ray.time);
        let local = placed.inverse().vector(ray.d.to_f64());
        let length = local.length();
        let d = local / length;
        let pdf_w = match &self.projection {
            Projection::Perspective(perspective) => perspective.pdf_w(d),
            Projection::Environment(environment) => environment.pdf_w(d),
            Projection::Orthographic(_) | Projection::Realistic(_) => 0.0,
        };
        // What the camera's placement does to solid angles.
        pdf_w / (placed.determinant().abs() * length * length * length)
    }

    /// Chooses a point of the lens by `u_lens` for light from `p`. `None` if it does not arrive on the plane of the film.
    pub fn sample_arrival(&self, p: Point3, u_lens: [f32; 2], time: f32) -> Option<Arrival> {
        let placed = self.placed_at(time);
        let local = placed.inverse().point(p.to_f64());
        let (on_lens, raster, in_frame) = match &self.projection {
            Projection::Perspective(perspective) => {
                let (on_lens, raster) = perspective.arrival(local, u_lens)?;
                (on_lens, raster, perspective.frames(raster))
            }
            Projection::Environment(environment) => {
                let raster = environment.arrival(local);
                (glam::DVec3::ZERO, raster, environment.frames(raster))
            }
            Projection::Orthographic(_) | Projection::Realistic(_) => return None,
        };
        let on_lens = Point3::from_f64(placed.point(on_lens));
        let d = Vec3::from_f64((p.to_f64() - on_lens.to_f64()).try_normalize()?);
        let pdf_w = self.pdf_w(&Ray {
            o: on_lens,
            d,
            time,
        });
        (pdf_w > 0.0 && pdf_w.is_finite()).then_some(Arrival {
            p: on_lens,
            raster,
            in_frame,
            pdf_w,
        })
    }
}
