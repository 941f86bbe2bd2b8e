//! Bounding volume hierarchies over boxes. Knows boxes and a closure; has never heard of a shape or a material.

pub mod build;
pub mod bvh;

pub use bvh::Bvh;
