//! The library half of `sonel-trace`: writes a sonel map and its report.

mod arguments;
mod check;
mod extension;
mod materials;
mod new;
mod planning;
mod program;
mod report;
mod until;
mod variants;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use anyhow::{Context, bail};
use serde_json::{Value, json};
use sonel_console::output::{Kind, Output};
use sonel_console::plan as console;
use sonel_console::progress::{Progress, ProgressSink};
use sonel_console::version::version;
use sonel_console::{Outcome, Stopwatch, scene, use_threads};
use sonel_geometry::Geometry;
use sonel_map::{Ledger, MapError, MapHeader, MapWriter, Mode, Settings, SonelMap};
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_study::effects::{self, Decision};
use sonel_study::pilot::{Pilot, SHARE_OF_TIME};
use sonel_study::pipeline::Room;
use sonel_study::plan::Plan;
use sonel_study::room_decay;
use sonel_study::spread::PLANNED;
use sonel_tracer::{TraceError, TracedChunk, Tracer};

use planning::Planner;
use until::Goal;

pub use arguments::Arguments;
pub use check::json as checkup_json;
pub use program::Program;

/// Of this program, as maps state it.
static VERSION: LazyLock<String> = LazyLock::new(|| version(sonel_tracer::REVISION));

/// Runs the program: data to `out`, everything else to `log`.
///
/// # Errors
/// When the scene, the options or the output are unusable, or the room leaks.
pub fn run(arguments: &Arguments, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let progress = ProgressSink::unless(arguments.quiet);
    run_on(|log| scene::load(&arguments.scene, progress, log), arguments, progress, out, log)
}

/// Runs the program on the scene that `load` returns with its walls and the files it was read from, instead of the one that
/// `arguments` name.
///
/// # Errors
/// As [`run`], and those of `load`.
pub fn run_on(
    load: impl FnOnce(&mut dyn Write) -> anyhow::Result<(Scene, Geometry, Vec<PathBuf>)>,
    arguments: &Arguments,
    progress: ProgressSink<'_>,
    out: &mut dyn Write,
    log: &mut dyn Write,
) -> anyhow::Result<Outcome> {
    let watch = Stopwatch::start();
    use_threads(arguments.threads)?;
    let settings = arguments.settings()?;
    let (scene, geometry, inputs) = load(log)?;
    let (Beginning { header, decisions, extended: beginning }, geometry) =
        begin(arguments, settings, (scene, geometry), log)?;
    let scene = header.scene.clone();
    if !scene.variants.is_empty() {
        writeln!(log, "{}", variants::in_words(&scene))?;
    }
    let room = Room::within(&scene, geometry, header.effects.clone());
    let planner = Planner::new(&room, header.settings);
    let (pilot, planned) = show_plan(arguments, &planner, &header, &decisions, out)?;
    let Some(path) = &arguments.output else {
        if arguments.json {
            let effects = report::effects_json(&header, &decisions);
            writeln!(out, "{}", json!({ "effects": effects, "plan": planned }))?;
        }
        return Ok(Outcome::Done);
    };
    // A map that is extended may be replaced by the longer one.
    let create = || Output::create(path, Kind::MAP, &inputs);
    // Whatever is wrong with the output shall be said before the work is done.
    drop(create()?);
    if arguments.sonels.is_some() {
        planner.check_feasible(header.shard)?;
    }
    let (traced, mut told, outcome) = match &arguments.until {
        Some(targets) => {
            let (sonels, seconds) = (arguments.sonels, arguments.at_most);
            let goal = Goal { targets, sonels, seconds, watch: &watch, progress, create: &create };
            until::until(&planner, &header, beginning, &goal, log)?
        }
        None => {
            let once = Once { arguments, header, beginning, pilot, watch: &watch, progress };
            once.run(&planner, create()?, log)?
        }
    };
    let Traced { header, ledger, stored, output } = traced;
    output.publish()?;
    let seconds = watch.seconds();
    let run = report::Run { header: &header, decisions: &decisions, ledger: &ledger, stored, seconds };
    writeln!(log, "{}", report::summary(&run, path))?;
    warn_of_empty_batches(&header.settings, log)?;
    if arguments.json {
        if arguments.plan {
            told["plan"] = planned;
        }
        writeln!(out, "{}", report::json(&run, &told))?;
    }
    check(&ledger)?;
    Ok(outcome)
}

/// Says in words what the run of `header` takes, or returns it as JSON, with the pilot that found it; where it is asked for.
fn show_plan(
    arguments: &Arguments,
    planner: &Planner<'_>,
    header: &MapHeader,
    decisions: &[Decision],
    out: &mut dyn Write,
) -> anyhow::Result<(Option<Pilot>, Value)> {
    if !arguments.plan {
        return Ok((None, Value::Null));
    }
    let plan = plan(planner, header, arguments.at_most)?;
    if arguments.json {
        let planned = console::json(&plan);
        return Ok((Some(plan.pilot), planned));
    }
    let effects = if decisions.is_empty() {
        report::effects(header)
    } else {
        report::weighed(header, decisions, &effects::skips(&header.scene, header.settings.spectral))
    };
    write!(out, "effects:\n{effects}\n\n{}", console::trace_table(&plan))?;
    Ok((Some(plan.pilot), Value::Null))
}

/// A run of a number of sonels that is known before it begins.
struct Once<'a> {
    arguments: &'a Arguments,
    header: MapHeader,
    /// The map that is extended.
    beginning: Option<SonelMap>,
    /// The pilot of a plan.
    pilot: Option<Pilot>,
    watch: &'a Stopwatch,
    progress: ProgressSink<'a>,
}

impl Once<'_> {
    /// Traces into `output`; says to `log` and in JSON what was predicted and what came of it.
    fn run(
        self,
        planner: &Planner<'_>,
        output: Output,
        log: &mut dyn Write,
    ) -> anyhow::Result<(Traced, Value, Outcome)> {
        let Self { arguments, header, beginning, pilot, watch, progress } = self;
        let before = watch.seconds().1;
        let mut traced = trace(header, planner.room.geometry(), beginning.as_ref(), output, progress)?;
        let seconds = watch.seconds().1 - before;
        // A map that is replaced by its extension must not be open meanwhile.
        drop(beginning);
        let Some(pilot) = pilot.filter(|_| arguments.shard.is_none()) else {
            return Ok((traced, json!({}), Outcome::Done));
        };
        let comparison = until::compare_planned(planner, &pilot, &mut traced, seconds)?;
        writeln!(log, "{}", comparison.line())?;
        Ok((traced, comparison.json(), Outcome::Done))
    }
}

fn warn_of_empty_batches(settings: &Settings, log: &mut dyn Write) -> anyhow::Result<()> {
    let Settings { emissions, batches, .. } = *settings;
    if emissions < u64::from(batches) {
        writeln!(
            log,
            "warning: {emissions} sonels in {batches} batches: some batches are empty, intervals are unreliable"
        )?;
    }
    Ok(())
}

/// A traced map that is not published yet.
struct Traced {
    header: MapHeader,
    ledger: Ledger,
    /// Vertices.
    stored: u64,
    output: Output,
}

/// Traces the run of `header` into `output`, from `beginning` on.
fn trace(
    header: MapHeader,
    geometry: &Geometry,
    beginning: Option<&SonelMap>,
    mut output: Output,
    progress: ProgressSink<'_>,
) -> anyhow::Result<Traced> {
    let (scene, shard) = (&header.scene, header.shard);
    let target = output.target().to_owned();
    let tracer = Tracer::of(&header, geometry);
    let total = tracer.packets(shard) * scene.sources.len() as u64;
    let progress = Progress::begin("tracing", total, progress);
    let mut writer = MapWriter::begin(output.writer())?;
    let mut done = 0;
    let sink = |chunk: TracedChunk| {
        done += chunk.paths.ends.len() as u64;
        progress.reach(done);
        writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.ledger)
    };
    let ledger = match beginning {
        Some(beginning) => tracer.extend(beginning, sink),
        None => tracer.run(shard, sink),
    };
    progress.end();
    let ledger = ledger.map_err(|error| describe(error, &target))?;
    let stored = writer.vertex_count();
    writer.finish(&header, geometry).map_err(|error| describe(TraceError::Sink(error), &target))?;
    Ok(Traced { ledger, stored, output, header })
}

/// The plan for the run of `header`, which may take so many seconds.
fn plan(planner: &Planner<'_>, header: &MapHeader, at_most: Option<f64>) -> anyhow::Result<Plan> {
    let pilot = planner.pilot(&PLANNED, at_most.map(|seconds| SHARE_OF_TIME * seconds))?;
    let bin = RenderSettings::default().bin;
    Ok(Plan::of_trace(pilot, &header.scene, &planner.evaluation_receivers, header.settings.batches, bin))
}

/// What a run begins with.
struct Beginning {
    /// Provenance of the map that is asked for.
    header: MapHeader,
    /// Why its effects are as they are; none where a map has decided.
    decisions: Vec<Decision>,
    /// The map that is extended.
    extended: Option<SonelMap>,
}

/// What the run of `scene` begins with, and its walls. Says to `log` how long it is where the room decides that.
fn begin(
    arguments: &Arguments,
    settings: Settings,
    (mut scene, mut geometry): (Scene, Geometry),
    log: &mut dyn Write,
) -> anyhow::Result<(Beginning, Geometry)> {
    let spec = arguments.effects.clone().unwrap_or_default();
    if settings.mode == Mode::Accurate && spec.names_diffraction() {
        bail!(
            "--effects: edges are computed at the receivers: leave diffraction out here, sonel-render --effects -diffraction switches it off"
        );
    }
    if let Some(duration) = arguments.duration {
        scene = scene.with_duration(duration);
    }
    variants::add(&arguments.variants, &mut scene, &geometry)?;
    if settings.mode == Mode::Paper && !scene.variants.is_empty() {
        bail!(
            "--mode paper draws every event with the materials of the scene: leave --for and `variants` out"
        );
    }
    // A map that is extended has decided.
    if arguments.extend.is_none() {
        geometry = effects::leave_regions_out(&spec, settings.mode, &mut scene, geometry)
            .context("the scene's walls cannot be used")?;
    }
    // Another map may have decided to leave regions out: the walls are those of its scene.
    let decided = |header: MapHeader, extended| {
        let geometry = header.scene.geometry()?;
        Ok((Beginning { header, decisions: Vec::new(), extended }, geometry))
    };
    if let Some(map) = &arguments.extend {
        let (header, map) = extension::open(map, arguments, &scene, &geometry)?;
        return decided(header, Some(map));
    }
    if let Some(problem) = scene.profile_problem(&geometry) {
        bail!("air.sound_speed_gradient: {problem}");
    }
    let (tool_version, shard) = (VERSION.clone(), arguments.shard_range());
    if let Some(map) = &arguments.decision {
        let (effects, scene) = extension::decided(map, settings.mode, &scene)?;
        return decided(MapHeader { tool_version, settings, shard, effects, scene }, None);
    }
    let decisions = effects::decide(&spec, settings.mode, &mut scene, &geometry);
    if let Some(sentence) = room_decay::lengthen(&mut scene, &geometry)? {
        writeln!(log, "{sentence}")?;
    }
    let effects = effects::states(&decisions, settings.mode);
    let header = MapHeader { tool_version, settings, shard, effects, scene };
    Ok((Beginning { header, decisions, extended: None }, geometry))
}

fn describe(error: TraceError<MapError>, output: &Path) -> anyhow::Error {
    match error {
        TraceError::Sink(error) => anyhow::Error::new(error)
            .context(format!("cannot write {}; an older file there is untouched", output.display())),
        other => other.into(),
    }
}

/// The ledger of a run must close; anything else is a defect of the program, and its map is not to be trusted.
fn check(ledger: &Ledger) -> anyhow::Result<()> {
    let residual = ledger.worst_residual();
    if residual > 1e-9 {
        bail!("the energy ledger does not close (relative residual {residual:e}): please report this scene");
    }
    Ok(())
}
