//! The graphics state of pbrt-v3: directives in, scene description out.
//!
//! Owns the current transforms, the attribute and transform stacks, and every name a scene file defines. Opens no
//! file, builds nothing and reads parameters only where a directive's meaning hangs on one (the kind of a named
//! material or medium, the parts of a `mix`, the guess of whether a shape overrides its material). Names of
//! textures are resolved here, but only reported by whoever looks them up.

mod builder;
pub mod description;
mod names;
mod state;
mod transform;

pub use builder::Builder;

use description::SceneDescription;
use tyndall_parser::diagnostic::Diagnostics;
use tyndall_parser::directive::SceneFile;

/// What a scene file means, and what is wrong with it. Never fails: a directive that cannot be followed is
/// reported and left out, as pbrt-v3 does. Parameters are moved, not copied.
pub fn describe(file: SceneFile) -> (SceneDescription, Diagnostics) {
    let mut builder = Builder::default();
    for directive in file.directives {
        builder.directive(directive);
    }
    builder.finish()
}
