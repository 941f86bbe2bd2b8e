//! How much of what a material receives it sends back, for the warning that it is more.

use crate::ids::MaterialId;
use crate::material::{Input, Inputs, Materials, Model};
use crate::math::{Frame, Point3, Vec3};
use crate::sampling::rng::Rng;
use crate::scatter::{Bsdf, TransportMode};
use crate::texture::{Source, TextureContext, Textures};

/// Cosines of the directions that are looked from.
const COSINES: [f32; 3] = [1.0, 0.5, 0.1];
/// Directions drawn for each look: most materials pass the first, nearly all of the others the next.
const LOOKS: [u32; 3] = [32, 128, 512];
/// Directions drawn for certainty.
const LAST_LOOK: u32 = 2048;
/// Standard errors that are certainty.
const SIGMAS: f64 = 4.0;

/// An estimate.
#[derive(Clone, Copy)]
struct Albedo {
    mean: f64,
    standard_error: f64,
}

impl Materials {
    /// The largest directional albedo found among a few directions and all channels, if it is certainly above `most`.
    /// Only materials that are the same everywhere are looked at, and what their surface scatters at once.
    /// With it, how many directions were drawn.
    pub fn albedo_above(&self, id: MaterialId, most: f64) -> (Option<f64>, u32) {
        if !self.is_uniform(id) || self.scatters_at_most(id, most) {
            return (None, 0);
        }
        let mut n_drawn = 0;
        let largest = COSINES.map(|cos| {
            for n in LOOKS {
                n_drawn += n;
                let look = self.albedo(id, cos, n);
                if look.mean + SIGMAS * look.standard_error <= most {
                    return None;
                }
            }
            n_drawn += LAST_LOOK;
            let last = self.albedo(id, cos, LAST_LOOK);
            (last.mean - SIGMAS * last.standard_error > most).then_some(last.mean)
        });
        (largest.into_iter().flatten().reduce(f64::max), n_drawn)
    }

    /// Whether the coefficients of all lobes together are at most `most`: nothing need be drawn to know that.
    fn scatters_at_most(&self, id: MaterialId, most: f64) -> bool {
        let bsdf = self.flat_bsdf(id);
        f64::from(bsdf.max_albedo()) <= most
    }

    /// The lobes of a material that is the same everywhere, on a plane.
    fn flat_bsdf(&self, id: MaterialId) -> Bsdf<'_> {
        let frame = Frame::from_z(Vec3::new(0.0, 0.0, 1.0));
        let at = Inputs {
            ctx: &TextureContext::at_point(Point3::ZERO, [0.5; 2]),
            textures: &Textures::default(),
        };
        let mut bsdf = Bsdf::new(frame, frame.n.into());
        self.scatter(id, &at, &mut bsdf);
        bsdf
    }

    /// Whether nothing that a material or its parts read varies.
    fn is_uniform(&self, id: MaterialId) -> bool {
        let material = &self.list[id.index()];
        let is_constant = |input: &Input| {
            matches!(
                input,
                Input::Float(Source::Constant(_)) | Input::Spectrum(Source::Constant(_))
            )
        };
        let parts_are = match &material.model {
            Model::Mix(mix) => self.is_uniform(mix.first) && self.is_uniform(mix.second),
            _ => true,
        };
        parts_are && material.model.inputs().iter().all(is_constant)
    }

    /// The directional albedo seen under a cosine, in the brightest channel, by `n` directions.
    fn albedo(&self, id: MaterialId, cos: f32, n: u32) -> Albedo {
        let bsdf = self.flat_bsdf(id);
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let mut rng = Rng::new(0);
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for _ in 0..n {
            let (u_lobe, u) = (rng.uniform(), rng.uniform2());
            // Light, not radiance: refraction into glass widens no beam.
            if let Some(sample) = bsdf.sample(wo, u_lobe, u, TransportMode::Importance) {
                for (channel, weight) in sample.weight.to_array().into_iter().enumerate() {
                    sum[channel] += f64::from(weight);
                    squares[channel] += f64::from(weight).powi(2);
                }
            }
        }
        let n = f64::from(n);
        let albedo = |channel: usize| {
            let mean = sum[channel] / n;
            let variance = (squares[channel] / n - mean * mean).max(0.0) / n;
            Albedo {
                mean,
                standard_error: variance.sqrt(),
            }
        };
        let [r, g, b] = [0, 1, 2].map(albedo);
        let brighter = |a: Albedo, b: Albedo| if a.mean < b.mean { b } else { a };
        brighter(brighter(r, g), b)
    }
}
