//! Progress: a bar on stderr (terminal, without --quiet), or calls of a listener.

use std::borrow::Cow;
use std::fmt;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Where the progress of long work is shown.
#[derive(Clone, Copy)]
pub enum ProgressSink<'a> {
    /// On the terminal, if stderr is one.
    Terminal,
    /// Nowhere.
    Nobody,
    /// Is called with what is being done and the share of it that is done, 0 … 1, as the work goes on. It may unwind
    /// ([`std::panic::resume_unwind`]): then the work ends and leaves no file.
    Listener(&'a (dyn Fn(&str, f64) + Sync)),
}

impl ProgressSink<'_> {
    /// The terminal, unless a program is `quiet`.
    #[must_use]
    pub fn unless(quiet: bool) -> Self {
        if quiet { Self::Nobody } else { Self::Terminal }
    }
}

impl fmt::Debug for ProgressSink<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Terminal => "Terminal",
            Self::Nobody => "Nobody",
            Self::Listener(_) => "Listener",
        })
    }
}

/// How often the seconds of waiting are drawn.
const TICK: Duration = Duration::from_millis(200);

fn bar(
    what: Cow<'static, str>,
    total: Option<u64>,
    progress: ProgressSink<'_>,
    template: &str,
) -> ProgressBar {
    let target = match progress {
        ProgressSink::Terminal => ProgressDrawTarget::stderr(),
        ProgressSink::Nobody | ProgressSink::Listener(_) => ProgressDrawTarget::hidden(),
    };
    let style = ProgressStyle::with_template(template).expect("a constant template").progress_chars("=> ");
    ProgressBar::with_draw_target(total, target).with_style(style).with_message(what)
}

/// Progress of one long piece of work.
#[derive(Debug)]
pub struct Progress<'a> {
    what: Cow<'static, str>,
    total: u64,
    bar: ProgressBar,
    progress: ProgressSink<'a>,
}

impl<'a> Progress<'a> {
    /// Begins `total` steps of `what`. Nothing is drawn where stderr is no terminal.
    #[must_use]
    pub fn begin(what: impl Into<Cow<'static, str>>, total: u64, progress: ProgressSink<'a>) -> Self {
        let what = what.into();
        let bar =
            bar(what.clone(), Some(total), progress, "{msg:>10} [{bar:40}] {percent:>3} % {eta:>6} left");
        Self { what, total, bar, progress }
    }

    /// Begins work that cannot say how far it is: the seconds since are shown.
    #[must_use]
    pub fn wait(what: &'static str, progress: ProgressSink<'a>) -> Self {
        let bar = bar(what.into(), None, progress, "{msg:>10} {spinner} {elapsed}");
        bar.enable_steady_tick(TICK);
        Self { what: what.into(), total: 0, bar, progress }
    }

    /// `done` steps are done.
    pub fn reach(&self, done: u64) {
        self.bar.set_position(done);
        if let ProgressSink::Listener(listener) = self.progress {
            listener(&self.what, done as f64 / self.total.max(1) as f64);
        }
    }

    /// Removes the bar.
    pub fn end(self) {
        self.bar.finish_and_clear();
    }
}
