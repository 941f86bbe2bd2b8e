//! Spectrum values to linear RGB.

use tyndall_parser::diagnostic::{Diagnostic, Diagnostics};
use tyndall_parser::source::Spanned;

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
            let samples = samples
                .iter()
                .map(|&[nm, v]| (nm as f64, v as f64))
                .collect();
            match SampledSpectrum::new(samples) {
                Ok(spectrum) => spectrum.to_rgb(),
                Err(error) => fail("bad-spectrum", error.to_string()),
            }
        }
        SpectrumValue::File(path) => {
            let path = Spanned::new(path.clone(), value.span);
            let file = match read_numbers(&path, assets) {
                Ok(file) => file,
                Err((code, message)) => return fail(code, message),
            };
            let (samples, dangling) = float_file::pairs(&file.values);
            let rgb = match SampledSpectrum::new(samples) {
                Ok(spectrum) => spectrum.to_rgb(),
                Err(error) => return fail("bad-spectrum", format!("{}: {error}", path.value)),
            };
            let warnings = file.warnings.iter().map(ToString::to_string);
            let dangling = dangling.map(|nm| format!("the wavelength {nm} nm has no value"));
            for warning in warnings.chain(dangling) {
                let message = format!("{}: {warning}", path.value);
                diagnostics.push(Diagnostic::warning("spectrum-file", value.span, message));
            }
            rgb
        }
    }
}
