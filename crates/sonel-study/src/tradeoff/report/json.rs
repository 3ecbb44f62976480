//! Everything as one JSON object.

use serde_json::{Value, json};

use super::Findings;
use super::csv::pairs;
use crate::tradeoff::errors::{self, Curve};
use crate::tradeoff::fit::Measured;
use crate::tradeoff::runs::Cell;
use crate::tradeoff::sweep::{Setting, estimator_name};
use crate::tradeoff::verdict;

/// The sweep, its errors and what follows.
#[must_use]
pub fn json(findings: &Findings<'_>) -> Value {
    let tradeoff = findings.tradeoff;
    let sweep = &tradeoff.sweep;
    json!({
        "scene": tradeoff.scene,
        "sonels": sweep.sonels,
        "repeats": sweep.repeats,
        "seed": sweep.seed,
        "reference": match tradeoff.reference.sonels {
            Some(sonels) => json!({ "kind": "longest run", "sonels": sonels }),
            None => json!({ "kind": "exact" }),
        },
        "recommendation": verdict::recommendation(tradeoff, &findings.verdicts),
        "settings": (0..sweep.settings.len()).map(|index| setting(findings, index)).collect::<Vec<_>>(),
        "curves": findings.curves.iter().map(|one| curve(findings, one)).collect::<Vec<_>>(),
        "seconds": pairs(findings).map(|(index, sonels)| seconds(findings, index, sonels)).collect::<Vec<_>>(),
        "figures": pairs(findings).flat_map(|(index, sonels)| figures(findings, index, sonels)).collect::<Vec<_>>(),
    })
}

fn setting(findings: &Findings<'_>, index: usize) -> Value {
    let Setting { name, trace, render } = &findings.tradeoff.sweep.settings[index];
    let verdict = &findings.verdicts[index];
    let line = findings.seconds_per_sonel(index);
    json!({
        "name": name,
        "survival": trace.survival,
        "mode": format!("{:?}", trace.mode).to_lowercase(),
        "spectral": format!("{:?}", trace.spectral).to_lowercase(),
        "estimator": estimator_name(render.estimator),
        "rays": render.rays,
        "radius_m": render.gather_radius,
        "seconds_per_sonel": line.map(|line| measured(Some(line.slope))),
        "overhead_s": line.map(|line| measured(Some(line.intercept))),
        "to_a_twentieth_jnd": {
            "arrives": verdict.arrives(),
            "cpu_s": measured(verdict.seconds),
            "times_best": measured(verdict.times_best),
            "sonels": Some(verdict.sonels).filter(|sonels| sonels.is_finite()),
            "biases": verdict.biases,
        },
    })
}

fn curve(findings: &Findings<'_>, curve: &Curve) -> Value {
    json!({
        "setting": findings.name(curve.setting),
        "parameter": curve.parameter.key(),
        "unit": errors::unit(curve.parameter),
        "slope": measured(curve.slope()),
        "efficiency": measured(curve.efficiency()),
        "points": curve.points.iter().map(|point| json!({
            "sonels": point.sonels,
            "figures": point.errors[0].len(),
            "figures_refused": point.refused,
            "cpu_s": point.mean_seconds(None),
            "standard_deviation": measured(point.measured_deviation()),
            "bias": measured(point.bias()),
            "efficiency": measured(point.efficiency()),
        })).collect::<Vec<_>>(),
    })
}

fn seconds(findings: &Findings<'_>, index: usize, sonels: u64) -> Value {
    let phases: serde_json::Map<String, Value> = findings
        .phases(index, sonels)
        .into_iter()
        .map(|(name, mean)| (format!("{name}_s"), json!(mean)))
        .collect();
    let runs = findings.tradeoff.runs_of(index, sonels);
    json!({
        "setting": findings.name(index),
        "sonels": sonels,
        "cpu_s": runs.iter().map(|run| run.seconds.total()).collect::<Vec<_>>(),
        "phases": phases,
    })
}

fn figures(findings: &Findings<'_>, index: usize, sonels: u64) -> Vec<Value> {
    let tradeoff = findings.tradeoff;
    let runs = tradeoff.runs_of(index, sonels);
    let figure = |(at, cell): (usize, &Cell)| {
        let found = errors::figure(&runs, at);
        json!({
            "setting": findings.name(index),
            "sonels": sonels,
            "source": cell.source,
            "receiver": cell.receiver,
            "center_frequency_hz": cell.center_frequency_hz,
            "parameter": cell.parameter.key(),
            "reference": tradeoff.reference.values[at].map(|(value, _)| value),
            "mean": measured(found.as_ref().map(|figure| figure.mean)),
            "standard_deviation": found.as_ref().map(|figure| figure.deviation),
            "stated_half_width": found.as_ref().and_then(|figure| figure.stated_half_width),
        })
    };
    tradeoff.cells.iter().enumerate().map(figure).collect()
}

fn measured(measured: Option<Measured>) -> Value {
    json!({ "value": measured.map(|m| m.value), "ci95": measured.and_then(|m| m.interval) })
}
