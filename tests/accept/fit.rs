//! Fitted coefficients lie within their 95 % intervals as often as those say.
//!
//! In every repetition the true coefficients are drawn from the belief, independently of each other; map and measurement have seeds of
//! their own. One band: the bands of a map share its packets, so that they would be within their intervals or outside together.

use std::f64::consts::TAU;

use sonel_acoustics::{BandWidth, Bands, Coefficient, Material};
use sonel_analysis::{Parameter, parameters};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_study::fit::{FitSettings, Fitted, Knowledge, Measurement, fit};
use sonel_study::response::receivers_of;
use sonel_study::trial::InMemory;
use sonel_testkit::uniform::Uniform;
use sonel_tests::Traced;

const REPETITIONS: u64 = 80;
const BELIEF: f64 = 0.5;
const START: [f64; 4] = [0.15, 0.25, 0.3, 0.2];

fn logit(alpha: f64) -> f64 {
    (alpha / (1.0 - alpha)).ln()
}

/// Absorption whose ln(α/(1−α)) is normally distributed about that of [`START`], standard deviation [`BELIEF`].
fn drawn(seed: u64) -> [f64; 4] {
    let mut numbers = Uniform::new(seed);
    START.map(|alpha| {
        let [u, v] = numbers.square();
        let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos();
        1.0 / (1.0 + (-logit(alpha) - BELIEF * normal).exp())
    })
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
    RenderSettings { rays: 4096, ..RenderSettings::default() }
}

fn trace(absorption: [f64; 4], seed: u64) -> Traced {
    Traced::new(room(absorption), Settings { emissions: 3000, seed, ..Settings::default() })
}

fn measured(absorption: [f64; 4], seed: u64) -> Vec<Measurement> {
    let wanted = [Parameter::EarlyDecayTime, Parameter::T20, Parameter::ClarityC80, Parameter::Level];
    let figures = parameters(&trace(absorption, seed).respond(few_rays()));
    let of = |(receiver, parameter): (usize, Parameter)| {
        let estimate = figures[receiver].bands[0].figure(parameter).as_ref().ok()?;
        let sigma = estimate.error.expect("batches").sigma;
        Some(Measurement { source: 0, receiver, band: 0, parameter, value: estimate.value, sigma })
    };
    (0..figures.len())
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
    let settings =
        FitSettings { coefficients: vec![Coefficient::Absorption], belief: BELIEF, render: few_rays() };
    let (geometry, store) = (&traced.geometry, &mut InMemory);
    let found = fit(&mut traced.map, geometry, &receivers, &measurements, &settings, store, &mut |_| ());
    let coefficients = found.expect("a decay").coefficients;
    let told = coefficients.into_iter().filter(|one| one.knowledge == Knowledge::Told);
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
