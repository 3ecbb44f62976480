//! CPU seconds for the studies, which read no clock themselves.

use cpu_time::{ProcessTime, ThreadTime};
use sonel_study::pipeline::Clock;

/// The CPU time of this process and of its threads.
#[derive(Debug, Clone, Copy)]
pub struct CpuClock;

impl Clock for CpuClock {
    fn process(&self) -> f64 {
        ProcessTime::now().as_duration().as_secs_f64()
    }

    fn thread(&self) -> f64 {
        ThreadTime::now().as_duration().as_secs_f64()
    }
}
