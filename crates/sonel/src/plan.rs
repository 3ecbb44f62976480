//! Plans, targets and results, as text and JSON.

use std::fmt::Write;

use crate::study::forecast::{Effort, Pilot, Price, Width};
use crate::study::plan::{Names, Plan, PlanRow};
use crate::study::spread::{HalfWidth, NoWidth, PLANNED, ParameterPlace, Reading};
use crate::study::target::Targets;
use crate::study::until::{TargetCheck, Worst};
use serde_json::{Value, json};
use sonel_analysis::Parameter;
use sonel_map::Settings;

use crate::feasible::Demand;
use crate::quantity::{bytes, count, seconds};

/// The table of a plan for a trace.
#[must_use]
pub fn trace_table(plan: &Plan) -> String {
    let mut text = String::from(
        "accuracy    packets      rays  trace CPU  render CPU        map  own memory  limited by\n",
    );
    for row in &plan.rows {
        let by = needed_by(plan, row);
        let _ = writeln!(
            text,
            "{:>4} JND {:>11} {:>9} {:>10} {:>11} {:>10} {:>11}  {by}",
            row.just_noticeable,
            count(row.effort.emissions),
            row.effort.rays,
            seconds(row.price.trace),
            seconds(row.price.render),
            bytes(row.price.bytes),
            bytes(row.memory[0].max(row.memory[1])),
        );
    }
    let default = Effort::of_trace(Settings::default().emissions, plan.pilot.effort.batches);
    let typical = |of: Parameter| Some((plan.pilot.typical(of, default)?, of.heading().0));
    if let Some((width, symbol)) = PLANNED.into_iter().filter_map(typical).max_by(|a, b| a.0.total_cmp(&b.0))
    {
        let packets = count(default.emissions);
        let _ = writeln!(
            text,
            "without `packets` a run takes {packets}: half-widths of {symbol}, the widest, are {width:.2} JND (geometric mean)"
        );
    }
    text + &widths(plan)
}

/// The table of a plan for rendering the map `label`, which has the packets of the plan's rows.
#[must_use]
pub fn map_table(plan: &Plan, label: &str) -> String {
    let packets = plan.rows.first().map_or(0, |row| row.effort.emissions);
    let mut text = format!("the map has {} packets", count(packets));
    if !plan.pilot.casts_rays {
        text.push_str("; it needs no visibility rays, so only packets help");
    }
    text.push_str("\naccuracy      rays  render CPU  own memory  packets wanted  limited by\n");
    for row in &plan.rows {
        let _ = writeln!(
            text,
            "{:>4} JND {:>9} {:>11} {:>11} {:>14}  {}",
            row.just_noticeable,
            row.effort.rays,
            seconds(row.price.render),
            bytes(row.memory[1]),
            row.lacking.map_or_else(|| "enough".to_owned(), count),
            needed_by(plan, row),
        );
    }
    if let Some((row, packets)) = plan.rows.iter().find_map(|row| Some((row, row.lacking?))) {
        let _ = writeln!(
            text,
            "for {} JND and below more packets are needed: {}",
            row.just_noticeable,
            extension(label, packets)
        );
    }
    text + &widths(plan)
}

/// Command that makes a map longer.
pub(crate) fn extension(label: &str, packets: u64) -> String {
    format!("sonel-trace SCENE.toml -o {label} --extend {label} --packets {packets}")
}

/// Message where more seconds were `spent` than `at_most` allows.
pub(crate) fn overrun(at_most: Option<f64>, spent: f64) -> Option<String> {
    let at_most = at_most.filter(|seconds| spent > *seconds)?;
    Some(format!("`at_most` {at_most} s is exceeded by {:.1} s", spent - at_most))
}

/// Why no run takes what a row asks for.
fn not_feasible(row: &PlanRow) -> Option<String> {
    let memory_bytes = row.memory[0].max(row.memory[1]);
    let cpu_seconds = row.price.trace.max(row.price.render);
    Demand { cpu_seconds, map_bytes: row.price.bytes, memory_bytes }.excess()
}

/// The parameter that decides a row, or why nobody should run it.
fn needed_by(plan: &Plan, row: &PlanRow) -> String {
    if let Some(excess) = not_feasible(row) {
        return format!("not feasible: {excess}");
    }
    row.limited_by.map_or_else(|| "the minimum is enough".to_owned(), |place| plan.names.parameter(place))
}

/// The half-widths of a plan, and which parameters have none.
fn widths(plan: &Plan) -> String {
    let mut text = String::from(
        "\nhalf-width of the 95 % interval (widest over evaluation receivers) and the range that holds 19 of 20 runs:\naccuracy      band",
    );
    for parameter in PLANNED {
        let (symbol, unit, _) = parameter.heading();
        let _ = write!(text, " {:>21}", format!("{symbol} [{unit}]"));
    }
    // Rows of the same packets and rays have the same widths.
    let mut rows = plan.rows.clone();
    rows.dedup_by_key(|row| row.effort);
    for row in &rows {
        for (frequency, widths) in plan.names.center_frequencies_hz.iter().zip(&row.widths) {
            let _ = write!(text, "\n{:>4} JND {frequency:>6} Hz", row.just_noticeable);
            for (width, parameter) in widths.iter().zip(PLANNED) {
                let (_, _, factor) = parameter.heading();
                let shown = width.map_or_else(
                    || "-".to_owned(),
                    |Width { expected, range: [low, high] }| {
                        format!("{:.3} ({:.3} … {:.3})", expected * factor, low * factor, high * factor)
                    },
                );
                let _ = write!(text, " {shown:>21}");
            }
        }
    }
    text.push('\n');
    for (place, reason) in plan.pilot.not_estimable() {
        let _ = writeln!(text, "{} cannot be estimated: {reason}", plan.names.parameter(place));
    }
    text
}

/// A plan as JSON.
#[must_use]
pub fn json(plan: &Plan) -> Value {
    let rows: Vec<Value> = plan
        .rows
        .iter()
        .map(|row| {
            let bands: Vec<Value> = plan
                .names
                .center_frequencies_hz
                .iter()
                .zip(&row.widths)
                .map(|(frequency, widths)| {
                    let mut band = json!({ "center_frequency_hz": frequency });
                    for (width, parameter) in widths.iter().zip(PLANNED) {
                        band[parameter.key()] = json!(width.map(|width| width.expected));
                        band["ranges"][parameter.key()] = json!(width.map(|width| width.range));
                    }
                    band
                })
                .collect();
            let mut fields = json!({
                "just_noticeable": row.just_noticeable,
                "packets": row.effort.emissions,
                "rays": row.effort.rays,
                "trace_cpu_s": row.price.trace,
                "render_cpu_s": row.price.render,
                "cpu_s": row.price.trace + row.price.render,
                "packets_wanted": row.lacking,
                "map_bytes": row.price.bytes,
                "trace_memory_bytes": row.memory[0],
                "render_memory_bytes": row.memory[1],
                "limited_by": row.limited_by.map(|place| named(&plan.names, place)),
                "half_widths": bands,
            });
            if let Some(excess) = not_feasible(row) {
                fields["not_feasible"] = json!(excess);
            }
            fields
        })
        .collect();
    let not_estimable = plan.pilot.not_estimable();
    let not_estimable = not_estimable.map(|(place, reason)| refused(&plan.names, place, reason));
    json!({
        "evaluation_receivers": plan.names.pairs.iter().map(|(source, name)| json!({"source": source, "receiver": name})).collect::<Vec<_>>(),
        "pilot": { "packets": plan.pilot.effort.emissions, "rays": plan.pilot.effort.rays, "segments_per_packet": plan.pilot.costs.segments },
        "rows": rows,
        "not_estimable": not_estimable.collect::<Vec<_>>(),
    })
}

/// Findings of an iteration on `targets`, in a line, in the units of the targets.
pub(crate) fn check_in_words(names: &Names, check: &TargetCheck, targets: &Targets) -> String {
    let of_worst = |worst: Worst| {
        let (limit, unit) = targets.written(worst.place.parameter)?;
        let (excess, name) = (worst.excess(), names.parameter(worst.place));
        Some(format!("{name} has a half-width of {:.4} {unit}, {excess:.2} times its limit", excess * limit))
    };
    let worst = check.worst.and_then(of_worst);
    let mut text = worst.unwrap_or_else(|| "no parameter has a limit".to_owned());
    if let Some((place, reason)) = check.not_estimable.first() {
        let _ = write!(text, "; {} cannot be estimated: {reason}", names.parameter(*place));
        if check.not_estimable.len() > 1 {
            let _ = write!(text, ", and {} others", check.not_estimable.len() - 1);
        }
    }
    text
}

/// Whether `targets` were reached, in a word.
pub(crate) fn reached(check: &TargetCheck) -> &'static str {
    if check.is_reached() { "reached" } else { "NOT reached" }
}

/// Findings of the last iteration on `targets`, as JSON.
pub(crate) fn check_json(names: &Names, check: &TargetCheck, targets: &Targets) -> Value {
    json!({
        "reached": check.is_reached(),
        "worst": check.worst.map(|worst| {
            let mut value = named(names, worst.place);
            value["half_width_jnd"] = json!(worst.half_width);
            value["limit_jnd"] = json!(worst.limit);
            value
        }),
        "not_estimable": check.not_estimable.iter().map(|(place, reason)| refused(names, *place, reason)).collect::<Vec<_>>(),
        "targets": targets.to_string(),
    })
}

/// Adds the fields of `more` to `object`.
pub(crate) fn extend(object: &mut Value, more: &Value) {
    for (key, value) in more.as_object().into_iter().flatten() {
        object[key] = value.clone();
    }
}

/// A parameter's place, as JSON.
pub(crate) fn named(names: &Names, place: ParameterPlace) -> Value {
    json!({
        "parameter": place.parameter.key(),
        "source": names.pairs[place.row].0,
        "receiver": names.pairs[place.row].1,
        "center_frequency_hz": names.center_frequencies_hz[place.band],
    })
}

/// A parameter that cannot be estimated for this `reason`, as JSON.
fn refused(names: &Names, place: ParameterPlace, reason: &NoWidth) -> Value {
    let mut value = named(names, place);
    value["reason"] = json!(reason.to_string());
    value
}

/// Prediction and outcome of a run; numbers that were not observed are none.
#[derive(Debug, Clone, Default)]
pub struct Comparison {
    /// Widest half-widths [JND] of parameters: predicted and achieved.
    pub widths: Vec<(Parameter, Width, f64)>,
    /// Predicted cost.
    pub predicted: Option<Price>,
    /// CPU seconds of the trace.
    pub trace: Option<f64>,
    /// CPU seconds of the rendering.
    pub render: Option<f64>,
    /// Bytes of the map.
    pub bytes: Option<f64>,
}

impl Comparison {
    /// The widest half-widths of the parameters that were `found`, against those that `pilot` says of `effort`.
    #[must_use]
    pub fn of_widths(pilot: &Pilot, effort: Effort, found: &[Reading]) -> Self {
        let mut widths: Vec<(Parameter, Width, f64)> = Vec::new();
        for parameter in found.iter().map(|reading| reading.place.parameter) {
            if widths.iter().all(|(known, ..)| *known != parameter)
                && let (Some(predicted), Some(achieved)) =
                    (pilot.widest(effort, parameter), widest(found, parameter))
            {
                widths.push((parameter, predicted, achieved));
            }
        }
        Self { widths, predicted: Some(pilot.price(effort)), ..Self::default() }
    }

    /// A line for the log: predicted against achieved.
    #[must_use]
    pub fn line(&self) -> String {
        let mut parts = Vec::new();
        if let Some(price) = self.predicted {
            let mut part = |name: &str, predicted: f64, achieved: Option<f64>, show: fn(f64) -> String| {
                if let Some(achieved) = achieved {
                    parts.push(format!("{name} {} / {}", show(predicted), show(achieved)));
                }
            };
            part("trace", price.trace, self.trace, seconds);
            part("render", price.render, self.render, seconds);
            part("map", price.bytes, self.bytes, bytes);
        }
        for (parameter, predicted, achieved) in &self.widths {
            let Width { expected, range: [low, high] } = predicted;
            let symbol = parameter.heading().0;
            parts.push(format!("{symbol} {expected:.3} ({low:.3} … {high:.3}) / {achieved:.3} JND"));
        }
        format!("predicted / achieved: {}", parts.join(", "))
    }

    /// The same as JSON.
    #[must_use]
    pub fn json(&self) -> Value {
        let widths = |pick: fn(&(Parameter, Width, f64)) -> Value| -> Value {
            self.widths.iter().map(|width| (width.0.key().to_owned(), pick(width))).collect()
        };
        json!({
            "predicted": {
                "trace_cpu_s": self.trace.and(self.predicted).map(|price| price.trace),
                "render_cpu_s": self.render.and(self.predicted).map(|price| price.render),
                "map_bytes": self.bytes.and(self.predicted).map(|price| price.bytes),
                "half_widths_jnd": widths(|width| json!(width.1.expected)),
                "ranges_jnd": widths(|width| json!(width.1.range)),
            },
            "achieved": {
                "trace_cpu_s": self.trace,
                "render_cpu_s": self.render,
                "map_bytes": self.bytes,
                "half_widths_jnd": widths(|width| json!(width.2)),
            },
        })
    }
}

/// The widest half-width [JND] of `parameter` among `readings`.
fn widest(readings: &[Reading], parameter: Parameter) -> Option<f64> {
    readings
        .iter()
        .filter(|reading| reading.place.parameter == parameter)
        .filter_map(|reading| reading.half_width.as_ref().ok().copied().map(HalfWidth::total))
        .reduce(f64::max)
}
