//! Bounding volume hierarchies, and trees of points. Knows boxes, triangles as three points, and closures; has never
//! heard of a shape or a material.

pub mod build;
pub mod bvh;
mod lanes;
pub mod node;
pub mod point_tree;
pub mod triangle;

pub use build::{Item, push_item};
pub use bvh::Bvh;
pub use node::Key;
pub use point_tree::PointTree;
pub use triangle::{RayShear, TriangleHit};
