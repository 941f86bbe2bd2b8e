//! One run: a child process, measured from outside, whoever's program it is.

use std::fs::{self, File};
use std::io::{self, Read, Seek};
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use crate::app::files::reason;

/// Characters of a program's last words that are kept.
const MAX_LAST_WORDS: usize = 160;
/// Time between two looks at the clock and at the wish to stop.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// How long a program may take to tell its version.
const VERSION_TIMEOUT: Duration = Duration::from_secs(5);
/// Bytes in which its version is looked for.
const MAX_VERSION: u64 = 4096;

/// What a process took.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Usage {
    /// Seconds from start to end.
    pub(super) wall: f64,
    /// Seconds of all its threads, in the program and in the system on its behalf; `None` where unknown.
    pub(super) cpu: Option<f64>,
    /// Most memory held at once, in bytes; `None` where unknown.
    pub(super) peak_memory: Option<u64>,
}

/// A process that ended.
#[derive(Debug)]
pub(super) struct Ended {
    pub(super) usage: Usage,
    /// The exit status; `None` if a signal ended it.
    pub(super) code: Option<i32>,
    /// Why this is a failure: the exit status and the last words. `None` for status 0.
    pub(super) failure: Option<String>,
}

/// Runs a program to its end, to `timeout`, or until it is to `stop`. What it says goes to the file `log`.
///
/// # Errors
/// It cannot be started, or ran out of time.
pub(super) fn measure(
    command: &mut Command,
    log: &Path,
    timeout: Duration,
    stop: &AtomicBool,
) -> Result<Ended, String> {
    let program = command.get_program().display().to_string();
    let refusal = |error: io::Error| format!("cannot run \"{program}\": {}", reason(&error));
    let output = File::create(log).map_err(refusal)?;
    let errors = output.try_clone().map_err(refusal)?;
    command.stdin(Stdio::null()).stdout(output).stderr(errors);
    let start = Instant::now();
    let mut child = command.spawn().map_err(refusal)?;
    let (status, usage, is_overdue) = wait(&mut child, start, timeout, stop).map_err(refusal)?;
    if is_overdue {
        return Err(format!("not done after {} s", timeout.as_secs()));
    }
    let failure = (!status.success()).then(|| {
        let last_words = last_words(log);
        let colon = if last_words.is_empty() { "" } else { ": " };
        format!("{status}{colon}{last_words}")
    });
    Ok(Ended {
        usage,
        code: status.code(),
        failure,
    })
}

/// Waits while a thread watches the clock.
fn wait(
    child: &mut Child,
    start: Instant,
    timeout: Duration,
    stop: &AtomicBool,
) -> io::Result<(ExitStatus, Usage, bool)> {
    let id = child.id();
    thread::scope(|scope| {
        let (done, is_done) = mpsc::channel::<()>();
        let watchman = scope.spawn(move || {
            while is_done.recv_timeout(LOOK_EVERY) == Err(mpsc::RecvTimeoutError::Timeout) {
                let is_overdue = start.elapsed() >= timeout;
                if is_overdue || stop.load(Ordering::Relaxed) {
                    kill(id);
                    return is_overdue;
                }
            }
            false
        });
        let ended = wait_for_usage(child, start);
        drop(done);
        let is_overdue = watchman.join().unwrap_or_default();
        ended.map(|(status, usage)| (status, usage, is_overdue))
    })
}

#[cfg(unix)]
fn wait_for_usage(child: &mut Child, start: Instant) -> io::Result<(ExitStatus, Usage)> {
    use wait4::Wait4;

    let ended = child.wait4()?;
    let usage = Usage {
        wall: start.elapsed().as_secs_f64(),
        cpu: Some((ended.rusage.utime + ended.rusage.stime).as_secs_f64()),
        peak_memory: Some(ended.rusage.maxrss),
    };
    Ok((ended.status, usage))
}

#[cfg(not(unix))]
fn wait_for_usage(child: &mut Child, start: Instant) -> io::Result<(ExitStatus, Usage)> {
    let status = child.wait()?;
    let usage = Usage {
        wall: start.elapsed().as_secs_f64(),
        cpu: None,
        peak_memory: None,
    };
    Ok((status, usage))
}

#[cfg(unix)]
fn kill(id: u32) {
    use nix::sys::signal::{Signal, kill};
    use nix::unistd::Pid;

    if let Ok(id) = i32::try_from(id) {
        // It may have ended this moment.
        let _ = kill(Pid::from_raw(id), Signal::SIGKILL);
    }
}

/// Without signals, a run takes as long as it takes and is discarded then.
#[cfg(not(unix))]
fn kill(_id: u32) {}

/// The last line that says anything.
fn last_words(log: &Path) -> String {
    let bytes = fs::read(log).unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    let line = text
        .lines()
        .rev()
        .map(str::trim)
        .find(|line| !line.is_empty());
    line.unwrap_or_default()
        .chars()
        .take(MAX_LAST_WORDS)
        .collect()
}

/// The first line that a command prints, where a version is expected. `None` if there is none within
/// [`VERSION_TIMEOUT`].
pub(super) fn first_line(words: &[String]) -> Option<String> {
    let (program, args) = words.split_first()?;
    // Not a pipe: what a program leaves running would keep that open.
    let mut output = tempfile::tempfile().ok()?;
    let mut child = Command::new(program)
        .args(args)
        .stdin(Stdio::null())
        .stdout(output.try_clone().ok()?)
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let never = AtomicBool::new(false);
    let (_, _, is_overdue) = wait(&mut child, Instant::now(), VERSION_TIMEOUT, &never).ok()?;
    if is_overdue {
        return None;
    }
    output.rewind().ok()?;
    let mut bytes = Vec::new();
    output.take(MAX_VERSION).read_to_end(&mut bytes).ok()?;
    let text = String::from_utf8_lossy(&bytes);
    let line = text.lines().map(str::trim).find(|line| !line.is_empty())?;
    Some(line.to_owned())
}
