//! What a pilot finds: how uncertain parameters are, and what a run costs.

use sonel_analysis::Parameter;
use sonel_renderer::Columns;

use crate::study::split::{self, Variance};
use crate::study::spread::{Place, Reading, pooled_kurtosis};

/// Result of a pilot.
#[derive(Debug, Clone)]
pub struct Pilot {
    /// Emissions per source of the last look (per source and band where bands do not share paths).
    pub emissions: u64,
    /// Batches.
    pub batches: u32,
    /// Visibility rays of a receiver.
    pub rays: u32,
    /// Whether visibility rays are cast: then more of them help.
    pub casts_rays: bool,
    /// Columns of a receiver's echograms: more where directions are asked for.
    pub columns: Columns,
    /// Uncertainty of each parameter.
    pub spreads: Vec<Spread>,
    /// What it cost.
    pub costs: Costs,
}

/// Uncertainty of one parameter in a pilot [JND].
#[derive(Debug, Clone)]
pub struct Spread {
    /// The parameter.
    pub place: Place,
    /// Mean value; none where every run refused it as too noisy.
    pub value: Option<f64>,
    /// Variance, or the reason why there is none.
    pub variance: Result<Variance, String>,
    /// Excess kurtosis that a batch of a single emission would have: large where few strong paths carry the parameter, so that its
    /// variance is itself uncertain.
    pub tail: f64,
}

/// Cost of a run in this scene; times are those of this machine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Costs {
    /// CPU seconds of tracing and writing.
    pub trace: Linear,
    /// CPU seconds of opening the map and checking it.
    pub open: Linear,
    /// CPU seconds of rendering the pilot's receivers with the pilot's rays.
    pub render: Linear,
    /// CPU seconds of the pilot's rays once more. Those of as many rays for each emission are part of `render`.
    pub rays: f64,
    /// CPU seconds of reading the parameters, for each batch.
    pub parameters: f64,
    /// Bytes of the map.
    pub bytes: Linear,
    /// Segments per emission.
    pub segments: f64,
}

/// Part of a pilot's cost that grows with its emissions at least: what looks like less is a disturbance of the clock.
const LEAST_EACH: f64 = 0.3;

/// A fixed part and one per emission.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Linear {
    /// Whatever the number.
    pub fixed: f64,
    /// Per emission.
    pub each: f64,
}

impl Linear {
    /// Through two points (emissions, cost), the first with fewer; neither part is below zero. Through a single one there is no fixed part, so
    /// that more emissions cost less than it says.
    pub(super) fn through(few: (f64, f64), many: (f64, f64)) -> Self {
        if few.0 >= many.0 {
            return Self { fixed: 0.0, each: many.1 / many.0 };
        }
        let each = ((many.1 - few.1) / (many.0 - few.0)).clamp(LEAST_EACH * many.1 / many.0, many.1 / many.0);
        Self { fixed: (many.1 - each * many.0).max(0.0), each }
    }

    /// At `emissions`.
    #[must_use]
    pub fn at(self, emissions: u64) -> f64 {
        self.fixed + self.each * emissions as f64
    }
}

/// How uncertain the parameters are that were `found` in a run of so many emissions and batches, where visibility rays have a `share` of
/// the variance.
pub(crate) fn spreads(
    found: &[Reading],
    emissions: u64,
    batches: u32,
    share: impl Fn(Parameter) -> f64,
) -> Vec<Spread> {
    let spread = |reading: &Reading| Spread {
        place: reading.place,
        value: reading.value,
        variance: split::parts(reading, batches, share(reading.place.parameter)),
        tail: pooled_kurtosis(found, reading.place.parameter) * emissions as f64 / f64::from(batches),
    };
    found.iter().map(spread).collect()
}
