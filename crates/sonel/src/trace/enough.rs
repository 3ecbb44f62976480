//! Number of packets of a run where nobody states it: the geometric mean of 32 000, 32 000 and those that a plan needs for half a
//! just-noticeable difference.
//!
//! A pilot looks at the first packets of the run, with the materials of the scene, and the run continues them: its bytes are those of a run with
//! as many packets.

use crate::study::forecast::{ACCURACY, Effort, Need, Pilot};
use crate::study::pipeline::{MapStore, trace};
use crate::study::plan::Names;
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
    let emissions = pilot.balanced(need.effort.emissions, most);
    planner.check_feasible(emissions as f64, [options.memory, options.at_most], watch)?;
    let settings = Settings { emissions, ..header.settings };
    let header = MapHeader { settings, ..header.clone() };
    let traced = trace(&header, planner.room.geometry(), Some(&known), store, watch.0)?;
    let effort = Effort::of_trace(emissions, batches);
    let names = Names::of(&header.scene, &planner.evaluation_receivers);
    watch.info(&in_words(&pilot, &need, effort, &names))?;
    let widest = need.limited_by.map(|place| {
        let mut value = named(&names, place);
        value["expected_half_width_jnd"] = json!(pilot.typical(place.parameter, effort));
        value["kept_half_width_jnd"] = json!(pilot.kept(place.parameter, effort));
        value
    });
    let looked_at = pilot.effort.emissions;
    let told = json!({
        "packets": emissions, "packets_looked_at": looked_at, "limit_jnd": ACCURACY, "widest": widest,
    });
    Ok(Finished { traced, told: json!({ "enough": told }), is_reached: None })
}

/// What a pilot says of a run of this `effort`.
fn in_words(pilot: &Pilot, need: &Need, effort: Effort, names: &Names) -> String {
    let packets = count(effort.emissions);
    let Some(place) = need.limited_by else {
        return format!(
            "{packets} packets: half-widths are expected to be below {ACCURACY} JND (geometric mean)"
        );
    };
    let [typical, kept] = [pilot.typical(place.parameter, effort), pilot.kept(place.parameter, effort)]
        .map(Option::unwrap_or_default);
    let (symbol, ..) = place.parameter.heading();
    format!(
        "{packets} packets: half-widths of {symbol}, which needs most ({}), are expected to be {typical:.2} JND (geometric mean), in nine of ten runs within {kept:.2} JND; {ACCURACY} JND takes about {} `packets`, see `plan`",
        names.parameter(place),
        count(need.effort.emissions)
    )
}
