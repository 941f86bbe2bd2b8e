//! The graphics state of pbrt-v3: directives in, scene description out. Pure; opens nothing.

pub mod description;
