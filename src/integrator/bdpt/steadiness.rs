//! How little direct light of points varies within a pixel.
//!
//! Every pixel has its share of camera paths, but takes the light paths that happen to arrive. So what light sampling finds
//! of a light without extent has no noise where all points of a pixel see the light alike, while light paths to the same
//! points have, however many arrive: in proportion to densities alone, weights prefer the noise. Where a pixel shows
//! the edge of a cone, or more than its light, it is the other way round.

use crate::camera::Camera;
use crate::ids::LightId;
use crate::integrator::bdpt::Tracer;
use crate::integrator::bdpt::vertex::{Kind, Vertex};
use crate::light::Light;
use crate::math::Frame;
use crate::world::Receiver;

/// Corners of a square around a point of a pixel, in units of the pixel's side: it holds the pixel wherever in it the
/// point is, so that a convex patch of light which holds the corners fills the pixel.
const CORNERS: [[f32; 2]; 4] = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];

/// Of a function that is linear over a pixel: its variance there, relative to the mean square of its differences between
/// the middle and [`CORNERS`].
const LINEAR: f64 = 1.0 / 12.0;

impl Tracer<'_> {
    /// Mean square over variance of what light sampling finds in a pixel, at least 1: for a vertex that the camera sees with
    /// density `camera` and that chooses `light` with probability `pmf`. 1 for lights of any extent, in media, and
    /// through lenses, where noise comes from elsewhere.
    pub(super) fn steadiness(&self, light: LightId, vertex: &Vertex, camera: f64, pmf: f64) -> f64 {
        let is_point = !matches!(self.world.light(light), Light::Area(_) | Light::Infinite(_));
        let is_surface = matches!(vertex.kind, Kind::Surface(_));
        let has_lens = self.film.is_none_or(Camera::has_lens);
        if !(self.n_pixels > 1.0) || !is_point || !is_surface || has_lens {
            return 1.0;
        }
        let side = (1.0 / (camera * self.n_pixels).sqrt()) as f32;
        let frame = Frame::from_z(vertex.ng.into());
        let arrives = |[x, y]: [f32; 2]| {
            let at = Receiver {
                p: vertex.p + frame.s * (side * x) + frame.t * (side * y),
                ..vertex.receiver(self.time)
            };
            let sample = self.world.sample_on_light(light, 1.0, &at, [0.0; 2]);
            sample.map_or(0.0, |sample| f64::from(sample.radiance.max_component()))
        };
        let middle = arrives([0.0; 2]);
        let variances = CORNERS.map(|corner| match arrives(corner) {
            // An edge: light and dark, in parts that are not known.
            0.0 => 1.0,
            light => LINEAR * (light / middle - 1.0).powi(2),
        });
        let variance = variances.iter().sum::<f64>() / CORNERS.len() as f64;
        // No pixel is steadier than all of them are many; another light may be chosen; what is no number is 0/0.
        (1.0 / (1.0 / self.n_pixels + variance + (1.0 / pmf - 1.0))).max(1.0)
    }
}
