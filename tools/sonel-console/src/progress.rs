//! A progress bar on stderr, where stderr is a terminal and nobody asked for quiet.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Progress of one long piece of work.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Begins `total` steps of `what`. Nothing is drawn with `quiet` or where stderr is no terminal.
    #[must_use]
    pub fn begin(what: &str, total: u64, quiet: bool) -> Self {
        let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let bar = ProgressBar::with_draw_target(Some(total), target);
        let style = ProgressStyle::with_template("{msg:>10} [{bar:40}] {percent:>3} % {eta:>6} left")
            .expect("a constant template")
            .progress_chars("=> ");
        bar.set_style(style);
        bar.set_message(what.to_owned());
        Self { bar }
    }

    /// `done` steps are done.
    pub fn reach(&self, done: u64) {
        self.bar.set_position(done);
    }

    /// Removes the bar.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}
