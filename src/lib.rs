//! Tyndall: a renderer for pbrt-v3 scene files.

pub mod accel;
pub mod describe;
pub mod ids;
pub mod image;
pub mod math;
pub mod medium;
pub mod sampler;
pub mod sampling;
pub mod scatter;
pub mod shape;
pub mod spectrum;
