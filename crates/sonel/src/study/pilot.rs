//! A short run that predicts intervals and cost of a longer one.
//!
//! - Its random numbers are not those of the run that it plans, so that the number of emissions it asks for and the run's
//!   own estimates are independent: intervals of a run planned by a pilot cover as ever.
//! - It has 32 batches, as a run has: rays fill their directions the better the more of them a batch has. It is longer where that costs
//!   little, or where the kurtosis of the batches says that few strong paths carry a parameter, whose variance itself scatters (`kurtosis`).
//! - Its rays follow its packets as those of a run do. Where a map is given and rays are planned, their variance is separated by rendering the
//!   same map with other and fewer rays.
//! - A shorter run before it tells fixed times from times per emission.
//! - Edges, which bring no noise, are heard by the shorter run alone, for their time.
//!
//! Everything but the seconds is a function of scene and settings.

use sonel_analysis::{Parameter, ReceiverParameters};
use sonel_map::Settings;
use sonel_renderer::{Columns, ReceiverPoint, RenderSettings};

use crate::Result;
use crate::observer::{Observer, Silent, Watch};
use crate::study::kurtosis;
use crate::study::pipeline::{InMemory, RenderedMap, Room, TracedMap, render_and_read};
use crate::study::split::{self, RenderedTwice, Variance};
use crate::study::spread::{Place, Reading, pooled_kurtosis, readings};

/// Batches of each run, as many as a run has by default.
const BATCHES: u32 = 32;
/// Emissions of pilots, the most first: 96, 48 and 24 chunks. Chosen, not measured; doubled, pilots take twice as long.
const EMISSIONS: [u64; 3] = [49_152, 24_576, 12_288];
/// Most work of a pilot longer than the shortest: segments times rays to evaluation receivers and along the path. Chosen, not measured; doubled,
/// pilots take up to twice as long.
const WORK: f64 = 1.2e6;
/// The same where few strong paths carry a parameter.
const WORK_FOR_TAILS: f64 = 1e7;
/// Emissions of the shortest pilot over those of its shorter run, which separates the cost of an emission from that of a start.
const SHORTER: u64 = 4;
/// Rays of a pilot over those of its second rendering, which separates their noise from that of packets.
const FEWER_RAYS: u32 = 2;
/// Emissions of [`segments`]: half a chunk. Chosen, not measured.
pub const FEW: u64 = 256;
/// Bits that distinguish the seeds of pilots from those of users: the golden ratio's.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// Largest share of a run's time that its pilot takes in CPU seconds [1], even if a single processor works. Chosen, not measured.
pub const SHARE_OF_TIME: f64 = 0.3;

/// Result of a pilot.
#[derive(Debug, Clone)]
pub struct Pilot {
    /// Emissions per source of each of its runs (per source and band where bands do not share paths).
    pub emissions: u64,
    /// Batches.
    pub batches: u32,
    /// Visibility rays of a receiver.
    pub rays: u32,
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
    pub place: Place,
    /// Mean value; none where every run refused it as too noisy.
    pub value: Option<f64>,
    /// Variance, or the reason why there is none.
    pub variance: Result<Variance, String>,
    /// Excess kurtosis that a batch of a single emission would have: large where few strong paths carry the parameter, so that its
    /// variance is itself uncertain.
    pub tail: f64,
}

/// Cost of a run in this scene; times are those of this machine.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Costs {
    /// CPU seconds of tracing and writing.
    pub trace: Linear,
    /// CPU seconds of opening the map and checking it.
    pub open: Linear,
    /// CPU seconds of rendering the pilot's receivers with the pilot's rays.
    pub render: Linear,
    /// CPU seconds of the pilot's rays once more. Those of as many rays for each emission are part of `render`.
    pub rays: f64,
    /// CPU seconds of reading the parameters, for each batch.
    pub parameters: f64,
    /// Bytes of the map.
    pub bytes: Linear,
    /// Segments per emission.
    pub segments: f64,
}

/// Part of a pilot's cost that grows with its emissions at least: what looks like less is a disturbance of the clock.
const LEAST_EACH: f64 = 0.3;

/// A fixed part and one per emission.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Linear {
    /// Whatever the number.
    pub fixed: f64,
    /// Per emission.
    pub each: f64,
}

impl Linear {
    /// Through two points (emissions, cost), the first with fewer; neither part is below zero. Through a single one there is no fixed part, so
    /// that more emissions cost less than it says.
    fn through(few: (f64, f64), many: (f64, f64)) -> Self {
        if few.0 >= many.0 {
            return Self { fixed: 0.0, each: many.1 / many.0 };
        }
        let each = ((many.1 - few.1) / (many.0 - few.0)).clamp(LEAST_EACH * many.1 / many.0, many.1 / many.0);
        Self { fixed: (many.1 - each * many.0).max(0.0), each }
    }

    /// At `emissions`.
    #[must_use]
    pub fn at(self, emissions: u64) -> f64 {
        self.fixed + self.each * emissions as f64
    }
}

/// Purpose of a pilot.
pub struct PilotConfig<'a> {
    /// The scene.
    pub room: &'a Room<'a>,
    /// Settings of the run that is planned.
    pub trace: Settings,
    /// Settings of the rendering.
    pub render: RenderSettings,
    /// Whether the packets are those of a map, and more rays or fewer shall be planned. Else rays follow from the packets.
    pub is_traced: bool,
    /// Receivers.
    pub receivers: &'a [ReceiverPoint],
    /// Parameters that matter.
    pub parameters: &'a [Parameter],
    /// CPU seconds that a pilot may take, where the clock matters; its shortest form, a quarter of the shortest otherwise, takes what it
    /// takes.
    pub seconds: Option<f64>,
}

impl PilotConfig<'_> {
    /// Rays of a pilot of so many `emissions`: in proportion to those of the run that is planned.
    fn rays(&self, emissions: u64) -> u32 {
        let asked = f64::from(self.render.rays(self.trace.emissions));
        (asked * emissions as f64 / self.trace.emissions as f64).ceil() as u32
    }
}

/// A rendering and its parameters.
type Rendered = (RenderedMap, Vec<ReceiverParameters>);

/// One of a pilot's runs.
struct Run {
    emissions: f64,
    rays: u32,
    traced: TracedMap,
    rendered: RenderedMap,
    parameters: Vec<ReceiverParameters>,
}

impl Run {
    fn of(
        config: &PilotConfig<'_>,
        emissions: u64,
        with_edges: bool,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let PilotConfig { room, receivers, .. } = *config;
        let seed = config.trace.seed.wrapping_add(1).wrapping_mul(SEED);
        let settings = Settings { emissions, seed, batches: BATCHES, ..config.trace };
        let traced = room.trace(settings, &mut InMemory, observer)?;
        let rays = config.rays(emissions);
        let edges = with_edges && config.render.edges;
        let render = RenderSettings { seed: None, rays: Some(rays), edges, ..config.render.clone() };
        let (rendered, parameters) =
            render_and_read(&traced.map, room.geometry(), receivers, &render, observer)?;
        Ok(Self { emissions: settings.emissions as f64, rays, traced, rendered, parameters })
    }

    /// CPU seconds of a run of so many emissions that is heard twice where rays are planned; at the most, as every
    /// phase but that of the deterministic parts is taken to grow in proportion.
    fn seconds_of(&self, emissions: u64, config: &PilotConfig<'_>) -> f64 {
        let (traced, rendered) = (self.traced.seconds, self.rendered.seconds);
        let more = emissions as f64 / self.emissions;
        let renderings = if config.is_traced && self.rendered.casts_rays { 2.0 } else { 1.0 };
        let once = rendered.deterministic + rendered.parameters + more * rendered.sweep;
        more * (traced.total() + rendered.prepare) + renderings * once
    }
}

/// Runs a pilot.
///
/// # Errors
/// The errors of [`Room::trace`] and [`render_and_read`].
pub fn run(config: &PilotConfig<'_>, observer: &dyn Observer) -> Result<Pilot> {
    let clock = Watch(observer).clock();
    let begin = clock.process();
    let least = EMISSIONS[EMISSIONS.len() - 1];
    let shorter = Run::of(config, least / SHORTER, true, observer)?;
    let ends_in_time = |emissions| {
        let end = config.seconds.map_or(f64::INFINITY, |seconds| begin + seconds);
        clock.process() + shorter.seconds_of(emissions, config) <= end
    };
    let mut run = None;
    if !is_heavy(config, &shorter)
        && let Some(emissions) = lengths(config, &shorter, WORK).find(|&emissions| ends_in_time(emissions))
    {
        run = Some(Run::of(config, emissions, false, observer)?);
    }
    if is_heavy(config, run.as_ref().unwrap_or(&shorter)) {
        let known = run.as_ref().map_or(0.0, |run| run.emissions);
        let longer = |emissions: &u64| *emissions as f64 > known && ends_in_time(*emissions);
        if let Some(emissions) = lengths(config, &shorter, WORK_FOR_TAILS).find(longer) {
            run = Some(Run::of(config, emissions, false, observer)?);
        }
    }
    let Some(run) = run else { return Ok(found(config, &shorter, &shorter, None)) };
    let tells_rays = config.is_traced && run.rendered.casts_rays;
    let fewer = tells_rays.then(|| render_with_fewer_rays(config, &run, observer)).transpose()?;
    Ok(found(config, &shorter, &run, fewer.as_ref()))
}

/// Values of the runs.
fn found(config: &PilotConfig<'_>, shorter: &Run, run: &Run, fewer: Option<&Rendered>) -> Pilot {
    let found = readings(&run.parameters, config.parameters);
    let others = fewer.map(|fewer| RenderedTwice {
        parameters: &run.parameters,
        others: &fewer.1,
        // Rays of their own: the difference holds the noise of both.
        excess: 1.0 + f64::from(FEWER_RAYS),
        batches: run.traced.map.header().settings.batches,
    });
    let share = |parameter| others.as_ref().map_or(0.0, |others| others.share(&found, parameter));
    let Settings { emissions, batches, .. } = run.traced.map.header().settings;
    Pilot {
        emissions,
        batches,
        rays: run.rays,
        casts_rays: run.rendered.casts_rays,
        columns: if config.render.directions { Columns::DIRECTED } else { Columns::PLAIN },
        spreads: spreads(&found, emissions, batches, share),
        costs: costs(shorter, run, fewer),
    }
}

/// Segments per emission of the run that is planned: a few packets traced and not heard.
///
/// # Errors
/// The errors of [`Room::trace`].
pub fn segments(config: &PilotConfig<'_>) -> Result<f64> {
    let settings = Settings { emissions: FEW, seed: config.trace.seed.wrapping_mul(SEED), ..config.trace };
    let traced = config.room.trace(settings, &mut InMemory, &Silent)?;
    Ok(traced.ledger.segments as f64 / (FEW * config.room.scene().sources.len() as u64) as f64)
}

/// Whether few strong paths carry a parameter of `run`: only more emissions find them.
fn is_heavy(config: &PilotConfig<'_>, run: &Run) -> bool {
    let found = readings(&run.parameters, config.parameters);
    config.parameters.iter().any(|&parameter| pooled_kurtosis(&found, parameter) > kurtosis::HEAVY)
}

/// Emissions of pilots that have at most `limit` work, and of the shortest; the most first.
fn lengths(config: &PilotConfig<'_>, shorter: &Run, limit: f64) -> impl Iterator<Item = u64> {
    let segments = shorter.traced.ledger.segments as f64 / shorter.emissions;
    let work = segments * (1 + config.receivers.len()) as f64;
    let least = EMISSIONS[EMISSIONS.len() - 1];
    EMISSIONS.into_iter().filter(move |&emissions| emissions == least || work * emissions as f64 <= limit)
}

/// The same map, heard with fewer rays and other choices.
fn render_with_fewer_rays(config: &PilotConfig<'_>, run: &Run, observer: &dyn Observer) -> Result<Rendered> {
    let map = &run.traced.map;
    let seed = map.header().settings.seed.wrapping_mul(SEED);
    let rays = run.rays.div_ceil(FEWER_RAYS);
    let render = RenderSettings { seed: Some(seed), rays: Some(rays), ..config.render.clone() };
    render_and_read(map, config.room.geometry(), config.receivers, &render, observer)
}

/// How uncertain the parameters are that were `found` in a run of so many emissions and batches, where visibility rays have a `share` of
/// the variance.
pub(crate) fn spreads(
    found: &[Reading],
    emissions: u64,
    batches: u32,
    share: impl Fn(Parameter) -> f64,
) -> Vec<Spread> {
    let spread = |reading: &Reading| Spread {
        place: reading.place,
        value: reading.value,
        variance: split::parts(reading, batches, share(reading.place.parameter)),
        tail: pooled_kurtosis(found, reading.place.parameter) * emissions as f64 / f64::from(batches),
    };
    found.iter().map(spread).collect()
}

fn costs(few: &Run, many: &Run, fewer: Option<&Rendered>) -> Costs {
    let line =
        |of: &dyn Fn(&Run) -> f64| Linear::through((few.emissions, of(few)), (many.emissions, of(many)));
    // What is deterministic costs the same each time, but for edges.
    let deterministic = few.rendered.seconds.deterministic;
    let render = line(&|run| run.rendered.seconds.sweep);
    let rays = fewer.map_or(0.0, |fewer| {
        let saved = many.rendered.seconds.sweep - fewer.0.seconds.sweep;
        (saved / (1.0 - 1.0 / f64::from(FEWER_RAYS))).max(0.0)
    });
    Costs {
        trace: line(&|run| run.traced.seconds.trace + run.traced.seconds.write),
        open: line(&|run| run.traced.seconds.open + run.rendered.seconds.prepare),
        render: Linear { fixed: render.fixed + deterministic, ..render },
        rays,
        parameters: many.rendered.seconds.parameters / f64::from(many.traced.map.header().settings.batches),
        bytes: line(&|run| run.traced.map.byte_length() as f64),
        segments: many.traced.ledger.segments as f64 / many.emissions,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Clock;
    use crate::study::evaluation_receivers::evaluation_receivers;
    use crate::study::plan::Plan;
    use crate::study::spread::PLANNED;
    use sonel_acoustics::{BandWidth, Bands, Material};
    use sonel_renderer::Estimator;
    use sonel_scene::Scene;
    use std::sync::Mutex;

    /// A second passes whenever somebody asks for the time.
    #[derive(Default)]
    struct Ticking(Mutex<f64>);

    impl Observer for Ticking {
        fn clock(&self) -> Option<&dyn Clock> {
            Some(self)
        }
    }

    impl Clock for Ticking {
        fn wall(&self) -> f64 {
            0.0
        }

        fn process(&self) -> f64 {
            let mut time = self.0.lock().expect("nobody panicked");
            *time += 1.0;
            *time
        }

        fn thread(&self) -> f64 {
            0.0
        }
    }

    /// A pilot of a box with walls that scatter by half, heard by `estimator`, that may take `seconds`.
    fn pilot(estimator: Estimator, seconds: Option<f64>) -> Pilot {
        let bands = Bands::new(vec![500.0], BandWidth::Octave).expect("an octave");
        let walls = Material::uniform("walls", 0.3, 0.5, bands.count());
        let scene = Scene::shoebox([6.0, 5.0, 3.0], walls, bands)
            .with_duration(0.8)
            .with_source("source", [1.0, 1.0, 1.5])
            .with_receiver("seat", [4.2, 3.4, 1.2]);
        let geometry = scene.geometry().expect("walls");
        let room = Room::within(&scene, &geometry, &[]);
        let receivers = evaluation_receivers(&scene, room.geometry());
        let config = PilotConfig {
            room: &room,
            trace: Settings::default(),
            render: RenderSettings::of(estimator),
            is_traced: false,
            receivers: &receivers,
            parameters: &PLANNED,
            seconds,
        };
        let pilot = run(&config, &Ticking::default()).expect("a valid scene");
        let plan = Plan::of_trace(pilot.clone(), &scene, &receivers, 32, 0.001);
        assert!(plan.rows.iter().all(|row| row.price.trace.is_finite() && row.effort.emissions > 0));
        pilot
    }

    #[test]
    fn pilots_are_as_long_as_their_time_and_what_they_find_let_them() {
        assert!(pilot(Estimator::Auto, None).emissions >= 12_288);
        assert_eq!(pilot(Estimator::Auto, None).emissions, pilot(Estimator::Auto, Some(1e6)).emissions);
        let hasty = pilot(Estimator::Auto, Some(3.0));
        assert_eq!((hasty.emissions, hasty.batches), (3072, 32));
    }

    /// Spheres alone: few paths reach them late.
    #[test]
    fn heavy_tails_make_pilots_longer() {
        assert!(pilot(Estimator::Sphere, None).emissions > pilot(Estimator::Auto, None).emissions);
    }
}
