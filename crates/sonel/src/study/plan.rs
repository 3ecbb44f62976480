//! Numbers of packets and rays for an accuracy (just-noticeable differences or targets), before a trace or before a rendering.

use sonel_map::CHUNK_EMISSIONS;
use sonel_renderer::ReceiverPoint;
use sonel_scene::Scene;
use sonel_tracer::CHUNKS_IN_FLIGHT;

use crate::study::forecast::{Effort, Need, Pilot, Price, Width};
use crate::study::memory::{PROGRAM, RenderLoad};
use crate::study::spread::{PLANNED, ParameterPlace};
use crate::study::target::Targets;

/// Accuracies of a plan's rows [JND]: from what is just heard to the 0.05 of comparisons between variants.
pub const STEPS: [f64; 5] = [1.0, 0.5, 0.2, 0.1, 0.05];

/// A plan, accuracy by accuracy.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Pilot that it rests on.
    pub pilot: Pilot,
    /// Names of the parameters.
    pub names: Names,
    /// One for each of [`STEPS`].
    pub rows: Vec<PlanRow>,
}

/// Effort for an accuracy.
#[derive(Debug, Clone)]
pub struct PlanRow {
    /// The accuracy [JND].
    pub just_noticeable: f64,
    /// Packets and rays.
    pub effort: Effort,
    /// Which parameter needs them, where it is least certain; none where the minimum is enough.
    pub limited_by: Option<ParameterPlace>,
    /// Packets of a map that has this accuracy, where that at hand has it with no number of rays.
    pub lacking: Option<u64>,
    /// CPU seconds and bytes.
    pub price: Price,
    /// Own memory of trace and render, without the pages of the map [bytes].
    pub memory: [f64; 2],
    /// Widest 95 % half-width over the evaluation receivers, in the parameter's own unit, by band and [`PLANNED`]; none where it cannot be read.
    pub widths: Vec<[Option<Width>; PLANNED.len()]>,
}

impl Plan {
    /// The plan for a trace of `scene`, evaluated at `evaluation_receivers`, in `batches` batches, with bins of `bin` [s].
    #[must_use]
    pub fn of_trace(
        pilot: Pilot,
        scene: &Scene,
        evaluation_receivers: &[ReceiverPoint],
        batches: u32,
        bin: f64,
    ) -> Self {
        let rows = STEPS.map(|step| {
            let need = pilot.typical_need(step, batches);
            PlanRow::new(step, need, &pilot, scene, evaluation_receivers.len(), bin)
        });
        Self { names: Names::of(scene, evaluation_receivers), rows: rows.into(), pilot }
    }

    /// The plan for rendering a map of `scene` with the packets and batches of `map` at `receivers` receivers, evaluated at `evaluation_receivers`,
    /// with bins of `bin` [s].
    #[must_use]
    pub fn of_map(
        pilot: Pilot,
        scene: &Scene,
        evaluation_receivers: &[ReceiverPoint],
        receivers: usize,
        map: Effort,
        bin: f64,
    ) -> Self {
        let pilot = pilot.rendered_at(receivers, evaluation_receivers.len());
        let rows = STEPS.map(|step| {
            let render_need = pilot.render_need(&Targets::just_noticeable(step), map);
            PlanRow::new(step, render_need, &pilot, scene, receivers, bin)
        });
        Self { names: Names::of(scene, evaluation_receivers), rows: rows.into(), pilot }
    }
}

/// Names of the parameters of a rendering.
#[derive(Debug, Clone)]
pub struct Names {
    /// Source and receiver of every row of parameters.
    pub pairs: Vec<(String, String)>,
    /// Band centres [Hz].
    pub center_frequencies_hz: Vec<f64>,
}

impl Names {
    /// The names of parameters at `receivers` in `scene`.
    #[must_use]
    pub fn of(scene: &Scene, receivers: &[ReceiverPoint]) -> Self {
        let pair = |source: &str, receiver: &ReceiverPoint| (source.to_owned(), receiver.name.clone());
        let sources = scene.sources.iter();
        let pairs = sources.flat_map(|source| receivers.iter().map(|receiver| pair(&source.name, receiver)));
        Self { pairs: pairs.collect(), center_frequencies_hz: scene.bands.nominal().to_vec() }
    }

    /// A parameter in words: "T30 at seat 12, 125 Hz".
    #[must_use]
    pub fn parameter(&self, place: ParameterPlace) -> String {
        let (symbol, ..) = place.parameter.heading();
        format!("{symbol} at {}, {} Hz", self.pairs[place.row].1, self.center_frequencies_hz[place.band])
    }
}

impl PlanRow {
    fn new(
        just_noticeable: f64,
        need: Need,
        pilot: &Pilot,
        scene: &Scene,
        receivers: usize,
        bin: f64,
    ) -> Self {
        let Need { effort, limited_by, lacking } = need;
        let widths = |band| PLANNED.map(|parameter| pilot.widest_in_band(effort, band, parameter));
        Self {
            just_noticeable,
            effort,
            limited_by,
            lacking,
            price: pilot.price(effort),
            memory: [trace_memory(pilot, effort), pilot.load().memory(effort, scene, receivers, bin)],
            widths: (0..scene.bands.count()).map(widths).collect(),
        }
    }
}

/// Most emissions in memory: chunks under way while as many are written.
pub const EMISSIONS_UNDER_WAY: f64 = (2 * CHUNKS_IN_FLIGHT * CHUNK_EMISSIONS) as f64;

/// Own memory of a trace [bytes]: chunks under way.
fn trace_memory(pilot: &Pilot, effort: Effort) -> f64 {
    PROGRAM + pilot.costs.bytes * EMISSIONS_UNDER_WAY.min(effort.emissions as f64)
}

impl Pilot {
    fn load(&self) -> RenderLoad {
        let Self { columns, casts_rays, .. } = *self;
        RenderLoad { columns, casts_rays, segments: self.costs.segments }
    }
}
