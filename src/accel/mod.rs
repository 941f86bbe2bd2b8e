//! Bounding volume hierarchies over boxes, and trees of points. Knows boxes, points and a closure; has never heard of a
//! shape or a material.

pub mod build;
pub mod bvh;
pub mod point_tree;

pub use bvh::Bvh;
pub use point_tree::PointTree;
