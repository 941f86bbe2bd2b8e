//! Every row of the list of numerical hazards: what breaks in renderers of this family, as a test or a decision.
//!
//! [`rows`] is the list, and names a test for each row, here or elsewhere; `docs/stability.md` is written from it. Tests
//! are named by the row they stand for, and lie in a file for each family of rows.

mod geometry;
mod hostile;
mod input;
mod lights;
mod loaded;
mod materials;
mod media;
mod rows;
mod sampling;
mod table;
