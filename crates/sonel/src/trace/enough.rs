//! Number of packets of a run where nobody states it: that of the row of a plan for half a just-noticeable difference.
//!
//! A pilot looks at the first packets of the run, with the materials of the scene, and the run continues them: its bytes are those of a run with
//! as many packets.

use crate::study::effort::Effort;
use crate::study::findings::Pilot;
use crate::study::pipeline::{MapStore, trace};
use crate::study::plan::{ACCURACY, Names};
use crate::study::render_need::RenderNeed;
use serde_json::json;
use sonel_map::{MapHeader, Mode, Settings};

use crate::Result;
use crate::observer::Watch;
use crate::plan::named;
use crate::quantity::count;
use crate::trace::planner::Planner;
use crate::trace::{Finished, TraceOptions};

/// Whether `options` leave the number of packets to the run. Another map has decided about it for `extend` and `decision`, and shards do not
/// know of each other.
pub(super) fn decides(options: &TraceOptions<'_>) -> bool {
    let TraceOptions { packets, shard, extend, decision, mode, .. } = options;
    packets.is_none()
        && shard.is_none()
        && extend.is_none()
        && decision.is_none()
        && *mode != Some(Mode::Paper)
}

/// Traces as many packets as are enough into `store`, those of `header` at most.
pub(super) fn enough(
    planner: &Planner<'_>,
    header: &MapHeader,
    options: &TraceOptions<'_>,
    store: &mut impl MapStore,
    watch: Watch<'_>,
) -> Result<Finished> {
    let Settings { emissions: most, batches, .. } = header.settings;
    let (pilot, known) = planner.pilot(false, None, watch)?;
    let need = pilot.typical_need(ACCURACY, batches);
    let emissions = need.effort.emissions.min(most).max(pilot.emissions);
    planner.check_feasible(emissions as f64, [options.memory, options.at_most], watch)?;
    let settings = Settings { emissions, ..header.settings };
    let header = MapHeader { settings, ..header.clone() };
    let traced = trace(&header, planner.room.geometry(), Some(&known), store, watch.0)?;
    let names = Names::of(&header.scene, &planner.evaluation_receivers);
    let expected = Expected { pilot: &pilot, need, effort: Effort::of_trace(emissions, batches) };
    watch.info(&expected.in_words(&names))?;
    let widest = need.limited_by.map(|place| {
        let mut value = named(&names, place);
        value["expected_half_width_jnd"] = json!(pilot.typical(place.parameter, expected.effort));
        value
    });
    let told = json!({
        "packets": emissions, "packets_looked_at": pilot.emissions, "limit_jnd": ACCURACY, "widest": widest,
    });
    Ok(Finished { traced, told: json!({ "enough": told }), is_reached: None })
}

/// What a pilot says of a run.
struct Expected<'a> {
    pilot: &'a Pilot,
    need: RenderNeed,
    effort: Effort,
}

impl Expected<'_> {
    fn in_words(&self, names: &Names) -> String {
        let Self { pilot, need, effort } = self;
        let packets = count(effort.emissions);
        let Some(place) = need.limited_by else {
            return format!(
                "{packets} packets: half-widths are expected to be below {ACCURACY} JND (root mean square)"
            );
        };
        let [typical, widest] = [
            pilot.typical(place.parameter, *effort),
            pilot.widest(*effort, place.parameter).map(|width| width.expected),
        ]
        .map(Option::unwrap_or_default);
        let (symbol, ..) = place.parameter.heading();
        let limit = if need.effort.emissions > effort.emissions { ", the default limit" } else { "" };
        format!(
            "{packets} packets{limit}: half-widths of {symbol}, which needs most, are expected to be {typical:.2} JND (root mean square), {widest:.2} JND for {}; {} JND takes about {} `packets`, see `plan`",
            names.parameter(place),
            0.5 * ACCURACY,
            count(pilot.typical_need(0.5 * ACCURACY, effort.batches).effort.emissions)
        )
    }
}
