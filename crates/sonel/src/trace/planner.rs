//! Plans of a trace: a pilot predicts the packets required.

use crate::study::evaluation_receivers::{FEW, evaluation_receivers};
use crate::study::forecast::Pilot;
use crate::study::pilot::{self, PilotConfig};
use crate::study::pipeline::Room;
use crate::study::plan;
use sonel_map::Settings;
use sonel_renderer::ReceiverPoint;
use sonel_tracer::PILOTS;

use crate::feasible::Demand;
use crate::observer::Watch;
use crate::{Error, Result};

/// Emissions from which on the cost of a run is measured beforehand: the few that tell it are then at most 1/32 of the run.
const SURELY_FEASIBLE: f64 = 32.0 * pilot::FEW as f64;
/// A vertex of a path in the map [bytes] (docs/formats).
const VERTEX_BYTES: f64 = 16.0;

/// Estimates the accuracy of runs at evaluation receivers.
pub(crate) struct Planner<'a> {
    /// The room.
    pub room: Room<'a>,
    /// Settings of the run.
    pub settings: Settings,
    /// Evaluation receivers.
    pub evaluation_receivers: Vec<ReceiverPoint>,
}

impl<'a> Planner<'a> {
    /// A planner for a run with `settings`.
    pub(super) fn new(room: Room<'a>, settings: Settings) -> Self {
        let evaluation_receivers = evaluation_receivers(room.scene(), room.geometry(), FEW);
        Self { room, settings, evaluation_receivers }
    }

    /// Looks at the first packets of the run, in so many CPU `seconds` where they are limited.
    pub(super) fn pilot(&self, seconds: Option<f64>, watch: Watch<'_>) -> Result<Pilot> {
        let (room, receivers) = (&self.room, &self.evaluation_receivers[..]);
        pilot::run(&PilotConfig { room, settings: self.settings, receivers, seconds }, watch.0)
    }

    /// Checks that a run of so many `emissions` takes no more than any run may, nor more memory [bytes] or time [s] than is `allowed`.
    /// Announces a large one.
    ///
    /// # Errors
    /// What it takes and what is allowed.
    pub(super) fn check_feasible(
        &self,
        emissions: f64,
        allowed: [Option<f64>; 2],
        watch: Watch<'_>,
    ) -> Result<()> {
        if emissions < SURELY_FEASIBLE && allowed[0].is_none() {
            return Ok(());
        }
        let sources = self.room.scene().sources.len() as f64;
        let begin = watch.clock().process();
        let segments = pilot::segments(&self.room, self.settings)?;
        let each = (watch.clock().process() - begin) / (pilot::FEW + PILOTS.iter().sum::<u64>()) as f64;
        let map_bytes = VERTEX_BYTES * segments * sources * emissions;
        let memory_bytes = VERTEX_BYTES * segments * plan::EMISSIONS_UNDER_WAY.min(emissions);
        let demand = Demand { cpu_seconds: each * emissions, map_bytes, memory_bytes };
        if let Some(excess) = demand.excess() {
            return Err(Error::Options(vec![format!(
                "`packets` {} is not feasible: {excess}. The whole run needs about: {demand}. Give fewer packets, or use `plan`",
                self.settings.emissions
            )]));
        }
        demand.admit(allowed, "give fewer packets", watch)
    }
}
