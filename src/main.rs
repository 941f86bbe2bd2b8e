//! The `tyndall` program.

fn main() -> std::process::ExitCode {
    tyndall::app::run()
}
