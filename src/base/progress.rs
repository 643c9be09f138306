//! Progress of long steps: shown on a terminal, silent in a pipe.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A bar for one long step; it draws nothing unless standard error is a terminal.
#[derive(Clone)]
pub struct Progress(ProgressBar);

impl Progress {
    /// A bar of `total` steps on the terminal, or a silent one in a pipe.
    pub fn new(label: &str, total: u64) -> Self {
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
        if let Ok(style) = ProgressStyle::with_template("{msg:>14} {bar:32} {pos}/{len} {eta}") {
            bar.set_style(style);
        }
        bar.set_message(label.to_owned());
        Self(bar)
    }

    /// A bar that never draws.
    pub fn silent() -> Self {
        Self(ProgressBar::hidden())
    }

    /// One more step is done.
    pub fn advance(&self) {
        self.0.inc(1);
    }

    /// The step is over; the bar goes away.
    pub fn finish(&self) {
        self.0.finish_and_clear();
    }
}
