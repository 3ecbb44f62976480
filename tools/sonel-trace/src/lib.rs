//! The library half of `sonel-trace`: the command line of [`sonel::Scene::trace`].

mod arguments;
mod check;
mod materials;
mod new;
mod program;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use serde_json::{Value, json};
use sonel::map::{MapError, SonelMap};
use sonel::plan as tables;
use sonel::{Map, MapStore, Scene};
use sonel_console::follower::Follower;
use sonel_console::output::{self, Kind, Output, failed};
use sonel_console::{Log, Outcome, speak_as, spelled, use_threads};

pub use arguments::Arguments;
pub use program::Program;

/// Runs the program: data to `out`, everything else to `log`.
///
/// # Errors
/// When the scene, the options or the output are unusable, or the room leaks.
pub fn run(arguments: &Arguments, out: &mut dyn Write, log: &mut Log<'_>) -> anyhow::Result<Outcome> {
    speak_as::<Program>();
    let follower = Follower::new(arguments.quiet, log).verbose(arguments.verbose);
    use_threads(arguments.threads)?;
    let mut options = arguments.options();
    options.settings().map_err(spelled)?;
    arguments.output.iter().try_for_each(|path| output::check_place(path))?;
    let scene = follower.result(Scene::load(&arguments.scene, &follower))?;
    // Whatever is wrong with the output shall be said before the work is done.
    let inputs: Vec<PathBuf> = scene.files().iter().chain(&arguments.decision).cloned().collect();
    let create = |path: &Path| Output::create(path, Kind::MAP, &inputs);
    arguments.output.iter().try_for_each(|path| create(path).map(drop))?;
    let [extended, decision] = [&arguments.extend, &arguments.decision]
        .map(|path| path.as_ref().map(Map::open).transpose().map_err(spelled));
    let (extended, decision) = (extended?, decision?);
    (options.extend, options.decision) = (extended.as_ref(), decision.as_ref());
    let prepared = follower.result(scene.prepare(&options, &follower))?;
    let plan = arguments.plan.then(|| follower.result(prepared.plan(&follower))).transpose()?;
    if let Some(plan) = plan.as_ref().filter(|_| !arguments.json) {
        write!(out, "effects:\n{}\n\n{}", prepared.effects(), tables::trace_table(plan))?;
    }
    let planned = plan.as_ref().filter(|_| arguments.json).map_or(Value::Null, tables::json);
    let Some(path) = &arguments.output else {
        if arguments.json {
            writeln!(out, "{}", json!({ "effects": prepared.effects_json(), "plan": planned }))?;
        }
        return Ok(Outcome::Done);
    };
    let mut outputs = MapOutputs { create: &|| create(path), last: None };
    let traced = match prepared.trace(plan.as_ref(), &mut outputs, &follower) {
        Err(sonel::Error::Write(error)) => return Err(anyhow!(error).context(failed(path))),
        other => follower.result(other)?,
    };
    let output = outputs.last.expect("a trace writes a map");
    let mut report = traced.report();
    let (summary, is_reached) = (traced.summary(), traced.is_reached);
    // A map that is replaced must not be open meanwhile.
    drop((traced, extended));
    output.publish()?;
    follower.line(&format!("{summary}; written to {}", path.display()))?;
    if arguments.json {
        if arguments.plan {
            report["plan"] = planned;
        }
        writeln!(out, "{report}")?;
    }
    Ok(if is_reached == Some(false) { Outcome::Missed } else { Outcome::Done })
}

/// Keeps maps beside their final place; the last one is published.
struct MapOutputs<'a> {
    create: &'a dyn Fn() -> anyhow::Result<Output>,
    last: Option<Output>,
}

impl MapStore for MapOutputs<'_> {
    type Writer = Output;

    fn begin(&mut self) -> std::io::Result<Output> {
        (self.create)().map_err(|error| std::io::Error::other(format!("{error:#}")))
    }

    fn open(&mut self, mut written: Output) -> Result<SonelMap, MapError> {
        let map = SonelMap::open(written.file()?)?;
        self.last = Some(written);
        Ok(map)
    }
}
