//! `until`: adds packets until the targets are met.

use serde_json::json;
use sonel_analysis::ReceiverParameters;
use sonel_map::{MapHeader, Settings, SonelMap};
use sonel_renderer::RenderSettings;

use crate::Result;
use crate::observer::Watch;
use crate::plan::Comparison;
use crate::study::effort::Effort;
use crate::study::pilot::{Pilot, SHARE_OF_TIME};
use crate::study::pipeline::{MapStore, RenderedMap, TracedMap, render_and_read, trace};
use crate::study::plan::{LEAST_PER_BATCH, Names};
use crate::study::spread::{Reading, readings};
use crate::study::target::Targets;
use crate::study::until::{MARGIN, Verdict, WORTH_WHILE};
use crate::trace::Finished;
use crate::trace::planner::Planner;
use crate::until::{Goal, Growing, Look};

/// Segments of a run at the most, unless `packets` says how many: a map of about 4 GB.
const MOST_SEGMENTS: f64 = 2.7e8;

/// Share of the time left that an iteration is planned for [1]: prices are predictions. Chosen, not measured; at 1 half of the runs end late.
const RESERVE: f64 = 0.85;

/// A run that goes on from the packets of the iteration before.
struct Run<'a, S> {
    planner: &'a Planner<'a>,
    header: &'a MapHeader,
    beginning: Option<&'a SonelMap>,
    store: &'a mut S,
    watch: Watch<'a>,
    /// Emissions at the most.
    most: u64,
    /// CPU seconds of tracing.
    seconds: f64,
}

impl<S: MapStore> Growing for Run<'_, S> {
    type Run = (TracedMap, RenderedMap);

    fn run(
        &mut self,
        effort: Effort,
        before: Option<Look<Self::Run>>,
    ) -> Result<(Self::Run, Vec<ReceiverParameters>)> {
        let begin = self.watch.seconds().1;
        let mut header = self.header.clone();
        header.settings.emissions = effort.emissions;
        let geometry = self.planner.room.geometry();
        let known = before.as_ref().map(|look| &look.run.0.map).or(self.beginning);
        let traced = trace(&header, geometry, known, self.store, self.watch.0)?;
        self.seconds += self.watch.seconds().1 - begin;
        drop(before);
        let (settings, receivers) = (RenderSettings::default(), &self.planner.evaluation_receivers);
        let (rendered, parameters) =
            render_and_read(&traced.map, geometry, receivers, &settings, self.watch.0)?;
        Ok(((traced, rendered), parameters))
    }

    fn next(&self, last: &Look<Self::Run>, growth: f64) -> Option<Effort> {
        let Effort { emissions, batches, .. } = last.effort;
        let most = self.most.min((emissions as f64 * growth).max(0.0) as u64);
        next_number(&last.found, emissions, most).map(|emissions| Effort::of_trace(emissions, batches))
    }

    fn in_words(&self, effort: Effort) -> String {
        format!("{} packets", effort.emissions)
    }

    fn limit(&self, last: &Look<Self::Run>) -> &'static str {
        let more = next_number(&last.found, last.effort.emissions, u64::MAX);
        if more.is_some() { " (largest number, see `packets`)" } else { "" }
    }
}

/// Traces into `store` and evaluates, until the targets are kept or a bound is met, and says how far it came.
pub(super) fn until(
    planner: &Planner<'_>,
    header: &MapHeader,
    beginning: Option<&SonelMap>,
    goal: &Goal<'_>,
    store: &mut impl MapStore,
) -> Result<Finished> {
    let watch = goal.watch;
    let names = Names::of(&header.scene, &planner.evaluation_receivers);
    let known = beginning.map_or(1, |map| map.header().settings.emissions);
    let Start { pilot, first, most } = start(planner, &header.settings, known, goal)?;
    let mut run = Run { planner, header, beginning, store, watch, most, seconds: 0.0 };
    let (look, mut until) = crate::until::until(&mut run, first, &names, goal)?;
    let (traced, rendered) = look.run;
    let bytes = traced.map.byte_length();
    let comparison = compared(&pilot, look.effort, &look.readings, run.seconds, &rendered, bytes);
    watch.info(&comparison.line())?;
    until["packets"] = json!(look.effort.emissions);
    let mut told = comparison.json();
    told["until"] = until;
    Ok(Finished { traced, told, is_reached: Some(look.found.is_reached()) })
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
    let most = goal.most.unwrap_or((MOST_SEGMENTS / pilot.costs.segments.max(1.0)) as u64);
    watch.info(&format!(
        "{targets}: about {} packets needed (pilot of {} packets, {:.2} s)",
        need.emissions,
        pilot.emissions,
        after_pilot.0 - before_pilot.0
    ))?;
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

/// Number of packets of the next iteration, `most` at the most, if there is one that is worth while.
fn next_number(verdict: &Verdict, emissions: u64, most: u64) -> Option<u64> {
    let next = verdict.next(emissions).min(most);
    (!verdict.is_inside() && next as f64 >= WORTH_WHILE * emissions as f64).then_some(next)
}

/// Looks at the parameters of `map` rendered with `settings`.
pub(super) fn evaluate(
    planner: &Planner<'_>,
    map: &SonelMap,
    settings: &RenderSettings,
    targets: &Targets,
    watch: Watch<'_>,
) -> Result<(Verdict, Vec<Reading>, RenderedMap)> {
    let receivers = &planner.evaluation_receivers;
    let (rendered, parameters) = render_and_read(map, planner.room.geometry(), receivers, settings, watch.0)?;
    let found = readings(&parameters, &targets.parameters());
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
    rendered: &RenderedMap,
    bytes: u64,
) -> Comparison {
    Comparison {
        trace: Some(trace),
        render: Some(rendered.seconds.total() - rendered.seconds.parameters),
        bytes: Some(bytes as f64),
        ..Comparison::of_widths(pilot, effort, found)
    }
}
