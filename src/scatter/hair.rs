//! Scattering by a hair fibre: a rough dielectric cylinder with tilted scales, seen from far away.
//!
//! The model is that of Marschner et al. 2003 in the energy-conserving form of d'Eon et al. 2011, with the near-field
//! azimuth and the roughness parameters of Chiang et al. 2016: light is reflected (R), or passes the fibre once (TT),
//! twice (TRT) or more often; each of these lobes is an attenuation A, a longitudinal spread M and an azimuthal spread
//! N. Frame: +x runs along the fibre, θ is measured from the plane across it, φ around it from +y.

use std::f32::consts::{FRAC_1_PI, PI};

use crate::math::Vec3;
use crate::sampling::rng::ONE_MINUS_EPSILON;
use crate::scatter::fresnel;
use crate::spectrum::Rgb;

/// R, TT, TRT, and all that comes later.
const N_LOBES: usize = 4;

/// Smallest roughness. Below it a lobe is narrower than directions in single precision can tell.
const MIN_BETA: f32 = 1e-3;

/// Absorption by a unit concentration of eumelanin and of pheomelanin per fibre diameter (d'Eon et al. 2011).
const EUMELANIN: Rgb = Rgb::new(0.419, 0.697, 1.37);
const PHEOMELANIN: Rgb = Rgb::new(0.187, 0.4, 1.05);

/// Absorption per fibre diameter of pigments of these concentrations; negative ones count as 0.
pub fn sigma_a_from_melanin(eumelanin: f32, pheomelanin: f32) -> Rgb {
    EUMELANIN * eumelanin.max(0.0) + PHEOMELANIN * pheomelanin.max(0.0)
}

/// Absorption per fibre diameter that gives dense hair of azimuthal roughness `beta_n` about the colour `color`
/// (Chiang et al. 2016, eq. 9). Finite for every finite colour: black absorbs as much as can be said.
pub fn sigma_a_from_color(color: Rgb, beta_n: f32) -> Rgb {
    let n = beta_n;
    let scale = 5.969 + n * (-0.215 + n * (2.532 + n * (-10.73 + n * (5.574 + n * 0.245))));
    color.map(|c| (c.max(0.0).ln() / scale).powi(2).min(f32::MAX))
}

/// The scattering function of one point across a fibre.
#[derive(Clone, Copy, Debug)]
pub struct Hair {
    sigma_a: Rgb,
    /// Offset across the fibre, −1 to 1: the sine of `gamma_o`.
    h: f32,
    /// Angle between the normal of the cylinder and the viewer's direction, both across the fibre.
    gamma_o: f32,
    eta: f32,
    /// Longitudinal variance of R.
    v: f32,
    /// Scale of the azimuthal logistic.
    s: f32,
    /// Sine and cosine of what the scales turn θ by for R, TT, TRT.
    tilt: [[f32; 2]; 3],
}

/// Everything that depends on the viewer's direction.
struct Outgoing {
    sin: f32,
    cos: f32,
    phi: f32,
    gamma_t: f32,
    attenuation: [Rgb; N_LOBES],
}

impl Hair {
    /// `h` is the offset across the fibre, −1 to 1; `eta` the index of refraction, positive; `sigma_a` the absorption
    /// per fibre diameter, finite and not negative; `beta_m` and `beta_n` the roughness along and around, clamped to
    /// [0.001, 1]; `alpha` the tilt of the scales in degrees.
    pub fn new(h: f32, eta: f32, sigma_a: Rgb, beta_m: f32, beta_n: f32, alpha: f32) -> Self {
        let h = h.clamp(-1.0, 1.0);
        let (m, n) = (beta_m.clamp(MIN_BETA, 1.0), beta_n.clamp(MIN_BETA, 1.0));
        let root_pi_over_8 = (PI / 8.0).sqrt();
        let alpha = alpha.to_radians();
        Self {
            sigma_a,
            h,
            gamma_o: h.asin(),
            eta,
            v: (0.726 * m + 0.812 * m * m + 3.7 * m.powi(20)).powi(2),
            s: root_pi_over_8 * (0.265 * n + 1.194 * n * n + 5.372 * n.powi(22)),
            tilt: [-2.0 * alpha, alpha, 4.0 * alpha].map(|turn| turn.sin_cos().into()),
        }
    }

    /// Value in sr⁻¹, cosine to the shading normal excluded, which the model does not know: it is divided out.
    pub fn f(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let outgoing = self.outgoing(wo);
        let spread = self.spread(&outgoing, wi);
        let sum: Rgb = (0..N_LOBES)
            .map(|p| outgoing.attenuation[p] * spread[p])
            .sum();
        let f = sum * (1.0 / wi.z().abs());
        // In the plane of the surface there is no value; the cosine is 0.
        if f.is_finite() { f } else { Rgb::BLACK }
    }

    /// Density of [`Hair::sample`] in sr⁻¹.
    pub fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        let outgoing = self.outgoing(wo);
        let Some(shares) = outgoing.shares() else {
            return 0.0;
        };
        let spread = self.spread(&outgoing, wi);
        (0..N_LOBES).map(|p| shares[p] * spread[p]).sum()
    }

    /// Draws `wi`: a lobe by its luminance and the azimuth by `u_part`, the angle along the fibre by `u`. `None` where
    /// everything is absorbed.
    pub fn sample(&self, wo: Vec3, u_part: f32, u: [f32; 2]) -> Option<Vec3> {
        let outgoing = self.outgoing(wo);
        let shares = outgoing.shares()?;
        let mut rest = u_part;
        let mut p = 0;
        while p < N_LOBES - 1 && rest >= shares[p] {
            rest -= shares[p];
            p += 1;
        }
        let u_phi = if shares[p] > 0.0 {
            (rest / shares[p]).min(ONE_MINUS_EPSILON)
        } else {
            rest
        };

        let [sin_o, cos_o] = self.tilted(&outgoing, p);
        let (sin_i, cos_i) = sample_longitudinal(sin_o, cos_o, self.variance(p), u);
        let phi = outgoing.phi
            + if p < N_LOBES - 1 {
                self.center(&outgoing, p) + sample_logistic(u_phi, self.s)
            } else {
                2.0 * PI * u_phi
            };
        let (sin_phi, cos_phi) = phi.sin_cos();
        Some(Vec3::new(sin_i, cos_i * cos_phi, cos_i * sin_phi))
    }

    fn outgoing(&self, wo: Vec3) -> Outgoing {
        let (sin, cos) = (wo.x(), across(wo));
        // Index of refraction in the plane across the fibre (Marschner et al. 2003, appendix B), times cos θ. Beyond
        // the critical angle, which an index below 1 has, nothing enters and the refracted angles have no effect.
        let bent = (self.eta * self.eta - sin * sin).max(0.0).sqrt();
        let sin_gamma_t = (self.h * cos / bent.max(f32::MIN_POSITIVE)).clamp(-1.0, 1.0);
        let cos_gamma_t = unit_complement(sin_gamma_t);
        let cos_theta_t = unit_complement((sin / self.eta).clamp(-1.0, 1.0));
        let path = 2.0 * cos_gamma_t / cos_theta_t.max(f32::MIN_POSITIVE);
        let transmittance = (self.sigma_a * path).exp_neg();
        let cos_incident = cos * unit_complement(self.h);
        let reflectance = fresnel::dielectric(cos_incident, 1.0, self.eta);
        Outgoing {
            sin,
            cos,
            phi: wo.z().atan2(wo.y()),
            gamma_t: sin_gamma_t.asin(),
            attenuation: attenuation(reflectance, transmittance),
        }
    }

    fn variance(&self, p: usize) -> f32 {
        [self.v, 0.25 * self.v, 4.0 * self.v, 4.0 * self.v][p]
    }

    /// Sine and cosine of θ of the viewer, turned by the scales.
    fn tilted(&self, outgoing: &Outgoing, p: usize) -> [f32; 2] {
        let Some([sin, cos]) = self.tilt.get(p) else {
            return [outgoing.sin, outgoing.cos];
        };
        [
            outgoing.sin * cos + outgoing.cos * sin,
            (outgoing.cos * cos - outgoing.sin * sin).abs(),
        ]
    }

    /// Azimuth around which lobe `p` lies, from the viewer's.
    fn center(&self, outgoing: &Outgoing, p: usize) -> f32 {
        let p = p as f32;
        2.0 * p * outgoing.gamma_t - 2.0 * self.gamma_o + p * PI
    }

    /// M N of every lobe, in sr⁻¹; each integrates to 1 over directions.
    fn spread(&self, outgoing: &Outgoing, wi: Vec3) -> [f32; N_LOBES] {
        let (sin_i, cos_i) = (wi.x(), across(wi));
        let phi = wi.z().atan2(wi.y()) - outgoing.phi;
        std::array::from_fn(|p| {
            let [sin_o, cos_o] = self.tilted(outgoing, p);
            let m = longitudinal(sin_i, cos_i, sin_o, cos_o, self.variance(p));
            let n = if p < N_LOBES - 1 {
                logistic(phi - self.center(outgoing, p), self.s)
            } else {
                0.5 * FRAC_1_PI
            };
            m * n
        })
    }
}

impl Outgoing {
    /// Probability of each lobe; `None` where everything is absorbed.
    fn shares(&self) -> Option<[f32; N_LOBES]> {
        let luminances = self.attenuation.map(Rgb::luminance);
        let sum: f32 = luminances.iter().sum();
        (sum > 0.0).then(|| luminances.map(|luminance| luminance / sum))
    }
}

/// Length of the part across the fibre, cos θ, without cancellation near the ends.
#[inline]
fn across(w: Vec3) -> f32 {
    (w.y() * w.y() + w.z() * w.z()).sqrt()
}

/// √(1 − x²).
#[inline]
fn unit_complement(x: f32) -> f32 {
    ((1.0 - x) * (1.0 + x)).max(0.0).sqrt()
}

/// Shares of the light that leaves after 0, 1, 2 and more passes (Chiang et al. 2016, section 2.5). Without absorption
/// they add up to 1.
fn attenuation(reflectance: f32, transmittance: Rgb) -> [Rgb; N_LOBES] {
    let once = transmittance * ((1.0 - reflectance) * (1.0 - reflectance));
    let twice = once * transmittance * reflectance;
    let kept = transmittance * reflectance;
    let later = (twice * kept).to_array();
    let kept = kept.to_array();
    // Where nothing enters, the series is 0/0 and there is nothing to add up.
    let later = [0, 1, 2].map(|k| {
        if later[k] > 0.0 {
            later[k] / (1.0 - kept[k])
        } else {
            0.0
        }
    });
    [Rgb::splat(reflectance), once, twice, Rgb::from_array(later)]
}

/// Longitudinal spread: the density over θ of a von Mises–Fisher lobe of variance `v` around the mirrored cone
/// (d'Eon et al. 2011, eq. 7), per cos θ of the light.
///
/// Written as exp(−|Δ|²/2v) · e⁻ᵃI₀(a) / (v (1 − e^(−2/v))), a = cos θi cos θo / v, so that nothing overflows or
/// cancels for any `v`.
fn longitudinal(sin_i: f32, cos_i: f32, sin_o: f32, cos_o: f32, v: f32) -> f32 {
    let (along, across) = (sin_i + sin_o, cos_i - cos_o);
    let exponent = -0.5 * (along * along + across * across) / v;
    exponent.exp() * scaled_bessel_i0(cos_i * cos_o / v) / (-v * (-2.0 / v).exp_m1())
}

/// Sine and cosine of an angle along the fibre with the density of [`longitudinal`]: a direction of the lobe around
/// the mirrored cone (d'Eon et al. 2013), of which only θ is kept.
fn sample_longitudinal(sin_o: f32, cos_o: f32, v: f32, u: [f32; 2]) -> (f32, f32) {
    // 1 − cos of the angle to the lobe's axis.
    let one_minus_cos = (-v * (u[0] * (-2.0 / v).exp_m1()).ln_1p()).clamp(0.0, 2.0);
    let (cos, sin) = (
        1.0 - one_minus_cos,
        (one_minus_cos * (2.0 - one_minus_cos)).sqrt(),
    );
    let (sin_turn, cos_turn) = (2.0 * PI * u[1]).sin_cos();
    // The axis is (−sin θo, cos θo, 0).
    let x = sin * cos_turn * cos_o - cos * sin_o;
    let y = sin * cos_turn * sin_o + cos * cos_o;
    let z = sin * sin_turn;
    let w = Vec3::new(x, y, z).normalize();
    (w.x(), across(w))
}

/// Logistic density of scale `s`, cut to [−π, π] and wrapped there (Chiang et al. 2016, section 2.4).
fn logistic(x: f32, s: f32) -> f32 {
    let x = (x - 2.0 * PI * (x / (2.0 * PI)).round()).abs();
    let e = (-x / s).exp();
    e / (s * (1.0 + e) * (1.0 + e) * (0.5 * PI / s).tanh())
}

/// Draws from [`logistic`], in [−π, π].
fn sample_logistic(u: f32, s: f32) -> f32 {
    let x = 2.0 * s * ((2.0 * u - 1.0) * (0.5 * PI / s).tanh()).atanh();
    x.clamp(-PI, PI)
}

/// e⁻ˣ I₀(x) for x ≥ 0, the modified Bessel function of the first kind (Abramowitz and Stegun, 9.8.1 and 9.8.2), to
/// 3e-7.
fn scaled_bessel_i0(x: f32) -> f32 {
    let polynomial =
        |coefficients: &[f32], t: f32| coefficients.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if x <= 3.75 {
        let t = (x / 3.75).powi(2);
        let series = [
            1.0,
            3.515_622_9,
            3.089_942_4,
            1.206_749_2,
            0.265_973_2,
            0.036_076_8,
            0.004_581_3,
        ];
        polynomial(&series, t) * (-x).exp()
    } else {
        let series = [
            0.398_942_3,
            0.013_285_92,
            0.002_253_19,
            -0.001_575_65,
            0.009_162_81,
            -0.020_577_06,
            0.026_355_37,
            -0.016_476_33,
            0.003_923_77,
        ];
        polynomial(&series, 3.75 / x) / x.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scaled_bessel_function_is_its_series() {
        for k in 0..600 {
            let x = 0.05 * k as f64;
            // Σ (x²/4)ᵏ / k!²
            let (mut term, mut sum) = (1f64, 1f64);
            for k in 1..200 {
                term *= x * x / 4.0 / f64::from(k).powi(2);
                sum += term;
            }
            let exact = sum * (-x).exp();
            let error = f64::from(scaled_bessel_i0(x as f32)) / exact - 1.0;
            assert!(error.abs() < 2e-6, "{x}: {error}");
        }
        // Beyond the reach of the series: the asymptote.
        let x = 1e7f32;
        let asymptote = 1.0 / (2.0 * PI * x).sqrt();
        assert!((scaled_bessel_i0(x) / asymptote - 1.0).abs() < 1e-5);
    }

    #[test]
    fn m06_every_spread_along_the_fibre_is_a_density() {
        for v in [1e-7f32, 1e-5, 1e-3, 0.0846, 0.1001, 1.0, 27.0, 110.0] {
            for theta_o in [-90.0f64, -89.9, -45.0, 0.0, 17.0, 88.0] {
                let (sin_o, cos_o) = theta_o.to_radians().sin_cos();
                // Steps that follow the peak.
                let n = 100_000;
                let width = f64::from((40.0 * v.sqrt()).min(2.0 * PI));
                let mut sum = 0f64;
                for k in 0..n {
                    let turn = width * ((k as f64 + 0.5) / n as f64 - 0.5);
                    let (sin_i, cos_i) = (turn - theta_o.to_radians()).sin_cos();
                    if cos_i > 0.0 {
                        let [s_i, c_i, s_o, c_o] = [sin_i, cos_i, sin_o, cos_o].map(|x| x as f32);
                        sum += cos_i * f64::from(longitudinal(s_i, c_i, s_o, c_o, v));
                    }
                }
                let mass = sum * width / n as f64;
                assert!((mass - 1.0).abs() < 1e-3, "v {v}, {theta_o}°: {mass}");
            }
        }
    }

    #[test]
    fn m06_the_spread_around_the_fibre_is_a_density() {
        for beta in [0.0f32, 1e-4, 1e-3, 0.01, 0.3, 1.0] {
            let s = Hair::new(0.0, 1.55, Rgb::BLACK, 0.3, beta, 0.0).s;
            let n = 200_000;
            let width = (80.0 * s).min(2.0 * PI);
            let mass = (0..n)
                .map(|k| width * ((k as f32 + 0.5) / n as f32 - 0.5))
                .map(|x| f64::from(logistic(x, s)))
                .sum::<f64>()
                * f64::from(width)
                / f64::from(n);
            assert!((mass - 1.0).abs() < 1e-4, "beta {beta}: {mass}");
        }
    }
}
