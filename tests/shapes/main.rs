//! Shapes against triangulated copies, closed forms and their own samples.

#![expect(clippy::print_stdout, reason = "a skipped test says so")]

mod copies;
mod killeroo;
mod quadrics;
mod scenes;
