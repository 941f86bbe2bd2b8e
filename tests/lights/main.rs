//! Lights by themselves: what they send where, the rays they emit, and how one of many is chosen.

#[path = "../common/scene.rs"]
mod scene;

mod bad;
mod choice;
mod emission;
mod positional;
mod setup;
