//! Tyndall: a renderer for pbrt-v3 scene files.

pub mod compile;
pub mod describe;
