//! `--until`: adds sonels until the targets are met.

use std::io::Write;

use sonel_console::Stopwatch;
use sonel_console::clock::CpuClock;
use sonel_console::output::Output;
use sonel_console::plan::{Comparison, Names};
use sonel_console::progress::Audience;
use sonel_map::{MapHeader, SonelMap};
use sonel_renderer::RenderSettings;
use sonel_study::forecast::Effort;
use sonel_study::pilot::{Pilot, SHARE_OF_TIME};
use sonel_study::pipeline::{Rendered, render_and_read};
use sonel_study::plan::{LEAST_PER_BATCH, pairs};
use sonel_study::spread::{Reading, readings};
use sonel_study::target::Targets;
use sonel_study::until::{MARGIN, Verdict, WORTH_WHILE};

use crate::planning::Planner;
use crate::{Traced, trace};

/// Segments of a run at the most, unless --sonels says how many: a map of about 4 GB.
const MOST_SEGMENTS: f64 = 2.7e8;

/// The part of the time left that a first look is planned for: prices are predictions.
const RESERVE: f64 = 0.85;

/// A run that was judged.
pub struct Judged {
    /// The map.
    pub traced: Traced,
    /// What was found of the targets.
    pub verdict: Verdict,
    /// What was predicted and what came of it.
    pub comparison: Comparison,
    /// Visibility rays with which the targets are kept.
    pub rays: u32,
    /// How often the parameters were looked at.
    pub looks: u32,
}

/// What a run goes on for, and how far.
pub struct Goal<'a> {
    /// How certain the parameters shall be.
    pub targets: &'a Targets,
    /// Emissions at the most, where somebody says so.
    pub sonels: Option<u64>,
    /// Seconds by the clock, where somebody says so.
    pub seconds: Option<f64>,
    /// Runs since the program began.
    pub watch: &'a Stopwatch,
    /// Who follows the progress.
    pub audience: Audience<'a>,
}

/// Traces and looks, until the targets are kept or a bound is met.
pub fn until(
    planner: &Planner<'_>,
    header: &MapHeader,
    beginning: Option<SonelMap>,
    goal: &Goal<'_>,
    create: &dyn Fn() -> anyhow::Result<Output>,
    log: &mut dyn Write,
) -> anyhow::Result<Judged> {
    let Goal { targets, watch, .. } = *goal;
    let parameters = targets.parameters();
    let pairs = pairs(&header.scene, &planner.evaluation_receivers);
    let names = Names { pairs: &pairs, center_frequencies_hz: header.scene.bands.nominal() };
    let before_pilot = watch.seconds();
    let left = goal.seconds.map(|seconds| SHARE_OF_TIME * (seconds - before_pilot.0).max(0.0));
    let pilot = planner.pilot(&parameters, left)?;
    let after_pilot = watch.seconds();
    // How many processors work for us: CPU seconds of the pilot per second by the clock.
    let processors = (after_pilot.1 - before_pilot.1) / (after_pilot.0 - before_pilot.0).max(1e-3);
    let batches = header.settings.batches;
    let need = pilot.need(targets, batches, RenderSettings::default().rays).effort;
    let most = goal.sonels.unwrap_or((MOST_SEGMENTS / pilot.costs.segments.max(1.0)) as u64);
    let known = beginning.as_ref().map_or(1, |map| map.header().settings.emissions);
    writeln!(
        log,
        "{targets}: about {} sonels and {} rays needed (pilot of {} sonels, {:.2} s)",
        need.emissions,
        need.rays,
        pilot.emissions,
        after_pilot.0 - before_pilot.0
    )?;
    let wanted = Effort { emissions: (need.emissions as f64 * MARGIN) as u64, ..need };
    let Effort { emissions, rays, .. } = first_look(&pilot, wanted, goal, processors);
    let mut emissions = emissions.max(LEAST_PER_BATCH * u64::from(batches)).min(most).max(known);
    let (mut looks, mut trace_seconds) = (0, 0.0);
    let mut previous: Option<(Output, SonelMap)> = None;
    let mut beginning = beginning;
    loop {
        let (begin, cpu) = watch.seconds();
        let mut header = header.clone();
        header.settings.emissions = emissions;
        let known = previous.as_ref().map(|(_, map)| map).or(beginning.as_ref());
        let mut traced = trace(header, planner.room.geometry(), known, create()?, goal.audience)?;
        trace_seconds += watch.seconds().1 - cpu;
        beginning = None;
        drop(previous);
        let map = SonelMap::open(traced.output.file()?)?;
        let (verdict, found, rendered) = look(planner, &map, targets, rays)?;
        looks += 1;
        writeln!(log, "{emissions} sonels: {}", names.verdict(&verdict))?;
        let next = next_number(
            &verdict,
            emissions,
            most,
            goal.seconds.map(|seconds| {
                affordable(seconds - watch.seconds().0, (watch.seconds().0 - begin) / emissions as f64)
            }),
        );
        let Some(next) = next else {
            let effort = Effort { emissions, rays, batches };
            let comparison = compared(&pilot, effort, &found, (trace_seconds, &rendered), map.byte_length());
            return Ok(Judged { traced, verdict, comparison, rays, looks });
        };
        previous = Some((traced.output, map));
        emissions = next;
    }
}

/// What is affordable of `wanted` by `processors`, where the seconds are limited.
fn first_look(pilot: &Pilot, wanted: Effort, goal: &Goal<'_>, processors: f64) -> Effort {
    let Some(seconds) = goal.seconds else { return wanted };
    let Effort { emissions, mut rays, batches } = wanted;
    let processor_seconds = RESERVE * (seconds - goal.watch.seconds().0) * processors;
    let cpu = |emissions, rays| {
        let price = pilot.price(Effort { emissions, rays, batches });
        price.trace + price.render + pilot.costs.parameters * f64::from(batches)
    };
    // Rays are paid for before the first sonel: no more than half of the time may go to them.
    while rays > RenderSettings::default().rays && cpu(0, rays) > 0.5 * processor_seconds {
        rays /= 2;
    }
    let each = (cpu(1_000_000, rays) - cpu(0, rays)) / 1e6;
    Effort { emissions: emissions.min(affordable(processor_seconds - cpu(0, rays), each)), rays, batches }
}

/// How many sonels of so many seconds `each` there are in `seconds`.
fn affordable(seconds: f64, each: f64) -> u64 {
    (seconds / each).max(1.0) as u64
}

/// How many sonels the next look has, if there is one.
fn next_number(verdict: &Verdict, emissions: u64, most: u64, affordable: Option<u64>) -> Option<u64> {
    if verdict.is_inside() {
        return None;
    }
    let next = verdict.next(emissions).min(most).min(affordable.unwrap_or(u64::MAX));
    (next as f64 >= WORTH_WHILE * emissions as f64).then_some(next)
}

/// Looks at the parameters of `map`.
fn look(
    planner: &Planner<'_>,
    map: &SonelMap,
    targets: &Targets,
    rays: u32,
) -> anyhow::Result<(Verdict, Vec<Reading>, Rendered)> {
    let settings = RenderSettings { rays, ..RenderSettings::default() };
    let rendered =
        render_and_read(map, planner.room.geometry(), &planner.evaluation_receivers, &settings, &CpuClock)?;
    let found = readings(&rendered.parameters, &targets.parameters());
    Ok((Verdict::new(&found, targets), found, rendered))
}

/// Looks at a finished run that was planned.
pub fn compare_planned(
    planner: &Planner<'_>,
    pilot: &Pilot,
    traced: &mut Traced,
    seconds: f64,
) -> anyhow::Result<Comparison> {
    let map = SonelMap::open(traced.output.file()?)?;
    let (_, found, rendered) = look(planner, &map, &Targets::just_noticeable(1.0), pilot.asked_rays)?;
    let settings = traced.header.settings;
    let effort = Effort { emissions: settings.emissions, rays: pilot.asked_rays, batches: settings.batches };
    Ok(compared(pilot, effort, &found, (seconds, &rendered), map.byte_length()))
}

fn compared(
    pilot: &Pilot,
    effort: Effort,
    found: &[Reading],
    (trace, rendered): (f64, &Rendered),
    bytes: u64,
) -> Comparison {
    Comparison {
        trace: Some(trace),
        render: Some(rendered.seconds.total() - rendered.seconds.parameters),
        bytes: Some(bytes as f64),
        ..Comparison::of_widths(pilot, effort, found)
    }
}
