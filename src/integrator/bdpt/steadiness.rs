//! How little direct light of points varies within a pixel.
//!
//! Every pixel has its share of camera paths, but takes the light paths that happen to arrive. So what light sampling finds
//! of a light without extent has no noise where all points of a pixel see the light alike, while light paths to the same
//! points have, however many arrive: in proportion to densities alone, weights prefer the noise. Where a pixel shows
//! the edge of a cone, or more than its light, it is the other way round.
//!
//! What is looked at is the pixel as a whole, so that all its points are weighed alike: weights that change within it would
//! be noise themselves.

use crate::camera::{Camera, CameraSample};
use crate::ids::LightId;
use crate::integrator::bdpt::Tracer;
use crate::integrator::bdpt::vertex::{Kind, Vertex};
use crate::light::Light;
use crate::math::Point3;
use crate::world::Receiver;

/// Places of a pixel: its middle and its corners. A convex patch of light that holds them fills the pixel.
const PLACES: [[f64; 2]; 5] = [[0.5, 0.5], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
/// Of a function that is linear over a pixel: its variance, relative to that over [`PLACES`].
const LINEAR: f64 = 5.0 / 12.0;

impl Tracer<'_> {
    /// Mean square over variance of what light sampling finds in a pixel, at least 1: for a vertex that the camera sees and
    /// that chooses `light` with probability `pmf`. 1 for lights of any extent, in media, and through lenses and moving
    /// cameras, where noise comes from elsewhere.
    pub(super) fn steadiness(&self, light: LightId, vertex: &Vertex, pmf: f64) -> f64 {
        let is_point = !matches!(self.world.light(light), Light::Area(_) | Light::Infinite(_));
        let is_surface = matches!(vertex.kind, Kind::Surface(_));
        let pinhole = |camera: &&Camera| !camera.has_lens() && camera.is_still();
        let Some(camera) = self.film.filter(pinhole) else {
            return 1.0;
        };
        if !(self.n_pixels > 1.0) || !is_point || !is_surface {
            return 1.0;
        }
        let Some(arrival) = camera.sample_arrival(vertex.p, [0.5; 2], self.time) else {
            return 1.0;
        };
        let pixel = arrival.raster.map(f64::floor);
        let seen = PLACES.map(|place| {
            seen_on_plane(camera, vertex, [pixel[0] + place[0], pixel[1] + place[1]]).map_or(
                0.0,
                |p| {
                    let at = Receiver {
                        p,
                        ..vertex.receiver(self.time)
                    };
                    let sample = self.world.sample_on_light(light, 1.0, &at, [0.0; 2]);
                    sample.map_or(0.0, |sample| f64::from(sample.radiance.max_component()))
                },
            )
        });
        let n = PLACES.len() as f64;
        let mean = seen.iter().sum::<f64>() / n;
        let spread = seen.map(|x| (x / mean - 1.0).powi(2)).iter().sum::<f64>() / n;
        // At an edge, light fills a part that is not known.
        let variance = if seen.contains(&0.0) {
            spread
        } else {
            LINEAR * spread
        };
        // No pixel is steadier than all of them are many; another light may be chosen; what is no number is 0/0.
        (1.0 / (1.0 / self.n_pixels + variance + (1.0 / pmf - 1.0))).max(1.0)
    }
}

/// Where a camera sees the tangent plane of a vertex. `None` beyond its horizon.
fn seen_on_plane(camera: &Camera, vertex: &Vertex, raster: [f64; 2]) -> Option<Point3> {
    let sample = CameraSample {
        raster,
        time: 0.0,
        lens: [0.5; 2],
    };
    let ray = camera.ray(&sample)?.ray;
    let t = (vertex.p - ray.o).dot(vertex.ng) / ray.d.dot(vertex.ng);
    (t > 0.0 && t.is_finite()).then(|| ray.at(t))
}
