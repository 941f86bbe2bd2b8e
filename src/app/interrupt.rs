//! Ctrl-C and SIGTERM: the first stops the rendering and leaves a partial picture, the second ends the program. And the
//! abort that memory ends with.

use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::outcome::Outcome;

/// The wish to stop.
#[derive(Default)]
pub(super) struct Interrupt {
    wanted: AtomicBool,
    /// There is a picture to save: stopping has to wait.
    is_busy: AtomicBool,
}

impl Interrupt {
    /// Starts to listen. Where that is impossible, signals do what they do by default.
    pub(super) fn listen() -> Arc<Self> {
        let interrupt = Arc::new(Self::default());
        let heard = Arc::clone(&interrupt);
        // Fails only if the program listens twice or the system forbids it; rendering goes well without.
        let _ = ctrlc::set_handler(move || heard.signal());
        interrupt
    }

    fn signal(&self) {
        let is_first = !self.wanted.swap(true, Ordering::Relaxed);
        if is_first && self.is_busy.load(Ordering::Relaxed) {
            let _ = writeln!(
                std::io::stderr().lock(),
                "\ninterrupted: writing what there is; once more to stop at once"
            );
        } else {
            std::process::exit(Outcome::Interrupted.code().into());
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

    /// Runs `work`, during which the first signal only sets the flag.
    pub(super) fn busy<T>(&self, work: impl FnOnce() -> T) -> T {
        self.is_busy.store(true, Ordering::Relaxed);
        let result = work();
        self.is_busy.store(false, Ordering::Relaxed);
        result
    }
}

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
