//! Surfaces and pictures against closed forms and against themselves: moved, scaled, cropped, on other threads.

mod direct;
mod film;
mod furnace;
mod hazards;
mod invariance;
mod masks;
mod robustness;
mod silhouettes;
mod subsurface;
