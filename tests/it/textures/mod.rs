//! Textures against closed forms, against independent evaluations and under absurd input.

mod at;
mod bump;
mod checkerboard;
mod classes;
mod hazards;
mod mapping;
mod noise;
mod ptex;
