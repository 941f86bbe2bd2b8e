//! Photon beam diffusion: how much light leaves a half space of a scattering medium at a distance from where a beam
//! enters it (Habel, Christensen and Jarosz 2013; pbrt 3rd ed., section 15.5).

use std::f64::consts::PI;

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::math::spline::{self, SplineWeights};
use crate::scatter::fresnel;

const N_ALBEDOS: usize = 100;
const N_RADII: usize = 64;
/// Points of the quadrature along the beam.
const N_DEPTHS: usize = 100;
const FIRST_RADIUS: f64 = 2.5e-3;
const RADIUS_RATIO: f64 = 1.2;

/// Profiles for one index of refraction and one anisotropy, over albedo and radius.
///
/// A profile is 2πr S(r), the light per radius; radii are in mean free paths 1/`sigma_t`.
#[derive(Clone, Debug)]
pub struct DiffusionTable {
    albedos: Vec<f32>,
    /// The same, to be found from an effective albedo.
    fine_albedos: Vec<f64>,
    radii: Vec<f32>,
    /// One row of radii for each albedo; finite and ≥ 0.
    profiles: Vec<f32>,
    /// Integral of each row, linear between radii, up to each radius.
    cumulative: Vec<f32>,
    /// Integral over the plane for each albedo, by the spline; ascending.
    effective: Vec<f64>,
}

/// A profile of the table at one albedo, and a density close to it from which radii are drawn.
#[derive(Clone, Copy, Debug)]
pub struct TabulatedProfile<'a> {
    table: &'a DiffusionTable,
    albedo: SplineWeights<f32>,
    /// Part of the second of the two rows that radii are drawn from.
    second: f32,
    /// Their integrals together.
    total: f32,
}

impl DiffusionTable {
    /// Tabulates the profiles. `g` is the mean cosine of scattering, `eta` the relative index inside.
    pub fn new(g: f64, eta: f64) -> Self {
        let mut radii = vec![0.0, FIRST_RADIUS];
        while radii.len() < N_RADII {
            radii.push(radii[radii.len() - 1] * RADIUS_RATIO);
        }
        // Denser toward 1, where the profile changes most.
        let albedos: Vec<f64> = (0..N_ALBEDOS)
            .map(|i| (-8.0 * i as f64 / (N_ALBEDOS - 1) as f64).exp_m1() / (-8f64).exp_m1())
            .collect();
        let beam = Beam::new(g, eta);
        let rows: Vec<Vec<f64>> = albedos
            .clone()
            .into_par_iter()
            .map(|albedo| beam.row(albedo, &radii))
            .collect();
        let effective = rows
            .iter()
            .map(|row| spline::cumulative_integrals(&radii, row)[N_RADII - 1])
            .collect();
        let narrow = |values: &[f64]| values.iter().map(|&v| v as f32).collect::<Vec<_>>();
        let mut cumulative = Vec::with_capacity(N_ALBEDOS * N_RADII);
        for row in &rows {
            let mut sum = 0.0;
            cumulative.push(0.0);
            for j in 1..N_RADII {
                sum += (row[j - 1] + row[j]) * 0.5 * (radii[j] - radii[j - 1]);
                cumulative.push(sum as f32);
            }
        }
        Self {
            albedos: narrow(&albedos),
            fine_albedos: albedos,
            radii: narrow(&radii),
            profiles: narrow(&rows.concat()),
            cumulative,
            effective,
        }
    }

    /// The albedo of single scattering for which the whole plane sends `effective` back.
    pub fn albedo_of(&self, effective: f64) -> f64 {
        spline::invert(&self.fine_albedos, &self.effective, effective)
    }

    /// Largest radius in mean free paths: beyond it profiles are 0.
    pub fn max_radius(&self) -> f32 {
        self.radii[N_RADII - 1]
    }

    /// The profile for an albedo in [0, 1].
    pub fn profile(&self, albedo: f32) -> Option<TabulatedProfile<'_>> {
        let weights = SplineWeights::new(&self.albedos, albedo)?;
        let i = weights.interval;
        let (a0, a1) = (self.albedos[i], self.albedos[i + 1]);
        let t = (albedo - a0) / (a1 - a0);
        let (w0, w1) = ((1.0 - t) * self.integral(i), t * self.integral(i + 1));
        Some(TabulatedProfile {
            table: self,
            albedo: weights,
            second: w1 / (w0 + w1).max(f32::MIN_POSITIVE),
            total: w0 + w1,
        })
    }

    fn integral(&self, row: usize) -> f32 {
        self.cumulative[(row + 1) * N_RADII - 1]
    }

    fn row(values: &[f32], row: usize) -> &[f32] {
        &values[row * N_RADII..(row + 1) * N_RADII]
    }
}

impl TabulatedProfile<'_> {
    /// 2πr S(r) for a radius in mean free paths.
    pub fn radial(&self, r: f32) -> f32 {
        let Some(radius) = SplineWeights::new(&self.table.radii, r) else {
            return 0.0;
        };
        let value = self
            .albedo
            .sum(|i| radius.sum(|j| self.table.profiles[i * N_RADII + j]));
        value.max(0.0)
    }

    /// Integral of the profile: the part of the light that comes back.
    pub fn effective_albedo(&self) -> f32 {
        self.albedo.sum(|i| self.table.effective[i] as f32).max(0.0)
    }

    /// Draws a radius. `None` where nothing comes back.
    pub fn sample(&self, u: f32) -> Option<f32> {
        if self.total <= 0.0 {
            return None;
        }
        let first = 1.0 - self.second;
        let (row, u) = if u < first {
            (self.albedo.interval, u / first)
        } else {
            (self.albedo.interval + 1, (u - first) / self.second)
        };
        let cumulative = DiffusionTable::row(&self.table.cumulative, row);
        let values = DiffusionTable::row(&self.table.profiles, row);
        let target = u * cumulative[N_RADII - 1];
        let j = cumulative
            .partition_point(|c| *c <= target)
            .clamp(1, N_RADII - 1)
            - 1;
        let (f0, f1) = (values[j], values[j + 1]);
        let (r0, r1) = (self.table.radii[j], self.table.radii[j + 1]);
        // The root of f0 t + (f1 − f0) t² / 2 = area, without cancellation.
        let area = (target - cumulative[j]) / (r1 - r0);
        let root = (f0 * f0 + 2.0 * (f1 - f0) * area).max(0.0).sqrt();
        let t = (2.0 * area / (f0 + root).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
        Some(r0 + (r1 - r0) * t)
    }

    /// Density of [`TabulatedProfile::sample`] per mean free path.
    pub fn pdf(&self, r: f32) -> f32 {
        let radii = &self.table.radii;
        if !(r < self.table.max_radius() && self.total > 0.0) {
            return 0.0;
        }
        let j = radii.partition_point(|node| *node <= r).max(1) - 1;
        let t = (r - radii[j]) / (radii[j + 1] - radii[j]);
        let density = |row: usize| {
            let values = DiffusionTable::row(&self.table.profiles, row);
            let value = values[j] + (values[j + 1] - values[j]) * t;
            let integral = self.table.integral(row);
            if integral > 0.0 {
                value / integral
            } else {
                0.0
            }
        };
        let i = self.albedo.interval;
        density(i) * (1.0 - self.second) + density(i + 1) * self.second
    }
}

/// A beam that enters the half space head on.
struct Beam {
    g: f64,
    eta: f64,
    /// First and second moment of Fresnel reflection at the boundary.
    moments: [f64; 2],
    /// Depths at which the beam is sampled, in mean free paths of extinction.
    depths: Vec<f64>,
}

impl Beam {
    fn new(g: f64, eta: f64) -> Self {
        Self {
            g,
            eta,
            moments: [fresnel::first_moment(eta), fresnel::second_moment(eta)],
            depths: (0..N_DEPTHS)
                .map(|i| -(-(i as f64 + 0.5) / N_DEPTHS as f64).ln_1p())
                .collect(),
        }
    }

    /// The profile of an albedo at each radius. Where the model has no value (nothing is scattered back, or never
    /// lost) nothing comes back.
    fn row(&self, albedo: f64, radii: &[f64]) -> Vec<f64> {
        radii
            .iter()
            .map(|&r| {
                let per_area = self.single(albedo, r) + self.multiple(albedo, r);
                let value = 2.0 * PI * r * per_area;
                if value.is_finite() {
                    value.max(0.0)
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// Light scattered once. Along the beam it leaves the medium only from where the critical angle allows.
    fn single(&self, albedo: f64, r: f64) -> f64 {
        let critical = r * (self.eta * self.eta - 1.0).max(0.0).sqrt();
        let term = |depth: &f64| {
            let t = critical + depth;
            let d2 = r * r + t * t;
            let cos = t / d2.sqrt();
            let fresnel = fresnel::dielectric(-cos as f32, 1.0, self.eta as f32);
            albedo * (-(d2.sqrt() + critical)).exp() / d2
                * henyey_greenstein(cos, self.g)
                * (1.0 - f64::from(fresnel))
                * cos
        };
        self.depths.iter().map(term).sum::<f64>() / N_DEPTHS as f64
    }

    /// Light scattered more often: pairs of real and mirrored sources along the beam, in the diffusion approximation
    /// of Grosjean.
    fn multiple(&self, albedo: f64, r: f64) -> f64 {
        let [m1, m2] = self.moments;
        let sigma_a = 1.0 - albedo;
        let reduced_s = albedo * (1.0 - self.g);
        let reduced_t = sigma_a + reduced_s;
        let reduced_albedo = reduced_s / reduced_t;
        let diffusion = (2.0 * sigma_a + reduced_s) / (3.0 * reduced_t * reduced_t);
        let transport = (sigma_a / diffusion).sqrt();
        // Twice the depth of the plane in which the fluence would vanish.
        let mirror = -4.0 * diffusion * (1.0 + 3.0 * m2) / (1.0 - 2.0 * m1);
        let (of_fluence, of_flux) = (0.25 * (1.0 - 2.0 * m1), 0.5 * (1.0 - 3.0 * m2));
        let term = |depth: &f64| {
            let real = depth / reduced_t;
            let virt = mirror - real;
            let (dr, dv) = (r.hypot(real), r.hypot(virt));
            let (er, ev) = ((-transport * dr).exp(), (-transport * dv).exp());
            let fluence = (er / dr - ev / dv) / diffusion;
            let flux = real * (1.0 + transport * dr) * er / dr.powi(3)
                - virt * (1.0 + transport * dv) * ev / dv.powi(3);
            // Empirical correction where the source is near (Habel et al., equation 14).
            let kappa = -(-2.0 * reduced_t * (dr + real)).exp_m1();
            kappa * (fluence * of_fluence + flux * of_flux)
        };
        let sum: f64 = self.depths.iter().map(term).sum();
        sum * reduced_albedo * reduced_albedo / (4.0 * PI * N_DEPTHS as f64)
    }
}

/// In terms of the cosine between the direction of travel and the way back, g > 0 forward.
fn henyey_greenstein(cos: f64, g: f64) -> f64 {
    let denominator = 1.0 + g * g + 2.0 * g * cos;
    (1.0 - g * g) / (4.0 * PI * denominator * denominator.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radii_are_drawn_with_the_density_that_is_claimed() {
        let table = DiffusionTable::new(0.3, 1.33);
        for albedo in [0.05, 0.5, 0.93, 0.9997] {
            let profile = table.profile(albedo).expect("it lies in the table");
            let n = 100_000;
            let mut drawn: Vec<f32> = (0..n)
                .map(|k| {
                    let u = (k as f32 + 0.5) / n as f32;
                    profile.sample(u).expect("something comes back")
                })
                .collect();
            drawn.sort_by(f32::total_cmp);
            let steps = 400_000;
            let h = f64::from(table.max_radius()) / f64::from(steps);
            let (mut integral, mut next) = (0.0, 0);
            for k in 0..steps {
                let r = (f64::from(k) + 0.5) * h;
                integral += f64::from(profile.pdf(r as f32)) * h;
                if k % 1000 == 999 {
                    let end = (r + 0.5 * h) as f32;
                    next += drawn[next..].partition_point(|r| *r < end);
                    let share = next as f64 / f64::from(n);
                    assert!(
                        (share - integral).abs() < 2e-3,
                        "{albedo} {end}: {share} {integral}"
                    );
                }
            }
            assert!((integral - 1.0).abs() < 2e-3, "{albedo}: {integral}");
            // Near the profile itself.
            let near = profile.radial(0.4) / profile.effective_albedo() / profile.pdf(0.4);
            assert!((near - 1.0).abs() < 0.1, "{albedo}: {near}");
        }
    }

    #[test]
    fn more_albedo_sends_more_light_back_and_the_inverse_finds_it() {
        let table = DiffusionTable::new(0.0, 1.33);
        assert!(table.effective.windows(2).all(|w| w[0] < w[1]));
        assert_eq!(table.effective[0], 0.0);
        for effective in [0.01, 0.2, 0.5, 0.7] {
            let albedo = table.albedo_of(effective) as f32;
            let profile = table.profile(albedo).expect("it lies in the table");
            let back = profile.effective_albedo();
            assert!(
                (f64::from(back) - effective).abs() < 1e-4,
                "{effective}: {back}"
            );
        }
    }

    #[test]
    fn m07_extreme_media_have_finite_profiles() {
        for g in [-1.0, 0.0, 1.0] {
            for eta in [0.5, 1.0, 3.0] {
                let table = DiffusionTable::new(g, eta);
                assert!(table.profiles.iter().all(|p| p.is_finite() && *p >= 0.0));
                for albedo in [0.0, 0.5, 1.0] {
                    let profile = table.profile(albedo).expect("it lies in the table");
                    if let Some(r) = profile.sample(0.3) {
                        assert!(r.is_finite() && profile.pdf(r).is_finite());
                    }
                }
            }
        }
    }
}
