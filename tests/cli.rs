//! The command line: the real program, run in fresh directories.

#[path = "cli/bench.rs"]
mod bench;
#[path = "cli/commands.rs"]
mod commands;
#[path = "cli/confined.rs"]
mod confined;
#[path = "cli/costs.rs"]
mod costs;
#[path = "cli/exhausted.rs"]
mod exhausted;
#[path = "cli/files.rs"]
mod files;
#[path = "cli/following.rs"]
mod following;
#[path = "cli/options.rs"]
mod options;
#[path = "cli/outside.rs"]
mod outside;
#[path = "cli/readers.rs"]
mod readers;
#[path = "cli/rendering.rs"]
mod rendering;
#[path = "cli/report.rs"]
mod report;
#[path = "cli/room.rs"]
mod room;
#[path = "cli/status.rs"]
mod status;
#[path = "cli/stopping.rs"]
mod stopping;
