//! Progress: a bar on stderr, where stderr is a terminal and nobody asked for quiet, or calls of a listener.

use std::fmt;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Who follows the progress of long work.
#[derive(Clone, Copy)]
pub enum Audience<'a> {
    /// Whoever sees the terminal that stderr is.
    Terminal,
    /// Nobody.
    Nobody,
    /// Is called with what is being done and the share of it that is done, 0 … 1, as the work goes on. It may unwind
    /// ([`std::panic::resume_unwind`]): then the work ends and leaves no file.
    Listener(&'a (dyn Fn(&str, f64) + Sync)),
}

impl Audience<'_> {
    /// The terminal, unless a program is `quiet`.
    #[must_use]
    pub fn unless(quiet: bool) -> Self {
        if quiet { Self::Nobody } else { Self::Terminal }
    }
}

impl fmt::Debug for Audience<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Terminal => "Terminal",
            Self::Nobody => "Nobody",
            Self::Listener(_) => "Listener",
        })
    }
}

/// Progress of one long piece of work.
#[derive(Debug)]
pub struct Progress<'a> {
    what: &'static str,
    total: u64,
    bar: ProgressBar,
    audience: Audience<'a>,
}

impl<'a> Progress<'a> {
    /// Begins `total` steps of `what`. Nothing is drawn where stderr is no terminal.
    #[must_use]
    pub fn begin(what: &'static str, total: u64, audience: Audience<'a>) -> Self {
        let target = match audience {
            Audience::Terminal => ProgressDrawTarget::stderr(),
            Audience::Nobody | Audience::Listener(_) => ProgressDrawTarget::hidden(),
        };
        let bar = ProgressBar::with_draw_target(Some(total), target);
        let style = ProgressStyle::with_template("{msg:>10} [{bar:40}] {percent:>3} % {eta:>6} left")
            .expect("a constant template")
            .progress_chars("=> ");
        bar.set_style(style);
        bar.set_message(what);
        Self { what, total, bar, audience }
    }

    /// `done` steps are done.
    pub fn reach(&self, done: u64) {
        self.bar.set_position(done);
        if let Audience::Listener(listener) = self.audience {
            listener(self.what, done as f64 / self.total.max(1) as f64);
        }
    }

    /// Removes the bar.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}
