//! Output of a sweep: JSON, plots and a page.

mod json;
mod page;
mod plots;

pub use self::json::json;
pub use self::page::markdown;
pub use self::plots::{bias, cost, deviation, efficiency};

use super::errors::{self, Curve};
use super::fit::{self, Line};
use super::runs::Tradeoff;
use super::verdict::{self, Verdict};

/// A sweep with everything that was made of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Findings<'a> {
    /// The sweep.
    pub tradeoff: &'a Tradeoff,
    /// Errors of every setting and parameter.
    pub curves: Vec<Curve>,
    /// What follows.
    pub verdicts: Vec<Verdict>,
}

impl<'a> Findings<'a> {
    /// Findings of `tradeoff`.
    #[must_use]
    pub fn of(tradeoff: &'a Tradeoff) -> Self {
        let curves = errors::curves(tradeoff);
        let verdicts = verdict::verdicts(tradeoff, &curves);
        Self { tradeoff, curves, verdicts }
    }

    fn name(&self, setting: usize) -> &str {
        &self.tradeoff.sweep.settings[setting].name
    }

    /// CPU seconds of `setting` over packets: a straight line, weighted by 1/N² because times scatter in proportion.
    #[must_use]
    pub fn seconds_per_packet(&self, setting: usize) -> Option<Line> {
        let runs = self.tradeoff.runs.iter().filter(|run| run.setting == setting);
        let points: Vec<(f64, f64, f64)> = runs
            .map(|run| {
                let packets = run.packets as f64;
                (packets, run.seconds.total(), 1.0 / (packets * packets))
            })
            .collect();
        fit::line(&points)
    }

    /// Mean CPU seconds of each phase of `setting` with `packets` [s].
    fn phases(&self, setting: usize, packets: u64) -> Vec<(&'static str, f64)> {
        let runs = self.tradeoff.runs_of(setting, packets);
        let Some(first) = runs.first() else { return Vec::new() };
        let mean = |phase: usize| {
            runs.iter().map(|run| run.seconds.phases()[phase].1).sum::<f64>() / runs.len() as f64
        };
        first.seconds.phases().iter().enumerate().map(|(phase, (name, _))| (*name, mean(phase))).collect()
    }
}
