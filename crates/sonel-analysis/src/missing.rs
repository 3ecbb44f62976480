//! Truncation at the end of a run, and its effect on parameters.
//!
//! The tail that continues a record fits its last 10 dB at one receiver. The energy of packets at the end of the run is an
//! independent estimate of what arrives later, as the mean over the room. The true value is expected between half the
//! smaller and twice the larger of both; intervals include the parameters at both limits.

use crate::decay::{DecayCurve, Echogram};
use crate::estimate::{Estimate, ParameterValue, Unsupported};
use crate::parameter::{LevelScale, Values};
use crate::tail::Tail;

/// Factor up to which either of two guesses counts [1]. Chosen, not measured; doubled, bounds of what follows the record are twice as far apart.
const TRUST: f64 = 2.0;
/// Possible error above which a parameter is refused [JND]: half of the widest interval. Chosen, not measured; doubled, as much as that.
const MOST_JUST_NOTICEABLE: f64 = 5.0;
/// Possible error above which a parameter is warned of [JND]: below it nobody hears the difference.
const LEAST_WARNED: f64 = 0.5;
/// Possible error at the duration that messages propose [JND], a fifth of what is warned of. Chosen; doubled, durations are shorter by 3 dB of
/// decay.
const AIM: f64 = 0.1;

/// Readings with the least and the most that may follow the record.
#[derive(Debug)]
pub(crate) struct Bounds {
    ends: [Values; 2],
    /// End of the record, from the emission [s].
    end: f64,
    /// Slowest decay expected behind it [1/s].
    rate: f64,
}

impl Bounds {
    /// Bounds for a record that `fluence` [1/m²] follows, as far as the room is known, with the decay rate `rate` [1/s]. [`None`] where
    /// nothing follows. Without a curve the level alone can be read.
    #[must_use]
    pub(crate) fn new(
        echogram: Echogram<'_>,
        curve: &Result<DecayCurve, Unsupported>,
        (fluence, rate): (f64, f64),
        scale: Option<LevelScale>,
    ) -> Option<Self> {
        let (least, most, rate) = match curve {
            Ok(curve) => {
                let Tail { energy, rate: fitted, .. } = curve.tail();
                (energy.min(fluence) / TRUST, energy.max(fluence) * TRUST, rate.min(fitted))
            }
            Err(_) => (0.0, fluence * TRUST, rate),
        };
        let total = echogram.total();
        let read = |energy: f64, total: f64| {
            let curve = curve.as_ref().map(|curve| curve.with_tail(energy, rate)).map_err(Clone::clone);
            Values::of_curve(total, curve, scale)
        };
        // The level is that of the record: it can only be too low.
        let ends = [read(least, total), read(most, total + most)];
        (most > 0.0).then(|| Self { ends, end: *echogram.edges.last().unwrap_or(&0.0), rate })
    }
}

/// `parameter` with an interval that holds what `read` finds at both ends of `bounds`, one for each band that it is read from.
///
/// # Errors
/// [`Unsupported::CutOff`] where that is further away than a few times `just_noticeable`.
pub(crate) fn widened(
    estimate: Estimate,
    bounds: &[&Bounds],
    just_noticeable: f64,
    read: impl Fn(&[&Values]) -> Result<f64, Unsupported>,
) -> ParameterValue {
    let off = |end: usize| -> Result<f64, Unsupported> {
        let values: Vec<&Values> = bounds.iter().map(|bounds| &bounds.ends[end]).collect();
        Ok(read(&values)? - estimate.value)
    };
    let (end, rate) = bounds
        .iter()
        .fold((0.0_f64, f64::INFINITY), |(end, rate), bounds| (end.max(bounds.end), rate.min(bounds.rate)));
    let (least, most) = match (off(0), off(1)) {
        (Ok(first), Ok(second)) => (first.min(second).min(0.0), first.max(second).max(0.0)),
        // A range that one of the ends does not reach is not known to be reached.
        _ => (f64::NEG_INFINITY, f64::INFINITY),
    };
    let largest = most.max(-least) / just_noticeable;
    // What is missing falls with the decay: so does what it does to the parameter.
    let needed_s = end + libm::log(largest.min(FARTHEST) / AIM).max(0.0) / rate;
    if largest > MOST_JUST_NOTICEABLE {
        return Err(Unsupported::CutOff { end_s: end, needed_s });
    }
    let interval = estimate.interval.map(|[low, high]| [low + least, high + most]);
    let cut_off = (largest > LEAST_WARNED).then(|| {
        format!(
            "the run ends at {end:.2} s, before the decay: the missing part may change this by {largest:.1} just-noticeable differences, included in the interval; set duration_s to {needed_s:.2} or more"
        )
    });
    Ok(Estimate { interval, ..estimate }.warned(cut_off))
}

/// Error that stands for a parameter without a value [JND]: any number above those that are refused.
const FARTHEST: f64 = 1000.0;
