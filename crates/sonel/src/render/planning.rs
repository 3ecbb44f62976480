//! Plans of a rendering: a pilot predicts the rays required.

use std::sync::Arc;

use crate::study::evaluation_receivers::some_of;
use crate::study::forecast::Effort;
use crate::study::pilot::{self, PilotConfig, SHARE_OF_TIME};
use crate::study::pipeline::Room;
use crate::study::plan::Plan;
use crate::study::spread::{PLANNED, readings};
use sonel_renderer::RenderSettings;

use crate::Result;
use crate::plan::Comparison;
use crate::render::job::{Job, Run};

/// The packets and batches of the map, rendered with the rays of `settings`.
pub(super) fn effort(job: &Job<'_>, settings: &RenderSettings) -> Effort {
    let traced = job.map.header().settings;
    Effort { emissions: traced.emissions, rays: settings.rays(traced.emissions), batches: traced.batches }
}

/// The plan for rendering the map with `settings`: its first packets are traced again and evaluated at the receivers or, of very many, some of them. Where all may take so many seconds, the pilot takes a part of them.
pub(super) fn plan(job: &Job<'_>, settings: &RenderSettings, at_most: Option<f64>) -> Result<Plan> {
    let header = job.map.header();
    let geometry = Arc::clone(job.geometry);
    let room = Room::within(&header.scene, geometry, header.effects.clone());
    let evaluation_receivers = some_of(job.receivers.to_vec());
    let config = PilotConfig {
        room: &room,
        trace: header.settings,
        render: settings.clone(),
        is_traced: true,
        receivers: &evaluation_receivers,
        parameters: &PLANNED,
        is_priced: true,
        seconds: at_most.map(|seconds| SHARE_OF_TIME * seconds),
    };
    let (pilot, _) = pilot::run(&config, job.watch.clock())?;
    let map = effort(job, settings);
    Ok(Plan::of_map(pilot, &header.scene, &evaluation_receivers, job.receivers.len(), map, settings.bin))
}

/// Comparison of `plan` with `run`; `opened` are the CPU seconds of opening the map.
pub(super) fn compare(plan: &Plan, job: &Job<'_>, run: &Run<'_>, opened: f64) -> Comparison {
    let found = readings(&sonel_analysis::parameters(&run.response), &PLANNED);
    Comparison {
        render: Some(opened + run.seconds),
        ..Comparison::of_widths(&plan.pilot, effort(job, &run.settings), &found)
    }
}
