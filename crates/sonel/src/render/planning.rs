//! Plans of a rendering: some batches of the map predict the rays required, and the packets where rays do not help.

use sonel_echogram::Response;
use sonel_renderer::{Columns, MOST_RAYS, RenderSettings};

use crate::Result;
use crate::plan::Comparison;
use crate::study::evaluation_receivers::{MOST, some_of};
use crate::study::forecast::{Costs, Effort, Pilot};
use crate::study::job::Job;
use crate::study::plan::Plan;
use crate::study::spread::{PLANNED, readings};

/// Batches of the map over those that a plan renders: 16 of 32, whose standard errors scatter by a fifth. A rendering of the same receivers goes on
/// from them.
const PART_OF_BATCHES: u32 = 2;
/// Rays of the second look over those of the first, which separates their noise from that of packets.
const MORE_RAYS: u32 = 2;

/// The plan for rendering the map with `settings`: half of its batches are evaluated at the receivers or, of very many, some of them, twice
/// where rays are cast.
pub(super) fn plan(job: &Job<'_>, settings: &RenderSettings) -> Result<Plan> {
    let header = job.map.header();
    let (traced, scene) = (header.settings, &header.scene);
    let evaluation_receivers = some_of(job.receivers.to_vec(), MOST);
    let part = traced.batches.div_ceil(PART_OF_BATCHES);
    let rays = settings.rays(traced.emissions);
    let look = |rays| {
        let job = Job { batches: Some(part), receivers: &evaluation_receivers, ..*job };
        job.read(&RenderSettings { rays: Some(rays), ..settings.clone() }, &PLANNED)
    };
    let first = look(rays)?;
    let more = rays.saturating_mul(MORE_RAYS).min(MOST_RAYS);
    let second = (first.0.casts_rays && more > rays).then(|| look(more)).transpose()?;
    let (rendered, parameters) = second.as_ref().unwrap_or(&first);
    let share = f64::from(part) / f64::from(traced.batches);
    let of_part = |rays: u32| Effort {
        emissions: (share * traced.emissions as f64).ceil() as u64,
        rays: (share * f64::from(rays)).ceil() as u32,
        batches: part,
    };
    let (few, many) = (of_part(rays), of_part(rendered.effort.rays));
    let before = second.as_ref().map(|_| (few.rays, &first.1[..]));
    let saved = (rendered.seconds.sweep - first.0.seconds.sweep).max(0.0);
    let (all, sources) = (traced.emissions as f64, scene.sources.len() as f64);
    let costs = Costs {
        trace: 0.0,
        open: first.0.seconds.prepare / all,
        deterministic: rendered.seconds.deterministic,
        sweep: rendered.seconds.sweep / many.emissions as f64,
        ray: saved / f64::from((many.rays - few.rays).max(1)),
        bytes: job.map.byte_length() as f64 / all,
        segments: job.map.vertex_count() as f64 / (all * sources),
    };
    let columns = if settings.directions { Columns::DIRECTED } else { Columns::PLAIN };
    let pilot = Pilot { columns, costs, ..Pilot::of(before, parameters, &PLANNED, many) };
    let map = Effort { rays, ..Effort::of_trace(traced.emissions, traced.batches) };
    Ok(Plan::of_map(pilot, scene, &evaluation_receivers, job.receivers.len(), map, settings.bin))
}

/// Comparison of `plan` with a `response` that took this effort and CPU time.
pub(super) fn compare(plan: &Plan, effort: Effort, response: &Response, seconds: f64) -> Comparison {
    let found = readings(&sonel_analysis::some_parameters(response, &PLANNED), &PLANNED);
    Comparison { render: Some(seconds), ..Comparison::of_widths(&plan.pilot, effort, &found) }
}
