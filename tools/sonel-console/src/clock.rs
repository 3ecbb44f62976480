//! Seconds for the libraries, which read no clock themselves.

use std::time::Instant;

use cpu_time::{ProcessTime, ThreadTime};
use sonel::{Clock, Observer};

/// Seconds since its start, on the wall and of the processor.
#[derive(Debug)]
pub struct Stopwatch {
    wall: Instant,
    process: ProcessTime,
}

impl Stopwatch {
    /// Starts.
    #[must_use]
    pub fn start() -> Self {
        Self { wall: Instant::now(), process: ProcessTime::now() }
    }

    /// (wall, CPU of all threads) [s].
    #[must_use]
    pub fn seconds(&self) -> (f64, f64) {
        (self.wall(), self.process())
    }
}

impl Observer for Stopwatch {
    fn clock(&self) -> Option<&dyn Clock> {
        Some(self)
    }
}

impl Clock for Stopwatch {
    fn wall(&self) -> f64 {
        self.wall.elapsed().as_secs_f64()
    }

    fn process(&self) -> f64 {
        self.process.elapsed().as_secs_f64()
    }

    fn thread(&self) -> f64 {
        ThreadTime::now().as_duration().as_secs_f64()
    }
}
