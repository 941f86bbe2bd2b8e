//! The order of lights by what they are, so that the order in which a file lists them changes no bit of a picture: numbers
//! of the sampler are spent on lights, chances laid out and sums taken in the order of their ids.
//!
//! Places count by their share along one oblique direction: a row of lamps along an axis is then in the same order whatever
//! rounding its transforms bring. What is alike in all of that may trade places without harm.

use std::cmp::Ordering;

use crate::ids::LightId;
use crate::light::Light;
use crate::math::{Point3, Vec3};
use crate::world::{Geometry, LampCopies, WorldParts};

/// Direction along which nothing is laid out on purpose.
const OBLIQUE: [f64; 3] = [0.532_017, 0.411_983, 0.739_741];
/// A point of a surface at which nothing meets on purpose, as numbers in [0, 1).
const PLACE: [f32; 2] = [0.371, 0.613];
/// Directions in which maps are compared, drawn evenly in a spiral.
const N_DIRECTIONS: usize = 64;

/// What tells lights apart, but for the elements of shapes and the maps of others.
type Key = [f64; 9];

/// Lights of following ids that stay together: the elements of a shape, or one other light.
struct Source {
    first: usize,
    n: usize,
    key: Key,
}

impl WorldParts {
    /// Gives lights ids by what they are instead of by the order of the file. Returns the new id of each.
    pub fn order_lights(&mut self) -> Vec<LightId> {
        let mut sources = Vec::new();
        let mut first = 0;
        while let Some(light) = self.lights.get(first) {
            let n = match light {
                Light::Area(area) => self.geometries[area.geometry.index()].shape.n_elements(),
                _ => 1,
            };
            let key = key(light, &self.geometries);
            sources.push(Source { first, n, key });
            first += n;
        }
        sources.sort_by(|a, b| {
            let by_key = a.key.iter().zip(&b.key).map(|(x, y)| x.total_cmp(y));
            by_key.fold(Ordering::Equal, Ordering::then).then_with(|| {
                self.details(a)
                    .partial_cmp(self.details(b))
                    .unwrap_or(Ordering::Equal)
            })
        });
        let old: Vec<usize> = sources
            .iter()
            .flat_map(|source| source.first..source.first + source.n)
            .collect();
        let mut new = vec![LightId::NONE; old.len()];
        for (index, &old) in old.iter().enumerate() {
            new[old] = LightId::new(index);
        }
        self.lights = old.iter().map(|&i| self.lights[i].clone()).collect();
        reorder(&mut self.light_media, &old, crate::ids::MediumId::NONE);
        reorder(&mut self.light_samples, &old, 1);
        for geometry in &mut self.geometries {
            if geometry.first_light.is_some() {
                geometry.first_light = new[geometry.first_light.index()];
            }
        }
        for first in self
            .lamp_copies
            .iter_mut()
            .flat_map(LampCopies::first_lights_mut)
        {
            *first = new[first.index()];
        }
        new
    }

    /// What is compared where keys are the same.
    fn details(&self, source: &Source) -> Box<dyn Iterator<Item = f64> + '_> {
        match &self.lights[source.first] {
            Light::Area(area) => {
                let shape = &self.geometries[area.geometry.index()].shape;
                let boxes = (0..source.n).map(|element| shape.bounds(element as u32));
                Box::new(boxes.flat_map(|b| {
                    b.min
                        .to_f64()
                        .to_array()
                        .into_iter()
                        .chain(b.max.to_f64().to_array())
                }))
            }
            light => Box::new((0..N_DIRECTIONS).flat_map(move |k| {
                let w = direction(k);
                let value = match light {
                    Light::Infinite(infinite) => Some(infinite.le(w)),
                    _ => light.intensity(w),
                };
                value.map_or([0.0; 3], |rgb| [rgb.r(), rgb.g(), rgb.b()].map(f64::from))
            })),
        }
    }
}

/// The entries of `old` ids in the new order, with `blank` for those beyond the last.
fn reorder<T: Copy>(values: &mut Vec<T>, old: &[usize], blank: T) {
    *values = old
        .iter()
        .map(|&i| values.get(i).copied().unwrap_or(blank))
        .collect();
}

/// One of [`N_DIRECTIONS`] directions.
fn direction(k: usize) -> Vec3 {
    let z = (2.0 * k as f64 + 1.0) / N_DIRECTIONS as f64 - 1.0;
    let (sin, cos) = (2.399_963 * k as f64).sin_cos();
    let r = ((1.0 - z) * (1.0 + z)).sqrt();
    Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32)
}

fn key(light: &Light, geometries: &[Geometry]) -> Key {
    let along = |v: glam::DVec3| v.dot(OBLIQUE.into());
    let place = |p: Point3| along(p.to_f64());
    let [r, g, b] = {
        let strength = light.strength();
        [strength.r(), strength.g(), strength.b()].map(f64::from)
    };
    let flag = |is_set: bool| f64::from(u8::from(is_set));
    match light {
        Light::Area(area) => {
            let shape = &geometries[area.geometry.index()].shape;
            let (p, ng) = match shape.sample_area(area.element, PLACE) {
                Some(sample) => (place(sample.p), along(sample.ng.to_f64())),
                None => (place(shape.bounds(area.element).center()), 0.0),
            };
            let flags =
                flag(area.two_sided) + 2.0 * flag(area.is_turned) + 4.0 * flag(area.has_holes);
            let n = shape.n_elements() as f64;
            [6.0, r, g, b, n, flags, p, ng, shape.area(area.element)]
        }
        Light::Point(point) => [0.0, r, g, b, place(point.p), 0.0, 0.0, 0.0, 0.0],
        Light::Spot(spot) => {
            let (axis, spread) = spot.cone();
            let (p, axis) = (place(spot.position()), along(axis.to_f64()));
            [1.0, r, g, b, p, axis, spread.into(), 0.0, 0.0]
        }
        Light::Projection(projection) => {
            let (axis, spread) = projection.cone();
            let (p, axis) = (place(projection.position()), along(axis.to_f64()));
            [2.0, r, g, b, p, axis, spread.into(), 0.0, 0.0]
        }
        Light::Goniometric(goniometric) => {
            let p = place(goniometric.position());
            [3.0, r, g, b, p, goniometric.power(), 0.0, 0.0, 0.0]
        }
        Light::Distant(distant) => [
            4.0,
            r,
            g,
            b,
            along(distant.direction.to_f64()),
            0.0,
            0.0,
            0.0,
            0.0,
        ],
        Light::Infinite(infinite) => [5.0, r, g, b, infinite.irradiance(), 0.0, 0.0, 0.0, 0.0],
    }
}
