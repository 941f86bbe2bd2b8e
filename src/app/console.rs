//! Everything that is said to people: findings, notes and facts on standard error, scenes on standard output.

use std::collections::HashMap;
use std::io::{self, IsTerminal, Write};

use tyndall_parser::diagnostic::{Diagnostics, Severity, Style};
use tyndall_parser::source::Sources;

use super::files::reason;
use super::plan::Verbosity;

/// Findings of one code that are shown; the report has more of them.
const MAX_SHOWN_PER_CODE: usize = 50;

/// Standard error.
pub(super) struct Console {
    verbosity: Verbosity,
    style: Style,
    is_terminal: bool,
    n_seen: HashMap<&'static str, usize>,
}

impl Console {
    /// Coloured on a terminal, unless the environment variable `NO_COLOR` is set (see <https://no-color.org>).
    pub(super) fn new(verbosity: Verbosity) -> Self {
        let is_terminal = io::stderr().is_terminal();
        let wants_colour = std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
            && std::env::var_os("TERM").is_none_or(|term| term != "dumb");
        let style = if is_terminal && wants_colour {
            Style::Coloured
        } else {
            Style::Plain
        };
        Self {
            verbosity,
            style,
            is_terminal,
            n_seen: HashMap::new(),
        }
    }

    /// Whether a progress bar has a place.
    pub(super) fn shows_progress(&self) -> bool {
        self.is_terminal && self.verbosity > Verbosity::Quiet
    }

    /// Says something to everyone.
    pub(super) fn say(&self, text: &str) {
        // Whoever closed standard error does not want to hear of it.
        let _ = writeln!(io::stderr().lock(), "{text}");
    }

    /// Says something unless `--quiet` was given.
    pub(super) fn note(&self, text: &str) {
        if self.verbosity > Verbosity::Quiet {
            self.say(text);
        }
    }

    /// Says something only if `--verbose` was given.
    pub(super) fn detail(&self, text: &str) {
        if self.verbosity == Verbosity::Verbose {
            self.say(text);
        }
    }

    /// Shows findings: with `--quiet`, the errors among them; never more than a screenful of one kind.
    pub(super) fn show(&mut self, found: &Diagnostics, sources: &Sources) {
        let mut shown = Diagnostics::new();
        let mut more = Vec::new();
        for diagnostic in found.iter().cloned().chain(found.left_out()) {
            if diagnostic.severity == Severity::Warning && self.verbosity == Verbosity::Quiet {
                continue;
            }
            let n_seen = self.n_seen.entry(diagnostic.code).or_default();
            *n_seen += 1;
            if *n_seen <= MAX_SHOWN_PER_CODE {
                shown.push(diagnostic);
            } else if *n_seen == MAX_SHOWN_PER_CODE + 1 {
                more.push(diagnostic.code);
            }
        }
        let text = shown.render(sources, self.style);
        let _ = io::stderr().lock().write_all(text.as_bytes());
        for code in more {
            self.say(&format!(
                "more of the kind `{code}` are not shown; the report of --json has more"
            ));
        }
    }
}

/// Whether a person is expected to type the scene.
pub(super) fn stdin_is_terminal() -> bool {
    io::stdin().is_terminal()
}

/// Whether standard output is read by a person.
pub(super) fn stdout_is_terminal() -> bool {
    io::stdout().is_terminal()
}

/// Writes to standard output. A reader that has seen enough is no error.
///
/// # Errors
/// One sentence, for any other failure.
pub(super) fn print(text: &str) -> Result<(), String> {
    match standard_output().and_then(|mut stdout| stdout.write_all(text.as_bytes())) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(format!(
            "cannot write to standard output: {}",
            reason(&error)
        )),
        Ok(()) | Err(_) => Ok(()),
    }
}

/// Standard output without the standard library in between, which takes a closed one for one that nobody looks at: a
/// report would be lost without a word.
#[cfg(unix)]
fn standard_output() -> io::Result<impl Write> {
    use std::os::fd::AsFd;

    if closed::was_closed() {
        return Err(nix::errno::Errno::EBADF.into());
    }
    let stdout = io::stdout().as_fd().try_clone_to_owned()?;
    Ok(std::fs::File::from(stdout))
}

#[cfg(not(unix))]
fn standard_output() -> io::Result<impl Write> {
    Ok(io::stdout().lock())
}

/// Whether standard output was closed when the program started. Before `main`, the standard library opens `/dev/null` in
/// its place, so that no file of the program's takes it; afterwards nobody can tell.
#[cfg(unix)]
mod closed {
    use std::io;
    use std::sync::atomic::{AtomicBool, Ordering};

    static WAS_CLOSED: AtomicBool = AtomicBool::new(false);

    #[ctor::ctor(unsafe)]
    fn look() {
        use nix::fcntl::{FcntlArg, fcntl};

        if fcntl(io::stdout(), FcntlArg::F_GETFD).is_err() {
            WAS_CLOSED.store(true, Ordering::Relaxed);
        }
    }

    pub(super) fn was_closed() -> bool {
        WAS_CLOSED.load(Ordering::Relaxed)
    }
}
