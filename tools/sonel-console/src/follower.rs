//! Follows long work for a program: a progress bar, a log, a stopwatch.

use std::ops::ControlFlow;
use std::sync::{Mutex, MutexGuard, PoisonError};

use sonel::{Clock, Observer, Severity};

use crate::progress::Progress;
use crate::{Log, Stopwatch, in_words, spelled};

/// A step that cannot say how far it is.
const READING: &str = "reading";

/// Shows the progress of work and writes what it says to a log.
pub struct Follower<'a> {
    quiet: bool,
    state: Mutex<State<'a>>,
    watch: Stopwatch,
    /// Whether single defaults are written.
    is_verbose: bool,
}

struct State<'a> {
    log: &'a mut Log<'a>,
    /// The step that is shown, with its bar.
    shown: Option<(String, Progress)>,
}

impl<'a> Follower<'a> {
    /// Follows work from now on, without a bar for a program that is `quiet`.
    pub fn new<'b: 'a>(quiet: bool, log: &'a mut Log<'b>) -> Self {
        let state = State { log, shown: None };
        Self { quiet, state: Mutex::new(state), watch: Stopwatch::start(), is_verbose: false }
    }

    /// Also writes every default on a line, if `is_verbose`.
    #[must_use]
    pub fn verbose(self, is_verbose: bool) -> Self {
        Self { is_verbose, ..self }
    }

    fn state(&self) -> MutexGuard<'_, State<'a>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// (wall, CPU) seconds since the beginning.
    #[must_use]
    pub fn seconds(&self) -> (f64, f64) {
        self.watch.seconds()
    }

    /// Writes a line to the log.
    ///
    /// # Errors
    /// When nobody reads it any more.
    pub fn line(&self, line: &str) -> anyhow::Result<()> {
        Ok(writeln!(self.state().log, "{line}")?)
    }

    /// The result of work that was followed, its error as the command line spells options.
    ///
    /// # Errors
    /// The error of the work.
    pub fn result<T>(&self, result: sonel::Result<T>) -> anyhow::Result<T> {
        result.map_err(spelled)
    }
}

impl Observer for Follower<'_> {
    fn progress(&self, step: &str, share: f64) -> ControlFlow<()> {
        let mut state = self.state();
        if state.shown.as_ref().is_none_or(|(shown, _)| shown != step) && share < 1.0 {
            let bar = match step {
                READING => Progress::wait(READING, self.quiet),
                _ => Progress::begin(step.to_owned(), self.quiet),
            };
            state.shown = Some((step.to_owned(), bar));
        }
        if share >= 1.0 {
            state.shown = None;
        } else if let Some((_, bar)) = &state.shown
            && step != READING
        {
            bar.reach(share);
        }
        ControlFlow::Continue(())
    }

    fn message(&self, severity: Severity, text: &str) -> ControlFlow<()> {
        let begin = match severity {
            Severity::Detail if !self.is_verbose => return ControlFlow::Continue(()),
            Severity::Detail | Severity::Info => "",
            Severity::Note => "note: ",
            Severity::Warning => "warning: ",
        };
        // A log that fails is done without.
        let _ = writeln!(self.state().log, "{begin}{}", in_words(text));
        ControlFlow::Continue(())
    }

    fn clock(&self) -> Option<&dyn Clock> {
        Some(&self.watch)
    }
}
