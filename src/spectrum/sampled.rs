//! Wavelength tables and their projection to linear RGB.

use std::fmt;

use crate::spectrum::{Rgb, cie, xyz};

/// A spectrum known at some wavelengths: linear in between, constant beyond both ends.
#[derive(Clone, PartialEq, Debug)]
pub struct SampledSpectrum {
    /// `(wavelength in nm, value)`, strictly ascending, finite, not empty.
    samples: Vec<(f64, f64)>,
}

/// Why a table is not a spectrum. The maker of the scene or the file must mend it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum SpectrumError {
    /// There are no samples.
    Empty,
    /// Two samples share this wavelength (nm).
    DuplicateWavelength(f64),
    /// The sample with this index, counted from 0 as given, has a wavelength or value that is infinite or NaN.
    NonFinite(usize),
}

impl fmt::Display for SpectrumError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "the spectrum has no samples"),
            Self::DuplicateWavelength(nm) => write!(f, "the spectrum has two samples at {nm} nm"),
            Self::NonFinite(index) => {
                write!(f, "sample {} of the spectrum is not finite", index + 1)
            }
        }
    }
}

impl std::error::Error for SpectrumError {}

impl SampledSpectrum {
    /// Builds from `(wavelength in nm, value)` pairs in any order.
    ///
    /// # Errors
    /// No samples, a sample that is not finite, or two samples at one wavelength.
    pub fn new(mut samples: Vec<(f64, f64)>) -> Result<Self, SpectrumError> {
        if samples.is_empty() {
            return Err(SpectrumError::Empty);
        }
        if let Some(index) = samples
            .iter()
            .position(|(nm, value)| !(nm.is_finite() && value.is_finite()))
        {
            return Err(SpectrumError::NonFinite(index));
        }
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(pair) = samples.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(SpectrumError::DuplicateWavelength(pair[0].0));
        }
        Ok(Self { samples })
    }

    /// The value at a wavelength in nanometres.
    pub fn at(&self, nm: f64) -> f64 {
        let above = self.samples.partition_point(|sample| sample.0 < nm);
        let (Some(&(nm0, v0)), Some(&(nm1, v1))) = (
            above
                .checked_sub(1)
                .and_then(|below| self.samples.get(below)),
            self.samples.get(above),
        ) else {
            return if above == 0 {
                self.samples[0].1
            } else {
                self.samples[above - 1].1
            };
        };
        let t = (nm - nm0) / (nm1 - nm0);
        v0 * (1.0 - t) + v1 * t
    }

    /// Linear RGB, see [`rgb_from_visible`].
    pub fn to_rgb(&self) -> Rgb {
        rgb_from_visible(|nm| self.at(nm))
    }
}

/// Projects a function of wavelength (nm) to linear RGB.
///
/// `X = Σ f(λ)·x̄(λ) · 470 / (106.856895·471)` over the 471 wavelengths 360, 361 … 830 nm, and Y, Z alike, then the
/// matrix of [`xyz`]. The scene format fixes the factor 470/471, which darkens every spectrum by 0.21 %, and leaves the
/// white point alone: a flat spectrum of 1 is (1.202, 0.946, 0.907), not white. Channels may be negative.
pub fn rgb_from_visible(f: impl Fn(f64) -> f64) -> Rgb {
    let mut sum = [0.0; 3];
    for (i, matching) in cie::MATCHING.iter().enumerate() {
        let value = f((cie::FIRST_NM + i) as f64);
        for (channel, weight) in sum.iter_mut().zip(matching) {
            *channel += value * weight;
        }
    }
    let span = (cie::LAST_NM - cie::FIRST_NM) as f64;
    xyz::rgb_from_xyz(sum.map(|channel| channel * span / (cie::Y_INTEGRAL * cie::N_SAMPLES as f64)))
}
