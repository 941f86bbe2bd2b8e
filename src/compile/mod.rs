//! Scene description in, world out: the room that knows plugin names, parameters and files.

pub mod reader;
