//! Plans of a rendering: a pilot predicts the rays required.

use sonel_echogram::Response;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;

use crate::Result;
use crate::plan::Comparison;
use crate::study::effort::Effort;
use crate::study::evaluation_receivers::some_of;
use crate::study::job::Job;
use crate::study::pilot::{self, PilotConfig, SHARE_OF_TIME};
use crate::study::pipeline::Room;
use crate::study::plan::Plan;
use crate::study::spread::{PLANNED, readings};

/// The plan for rendering the map with `settings`: its first packets are traced again and evaluated at the receivers or, of very many, some of them. Where all may take so many seconds, the pilot takes a part of them.
pub(super) fn plan(job: &Job<'_>, settings: &RenderSettings, at_most: Option<f64>) -> Result<Plan> {
    let header = job.map.header();
    let evaluation_receivers = some_of(job.receivers.to_vec());
    let config = PilotConfig {
        room: &Room::within(&header.scene, job.geometry, &header.effects),
        trace: header.settings,
        render: settings.clone(),
        is_traced: true,
        receivers: &evaluation_receivers,
        parameters: &PLANNED,
        is_priced: true,
        seconds: at_most.map(|seconds| SHARE_OF_TIME * seconds),
    };
    let (pilot, _) = pilot::run(&config, job.watch.0)?;
    let Settings { emissions, batches, .. } = header.settings;
    let map = Effort { emissions, rays: settings.rays(emissions), batches };
    Ok(Plan::of_map(pilot, &header.scene, &evaluation_receivers, job.receivers.len(), map, settings.bin))
}

/// Comparison of `plan` with a `response` that took this effort and CPU time.
pub(super) fn compare(plan: &Plan, effort: Effort, response: &Response, seconds: f64) -> Comparison {
    let found = readings(&sonel_analysis::parameters(response), &PLANNED);
    Comparison { render: Some(seconds), ..Comparison::of_widths(&plan.pilot, effort, &found) }
}
