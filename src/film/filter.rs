//! Pixel filters. Widths are radii in pixels; the functions are those of pbrt-v3, tabulated as it does.
//!
//! | name | `xwidth`, `ywidth` | others | function of the offset, per axis |
//! |---|---|---|---|
//! | `box` | 0.5 | | 1 |
//! | `triangle` | 2 | | max(0, r − x) |
//! | `gaussian` | 2 | `alpha` 2 | max(0, exp(−αx²) − exp(−αr²)) |
//! | `mitchell` | 2 | `B`, `C` 1/3 | Mitchell and Netravali 1988 over [−r, r] |
//! | `sinc` | 4 | `tau` 3 | sinc(x) · sinc(x/τ) |

use std::f64::consts::PI;

/// A pixel filter: a separable function of the offset from the pixel's centre.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Filter {
    /// Constant.
    Box,
    /// Tent.
    Triangle,
    /// Gaussian that meets 0 at the radius.
    Gaussian {
        /// Fall-off.
        alpha: f64,
    },
    /// Cubic with negative lobes.
    Mitchell {
        /// Blur.
        b: f64,
        /// Ringing.
        c: f64,
    },
    /// Lanczos-windowed sinc.
    Sinc {
        /// Number of cycles.
        tau: f64,
    },
}

impl Filter {
    /// Value of one axis at offset `x` ≥ 0 for radius `r`.
    fn evaluate(&self, x: f64, r: f64) -> f64 {
        match *self {
            Self::Box => 1.0,
            Self::Triangle => (r - x).max(0.0),
            Self::Gaussian { alpha } => ((-alpha * x * x).exp() - (-alpha * r * r).exp()).max(0.0),
            Self::Mitchell { b, c } => {
                let x = 2.0 * x / r;
                let poly = if x > 1.0 {
                    (-b - 6.0 * c) * x.powi(3)
                        + (6.0 * b + 30.0 * c) * x.powi(2)
                        + (-12.0 * b - 48.0 * c) * x
                        + (8.0 * b + 24.0 * c)
                } else {
                    (12.0 - 9.0 * b - 6.0 * c) * x.powi(3)
                        + (-18.0 + 12.0 * b + 6.0 * c) * x.powi(2)
                        + (6.0 - 2.0 * b)
                };
                poly / 6.0
            }
            Self::Sinc { tau } => {
                if x > r {
                    return 0.0;
                }
                sinc(x) * sinc(x / tau)
            }
        }
    }
}

fn sinc(x: f64) -> f64 {
    if x == 0.0 {
        1.0
    } else {
        (PI * x).sin() / (PI * x)
    }
}

/// Steps of the table per radius, as in pbrt-v3: published pictures are made with the filters it rounds to.
const STEPS: usize = 16;

/// A filter tabulated over the positive quadrant.
#[derive(Clone, Debug)]
pub struct FilterTable {
    radius: [f64; 2],
    /// From offsets to steps, along each axis.
    steps_per_pixel: [f64; 2],
    weights: Box<[[f64; STEPS]; STEPS]>,
}

/// The weights of a row of pixels.
pub(super) struct FilterRow<'a> {
    steps_per_pixel: f64,
    weights: &'a [f64; STEPS],
}

impl FilterRow<'_> {
    /// The weight at an offset along x, in pixels.
    #[inline]
    pub(super) fn at(&self, dx: f64) -> f64 {
        self.weights[step(dx, self.steps_per_pixel)]
    }
}

#[inline]
fn step(offset: f64, steps_per_pixel: f64) -> usize {
    ((offset.abs() * steps_per_pixel) as u32).min(STEPS as u32 - 1) as usize
}

impl FilterTable {
    /// Radii are positive and finite.
    pub fn new(filter: Filter, radius: [f64; 2]) -> Self {
        let [along_x, along_y] = radius.map(|r| -> [f64; STEPS] {
            std::array::from_fn(|i| filter.evaluate((i as f64 + 0.5) * r / STEPS as f64, r))
        });
        Self {
            radius,
            steps_per_pixel: radius.map(|r| STEPS as f64 / r),
            weights: Box::new(along_y.map(|wy| along_x.map(|wx| wx * wy))),
        }
    }

    /// Radii in pixels.
    #[inline]
    pub fn radius(&self) -> [f64; 2] {
        self.radius
    }

    /// Whether every sample counts alike, and in one pixel alone.
    pub fn is_even_within_a_pixel(&self) -> bool {
        let weights = self.weights.as_flattened();
        let is_even = weights.iter().all(|w| *w == weights[0]);
        is_even && self.radius.iter().all(|&r| r <= 0.5)
    }

    /// The weights of the pixels at an offset along y, in pixels.
    #[inline]
    pub(super) fn row(&self, dy: f64) -> FilterRow<'_> {
        FilterRow {
            steps_per_pixel: self.steps_per_pixel[0],
            weights: &self.weights[step(dy, self.steps_per_pixel[1])],
        }
    }
}
