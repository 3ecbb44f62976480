//! Progress: a bar on stderr (terminal, without --quiet).

use std::borrow::Cow;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Steps of a bar.
const STEPS: f64 = 1000.0;
/// How often the seconds of waiting are drawn.
const TICK: Duration = Duration::from_millis(200);

/// Progress of one long piece of work, shown until it is dropped: on the terminal, if stderr is one and the program is not `quiet`.
#[derive(Debug)]
pub struct Progress(ProgressBar);

impl Progress {
    /// Begins `what`.
    #[must_use]
    pub fn begin(what: impl Into<Cow<'static, str>>, quiet: bool) -> Self {
        Self::drawn(what, Some(STEPS as u64), quiet, "{msg:>10} [{bar:40}] {percent:>3} % {eta:>6} left")
    }

    /// Begins work that cannot say how far it is: the seconds since are shown.
    #[must_use]
    pub fn wait(what: &'static str, quiet: bool) -> Self {
        let begun = Self::drawn(what, None, quiet, "{msg:>10} {spinner} {elapsed}");
        // It takes a thread.
        if !begun.0.is_hidden() {
            begun.0.enable_steady_tick(TICK);
        }
        begun
    }

    fn drawn(what: impl Into<Cow<'static, str>>, steps: Option<u64>, quiet: bool, template: &str) -> Self {
        let target = if quiet { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr() };
        let style =
            ProgressStyle::with_template(template).expect("a constant template").progress_chars("=> ");
        Self(ProgressBar::with_draw_target(steps, target).with_style(style).with_message(what))
    }

    /// A `share` of it, 0 … 1, is done.
    pub fn reach(&self, share: f64) {
        self.0.set_position((share * STEPS) as u64);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
