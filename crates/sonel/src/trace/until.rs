//! `until`: adds packets until the targets are met.

use crate::study::forecast::Effort;
use crate::study::pilot::{FIRST, Pilot};
use crate::study::pipeline::{MapStore, Rendered, render_and_read};
use crate::study::plan::{LEAST_PER_BATCH, Names};
use crate::study::spread::{Reading, readings};
use crate::study::target::Targets;
use crate::study::until::{Verdict, WORTH_WHILE};
use serde_json::json;
use sonel_map::{MapHeader, SonelMap};
use sonel_renderer::RenderSettings;

use crate::Result;
use crate::observer::Watch;
use crate::plan::{Comparison, overrun, reached, verdict, verdict_json};
use crate::trace::planner::Planner;
use crate::trace::{Finished, trace};

/// Segments of a run at the most, unless `packets` says how many: a map of about 4 GB.
const MOST_SEGMENTS: f64 = 2.7e8;

/// Share of the time left that an iteration is planned for [1]: the machine may become busier. Chosen, not measured; at 1 half of the runs end
/// late.
const RESERVE: f64 = 0.6;

/// Targets and limits of a run.
pub(super) struct Goal<'a> {
    /// Targets of the parameters.
    pub targets: &'a Targets,
    /// Emissions at the most, where somebody says so.
    pub packets: Option<u64>,
    /// Seconds by the clock, where somebody says so.
    pub seconds: Option<f64>,
    /// Observer.
    pub watch: Watch<'a>,
}

/// Traces into `store` and evaluates, until the targets are kept or a bound is met, and says how far it came. The first iteration has the packets of
/// `beginning` or few; each continues those before.
pub(super) fn until(
    planner: &Planner<'_>,
    header: &MapHeader,
    beginning: Option<&SonelMap>,
    goal: &Goal<'_>,
    store: &mut impl MapStore,
) -> Result<Finished> {
    let Goal { targets, watch, .. } = *goal;
    let names = Names::of(&header.scene, &planner.evaluation_receivers);
    let batches = header.settings.batches;
    let first = FIRST.max(LEAST_PER_BATCH * u64::from(batches)).min(goal.packets.unwrap_or(u64::MAX));
    let mut emissions = beginning.map_or(first, |map| map.header().settings.emissions);
    let mut iterations = 0;
    let mut previous: Option<SonelMap> = None;
    let (traced, found, end) = loop {
        let begin = watch.seconds().0;
        let mut header = header.clone();
        header.settings.emissions = emissions;
        let known = previous.as_ref().or(beginning);
        let traced = trace(&header, planner.room.geometry(), known, store, watch)?;
        drop(previous);
        let (found, ..) = evaluate(planner, &traced.map, &RenderSettings::default(), targets, watch)?;
        iterations += 1;
        watch.info(&format!("{emissions} packets: {}", verdict(&names, &found, targets)));
        let segments = traced.ledger.segments as f64 / emissions as f64;
        let most = goal.packets.unwrap_or((MOST_SEGMENTS / segments.max(1.0)) as u64);
        let now = watch.seconds().0;
        // An iteration costs no more than in proportion to its packets, and its price includes whatever else the machine does.
        let affordable = goal.seconds.map_or(f64::INFINITY, |seconds| {
            emissions as f64 * RESERVE * (seconds - now).max(0.0) / (now - begin).max(1e-3)
        });
        let Some(next) = next_number(&found, emissions, most, affordable as u64) else {
            let end = why_ended(&found, emissions, most);
            break (traced, found, end);
        };
        (previous, emissions) = (Some(traced.map), next);
    };
    watch.info(&format!("{} with {emissions} packets{end}: {targets}", reached(&found)));
    if let Some(overrun) = overrun(goal.seconds, watch.seconds().0) {
        watch.info(&overrun);
    }
    let mut told = verdict_json(&names, &found, targets);
    told["packets"] = json!(emissions);
    told["rays"] = json!(Effort::of_trace(emissions, batches).rays);
    told["iterations"] = json!(iterations);
    Ok(Finished { traced, told: json!({ "until": told }), is_reached: Some(found.is_reached()) })
}

/// Number of packets of the next iteration, if there is one: worth while, or the last up to `most`.
fn next_number(verdict: &Verdict, emissions: u64, most: u64, affordable: u64) -> Option<u64> {
    let next = verdict.next(emissions).min(most).min(affordable);
    let is_last = next == most && next > emissions;
    let is_worth_while = next as f64 >= WORTH_WHILE * emissions as f64;
    (!verdict.is_inside() && (is_worth_while || is_last)).then_some(next)
}

/// Limit that ended a run, in brackets.
fn why_ended(verdict: &Verdict, emissions: u64, most: u64) -> &'static str {
    if next_number(verdict, emissions, most, u64::MAX).is_some() {
        " (time limit of `at_most`)"
    } else if next_number(verdict, emissions, u64::MAX, u64::MAX).is_some() {
        " (largest number, see `packets`)"
    } else {
        ""
    }
}

/// Looks at the parameters of `map` rendered with `settings`.
pub(super) fn evaluate(
    planner: &Planner<'_>,
    map: &SonelMap,
    settings: &RenderSettings,
    targets: &Targets,
    watch: Watch<'_>,
) -> Result<(Verdict, Vec<Reading>, Rendered)> {
    let receivers = &planner.evaluation_receivers;
    let rendered = render_and_read(map, planner.room.geometry(), receivers, settings, watch.clock())?;
    let found = readings(&rendered.parameters, &targets.parameters());
    Ok((Verdict::new(&found, targets), found, rendered))
}

/// Looks at a finished run that was planned; `seconds` are what the trace took of the processor.
pub(super) fn compare_planned(
    planner: &Planner<'_>,
    pilot: &Pilot,
    map: &SonelMap,
    seconds: f64,
    watch: Watch<'_>,
) -> Result<Comparison> {
    let (settings, targets) = (RenderSettings::default(), Targets::just_noticeable(1.0));
    let (_, found, rendered) = evaluate(planner, map, &settings, &targets, watch)?;
    let settings = map.header().settings;
    let effort = Effort::of_trace(settings.emissions, settings.batches);
    Ok(Comparison {
        trace: Some(seconds),
        render: Some(rendered.seconds.total() - rendered.seconds.parameters),
        bytes: Some(map.byte_length() as f64),
        ..Comparison::of_widths(pilot, effort, &found)
    })
}
