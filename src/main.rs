//! The `tyndall` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(tyndall::app::run(std::env::args_os()))
}
