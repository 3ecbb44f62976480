//! Numbers of packets and rays for an accuracy (just-noticeable differences or targets), before a trace or before a rendering.

use sonel_analysis::Parameter;
use sonel_map::CHUNK_EMISSIONS;
use sonel_renderer::ReceiverPoint;
use sonel_scene::Scene;
use sonel_tracer::CHUNKS_IN_FLIGHT;

use crate::study::effort::Effort;
use crate::study::findings::{Pilot, Spread};
use crate::study::forecast::{Price, least_within, two_digits_up};
use crate::study::memory::{PROGRAM, RenderLoad};
use crate::study::render_need::RenderNeed;
use crate::study::spread::{HalfWidth, PLANNED, Place, unit};
use crate::study::target::Targets;

/// Accuracies of a plan's rows [JND]: from what is just heard to the 0.05 of comparisons between variants.
pub const STEPS: [f64; 5] = [1.0, 0.5, 0.2, 0.1, 0.05];
/// Accuracy of runs whose number of packets nobody states [JND].
pub const ACCURACY: f64 = 0.5;
/// Fewest emissions of a batch: fewer make no estimate of their own. Chosen, not measured; doubled, the smallest run is twice as long.
pub const LEAST_PER_BATCH: u64 = 32;
/// Most emissions of a plan: their map would have about a petabyte.
const MOST_EMISSIONS: u64 = 1_000_000_000_000;

/// A plan, accuracy by accuracy.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Pilot that it rests on.
    pub pilot: Pilot,
    /// Names of the parameters.
    pub names: Names,
    /// One for each of [`STEPS`].
    pub rows: Vec<Row>,
}

/// Effort for an accuracy.
#[derive(Debug, Clone)]
pub struct Row {
    /// The accuracy [JND].
    pub just_noticeable: f64,
    /// Packets and rays.
    pub effort: Effort,
    /// Which parameter needs them, where it is least certain; none where the minimum is enough.
    pub limited_by: Option<Place>,
    /// Packets of a map that has this accuracy, where that at hand has it with no number of rays.
    pub lacking: Option<u64>,
    /// CPU seconds and bytes.
    pub price: Price,
    /// Own memory of trace and render, without the pages of the map [bytes].
    pub memory: [f64; 2],
    /// Widest 95 % half-width over the evaluation receivers, in the parameter's own unit, by band and [`PLANNED`]; none where it cannot be read.
    pub widths: Vec<[Option<Width>; PLANNED.len()]>,
}

/// Half of a 95 % interval that is predicted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
    /// Expected half-width, in the parameter's own unit.
    pub expected: f64,
    /// Between which bounds it is found in 19 of 20 runs ([`Pilot::range`]).
    pub range: [f64; 2],
}

impl Pilot {
    /// Effort that keeps `targets` in `batches` batches.
    #[must_use]
    pub fn need(&self, targets: &Targets, batches: u32) -> RenderNeed {
        let least = Effort::of_trace(LEAST_PER_BATCH * u64::from(batches), batches);
        let mut need = RenderNeed { effort: least, limited_by: None, lacking: None };
        for spread in &self.spreads {
            let Some(limit) = targets.limit(spread.place, spread.value) else { continue };
            if self.exceeds(spread, need.effort, limit) {
                let fewest = fewest(need.effort.emissions, |emissions| {
                    self.exceeds(spread, Effort::of_trace(emissions, batches), limit)
                });
                need.effort = Effort::of_trace(two_digits_up(fewest), batches);
                need.limited_by = Some(spread.place);
            }
        }
        need
    }

    /// Effort in `batches` batches with which every parameter has a [`Self::typical`] half-width of `limit` [JND] at most. Emissions are one of
    /// six numbers a decade, so that most seeds lead to the same.
    #[must_use]
    pub fn typical_need(&self, limit: f64, batches: u32) -> RenderNeed {
        let effort = |emissions| Effort::of_trace(emissions, batches);
        let least = LEAST_PER_BATCH * u64::from(batches);
        let mut need = RenderNeed { effort: effort(least), limited_by: None, lacking: None };
        for parameter in PLANNED {
            let exceeds =
                |emissions| self.typical(parameter, effort(emissions)).is_some_and(|width| width > limit);
            if exceeds(need.effort.emissions) {
                need.effort = effort(six_a_decade_up(fewest(need.effort.emissions, exceeds)));
                need.limited_by = self.least_certain(parameter, need.effort);
            }
        }
        need
    }

    /// Root of the mean square over bands and evaluation receivers of the half-widths of `parameter` [JND]; none where none can be read. It
    /// scatters less between seeds than the widest one does.
    #[must_use]
    pub fn typical(&self, parameter: Parameter, effort: Effort) -> Option<f64> {
        let widths = self.of_parameter(parameter).filter_map(|spread| self.half_width(spread, effort).ok());
        let squares: Vec<f64> = widths.map(|width| width.total() * width.total()).collect();
        (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    }

    /// Where `parameter` has its widest half-width.
    fn least_certain(&self, parameter: Parameter, effort: Effort) -> Option<Place> {
        let width = |spread: &&Spread| self.half_width(spread, effort).map_or(0.0, HalfWidth::total);
        let widest = self.of_parameter(parameter).max_by(|a, b| width(a).total_cmp(&width(b)));
        widest.map(|spread| spread.place)
    }

    /// Whether half of the interval of `spread` is wider than `limit`.
    pub(crate) fn exceeds(&self, spread: &Spread, effort: Effort, limit: f64) -> bool {
        self.half_width(spread, effort).is_ok_and(|width| width.total() > limit)
    }
}

/// The least number of emissions from `least` on that does not exceed a limit.
fn fewest(least: u64, exceeds: impl Fn(u64) -> bool) -> u64 {
    let (mut low, mut high) = (least, least);
    while exceeds(high) && high < MOST_EMISSIONS {
        (low, high) = (high, 2 * high);
    }
    least_within(low, high, 1000, exceeds)
}

/// The next of the numbers 1, 1.5, 2.2, 3.2, 4.6 and 6.8 times a power of ten.
fn six_a_decade_up(number: u64) -> u64 {
    let steps = |unit: u64| [10, 15, 22, 32, 46, 68, 100].map(|step| step * unit);
    let mut unit = 1;
    while steps(unit)[6] < number {
        unit *= 10;
    }
    steps(unit).into_iter().find(|&step| step >= number).unwrap_or(number)
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
            Row::new(step, need, &pilot, scene, evaluation_receivers.len(), bin)
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
            Row::new(step, render_need, &pilot, scene, receivers, bin)
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
    pub fn parameter(&self, place: Place) -> String {
        let (symbol, ..) = place.parameter.heading();
        format!("{symbol} at {}, {} Hz", self.pairs[place.row].1, self.center_frequencies_hz[place.band])
    }
}

impl Row {
    fn new(
        just_noticeable: f64,
        render_need: RenderNeed,
        pilot: &Pilot,
        scene: &Scene,
        receivers: usize,
        bin: f64,
    ) -> Self {
        let RenderNeed { effort, limited_by, lacking } = render_need;
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

impl Pilot {
    /// Widest half-width of `parameter` in `band` over the evaluation receivers, in its own unit; none where it cannot be read.
    #[must_use]
    pub fn widest_in_band(&self, effort: Effort, band: usize, parameter: Parameter) -> Option<Width> {
        let here = self.of_parameter(parameter).filter(|spread| spread.place.band == band);
        here.filter_map(|spread| Some(self.width(spread, effort)?.times(unit(parameter, spread.value?))))
            .reduce(Width::wider)
    }

    /// Widest half-width of `parameter` over bands and evaluation receivers, in just-noticeable differences; none where it cannot be read.
    #[must_use]
    pub fn widest(&self, effort: Effort, parameter: Parameter) -> Option<Width> {
        self.of_parameter(parameter).filter_map(|spread| self.width(spread, effort)).reduce(Width::wider)
    }

    fn of_parameter(&self, parameter: Parameter) -> impl Iterator<Item = &Spread> {
        self.spreads.iter().filter(move |spread| spread.place.parameter == parameter)
    }

    fn width(&self, spread: &Spread, effort: Effort) -> Option<Width> {
        let expected = self.half_width(spread, effort).ok()?.total();
        Some(Width { expected, range: self.range(spread, effort).ok()? })
    }
}

impl Width {
    fn times(self, unit: f64) -> Self {
        Self { expected: unit * self.expected, range: self.range.map(|bound| unit * bound) }
    }

    /// The wider of two predictions.
    fn wider(self, other: Self) -> Self {
        let [low, high] = [0, 1].map(|bound: usize| self.range[bound].max(other.range[bound]));
        Self { expected: self.expected.max(other.expected), range: [low, high] }
    }
}

/// Most emissions in memory: chunks under way while as many are written.
pub const EMISSIONS_UNDER_WAY: f64 = (2 * CHUNKS_IN_FLIGHT * CHUNK_EMISSIONS) as f64;

/// Own memory of a trace [bytes]: chunks under way.
fn trace_memory(pilot: &Pilot, effort: Effort) -> f64 {
    PROGRAM + pilot.costs.bytes.each * EMISSIONS_UNDER_WAY.min(effort.emissions as f64)
}

impl Pilot {
    fn load(&self) -> RenderLoad {
        let Self { columns, casts_rays, .. } = *self;
        RenderLoad { columns, casts_rays, segments: self.costs.segments }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::study::findings::Costs;
    use crate::study::split::Variance;
    use crate::study::spread::student_factor;

    /// A pilot of 10 000 emissions whose only parameter has a σ of 0.1 JND, from packets and rays as given.
    pub(crate) fn pilot(packets: f64, rays: f64) -> Pilot {
        let variance = Variance { packets, areas: 0.0, rays, bias: 0.0 };
        let place = Place { row: 0, band: 0, parameter: Parameter::T30 };
        let spreads = vec![Spread { place, value: Some(2.0), variance: Ok(variance), tail: 0.0 }];
        let costs = Costs { segments: 40.0, ..Costs::default() };
        Pilot {
            emissions: 10_000,
            batches: 96,
            rays: 2500,
            casts_rays: rays > 0.0,
            columns: sonel_renderer::Columns::PLAIN,
            spreads,
            costs,
        }
    }

    #[test]
    fn a_tenth_of_the_width_takes_a_hundred_times_the_sonels() {
        let pilot = pilot(0.01, 0.0);
        let wide = pilot.need(&Targets::just_noticeable(0.2), 32).effort.emissions as f64;
        let narrow = pilot.need(&Targets::just_noticeable(0.02), 32).effort.emissions as f64;
        assert!((wide / (10_000.0 * (0.1 * student_factor(32) / 0.2).powi(2)) - 1.0).abs() < 0.1, "{wide}");
        assert!((narrow / wide / 100.0 - 1.0).abs() < 0.1, "{narrow} {wide}");
    }

    #[test]
    fn what_is_needed_keeps_the_target_and_little_less_does_not() {
        let pilot = pilot(0.01, 0.0);
        let need = pilot.need(&Targets::just_noticeable(0.1), 32);
        let spread = &pilot.spreads[0];
        assert!(pilot.half_width(spread, need.effort).unwrap().total() <= 0.1);
        let less = Effort::of_trace(need.effort.emissions * 4 / 5, 32);
        assert!(pilot.half_width(spread, less).unwrap().total() > 0.1);
    }

    #[test]
    fn rays_follow_sonels_whatever_makes_the_noise() {
        let effort = |packets, rays| pilot(packets, rays).need(&Targets::just_noticeable(0.1), 32).effort;
        let of_packets = effort(0.01, 0.0);
        assert_eq!(u64::from(of_packets.rays), of_packets.emissions.div_ceil(4));
        assert_eq!(effort(0.001, 0.009), of_packets);
        assert_ne!(effort(0.001, 0.005), of_packets);
    }

    #[test]
    fn typical_half_widths_are_root_mean_squares() {
        let mut pilot = pilot(0.01, 0.0);
        let place = Place { band: 1, ..pilot.spreads[0].place };
        let more = Variance { packets: 0.07, areas: 0.0, rays: 0.0, bias: 0.0 };
        pilot.spreads.push(Spread { place, variance: Ok(more), ..pilot.spreads[0].clone() });
        let need = pilot.typical_need(0.1, 32);
        let exact = 10_000.0 * 0.04 * (student_factor(32) / 0.1).powi(2);
        let ratio = need.effort.emissions as f64 / exact;
        assert!((1.0..1.5).contains(&ratio), "{ratio}");
        assert_eq!(need.limited_by, Some(place));
        assert!(pilot.need(&Targets::just_noticeable(0.1), 32).effort.emissions > need.effort.emissions);
    }

    #[test]
    fn numbers_have_six_steps_a_decade() {
        assert_eq!([1, 10, 11, 1024, 2048, 68_001].map(six_a_decade_up), [10, 10, 15, 1500, 2200, 100_000]);
    }

    #[test]
    fn planned_numbers_have_two_digits() {
        assert_eq!([1, 99, 100, 101, 12_345].map(two_digits_up), [1, 99, 100, 110, 13_000]);
    }
}
