//! Random numbers, warps between domains, tabulated distributions and the arithmetic of multiple importance sampling.
//!
//! Every density has its sampler beside it. Knows no scene and keeps no state of its own.

pub mod alias;
pub mod cumulative;
pub mod equiangular;
pub mod mis;
pub mod rng;
pub mod warp;
