//! The library half of `sonel-render`: the command line of [`sonel::Map::render`].

mod arguments;
mod receivers;
mod sound;
mod walk;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::bail;
use serde_json::{Value, json};
use sonel::analysis::modal::ModalBands;
use sonel::analysis::report;
use sonel::names::place;
use sonel::plan as tables;
use sonel::{ClassShare, Map, RenderOptions, Rendered};
use sonel_console::follower::Follower;
use sonel_console::output::{self, Kind, Output};
use sonel_console::quantity::counted;
use sonel_console::{Log, Outcome, speak_as, use_threads};

use walk::Walk;

pub use arguments::Arguments;
pub use sound::{SoundArguments, SoundFiles, complete, numbered};
pub use walk::dry;

/// Runs the program: data to `out`, everything else to `log`.
///
/// # Errors
/// When the map is damaged, a receiver impossible, or the output cannot be written.
pub fn run(arguments: &Arguments, out: &mut dyn Write, log: &mut Log<'_>) -> anyhow::Result<Outcome> {
    speak_as::<Arguments>();
    let follower = Follower::new(arguments.common.quiet, log);
    use_threads(arguments.common.threads)?;
    let map = follower.result(Map::open(&arguments.map))?;
    let mut given = arguments.receivers.clone();
    if let Some(path) = &arguments.receivers_file {
        given.extend(receivers::read_file(path)?);
    }
    let scene = &map.sonels().header().scene;
    let walk = Walk::of(arguments, scene)?;
    given.extend(walk.iter().flat_map(Walk::receivers));
    let options = arguments.options();
    let prepared = follower.result(map.prepare(&given, &options, &follower))?;
    let receivers = counted(prepared.receivers().len(), "receiver");
    // Whatever is wrong with the output shall be said before the work is done.
    let create = |target: &Path| Output::create(target, Kind::RESPONSE, &[]);
    let output = arguments.output.as_deref().map(create).transpose()?;
    let variants = variants(arguments, scene)?;
    let further = variants.iter().map(|(_, path)| create(path)).collect::<anyhow::Result<Vec<_>>>()?;
    let names = prepared.receivers().iter().map(|receiver| receiver.name.as_str());
    let sources = scene.sources.iter().map(|source| source.name.as_str());
    let folder = arguments.sound.wav.as_deref().filter(|_| walk.is_none());
    let files = |folder| SoundFiles::of((folder, ""), &arguments.sound, sources, numbered(names));
    let sounds = folder.map(files).transpose()?;
    let plan = arguments.plan.then(|| follower.result(prepared.plan(&follower))).transpose()?;
    if let Some(plan) = plan.as_ref().filter(|_| !arguments.json) {
        write!(out, "{}", tables::map_table(plan, map.label()))?;
    }
    let planned = plan.as_ref().map_or(Value::Null, tables::json);
    let (Some(output), Some(target)) = (output, &arguments.output) else {
        if arguments.json {
            writeln!(out, "{}", json!({ "plan": planned }))?;
        }
        return Ok(Outcome::Done);
    };

    let rendered = follower.result(prepared.render(plan.as_ref(), &follower))?;
    let mut complete = vec![output.complete(|out| rendered.response.echograms().write(out).map(drop))?];
    for ((name, path), output) in variants.iter().zip(further) {
        let options = RenderOptions { variant: Some(name.clone()), ..arguments.options() };
        let rendered = follower.result(map.render(&given, &options, &follower))?;
        complete.push(output.complete(|out| rendered.response.echograms().write(out).map(drop))?);
        follower.line(&format!("variant \"{name}\": written to {}", path.display()))?;
        for sentence in &rendered.warnings {
            follower.line(&format!("warning: variant \"{name}\": {sentence}"))?;
        }
    }
    if let Some(sounds) = &sounds {
        complete.extend(sounds.each(&rendered.response, None, sound::complete)?);
    }
    if let Some(walk) = &walk {
        complete.extend(walk.complete(&rendered.response, (arguments.seed, arguments.at_most), &follower)?);
    }
    output::publish(complete)?;
    let files = walk.as_ref().map(|walk| counted(walk.files.count(), "walk"));
    let files = files.or(sounds.as_ref().map(|sounds| counted(sounds.count(), "impulse response")));
    if let (Some(files), Some(folder)) = (files, &arguments.sound.wav) {
        follower.line(&format!("{files} written to {}", folder.display()))?;
    }
    let seconds = follower.seconds();
    let (sources, (wall, cpu)) = (counted(scene.sources.len(), "source"), seconds);
    follower.line(&format!(
        "{}: {receivers}, {sources}; {wall:.2} s ({cpu:.2} CPU seconds); written to {}",
        scene.name,
        target.display()
    ))?;
    remark(&rendered, &follower)?;
    let parameters = arguments.parameters.then(|| sonel::analysis::parameters(rendered.response.echograms()));
    let volume = rendered.response.echograms().provenance.volume_m3;
    let modal = volume.zip(parameters.as_ref()).and_then(|(volume, of)| ModalBands::of(of, volume));
    modal.iter().try_for_each(|bands| follower.line(&format!("note: {bands}")))?;
    if let Some(parameters) = parameters.as_ref().filter(|_| !arguments.json) {
        write!(out, "{}", report::table(parameters, &format!("{}: ", scene.name), false))?;
    }
    if arguments.json {
        let mut written = rendered.report(seconds);
        if let Some(parameters) = &parameters {
            written["parameters"] = report::json(parameters);
        }
        if arguments.plan {
            written["plan"] = planned;
        }
        writeln!(out, "{written}")?;
    }
    Ok(if rendered.is_reached == Some(false) { Outcome::Missed } else { Outcome::Done })
}

/// Names of the variants to be rendered, and their files.
fn variants(
    arguments: &Arguments,
    scene: &sonel::scenes::CompiledScene,
) -> anyhow::Result<Vec<(String, PathBuf)>> {
    let Some(output) = &arguments.output else { return Ok(Vec::new()) };
    if !arguments.variants.is_empty() && arguments.sound.wav.is_some() {
        bail!(
            "--variant writes several responses, --wav the sound of one: leave --wav out, then hear all responses with one gain: sonel-analyze auralise A.npz B.npz --recording SPEECH.wav -o FOLDER"
        )
    }
    let known: Vec<&String> = scene.designs.iter().map(|design| &design.name).collect();
    let mut names: Vec<&String> = Vec::new();
    for name in &arguments.variants {
        match name.as_str() {
            "all" if known.is_empty() => {
                bail!("the map has no variants: name some in the scene file, [variants.NAME], and trace it")
            }
            "all" => names.extend(&known),
            _ => names.push(name),
        }
    }
    if let Some(twice) = names.iter().enumerate().find(|(at, name)| names[..*at].contains(name)) {
        bail!("variant \"{}\" is asked for twice", twice.1);
    }
    for name in &names {
        place(known.iter().map(|name| name.as_str()), name, "the map has no variant")?;
    }
    let (stem, ending) = (output.file_stem().unwrap_or_default(), output.extension());
    let path = |name: &String| {
        let mut file = stem.to_owned();
        file.push(format!("-{name}"));
        if let Some(ending) = ending {
            file.push(".");
            file.push(ending);
        }
        (name.clone(), output.with_file_name(file))
    };
    Ok(names.into_iter().map(path).collect())
}

/// Logs the shares of the path classes, what is to be warned of, and what became of a plan.
fn remark(rendered: &Rendered, follower: &Follower<'_>) -> anyhow::Result<()> {
    for ClassShare { class, share, estimator } in rendered.classes.iter().flatten() {
        follower.line(&format!("  {class:24} {:6.2} %  {estimator}", 100.0 * share))?;
    }
    rendered.boundary().iter().try_for_each(|line| follower.line(&format!("  {line}")))?;
    for sentence in &rendered.warnings {
        follower.line(&format!("warning: {sentence}"))?;
    }
    rendered.comparison.iter().try_for_each(|comparison| follower.line(&comparison.line()))
}
