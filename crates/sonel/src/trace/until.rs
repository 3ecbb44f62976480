//! `until`: adds packets until the targets are met.

use crate::study::forecast::Effort;
use crate::study::pilot::{Pilot, SHARE_OF_TIME};
use crate::study::pipeline::{MapStore, Rendered, render_and_read};
use crate::study::plan::{LEAST_PER_BATCH, Names};
use crate::study::spread::{Reading, readings};
use crate::study::target::Targets;
use crate::study::until::{MARGIN, Verdict, WORTH_WHILE};
use serde_json::json;
use sonel_map::{MapHeader, Settings, SonelMap};
use sonel_renderer::RenderSettings;

use crate::Result;
use crate::observer::Watch;
use crate::plan::{Comparison, overrun, reached, verdict, verdict_json};
use crate::trace::planner::Planner;
use crate::trace::{Finished, trace};

/// Segments of a run at the most, unless `packets` says how many: a map of about 4 GB.
const MOST_SEGMENTS: f64 = 2.7e8;

/// Share of the time left that an iteration is planned for [1]: prices are predictions. Chosen, not measured; at 1 half of the runs end late.
const RESERVE: f64 = 0.85;

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

/// Traces into `store` and evaluates, until the targets are kept or a bound is met, and says how far it came.
pub(super) fn until(
    planner: &Planner<'_>,
    header: &MapHeader,
    beginning: Option<&SonelMap>,
    goal: &Goal<'_>,
    store: &mut impl MapStore,
) -> Result<Finished> {
    let Goal { targets, watch, .. } = *goal;
    let names = Names::of(&header.scene, &planner.evaluation_receivers);
    let known = beginning.map_or(1, |map| map.header().settings.emissions);
    let Start { pilot, first, most } = start(planner, &header.settings, known, goal)?;
    let Effort { mut emissions, batches, .. } = first;
    let (mut iterations, mut trace_seconds) = (0, 0.0);
    let mut previous: Option<SonelMap> = None;
    let (traced, found, comparison, end) = loop {
        let (begin, cpu) = watch.seconds();
        let mut header = header.clone();
        header.settings.emissions = emissions;
        let known = previous.as_ref().or(beginning);
        let traced = trace(&header, planner.room.geometry(), known, store, watch)?;
        trace_seconds += watch.seconds().1 - cpu;
        drop(previous);
        let (found, figures, rendered) =
            evaluate(planner, &traced.map, &RenderSettings::default(), targets, watch)?;
        iterations += 1;
        watch.info(&format!("{emissions} packets: {}", verdict(&names, &found, targets)));
        let affordable = goal.seconds.map(|seconds| {
            affordable(seconds - watch.seconds().0, (watch.seconds().0 - begin) / emissions as f64)
        });
        let Some(next) = next_number(&found, emissions, most, affordable) else {
            let effort = Effort::of_trace(emissions, batches);
            let bytes = traced.map.byte_length();
            let comparison = compared(&pilot, effort, &figures, trace_seconds, &rendered, bytes);
            let end = why_ended(&found, emissions, most);
            break (traced, found, comparison, end);
        };
        (previous, emissions) = (Some(traced.map), next);
    };
    watch.info(&format!(
        "{} with {emissions} packets{end}: {targets}\n{}",
        reached(&found),
        comparison.line()
    ));
    if let Some(overrun) = overrun(goal.seconds, watch.seconds().0) {
        watch.info(&overrun);
    }
    let mut told = comparison.json();
    told["until"] = verdict_json(&names, &found, targets);
    told["until"]["packets"] = json!(emissions);
    told["until"]["rays"] = json!(Effort::of_trace(emissions, batches).rays);
    told["until"]["iterations"] = json!(iterations);
    Ok(Finished { traced, told, is_reached: Some(found.is_reached()) })
}

/// Begin of a run.
struct Start {
    pilot: Pilot,
    /// Packets traced first.
    first: Effort,
    /// Emissions at the most.
    most: u64,
}

/// Runs the pilot and chooses the first number of emissions, at least those `known`.
fn start(planner: &Planner<'_>, settings: &Settings, known: u64, goal: &Goal<'_>) -> Result<Start> {
    let Goal { targets, watch, .. } = *goal;
    let before_pilot = watch.seconds();
    let left = goal.seconds.map(|seconds| SHARE_OF_TIME * (seconds - before_pilot.0).max(0.0));
    let pilot = planner.pilot(&targets.parameters(), left, watch)?;
    let after_pilot = watch.seconds();
    // How many processors work for us: CPU seconds of the pilot per second by the clock.
    let processors = (after_pilot.1 - before_pilot.1) / (after_pilot.0 - before_pilot.0).max(1e-3);
    let batches = settings.batches;
    let need = pilot.need(targets, batches).effort;
    let most = goal.packets.unwrap_or((MOST_SEGMENTS / pilot.costs.segments.max(1.0)) as u64);
    watch.info(&format!(
        "{targets}: about {} packets needed (pilot of {} packets, {:.2} s)",
        need.emissions,
        pilot.emissions,
        after_pilot.0 - before_pilot.0
    ));
    let wanted = (need.emissions as f64 * MARGIN) as u64;
    let affordable = first_look(&pilot, Effort::of_trace(wanted, batches), goal, processors);
    let emissions = affordable.max(LEAST_PER_BATCH * u64::from(batches)).min(most).max(known);
    Ok(Start { pilot, first: Effort::of_trace(emissions, batches), most })
}

/// Emissions of `wanted` that are affordable by `processors`, where the seconds are limited.
fn first_look(pilot: &Pilot, wanted: Effort, goal: &Goal<'_>, processors: f64) -> u64 {
    let Effort { emissions, batches, .. } = wanted;
    let Some(seconds) = goal.seconds else { return emissions };
    let processor_seconds = RESERVE * (seconds - goal.watch.seconds().0) * processors;
    let cpu = |emissions| {
        let price = pilot.price(Effort::of_trace(emissions, batches));
        price.trace + price.render + pilot.costs.parameters * f64::from(batches)
    };
    let each = (cpu(1_000_000) - cpu(0)) / 1e6;
    emissions.min(affordable(processor_seconds - cpu(0), each))
}

/// Number of packets of `each` seconds in `seconds`.
fn affordable(seconds: f64, each: f64) -> u64 {
    (seconds / each).max(1.0) as u64
}

/// Number of packets of the next iteration, if there is one.
fn next_number(verdict: &Verdict, emissions: u64, most: u64, affordable: Option<u64>) -> Option<u64> {
    if verdict.is_inside() {
        return None;
    }
    let next = verdict.next(emissions).min(most).min(affordable.unwrap_or(u64::MAX));
    (next as f64 >= WORTH_WHILE * emissions as f64).then_some(next)
}

/// Limit that ended a run, in brackets.
fn why_ended(verdict: &Verdict, emissions: u64, most: u64) -> &'static str {
    if next_number(verdict, emissions, most, None).is_some() {
        " (time limit of `at_most`)"
    } else if next_number(verdict, emissions, u64::MAX, None).is_some() {
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
    Ok(compared(pilot, effort, &found, seconds, &rendered, map.byte_length()))
}

fn compared(
    pilot: &Pilot,
    effort: Effort,
    found: &[Reading],
    trace: f64,
    rendered: &Rendered,
    bytes: u64,
) -> Comparison {
    Comparison {
        trace: Some(trace),
        render: Some(rendered.seconds.total() - rendered.seconds.parameters),
        bytes: Some(bytes as f64),
        ..Comparison::of_widths(pilot, effort, found)
    }
}
