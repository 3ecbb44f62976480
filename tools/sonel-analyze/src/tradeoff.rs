//! `sonel-analyze tradeoff`: error against CPU time for several settings.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use sonel::TemporaryMaps;
use sonel::drawing::plot::{self, Sheet};
use sonel::map::{Mode, Settings};
use sonel::rendering::{Estimator, RenderSettings};
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

use crate::arguments::Tradeoff;

/// Packets that are tried unless others are given.
const PACKETS: [u64; 4] = [1_000, 4_000, 16_000, 64_000];
/// Most packets of a run: as maps they would not fit a usual disk, and the reference has more. It refuses misprints.
const MOST_PACKETS: u64 = 100_000_000;
/// The reference has this many times the most packets.
const REFERENCE: u64 = 4;

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
    let states = effects::states(&decisions, mode);
    let room = Room::within(&scene, &geometry, &states);
    let sweep = sweep(arguments);
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
const FILES: [(&str, Kind); 6] = [
    ("deviation.svg", Kind::DRAWING),
    ("bias.svg", Kind::DRAWING),
    ("efficiency.svg", Kind::DRAWING),
    ("cost.svg", Kind::DRAWING),
    ("tradeoff.json", Kind::TRADEOFF_REPORT),
    ("README.md", Kind::TRADEOFF_PAGE),
];

fn write_all(folder: &Path, inputs: &[PathBuf], findings: &Findings<'_>) -> anyhow::Result<()> {
    let file = |name: &str, write: &dyn Fn(&mut dyn Write) -> anyhow::Result<()>| {
        let (_, kind) = FILES.into_iter().find(|(known, _)| *known == name).expect("a file of the folder");
        let mut output = Output::create(&folder.join(name), kind, inputs)?;
        write(&mut output)
            .with_context(|| format!("cannot write {name}; an older file there is untouched"))?;
        output.publish()
    };
    let drawing = |name: &str, sheet: Sheet| file(name, &|out| Ok(plot::svg(&sheet, out)?));
    drawing("deviation.svg", report::deviation(findings))?;
    drawing("bias.svg", report::bias(findings))?;
    drawing("efficiency.svg", report::efficiency(findings))?;
    drawing("cost.svg", report::cost(findings))?;
    file("tradeoff.json", &|out| Ok(writeln!(out, "{:#}", report::json(findings))?))?;
    // The page last: whoever finds it finds what it shows.
    file("README.md", &|out| Ok(out.write_all(report::markdown(findings, &command()).as_bytes())?))
}

/// The command line without the folder of the program.
fn command() -> String {
    let words: Vec<String> = std::env::args().skip(1).collect();
    format!("sonel-analyze {}", words.join(" "))
}

fn sweep(arguments: &Tradeoff) -> Sweep {
    let Tradeoff { survival, mode, estimator, rays, radius, .. } = arguments.clone();
    let mut tried = Levels { survival, mode, estimator, rays, radius };
    let counts =
        [tried.survival.len(), tried.mode.len(), tried.estimator.len(), tried.rays.len(), tried.radius.len()];
    if tried.estimator.is_empty() && counts.iter().all(|&count| count < 2) {
        tried.estimator = Estimator::COMPARABLE.to_vec();
    }
    let mut packets = arguments.packets.clone();
    if packets.is_empty() {
        packets.extend(PACKETS);
    }
    packets.sort_unstable();
    packets.dedup();
    let edges = arguments.effects.as_ref().is_none_or(EffectSpec::diffracts);
    let render = RenderSettings { edges, ..RenderSettings::default() };
    let base = Setting { name: "default".to_owned(), trace: Settings::default(), render };
    let most = packets.last().copied().unwrap_or_default();
    Sweep {
        settings: tried.settings(&base),
        packets,
        repeats: arguments.repeats,
        seed: arguments.seed,
        reference_packets: arguments.reference.unwrap_or(REFERENCE * most),
    }
}

/// What is wrong with the options, a sentence each.
fn problems(arguments: &Tradeoff) -> Vec<String> {
    let mut problems = Vec::new();
    let mut complain = |is_wrong: bool, sentence: &str| {
        if is_wrong {
            problems.push(sentence.to_owned());
        }
    };
    let is_no_number = |count: &u64| !(1..=MOST_PACKETS).contains(count);
    complain(arguments.packets.iter().any(is_no_number), "--packets is outside 1 … 100M");
    let outside = |survival: &f64| !(0.0..=1.0).contains(survival);
    complain(arguments.survival.iter().any(outside), "--survival is outside 0 … 1");
    let not_above_zero = |length: &f64| !(length.is_finite() && *length > 0.0);
    complain(arguments.radius.iter().any(not_above_zero), "--radius must be above 0");
    complain(arguments.duration.iter().any(not_above_zero), "--duration must be above 0 s");
    complain(arguments.reference.iter().any(is_no_number), "--reference is outside 1 … 100M");
    let paper = arguments.mode.first() == Some(&Mode::Paper);
    complain(
        paper && arguments.survival.iter().any(|&survival| survival < 1.0),
        "--mode paper means --survival 1: leave --survival out, or vary the mode instead",
    );
    problems
}
