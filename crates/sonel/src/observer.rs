//! Who follows long work: how far it is, what is to be said, whether to go on, and which clock it goes by.

use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

use crate::study::pipeline::{Clock, NoClock};

use crate::{Error, Result};

/// Follows long work. Every method has a default: [`Silent`] follows nothing and has no clock.
///
/// [`ControlFlow::Break`] stops the work, which then returns [`Error::Stopped`] and leaves no file.
pub trait Observer: Sync {
    /// Hears that `share`, 0 … 1, of a `step` is done: `reading`, `tracing` or `rendering`.
    fn progress(&self, _step: &str, _share: f64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Says between small steps whether to go on. Nothing has been done that is worth hearing.
    fn go_on(&self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Hears a sentence, or several lines, that the work has to say.
    fn message(&self, _severity: Severity, _text: &str) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// The clock of the work: limits of time count from its zero. Reports of work without a clock state 0 s.
    fn clock(&self) -> Option<&dyn Clock> {
        None
    }
}

/// Severity of a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// A single default, which a note has mentioned already together with the others.
    Detail,
    /// A step of the work.
    Info,
    /// Defaults taken, or a repair made.
    Note,
    /// Likely mistakes, and causes of unreliable results.
    Warning,
}

/// Follows nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {}

/// Payload of the unwinding by which an observer stops the work.
struct Stop;

/// An observer as the work sees it.
#[derive(Clone, Copy)]
pub(crate) struct Watch<'a>(&'a dyn Observer);

impl<'a> Watch<'a> {
    pub(crate) fn progress(self, step: &str, share: f64) {
        unless_stopped(self.0.progress(step, share));
    }

    #[cfg(feature = "sound")]
    pub(crate) fn go_on(self) {
        unless_stopped(self.0.go_on());
    }

    pub(crate) fn say(self, severity: Severity, text: &str) {
        unless_stopped(self.0.message(severity, text));
    }

    pub(crate) fn info(self, text: &str) {
        self.say(Severity::Info, text);
    }

    pub(crate) fn clock(self) -> &'a dyn Clock {
        self.0.clock().unwrap_or(&NoClock)
    }

    /// Checks that limits of time can be kept.
    pub(crate) fn require_clock(self, at_most: Option<f64>) -> Result<()> {
        match (at_most, self.0.clock()) {
            (Some(_), None) => {
                Err(Error::Options(vec!["`at_most` needs an observer with a clock".to_owned()]))
            }
            _ => Ok(()),
        }
    }

    /// Seconds by the clock: on the wall, and of the processor.
    pub(crate) fn seconds(self) -> (f64, f64) {
        (self.clock().wall(), self.clock().process())
    }
}

fn unless_stopped(flow: ControlFlow<()>) {
    if flow.is_break() {
        resume_unwind(Box::new(Stop));
    }
}

/// Does `work` before the eyes of `observer`.
///
/// # Errors
/// The errors of the work, and [`Error::Stopped`].
pub(crate) fn watched<T>(observer: &dyn Observer, work: impl FnOnce(Watch<'_>) -> Result<T>) -> Result<T> {
    match catch_unwind(AssertUnwindSafe(|| work(Watch(observer)))) {
        Ok(result) => result,
        Err(payload) if payload.is::<Stop>() => Err(Error::Stopped),
        Err(payload) => resume_unwind(payload),
    }
}
