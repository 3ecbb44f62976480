//! Everything as one JSON object.

use serde_json::{Value, json};

use super::Findings;
use crate::tradeoff::errors::{self, Curve};
use crate::tradeoff::fit::Measured;
use crate::tradeoff::runs::SweepCell;
use crate::tradeoff::sweep::Setting;
use crate::tradeoff::verdict;

/// The sweep, its errors and what follows.
#[must_use]
pub fn json(findings: &Findings<'_>) -> Value {
    let tradeoff = findings.tradeoff;
    let sweep = &tradeoff.sweep;
    json!({
        "scene": tradeoff.scene,
        "packets": sweep.packets,
        "repeats": sweep.repeats,
        "seed": sweep.seed,
        "reference": match tradeoff.reference.packets {
            Some(packets) => json!({ "kind": "longest run", "packets": packets }),
            None => json!({ "kind": "exact" }),
        },
        "recommendation": verdict::recommendation(tradeoff, &findings.verdicts),
        "settings": (0..sweep.settings.len()).map(|index| setting(findings, index)).collect::<Vec<_>>(),
        "curves": findings.curves.iter().map(|one| curve(findings, one)).collect::<Vec<_>>(),
        "seconds": pairs(findings).map(|(index, packets)| seconds(findings, index, packets)).collect::<Vec<_>>(),
        "parameters": pairs(findings).flat_map(|(index, packets)| parameters(findings, index, packets)).collect::<Vec<_>>(),
    })
}

/// Settings and numbers of packets in order.
fn pairs<'a>(findings: &'a Findings<'_>) -> impl Iterator<Item = (usize, u64)> + 'a {
    let sweep = &findings.tradeoff.sweep;
    (0..sweep.settings.len())
        .flat_map(move |setting| sweep.packets.iter().map(move |&packets| (setting, packets)))
}

fn setting(findings: &Findings<'_>, index: usize) -> Value {
    let Setting { name, trace, render } = &findings.tradeoff.sweep.settings[index];
    let verdict = &findings.verdicts[index];
    let line = findings.seconds_per_packet(index);
    let mut value = json!({
        "name": name,
        "survival": trace.survival,
        "mode": format!("{:?}", trace.mode).to_lowercase(),
        "spectral": format!("{:?}", trace.spectral).to_lowercase(),
        "estimator": render.estimator.name(),
        "radius_m": render.gather_radius,
        "seconds_per_packet": measured(line.map(|line| line.slope), ONE_COUNT),
        "overhead_s": measured(line.map(|line| line.intercept), ONE_COUNT),
        "to_a_twentieth_jnd": {
            "arrives": verdict.arrives(),
            "cpu_s": measured(verdict.seconds, MISSING),
            "times_best": measured(verdict.times_best, NO_BEST),
            "packets": Some(verdict.packets).filter(|packets| packets.is_finite()),
            "biases": verdict.biases,
        },
    });
    if !verdict.packets.is_finite() {
        value["to_a_twentieth_jnd"]["reason"] = json!(MISSING);
    }
    if let Some(rays) = render.rays {
        value["rays"] = json!(rays);
    }
    value
}

/// Why a setting has no line through its seconds.
const ONE_COUNT: &str = "a line needs two numbers of packets";
/// Why a setting has no cost to an accuracy.
const MISSING: &str = "a parameter is refused in one of the runs or in the reference";
/// Why a setting cannot be compared with the best.
const NO_BEST: &str = "no setting reaches the aim, the best takes no time, or parameters are missing";
/// Why errors have no deviation.
const NO_SCATTER: &str = "nothing scatters, or too many parameters are refused";

fn curve(findings: &Findings<'_>, curve: &Curve) -> Value {
    json!({
        "setting": findings.name(curve.setting),
        "parameter": curve.parameter.key(),
        "unit": errors::unit(curve.parameter),
        "slope": measured(curve.slope(), NO_SCATTER),
        "efficiency": measured(curve.efficiency(), NO_SCATTER),
        "points": curve.points.iter().map(|point| json!({
            "packets": point.packets,
            "parameters": point.errors[0].len(),
            "figures_refused": point.refused,
            "cpu_s": point.mean_seconds(None),
            "standard_deviation": measured(point.measured_deviation(), NO_SCATTER),
            "bias": measured(point.bias(), NO_SCATTER),
            "efficiency": measured(point.efficiency(), NO_SCATTER),
        })).collect::<Vec<_>>(),
    })
}

fn seconds(findings: &Findings<'_>, index: usize, packets: u64) -> Value {
    let phases: serde_json::Map<String, Value> = findings
        .phases(index, packets)
        .into_iter()
        .map(|(name, mean)| (format!("{name}_s"), json!(mean)))
        .collect();
    let runs = findings.tradeoff.runs_of(index, packets);
    json!({
        "setting": findings.name(index),
        "packets": packets,
        "cpu_s": runs.iter().map(|run| run.seconds.total()).collect::<Vec<_>>(),
        "phases": phases,
    })
}

fn parameters(findings: &Findings<'_>, index: usize, packets: u64) -> Vec<Value> {
    let tradeoff = findings.tradeoff;
    let runs = tradeoff.runs_of(index, packets);
    let estimate = |(at, cell): (usize, &SweepCell)| {
        let found = errors::estimate(&runs, at);
        let missing = errors::missing(found.as_ref(), tradeoff.reference.values[at]);
        let mut value = json!({
            "setting": findings.name(index),
            "packets": packets,
            "source": cell.source,
            "receiver": cell.receiver,
            "center_frequency_hz": cell.center_frequency_hz,
            "parameter": cell.parameter.key(),
            "reference": tradeoff.reference.values[at].map(|(value, _)| value),
            "mean": measured(found.as_ref().map(|estimate| estimate.mean), missing.unwrap_or_default()),
            "standard_deviation": found.as_ref().map(|estimate| estimate.deviation),
            "stated_half_width": found.as_ref().and_then(|estimate| estimate.stated_half_width),
        });
        if let Some(missing) = missing {
            value["reason"] = json!(missing);
        }
        value
    };
    tradeoff.cells.iter().enumerate().map(estimate).collect()
}

/// A value with its interval, or why there is none: `missing`.
fn measured(measured: Option<Measured>, missing: &str) -> Value {
    let Some(Measured { value, interval }) = measured else {
        return json!({ "value": null, "ci95": null, "reason": missing });
    };
    match interval {
        Some(interval) => json!({ "value": value, "ci95": interval }),
        None => json!({ "value": value, "ci95": null, "reason": TOO_FEW }),
    }
}

/// Why a value has no interval.
const TOO_FEW: &str = "too few repeats or numbers of packets for an interval";
