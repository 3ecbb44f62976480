//! Fitted coefficients lie within their 95 % intervals as often as those say.
//!
//! In every repetition the true coefficients are drawn from the prior, independently of each other; map and measurement have seeds of
//! their own. One band: the bands of a map share its packets, so that they would be within their intervals or outside together.

use std::f64::consts::TAU;

use sonel::study::pipeline::InMemory;
use sonel::study::response::receivers_of;
use sonel_acoustics::{BandWidth, Bands, Coefficient, Material};
use sonel_analysis::{Parameter, parameters};
use sonel_design::fit::{FitSettings, Fitted, Identifiability, Measurement, fit};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_testkit::uniform::Uniform;
use sonel_tests::{Traced, shipped};

const REPETITIONS: u64 = 80;
const PRIOR_SIGMA: f64 = 0.5;
const START: [f64; 4] = [0.15, 0.25, 0.3, 0.2];

fn logit(alpha: f64) -> f64 {
    (alpha / (1.0 - alpha)).ln()
}

fn normal(numbers: &mut Uniform) -> f64 {
    let [u, v] = numbers.square();
    (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()
}

/// Absorption whose ln(α/(1−α)) is normally distributed about that of `alpha`, standard deviation [`PRIOR_SIGMA`].
fn about(alpha: f64, numbers: &mut Uniform) -> f64 {
    1.0 / (1.0 + (-logit(alpha) - PRIOR_SIGMA * normal(numbers)).exp())
}

fn drawn(seed: u64) -> [f64; 4] {
    let mut numbers = Uniform::new(seed);
    START.map(|alpha| about(alpha, &mut numbers))
}

/// A box of four materials, one band.
fn room(absorption: [f64; 4]) -> Scene {
    let material = |(name, absorption)| Material::uniform(name, absorption, 0.4, 1);
    let materials = ["long", "short", "floor", "ceiling"].into_iter().zip(absorption).map(material).collect();
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
    Scene::from_parts(Mesh::shoebox([8.0, 6.0, 3.5], [1, 1, 0, 0, 2, 3]), materials, bands, 1.0)
        .with_source("source", [1.5, 1.7, 1.3])
        .with_receiver("a", [3.0, 2.4, 1.2])
        .with_receiver("b", [6.9, 4.7, 1.2])
        .with_receiver("c", [5.0, 1.2, 2.6])
        .with_receiver("d", [2.2, 5.1, 0.7])
        .without_air_attenuation()
}

fn few_rays() -> RenderSettings {
    RenderSettings { rays: Some(4096), ..RenderSettings::default() }
}

fn trace(absorption: [f64; 4], seed: u64) -> Traced {
    Traced::new(room(absorption), Settings { emissions: 3000, seed, ..Settings::default() })
}

fn measured(absorption: [f64; 4], seed: u64) -> Vec<Measurement> {
    let wanted = [Parameter::EarlyDecayTime, Parameter::T20, Parameter::ClarityC80, Parameter::Level];
    let parameters = parameters(&trace(absorption, seed).respond(few_rays()));
    let of = |(receiver, parameter): (usize, Parameter)| {
        let estimate = parameters[receiver].bands[0].parameter(parameter).as_ref().ok()?;
        let sigma = estimate.error.expect("batches").sigma;
        Some(Measurement { source: 0, receiver, band: 0, parameter, value: estimate.value, sigma })
    };
    (0..parameters.len())
        .flat_map(|receiver| wanted.map(|parameter| (receiver, parameter)))
        .filter_map(of)
        .collect()
}

/// True values and coefficients that the measurement tells in one repetition.
fn told(repetition: u64) -> Vec<(f64, Fitted)> {
    let truth = drawn(9000 + repetition);
    let measurements = measured(truth, 5000 + repetition);
    let mut traced = trace(START, repetition);
    let receivers = receivers_of(&traced.map.header().scene);
    let settings = FitSettings { coefficients: vec![Coefficient::Absorption], prior_sigma: PRIOR_SIGMA };
    let map = traced.varied(&receivers, few_rays());
    let found = fit(map, &measurements, &settings, &mut InMemory, &mut |_| ());
    let coefficients = found.expect("a decay").coefficients;
    let told = coefficients.into_iter().filter(|one| one.identifiability == Identifiability::Identified);
    told.map(|one| (truth[one.material], one)).collect()
}

/// Error over half of the interval, on the axis on which intervals are symmetric.
fn deviation((truth, one): &(f64, Fitted)) -> f64 {
    let [low, high] = one.interval.map(logit);
    2.0 * (logit(one.value) - logit(*truth)) / (high - low)
}

/// Of some 300 coefficients 95 % ± 1.3 % are expected inside, two thirds of them at half the width. The mean error is within 3.5 of its
/// standard errors, 1/(1.96 √300) each.
#[test]
fn absorption_is_within_its_intervals() {
    let deviations: Vec<f64> = (1..=REPETITIONS).flat_map(told).map(|one| deviation(&one)).collect();
    let count = deviations.len() as f64;
    let inside = |scale: f64| deviations.iter().filter(|one| one.abs() <= scale).count() as f64 / count;
    let mean = deviations.iter().sum::<f64>() / count;
    let root_mean_square = (deviations.iter().map(|one| one * one).sum::<f64>() / count).sqrt();
    let [all, half] = [1.0, 0.5].map(inside);
    println!(
        "{count} told: {all:.3} inside, {half:.3} at half width; mean {mean:.3}, rms {root_mean_square:.3}"
    );
    assert!(count >= 240.0, "the data tell too little to mean anything: {count}");
    assert!((0.90..=0.99).contains(&all), "{all} inside");
    assert!(half < 0.90, "intervals of half the width are found out: {half}");
    assert!(mean.abs() < 3.5 / (1.96 * count.sqrt()), "biased: {mean}");
}

/// What `room` reads, with errors of its own for every value, beside those of its trace.
fn measured_well(room: Scene, seed: u64, numbers: &mut Uniform) -> Vec<Measurement> {
    let errors = [
        (Parameter::EarlyDecayTime, 0.0, 0.02),
        (Parameter::T20, 0.0, 0.02),
        (Parameter::ClarityC80, 0.3, 0.0),
        (Parameter::Level, 0.2, 0.0),
    ];
    let bands = room.bands.count();
    let settings = Settings { emissions: 200_000, seed, ..Settings::default() };
    let parameters = parameters(&Traced::new(room, settings).respond(RenderSettings::default()));
    let places = (0..parameters.len()).flat_map(|receiver| (0..bands).map(move |band| (receiver, band)));
    let mut found = Vec::new();
    for ((receiver, band), (parameter, error, part)) in
        places.flat_map(|place| errors.map(|error| (place, error)))
    {
        let Ok(estimate) = parameters[receiver].bands[band].parameter(parameter) else { continue };
        let sigma = error + part * estimate.value;
        let value = estimate.value + sigma * normal(numbers);
        let sigma = f64::hypot(sigma, estimate.error.expect("batches").sigma);
        found.push(Measurement { source: 0, receiver, band, parameter, value, sigma });
    }
    found
}

/// In the hall, where each measured value has an error of its own, of 2 % or 0.2 to 0.3 dB.
#[test]
fn in_the_hall_too_where_measured_values_have_errors_of_their_own() {
    let (mut inside, mut count, mut at_half) = (0, 0, 0);
    for seed in 1..=6 {
        let mut numbers = Uniform::new(700 + seed);
        let mut room = shipped("hall");
        for material in &mut room.materials {
            material.absorption.iter_mut().for_each(|alpha| *alpha = about(*alpha, &mut numbers));
        }
        let truth = room.materials.clone();
        let measurements = measured_well(room, 1000 + seed, &mut numbers);
        let settings = Settings { emissions: 30_000, seed, ..Settings::default() };
        let mut traced = Traced::new(shipped("hall"), settings);
        let receivers = receivers_of(&traced.map.header().scene);
        let render = RenderSettings { rays: Some(16_384), ..RenderSettings::default() };
        let settings = FitSettings { coefficients: vec![Coefficient::Absorption], prior_sigma: PRIOR_SIGMA };
        let map = traced.varied(&receivers, render);
        let found = fit(map, &measurements, &settings, &mut InMemory, &mut |_| ());
        for one in found.expect("a decay").coefficients {
            if one.identifiability == Identifiability::Identified {
                let off = deviation(&(truth[one.material].absorption[one.band], one)).abs();
                count += 1;
                inside += u32::from(off <= 1.0);
                at_half += u32::from(off <= 0.5);
            }
        }
    }
    println!("{inside} of {count} inside, {at_half} at half width");
    assert!(count >= 60, "the data tell too little: {count}");
    assert!(f64::from(inside) >= 0.88 * f64::from(count), "{inside} of {count} inside");
    assert!(f64::from(at_half) < 0.88 * f64::from(count), "intervals of half the width are found out");
}
