//! Integrators that follow light against those that do not: the same scenes must give the same pictures.

mod agreement;
mod footprints;
mod invariance;
mod narrow_spots;
mod setup;
mod specks;
mod stopping;
mod strategies;
