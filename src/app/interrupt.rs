//! Signals. The first one stops a rendering, which leaves a partial picture; before there is anything to save it ends the
//! program, whatever that is reading or building. The second one always does. And the abort that memory ends with.

use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;

use super::outcome::Outcome;
use super::output;

/// The wish to stop.
#[derive(Default)]
pub(super) struct Interrupt {
    wanted: AtomicBool,
    state: Mutex<State>,
}

/// Said by whom a signal ends, before the program does.
type LastWords = Box<dyn FnOnce() + Send>;

#[derive(Default)]
struct State {
    /// There is something to save: stopping has to wait.
    is_busy: bool,
    /// A signal ends the program this moment.
    is_over: bool,
    last_words: Option<LastWords>,
}

impl Interrupt {
    /// Starts to listen. Where that is impossible, signals do what they do by default.
    pub(super) fn listen() -> Arc<Self> {
        let interrupt = Arc::new(Self::default());
        let heard = Arc::clone(&interrupt);
        // Fails only if the program listens twice or the system forbids it; rendering goes well without.
        let _ = ctrlc::set_handler(move || heard.signal());
        ignore_file_size_limit();
        interrupt
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn signal(&self) {
        if self.wanted.swap(true, Ordering::Relaxed) {
            end();
        }
        let mut state = self.lock();
        if state.is_busy {
            drop(state);
            let _ = writeln!(
                std::io::stderr().lock(),
                "\ninterrupted: writing what there is; once more to stop at once"
            );
            return;
        }
        state.is_over = true;
        match state.last_words.take() {
            // Not here: a second signal must be heard while a report waits for its reader.
            Some(last_words) => {
                let spoken = thread::Builder::new().spawn(move || {
                    last_words();
                    end();
                });
                if spoken.is_err() {
                    end();
                }
            }
            None => end(),
        }
    }

    /// Set when rendering has to stop.
    pub(super) fn flag(&self) -> &AtomicBool {
        &self.wanted
    }

    /// Whether a signal came.
    pub(super) fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed)
    }

    /// What is to be done if a signal ends the program while it is not busy.
    pub(super) fn leave(&self, last_words: impl FnOnce() + Send + 'static) {
        self.lock().last_words = Some(Box::new(last_words));
    }

    /// Runs `work`, during which the first signal only sets the flag.
    pub(super) fn busy<T>(&self, work: impl FnOnce() -> T) -> T {
        self.set_busy(true);
        let result = work();
        self.set_busy(false);
        result
    }

    /// From here on, the first signal only sets the flag.
    pub(super) fn conclude(&self) {
        self.set_busy(true);
    }

    fn set_busy(&self, is_busy: bool) {
        let mut state = self.lock();
        if state.is_over {
            drop(state);
            // The program ends; nothing may be begun any more.
            loop {
                thread::park();
            }
        }
        state.is_busy = is_busy;
    }
}

/// Ends the program without leaving files in the making behind.
fn end() -> ! {
    output::forsake();
    std::process::exit(Outcome::Interrupted.code().into())
}

/// Lets a write beyond the limit on the size of files fail as any other, instead of killing the program.
#[cfg(unix)]
fn ignore_file_size_limit() {
    // Handled rather than ignored: children should not inherit it.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// There are none.
#[cfg(not(unix))]
fn ignore_file_size_limit() {}

/// Makes memory that cannot be had end the program as any other failure does. The standard library says how much was
/// asked for, and aborts, which would look as if the program had crashed.
#[cfg(unix)]
pub(super) fn fail_on_abort() {
    let always = Arc::new(AtomicBool::new(true));
    let status = Outcome::Failed.code().into();
    // Where that is impossible, an abort is an abort.
    let _ = signal_hook::flag::register_conditional_shutdown(
        signal_hook::consts::SIGABRT,
        status,
        always,
    );
}

/// Aborts are left alone.
#[cfg(not(unix))]
pub(super) fn fail_on_abort() {}
