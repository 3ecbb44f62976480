//! The trace of a scene: options, plan, run.

mod extension;
mod options;
mod planner;
mod report;
mod until;

use std::sync::{Arc, LazyLock};

use crate::study::effects::{self, Decision};
use crate::study::pilot::SHARE_OF_TIME;
use crate::study::pipeline::{MapStore, Room, TracedMap, trace};
use crate::study::plan::Plan;
use crate::study::room_decay;
use serde_json::{Value, json};
use sonel_geometry::Geometry;
use sonel_map::{Ledger, MapHeader, Mode, Settings};
use sonel_renderer::RenderSettings;

use crate::error::At;
use crate::observer::{Observer, Severity, Watch};
use crate::plan::extend;
use crate::store::TemporaryMaps;
use crate::until::Goal;
use crate::version::version;
use crate::{Error, Map, Result, Scene, variants};

use planner::Planner;

pub use options::TraceOptions;

/// Version of the tracer, as maps state it.
pub static VERSION: LazyLock<String> = LazyLock::new(|| version(sonel_tracer::REVISION));

/// A finished run.
#[derive(Debug)]
pub struct Traced {
    /// The map.
    pub map: Map,
    /// Energy balance and fates of the packets.
    pub ledger: Ledger,
    /// Why effects are on or off; none where another map has decided.
    pub decisions: Vec<Decision>,
    /// Whether the targets of `until` were reached; none without.
    pub is_reached: Option<bool>,
    /// Seconds by the observer's clock at the end: on the wall, and of the processor.
    pub seconds: (f64, f64),
    /// Further fields of the report.
    extra: Value,
}

impl Traced {
    /// Provenance of the map.
    fn header(&self) -> &MapHeader {
        self.map.sonels().header()
    }
}

impl Scene {
    /// Traces the scene into a map in a temporary file, which is gone with the map.
    ///
    /// # Errors
    /// Options that are out of range or contradict the scene; a room that leaks; a full disk; [`Error::Stopped`].
    pub fn trace(&self, options: &TraceOptions<'_>, observer: &dyn Observer) -> Result<Traced> {
        self.prepare(options, observer)?.trace(None, &mut TemporaryMaps::default(), observer)
    }

    /// Predicts cost and intervals of traces for several accuracies; `packets` does not matter, `at_most` limits the plan, too.
    ///
    /// # Errors
    /// The errors of [`Self::trace`].
    pub fn plan(&self, options: &TraceOptions<'_>, observer: &dyn Observer) -> Result<Plan> {
        self.prepare(options, observer)?.plan(observer)
    }

    /// Decides everything about a trace and traces nothing.
    ///
    /// # Errors
    /// Options that are out of range or contradict the scene.
    pub fn prepare<'a>(
        &self,
        options: &'a TraceOptions<'a>,
        observer: &dyn Observer,
    ) -> Result<PreparedTrace<'a>> {
        let (settings, watch) = (options.settings()?, Watch(observer));
        watch.require_clock(options.at_most)?;
        let prepared = begin(self, options, settings, watch)?;
        if !prepared.header.scene.variants.is_empty() {
            watch.info(&variants::in_words(&prepared.header.scene))?;
        }
        Ok(prepared)
    }
}

/// A trace about which everything is decided.
pub struct PreparedTrace<'a> {
    options: &'a TraceOptions<'a>,
    header: MapHeader,
    decisions: Vec<Decision>,
    geometry: Arc<Geometry>,
}

impl PreparedTrace<'_> {
    fn planner(&self) -> Planner<'_> {
        let room = Room::within(&self.header.scene, &self.geometry, &self.header.effects);
        Planner::new(room, self.header.settings)
    }

    /// Predicts cost and intervals of traces for several accuracies.
    ///
    /// # Errors
    /// A room that leaks; [`Error::Stopped`].
    pub fn plan(&self, observer: &dyn Observer) -> Result<Plan> {
        let planner = self.planner();
        let seconds = self.options.at_most.map(|seconds| SHARE_OF_TIME * seconds);
        let pilot = planner.pilot(seconds, Watch(observer))?;
        let bin = RenderSettings::default().bin;
        let Planner { evaluation_receivers, settings, .. } = &planner;
        Ok(Plan::of_trace(pilot, &self.header.scene, evaluation_receivers, settings.batches, bin))
    }

    /// Decisions on effects with their reasons, in lines.
    #[must_use]
    pub fn effects(&self) -> String {
        report::effects_in_words(&self.header, &self.decisions)
    }

    /// The same as JSON.
    #[must_use]
    pub fn effects_json(&self) -> Vec<Value> {
        report::effects_json(&self.header, &self.decisions)
    }

    /// Traces into a map that `store` keeps. With a `plan` the report compares.
    ///
    /// # Errors
    /// A run that no machine can do; a room that leaks; a store that cannot be written; [`Error::Stopped`].
    pub fn trace(
        self,
        plan: Option<&Plan>,
        store: &mut impl MapStore,
        observer: &dyn Observer,
    ) -> Result<Traced> {
        let (planner, watch) = (self.planner(), Watch(observer));
        if self.options.packets.is_some() || self.options.until.is_none() {
            let MapHeader { settings, shard, .. } = &self.header;
            let time = self.options.at_most.filter(|_| self.options.until.is_none());
            let emissions = settings.emissions as f64 / f64::from(shard.count);
            planner.check_feasible(emissions, [self.options.memory, time], watch)?;
        }
        let Finished { traced, extra, is_reached } = self.run(&planner, plan, store, watch)?;
        let TracedMap { map, ledger, .. } = traced;
        let seconds = watch.seconds();
        drop(planner);
        let map = Map::within(map, "the map".to_owned(), self.geometry);
        warn_of_empty_batches(&self.header.settings, watch)?;
        check(&ledger)?;
        Ok(Traced { map, ledger, decisions: self.decisions, is_reached, seconds, extra })
    }

    fn run(
        &self,
        planner: &Planner<'_>,
        plan: Option<&Plan>,
        store: &mut impl MapStore,
        watch: Watch<'_>,
    ) -> Result<Finished> {
        let beginning = self.options.extend.map(Map::sonels);
        if let Some(targets) = &self.options.until {
            let (most, seconds) = (self.options.packets, self.options.at_most);
            let goal = Goal { targets, most, seconds, watch };
            return until::until(planner, &self.header, beginning, &goal, store);
        }
        let before = watch.seconds().1;
        let traced = trace(&self.header, &self.geometry, beginning, store, watch.0)?;
        let mut extra = json!({});
        let seconds = watch.seconds().1 - before;
        if let Some(plan) = plan.filter(|_| self.options.shard.is_none()) {
            let comparison = until::compare_planned(planner, &plan.pilot, &traced.map, seconds, watch)?;
            watch.info(&comparison.line())?;
            extend(&mut extra, &comparison.json());
        }
        Ok(Finished { traced, extra, is_reached: None })
    }
}

/// A run and further fields of its report.
struct Finished {
    traced: TracedMap,
    extra: Value,
    /// Whether targets were reached; none without.
    is_reached: Option<bool>,
}

fn warn_of_empty_batches(settings: &Settings, watch: Watch<'_>) -> Result<()> {
    let Settings { emissions, batches, .. } = *settings;
    if emissions >= u64::from(batches) {
        return Ok(());
    }
    let text =
        format!("{emissions} packets in {batches} batches: some batches are empty, intervals are unreliable");
    watch.say(Severity::Warning, &text)
}

/// Decides everything about the run of `scene`. Says how long it is where the room decides that.
fn begin<'a>(
    scene: &Scene,
    options: &'a TraceOptions<'a>,
    settings: Settings,
    watch: Watch<'_>,
) -> Result<PreparedTrace<'a>> {
    let asked = options.effects.clone().unwrap_or_default();
    if settings.mode == Mode::Accurate && asked.names_rendered() {
        return Err(Error::Options(vec![
            "`effects`: edges and the boundary term are computed at the receivers: leave diffraction and boundary out here, `effects` -diffraction,-boundary of the rendering switches them off"
                .to_owned(),
        ]));
    }
    let (mut scene, mut geometry) = (scene.compiled().clone(), scene.shared_geometry());
    if let Some(duration) = options.duration {
        scene = scene.with_duration(duration);
    }
    variants::add(&options.variants, &mut scene, &geometry)?;
    if settings.mode == Mode::Paper && !scene.variants.is_empty() {
        return Err(Error::Options(vec![
            "`mode` paper draws every event with the materials of the scene: leave `variants` out".to_owned(),
        ]));
    }
    // A map that is extended has decided.
    if options.extend.is_none() {
        geometry = effects::leave_regions_out(&asked, settings.mode, &mut scene, geometry)
            .at(|| "the scene's walls cannot be used".to_owned())?;
    }
    // Another map may have decided to leave regions out: the walls are those of its scene.
    let decided = |header: MapHeader| {
        let geometry = Arc::new(header.scene.geometry()?);
        Ok(PreparedTrace { options, header, decisions: Vec::new(), geometry })
    };
    if let Some(map) = options.extend {
        return decided(extension::longer(map, options, &scene, &geometry)?);
    }
    if let Some(problem) = scene.profile_problem(&geometry) {
        return Err(Error::refused(format!("air.sound_speed_gradient: {problem}")));
    }
    let (tool_version, shard) = (VERSION.clone(), options.shard_range());
    if let Some(map) = options.decision {
        let (effects, scene) = extension::decided(map, settings.mode, &scene)?;
        let emissions = options.packets.unwrap_or(map.sonels().header().settings.emissions);
        let settings = Settings { emissions, ..settings };
        return decided(MapHeader { tool_version, settings, shard, effects, scene });
    }
    let decisions = effects::decide(&asked, settings.mode, &mut scene, &geometry);
    if let Some(sentence) = room_decay::lengthen(&mut scene, &geometry)? {
        watch.info(&sentence)?;
    }
    let effects = effects::states(&decisions, settings.mode);
    let header = MapHeader { tool_version, settings, shard, effects, scene };
    Ok(PreparedTrace { options, header, decisions, geometry })
}

/// The ledger of a run must close; anything else is a defect of the program, and its map is not to be trusted.
fn check(ledger: &Ledger) -> Result<()> {
    let residual = ledger.worst_residual();
    if residual > 1e-9 {
        return Err(Error::refused(format!(
            "the energy ledger does not close (relative residual {residual:e}): please report this scene"
        )));
    }
    Ok(())
}
