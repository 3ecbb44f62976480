//! Progress: a bar on stderr (terminal, without --quiet).

use std::borrow::Cow;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Where the progress of long work is shown.
#[derive(Debug, Clone, Copy)]
pub enum ProgressSink {
    /// On the terminal, if stderr is one.
    Terminal,
    /// Nowhere.
    Nobody,
}

impl ProgressSink {
    /// The terminal, unless a program is `quiet`.
    #[must_use]
    pub fn unless(quiet: bool) -> Self {
        if quiet { Self::Nobody } else { Self::Terminal }
    }
}

/// How often the seconds of waiting are drawn.
const TICK: Duration = Duration::from_millis(200);

fn bar(what: Cow<'static, str>, total: Option<u64>, progress: ProgressSink, template: &str) -> ProgressBar {
    let target = match progress {
        ProgressSink::Terminal => ProgressDrawTarget::stderr(),
        ProgressSink::Nobody => ProgressDrawTarget::hidden(),
    };
    let style = ProgressStyle::with_template(template).expect("a constant template").progress_chars("=> ");
    ProgressBar::with_draw_target(total, target).with_style(style).with_message(what)
}

/// Progress of one long piece of work.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Begins `total` steps of `what`. Nothing is drawn where stderr is no terminal.
    #[must_use]
    pub fn begin(what: impl Into<Cow<'static, str>>, total: u64, progress: ProgressSink) -> Self {
        let bar =
            bar(what.into(), Some(total), progress, "{msg:>10} [{bar:40}] {percent:>3} % {eta:>6} left");
        Self { bar }
    }

    /// Begins work that cannot say how far it is: the seconds since are shown.
    #[must_use]
    pub fn wait(what: &'static str, progress: ProgressSink) -> Self {
        let bar = bar(what.into(), None, progress, "{msg:>10} {spinner} {elapsed}");
        // It takes a thread.
        if !bar.is_hidden() {
            bar.enable_steady_tick(TICK);
        }
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
