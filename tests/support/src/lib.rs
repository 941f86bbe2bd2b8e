//! Judges for tests: each returns a [`Verdict`], and each must reject a planted bug before it may judge the renderer
//! (`tests/it/harness.rs`).
//!
//! A crate of its own, so that every test uses what it needs and no more, and so that it knows nothing of the renderer.

pub mod chi2;
mod gamma;
pub mod image_z;
pub mod ptex;
mod uniform;
mod verdict;
pub mod z_test;

pub use uniform::Uniform;
pub use verdict::{Verdict, sidak};

/// Panics unless `actual` is within `relative · |expected|` of `expected`.
#[track_caller]
pub fn assert_close(actual: f64, expected: f64, relative: f64) {
    let error = (actual - expected).abs();
    let allowed = relative * expected.abs();
    assert!(
        error <= allowed,
        "{actual} is not {expected}: off by {:.3e}, allowed {relative:.1e} (relative)",
        error / expected.abs()
    );
}
