//! Who follows long work: how far it is, what is to be said, whether to go on, and which clock it goes by.

use std::ops::ControlFlow;

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

/// Seconds since any moments, which must not change during a run.
pub trait Clock: Sync {
    /// Time of the clock on the wall [s].
    fn wall(&self) -> f64;
    /// CPU time of all threads of the process [s].
    fn process(&self) -> f64;
    /// CPU time of the thread that asks [s].
    fn thread(&self) -> f64;
}

/// It is always the same time.
struct NoClock;

impl Clock for NoClock {
    fn wall(&self) -> f64 {
        0.0
    }

    fn process(&self) -> f64 {
        0.0
    }

    fn thread(&self) -> f64 {
        0.0
    }
}

/// An observer as the work sees it. Every report may end the work with [`Error::Stopped`].
#[derive(Clone, Copy)]
pub(crate) struct Watch<'a>(pub &'a dyn Observer);

impl<'a> Watch<'a> {
    pub(crate) fn progress(self, step: &str, share: f64) -> Result<()> {
        unless_stopped(self.0.progress(step, share))
    }

    pub(crate) fn say(self, severity: Severity, text: &str) -> Result<()> {
        unless_stopped(self.0.message(severity, text))
    }

    pub(crate) fn info(self, text: &str) -> Result<()> {
        self.say(Severity::Info, text)
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

pub(crate) fn unless_stopped(flow: ControlFlow<()>) -> Result<()> {
    if flow.is_break() { Err(Error::Stopped) } else { Ok(()) }
}
