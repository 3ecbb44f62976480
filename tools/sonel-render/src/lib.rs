//! The library half of `sonel-render`: from a map and arguments to a response.

mod arguments;
mod assemble;
mod change;
mod planning;
mod receivers;
mod remedy;
mod sound;
mod until;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use anyhow::{Context, bail};
use serde_json::{Value, json};
use sonel_acoustics::Air as AirState;
use sonel_analysis::what_if::{Fitness, fitness};
use sonel_console::output::{Kind, Output};
use sonel_console::plan as console;
use sonel_console::progress::ProgressSink;
use sonel_console::quantity::counted;
use sonel_console::version::version;
use sonel_console::{Outcome, Stopwatch, input, use_threads};
use sonel_echogram::Response;
use sonel_geometry::Geometry;
use sonel_map::{Mode, SonelMap};
use sonel_renderer::{Air, Estimator, ReceiverPoint, RenderSettings, Renderer, Rendering};
use sonel_scene::Scene;
use sonel_sound::Synthesizer;

use assemble::{Job, Run};
use receivers::{Gathered, GridCounts};
use sound::SoundFiles;
use until::{Finished, Goal};

pub use arguments::{Arguments, Grid};

/// Of this program, as responses state it.
static VERSION: LazyLock<String> = LazyLock::new(|| version(sonel_renderer::REVISION));

/// Runs the program: data to `out`, everything else to `log`.
///
/// # Errors
/// When the map is damaged, a receiver impossible, or the output cannot be written.
pub fn run(arguments: &Arguments, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let watch = Stopwatch::start();
    use_threads(arguments.threads)?;
    let label = arguments.map.display().to_string();
    let file = input::open(&arguments.map).with_context(|| format!("cannot read the map {label}"))?;
    let mut map = SonelMap::open(&file).with_context(|| label.clone())?;
    let Prepared { warnings, geometry, settings, receivers, grid } =
        prepare(&mut map, &label, arguments, log)?;
    let opened = watch.seconds().1;
    let (map, geometry, progress) = (&map, &geometry, ProgressSink::unless(arguments.quiet));
    let scene = &map.header().scene;
    let job = Job { map, geometry, label: &label, receivers: &receivers, watch: &watch, progress };
    // Whatever is wrong with the output shall be said before the work is done.
    let inputs = inputs(arguments);
    let create = |target: &Path| Output::create(target, Kind::RESPONSE, &inputs);
    let output = arguments.output.as_deref().map(create).transpose()?;
    let sounds = SoundFiles::of(arguments, scene, &receivers, &inputs)?;
    let plan = arguments.plan.then(|| planning::plan(&job, &settings, arguments.at_most)).transpose()?;
    if let Some(plan) = plan.as_ref().filter(|_| !arguments.json) {
        write!(out, "{}", console::map_table(plan, &label))?;
    }
    let planned = plan.as_ref().map_or(Value::Null, console::json);
    let Some(output) = output else {
        if arguments.json {
            writeln!(out, "{}", json!({ "plan": planned }))?;
        }
        return Ok(Outcome::Done);
    };

    let (mut run, mut told, outcome) = render(&job, &settings, arguments, log)?;
    if let Some(shard) = arguments.shard {
        run.response.mark_as_part(shard.index, shard.count);
    }
    let target = output.target().display().to_string();
    output.write(|out| run.response.write(out).map(drop))?;
    if let Some(sounds) = sounds {
        let seed = run.settings.seed.unwrap_or(map.header().settings.seed);
        sounds.write(&Synthesizer::new(&run.response, geometry.volume(), seed), scene.up)?;
        let files = counted(sounds.count(), "impulse response");
        writeln!(log, "{files} written to {}", sounds.folder.display())?;
    }
    let seconds = watch.seconds();
    writeln!(log, "{}; written to {target}", summary(&job, seconds))?;
    told["warnings"] = remark(&run, warnings, log)?.into();
    if let Some(plan) = &plan {
        let comparison = planning::compare(plan, &job, &run, opened);
        writeln!(log, "{}", comparison.line())?;
        extend(&mut told, &comparison.json());
        told["plan"] = planned;
    }
    if let Some(grid) = grid {
        told["grid"] = grid.json();
    }
    if arguments.json {
        writeln!(out, "{}", run.report(seconds, &told))?;
    }
    Ok(outcome)
}

/// Scene, receivers, sources, and how long the run took: wall and CPU time [s].
fn summary(job: &Job<'_>, (wall, cpu): (f64, f64)) -> String {
    let scene = &job.map.header().scene;
    let receivers = counted(job.receivers.len(), "receiver");
    let sources = counted(scene.sources.len(), "source");
    format!("{}: {receivers}, {sources}; {wall:.2} s ({cpu:.2} CPU seconds)", scene.name)
}

/// Adds the fields of `more` to `object`.
fn extend(object: &mut Value, more: &Value) {
    for (key, value) in more.as_object().into_iter().flatten() {
        object[key] = value.clone();
    }
}

/// What a rendering begins with.
struct Prepared {
    /// What is to be warned of.
    warnings: Vec<String>,
    geometry: Geometry,
    settings: RenderSettings,
    receivers: Vec<ReceiverPoint>,
    grid: Option<GridCounts>,
}

/// Changes `map`, which messages call `label`, as it is asked for; finds the receivers.
fn prepare(
    map: &mut SonelMap,
    label: &str,
    arguments: &Arguments,
    log: &mut dyn Write,
) -> anyhow::Result<Prepared> {
    let warnings = change_map(map, arguments, label)?;
    let scene = &map.header().scene;
    let geometry = scene.geometry().with_context(|| format!("{label}: the walls cannot be used"))?;
    let settings = render_settings(arguments, scene)?;
    let Gathered { mut receivers, grid } = receivers::gather(arguments, scene, &geometry, log)?;
    if let Some(shard) = arguments.shard {
        receivers = receivers::part(receivers, shard)?;
    }
    Ok(Prepared { warnings, geometry, settings, receivers, grid })
}

/// The files that are read.
fn inputs(arguments: &Arguments) -> Vec<PathBuf> {
    std::iter::once(&arguments.map)
        .chain(&arguments.receivers_file)
        .chain(&arguments.materials)
        .chain(&arguments.hrtf)
        .cloned()
        .chain(arguments.set.iter().filter_map(change::Assignment::file))
        .collect()
}

/// Renders `map`, which messages call `label`, as [`run`] would, but writes no file. Returns the response and the report of `--json`.
///
/// # Errors
/// When the map is damaged or a receiver impossible.
pub fn respond(
    map: &mut SonelMap,
    label: &str,
    arguments: &Arguments,
    progress: ProgressSink<'_>,
    log: &mut dyn Write,
) -> anyhow::Result<(Response, Value)> {
    let watch = Stopwatch::start();
    let Prepared { warnings, geometry, settings, receivers, grid } = prepare(map, label, arguments, log)?;
    let job = Job { map, geometry: &geometry, label, receivers: &receivers, watch: &watch, progress };
    let (run, mut told, _) = render(&job, &settings, arguments, log)?;
    told["warnings"] = remark(&run, warnings, log)?.into();
    if let Some(grid) = grid {
        told["grid"] = grid.json();
    }
    let report = run.report(watch.seconds(), &told);
    Ok((run.response, report))
}

/// Renders once, or until the targets are kept; with what `--json` prints of it.
fn render<'a>(
    job: &Job<'a>,
    settings: &RenderSettings,
    arguments: &Arguments,
    log: &mut dyn Write,
) -> anyhow::Result<(Run<'a>, Value, Outcome)> {
    let Some(targets) = &arguments.until else {
        return Ok((job.render(settings.clone())?, json!({}), Outcome::Done));
    };
    let goal = Goal { targets, rays: arguments.rays, seconds: arguments.at_most };
    let Finished { run, verdict, told } = until::until(job, settings, &goal, log)?;
    Ok((run, told, if verdict.is_reached() { Outcome::Done } else { Outcome::Missed }))
}

/// Logs the shares of the path classes and what is to be warned of, `warnings` first; returns all warnings.
fn remark(run: &Run<'_>, warnings: Vec<String>, log: &mut dyn Write) -> anyhow::Result<Vec<String>> {
    log_classes(&run.renderer, &run.renderings, log)?;
    for sentence in &warnings {
        writeln!(log, "warning: {sentence}")?;
    }
    Ok(warnings)
}

/// Gives `map` the materials and directivities that were asked for; returns what is to be warned of.
fn change_map(map: &mut SonelMap, arguments: &Arguments, label: &str) -> anyhow::Result<Vec<String>> {
    let Arguments { materials, set, .. } = arguments;
    if materials.is_none() && set.is_empty() {
        return Ok(Vec::new());
    }
    if map.header().settings.mode == Mode::Paper || arguments.estimator == Estimator::Paper {
        bail!(
            "the paper's estimator draws events anew with the materials of the map: leave --set and --materials out"
        );
    }
    let scene = &map.header().scene;
    let geometry = scene.geometry().with_context(|| format!("{label}: the walls cannot be used"))?;
    let (materials, sources) = change::changed(scene, materials.as_deref(), set)?;
    map.require_whole().with_context(|| label.to_owned())?;
    map.check_surfaces(&geometry).with_context(|| label.to_owned())?;
    map.check_paths(geometry.surfaces().len() as u32).with_context(|| label.to_owned())?;
    map.change(materials, sources);
    let Fitness { refusals, warnings } = fitness(map, &geometry);
    let command = remedy::command(map.header(), map.drawn_with(), &geometry, label);
    if !refusals.is_empty() {
        let reasons = refusals.join("\nerror: ");
        bail!("{label} does not support these materials: {reasons}; trace the scene for them: {command}");
    }
    Ok(warnings
        .into_iter()
        .map(|sentence| format!("{sentence}; for narrower intervals: {command}"))
        .collect())
}

fn render_settings(arguments: &Arguments, scene: &Scene) -> anyhow::Result<RenderSettings> {
    let default = RenderSettings::of(arguments.estimator);
    Ok(RenderSettings {
        bin: arguments.bin,
        mirror_order: arguments.order,
        rays: arguments.rays,
        gather_radius: arguments.radius,
        seed: arguments.seed,
        air: air(arguments, scene)?,
        edges: arguments.effects.diffracts(),
        directions: arguments.directions || arguments.ambix.is_some() || arguments.hrtf.is_some(),
        ..default
    })
}

/// The air asked for. Its state changes the attenuation; travel times are those of the traced scene.
fn air(arguments: &Arguments, scene: &Scene) -> anyhow::Result<Air> {
    if arguments.no_air {
        return Ok(Air::Attenuation(vec![0.0; scene.bands.count()]));
    }
    if arguments.temperature.is_none() && arguments.humidity.is_none() {
        return Ok(Air::OfScene);
    }
    let state = AirState {
        temperature_celsius: arguments.temperature.unwrap_or(scene.air.temperature_celsius),
        relative_humidity_percent: arguments.humidity.unwrap_or(scene.air.relative_humidity_percent),
        ..scene.air
    };
    let problems: Vec<String> = state.problems().iter().map(ToString::to_string).collect();
    if !problems.is_empty() {
        bail!("{}", problems.join("\nerror: "));
    }
    let attenuation = (0..scene.bands.count())
        .map(|band| state.energy_attenuation(scene.bands.exact_midband(band)))
        .collect();
    Ok(Air::Attenuation(attenuation))
}

fn log_classes(renderer: &Renderer<'_>, renderings: &[Rendering], log: &mut dyn Write) -> anyhow::Result<()> {
    for rendering in renderings {
        let total: f64 = rendering.classes.iter().flat_map(|(_, energy)| energy).sum();
        for class in renderer.path_classes() {
            let (_, energy) = &rendering.classes[class as usize];
            let share = energy.iter().sum::<f64>() / total.max(f64::MIN_POSITIVE) * 100.0;
            writeln!(log, "  {:24} {share:6.2} %  {}", class.notation(), renderer.owner(class))?;
        }
    }
    Ok(())
}
