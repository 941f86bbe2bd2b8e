//! Lens systems: spherical interfaces around the z axis, rays from the film through them, and where they focus
//! (pbrt 3rd ed., section 6.4; Kolb, Mitchell and Hanrahan 1995).
//!
//! Camera space: the film lies in the plane z = 0, the scene is toward +z, lengths are in metres.

use std::fmt;

use glam::DVec3;

use crate::camera::LocalRay;

/// One row of a lens table.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Interface {
    /// Radius of curvature, positive if the centre is on the film's side; 0 is the plane of a stop.
    pub curvature_radius: f64,
    /// Distance along the axis to the next interface toward the film, or from the last one to the film.
    pub thickness: f64,
    /// Index of refraction on the film's side.
    pub eta: f64,
    /// Rays farther from the axis are blocked.
    pub aperture_radius: f64,
}

/// A lens system, focused.
#[derive(Clone, Debug)]
pub struct Lens {
    /// From the film outward.
    surfaces: Vec<Surface>,
}

/// An interface as rays from the film meet it.
#[derive(Clone, Copy, Debug)]
struct Surface {
    /// Where it crosses the axis.
    z: f64,
    /// 1 / (z of the centre − z of the vertex).
    curvature: f64,
    aperture_radius: f64,
    /// Index of refraction before and behind.
    eta: [f64; 2],
}

/// Why a lens makes no picture.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum LensError {
    /// It does not gather light.
    NotConverging,
    /// Nothing nearer than this distance from the film comes into focus.
    TooClose {
        /// In metres.
        nearest: f64,
    },
    /// To be in focus, the film would have to be inside the lens.
    FilmInside,
    /// Not even the ray along the axis gets through.
    Opaque,
    /// Weights of rays are beyond what numbers can hold.
    OutOfRange,
}

impl fmt::Display for LensError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotConverging => write!(f, "the lens does not gather light"),
            Self::TooClose { nearest } => write!(
                f,
                "the lens cannot focus so close: the nearest distance from the film is {nearest:.4}"
            ),
            Self::FilmInside => write!(f, "the lens would focus inside itself"),
            Self::Opaque => write!(f, "no light gets through the lens"),
            Self::OutOfRange => write!(f, "the lens is too large or too small to compute with"),
        }
    }
}

impl std::error::Error for LensError {}

/// The Gaussian description of a lens in air, along z.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct CardinalPoints {
    /// Focal length on the film's side.
    pub focal_length: f64,
    /// Principal plane of the film's side.
    pub film_side: f64,
    /// Principal plane of the scene's side.
    pub scene_side: f64,
}

impl Lens {
    /// A lens with a given table, from the scene's side to the film's, before it is focused.
    pub fn new(interfaces: &[Interface]) -> Self {
        let mut z = 0.0;
        let surface = |(k, interface): (usize, &Interface)| {
            z += interface.thickness;
            let is_stop = interface.curvature_radius == 0.0;
            let beyond = k.checked_sub(1).map_or(1.0, |k| interfaces[k].eta);
            Surface {
                z,
                curvature: if is_stop {
                    0.0
                } else {
                    -1.0 / interface.curvature_radius
                },
                aperture_radius: interface.aperture_radius,
                // A stop bends nothing, whatever its row says.
                eta: if is_stop {
                    [interface.eta; 2]
                } else {
                    [interface.eta, beyond]
                },
            }
        };
        let from_film = interfaces.iter().enumerate().rev();
        Self {
            surfaces: from_film.map(surface).collect(),
        }
    }

    /// The lens moved along the axis so that the plane at a distance from the film comes into focus, by the
    /// thick-lens approximation.
    ///
    /// # Errors
    /// There is no such place for it.
    pub fn focused(mut self, focus_distance: f64) -> Result<Self, LensError> {
        let CardinalPoints {
            focal_length: f,
            film_side,
            scene_side,
        } = self.cardinal_points().ok_or(LensError::NotConverging)?;
        if !(f > 0.0 && f.is_finite()) {
            return Err(LensError::NotConverging);
        }
        // The distances a (object to lens) and b (lens to film), each to its principal plane, have 1/a + 1/b = 1/f
        // and a given sum.
        let sum = focus_distance - scene_side + film_side;
        let discriminant = sum * (sum - 4.0 * f);
        if !(sum > 0.0 && discriminant > 0.0) {
            let nearest = focus_distance + (4.0 * f - sum);
            return Err(LensError::TooClose { nearest });
        }
        // The smaller solution, without cancellation for distant planes.
        let b = 2.0 * f * sum / (sum + discriminant.sqrt());
        let shift = b - film_side;
        for surface in &mut self.surfaces {
            surface.z += shift;
        }
        if self.rear_extent()[0] > 0.0 {
            Ok(self)
        } else {
            Err(LensError::FilmInside)
        }
    }

    /// Focal length and principal planes, from paraxial rays. `None` if the lens is afocal.
    pub fn cardinal_points(&self) -> Option<CardinalPoints> {
        let (first, last) = (self.surfaces.first()?, self.surfaces.last()?);
        // Height and angle times index behind the last surface, of the two rays that start in the first one with
        // (1, 0) and (0, 1).
        let mut rays = [[1.0, 0.0], [0.0, 1.0]];
        let mut z = first.z;
        for surface in &self.surfaces {
            let [eta_i, eta_t] = surface.eta;
            let power = (eta_t - eta_i) * surface.curvature;
            for [height, angle] in &mut rays {
                *height += *angle * (surface.z - z) / eta_i;
                *angle -= *height * power;
            }
            z = surface.z;
        }
        let [[a, c], [_, d]] = rays;
        let eta_film = first.eta[0];
        let points = CardinalPoints {
            focal_length: -eta_film / c,
            film_side: first.z + eta_film * (d - 1.0) / c,
            scene_side: last.z + (1.0 - a) / c,
        };
        let CardinalPoints {
            focal_length,
            film_side,
            scene_side,
        } = points;
        (focal_length + film_side + scene_side)
            .is_finite()
            .then_some(points)
    }

    /// Where the interface nearest the film crosses the axis.
    pub fn rear_z(&self) -> f64 {
        self.rear().z
    }

    /// Radius of the aperture of the interface nearest the film.
    pub fn rear_aperture_radius(&self) -> f64 {
        self.rear().aperture_radius
    }

    /// Least and greatest z of the part of the rear interface that its aperture leaves open.
    pub fn rear_extent(&self) -> [f64; 2] {
        let rear = self.rear();
        // x²/(1 + √(1 − x²)) with x = r/R is the depth over R; an aperture wider than the sphere is the hemisphere.
        let x = (rear.aperture_radius * rear.curvature).abs().min(1.0);
        let edge = if rear.curvature == 0.0 {
            rear.z
        } else {
            rear.z + x * x / (1.0 + ((1.0 - x) * (1.0 + x)).sqrt()) / rear.curvature
        };
        [rear.z.min(edge), rear.z.max(edge)]
    }

    fn rear(&self) -> &Surface {
        self.surfaces
            .first()
            .expect("a lens has at least one interface")
    }

    /// The ray as it leaves the lens toward the scene, its direction normalised. `None` if it is blocked, reflected
    /// or misses an interface.
    #[inline]
    pub fn trace(&self, ray: LocalRay) -> Option<LocalRay> {
        self.follow(ray, |fill| fill <= 1.0)
    }

    /// How much of the apertures a ray needs: its greatest distance from the axis in terms of the aperture there,
    /// squared. At most 1 if it gets through; ∞ if it would not even through interfaces without edges.
    pub fn fill(&self, ray: LocalRay) -> f64 {
        let mut greatest = 0f64;
        let end = self.follow(ray, |fill| {
            greatest = greatest.max(fill);
            true
        });
        if end.is_some() {
            greatest
        } else {
            f64::INFINITY
        }
    }

    /// Follows a ray from the film, as long as `passes` says so, which sees its squared distance from the axis in
    /// terms of each aperture.
    #[inline]
    fn follow(&self, ray: LocalRay, mut passes: impl FnMut(f64) -> bool) -> Option<LocalRay> {
        let LocalRay { mut o, d } = ray;
        let mut d = d.normalize();
        for surface in &self.surfaces {
            if !(d.z > 0.0) {
                return None;
            }
            // First to the plane of the vertex, then to the sphere: nothing cancels, and planes are no exception
            // (Welford 1986, "Aberrations of Optical Systems", section 4.2).
            let to_plane = (surface.z - o.z) / d.z;
            let mut p = o + d * to_plane;
            p.z = 0.0;
            let c = surface.curvature;
            let f = c * p.length_squared();
            let g = d.z - c * p.dot(d);
            let discriminant = g * g - c * f;
            if !(discriminant >= 0.0) {
                return None;
            }
            let cos_i = discriminant.sqrt();
            let to_sphere = if f == 0.0 { 0.0 } else { f / (g + cos_i) };
            if !(to_plane + to_sphere >= 0.0) {
                return None;
            }
            p += d * to_sphere;
            let radius = surface.aperture_radius;
            if !passes(p.truncate().length_squared() / (radius * radius)) {
                return None;
            }
            let [eta_i, eta_t] = surface.eta;
            if eta_i != eta_t {
                let normal = DVec3::new(-c * p.x, -c * p.y, 1.0 - c * p.z);
                // Snell's law keeps the tangential part, times the index.
                let tangential = (d - normal * cos_i) * (eta_i / eta_t);
                let sin2_t = tangential.length_squared();
                if sin2_t > 1.0 {
                    return None;
                }
                d = tangential + normal * (1.0 - sin2_t).sqrt();
            }
            p.z += surface.z;
            o = p;
        }
        Some(LocalRay { o, d })
    }
}
