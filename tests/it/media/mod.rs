//! Media against closed forms and quadrature, each channel to four standard errors.

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
