//! What the graphics state promises. Rows of pbrt-v3's sharp edges are named by their number.

mod blocks;
mod frames;
mod hostile;
mod materials;
mod media;
mod motion;
mod objects;
mod published;
mod scene;
mod transforms;
