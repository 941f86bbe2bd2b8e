//! Parser for pbrt-v3 scene files: bytes in, directives with spans and located diagnostics out.
//!
//! It never panics, never prints and touches no file system: includes are asked for through a loader.

pub mod diagnostic;
pub mod directive;
pub mod params;
pub mod schema;
pub mod source;
