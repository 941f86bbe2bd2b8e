//! The `tyndall` program.

fn main() {}
