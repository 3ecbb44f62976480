//! Intervals of default runs, and of runs that stop when their targets are kept: there stopping is a matter of luck.
//!
//! The runs begin with fewer packets than planned, so that they take more iterations than `sonel-trace --until` does.

use std::collections::BTreeSet;

use sonel::study::pipeline::{Room, render_and_read};
use sonel::study::response::receivers_of;
use sonel::study::spread::readings;
use sonel::study::target::Targets;
use sonel::study::until::TargetCheck;
use sonel::{InMemory, Silent};
use sonel_analysis::Parameter;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_tests::shipped;

const SEEDS: u64 = 120;
/// Emissions of the first iteration: seven tenths of what the targets take.
const FIRST: u64 = 5_000;
const FIGURES: [Parameter; 3] = [Parameter::T30, Parameter::Level, Parameter::ClarityC80];
const BAND: usize = 1;

/// Values and half-widths of the parameters when the run stops, and how often it was looked at.
fn stopped(scene: &Scene, targets: &Targets, seed: u64) -> ([(f64, f64); FIGURES.len()], u32) {
    let geometry = scene.geometry().expect("walls");
    let room = Room::within(scene, &geometry, &[]);
    let receivers = receivers_of(scene);
    let mut emissions = FIRST;
    for iterations in 1.. {
        let trace = Settings { emissions, seed, ..Settings::default() };
        let map = room.trace(trace, &mut InMemory, &Silent).expect("a run").map;
        let render = RenderSettings::default();
        let (_, parameters) = render_and_read(&map, &geometry, &receivers, &render, &Silent).expect("a run");
        let found = readings(&parameters, &targets.parameters());
        let target_check = TargetCheck::new(&found, targets);
        if target_check.is_reached() {
            let band = &parameters[0].bands[BAND];
            let parameters = FIGURES.map(|parameter| {
                let estimate = band.parameter(parameter).as_ref().expect("a supported figure");
                let [low, high] = *estimate.interval.as_ref().expect("an interval");
                (estimate.value, 0.5 * (high - low))
            });
            return (parameters, iterations);
        }
        emissions = target_check.next(emissions);
    }
    unreachable!("a run stops")
}

#[test]
fn intervals_of_stopped_runs_cover_nine_tenths() {
    let scene = shipped("shoebox");
    let targets: Targets = "t30<1%,level<0.1dB,c80<0.2dB".parse().expect("targets");
    let runs: Vec<_> = (1..=SEEDS).map(|seed| stopped(&scene, &targets, seed)).collect();
    let iterations = runs.iter().map(|(_, iterations)| f64::from(*iterations)).sum::<f64>() / SEEDS as f64;
    println!("{iterations:.2} iterations");
    assert!(iterations > 1.5, "runs that stop at once are no test of stopping: {iterations}");
    for (index, parameter) in FIGURES.iter().enumerate() {
        let truth = runs.iter().map(|(parameters, _)| parameters[index].0).sum::<f64>() / SEEDS as f64;
        let covered = |scale: f64| {
            let inside = |(parameters, _): &&([(f64, f64); FIGURES.len()], u32)| {
                (parameters[index].0 - truth).abs() <= scale * parameters[index].1
            };
            runs.iter().filter(inside).count() as f64 / SEEDS as f64
        };
        println!("{parameter:?}: coverage {:.3}", covered(1.0));
        assert!(covered(1.0) >= 0.90, "{parameter:?}: {}", covered(1.0));
        assert!(covered(0.5) < 0.90, "{parameter:?}: an interval of half the width is found out");
    }
}

/// Level, T30 and C80 of every receiver and band, as value and half-width.
type Found = Vec<Option<[f64; 2]>>;

fn found(rendered: &sonel::Rendered) -> Found {
    let of = |row: &sonel_analysis::ReceiverParameters| -> Found {
        let bands = row.bands.iter().flat_map(|band| FIGURES.map(|parameter| band.parameter(parameter)));
        bands
            .map(|found| {
                let estimate = found.as_ref().ok()?;
                let [low, high] = *estimate.interval.as_ref().ok()?;
                Some([0.5 * (low + high), 0.5 * (high - low)])
            })
            .collect()
    };
    sonel_analysis::parameters(rendered.response.echograms()).iter().flat_map(of).collect()
}

/// Checks that the intervals of `runs` hold their mean.
fn check(name: &str, runs: &[Found]) {
    let (mut covered, mut halves, mut all) = (0, 0, 0);
    for at in 0..runs[0].len() {
        let values: Vec<[f64; 2]> = runs.iter().filter_map(|found| found[at]).collect();
        let truth = values.iter().map(|[value, _]| value).sum::<f64>() / values.len() as f64;
        let within =
            |scale: f64| values.iter().filter(|[value, half]| (value - truth).abs() <= scale * half).count();
        covered += within(1.0);
        halves += within(0.5);
        all += values.len();
    }
    let share = |count: usize| count as f64 / all as f64;
    println!("{name}: coverage {:.3}, of half the width {:.3}", share(covered), share(halves));
    assert!(share(covered) >= 0.90, "{name}: {}", share(covered));
    assert!(share(halves) < 0.90, "{name}: an interval of half the width is found out");
}

fn scene(name: &str) -> sonel::Scene {
    let path = format!("{}/../scenes/{name}/scene.toml", env!("CARGO_MANIFEST_DIR"));
    sonel::Scene::load(path, &sonel::Silent).expect("a shipped scene")
}

#[test]
fn intervals_of_default_runs_cover_nine_tenths() {
    for (name, seeds) in [("shoebox", 100), ("coupled-door", 60)] {
        let scene = scene(name);
        let run = |seed| {
            let options = sonel::TraceOptions { seed: Some(seed), ..sonel::TraceOptions::default() };
            let map = scene.trace(&options, &sonel::Silent).expect("a map").map;
            found(&map.render(&[], &sonel::RenderOptions::default(), &sonel::Silent).expect("a response"))
        };
        check(name, &(1..=seeds).map(run).collect::<Vec<_>>());
    }
}

/// The number of batches follows from what the first quarter of them says.
#[test]
fn intervals_of_renderings_that_stop_cover_nine_tenths() {
    let scene = scene("shoebox");
    let until = Some("t30<2.2%,level<0.16dB,c80<0.35dB".parse().expect("targets"));
    let options = sonel::RenderOptions { until, ..sonel::RenderOptions::default() };
    let run = |seed| {
        let options_of_map =
            sonel::TraceOptions { packets: Some(10_000), seed: Some(seed), ..sonel::TraceOptions::default() };
        let map = scene.trace(&options_of_map, &sonel::Silent).expect("a map").map;
        let rendered = map.render(&[], &options, &sonel::Silent).expect("a response");
        (rendered.response.echograms().batch_count() as u64, found(&rendered))
    };
    let (efforts, runs): (BTreeSet<u64>, Vec<Found>) = (1..=200).map(run).unzip();
    assert!(efforts.len() > 1, "runs of one length are no test of choosing it: {efforts:?}");
    check("batches", &runs);
}
