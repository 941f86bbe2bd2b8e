//! Shapes against triangulated copies, closed forms and their own samples.

mod copies;
mod curves;
mod hierarchy;
mod killeroo;
mod packets;
mod quadrics;
mod scenes;
