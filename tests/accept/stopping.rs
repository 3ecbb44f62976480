//! Intervals of runs that stop when their targets are kept: coverage in the shoebox, where stopping is a matter of luck.
//!
//! The runs begin with fewer packets than planned, so that they take more iterations than `sonel-trace --until` does.

use sonel_analysis::Parameter;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_study::pipeline::{InMemory, NoClock, PipelineSettings, Room};
use sonel_study::response::receivers_of;
use sonel_study::spread::readings;
use sonel_study::target::Targets;
use sonel_study::until::Verdict;
use sonel_tests::shipped;

const SEEDS: u64 = 120;
/// Emissions of the first iteration: seven tenths of what the targets take.
const FIRST: u64 = 5_800;
const FIGURES: [Parameter; 3] = [Parameter::T30, Parameter::Level, Parameter::ClarityC80];
const BAND: usize = 1;

/// Values and half-widths of the parameters when the run stops, and how often it was looked at.
fn stopped(scene: &Scene, targets: &Targets, seed: u64) -> ([(f64, f64); FIGURES.len()], u32) {
    let room = Room::new(scene, Vec::new()).expect("walls");
    let receivers = receivers_of(scene);
    let mut emissions = FIRST;
    for iterations in 1.. {
        let trace = Settings { emissions, seed, ..Settings::default() };
        let settings = PipelineSettings { trace, render: RenderSettings::default() };
        let run = room.run(&settings, &receivers, &mut InMemory, &NoClock).expect("a run");
        let found = readings(&run.rendered.parameters, &targets.parameters());
        let verdict = Verdict::new(&found, targets);
        if verdict.is_reached() {
            let band = &run.rendered.parameters[0].bands[BAND];
            let parameters = FIGURES.map(|parameter| {
                let estimate = band.parameter(parameter).as_ref().expect("a supported figure");
                let [low, high] = *estimate.interval.as_ref().expect("an interval");
                (estimate.value, 0.5 * (high - low))
            });
            return (parameters, iterations);
        }
        emissions = verdict.next(emissions);
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
