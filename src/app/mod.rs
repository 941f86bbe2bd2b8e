//! The command line: the only room that reads arguments, opens files and prints.

mod files;
