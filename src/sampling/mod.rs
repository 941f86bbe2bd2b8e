//!
//! Every density has its sampler beside it. Knows no scene and keeps no state of its own.

pub mod mis;
pub mod rng;
pub mod warp;
