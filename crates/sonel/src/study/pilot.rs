//! The first packets of a run, which predict intervals and cost of all of it.
//!
//! - They are the run's own: the run continues them, so that they cost nothing but their rendering. Their number follows from what they find, which
//!   leaves intervals as they are within a few per cent of coverage (`tests/accept/stopping.rs`).
//! - They are looked at again, four times as many, until they say that no more than four times their number is needed: few packets miss the rare
//!   paths that carry the late decay.
//! - Rays follow packets as those of a run do. Where a map is given and rays are planned, their variance is separated by rendering the
//!   same packets with other and fewer rays.
//! - The look before the last tells fixed times from times per packet.
//! - Edges, which bring no noise, are heard by the first look alone, for their time.
//!
//! Everything but the seconds is a function of scene and settings.

use sonel_analysis::{Parameter, ReceiverParameters};
use sonel_map::{Settings, SonelMap};
use sonel_renderer::{Columns, ReceiverPoint, RenderSettings};

use crate::Result;
use crate::observer::{Observer, Silent, Watch};
use crate::study::findings::{Costs, Linear, Pilot, spreads};
use crate::study::pipeline::{InMemory, RenderedMap, Room, TracedMap, render_and_read, trace};
use crate::study::plan::{ACCURACY, LEAST_PER_BATCH};
use crate::study::split::RenderedTwice;
use crate::study::spread::readings;

/// Packets of the first look: 64 in each of 32 batches.
pub const FIRST: u64 = 2048;
/// Factor from the packets of a look to the most that it may ask for [1]: half-widths of fewer are too narrow where rare paths count.
const FARTHEST: u64 = 4;
/// Most packets of a look, some seconds of a room. Chosen, not measured; doubled, plans of long runs take twice as long.
const LONGEST: u64 = 32_768;
/// Rays of a pilot over those of its second rendering, which separates their noise from that of packets.
const FEWER_RAYS: u32 = 2;
/// Emissions of [`segments`]: half a chunk. Chosen, not measured.
pub const FEW: u64 = 256;
/// Bits that distinguish the seeds of second renderings and of [`segments`] from those of users: the golden ratio's.
const SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// Largest share of a run's time that its pilot takes in CPU seconds [1], even if a single processor works. Chosen, not measured.
pub const SHARE_OF_TIME: f64 = 0.3;

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
    /// Whether the cost matters, which takes two looks.
    pub is_priced: bool,
    /// CPU seconds that a pilot may take, where the clock matters; its first look takes what it takes.
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

/// A look at the first packets.
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
        before: Option<&Self>,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let PilotConfig { room, receivers, .. } = *config;
        let known = before.map(|before| &before.traced.map);
        let settings = Settings { emissions, ..config.trace };
        let header = room.whole_run(settings);
        let mut traced = trace(&header, room.geometry(), known, &mut InMemory, observer)?;
        // Only new packets are traced; all are written.
        traced.seconds.trace += before.map_or(0.0, |before| before.traced.seconds.trace);
        let rays = config.rays(emissions);
        let edges = before.is_none() && config.render.edges;
        let render = RenderSettings { seed: None, rays: Some(rays), edges, ..config.render.clone() };
        let (rendered, parameters) =
            render_and_read(&traced.map, room.geometry(), receivers, &render, observer)?;
        Ok(Self { emissions: emissions as f64, rays, traced, rendered, parameters })
    }

    /// CPU seconds of a look at so many emissions that is heard twice where rays are planned; at the most, as every
    /// phase but that of the deterministic parts is taken to grow in proportion.
    fn seconds_of(&self, emissions: u64, config: &PilotConfig<'_>) -> f64 {
        let (traced, rendered) = (self.traced.seconds, self.rendered.seconds);
        let more = emissions as f64 / self.emissions;
        let renderings = if config.is_traced && self.rendered.casts_rays { 2.0 } else { 1.0 };
        let once = rendered.deterministic + rendered.parameters + more * rendered.sweep;
        more * (traced.total() + rendered.prepare) + renderings * once
    }
}

/// Runs a pilot. Returns its packets, too, which the run continues.
///
/// # Errors
/// The errors of [`Room::trace`] and [`render_and_read`].
pub fn run(config: &PilotConfig<'_>, observer: &dyn Observer) -> Result<(Pilot, SonelMap)> {
    let clock = Watch(observer).clock();
    let begin = clock.process();
    let batches = config.trace.batches;
    let first = FIRST.max(LEAST_PER_BATCH * u64::from(batches));
    let mut before = None;
    let mut run = Run::of(config, first, None, observer)?;
    let pilot = loop {
        let emissions = run.traced.map.header().settings.emissions;
        let pilot = found(config, before.as_ref().unwrap_or(&run), &run, None);
        let needed = if pilot.spreads.iter().all(|spread| spread.variance.is_ok()) {
            pilot.typical_need(ACCURACY, batches).effort.emissions
        } else {
            u64::MAX
        };
        let next = FARTHEST * emissions;
        let is_enough = needed <= next && !(config.is_priced && before.is_none());
        let ends_late = config
            .seconds
            .is_some_and(|seconds| clock.process() - begin + run.seconds_of(next, config) > seconds);
        if is_enough || next > LONGEST || ends_late {
            break pilot;
        }
        let longer = Run::of(config, next, Some(&run), observer)?;
        before = Some(std::mem::replace(&mut run, longer));
    };
    if !(config.is_traced && run.rendered.casts_rays) {
        return Ok((pilot, run.traced.map));
    }
    let fewer = render_with_fewer_rays(config, &run, observer)?;
    Ok((found(config, before.as_ref().unwrap_or(&run), &run, Some(&fewer)), run.traced.map))
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

/// The same map, heard with fewer rays and other choices.
fn render_with_fewer_rays(config: &PilotConfig<'_>, run: &Run, observer: &dyn Observer) -> Result<Rendered> {
    let map = &run.traced.map;
    let seed = map.header().settings.seed.wrapping_mul(SEED);
    let rays = run.rays.div_ceil(FEWER_RAYS);
    let render = RenderSettings { seed: Some(seed), rays: Some(rays), ..config.render.clone() };
    render_and_read(map, config.room.geometry(), config.receivers, &render, observer)
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
    fn pilot(estimator: Estimator, is_priced: bool, seconds: Option<f64>) -> Pilot {
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
            is_priced,
            seconds,
        };
        let (pilot, map) = run(&config, &Ticking::default()).expect("a valid scene");
        assert_eq!(map.header().settings.emissions, pilot.emissions);
        let plan = Plan::of_trace(pilot.clone(), &scene, &receivers, 32, 0.001);
        assert!(plan.rows.iter().all(|row| row.price.trace.is_finite() && row.effort.emissions > 0));
        pilot
    }

    #[test]
    fn pilots_are_as_long_as_their_time_and_what_they_find_let_them() {
        assert_eq!(pilot(Estimator::Auto, false, None).emissions, FIRST);
        let priced = pilot(Estimator::Auto, true, None);
        assert_eq!(priced.emissions, FARTHEST * FIRST);
        assert!(priced.costs.trace.fixed > 0.0, "two looks tell what does not grow");
        assert_eq!(pilot(Estimator::Auto, true, Some(3.0)).emissions, FIRST);
    }

    /// Spheres alone: few paths reach them late.
    #[test]
    fn heavy_tails_make_pilots_longer() {
        assert!(pilot(Estimator::Sphere, false, None).emissions > FIRST);
    }
}
