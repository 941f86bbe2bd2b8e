//! Surfaces of second degree, placed by a transform. All arithmetic is f64 in object space: these shapes are few,
//! and a ground sphere of radius 10⁸ must be as smooth as a marble.

pub mod cone;
pub mod cylinder;
pub mod disk;
pub mod hyperboloid;
pub mod paraboloid;
mod revolution;
pub mod sphere;
pub mod sweep;

use glam::{DAffine3, DVec3};

use crate::math::animated::corners_of;
use crate::math::error::EPSILON;
use crate::math::{Bounds3, Frame, Normal3, Point3, Ray, Transform, Vec3};
use crate::shape::{AreaSample, Emission, ShapeSample, SurfacePoint, area_to_solid_angle};
pub use cone::cone;
pub use cylinder::cylinder;
pub use disk::Disk;
pub use hyperboloid::{Hyperboloid, hyperboloid};
pub use paraboloid::Paraboloid;
pub use sphere::Sphere;
pub use sweep::Sweep;

/// Relative deviation below which a transform counts as a similarity: it comes from composing rotations in f64.
pub(super) const SIMILARITY_TOLERANCE: f64 = 1e-9;

/// The equation of a quadric in object space.
#[derive(Clone, Debug)]
pub enum Form {
    /// Sphere around the origin.
    Sphere(Sphere),
    /// Disk perpendicular to z.
    Disk(Disk),
    /// Cylinder, cone, swept hyperboloid or ring around z.
    Sweep(Sweep),
    /// Hyperboloid around z that its segment does not sweep.
    Hyperboloid(Box<Hyperboloid>),
    /// Paraboloid around z.
    Paraboloid(Paraboloid),
}

/// A point of a form, in object space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FormPoint {
    /// The point, moved exactly onto the form.
    pub(crate) p: DVec3,
    /// Unit normal of the surface.
    pub(crate) n: DVec3,
    /// Unit normal along ∂p/∂u × ∂p/∂v, which is pbrt-v3's.
    pub(crate) ns: DVec3,
    pub(crate) uv: [f64; 2],
    pub(crate) dpdu: DVec3,
    pub(crate) dpdv: DVec3,
    /// Derivatives of `ns`.
    pub(crate) dndu: DVec3,
    pub(crate) dndv: DVec3,
}

impl Form {
    fn intersect(&self, o: DVec3, d: DVec3, t_max: f64) -> Option<f64> {
        match self {
            Self::Sphere(sphere) => sphere.intersect(o, d, t_max),
            Self::Disk(disk) => disk.intersect(o, d, t_max),
            Self::Sweep(sweep) => sweep.intersect(o, d, t_max),
            Self::Hyperboloid(bent) => bent.intersect(o, d, t_max),
            Self::Paraboloid(paraboloid) => paraboloid.intersect(o, d, t_max),
        }
    }

    fn point(&self, p: DVec3) -> FormPoint {
        match self {
            Self::Sphere(sphere) => sphere.point(p),
            Self::Disk(disk) => disk.point(p),
            Self::Sweep(sweep) => sweep.point(p),
            Self::Hyperboloid(bent) => bent.point(p),
            Self::Paraboloid(paraboloid) => paraboloid.point(p),
        }
    }

    /// The normal of [`Form::point`] alone.
    fn normal(&self, p: DVec3) -> DVec3 {
        match self {
            Self::Sphere(_) => Sphere::normal(p),
            Self::Hyperboloid(bent) => bent.normal(p),
            Self::Disk(_) | Self::Sweep(_) | Self::Paraboloid(_) => self.point(p).n,
        }
    }

    /// Area in object space; not above 0 if there is no surface.
    fn area(&self) -> f64 {
        match self {
            Self::Sphere(sphere) => sphere.area(),
            Self::Disk(disk) => disk.area(),
            Self::Sweep(sweep) => sweep.area(),
            Self::Hyperboloid(bent) => bent.area(),
            Self::Paraboloid(paraboloid) => paraboloid.area(),
        }
    }

    /// A point and its normal, uniform by object-space area.
    fn sample_area(&self, u: [f64; 2]) -> (DVec3, DVec3) {
        match self {
            Self::Sphere(sphere) => sphere.sample_area(u),
            Self::Disk(disk) => disk.sample_area(u),
            Self::Sweep(sweep) => sweep.sample_area(u),
            Self::Hyperboloid(bent) => bent.sample_area(u),
            Self::Paraboloid(paraboloid) => paraboloid.sample_area(u),
        }
    }

    /// Whether nothing of the surface is clipped away.
    pub fn is_whole(&self) -> bool {
        match self {
            Self::Sphere(sphere) => sphere.is_whole(),
            Self::Disk(disk) => disk.is_whole(),
            Self::Sweep(sweep) => sweep.is_whole(),
            Self::Hyperboloid(bent) => bent.is_whole(),
            Self::Paraboloid(paraboloid) => paraboloid.is_whole(),
        }
    }

    /// The form as pbrt-v3 shows it where it was defined under `definition_from_object`: a hyperboloid that reaches
    /// beyond the box around its turned ends is met only by lines that pass that box.
    pub fn defined_under(self, definition_from_object: &DAffine3) -> Self {
        match self {
            Self::Hyperboloid(bent) => {
                Self::Hyperboloid(Box::new(bent.behind_window(definition_from_object)))
            }
            other => other,
        }
    }

    /// The eight corners of the box around it in object space.
    pub fn corners(&self) -> [DVec3; 8] {
        corners_of(self.bounds())
    }

    /// Smallest and largest coordinates in object space.
    fn bounds(&self) -> [DVec3; 2] {
        match self {
            Self::Sphere(sphere) => sphere.bounds(),
            Self::Disk(disk) => disk.bounds(),
            Self::Sweep(sweep) => sweep.bounds(),
            Self::Hyperboloid(bent) => bent.bounds(),
            Self::Paraboloid(paraboloid) => paraboloid.bounds(),
        }
    }
}

/// A quadric in render space.
#[derive(Clone, Debug)]
pub struct Quadric {
    form: Form,
    render_from_object: Transform,
    /// The normal is the negative of ∂p/∂u × ∂p/∂v, both in object space.
    flip_normal: bool,
    /// Scale of the transform, when it is a similarity.
    uniform_scale: Option<f64>,
    /// Area in render space.
    area: f64,
    /// Length in render space of one unit of the world.
    unit: f64,
}

/// Least cosine between a normal of pbrt-v3 and that of the surface for which error boxes make up.
const LEAST_COS: f32 = 0.01;

/// What to multiply an error box with so that a point that is moved off it along `ng` is off it along `n_surface` as well:
/// 1 where both are the same.
fn reach_across(ng: Normal3, n_surface: Normal3, p_err: Vec3) -> f32 {
    if ng == n_surface {
        return 1.0;
    }
    let extent = |n: Normal3| n.0.abs().dot(p_err.0);
    let cos = ng.0.dot(n_surface.0).abs().max(LEAST_COS);
    let factor = extent(n_surface) / (extent(ng) * cos);
    if factor.is_finite() {
        factor.max(1.0)
    } else {
        1.0
    }
}

impl Quadric {
    /// Places a form. `flip_normal` turns its normal around in object space: pbrt-v3 does so when exactly one of
    /// `ReverseOrientation` and a mirroring definition holds, so that a mirrored sphere has its normal inside.
    pub fn new(form: Form, render_from_object: Transform, flip_normal: bool) -> Self {
        let uniform_scale = render_from_object.uniform_scale(SIMILARITY_TOLERANCE);
        let mut quadric = Self {
            form,
            render_from_object,
            flip_normal,
            uniform_scale,
            area: 0.0,
            unit: 1.0,
        };
        quadric.area = match uniform_scale {
            Some(scale) => quadric.form.area() * scale * scale,
            None => {
                // Mean stretch over a grid of area-uniform points.
                const N: usize = 64;
                let stretch = |k: usize| {
                    let u = [(k % N) as f64 + 0.5, (k / N) as f64 + 0.5].map(|x| x / N as f64);
                    quadric.area_stretch(quadric.form.sample_area(u).1)
                };
                quadric.form.area() * (0..N * N).map(stretch).sum::<f64>() / (N * N) as f64
            }
        };
        quadric
    }

    /// The same where one unit of the world is `unit` long in render space. Bumps are measured by it.
    pub fn with_unit(self, unit: f64) -> Self {
        Self { unit, ..self }
    }

    /// Factor by which the transform stretches area where the object-space unit normal is `n`.
    fn area_stretch(&self, n: DVec3) -> f64 {
        self.render_from_object.determinant().abs() * self.render_from_object.normal(n).length()
    }

    /// Area in render space.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Box around it; empty if it has no area.
    pub fn bounds(&self) -> Bounds3 {
        if !(self.area > 0.0 && self.area.is_finite()) {
            return Bounds3::EMPTY;
        }
        let mut bounds = Bounds3::EMPTY;
        for corner in self.form.corners() {
            let p = self.render_from_object.point(corner).as_vec3a();
            // Rounded outward, so that the f32 box holds the f64 one.
            let down = Point3::new(p.x.next_down(), p.y.next_down(), p.z.next_down());
            let up = Point3::new(p.x.next_up(), p.y.next_up(), p.z.next_up());
            bounds = bounds.with_point(down).with_point(up);
        }
        bounds
    }

    fn object_ray(&self, ray: &Ray) -> (DVec3, DVec3) {
        let object_from_render = self.render_from_object.inverse();
        (
            object_from_render.point(ray.o.to_f64()),
            object_from_render.vector(ray.d.to_f64()),
        )
    }

    /// Distance to the nearest meeting in (0, `t_max`).
    pub fn intersect(&self, ray: &Ray, t_max: f32) -> Option<f32> {
        let (o, d) = self.object_ray(ray);
        let t = self.form.intersect(o, d, t_max as f64)? as f32;
        (t > 0.0 && t < t_max).then_some(t)
    }

    /// The surface where `ray` met it at distance `t`.
    pub fn surface(&self, ray: &Ray, t: f32) -> SurfacePoint {
        let (o, d) = self.object_ray(ray);
        let at = self.form.point(o + d * t as f64);
        let (p, p_err) = self.render_point(at.p);
        let (n_surface, ng) = (self.render_normal(at.n), self.render_normal(at.ns));
        let p_err = p_err * reach_across(ng, n_surface, p_err);
        let vector = |v: DVec3| Vec3::from_f64(self.render_from_object.vector(v));
        // By the inverse transpose of the map to world space, whichever way the normal points.
        let world_normal = |n: DVec3| self.render_from_object.normal(n) * self.unit;
        let normal = |n: DVec3| Vec3::from_f64(world_normal(n));
        let sign = if self.flip_normal { -1.0 } else { 1.0 };
        let (mut dpdu, dpdv) = (vector(at.dpdu), vector(at.dpdv));
        if dpdu.length_squared() == 0.0 {
            dpdu = Frame::from_z(ng.into()).s * self.unit as f32; // A pole.
        }
        SurfacePoint {
            p,
            p_err,
            ng,
            n_surface,
            ns: ng,
            uv: at.uv.map(|x| x as f32),
            dpdu,
            dpdv,
            tangent: dpdu,
            bitangent: dpdv,
            dndu: normal(at.dndu),
            dndv: normal(at.dndv),
            face: 0,
            dn_scale: (sign / world_normal(at.ns).length()) as f32,
        }
    }

    /// Whether its normal in pbrt-v3 is not that of its surface.
    pub fn has_normal_of_its_own(&self) -> bool {
        matches!(self.form, Form::Hyperboloid(_))
    }

    /// [`SurfacePoint::n_surface`] of [`Quadric::surface`] alone.
    pub fn normal(&self, ray: &Ray, t: f32) -> Normal3 {
        let (o, d) = self.object_ray(ray);
        self.render_normal(self.form.normal(o + d * t as f64))
    }

    /// An object-space point in render space with its error bound: one rounding to f32, and the f64 rounding of
    /// the transform, which counts where large terms cancel.
    fn render_point(&self, p_object: DVec3) -> (Point3, Vec3) {
        let p = self.render_from_object.point(p_object);
        let affine = self.render_from_object.affine();
        let terms = affine.matrix3.x_axis.abs() * p_object.x.abs()
            + affine.matrix3.y_axis.abs() * p_object.y.abs()
            + affine.matrix3.z_axis.abs() * p_object.z.abs()
            + affine.translation.abs();
        let err = p.abs() * EPSILON as f64 + terms * (8.0 * f64::EPSILON);
        (Point3::from_f64(p), Vec3::from_f64(err))
    }

    fn render_normal(&self, n_object: DVec3) -> Normal3 {
        let n = if self.flip_normal {
            -n_object
        } else {
            n_object
        };
        Normal3::from_f64(self.render_from_object.normal(n).normalize())
    }

    /// Whether it is the same surface, on whichever side its normals are.
    pub fn is_same_form(&self, other: &Self) -> bool {
        let text = |quadric: &Self| format!("{:?} {:?}", quadric.form, quadric.render_from_object);
        text(self) == text(other)
    }

    /// The sphere in render space of which this is all or a part: centre and radius.
    fn sphere(&self) -> Option<(DVec3, f64)> {
        match (&self.form, self.uniform_scale) {
            (Form::Sphere(sphere), Some(scale)) => Some((
                self.render_from_object.point(DVec3::ZERO),
                sphere.radius() * scale,
            )),
            _ => None,
        }
    }

    /// The same if this is all of it.
    pub fn whole_sphere(&self) -> Option<(DVec3, f64)> {
        self.sphere().filter(|_| self.form.is_whole())
    }

    /// See [`crate::shape::Shape::sample_toward`]. A whole sphere seen from outside is sampled by the solid angle
    /// it subtends, anything else by area: in object space, with the stretch of the transform as Jacobian.
    pub fn sample_toward(&self, from: Point3, u: [f32; 2]) -> Option<ShapeSample> {
        let u = u.map(f64::from);
        if let Some((center, radius)) = self.whole_sphere()
            && let Some(cone) = sphere::Cone::new(center, radius, from.to_f64())
        {
            let n = cone.sample(u);
            let p_object = self.render_from_object.inverse().point(center + n * radius);
            let (p, p_err) = self.render_point(p_object);
            let ng = self.render_normal(self.form.normal(p_object));
            return Some(ShapeSample {
                p,
                p_err,
                ng,
                pdf_w: cone.pdf_w() as f32,
                barycentric: [0.0; 2],
            });
        }
        self.sample_area(u).toward(from)
    }

    /// See [`crate::shape::Shape::sample_area`]: uniform in object space.
    pub fn sample_area(&self, u: [f64; 2]) -> AreaSample {
        let (p_object, n_object) = self.form.sample_area(u);
        let (p, p_err) = self.render_point(p_object);
        AreaSample {
            p,
            p_err,
            ng: self.render_normal(n_object),
            pdf_area: 1.0 / (self.form.area() * self.area_stretch(n_object)),
            barycentric: [0.0; 2],
        }
    }

    /// See [`crate::shape::Shape::emission`].
    pub fn emission(&self) -> Emission {
        match self.form {
            Form::Disk(_) => Emission::Flat(self.sample_area([0.5; 2]).ng),
            Form::Sphere(_) | Form::Sweep(_) | Form::Hyperboloid(_) | Form::Paraboloid(_) => {
                Emission::Round
            }
        }
    }

    /// See [`crate::shape::Shape::pdf_toward`].
    pub fn pdf_toward(&self, from: Point3, p: Point3, ng: Normal3) -> f32 {
        if let Some((center, radius)) = self.whole_sphere()
            && let Some(cone) = sphere::Cone::new(center, radius, from.to_f64())
        {
            return cone.pdf_w() as f32;
        }
        area_to_solid_angle(from, p, ng, self.pdf_area(p))
    }

    /// See [`crate::shape::Shape::pdf_in_pbrt`]: of any part of a sphere, that of the whole one, as seen from outside.
    pub fn pdf_in_pbrt(&self, from: Point3, p: Point3, ng: Normal3) -> f32 {
        if let Some((center, radius)) = self.sphere()
            && let Some(cone) = sphere::Cone::new(center, radius, from.to_f64())
        {
            return cone.pdf_w() as f32;
        }
        area_to_solid_angle(from, p, ng, 1.0 / self.area)
    }

    /// See [`crate::shape::Shape::pdf_area`].
    pub fn pdf_area(&self, p: Point3) -> f64 {
        let stretch = match self.uniform_scale {
            Some(scale) => scale * scale,
            None => {
                let p = self.render_from_object.inverse().point(p.to_f64());
                self.area_stretch(self.form.normal(p))
            }
        };
        1.0 / (self.form.area() * stretch)
    }
}
