//! Vertices of paths, and what passes through them.

use crate::ids::{LightId, MediumId};
use crate::light::{Light, Wanted};
use crate::math::{Normal3, Point3, Vec3};
use crate::scatter::{Bsdf, HenyeyGreenstein, TransportMode};
use crate::spectrum::Rgb;
use crate::world::{Aim, Hit, Receiver, Segment, World};

/// Below any square of a distance between two different points in single precision.
const NO_DISTANCE: f64 = 1e-100;

/// Where a path starts or scatters.
#[derive(Clone, Debug)]
pub(super) struct Vertex<'a> {
    pub(super) kind: Kind<'a>,
    pub(super) p: Point3,
    /// Error box of `p`; zero off surfaces.
    pub(super) p_err: Vec3,
    /// Geometric normal; zero off surfaces.
    pub(super) ng: Normal3,
    /// Unit direction to the vertex before it on its own path.
    pub(super) wo: Vec3,
    /// What a path carries that ends here.
    pub(super) beta: Rgb,
    /// Density with which its own path finds it.
    pub(super) pdf_own: f64,
    /// Density with which a path that comes from the other end finds it.
    pub(super) pdf_other: f64,
    /// Its own path goes on specularly.
    pub(super) specular: bool,
    /// A surface that no path from a light gets to: see [`crate::shape::Shape::is_one_way`].
    pub(super) one_way: bool,
    /// Where its own path met a surface.
    pub(super) hit: Option<Hit>,
    /// The medium in which its own path arrived.
    pub(super) medium: MediumId,
    /// The one behind its surface, where boundaries lie in the place of that.
    pub(super) medium_through: Option<MediumId>,
}

/// What a vertex is.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "vertices live in lists that are kept; a box would be an allocation for each of them"
)]
pub(super) enum Kind<'a> {
    /// A point of the lens.
    Camera,
    /// A point of a light with a place.
    Light(LightId),
    /// A light infinitely far away. The vertex has no place, and densities are per solid angle.
    FarLight(LightId),
    /// A point of a surface.
    Surface(Bsdf<'a>),
    /// A point in a medium.
    Medium(HenyeyGreenstein),
}

impl Kind<'_> {
    /// A point of a light.
    pub(super) fn of_light(world: &World, light: LightId) -> Self {
        match world.light(light) {
            Light::Infinite(_) | Light::Distant(_) => Self::FarLight(light),
            Light::Point(_)
            | Light::Spot(_)
            | Light::Projection(_)
            | Light::Goniometric(_)
            | Light::Area(_) => Self::Light(light),
        }
    }
}

impl<'a> Vertex<'a> {
    /// A vertex off surfaces at which a path starts.
    pub(super) fn start(kind: Kind<'a>, p: Point3, medium: MediumId) -> Self {
        Self {
            kind,
            p,
            p_err: Vec3::ZERO,
            ng: Normal3::ZERO,
            wo: Vec3::ZERO,
            beta: Rgb::ONE,
            pdf_own: 0.0,
            pdf_other: 0.0,
            specular: false,
            one_way: false,
            hit: None,
            medium,
            medium_through: None,
        }
    }

    /// Whether other vertices can be connected to it.
    pub(super) fn connects(&self) -> bool {
        match &self.kind {
            Kind::Surface(bsdf) => bsdf.has_non_specular(),
            Kind::Medium(phase) => !phase.is_delta(),
            Kind::Camera | Kind::Light(_) | Kind::FarLight(_) => false,
        }
    }

    pub(super) fn receiver(&self, time: f32) -> Receiver {
        Receiver {
            p: self.p,
            p_err: self.p_err,
            ng: self.ng,
            // Weights know one density of directions toward a light, for both ends.
            wanted: Wanted::All,
            time,
        }
    }

    /// For a vertex of a camera path: what it lets through from the direction `toward_light`, cosine included.
    pub(super) fn passes_from(&self, toward_light: Vec3) -> Rgb {
        match &self.kind {
            Kind::Surface(bsdf) => {
                bsdf.f(self.wo, toward_light, TransportMode::Radiance) * bsdf.abs_cos(toward_light)
            }
            Kind::Medium(phase) => Rgb::splat(phase.p(self.wo, toward_light)),
            Kind::Camera | Kind::Light(_) | Kind::FarLight(_) => Rgb::BLACK,
        }
    }

    /// For a vertex of a light path: what it lets through toward the direction `toward_camera`, cosine included.
    ///
    /// The scattering function is seen from the camera whichever end a path starts at: what is found is the same
    /// picture even where a model is not reciprocal.
    pub(super) fn passes_to(&self, toward_camera: Vec3) -> Rgb {
        match &self.kind {
            Kind::Surface(bsdf) => {
                let f = bsdf.f(toward_camera, self.wo, TransportMode::Radiance);
                f * self.adjoint_cos(bsdf, toward_camera)
            }
            Kind::Medium(phase) => Rgb::splat(phase.p(self.wo, toward_camera)),
            Kind::Camera | Kind::Light(_) | Kind::FarLight(_) => Rgb::BLACK,
        }
    }

    /// The cosine at a vertex of a light path. Shading normals belong to the side light comes from, geometric ones to
    /// the measure of what is seen (pbrt 3rd ed., section 16.1.3).
    pub(super) fn adjoint_cos(&self, bsdf: &Bsdf, toward_camera: Vec3) -> f32 {
        let geometric = self.wo.abs_dot(self.ng);
        if geometric > 0.0 {
            toward_camera.abs_dot(self.ng) * bsdf.abs_cos(self.wo) / geometric
        } else {
            0.0
        }
    }

    /// Density in sr⁻¹ of scattering toward `to` for a path that comes from the direction `from`.
    pub(super) fn pdf_w(&self, from: Vec3, to: Vec3) -> f64 {
        match &self.kind {
            Kind::Surface(bsdf) => f64::from(bsdf.pdf(from, to)),
            Kind::Medium(phase) => f64::from(phase.p(from, to)),
            Kind::Camera | Kind::Light(_) | Kind::FarLight(_) => 0.0,
        }
    }

    /// Density in sr⁻¹ with which pbrt-v3 draws the direction `to` for a path that comes from `from`.
    pub(super) fn pdf_in_pbrt(&self, from: Vec3, to: Vec3) -> f32 {
        match &self.kind {
            Kind::Surface(bsdf) => bsdf.pdf_in_pbrt(from, to),
            Kind::Medium(phase) => phase.p(from, to),
            Kind::Camera | Kind::Light(_) | Kind::FarLight(_) => 0.0,
        }
    }

    /// Density of this vertex for a path that leaves `from` with density `pdf_w` per solid angle.
    pub(super) fn density(&self, from: Point3, pdf_w: f64) -> f64 {
        match self.kind {
            Kind::FarLight(_) => pdf_w,
            _ => density_at(self.p, self.ng, from, pdf_w),
        }
    }

    /// The medium a path is in that leaves toward `w`.
    pub(super) fn medium_toward(&self, world: &World, w: Vec3) -> MediumId {
        let goes_on = || (self.ng.dot(w) > 0.0) != (self.ng.dot(self.wo) > 0.0);
        match (self.hit, self.medium_through) {
            (_, Some(through)) if goes_on() => through,
            (_, Some(_)) | (None, None) => self.medium,
            (Some(hit), None) => world.medium_toward(hit.target, self.ng, w, self.medium),
        }
    }

    /// What must be free for two vertices to see each other. `None` if they are in one place.
    pub(super) fn segment_to(&self, other: &Self, time: f32) -> Option<Segment> {
        let aim = other.hit.map(|hit| Aim {
            target: hit.target,
            instance: hit.instance,
            from_behind: other.ng.dot(other.p - self.p) > 0.0,
        });
        Segment::between(&self.receiver(time), &other.receiver(time), aim)
    }
}

/// Density per area where the normal is `ng`, or per volume where it is zero, of the point `p` for a path that leaves
/// `from` with density `pdf_w` per solid angle.
pub(super) fn density_at(p: Point3, ng: Normal3, from: Point3, pdf_w: f64) -> f64 {
    let d = p.to_f64() - from.to_f64();
    let squared = d.length_squared().max(NO_DISTANCE);
    let n = ng.to_f64();
    let cos = if n == glam::DVec3::ZERO {
        1.0
    } else {
        n.dot(d).abs() / squared.sqrt()
    };
    pdf_w * cos / squared
}
