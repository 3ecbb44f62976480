//! Limits of a single run: plans state an excess, runs are refused.

use std::fmt;

use crate::quantity::{bytes, seconds};

/// Largest map [bytes]: 1 TB, a usual disk.
const MOST_MAP_BYTES: f64 = 1e12;
/// Most own memory [bytes]: 1 TB, a large node.
const MOST_MEMORY_BYTES: f64 = 1e12;
/// Longest CPU time [s]: a year, four days on 96 cores. The three are chosen to refuse misprints.
const MOST_CPU_SECONDS: f64 = 365.0 * 86_400.0;

/// Demand of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Demand {
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
    pub fn excess(self) -> Option<String> {
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
}

/// `map 2.0 GB, memory 20.0 MB, CPU time 3.00 s`.
impl fmt::Display for Demand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [map, memory] = [self.map_bytes, self.memory_bytes].map(bytes);
        write!(f, "map {map}, memory {memory}, CPU time {}", seconds(self.cpu_seconds))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
