//! Limits of a single run: plans state an excess, runs are refused.

use std::fmt;

use crate::observer::Watch;
use crate::quantity::{bytes, seconds};
use crate::{Error, Result};

/// Largest map [bytes]: 1 TB, a usual disk.
const MOST_MAP_BYTES: f64 = 1e12;
/// Most own memory [bytes]: 1 TB, a large node.
const MOST_MEMORY_BYTES: f64 = 1e12;
/// Longest CPU time [s]: a year, four days on 96 cores. The three are chosen to refuse misprints.
const MOST_CPU_SECONDS: f64 = 365.0 * 86_400.0;

/// More own memory [bytes] or CPU time [s] is announced before a run: 4 GB, five minutes.
const UNANNOUNCED_MEMORY_BYTES: f64 = 4e9;
const UNANNOUNCED_CPU_SECONDS: f64 = 300.0;

/// Cores of this machine.
pub(crate) fn cores() -> f64 {
    std::thread::available_parallelism().map_or(1.0, |cores| cores.get() as f64)
}

/// Demand of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Demand {
    /// CPU time [s].
    pub cpu_seconds: f64,
    /// Size of its map [bytes].
    pub map_bytes: f64,
    /// Own memory [bytes].
    pub memory_bytes: f64,
}

impl Demand {
    /// Demand that exceeds its limit, with the limit; none where the run is feasible.
    #[must_use]
    pub(crate) fn excess(self) -> Option<String> {
        let limits = [
            ("map", self.map_bytes, MOST_MAP_BYTES, bytes as fn(f64) -> String),
            ("memory", self.memory_bytes, MOST_MEMORY_BYTES, bytes),
            ("CPU time", self.cpu_seconds, MOST_CPU_SECONDS, seconds),
        ];
        let exceeded = limits.into_iter().filter(|(_, value, most, _)| value > most);
        let parts: Vec<String> = exceeded
            .map(|(what, value, most, show)| format!("{what} {} (limit {})", show(value), show(most)))
            .collect();
        (!parts.is_empty()).then(|| parts.join(", "))
    }

    /// Announces a large run. `smaller` is what makes it smaller.
    ///
    /// # Errors
    /// Where it takes more memory [bytes], or on all cores more time [s], than `allowed`.
    pub(crate) fn admit(self, allowed: [Option<f64>; 2], smaller: &str, watch: Watch<'_>) -> Result<()> {
        let [memory, time] = allowed;
        let of_memory = memory.filter(|most| self.memory_bytes > *most);
        let of_time = time.filter(|most| self.cpu_seconds > most * cores());
        let over = of_memory.map(|most| format!("`memory` allows {}", bytes(most)));
        let of_time = of_time.map(|most| format!("`at_most` allows {} on {} cores", seconds(most), cores()));
        let over = over.or(of_time);
        if let Some(over) = over {
            return Err(Error::Options(vec![format!(
                "the run needs about: {self}, but {over}: allow more, or {smaller}"
            )]));
        }
        if self.memory_bytes > UNANNOUNCED_MEMORY_BYTES || self.cpu_seconds > UNANNOUNCED_CPU_SECONDS {
            watch.info(&format!("the run needs about: {self}; for less, {smaller}"))?;
        }
        Ok(())
    }
}

/// `map 2.0 GB, memory 20.0 MB, CPU time 3.00 s`; without a map only the rest.
impl fmt::Display for Demand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.map_bytes > 0.0 {
            write!(f, "map {}, ", bytes(self.map_bytes))?;
        }
        write!(f, "memory {}, CPU time {}", bytes(self.memory_bytes), seconds(self.cpu_seconds))
    }
}

/// Sentences about limits of memory [bytes] and time [s] that are none.
pub(crate) fn wrong_limits(memory: Option<f64>, at_most: Option<f64>) -> [Option<String>; 2] {
    let wrong = |limit: Option<f64>| limit.filter(|&limit| !(limit.is_finite() && limit > 0.0));
    [
        wrong(memory).map(|limit| format!("`memory` {limit} is no limit: give bytes above 0")),
        wrong(at_most).map(|limit| format!("`at_most` {limit} s is no limit: give a time above 0 s")),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::{Observer, Severity};
    use std::ops::ControlFlow;

    #[derive(Default)]
    struct Notes(std::sync::Mutex<Vec<String>>);

    impl Observer for Notes {
        fn message(&self, _: Severity, text: &str) -> ControlFlow<()> {
            self.0.lock().unwrap().push(text.to_owned());
            ControlFlow::Continue(())
        }
    }

    #[test]
    fn large_runs_are_announced_and_those_beyond_the_allowed_memory_refused() {
        let heard = Notes::default();
        let admit = |cpu_seconds, memory_bytes, allowed| {
            let demand = Demand { cpu_seconds, map_bytes: 0.0, memory_bytes };
            demand.admit(allowed, "give fewer", Watch(&heard))
        };
        admit(299.0, 3.9e9, [Some(4e9), Some(300.0)]).unwrap();
        assert!(heard.0.lock().unwrap().is_empty());
        admit(301.0, 1e9, [None, Some(301.0)]).unwrap();
        admit(1.0, 4.1e9, [None; 2]).unwrap();
        let last = "the run needs about: memory 4.1 GB, CPU time 1.00 s; for less, give fewer";
        assert_eq!(heard.0.lock().unwrap()[1..], [last]);
        let late = admit(1801.0 * cores(), 1e9, [None, Some(1800.0)]).unwrap_err().to_string();
        assert!(late.contains("but `at_most` allows 30 min on ") && late.ends_with("give fewer"), "{late}");
        let refused = admit(1.0, 4.1e9, [Some(4e9), None]).unwrap_err().to_string();
        assert!(
            refused.starts_with("the run needs about: memory 4.1 GB")
                && refused.ends_with("but `memory` allows 4.0 GB: allow more, or give fewer"),
            "{refused}"
        );
    }

    #[test]
    fn what_exceeds_a_limit_is_named_with_it() {
        let demand = Demand { cpu_seconds: 1e9, map_bytes: 2.4e14, memory_bytes: 1e9 };
        assert_eq!(
            demand.excess().unwrap(),
            "map 240.0 TB (limit 1.0 TB), CPU time 31.7 years (limit 1.0 years)"
        );
        assert_eq!(Demand::default().excess(), None);
    }
}
