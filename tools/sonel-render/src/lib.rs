//! The library half of `sonel-render`: from a map and arguments to a response.

mod arguments;
mod assemble;
mod receivers;

use std::io::Write;

use anyhow::{Context, bail};
use sonel_acoustics::Air as AirState;
use sonel_console::output::Output;
use sonel_console::progress::Progress;
use sonel_console::{Outcome, Stopwatch, input, use_threads};
use sonel_map::SonelMap;
use sonel_renderer::{Air, RenderSettings, Renderer, Rendering};
use sonel_scene::Scene;
use sonel_study::{effects, response};

pub use arguments::{Arguments, Grid};

/// Steps of the progress bar.
const PROGRESS_STEPS: u64 = 1000;

/// Runs the program: data to `out`, everything else to `log`.
///
/// # Errors
/// When the map is damaged, a receiver impossible, or the output cannot be written.
pub fn run(arguments: &Arguments, out: &mut dyn Write, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let watch = Stopwatch::start();
    use_threads(arguments.threads.map(|threads| threads as usize))?;
    let label = arguments.map.display().to_string();
    let file = input::open(&arguments.map).with_context(|| format!("cannot read the map {label}"))?;
    let map = SonelMap::open(&file).with_context(|| label.clone())?;
    let scene = &map.header().scene;
    let geometry = scene.geometry().with_context(|| format!("{label}: the walls cannot be used"))?;
    let settings = render_settings(arguments, scene)?;
    let renderer = Renderer::new(&map, &geometry, settings.clone()).with_context(|| label.clone())?;
    let opened = watch.seconds();
    let receivers = receivers::gather(arguments, scene, &geometry, log)?;

    let mut output = Output::create(&arguments.output)?;
    let steps = PROGRESS_STEPS * scene.sources.len() as u64;
    let progress = Progress::begin("rendering", steps, arguments.quiet);
    let renderings = response::render(&map, &renderer, &receivers, &mut |source, share| {
        progress.reach(source as u64 * PROGRESS_STEPS + (share * PROGRESS_STEPS as f64) as u64);
    })?;
    progress.end();
    let run = assemble::Run { map: &map, renderer: &renderer, settings: &settings, receivers: &receivers };
    let response = run.response(&renderings);
    response
        .write(output.writer())
        .with_context(|| format!("cannot write {}", arguments.output.display()))?;
    output.publish()?;

    let (wall, cpu) = watch.seconds();
    writeln!(
        log,
        "{}: {} receivers, {} sources; {wall:.2} s ({cpu:.2} CPU seconds); written to {}",
        scene.name,
        receivers.len(),
        scene.sources.len(),
        arguments.output.display()
    )?;
    log_classes(&renderer, &renderings, log)?;
    let missing = effects::missing(map.header(), &geometry, &receivers, &renderings);
    for sentence in &missing {
        writeln!(log, "warning: {sentence}")?;
    }
    if arguments.json {
        let mut report = run.report(&renderings, opened, (wall, cpu));
        report["warnings"] = missing.into();
        writeln!(out, "{report}")?;
    }
    Ok(Outcome::Done)
}

fn render_settings(arguments: &Arguments, scene: &Scene) -> anyhow::Result<RenderSettings> {
    Ok(RenderSettings {
        bin: arguments.bin,
        estimator: arguments.estimator.into(),
        mirror_order: arguments.order,
        rays: arguments.rays,
        gather_radius: arguments.radius,
        seed: arguments.seed,
        air: air(arguments, scene)?,
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
        for (class, energy) in &rendering.classes {
            let share = energy.iter().sum::<f64>() / total.max(f64::MIN_POSITIVE) * 100.0;
            writeln!(log, "  {:24} {share:6.2} %  {}", class.notation(), renderer.owner(*class))?;
        }
    }
    Ok(())
}
