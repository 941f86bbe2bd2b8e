//! Lights by themselves: what they send where, the rays they emit, and how one of many is chosen.

mod asymmetric_lamps;
mod bad;
mod choice;
mod emission;
mod positional;
mod self_shadows;
mod setup;
