//! `sonel-analyze tradeoff`: error against CPU time for several settings.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use sonel::TemporaryMaps;
use sonel::drawing::plot::{self, Sheet};
use sonel::geometry::Geometry;
use sonel::map::{Mode, Settings};
use sonel::rendering::{Estimator, RenderSettings, free_path};
use sonel::study::effects::{self, EffectSpec};
use sonel::study::pipeline::Room;
use sonel::study::response::receivers_of;
use sonel::study::room_decay;
use sonel_console::follower::Follower;
use sonel_console::output::{self, Kind, Output};
use sonel_console::progress::Progress;
use sonel_console::{Log, Outcome, Stopwatch};
use sonel_design::tradeoff::report::{self, Findings};
use sonel_design::tradeoff::{Levels, Setting, Sweep, conduct, verdict};

use crate::arguments::{Property, Tradeoff};

/// Packets tried where they are varied, and where they are not.
const PACKETS: [u64; 4] = [1_000, 4_000, 16_000, 64_000];
const FIXED_PACKETS: u64 = 16_000;
/// The reference has this many times the most packets.
const REFERENCE: u64 = 4;
/// Usual values of the other properties, the default first. Radii are in mean free paths.
const SURVIVALS: [f64; 5] = [0.15, 0.0, 0.05, 0.4, 1.0];
const RAYS: [u32; 4] = [32_768, 8_192, 131_072, 524_288];
const RADII: [f64; 4] = [0.03, 0.015, 0.06, 0.12];

/// Runs the sweep and writes everything about it.
///
/// # Errors
/// When the scene or an option is unusable, or a file cannot be written.
pub(crate) fn run(
    arguments: &Tradeoff,
    quiet: bool,
    out: &mut dyn Write,
    log: &mut Log<'_>,
) -> anyhow::Result<Outcome> {
    let problems = problems(arguments);
    if !problems.is_empty() {
        bail!("{}", problems.join("\nerror: "));
    }
    let follower = Follower::new(quiet, log);
    let loaded = follower.result(sonel::Scene::load(&arguments.scene, &follower))?;
    drop(follower);
    let (mut scene, geometry, inputs) = loaded.into_parts();
    let folder = &arguments.output;
    if let Some(duration) = arguments.duration {
        scene = scene.with_duration(duration);
    }
    let receivers = receivers_of(&scene);
    if receivers.is_empty() {
        bail!("{} has no receivers to evaluate: add [[receivers]]", arguments.scene.display());
    }
    let mode = arguments.mode.first().copied().unwrap_or(Mode::Accurate);
    let spec = arguments.effects.clone().unwrap_or_default();
    let geometry = effects::leave_regions_out(&spec, mode, &mut scene, geometry)
        .context("the scene's walls cannot be used")?;
    let decisions = effects::decide(&spec, mode, &mut scene, &geometry);
    if let Some(sentence) = room_decay::lengthen(&mut scene, &geometry)? {
        writeln!(log, "{sentence}")?;
    }
    let room = Room::within(&scene, geometry, effects::states(&decisions, mode));
    let sweep = sweep(arguments, room.geometry());
    // Whatever is wrong with the output shall be said before the work is done.
    output::make_folder(folder)?;
    for (name, kind) in FILES {
        Output::create(&folder.join(name), kind, &inputs)?;
    }

    let progress = Progress::begin("running", quiet);
    let mut reach = |share| progress.reach(share);
    let mut store = TemporaryMaps::new(folder.clone());
    let conducted = conduct(&room, &receivers, &sweep, &mut store, &Stopwatch::start(), &mut reach);
    drop(progress);
    let tradeoff = conducted.with_context(|| format!("cannot run the settings in {}", folder.display()))?;
    let findings = Findings::of(&tradeoff);
    write_all(folder, &inputs, &findings)?;
    writeln!(out, "{}", verdict::recommendation(&tradeoff, &findings.verdicts))?;
    writeln!(log, "{} runs; written to {}", tradeoff.runs.len(), folder.display())?;
    Ok(Outcome::Done)
}

/// The files of the folder.
const FILES: [(&str, Kind); 8] = [
    ("deviation.svg", Kind::DRAWING),
    ("bias.svg", Kind::DRAWING),
    ("efficiency.svg", Kind::DRAWING),
    ("cost.svg", Kind::DRAWING),
    ("tradeoff.csv", Kind::TRADEOFF_TABLE),
    ("parameters.csv", Kind::TRADEOFF_TABLE),
    ("tradeoff.json", Kind::TRADEOFF_REPORT),
    ("README.md", Kind::TRADEOFF_PAGE),
];

fn write_all(folder: &Path, inputs: &[PathBuf], findings: &Findings<'_>) -> anyhow::Result<()> {
    let file = |name: &str, write: &dyn Fn(&mut dyn Write) -> anyhow::Result<()>| {
        let (_, kind) = FILES.into_iter().find(|(known, _)| *known == name).expect("a file of the folder");
        let mut output = Output::create(&folder.join(name), kind, inputs)?;
        write(output.writer())
            .with_context(|| format!("cannot write {name}; an older file there is untouched"))?;
        output.publish()
    };
    let drawing = |name: &str, sheet: Sheet| file(name, &|out| Ok(plot::svg(&sheet, out)?));
    drawing("deviation.svg", report::deviation(findings))?;
    drawing("bias.svg", report::bias(findings))?;
    drawing("efficiency.svg", report::efficiency(findings))?;
    drawing("cost.svg", report::cost(findings))?;
    file("tradeoff.csv", &|out| Ok(report::curves_csv(findings, out)?))?;
    file("parameters.csv", &|out| Ok(report::parameters_csv(findings, out)?))?;
    file("tradeoff.json", &|out| Ok(writeln!(out, "{:#}", report::json(findings))?))?;
    // The page last: whoever finds it finds what it shows.
    file("README.md", &|out| Ok(out.write_all(report::markdown(findings, &command()).as_bytes())?))
}

/// The command line without the folder of the program.
fn command() -> String {
    let words: Vec<String> = std::env::args().skip(1).collect();
    format!("sonel-analyze {}", words.join(" "))
}

fn sweep(arguments: &Tradeoff, geometry: &Geometry) -> Sweep {
    let is_varied =
        |property| arguments.vary.contains(&property) || has_default_properties(arguments, property);
    let radii = RADII.map(|radius| two_places(radius * free_path(geometry)));
    let tried = Levels {
        survival: or_usual(arguments.survival.clone(), is_varied(Property::Survival), &SURVIVALS),
        mode: or_usual(arguments.mode.clone(), is_varied(Property::Mode), &[Mode::Accurate, Mode::Paper]),
        estimator: or_usual(
            arguments.estimator.clone(),
            is_varied(Property::Estimator),
            &Estimator::COMPARABLE,
        ),
        rays: or_usual(arguments.rays.clone(), is_varied(Property::Rays), &RAYS),
        radius: or_usual(arguments.radius.clone(), is_varied(Property::Radius), &radii),
    };
    let mut packets = or_usual(arguments.packets.clone(), is_varied(Property::Packets), &PACKETS);
    if packets.is_empty() {
        packets.push(FIXED_PACKETS);
    }
    packets.sort_unstable();
    packets.dedup();
    let edges = arguments.effects.as_ref().is_none_or(EffectSpec::diffracts);
    let render = RenderSettings { edges, ..RenderSettings::default() };
    let base = Setting { name: "default".to_owned(), trace: Settings::default(), render };
    let most = packets.last().copied().unwrap_or(FIXED_PACKETS);
    Sweep {
        settings: tried.settings(&base),
        packets,
        repeats: arguments.repeats,
        seed: arguments.seed,
        reference_packets: arguments.reference.unwrap_or(REFERENCE * most),
    }
}

fn or_usual<T: Clone>(given: Vec<T>, is_varied: bool, usual: &[T]) -> Vec<T> {
    if given.is_empty() && is_varied { usual.to_vec() } else { given }
}

/// Whether nothing at all was said of what to vary, and `property` is varied then.
fn has_default_properties(arguments: &Tradeoff, property: Property) -> bool {
    let lists = [
        arguments.survival.len(),
        arguments.mode.len(),
        arguments.estimator.len(),
        arguments.rays.len(),
        arguments.radius.len(),
    ];
    let nothing_said = arguments.vary.is_empty() && lists.iter().all(|&given| given < 2);
    match property {
        // A curve of error over time needs several numbers of packets, whatever else is varied.
        Property::Packets => arguments.vary.is_empty(),
        Property::Estimator => nothing_said && lists[2] == 0,
        _ => false,
    }
}

/// `value` to two significant places.
fn two_places(value: f64) -> f64 {
    let unit = 10_f64.powi(value.log10().floor() as i32 - 1);
    (value / unit).round() * unit
}

/// What is wrong with the options, a sentence each.
fn problems(arguments: &Tradeoff) -> Vec<String> {
    let mut problems = Vec::new();
    let mut complain = |is_wrong: bool, sentence: &str| {
        if is_wrong {
            problems.push(sentence.to_owned());
        }
    };
    complain(arguments.packets.contains(&0), "--packets 0 traces nothing: give at least 1");
    let outside = |survival: &f64| !(0.0..=1.0).contains(survival);
    complain(arguments.survival.iter().any(outside), "--survival is outside 0 … 1");
    let not_above_zero = |length: &f64| !(length.is_finite() && *length > 0.0);
    complain(arguments.radius.iter().any(not_above_zero), "--radius must be above 0");
    complain(arguments.duration.iter().any(not_above_zero), "--duration must be above 0 s");
    complain(arguments.reference == Some(0), "--reference 0 traces nothing: give at least 1");
    let paper = arguments.mode.first() == Some(&Mode::Paper);
    complain(
        paper && arguments.survival.iter().any(|&survival| survival < 1.0),
        "--mode paper means --survival 1: leave --survival out, or vary the mode instead",
    );
    problems
}
