//! Number of packets of a run where nobody states it: enough for half a just-noticeable difference.
//!
//! The first packets of the run are rendered at the evaluation receivers, without edges, which bring no noise. Half-widths shrink as 1/√N;
//! the widest, with the materials of the scene or others that the map is to carry, tells how many packets are enough, at most [`Settings::default`]'s. Where that is far from the packets that were looked at,
//! more of them are looked at first. The run continues the packets that are there, so its bytes are those of a run with as many packets.

use crate::study::pipeline::{InMemory, MapStore, trace};
use crate::study::plan::{LEAST_PER_BATCH, Names};
use crate::study::target::Targets;
use crate::study::until::{MARGIN, Verdict, Worst};
use serde_json::{Value, json};
use sonel_map::{MapHeader, Mode, Settings, SonelMap};
use sonel_renderer::RenderSettings;

use crate::Result;
use crate::observer::Watch;
use crate::plan::named;
use crate::quantity::count;
use crate::trace::planner::Planner;
use crate::trace::until::evaluate;
use crate::trace::{Finished, TraceOptions};

/// Widest half-width of level, T30, EDT and C80 [JND]: nobody notices a difference between two runs.
const WIDEST: f64 = 0.5;
/// Packets of the first look: 64 in each of 32 batches. Five of eight shipped scenes need more than twice as many.
const FIRST: u64 = 2048;
/// Factor from the packets of a look to those it may ask for [1]: the half-widths of 32 batches err by 13 %, those of few packets by more,
/// as paths are missing that carry much.
const FARTHEST: u64 = 8;

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
    store: &mut impl MapStore,
    watch: Watch<'_>,
) -> Result<Finished> {
    let with = |emissions| {
        let settings = Settings { emissions, ..header.settings };
        MapHeader { settings, ..header.clone() }
    };
    let geometry = planner.room.geometry();
    let Settings { emissions: most, batches, .. } = header.settings;
    let targets = Targets::just_noticeable(WIDEST);
    let edgeless = RenderSettings { edges: false, ..RenderSettings::default() };
    let mut looked_at = FIRST.max(LEAST_PER_BATCH * u64::from(batches)).min(most);
    let mut known: Option<SonelMap> = None;
    let others = header.scene.other_materials();
    let need = loop {
        let map = trace(&with(looked_at), geometry, known.as_ref(), &mut InMemory, watch.0)?.map;
        let look = |map: &SonelMap| -> Result<Need> {
            let (found, ..) = evaluate(planner, map, &edgeless, &targets, watch)?;
            Ok(Need::of(found, looked_at))
        };
        let mut need = look(&map)?;
        for materials in &others {
            let mut changed = map.clone();
            changed.change(materials.clone(), header.scene.sources.clone());
            // Another set of transmitting walls has other faces, of which this geometry knows nothing.
            if changed.header().scene.has_faces_of(&header.scene) {
                let other = Need { is_variant: true, ..look(&changed)? };
                need = if other.packets > need.packets { other } else { need };
            }
        }
        known = Some(map);
        let next = (FARTHEST * looked_at).min(most);
        if need.packets <= next || need.packets > FARTHEST * most || next == most {
            break need;
        }
        looked_at = next;
    };
    let emissions = need.packets.clamp(looked_at, most);
    let traced = trace(&with(emissions), geometry, known.as_ref(), store, watch.0)?;
    let names = Names::of(&header.scene, &planner.evaluation_receivers);
    watch.info(&need.in_words(emissions, &names))?;
    let told = json!({ "enough": need.json(emissions, &names) });
    Ok(Finished { traced, told, is_reached: None })
}

/// The number rounded up to two digits, which are easily typed again.
fn two_digits(number: u64) -> u64 {
    let unit = 10_u64.pow(number.max(1).ilog10().saturating_sub(1));
    number.div_ceil(unit).saturating_mul(unit)
}

/// Finding of a look.
struct Need {
    /// Packets that were looked at.
    looked_at: u64,
    /// Widest half-width among those that can be estimated.
    worst: Option<Worst>,
    /// Packets that are enough.
    packets: u64,
    /// Whether other materials than those of the scene need most.
    is_variant: bool,
}

impl Need {
    fn of(found: Verdict, looked_at: u64) -> Self {
        let excess = found.worst.map_or(0.0, |worst| worst.excess());
        let packets = MARGIN * excess * excess * looked_at as f64;
        // What cannot be estimated may be so with more packets.
        let least =
            if found.not_estimable.is_empty() { 0.0 } else { (FARTHEST * FARTHEST * looked_at) as f64 };
        let packets = two_digits(packets.max(least).ceil() as u64);
        Self { looked_at, worst: found.worst, packets, is_variant: false }
    }

    /// Widest half-width expected with `emissions` packets [JND]; none where these are the most and fewer than needed, of which few packets
    /// tell little.
    fn expected(&self, emissions: u64) -> Option<f64> {
        let worst = self.worst.filter(|_| emissions >= self.packets)?;
        Some(worst.half_width * (self.looked_at as f64 / emissions as f64).sqrt())
    }

    fn in_words(&self, emissions: u64, names: &Names) -> String {
        let packets = count(emissions);
        let variant = if self.is_variant { " with other materials" } else { "" };
        let of = |worst: Worst| format!("; {}{variant} needs most", names.parameter(worst.place));
        let widest = self.worst.map_or_else(String::new, of);
        let Some(width) = self.expected(emissions) else {
            return format!(
                "{packets} packets, the default limit: some half-widths will exceed {WIDEST} JND{widest}; `plan` tells what more `packets` bring"
            );
        };
        let better = MARGIN * 4.0 * (width / WIDEST) * (width / WIDEST) * emissions as f64;
        format!(
            "{packets} packets: half-widths are expected to be within {width:.2} JND{widest}; {} JND takes about {} `packets`",
            0.5 * WIDEST,
            count(two_digits(better as u64))
        )
    }

    fn json(&self, emissions: u64, names: &Names) -> Value {
        json!({
            "packets": emissions,
            "packets_looked_at": self.looked_at,
            "limit_jnd": WIDEST,
            "widest": self.worst.map(|worst| {
                let mut value = named(names, worst.place);
                value["expected_half_width_jnd"] = json!(self.expected(emissions));
                value["with_other_materials"] = self.is_variant.into();
                value
            }),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_packets_have_two_digits() {
        assert_eq!([0, 7, 99, 100, 101, 2301, 36_800].map(two_digits), [0, 7, 99, 100, 110, 2400, 37_000]);
    }
}
