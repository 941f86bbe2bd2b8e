//! Lights by themselves: what they send where, the rays they emit, and how one of many is chosen.

#[path = "../common/probe.rs"]
mod probe;
#[path = "../common/scene.rs"]
mod scene;
#[path = "../common/seen.rs"]
mod seen;

mod bad;
mod choice;
mod emission;
mod odd_lamps;
mod positional;
mod setup;
