//! Tyndall: a renderer for pbrt-v3 scene files.

pub mod describe;
pub mod image;
pub mod sampling;
pub mod spectrum;
