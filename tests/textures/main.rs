//! Textures against closed forms, against independent evaluations and under absurd input.

#[path = "../common/scene.rs"]
mod scene;

mod at;
mod bump;
mod checkerboard;
mod classes;
mod hazards;
mod mapping;
mod noise;
mod ptex;
