//! The tests of the library, a module for each subject. Those that need a process of their own are beside this folder.

mod common;

mod alias;
mod analytic;
mod bidirectional;
mod cameras;
mod compare;
mod compat;
mod describe;
mod direct_lighting;
mod format_doc;
mod fuzz_findings;
mod harness;
mod hazards;
mod image;
mod invariance;
mod layers;
mod lights;
mod media;
mod ply;
mod pyramid;
mod references;
mod samplers;
mod sampling;
mod scatter;
mod scatter_measured;
mod shapes;
mod spectrum;
mod sppm;
mod stress;
mod subset;
mod surfaces;
mod textures;
