//! Does an image agree with a reference, given the noise in it?
//!
//! Per block, the difference of the means over its standard deviation is a standard normal variable if the two images
//! have one expectation. The worst block is judged with a Šidák correction for their number, and the sum of all, which
//! sees a faint bias everywhere, beside it.

use crate::{Verdict, sidak, z_test::two_sided};

/// How to compare.
#[derive(Clone, Copy, Debug)]
pub struct ImageZTest {
    /// Pixels per row.
    pub width: usize,
    /// Samples per pixel, interleaved.
    pub channels: usize,
    /// Side of the square blocks to average, in pixels. 1 compares pixel by pixel. Larger blocks see fainter
    /// differences and make the noise more nearly normal.
    pub block: usize,
    /// Probability of rejecting a right image.
    pub alpha: f64,
}

impl ImageZTest {
    /// Compares `image` to `reference`; `variance` is that of `image - reference`, per sample. All three have one
    /// length. A block without variance must agree to a part in a million.
    pub fn check(&self, image: &[f32], reference: &[f32], variance: &[f32]) -> Verdict {
        let row = self.width * self.channels;
        let shape_fits = image.len() == reference.len() && image.len() == variance.len();
        assert!(
            shape_fits && !image.is_empty() && image.len().is_multiple_of(row),
            "images of one shape"
        );
        let scores = self.scores(image, reference, variance);

        // In the total order NaN is the worst of all.
        let scores_by_size = scores.iter().map(|z| z.abs()).enumerate();
        let (place, worst) = scores_by_size
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .expect("an image has blocks");
        if !worst.is_finite() {
            return Verdict::impossible(format!(
                "block {place} differs without variance, or is not finite"
            ));
        }
        let global = scores.iter().sum::<f64>() / (scores.len() as f64).sqrt();
        // Two judges, half the error rate each; the less favourable one speaks.
        let local_level = sidak(self.alpha / 2.0, scores.len());
        let (local_p, global_p) = (two_sided(worst), two_sided(global));
        if local_p / local_level < global_p / (self.alpha / 2.0) {
            let explanation = format!("block {place} of {} is {worst:.2} sigma off", scores.len());
            Verdict {
                p_value: local_p,
                threshold: local_level,
                explanation,
            }
        } else {
            let explanation = format!("all blocks together are {global:.2} sigma off");
            Verdict {
                p_value: global_p,
                threshold: self.alpha / 2.0,
                explanation,
            }
        }
    }

    /// One score per block and channel.
    fn scores(&self, image: &[f32], reference: &[f32], variance: &[f32]) -> Vec<f64> {
        let height = image.len() / (self.width * self.channels);
        let mut scores = Vec::new();
        for y0 in (0..height).step_by(self.block) {
            for x0 in (0..self.width).step_by(self.block) {
                for channel in 0..self.channels {
                    let (mut difference, mut level, mut spread) = (0.0, 0.0, 0.0);
                    for y in y0..height.min(y0 + self.block) {
                        for x in x0..self.width.min(x0 + self.block) {
                            let i = (y * self.width + x) * self.channels + channel;
                            difference += f64::from(image[i]) - f64::from(reference[i]);
                            level += f64::from(reference[i]).abs();
                            spread += f64::from(variance[i]);
                        }
                    }
                    scores.push(score(difference, level, spread));
                }
            }
        }
        scores
    }
}

fn score(difference: f64, level: f64, spread: f64) -> f64 {
    const ROUNDING: f64 = 1e-6;
    if !difference.is_finite() {
        return f64::NAN;
    }
    let beyond_rounding = (difference.abs() - ROUNDING * level).max(0.0);
    if beyond_rounding == 0.0 {
        return 0.0;
    }
    beyond_rounding.copysign(difference) / spread.sqrt()
}
