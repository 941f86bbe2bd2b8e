//! Shapes against triangulated copies, closed forms and their own samples.

mod copies;
mod killeroo;
mod quadrics;
mod scenes;
