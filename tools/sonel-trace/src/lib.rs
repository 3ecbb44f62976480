//! The library half of `sonel-trace`: from arguments to a sonel map and its report.

mod arguments;
mod extension;
mod report;

use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use sonel_console::clock::CpuClock;
use sonel_console::output::Output;
use sonel_console::progress::Progress;
use sonel_console::{Outcome, Stopwatch, scene, use_threads};
use sonel_geometry::Geometry;
use sonel_map::{Ledger, MapError, MapHeader, MapWriter, Settings, SonelMap};
use sonel_scene::{Loaded, Scene};
use sonel_study::effects::{self, Decision};
use sonel_tracer::{TraceError, TracedChunk, Tracer};

pub use arguments::Arguments;

/// Runs the program: data to `out`, everything else to `log`.
///
/// # Errors
/// When the scene, the options or the output are unusable, or the room leaks.
pub fn run(arguments: &Arguments, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let watch = Stopwatch::start();
    use_threads(arguments.threads)?;
    let settings = arguments.settings()?;
    let Loaded { scene, notes } = scene::load(&arguments.scene)?;
    for note in notes {
        writeln!(log, "note: {note}")?;
    }
    let geometry = scene.geometry().context("the scene's walls cannot be used")?;
    let Beginning { header, decisions, extended } = begin(arguments, settings, scene, &geometry)?;
    let (scene, shard) = (&header.scene, header.shard);

    let mut output = Output::create(&arguments.output)?;
    let tracer = Tracer::of(&header, &geometry);
    let total = tracer.packets(shard) * scene.sources.len() as u64;
    let progress = Progress::begin("tracing", total, arguments.quiet);
    let mut writer = MapWriter::begin(output.writer())?;
    let mut done = 0;
    let sink = |chunk: TracedChunk| {
        done += chunk.paths.ends.len() as u64;
        progress.reach(done);
        writer.push_chunk(chunk.source, chunk.first_emission, &chunk.paths, &chunk.books)
    };
    let books = match &extended {
        Some(map) => tracer.extend(map, sink),
        None => tracer.run(shard, sink),
    };
    progress.end();
    let books = books.map_err(|error| describe(error, &arguments.output))?;
    let vertices = writer.vertex_count();
    writer.finish(&header).map_err(|error| describe(TraceError::Sink(error), &arguments.output))?;
    // A map that is replaced by its extension must not be open meanwhile.
    drop(extended);
    output.publish()?;

    let run = report::Run {
        header: &header,
        decisions: &decisions,
        books: &books,
        stored: vertices,
        seconds: watch.seconds(),
    };
    writeln!(log, "{}", report::summary(&run, &arguments.output))?;
    if arguments.json {
        writeln!(out, "{}", report::json(&run))?;
    }
    check(&books)?;
    Ok(Outcome::Done)
}

/// What a run begins with.
struct Beginning {
    /// Provenance of the map that is asked for.
    header: MapHeader,
    /// Why its effects are as they are; none where a map was extended, which has decided.
    decisions: Vec<Decision>,
    /// The map that is extended.
    extended: Option<SonelMap>,
}

fn begin(
    arguments: &Arguments,
    settings: Settings,
    mut scene: Scene,
    geometry: &Geometry,
) -> anyhow::Result<Beginning> {
    if let Some(map) = &arguments.extend {
        let (header, map) = extension::open(map, arguments, &scene, geometry)?;
        return Ok(Beginning { header, decisions: Vec::new(), extended: Some(map) });
    }
    scene.duration = arguments.duration.unwrap_or(scene.duration);
    let spec = arguments.effects.clone().unwrap_or_default();
    let decisions = effects::decide(&spec, settings.mode, &mut scene, geometry, false, &CpuClock)?;
    let (tool_version, shard) = (env!("CARGO_PKG_VERSION").to_owned(), arguments.shard_range());
    let effects = decisions.iter().map(Decision::state).collect();
    let header = MapHeader { tool_version, settings, shard, effects, scene };
    Ok(Beginning { header, decisions, extended: None })
}

fn describe(error: TraceError<MapError>, output: &Path) -> anyhow::Error {
    match error {
        TraceError::Sink(error) => anyhow::Error::new(error)
            .context(format!("cannot write {}; an older file there is untouched", output.display())),
        other => other.into(),
    }
}

/// The books of a run must close; anything else is a defect of the program, and its map is not to be trusted.
fn check(books: &Ledger) -> anyhow::Result<()> {
    let residual = books.worst_residual();
    if residual > 1e-9 {
        bail!("the energy ledger does not close (relative residual {residual:e}): please report this scene");
    }
    Ok(())
}
