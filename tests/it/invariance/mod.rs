//! What must not change a picture, over generated scenes: the unit of length, the place, the orientation, and how a
//! scene is written down.
//!
//! The scenes of the default run are always the same. `cargo test --test it invariance:: -- --ignored` looks at many others;
//! the environment variable `INVARIANCE_CASES` says how many for each property.

mod compared;
mod footprints;
mod media;
mod scenes;
mod still;
mod unseen;
