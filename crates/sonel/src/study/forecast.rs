//! How many packets and rays, how wide the intervals and at what cost: plans, default runs and targets ask this one prediction.
//!
//! Variances fall as 1/N: batches are independent, and deterministic parts have none (docs/physics.md §7). That of spheres falls more
//! slowly, as they shrink, and that of discs faster, as the rays that end in them grow with N too. Areas of discs and spheres shrink as
//! N^(−1/3), and with them their bias. The noise of visibility rays is mainly that of their directions: it falls as 1/M.

use sonel_analysis::{Parameter, ReceiverParameters};
use sonel_renderer::{Columns, MOST_RAYS, RenderSettings};

use crate::study::kurtosis;
use crate::study::split::{self, RenderedTwice, Variance};
use crate::study::spread::{
    HalfWidth, NoWidth, PLANNED, ParameterPlace, Reading, pooled_kurtosis, readings, student_factor, unit,
};
use crate::study::target::Targets;

/// Fewest emissions of a batch: fewer make no estimate of their own. Chosen, not measured; doubled, the smallest run is twice as long.
pub const LEAST_PER_BATCH: u64 = 32;
/// Largest excess kurtosis of a batch [1]: beyond it few strong paths decide, and intervals are themselves uncertain. Chosen, not measured;
/// halved, rooms of late decay by few packets take 1.4 times as many.
const MOST_KURTOSIS: f64 = 2.0;
/// Part of a limit below which the uncertainty of a half-width does not matter [1]. Chosen, not measured.
const FAR_BELOW: f64 = 0.5;
/// Rays of a receiver in a batch at least: fewer leave the strata of their directions empty.
const LEAST_RAYS_PER_BATCH: u32 = 16;
/// Most emissions of a plan: their map would have about a petabyte.
const MOST_EMISSIONS: u64 = 1_000_000_000_000;

/// What an interval takes for bias where there is none, in standard errors of the shift that would show it: the mean of
/// √(x² − 1), where that is real, for a normal x.
const SPURIOUS: f64 = 0.325;
/// A bias extends an interval to one side, which makes half of it longer by half the bias.
const ONE_SIDE: f64 = 0.5;
/// Standard deviations that are exceeded once in 20 times.
const MOST_SIGMAS: f64 = 1.96;

/// Packets, rays and batches of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Emissions per source (per source and band where bands do not share paths).
    pub emissions: u64,
    /// Visibility rays of a receiver.
    pub rays: u32,
    /// Batches.
    pub batches: u32,
}

impl Effort {
    /// Tracing so many `emissions`, and rendering with the rays that they have unless others are asked for.
    #[must_use]
    pub fn of_trace(emissions: u64, batches: u32) -> Self {
        Self { emissions, rays: RenderSettings::default().rays(emissions), batches }
    }
}

/// Uncertainty and cost of runs in a room, as some packets of one have shown them.
#[derive(Debug, Clone)]
pub struct Pilot {
    /// What was rendered.
    pub effort: Effort,
    /// Whether visibility rays are cast: then more of them help.
    pub casts_rays: bool,
    /// Columns of a receiver's echograms: more where directions are asked for.
    pub columns: Columns,
    /// Uncertainty of each parameter.
    pub spreads: Vec<Spread>,
    /// What it cost.
    pub costs: Costs,
}

/// Uncertainty of one parameter in a pilot [JND].
#[derive(Debug, Clone)]
pub struct Spread {
    /// The parameter.
    pub place: ParameterPlace,
    /// Mean value; none where every run refused it as too noisy.
    pub value: Option<f64>,
    /// Variance, or the reason why there is none.
    pub variance: Result<Variance, NoWidth>,
    /// Excess kurtosis that a batch of a single emission would have: large where few strong paths carry the parameter, so that its
    /// variance is itself uncertain.
    pub tail: f64,
}

/// Cost of a run in this scene; times are those of this machine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Costs {
    /// CPU seconds of tracing and writing an emission.
    pub trace: f64,
    /// CPU seconds of opening the map and checking it, for an emission.
    pub open: f64,
    /// CPU seconds of what no packet changes, at all evaluation receivers.
    pub deterministic: f64,
    /// CPU seconds of rendering an emission and its rays at all evaluation receivers.
    pub sweep: f64,
    /// CPU seconds of a ray at all evaluation receivers; zero where it is not known.
    pub ray: f64,
    /// Bytes of an emission in the map.
    pub bytes: f64,
    /// Segments of an emission.
    pub segments: f64,
}

/// CPU seconds and bytes of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Price {
    /// CPU seconds of the trace.
    pub trace: f64,
    /// CPU seconds of rendering the evaluation receivers.
    pub render: f64,
    /// Bytes of the map.
    pub bytes: f64,
}

/// Effort that targets need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Need {
    /// Packets and rays; in a map of given packets those.
    pub effort: Effort,
    /// Which parameter needs them; none where the least is enough.
    pub limited_by: Option<ParameterPlace>,
    /// Packets of a map that keeps the targets, where the given one does not with any number of rays.
    pub lacking: Option<u64>,
}

/// Half of a 95 % interval that is predicted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Width {
    /// Expected half-width, in the parameter's own unit.
    pub expected: f64,
    /// Between which bounds it is found in 19 of 20 runs ([`Pilot::range`]).
    pub range: [f64; 2],
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

impl Pilot {
    /// What a rendering with this `effort` tells whose parameters are `last`; after one `before` of the same packets with fewer rays, those
    /// among its own, also what rays bring. Nothing is known of costs.
    #[must_use]
    pub fn of(
        before: Option<(u32, &[ReceiverParameters])>,
        last: &[ReceiverParameters],
        parameters: &[Parameter],
        effort: Effort,
    ) -> Self {
        let found = readings(last, parameters);
        // The later one is a mean of the rays of the earlier and of new ones: its rays' variance is that of the difference over the factor of
        // their numbers less one.
        let twice = before.map(|(rays, others)| RenderedTwice {
            parameters: last,
            others,
            excess: f64::from(effort.rays) / f64::from(rays) - 1.0,
            batches: effort.batches,
        });
        let share = |parameter| twice.as_ref().map_or(0.0, |twice| twice.share(&found, parameter));
        let as_one = effort.emissions as f64 / f64::from(effort.batches);
        let spread = |reading: &Reading| Spread {
            place: reading.place,
            value: reading.value,
            variance: split::parts(reading, effort.batches, share(reading.place.parameter)),
            tail: pooled_kurtosis(&found, reading.place.parameter) * as_one,
        };
        let spreads = found.iter().map(spread).collect();
        Self {
            effort,
            casts_rays: twice.is_some(),
            columns: Columns::PLAIN,
            spreads,
            costs: Costs::default(),
        }
    }

    /// Half of the 95 % interval that the parameter of `spread` will have, in just-noticeable differences.
    ///
    /// # Errors
    /// Why nobody can say.
    pub fn half_width<'a>(&self, spread: &'a Spread, effort: Effort) -> Result<HalfWidth, &'a NoWidth> {
        let variance = spread.variance.as_ref()?;
        let [all, areas] = self.noise(variance, effort);
        let bias = self.squared_bias(variance, effort) + SPURIOUS * SPURIOUS * 4.0 * areas;
        let noise = student_factor(effort.batches) * all.sqrt();
        Ok(HalfWidth { noise, beside: ONE_SIDE * bias.sqrt() })
    }

    /// Between which bounds that half-width is found in 19 of 20 runs, in just-noticeable differences. The standard errors of pilot and run
    /// scatter, the more the heavier the tails of the batches are; and where areas bring noise, an interval may take part of it for bias.
    ///
    /// # Errors
    /// Why nobody can say.
    pub fn range<'a>(&self, spread: &'a Spread, effort: Effort) -> Result<[f64; 2], &'a NoWidth> {
        let variance = spread.variance.as_ref()?;
        let width = self.half_width(spread, effort)?;
        let factor = libm::exp(MOST_SIGMAS * self.scatter(effort, spread.tail));
        let [_, areas] = self.noise(variance, effort);
        let shift = 2.0 * areas.sqrt() * (MOST_SIGMAS * MOST_SIGMAS - 1.0).sqrt();
        let real = self.squared_bias(variance, effort).sqrt();
        Ok([width.noise / factor, (width.noise + ONE_SIDE * (shift + real)) * factor])
    }

    /// Standard deviation of the logarithm of a half-width over the one that is predicted: both standard errors scatter.
    fn scatter(&self, effort: Effort, tail: f64) -> f64 {
        let of = |Effort { emissions, batches, .. }: Effort| kurtosis::scatter(batches, emissions, tail);
        (of(self.effort) + of(effort)).sqrt()
    }

    /// Variance, and the part of it that discs and spheres show.
    fn noise(&self, variance: &Variance, effort: Effort) -> [f64; 2] {
        let packets = self.effort.emissions as f64 / effort.emissions as f64;
        let rays = f64::from(self.effort.rays) / f64::from(effort.rays);
        [(variance.packets + variance.areas) * packets + variance.rays * rays, variance.areas * packets]
    }

    /// The square of the bias: it grows with the areas of discs and spheres.
    fn squared_bias(&self, variance: &Variance, effort: Effort) -> f64 {
        variance.bias * libm::pow(self.effort.emissions as f64 / effort.emissions as f64, 2.0 / 3.0)
    }

    /// What has no variance, and why.
    pub(crate) fn not_estimable(&self) -> impl Iterator<Item = (ParameterPlace, &NoWidth)> {
        self.spreads.iter().filter_map(|spread| Some((spread.place, spread.variance.as_ref().err()?)))
    }

    fn of_parameter(&self, parameter: Parameter) -> impl Iterator<Item = &Spread> {
        self.spreads.iter().filter(move |spread| spread.place.parameter == parameter)
    }

    fn width(&self, spread: &Spread, effort: Effort) -> Option<Width> {
        let expected = self.half_width(spread, effort).ok()?.total();
        Some(Width { expected, range: self.range(spread, effort).ok()? })
    }

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

    /// Whether half of the interval of `spread` is wider than `limit`.
    fn exceeds(&self, spread: &Spread, effort: Effort, limit: f64) -> bool {
        self.half_width(spread, effort).is_ok_and(|width| width.total() > limit)
    }

    /// Effort that keeps `targets` in `batches` batches.
    #[must_use]
    pub fn need(&self, targets: &Targets, batches: u32) -> Need {
        let mut need = Need::least(batches);
        for spread in &self.spreads {
            let Some(limit) = targets.limit(spread.place, spread.value) else { continue };
            need.raise(|effort| self.exceeds(spread, effort, limit), || Some(spread.place));
        }
        need
    }

    /// Geometric mean over bands and evaluation receivers of the half-widths of `parameter` [JND]; none where none can be read. It scatters less
    /// between seeds than the root mean square does, which few wide ones decide.
    #[must_use]
    pub fn typical(&self, parameter: Parameter, effort: Effort) -> Option<f64> {
        let widths = self.of_parameter(parameter).filter_map(|spread| self.half_width(spread, effort).ok());
        let logarithms: Vec<f64> =
            widths.map(HalfWidth::total).filter(|&width| width > 0.0).map(libm::log).collect();
        let count = logarithms.len() as f64;
        (count > 0.0).then(|| libm::exp(logarithms.iter().sum::<f64>() / count))
    }

    /// Where `parameter` has its widest half-width.
    fn least_certain(&self, parameter: Parameter) -> Option<ParameterPlace> {
        let width = |spread: &&Spread| self.half_width(spread, self.effort).map_or(0.0, HalfWidth::total);
        let widest = self.of_parameter(parameter).max_by(|a, b| width(a).total_cmp(&width(b)));
        widest.map(|spread| spread.place)
    }

    /// Whether the batches of `parameter` have an excess kurtosis above `most`, so that its half-width is uncertain, and that is not far
    /// below `limit`.
    pub(crate) fn is_uncertain(&self, parameter: Parameter, effort: Effort, limit: f64, most: f64) -> bool {
        let tail = self.of_parameter(parameter).next().map_or(0.0, |spread| spread.tail);
        tail * f64::from(effort.batches) > most * effort.emissions as f64
            && self.typical(parameter, effort).is_some_and(|width| width > FAR_BELOW * limit)
    }

    /// Effort in `batches` batches with which every parameter has a [`Self::typical`] half-width of `limit` [JND] at most and batches near
    /// a normal distribution.
    #[must_use]
    pub fn typical_need(&self, limit: f64, batches: u32) -> Need {
        let mut need = Need::least(batches);
        for parameter in PLANNED {
            let exceeds = |effort| {
                self.typical(parameter, effort).is_some_and(|width| width > limit)
                    || self.is_uncertain(parameter, effort, limit, MOST_KURTOSIS)
            };
            need.raise(exceeds, || self.least_certain(parameter));
        }
        need
    }

    /// Effort that keeps `targets` in a map of the packets and batches of `map`. Where rays do not matter they are those of `map`.
    #[must_use]
    pub fn render_need(&self, targets: &Targets, map: Effort) -> Need {
        let rays = if self.casts_rays { LEAST_RAYS_PER_BATCH * map.batches } else { map.rays };
        let mut found = Need { effort: Effort { rays, ..map }, limited_by: None, lacking: None };
        for spread in &self.spreads {
            let Some(limit) = targets.limit(spread.place, spread.value) else { continue };
            if !self.exceeds(spread, found.effort, limit) {
                continue;
            }
            match self.fewest_rays(spread, found.effort, limit) {
                Some(rays) => {
                    found.effort.rays = rays;
                    found.limited_by = Some(spread.place);
                }
                // Rays are not enough.
                None => {
                    let need = self.need(targets, map.batches);
                    let rays = if self.casts_rays { need.effort.rays } else { map.rays };
                    let effort = Effort { rays, ..map };
                    return Need { effort, lacking: Some(need.effort.emissions), ..need };
                }
            }
        }
        found
    }

    /// The fewest rays, in two digits, with which the parameter of `spread` keeps `limit`; none where the most do not.
    fn fewest_rays(&self, spread: &Spread, effort: Effort, limit: f64) -> Option<u32> {
        let exceeds = |rays| self.exceeds(spread, Effort { rays: rays as u32, ..effort }, limit);
        let most = u64::from(MOST_RAYS);
        if !self.casts_rays || exceeds(most) {
            return None;
        }
        let rays = least_within(effort.rays.into(), most, u64::MAX, exceeds);
        Some(two_digits_up(rays).min(most) as u32)
    }

    /// The same with the costs of rendering `receivers` receivers where there were `evaluation_receivers`.
    #[must_use]
    pub fn rendered_at(mut self, receivers: usize, evaluation_receivers: usize) -> Self {
        let times = receivers as f64 / evaluation_receivers.max(1) as f64;
        let Costs { deterministic, sweep, ray, .. } = self.costs;
        let [deterministic, sweep, ray] = [deterministic, sweep, ray].map(|seconds| times * seconds);
        self.costs = Costs { deterministic, sweep, ray, ..self.costs };
        self
    }

    /// Cost of `effort`.
    #[must_use]
    pub fn price(&self, effort: Effort) -> Price {
        let Costs { trace, open, deterministic, sweep, ray, bytes, .. } = self.costs;
        let emissions = effort.emissions as f64;
        let as_many = f64::from(self.effort.rays) * emissions / self.effort.emissions as f64;
        let more_rays = ray * (f64::from(effort.rays) - as_many);
        Price {
            trace: trace * emissions,
            render: open * emissions + deterministic + (sweep * emissions + more_rays).max(0.0),
            bytes: bytes * emissions,
        }
    }
}

impl Need {
    /// The least that is traced.
    fn least(batches: u32) -> Self {
        let effort = Effort::of_trace(LEAST_PER_BATCH * u64::from(batches), batches);
        Self { effort, limited_by: None, lacking: None }
    }

    /// So many more packets, in two digits, that the effort no longer `exceeds`; then the parameter that `limits` is what needs them.
    fn raise(&mut self, exceeds: impl Fn(Effort) -> bool, limits: impl Fn() -> Option<ParameterPlace>) {
        let Effort { emissions: least, batches, .. } = self.effort;
        let too_few = |emissions| exceeds(Effort::of_trace(emissions, batches));
        let (mut low, mut high) = (least, least);
        while too_few(high) && high < MOST_EMISSIONS {
            (low, high) = (high, 2 * high);
        }
        if high > least {
            let emissions = two_digits_up(least_within(low, high, 1000, too_few));
            (self.effort, self.limited_by) = (Effort::of_trace(emissions, batches), limits());
        }
    }
}

/// The next number with two digits and zeros.
fn two_digits_up(number: u64) -> u64 {
    let mut unit = 1;
    while number / unit >= 100 {
        unit *= 10;
    }
    number.div_ceil(unit) * unit
}

/// The least number that does not exceed, to one part in `parts` of itself; `low` exceeds, `high` does not.
fn least_within(mut low: u64, mut high: u64, parts: u64, exceeds: impl Fn(u64) -> bool) -> u64 {
    while high - low > 1 + low / parts {
        let middle = low + (high - low) / 2;
        if exceeds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::split::Variance;
    use crate::study::spread::student_factor;

    /// A pilot of 10 000 emissions whose only parameter has a σ of 0.1 JND, from packets and rays as given.
    fn pilot(packets: f64, rays: f64) -> Pilot {
        let variance = Variance { packets, areas: 0.0, rays, bias: 0.0 };
        let place = ParameterPlace { row: 0, band: 0, parameter: Parameter::T30 };
        let spreads = vec![Spread { place, value: Some(2.0), variance: Ok(variance), tail: 0.0 }];
        let costs = Costs { segments: 40.0, ..Costs::default() };
        Pilot {
            effort: Effort { emissions: 10_000, rays: 2500, batches: 96 },
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
    fn typical_half_widths_are_geometric_means() {
        let mut pilot = pilot(0.01, 0.0);
        let place = ParameterPlace { band: 1, ..pilot.spreads[0].place };
        let more = Variance { packets: 0.16, areas: 0.0, rays: 0.0, bias: 0.0 };
        pilot.spreads.push(Spread { place, variance: Ok(more), ..pilot.spreads[0].clone() });
        let need = pilot.typical_need(0.1, 32);
        let exact = 10_000.0 * 0.04 * (student_factor(32) / 0.1).powi(2);
        let ratio = need.effort.emissions as f64 / exact;
        assert!((1.0..1.1).contains(&ratio), "{ratio}");
        assert_eq!(need.limited_by, Some(place));
        assert!(pilot.need(&Targets::just_noticeable(0.1), 32).effort.emissions > need.effort.emissions);
    }

    #[test]
    fn few_strong_paths_need_more_packets_unless_half_widths_are_far_below_their_limit() {
        let mut pilot = pilot(0.01, 0.0);
        let calm = pilot.typical_need(0.1, 32).effort.emissions;
        // An excess kurtosis of 2 at three times the packets.
        pilot.spreads[0].tail = 2.0 * 3.0 * calm as f64 / 32.0;
        assert_eq!(pilot.typical_need(0.1, 32).effort.emissions, two_digits_up(3 * calm));
        pilot.spreads[0].tail *= 3.0;
        let far_below = pilot.typical_need(0.1, 32).effort.emissions as f64 / calm as f64;
        assert!((far_below / 4.0 - 1.0).abs() < 0.06, "{far_below}");
    }

    #[test]
    fn planned_numbers_have_two_digits() {
        assert_eq!([1, 99, 100, 101, 12_345].map(two_digits_up), [1, 99, 100, 110, 13_000]);
    }

    const MAP: Effort = Effort { emissions: 10_000, rays: 2500, batches: 32 };

    fn render_need(pilot: &Pilot, limit: f64) -> Need {
        pilot.render_need(&Targets::just_noticeable(limit), MAP)
    }

    #[test]
    fn rays_are_as_many_as_the_rest_of_the_variance_leaves_room_for() {
        // In units of the squared limit, packets have a half: the other half is met by twice the rays.
        let limit = 0.1_f64;
        let square = (limit / student_factor(32)).powi(2);
        let found = render_need(&pilot(0.5 * square, square), limit);
        assert_eq!((found.effort.rays, found.lacking), (5000, None));
        assert_eq!(found.limited_by.unwrap().parameter, Parameter::T30);
    }

    #[test]
    fn what_rays_cannot_reach_takes_sonels() {
        let found = render_need(&pilot(0.01, 1e-6), 0.1);
        let packets = 10_000.0 * (0.1 * student_factor(32) / 0.1).powi(2);
        assert!((found.lacking.unwrap() as f64 / packets - 1.0).abs() < 0.1, "{found:?}");
        assert_eq!(found.effort.emissions, MAP.emissions);
    }

    #[test]
    fn where_no_rays_are_cast_they_are_left_alone() {
        let found = render_need(&pilot(1e-6, 0.0), 0.1);
        assert_eq!((found.effort, found.limited_by, found.lacking), (MAP, None, None));
        assert_eq!(render_need(&pilot(1.0, 0.0), 0.1).effort.rays, MAP.rays);
    }

    #[test]
    fn easy_targets_take_the_fewest_rays() {
        assert_eq!(render_need(&pilot(1e-9, 1e-9), 1.0).effort.rays, 512);
    }
}
