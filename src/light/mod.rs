//! Lights: what they emit, and how to draw a direction toward them. Knows no files, no materials, no visibility.
//!
//! Powers are in units of render space and serve only to choose among lights.

mod environment;
pub mod goniometric;
pub mod infinite;
mod luminances;
mod outline;
mod patch_choice;
mod pbrt_density;
mod placed_map;
pub mod projection;
mod regions;
pub mod spot;
pub mod tree;

use crate::ids::{BlockId, GeometryId};
use crate::math::{Normal3, Point3, Vec3};
use crate::sampling::alias::AliasTable;
use crate::spectrum::Rgb;
pub use goniometric::GoniometricLight;
pub use infinite::InfiniteLight;
pub use projection::ProjectionLight;
pub use spot::SpotLight;
pub use tree::{Emitter, LightTree};

/// A light.
#[derive(Clone, Debug)]
pub enum Light {
    /// Shines from a point in all directions alike.
    Point(PointLight),
    /// Shines from a point into a cone.
    Spot(Box<SpotLight>),
    /// Projects a picture from a point.
    Projection(Box<ProjectionLight>),
    /// Shines from a point as a map of directions says.
    Goniometric(Box<GoniometricLight>),
    /// Shines from infinitely far away in one direction.
    Distant(DistantLight),
    /// Surrounds the scene.
    Infinite(Box<InfiniteLight>),
    /// A surface that emits.
    Area(AreaLight),
}

/// What is wanted of the light that surrounds a receiver: what directions are drawn for, beside its brightness.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Wanted {
    /// All of it alike.
    All,
    /// What falls on a surface of this unit normal that scatters on its side only and draws directions of its own beside
    /// these: so rather, too, what is brighter than most.
    Facing(Normal3),
    /// What comes through to a place in this block of a medium.
    Within(BlockId),
}

impl Light {
    /// Where it is, if it is a point.
    pub fn position(&self) -> Option<Point3> {
        match self {
            Self::Point(point) => Some(point.p),
            Self::Spot(spot) => Some(spot.position()),
            Self::Projection(projection) => Some(projection.position()),
            Self::Goniometric(goniometric) => Some(goniometric.position()),
            Self::Distant(_) | Self::Infinite(_) | Self::Area(_) => None,
        }
    }

    /// Its radiance, irradiance or intensity, or what multiplies a map of that.
    pub fn strength(&self) -> Rgb {
        match self {
            Self::Point(point) => point.intensity,
            Self::Spot(spot) => spot.strength(),
            Self::Projection(projection) => projection.strength(),
            Self::Goniometric(goniometric) => goniometric.strength(),
            Self::Distant(distant) => distant.radiance,
            Self::Infinite(infinite) => infinite.strength(),
            Self::Area(area) => area.radiance,
        }
    }

    /// Whether it takes light away in some channel: colours beyond the gamut do, as those of single wavelengths.
    pub fn is_partly_negative(&self) -> bool {
        self.strength().min_component() < 0.0
    }

    /// Whether it is an [asymmetric lamp](crate::world::lamps).
    pub fn is_asymmetric(&self) -> bool {
        matches!(self, Self::Area(area) if area.is_asymmetric())
    }

    /// If it is a point: its intensity in the unit direction `w`, away from it.
    pub fn intensity(&self, w: Vec3) -> Option<Rgb> {
        match self {
            Self::Point(point) => Some(point.intensity),
            Self::Spot(spot) => Some(spot.intensity(w)),
            Self::Projection(projection) => Some(projection.intensity(w)),
            Self::Goniometric(goniometric) => Some(goniometric.intensity(w)),
            Self::Distant(_) | Self::Infinite(_) | Self::Area(_) => None,
        }
    }
}

/// Scene-file manual (`LightSource "point"`): `spectrum I` (1) in W/sr, `spectrum scale` (1), `point from`.
#[derive(Clone, Copy, Debug)]
pub struct PointLight {
    /// Position.
    pub p: Point3,
    /// Radiant intensity in render-space units: W/sr times the squared length scale.
    pub intensity: Rgb,
}

/// Scene-file manual (`LightSource "distant"`): `spectrum L` (1), `spectrum scale` (1), `point from`, `to`.
#[derive(Clone, Copy, Debug)]
pub struct DistantLight {
    /// Unit direction toward the light.
    pub direction: Vec3,
    /// Irradiance on a perpendicular area.
    pub radiance: Rgb,
}

/// Scene-file manual (`AreaLightSource "diffuse"`): `spectrum L` (1), `spectrum scale` (1), `bool twosided` (false).
#[derive(Clone, Copy, Debug)]
pub struct AreaLight {
    /// The shape that emits.
    pub geometry: GeometryId,
    /// Its element.
    pub element: u32,
    /// Emitted radiance.
    pub radiance: Rgb,
    /// Whether it emits from the back as well.
    pub two_sided: bool,
    /// In pbrt-v3, sampled points have the normal opposite to that of hits.
    pub is_turned: bool,
    /// A mask cuts holes into it, which light sampling in pbrt-v3 ignores.
    pub has_holes: bool,
}

impl AreaLight {
    /// Whether light sampling and rays see it differently in pbrt-v3 (see [`crate::world::lamps`]).
    #[inline]
    pub fn is_asymmetric(&self) -> bool {
        self.has_holes || self.is_turned && !self.two_sided
    }

    /// Whether it lights both of its sides, by whatever strategy of the model.
    #[inline]
    pub fn lights_both_sides(&self) -> bool {
        self.two_sided || self.is_turned
    }

    /// Radiance that leaves the surface toward `w` where its normal is `ng`.
    #[inline]
    pub fn le(&self, ng: Normal3, w: Vec3) -> Rgb {
        if self.two_sided || ng.dot(w) > 0.0 {
            self.radiance
        } else {
            Rgb::BLACK
        }
    }
}

/// How to choose one of the lights: with fixed probabilities.
#[derive(Clone, Debug, Default)]
pub struct LightChoice {
    table: Option<AliasTable>,
    n_lights: usize,
}

impl LightChoice {
    /// Chooses in proportion to `weights` (one for each light, non-negative); uniformly if all are zero.
    pub fn new(weights: &[f64]) -> Self {
        let table = if weights.len() > 1 {
            AliasTable::new(weights)
        } else {
            None
        };
        Self {
            table,
            n_lights: weights.len(),
        }
    }

    /// An index and its probability; `None` when there are no lights.
    #[inline]
    pub fn sample(&self, u: f64) -> Option<(usize, f32)> {
        match (&self.table, self.n_lights) {
            (_, 0) => None,
            (_, 1) => Some((0, 1.0)),
            (Some(table), _) => {
                let chosen = table.sample(u);
                Some((chosen.index, chosen.pmf))
            }
            (None, n) => Some((((u * n as f64) as usize).min(n - 1), 1.0 / n as f32)),
        }
    }

    /// Probability of an index.
    #[inline]
    pub fn pmf(&self, index: usize) -> f32 {
        match (&self.table, self.n_lights) {
            (_, 1) => 1.0,
            (Some(table), _) => table.pmf(index),
            (None, n) => 1.0 / n as f32,
        }
    }
}
