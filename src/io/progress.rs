//! A bar on standard error while recordings are worked through; hidden where it is no terminal.

use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Counts pieces of work, from any thread.
pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// `what` is done to so many pieces.
    pub(crate) fn start(what: &'static str, pieces: usize) -> Progress {
        // indicatif hides a bar where standard error is no terminal.
        let bar = ProgressBar::with_draw_target(Some(pieces as u64), ProgressDrawTarget::stderr());
        let style =
            ProgressStyle::with_template("{spinner} {msg} {pos} of {len} {wide_bar} {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_message(what);
        bar.enable_steady_tick(Duration::from_millis(100));
        Progress(bar)
    }

    pub(crate) fn done_one(&self) {
        self.0.inc(1);
    }

    pub(crate) fn finish(self) {
        self.0.finish_and_clear();
    }
}
