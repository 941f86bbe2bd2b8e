//! Shapes in render space: where a ray meets them, what the surface is like there, and how to draw points on
//! them toward a receiver. Knows no materials, no media and no parameter names.

pub mod curve;
pub mod heightfield;
pub mod mesh;
pub mod nurbs;
pub mod ply;
pub mod quadric;
pub mod subdivision;

use glam::DVec3;

pub use crate::accel::RayShear;
use crate::accel::TriangleHit;
use crate::math::error::EPSILON;
use crate::math::{Bounds3, Normal3, Point3, Ray, Transform, Vec3};
use curve::CurveStyle;
pub use curve::Curves;
pub use mesh::Mesh;
pub use quadric::Quadric;

/// A shape: one scene-file directive, made of one or more elements (triangles of a mesh, pieces of
/// curves).
#[derive(Clone, Debug)]
pub enum Shape {
    /// An indexed triangle mesh.
    Mesh(Mesh),
    /// A surface of second degree.
    Quadric(Quadric),
    /// Thin bands and tubes.
    Curves(Curves),
}

/// A ray's meeting with one element of a shape.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ElementHit {
    /// Distance along the ray, positive.
    pub t: f32,
    /// Weights of the first two vertices for a triangle; (u, v) on a curve; unused by quadrics.
    pub barycentric: [f32; 2],
}

impl From<TriangleHit> for ElementHit {
    #[inline]
    fn from(hit: TriangleHit) -> Self {
        Self {
            t: hit.t,
            barycentric: hit.barycentric,
        }
    }
}

/// Where a surface was met and how it lies there, in render space: what of a [`SurfacePoint`] a ray needs that only
/// passes through.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// See [`SurfacePoint::p`].
    pub p: Point3,
    /// See [`SurfacePoint::p_err`].
    pub p_err: Vec3,
    /// See [`SurfacePoint::ng`].
    pub ng: Normal3,
    /// See [`SurfacePoint::n_surface`].
    pub n_surface: Normal3,
    /// See [`SurfacePoint::ns`].
    pub ns: Normal3,
}

impl From<SurfacePoint> for Place {
    #[inline]
    fn from(surface: SurfacePoint) -> Self {
        let SurfacePoint {
            p,
            p_err,
            ng,
            n_surface,
            ns,
            ..
        } = surface;
        Self {
            p,
            p_err,
            ng,
            n_surface,
            ns,
        }
    }
}

/// The local geometry of a surface point, in render space.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// The point.
    pub p: Point3,
    /// Half extents of a box around `p` that holds the exact point.
    pub p_err: Vec3,
    /// Geometric normal, unit, on the side emission leaves from and `outside` media lie on. It tells on which side of the
    /// surface a direction is: for scattering, for media, and for rays that leave.
    pub ng: Normal3,
    /// Unit normal of the surface as it is, for measures of area and for emission: `ng`, but on quadrics whose normal in
    /// pbrt-v3 is not that of the surface they are met on. There rays may leave to the wrong side of it, and meet the
    /// surface at once; `p_err` is so large that they do.
    pub n_surface: Normal3,
    /// Shading normal, unit, on the same side as `ng`.
    pub ns: Normal3,
    /// Surface parameters.
    pub uv: [f32; 2],
    /// Derivative of position by `u`.
    pub dpdu: Vec3,
    /// Derivative of position by `v`.
    pub dpdv: Vec3,
    /// Tangent that orients the shading frame: `dpdu` itself, which is not perpendicular to `ns` in general, or what
    /// [`Mesh::unit`] says of meshes with a frame of their own. With `bitangent` what bump mapping bends.
    pub tangent: Vec3,
    /// `dpdv`, or what goes with a tangent of a frame of its own.
    pub bitangent: Vec3,
    /// What bump mapping takes for the derivative of the shading normal by `u`, as pbrt-v3 has it in world space: that
    /// of the normal in the space of the shape, whatever its orientation and its length, taken to world space by the
    /// inverse transpose. Surfaces of twice the size have half of it. [`Self::normal_derivatives`] are true ones.
    pub dndu: Vec3,
    /// The same by `v`.
    pub dndv: Vec3,
    /// Number of the face among those of a Ptex file: see [`Mesh::faces`].
    pub face: u32,
    /// Signed: what `dndu` and `dndv` are to be multiplied by to be derivatives of the unit normal, apart from what
    /// they have along it.
    pub dn_scale: f32,
}

impl SurfacePoint {
    /// Whether a ray that leaves toward `w` starts on the other side of the surface as it is, by `ng`, and meets the surface
    /// at once: pbrt-v3's hyperboloids are dark where their normal says that light falls on the side it does not fall on.
    #[inline]
    pub fn shadows_itself(&self, w: Vec3) -> bool {
        let starts_in_front = (w.dot(self.ng) > 0.0) == (self.ng.0.dot(self.n_surface.0) > 0.0);
        starts_in_front != (w.dot(self.n_surface) > 0.0)
    }

    /// The derivatives of the shading normal, a unit vector, by `u` and `v`.
    pub fn normal_derivatives(&self) -> [Vec3; 2] {
        let ns = Vec3::from(self.ns);
        [self.dndu, self.dndv].map(|dn| (dn - ns * ns.dot(dn)) * self.dn_scale)
    }

    /// The same surface placed by a transform from its space to another, in which one unit of the world is `growth`
    /// times as long as in the first. The error bound also covers the way back: a ray that leaves the point is rounded
    /// to f32 once more when it is taken to the space of the surface.
    pub fn placed(&self, transform: &Transform, growth: f64) -> Self {
        let p = transform.point(self.p.to_f64());
        let m = &transform.affine().matrix3;
        let err = self.p_err.to_f64() + self.p.to_f64().abs() * (2.0 * EPSILON as f64);
        let p_err = m.x_axis.abs() * err.x
            + m.y_axis.abs() * err.y
            + m.z_axis.abs() * err.z
            + p.abs() * EPSILON as f64;
        let vector = |v: Vec3| Vec3::from_f64(transform.vector(v.to_f64()));
        let unit_normal = |n: Normal3| Normal3::from_f64(transform.normal(n.to_f64()).normalize());
        let ng = unit_normal(self.ng);
        let n_surface = if self.n_surface == self.ng {
            ng
        } else {
            unit_normal(self.n_surface)
        };
        // By the inverse transpose of a map from world to world.
        let world_normal = |n: DVec3| transform.normal(n) * growth;
        let derivative = |dn: Vec3| Vec3::from_f64(world_normal(dn.to_f64()));
        let ns = transform.normal(self.ns.to_f64());
        let length = ns.length();
        Self {
            p: Point3::from_f64(p),
            p_err: Vec3::from_f64(p_err),
            ng,
            n_surface,
            ns: Normal3::from_f64(ns / length).face_forward(ng),
            uv: self.uv,
            dpdu: vector(self.dpdu),
            dpdv: vector(self.dpdv),
            tangent: vector(self.tangent),
            bitangent: vector(self.bitangent),
            dndu: derivative(self.dndu),
            dndv: derivative(self.dndv),
            face: self.face,
            dn_scale: (f64::from(self.dn_scale) / (length * growth)) as f32,
        }
    }
}

/// A point drawn on a shape as seen from a receiver.
#[derive(Clone, Copy, Debug)]
pub struct ShapeSample {
    /// The point.
    pub p: Point3,
    /// Half extents of a box around `p` that holds the exact point.
    pub p_err: Vec3,
    /// Normal as in [`SurfacePoint::ng`].
    pub ng: Normal3,
    /// Density in sr⁻¹ at the receiver, positive and finite.
    pub pdf_w: f32,
    /// As in [`ElementHit::barycentric`].
    pub barycentric: [f32; 2],
}

/// A point drawn on a shape uniformly by area; in object space, where a transform stretches a quadric.
#[derive(Clone, Copy, Debug)]
pub struct AreaSample {
    /// The point.
    pub p: Point3,
    /// Half extents of a box around `p` that holds the exact point.
    pub p_err: Vec3,
    /// Normal as in [`SurfacePoint::ng`].
    pub ng: Normal3,
    /// Density per area of render space; infinite for an element without area.
    pub pdf_area: f64,
    /// As in [`ElementHit::barycentric`].
    pub barycentric: [f32; 2],
}

impl AreaSample {
    /// As seen by a receiver at `from`. `None` where the density is not positive and finite.
    fn toward(self, from: Point3) -> Option<ShapeSample> {
        let pdf_w = area_to_solid_angle(from, self.p, self.ng, self.pdf_area);
        (pdf_w > 0.0).then_some(ShapeSample {
            p: self.p,
            p_err: self.p_err,
            ng: self.ng,
            pdf_w,
            barycentric: self.barycentric,
        })
    }
}

/// Whereto the normals of an element point.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Emission {
    /// All to one side: the unit normal.
    Flat(Normal3),
    /// Anywhere.
    Round,
}

impl Shape {
    /// Whether light cannot be followed over it against the direction of paths from the camera: it turns toward the ray
    /// that meets it, so that different surfaces are seen from the two ends of a segment, or it
    /// [shadows itself](SurfacePoint::shadows_itself) from rays that leave, and not from those that arrive.
    pub fn is_one_way(&self) -> bool {
        match self {
            Self::Curves(curves) => curves.style() != CurveStyle::Ribbon,
            Self::Quadric(quadric) => quadric.has_normal_of_its_own(),
            Self::Mesh(_) => false,
        }
    }

    /// Number of elements, the units of intersection and of light sampling.
    pub fn n_elements(&self) -> usize {
        match self {
            Self::Mesh(mesh) => mesh.n_triangles(),
            Self::Quadric(_) => 1,
            Self::Curves(curves) => curves.n_pieces(),
        }
    }

    /// Box around one element; empty for an element without area.
    pub fn bounds(&self, element: u32) -> Bounds3 {
        match self {
            Self::Mesh(mesh) => mesh.bounds(element),
            Self::Quadric(quadric) => quadric.bounds(),
            Self::Curves(curves) => curves.bounds(element),
        }
    }

    /// Whether one element has an area: whether its box is not empty.
    pub fn has_area(&self, element: u32) -> bool {
        match self {
            Self::Mesh(mesh) => mesh.has_area(element),
            Self::Quadric(_) | Self::Curves(_) => !self.bounds(element).is_empty(),
        }
    }

    /// Area of one element.
    pub fn area(&self, element: u32) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.area(element),
            Self::Quadric(quadric) => quadric.area(),
            Self::Curves(curves) => curves.area(element),
        }
    }

    /// The nearest meeting of the ray with one element in (0, `t_max`).
    #[inline]
    pub fn intersect(
        &self,
        element: u32,
        ray: &Ray,
        shear: &RayShear,
        t_max: f32,
    ) -> Option<ElementHit> {
        match self {
            Self::Mesh(mesh) => mesh.intersect(element, shear, t_max),
            Self::Quadric(quadric) => quadric.intersect(ray, t_max).map(|t| ElementHit {
                t,
                barycentric: [0.0; 2],
            }),
            Self::Curves(curves) => curves.intersect(element, ray, t_max),
        }
    }

    /// The surface where `ray` met an element.
    pub fn surface(&self, element: u32, ray: &Ray, hit: &ElementHit) -> SurfacePoint {
        match self {
            Self::Mesh(mesh) => mesh.surface(element, hit.barycentric),
            Self::Quadric(quadric) => quadric.surface(ray, hit.t),
            Self::Curves(curves) => curves.surface(element, ray, hit),
        }
    }

    /// The same of where it was met alone, which for meshes is less work.
    #[inline]
    pub fn place(&self, element: u32, ray: &Ray, hit: &ElementHit) -> Place {
        match self {
            Self::Mesh(mesh) => mesh.place(element, hit.barycentric),
            Self::Quadric(_) | Self::Curves(_) => self.surface(element, ray, hit).into(),
        }
    }

    /// Draws a point of one element for a receiver at `from`. `None` for an element without area, or where the
    /// density is not finite (the receiver lies in the element's plane).
    pub fn sample_toward(&self, element: u32, from: Point3, u: [f32; 2]) -> Option<ShapeSample> {
        match self {
            Self::Mesh(mesh) => mesh.sample_toward(element, from, u),
            Self::Quadric(quadric) => quadric.sample_toward(from, u),
            Self::Curves(curves) => curves.sample_toward(element, from, u),
        }
    }

    /// Draws a point of one element by area. `None` for curves, which have no surface of their own: a band turns to
    /// whoever looks at it.
    pub fn sample_area(&self, element: u32, u: [f32; 2]) -> Option<AreaSample> {
        match self {
            Self::Mesh(mesh) => Some(mesh.sample_area(element, u)),
            Self::Quadric(quadric) => Some(quadric.sample_area(u.map(f64::from))),
            Self::Curves(_) => None,
        }
    }

    /// Density per area with which [`Shape::sample_area`] draws the point `p` of an element; 0 for curves.
    pub fn pdf_area(&self, element: u32, p: Point3) -> f64 {
        match self {
            Self::Mesh(mesh) => 1.0 / mesh.area(element),
            Self::Quadric(quadric) => quadric.pdf_area(p),
            Self::Curves(_) => 0.0,
        }
    }

    /// Whereto the normals of an element point.
    pub fn emission(&self, element: u32) -> Emission {
        match self {
            Self::Mesh(mesh) => mesh.emission(element),
            Self::Quadric(quadric) => quadric.emission(),
            Self::Curves(_) => Emission::Round,
        }
    }

    /// Density in sr⁻¹ with which [`Shape::sample_toward`] draws the point `p` with normal `ng` for a receiver
    /// at `from`.
    pub fn pdf_toward(&self, element: u32, from: Point3, p: Point3, ng: Normal3) -> f32 {
        match self {
            Self::Mesh(mesh) => area_to_solid_angle(from, p, ng, 1.0 / mesh.area(element)),
            Self::Quadric(quadric) => quadric.pdf_toward(from, p, ng),
            Self::Curves(curves) => curves.pdf_toward(element, from, p),
        }
    }

    /// Density in sr⁻¹ with which pbrt-v3 draws that point. Scaled and clipped quadrics count as they are, not as
    /// what it takes them for.
    pub fn pdf_in_pbrt(&self, element: u32, from: Point3, p: Point3, ng: Normal3) -> f32 {
        match self {
            Self::Mesh(_) | Self::Curves(_) => self.pdf_toward(element, from, p, ng),
            Self::Quadric(quadric) => quadric.pdf_in_pbrt(from, p, ng),
        }
    }
}

/// Turns a density per area at `p` into one per solid angle at `from`: × d² / cos. 0 where that is not finite.
fn area_to_solid_angle(from: Point3, p: Point3, ng: Normal3, pdf_area: f64) -> f32 {
    let w: DVec3 = p.to_f64() - from.to_f64();
    let d2 = w.length_squared();
    let cos = ng.to_f64().dot(w).abs() / d2.sqrt();
    let pdf_w = (pdf_area * d2 / cos) as f32;
    if pdf_w.is_finite() { pdf_w } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::error::offset_origin;
    use crate::sampling::rng::Rng;
    use crate::sampling::warp::uniform_sphere;
    use crate::shape::quadric::{Form, Sphere};

    #[test]
    fn rays_that_leave_a_placed_surface_do_not_meet_it_again() {
        let mut rng = Rng::new(5);
        for k in 0..200_000 {
            let mut random = |scale: f32| uniform_sphere(rng.uniform2()) * scale;
            let far = 10f32.powi(k % 5 - 2);
            let (center, aside) = (random(far), random(far));
            let shape = if k % 2 == 0 {
                let sphere = Sphere::new(0.5, -0.5, 0.5, 7.0);
                let moved = glam::DAffine3::from_translation(center.to_f64());
                let moved = Transform::from_affine(moved).expect("it has an inverse");
                Shape::Quadric(Quadric::new(Form::Sphere(sphere), moved, false))
            } else {
                Shape::Mesh(Mesh {
                    positions: [0, 1, 2].map(|_| (center + random(1.0)).into()).to_vec(),
                    triangles: vec![[0, 1, 2]],
                    ..Mesh::default()
                })
            };
            let render_from_object =
                glam::DAffine3::from_axis_angle(random(1.0).to_f64().normalize(), f64::from(k))
                    * glam::DAffine3::from_translation(aside.to_f64());
            let placed = Transform::from_affine(render_from_object).expect("it has an inverse");
            let toward = random(1.0);
            let ray = Ray {
                o: Point3::ZERO + center - toward * 3.0,
                d: toward,
                time: 0.0,
            };
            let Some(hit) = shape.intersect(0, &ray, &RayShear::new(&ray), f32::INFINITY) else {
                continue;
            };
            let surface = shape.surface(0, &ray, &hit).placed(&placed, 1.0);
            // Away from a sphere, either way from a triangle.
            let mut d = random(1.0);
            if k % 2 == 0 && surface.ng.dot(d) < 0.0 {
                d = -d;
            }
            let o = offset_origin(surface.p, surface.p_err, surface.ng, d);
            let back = placed.inverse();
            let ray = Ray {
                o: Point3::from_f64(back.point(o.to_f64())),
                d: Vec3::from_f64(back.vector(d.to_f64())),
                time: 0.0,
            };
            let again = shape.intersect(0, &ray, &RayShear::new(&ray), f32::INFINITY);
            assert_eq!(again, None, "{k}: {ray:?}");
        }
    }
}
