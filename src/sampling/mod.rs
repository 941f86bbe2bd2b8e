//! Random choices and their densities, one routine for both.

pub mod distribution;
