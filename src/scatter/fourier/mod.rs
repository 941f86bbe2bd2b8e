//! Tabulated isotropic BSDFs: splines over the elevations of both directions, Fourier series over the azimuth between
//! them (Jakob et al. 2014; pbrt, 3rd ed., section 8.6).
//!
//! The table follows the flow of light: μi is the cosine of the direction light *travels* in, so that reflection has
//! μi μo < 0, and holds values times |μi|.

mod density;
mod file;

use std::f32::consts::TAU;

use arrayvec::ArrayVec;

use crate::math::Vec3;
use crate::math::spline::SplineWeights;
use crate::scatter::TransportMode;
use crate::spectrum::Rgb;
use density::Density;
pub use file::{FourierFileError, decode};

/// Coefficients that are summed at a time, so that series of any length need no memory.
const BLOCK: usize = 64;

/// A tabulated BSDF.
#[derive(Clone, Debug)]
pub struct FourierTable {
    /// Cosines of the nodes, at least two, from below to above. Equal ones, but never the last two, stand on the two
    /// sides of the surface.
    mu: Vec<f32>,
    n_channels: usize,
    /// Index of refraction on the −z side relative to the +z side.
    eta: f32,
    /// By node of μo, then of μi.
    series: Vec<Series>,
    coefficients: Vec<f32>,
    /// By node of μo: the integral over μi of the luminance's first coefficient, as the file has it.
    masses: Vec<f32>,
    density: Density,
}

/// The Fourier coefficients of one pair of nodes: those of luminance, then of red, then of blue.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Series {
    start: usize,
    /// Coefficients of one channel.
    len: usize,
}

/// Cosines of a pair of directions, as the table is addressed.
struct Angles {
    mu_i: f32,
    mu_o: f32,
    /// Cosine and absolute value of the azimuth between the directions of travel, in [0, π]. `None` where the viewer
    /// has no azimuth.
    phi: Option<f32>,
    cos_phi: f64,
}

impl FourierTable {
    /// Value in sr⁻¹, cosine excluded.
    pub fn f(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Rgb {
        let angles = Angles::new(wo, wi);
        let (mu_i, mu_o) = (angles.mu_i, angles.mu_o);
        if mu_i == 0.0 {
            return Rgb::BLACK;
        }
        let [y, r, b] = self.sum(mu_i, mu_o, angles.cos_phi);
        let y = y.max(0.0);
        let mut scale = 1.0 / mu_i.abs();
        if mode == TransportMode::Radiance && mu_i * mu_o > 0.0 {
            // Radiance is compressed into the cone of the denser side (pbrt 3rd ed., section 16.1.3).
            let eta = if mu_i > 0.0 { 1.0 / self.eta } else { self.eta };
            scale *= eta * eta;
        }
        let color = if self.n_channels == 1 {
            Rgb::splat(y)
        } else {
            // Green from the luminance of the table, as pbrt-v3 weighs it.
            Rgb::new(r, 1.39829 * y - 0.100913 * b - 0.297375 * r, b)
        };
        let f = color.clamp_negative() * scale;
        if f.is_finite() { f } else { Rgb::BLACK }
    }

    /// Density of [`FourierTable::sample`] in sr⁻¹.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let angles = Angles::new(wo, wi);
        self.density
            .pdf(&self.mu, angles.mu_o, angles.mu_i, angles.phi)
    }

    /// Density in sr⁻¹ with which pbrt-v3 draws `wi`: the luminance over its integral, which the file has. Where both
    /// swing below 0 it is 0.
    pub fn pdf_in_pbrt(&self, wo: Vec3, wi: Vec3) -> f32 {
        let Angles {
            mu_i,
            mu_o,
            cos_phi,
            ..
        } = Angles::new(wo, wi);
        let Some(spline_o) = SplineWeights::new(&self.mu, mu_o) else {
            return 0.0;
        };
        let rho = TAU * spline_o.sum(|o| self.masses[o]);
        let [y, ..] = self.sum(mu_i, mu_o, cos_phi);
        if rho > 0.0 && y > 0.0 { y / rho } else { 0.0 }
    }

    /// Draws `wi`, its elevation and then its azimuth. `None` where nothing scatters.
    pub fn sample(&self, wo: Vec3, u_part: f32, u: [f32; 2]) -> Option<Vec3> {
        let mu_o = wo.z().clamp(-1.0, 1.0);
        let sin_o = (wo.x() * wo.x() + wo.y() * wo.y()).sqrt();
        let axis = (sin_o > 0.0).then(|| [wo.x() / sin_o, wo.y() / sin_o]);
        let (mu_i, phi) = self
            .density
            .sample(&self.mu, mu_o, axis.is_some(), u_part, u)?;
        let [x, y] = axis.unwrap_or([1.0, 0.0]);
        let sin_i = ((1.0 - mu_i) * (1.0 + mu_i)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = phi.sin_cos();
        let travel = Vec3::new(
            sin_i * (cos_phi * x - sin_phi * y),
            sin_i * (sin_phi * x + cos_phi * y),
            mu_i,
        );
        (mu_i != 0.0).then(|| -travel.normalize())
    }

    /// The tabulated values times |μi| of luminance, red and blue; only the first for a table of one channel.
    fn sum(&self, mu_i: f32, mu_o: f32, cos_phi: f64) -> [f32; 3] {
        let (Some(spline_i), Some(spline_o)) = (
            SplineWeights::new(&self.mu, mu_i),
            SplineWeights::new(&self.mu, mu_o),
        ) else {
            return [0.0; 3];
        };
        let mut terms = ArrayVec::<(f32, Series), 16>::new();
        for (o, weight_o) in spline_o.terms() {
            for (i, weight_i) in spline_i.terms() {
                let series = self.series[o * self.mu.len() + i];
                if series.len > 0 {
                    terms.push((weight_o * weight_i, series));
                }
            }
        }
        let longest = terms.iter().map(|(_, series)| series.len).max();
        let mut sums = [0f64; 3];
        // cos kφ and cos (k − 1)φ.
        let (mut cos, mut before) = (1.0, cos_phi);
        for start in (0..longest.unwrap_or(0)).step_by(BLOCK) {
            let mut mean = [[0f32; BLOCK]; 3];
            for &(weight, series) in &terms {
                let len = series.len.saturating_sub(start).min(BLOCK);
                for (channel, mean) in mean.iter_mut().enumerate().take(self.n_channels) {
                    let first = series.start + channel * series.len + start.min(series.len);
                    let coefficients = &self.coefficients[first..first + len];
                    for (mean, coefficient) in mean.iter_mut().zip(coefficients) {
                        *mean += weight * coefficient;
                    }
                }
            }
            let mut cosines = [0f64; BLOCK];
            for value in &mut cosines {
                *value = cos;
                (cos, before) = (2.0 * cos_phi * cos - before, cos);
            }
            for (sum, mean) in sums.iter_mut().zip(&mean) {
                let terms = mean.iter().zip(&cosines);
                *sum += terms.map(|(a, cos)| f64::from(*a) * cos).sum::<f64>();
            }
        }
        sums.map(|sum| sum as f32)
    }
}

impl Angles {
    fn new(wo: Vec3, wi: Vec3) -> Self {
        let travel = -wi;
        let dot =
            f64::from(travel.x()) * f64::from(wo.x()) + f64::from(travel.y()) * f64::from(wo.y());
        let cross =
            f64::from(travel.x()) * f64::from(wo.y()) - f64::from(travel.y()) * f64::from(wo.x());
        let length = dot.hypot(cross);
        Self {
            mu_i: travel.z().clamp(-1.0, 1.0),
            mu_o: wo.z().clamp(-1.0, 1.0),
            phi: (wo.x() != 0.0 || wo.y() != 0.0).then(|| cross.abs().atan2(dot) as f32),
            cos_phi: if length > 0.0 { dot / length } else { 1.0 },
        }
    }
}

/// Index of the interval of ascending `nodes` that holds `x`, the last of those that begin at or before it.
fn interval(nodes: &[f32], x: f32) -> usize {
    let after = nodes.partition_point(|&node| node <= x);
    after.saturating_sub(1).min(nodes.len() - 2)
}
