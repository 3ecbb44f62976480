//! `until`: adds packets until the targets are met.

use serde_json::json;
use sonel_analysis::ReceiverParameters;
use sonel_map::{MapHeader, SonelMap};
use sonel_renderer::{ReceiverPoint, RenderSettings};

use crate::Result;
use crate::observer::Watch;
use crate::plan::Comparison;
use crate::study::evaluation_receivers::{MOST, evaluation_receivers};
use crate::study::forecast::{Effort, LEAST_PER_BATCH, Pilot};
use crate::study::job::Job;
use crate::study::pipeline::{MapStore, TracedMap, trace};
use crate::study::plan::Names;
use crate::study::spread::{PLANNED, readings};
use crate::study::target::Targets;
use crate::study::until::{TargetCheck, WORTH_WHILE};
use crate::trace::Finished;
use crate::trace::planner::Planner;
use crate::until::{Goal, Growing, Look};

/// Segments of a run at the most, unless `packets` says how many: a map of about 4 GB.
const MOST_SEGMENTS: f64 = 2.7e8;

/// Packets of the first iteration: 64 in each of 32 batches.
const FIRST: u64 = 2048;
/// Share of the time left that an iteration is planned for [1]: the machine may become busier. Chosen, not measured; at 1 half of the runs end
/// late.
const RESERVE: f64 = 0.6;

/// A run that goes on from the packets of the iteration before.
struct GrowingTrace<'a, S> {
    planner: &'a Planner<'a>,
    receivers: Vec<ReceiverPoint>,
    targets: &'a Targets,
    header: &'a MapHeader,
    beginning: Option<&'a SonelMap>,
    store: &'a mut S,
    watch: Watch<'a>,
    /// Emissions at the most, where somebody says so.
    most: Option<u64>,
}

impl<S: MapStore> Growing for GrowingTrace<'_, S> {
    type Run = TracedMap;

    fn run(
        &mut self,
        effort: Effort,
        before: Option<Look<TracedMap>>,
    ) -> Result<(TracedMap, Vec<ReceiverParameters>)> {
        let mut header = self.header.clone();
        header.settings.emissions = effort.emissions;
        let geometry = self.planner.room.geometry();
        let known = before.as_ref().map(|look| &look.run.map).or(self.beginning);
        let traced = trace(&header, geometry, known, self.store, self.watch.0)?;
        drop(before);
        let job = Job::of(&traced.map, geometry, &self.receivers, self.watch);
        let (_, parameters) = job.read(&RenderSettings::default(), &self.targets.parameters())?;
        Ok((traced, parameters))
    }

    fn next(&self, last: &Look<TracedMap>, growth: f64) -> Option<Effort> {
        let Effort { emissions, batches, .. } = last.effort;
        let segments = last.run.ledger.segments as f64 / emissions as f64;
        let most = self.most.unwrap_or((MOST_SEGMENTS / segments.max(1.0)) as u64);
        // An iteration costs no more than in proportion to its packets, and its price includes whatever else the machine does.
        let affordable = (RESERVE * growth * emissions as f64).max(0.0) as u64;
        next_number(&last.found, emissions, most, affordable)
            .map(|emissions| Effort::of_trace(emissions, batches))
    }

    fn in_words(&self, effort: Effort) -> String {
        format!("{} packets", effort.emissions)
    }

    fn limit(&self, last: &Look<TracedMap>) -> &'static str {
        let more = next_number(&last.found, last.effort.emissions, u64::MAX, u64::MAX);
        if more.is_some() { " (largest number, see `packets`)" } else { "" }
    }
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
    let receivers = evaluation_receivers(&header.scene, planner.room.geometry(), MOST);
    let names = Names::of(&header.scene, &receivers);
    let batches = header.settings.batches;
    let few = FIRST.max(LEAST_PER_BATCH * u64::from(batches)).min(goal.most.unwrap_or(u64::MAX));
    let first = beginning.map_or(few, |map| map.header().settings.emissions);
    let Goal { targets, most, watch, .. } = *goal;
    let mut run = GrowingTrace { planner, receivers, targets, header, beginning, store, watch, most };
    let (look, mut report) = crate::until::until(&mut run, Effort::of_trace(first, batches), &names, goal)?;
    report["packets"] = json!(look.effort.emissions);
    let is_reached = Some(look.found.is_reached());
    Ok(Finished { traced: look.run, extra: json!({ "until": report }), is_reached })
}

/// Number of packets of the next iteration, if there is one: worth while, or the last up to `most`.
fn next_number(check: &TargetCheck, emissions: u64, most: u64, affordable: u64) -> Option<u64> {
    let next = check.next(emissions).min(most).min(affordable);
    let is_last = next == most && next > emissions;
    let is_worth_while = next as f64 >= WORTH_WHILE * emissions as f64;
    (!check.is_inside() && (is_worth_while || is_last)).then_some(next)
}

/// Looks at a finished run that was planned; `seconds` are what the trace took of the processor.
pub(super) fn compare_planned(
    planner: &Planner<'_>,
    pilot: &Pilot,
    map: &SonelMap,
    seconds: f64,
    watch: Watch<'_>,
) -> Result<Comparison> {
    let job = Job::of(map, planner.room.geometry(), &planner.evaluation_receivers, watch);
    let (rendered, parameters) = job.read(&RenderSettings::default(), &PLANNED)?;
    let found = readings(&parameters, &PLANNED);
    let settings = map.header().settings;
    let effort = Effort::of_trace(settings.emissions, settings.batches);
    Ok(Comparison {
        trace: Some(seconds),
        render: Some(rendered.seconds.total() - rendered.seconds.parameters),
        bytes: Some(map.byte_length() as f64),
        ..Comparison::of_widths(pilot, effort, &found)
    })
}
