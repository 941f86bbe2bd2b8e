//! Surfaces and pictures against closed forms and against themselves: moved, scaled, cropped, on other threads.

#[path = "../common/findings.rs"]
mod findings;
#[path = "../common/probe.rs"]
mod probe;
#[path = "../common/scene.rs"]
mod scene;
#[path = "../common/seen.rs"]
mod seen;
#[path = "../common/solids.rs"]
mod solids;

mod direct;
mod film;
mod furnace;
mod hazards;
mod invariance;
mod masks;
mod robustness;
mod silhouettes;
mod subsurface;
