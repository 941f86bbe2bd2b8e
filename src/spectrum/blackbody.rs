//! Planck's law, normalised to its peak.

use std::fmt;

use crate::spectrum::{Rgb, sampled};

/// Speed of light, m/s.
const C: f64 = 299_792_458.0;
/// Planck constant, J·s, as the scene format fixes it.
const H: f64 = 6.626_069_57e-34;
/// Boltzmann constant, J/K, as the scene format fixes it.
const K_B: f64 = 1.380_648_8e-23;
/// Wien's displacement constant, m·K, as the scene format fixes it.
const WIEN: f64 = 2.897_772_1e-3;

/// A temperature (K) at which there is no blackbody: zero, negative, infinite or NaN.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BadTemperature(pub f64);

impl fmt::Display for BadTemperature {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "a blackbody needs a temperature above 0 K, not {}",
            self.0
        )
    }
}

impl std::error::Error for BadTemperature {}

/// Linear RGB of a blackbody at `kelvin` whose spectral peak is 1, also where the peak is not visible.
///
/// # Errors
/// A temperature that is not positive and finite.
pub fn rgb(kelvin: f64) -> Result<Rgb, BadTemperature> {
    if !(kelvin > 0.0 && kelvin.is_finite()) {
        return Err(BadTemperature(kelvin));
    }
    Ok(sampled::rgb_from_visible(|nm| {
        relative_radiance(nm * 1e-9, kelvin)
    }))
}

/// Planck radiance at `metres` over the radiance at Wien's peak, in [0, 1].
///
/// The leading 2hc² cancels, and the two fifth powers are taken of the ratio, so no temperature over- or underflows
/// on the way: B(λ)/B(p) = (p/λ)⁵ · (e^(x_p) − 1)/(e^x − 1) with x = hc/(λkT).
fn relative_radiance(metres: f64, kelvin: f64) -> f64 {
    let peak = WIEN / kelvin;
    let x = H * C / (metres * K_B * kelvin);
    let x_peak = H * C / (WIEN * K_B);
    let ratio = (peak / metres).powi(5) * x_peak.exp_m1() / x.exp_m1();
    // Below about 1 K the ratio of the powers is infinite and the exponential more so: nothing is visible.
    if ratio.is_finite() { ratio } else { 0.0 }
}
