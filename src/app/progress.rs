//! The progress bar.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use indicatif::{HumanCount, ProgressBar, ProgressState, ProgressStyle};

use crate::render::Progress;

/// Time between two drawings.
const INTERVAL: Duration = Duration::from_millis(100);

/// A bar on standard error. Drawn by a thread of its own: workers only store a number, whatever the terminal does.
pub(super) struct Bar {
    bar: ProgressBar,
    knows_length: AtomicBool,
}

impl Bar {
    /// A bar for the picture `name`, removed when dropped.
    pub(super) fn new(name: &str) -> Self {
        let rate = |state: &ProgressState, out: &mut dyn std::fmt::Write| {
            let _ = write!(out, "{}", HumanCount(state.per_sec() as u64));
        };
        let template =
            "{msg} {wide_bar} {percent:>3} %  {rate} samples/s  {elapsed} elapsed, {eta} left";
        let bar = ProgressBar::no_length().with_message(name.to_owned());
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style.with_key("rate", rate));
        }
        bar.enable_steady_tick(INTERVAL);
        Self {
            bar,
            knows_length: AtomicBool::new(false),
        }
    }
}

impl Progress for Bar {
    fn samples_done(&self, done: u64, total: u64) {
        if !self.knows_length.swap(true, Ordering::Relaxed) {
            self.bar.set_length(total);
        }
        self.bar.set_position(done);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
