//! Media against closed forms and quadrature, each channel to four standard errors.

#[path = "../common/probe.rs"]
mod probe;
#[path = "../common/scene.rs"]
mod scene;
#[path = "../common/seen.rs"]
mod seen;
#[path = "../common/solids.rs"]
mod solids;

mod boundaries;
mod furnace;
mod multiple_scattering;
mod nebula;
mod points_in_fog;
mod sharing;
mod single_scattering;
mod skies;
mod stacks;
mod transmittance;
mod vectors;
