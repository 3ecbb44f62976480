//! A short run that says how uncertain the figures of a longer one will be, and what it will cost.
//!
//! - Its random numbers are not those of the run that it plans, so that the number of emissions it asks for and the run's
//!   own estimates are independent: intervals of a run planned by a pilot cover as ever.
//! - It has 96 batches, so that the variance of a figure is good to 15 %, and is longer where that costs little: late decay may
//!   be carried by few strong paths, whose variance itself scatters.
//! - What visibility rays add to the variance is told from what sonels add by hearing the same map with other and more rays; what
//!   the sonels on discs and in spheres add, whose area shrinks as there are more, by the inner and outer halves of the areas.
//! - A shorter run beside it tells fixed times from times per emission.
//!
//! Everything but the seconds is a function of scene and settings.

use sonel_analysis::Parameter;
use sonel_map::Settings;
use sonel_renderer::{ReceiverPoint, RenderSettings};

use crate::split::{self, HeardTwice};
use crate::spread::{Place, Reading, readings};
use crate::trial::{Clock, Heard, InMemory, NoClock, Room, TracedMap, TrialError, hear};

/// Batches of the pilot.
const BATCHES: u32 = 96;
/// Emissions of the shortest pilot, and of the longest.
const EMISSIONS: std::ops::RangeInclusive<u64> = 12_288..=49_152;
/// A pilot longer than the shortest has at most so many segments times rays to judges and along the path.
const WORK: f64 = 3e6;
/// The shorter run has this part of the shortest pilot's emissions and of its batches.
const SHORTER: u32 = 4;
/// How many times the rays are heard that tell their noise.
const MORE_RAYS: u32 = 2;
/// Emissions that tell how long paths are.
const FEW: u64 = 256;
/// What tells the seeds of pilots from those of users: the golden ratio's bits.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// What a pilot found.
#[derive(Debug, Clone)]
pub struct Pilot {
    /// Emissions per source of each of its runs (per source and band where bands do not share paths).
    pub emissions: u64,
    /// Visibility rays of a receiver.
    pub rays: u32,
    /// Whether visibility rays are cast: then more of them help.
    pub casts_rays: bool,
    /// How uncertain each figure was.
    pub spreads: Vec<Spread>,
    /// What it cost.
    pub costs: Costs,
}

/// How uncertain one figure was in a pilot, in just-noticeable differences.
#[derive(Debug, Clone)]
pub struct Spread {
    /// Which figure.
    pub place: Place,
    /// Its mean value; none where every run refused it as too noisy.
    pub value: Option<f64>,
    /// Its variance, or why nobody can say.
    pub variance: Result<Variance, String>,
}

/// Squares of standard errors in just-noticeable differences.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Variance {
    /// What shrinks with the number of emissions.
    pub sonels: f64,
    /// What shrinks with the number of sonels on a disc or in a sphere.
    pub areas: f64,
    /// What shrinks with the number of visibility rays and of sonels on their discs.
    pub rays: f64,
    /// The square of the bias of discs and spheres.
    pub bias: f64,
}

/// What a run costs in this scene, on this machine where it is time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Costs {
    /// CPU seconds of tracing and writing.
    pub trace: Linear,
    /// CPU seconds of opening the map and checking it.
    pub open: Linear,
    /// CPU seconds of rendering the pilot's receivers with the pilot's rays.
    pub render: Linear,
    /// CPU seconds of the pilot's rays once more.
    pub rays: f64,
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
    /// Through two points (emissions, cost), the first with fewer; neither part is below zero.
    fn through(few: (f64, f64), many: (f64, f64)) -> Self {
        let each = ((many.1 - few.1) / (many.0 - few.0)).clamp(LEAST_EACH * many.1 / many.0, many.1 / many.0);
        Self { fixed: (many.1 - each * many.0).max(0.0), each }
    }

    /// At `emissions`.
    #[must_use]
    pub fn at(self, emissions: u64) -> f64 {
        self.fixed + self.each * emissions as f64
    }
}

/// Who a pilot is for.
pub struct Mission<'a> {
    /// The scene.
    pub room: &'a Room<'a>,
    /// Settings of the run that is planned.
    pub trace: Settings,
    /// How it will be heard.
    pub render: RenderSettings,
    /// Where.
    pub receivers: &'a [ReceiverPoint],
    /// Which figures matter.
    pub parameters: &'a [Parameter],
}

/// One of a pilot's runs.
struct Run {
    emissions: f64,
    traced: TracedMap,
    heard: Heard,
}

impl Run {
    fn of(
        mission: &Mission<'_>,
        emissions: u64,
        batches: u32,
        clock: &dyn Clock,
    ) -> Result<Self, TrialError> {
        let seed = mission.trace.seed.wrapping_add(1).wrapping_mul(SEED);
        let settings = Settings { emissions, seed, batches, ..mission.trace };
        let traced = mission.room.trace(settings, &mut InMemory, clock)?;
        let render = RenderSettings { seed: None, ..mission.render.clone() };
        let heard = hear(&traced.map, mission.room.geometry(), mission.receivers, &render, clock)?;
        Ok(Self { emissions: settings.emissions as f64, traced, heard })
    }
}

/// Runs a pilot.
///
/// # Errors
/// As [`Room::trace`] and [`hear`].
pub fn run(mission: &Mission<'_>, clock: &dyn Clock) -> Result<Pilot, TrialError> {
    let shorter = Run::of(mission, EMISSIONS.start() / u64::from(SHORTER), BATCHES / SHORTER, clock)?;
    let run = Run::of(mission, length(mission, &shorter), BATCHES, clock)?;
    let casts_rays = run.heard.casts_rays;
    let more = casts_rays.then(|| hear_more(mission, &run.traced, clock)).transpose()?;
    let found = readings(&run.heard.figures, mission.parameters);
    let others = more.as_ref().map(|more| HeardTwice {
        figures: &run.heard.figures,
        others: &more.figures,
        // Rays of their own: the difference holds the noise of both.
        excess: 1.0 + 1.0 / f64::from(MORE_RAYS),
        batches: BATCHES,
    });
    let spreads = spreads(&found, BATCHES, |parameter| {
        others.as_ref().map_or(0.0, |others| others.share(&found, parameter))
    });
    let costs = costs(&shorter, &run, more.as_ref());
    Ok(Pilot {
        emissions: run.traced.map.header().settings.emissions,
        rays: mission.render.rays,
        casts_rays,
        spreads,
        costs,
    })
}

/// Segments per emission of the run that is planned: a few packets traced and not heard.
///
/// # Errors
/// As [`Room::trace`].
pub fn segments(mission: &Mission<'_>) -> Result<f64, TrialError> {
    let settings = Settings { emissions: FEW, seed: mission.trace.seed.wrapping_mul(SEED), ..mission.trace };
    let traced = mission.room.trace(settings, &mut InMemory, &NoClock)?;
    Ok(traced.books.segments as f64 / (FEW * mission.room.scene().sources.len() as u64) as f64)
}

/// As many emissions as are cheap, but for a power of two.
fn length(mission: &Mission<'_>, shorter: &Run) -> u64 {
    let work =
        shorter.traced.books.segments as f64 / shorter.emissions * (1 + mission.receivers.len()) as f64;
    let mut emissions = *EMISSIONS.start();
    while 2 * emissions <= *EMISSIONS.end() && work * 2.0 * emissions as f64 <= WORK {
        emissions *= 2;
    }
    emissions
}

/// The same map, heard with more rays and other choices.
fn hear_more(mission: &Mission<'_>, traced: &TracedMap, clock: &dyn Clock) -> Result<Heard, TrialError> {
    let seed = traced.map.header().settings.seed.wrapping_mul(SEED);
    let rays = mission.render.rays.saturating_mul(MORE_RAYS);
    let render = RenderSettings { seed: Some(seed), rays, ..mission.render.clone() };
    Ok(hear(&traced.map, mission.room.geometry(), mission.receivers, &render, clock)?)
}

/// How uncertain the figures that were `found` in `batches` batches are, where visibility rays have a `share` of the variance.
pub(crate) fn spreads(found: &[Reading], batches: u32, share: impl Fn(Parameter) -> f64) -> Vec<Spread> {
    let spread = |reading: &Reading| Spread {
        place: reading.place,
        value: reading.value,
        variance: split::parts(reading, batches, share(reading.place.parameter)),
    };
    found.iter().map(spread).collect()
}

fn costs(few: &Run, many: &Run, more: Option<&Heard>) -> Costs {
    let line =
        |of: &dyn Fn(&Run) -> f64| Linear::through((few.emissions, of(few)), (many.emissions, of(many)));
    // What is deterministic costs the same each time.
    let deterministic = few.heard.seconds.deterministic.min(many.heard.seconds.deterministic);
    let render = line(&|run| run.heard.seconds.sweep);
    let rays = more.map_or(0.0, |more| {
        ((more.seconds.sweep - many.heard.seconds.sweep) / f64::from(MORE_RAYS - 1)).max(0.0)
    });
    Costs {
        trace: line(&|run| run.traced.seconds.trace + run.traced.seconds.write),
        open: line(&|run| run.traced.seconds.open + run.heard.seconds.prepare),
        render: Linear { fixed: render.fixed + deterministic, ..render },
        rays,
        bytes: line(&|run| run.traced.map.byte_length() as f64),
        segments: many.traced.books.segments as f64 / many.emissions,
    }
}
