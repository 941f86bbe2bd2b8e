//! Tyndall: a renderer for pbrt-v3 scene files.

pub mod accel;
pub mod app;
pub mod camera;
pub mod compile;
pub mod describe;
pub mod film;
pub mod ids;
pub mod image;
pub mod integrator;
pub mod light;
pub mod material;
pub mod math;
pub mod medium;
pub mod render;
pub mod sampler;
pub mod sampling;
pub mod scatter;
pub mod shape;
pub mod spectrum;
pub mod stop;
pub mod texture;
pub mod world;
