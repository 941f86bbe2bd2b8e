//! Spectrum values to linear RGB.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::{Span, Spanned};

use crate::compile::assets::{Assets, read_numbers};
use crate::compile::reader::SpectrumValue;
use crate::spectrum::sampled::SampledSpectrum;
use crate::spectrum::{Rgb, blackbody, float_file, xyz};

/// Linear RGB of a value. What cannot be read is black, with a located error.
pub(super) fn to_rgb(
    value: &Spanned<SpectrumValue>,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Rgb {
    let mut fail = |code: &'static str, message: String| {
        diagnostics.push(Diagnostic::error(code, value.span, message).with_label("black is used"));
        Rgb::BLACK
    };
    match &value.value {
        SpectrumValue::Rgb(rgb) => Rgb::from_array(*rgb),
        SpectrumValue::Xyz(v) => xyz::rgb_from_xyz(v.map(f64::from)),
        SpectrumValue::Blackbody { kelvin, scale } => match blackbody::rgb(*kelvin as f64) {
            Ok(rgb) => rgb * *scale,
            Err(error) => fail("bad-spectrum", error.to_string()),
        },
        SpectrumValue::Samples(samples) => {
            let samples: Vec<_> = samples
                .iter()
                .map(|&[nm, v]| (nm as f64, v as f64))
                .collect();
            let unseen = invisible(&samples);
            match SampledSpectrum::new(samples) {
                Ok(spectrum) => {
                    diagnostics.extend(unseen.map(|unseen| unseen.warning(None, value.span)));
                    spectrum.to_rgb()
                }
                Err(error) => fail("bad-spectrum", error.to_string()),
            }
        }
        SpectrumValue::File(path) => {
            let path = Spanned::new(path.clone(), value.span);
            let file = match read_numbers(&path, assets) {
                Ok(file) => file,
                Err(finding) => {
                    diagnostics.push(finding.with_label("black is used"));
                    return Rgb::BLACK;
                }
            };
            let (samples, dangling) = float_file::pairs(&file.values);
            let unseen = invisible(&samples);
            let rgb = match SampledSpectrum::new(samples) {
                Ok(spectrum) => spectrum.to_rgb(),
                Err(error) => return fail("bad-spectrum", format!("{}: {error}", path.value)),
            };
            let warnings = file.warnings.iter().map(ToString::to_string);
            let dangling = dangling.map(|nm| format!("the wavelength {nm} nm has no value"));
            diagnostics.extend(unseen.map(|unseen| unseen.warning(Some(&path.value), value.span)));
            for warning in warnings.chain(dangling) {
                let message = format!("{}: {warning}", path.value);
                diagnostics.push(Diagnostic::warning("spectrum-file", value.span, message));
            }
            rgb
        }
    }
}

/// Wavelengths in nanometres of which colours are made (pbrt-v3 cuts there).
const VISIBLE: [f64; 2] = [400.0, 700.0];

/// A spectrum none of whose light is seen.
struct Invisible {
    /// The shortest and the longest wavelength.
    ends: [f64; 2],
}

/// Whether a spectrum lies beside what is visible; one that reaches across it does not.
fn invisible(samples: &[(f64, f64)]) -> Option<Invisible> {
    let lengths = samples.iter().map(|(length, _)| *length);
    let shortest = lengths.clone().fold(f64::INFINITY, f64::min);
    let longest = lengths.fold(f64::NEG_INFINITY, f64::max);
    let is_beside = longest < VISIBLE[0] || shortest > VISIBLE[1];
    (is_beside && shortest.is_finite() && longest.is_finite()).then_some(Invisible {
        ends: [shortest, longest],
    })
}

impl Invisible {
    fn warning(&self, file: Option<&str>, span: Span) -> Diagnostic {
        /// Units that tables of spectra are written in, by their length in nanometres.
        const UNITS: [(&str, f64); 3] = [("micrometres", 1e3), ("Ångström", 0.1), ("metres", 1e9)];
        let [shortest, longest] = self.ends;
        let name = file.map_or(String::new(), |file| format!("{file}: "));
        let message = format!(
            "{name}no wavelength is visible: they are {shortest} to {longest}, and nanometres are meant"
        );
        let found = Diagnostic::warning("invisible-spectrum", span, message)
            .with_label("its first or last value counts for all colours");
        let is_visible = |unit: &f64| shortest * unit <= VISIBLE[1] && longest * unit >= VISIBLE[0];
        match UNITS.iter().find(|(_, unit)| is_visible(unit)) {
            Some((unit, _)) => found.with_help(format!("they look like {unit}")),
            None => found,
        }
    }
}
