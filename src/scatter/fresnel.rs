//! Fresnel equations for unpolarised light.

use crate::math::Vec3;
use crate::spectrum::Rgb;

/// Reflectance of a surface as a function of the angle.
#[derive(Clone, Copy, Debug)]
pub enum Fresnel {
    /// Boundary between two dielectrics, see [`dielectric`].
    Dielectric {
        /// Index of refraction on the side of the normal.
        eta_outside: f32,
        /// Index of refraction on the other side.
        eta_inside: f32,
    },
    /// Metal in vacuum, the same seen from both sides, see [`conductor`].
    Conductor {
        /// Real part of the index of refraction.
        eta: Rgb,
        /// Imaginary part: absorption.
        k: Rgb,
    },
    /// Between a dielectric in vacuum and Schlick's approximation of a metal (Burley 2015).
    Disney {
        /// Reflectance head on, for the approximation.
        r0: Rgb,
        /// Part of the approximation, in [0, 1].
        metallic: f32,
        /// Index of refraction of the dielectric.
        eta: f32,
    },
}

impl Fresnel {
    /// Reflectance; `cos_i` is positive on the side of the normal.
    #[inline]
    pub fn evaluate(&self, cos_i: f32) -> Rgb {
        match *self {
            Self::Dielectric {
                eta_outside,
                eta_inside,
            } => Rgb::splat(dielectric(cos_i, eta_outside, eta_inside)),
            Self::Conductor { eta, k } => {
                let channel = |c: usize| conductor(cos_i.abs(), eta[c], k[c]);
                Rgb::new(channel(0), channel(1), channel(2))
            }
            Self::Disney { r0, metallic, eta } => {
                let schlick = r0.lerp(Rgb::ONE, schlick_weight(cos_i));
                Rgb::splat(dielectric(cos_i, 1.0, eta)).lerp(schlick, metallic)
            }
        }
    }
}

/// (1 − cos)⁵ of Schlick 1994: how far a reflectance has gone from its value head on to 1; all the way below the
/// horizon.
#[inline]
pub fn schlick_weight(cos: f32) -> f32 {
    (1.0 - cos).clamp(0.0, 1.0).powi(5)
}

/// Reflectance of a smooth dielectric. `cos_i` is signed: positive on the side of index `eta_outside`, negative on
/// the side of `eta_inside`. 1 beyond the critical angle.
pub fn dielectric(cos_i: f32, eta_outside: f32, eta_inside: f32) -> f32 {
    let cos_i = cos_i.clamp(-1.0, 1.0);
    let (eta_i, eta_t) = if cos_i > 0.0 {
        (eta_outside, eta_inside)
    } else {
        (eta_inside, eta_outside)
    };
    let cos_i = cos_i.abs();
    let sin2_t = (eta_i / eta_t).powi(2) * (1.0 - cos_i) * (1.0 + cos_i);
    if sin2_t >= 1.0 {
        return 1.0;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    let parallel = (eta_t * cos_i - eta_i * cos_t) / (eta_t * cos_i + eta_i * cos_t);
    let perpendicular = (eta_i * cos_i - eta_t * cos_t) / (eta_i * cos_i + eta_t * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// Greatest index of a conductor; beyond it, the reflectance is 1 to four digits.
const MAX_CONDUCTOR_INDEX: f32 = 1e5;

/// Reflectance of a smooth conductor in vacuum, of index `eta` + i `k` (of any sign), at `cos_i` ≥ 0.
///
/// The exact equations (Born and Wolf; in the form of Lagarde 2013, "Memo on Fresnel equations").
pub fn conductor(cos_i: f32, eta: f32, k: f32) -> f32 {
    let cos_i = cos_i.clamp(0.0, 1.0);
    let (eta, k) = (
        eta.abs().min(MAX_CONDUCTOR_INDEX),
        k.abs().min(MAX_CONDUCTOR_INDEX),
    );
    let (cos2, sin2) = (cos_i * cos_i, (1.0 - cos_i) * (1.0 + cos_i));
    let (eta2, k2) = (eta * eta, k * k);
    // a² − b² and a² + b² of the complex cosine inside, times the index.
    let difference = eta2 - k2 - sin2;
    let sum = (difference * difference + 4.0 * eta2 * k2).sqrt();
    let a = (0.5 * (sum + difference)).max(0.0).sqrt();
    let ratio = |less: f32, more: f32| if more > 0.0 { less / more } else { 1.0 };
    let t = 2.0 * a * cos_i;
    let perpendicular = ratio(sum + cos2 - t, sum + cos2 + t);
    let (p, q) = (cos2 * sum + sin2 * sin2, t * sin2);
    let parallel = perpendicular * ratio(p - q, p + q);
    0.5 * (perpendicular + parallel)
}

/// The direction behind the interface of normal `n` (unit, on the side of `wi`) for light from `wi`;
/// `eta` = index on the side of `wi` / index on the other. `None` under total internal reflection.
pub fn refract(wi: Vec3, n: Vec3, eta: f32) -> Option<Vec3> {
    let cos_i = n.dot(wi);
    let sin2_i = ((1.0 - cos_i) * (1.0 + cos_i)).max(0.0);
    let sin2_t = eta * eta * sin2_i;
    if sin2_t >= 1.0 {
        return None;
    }
    let cos_t = (1.0 - sin2_t).sqrt();
    Some((-wi * eta + n * (eta * cos_i - cos_t)).normalize())
}

/// ∫₀¹ F(μ) μ dμ for light that leaves a dielectric of index `eta` for vacuum: polynomial fits of d'Eon and Irving
/// 2011.
pub fn first_moment(eta: f64) -> f64 {
    if eta < 1.0 {
        polynomial(
            eta,
            &[0.45966, -1.73965, 3.37668, -3.904945, 2.49277, -0.68441],
        )
    } else {
        polynomial(
            eta,
            &[-4.61686, 11.1136, -10.4646, 5.11455, -1.27198, 0.12746],
        )
    }
}

/// ∫₀¹ F(μ) μ² dμ, as [`first_moment`].
pub fn second_moment(eta: f64) -> f64 {
    if eta < 1.0 {
        polynomial(
            eta,
            &[0.27614, -0.87350, 1.12077, -0.65095, 0.07883, 0.04860],
        )
    } else {
        let inverse = polynomial(1.0 / eta, &[0.0, 458.843, -218.725, 45.3087]);
        inverse
            + polynomial(
                eta,
                &[-547.033, 404.557, -189.519, 54.9327, -9.00603, 0.63942],
            )
    }
}

/// A polynomial; coefficients start with that of x⁰.
fn polynomial(x: f64, coefficients: &[f64]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_reflects_four_percent_head_on_and_everything_beyond_the_critical_angle() {
        assert!((dielectric(1.0, 1.0, 1.5) - 0.04).abs() < 1e-6);
        assert!((dielectric(-1.0, 1.0, 1.5) - 0.04).abs() < 1e-6);
        let beyond = (1.0f32 / 1.5).asin() + 0.01;
        assert_eq!(dielectric(-beyond.cos(), 1.0, 1.5), 1.0);
        assert!(dielectric(0.5, 1.3, 1.3).abs() < 1e-12);
    }

    #[test]
    fn refraction_obeys_snell_and_reverses() {
        let n = Vec3::new(0.0, 0.0, 1.0);
        for k in 1..90 {
            let angle = (k as f32).to_radians();
            let wi = Vec3::new(angle.sin(), 0.0, angle.cos());
            let wt = refract(wi, n, 1.0 / 1.5).expect("no total reflection from outside");
            assert!((wt.x().abs() * 1.5 - angle.sin()).abs() < 1e-6 && wt.z() < 0.0);
            let back = refract(wt, -n, 1.5).expect("the way back exists");
            assert!((back - wi).length() < 1e-3, "{k}: {back:?} {wi:?}");
        }
    }

    #[test]
    fn moments_match_quadrature_of_the_reflectance() {
        for eta in [0.67, 0.75, 1.1, 1.33, 1.5] {
            let (mut m1, mut m2) = (0.0, 0.0);
            let n = 20_000;
            for k in 0..n {
                let mu = (k as f64 + 0.5) / n as f64;
                let f = f64::from(dielectric(-mu as f32, 1.0, eta as f32));
                m1 += f * mu / n as f64;
                m2 += f * mu * mu / n as f64;
            }
            // The fits themselves are that good.
            assert!((first_moment(eta) - m1).abs() < 5e-3, "{eta}: {m1}");
            assert!((second_moment(eta) - m2).abs() < 5e-3, "{eta}: {m2}");
        }
    }
}
