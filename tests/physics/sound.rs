//! Impulse responses have the energies of their echogram: exact arrivals alone, and noise in the mean over realisations.

use glam::{DVec3, dvec3};
use rayon::prelude::*;
use sonel_acoustics::{Bands, Material};
use sonel_analysis::{Parameter, ParameterValue, parameters};
use sonel_echogram::{Arrivals, Response};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::Scene;
use sonel_sound::{SoundSettings, Synthesizer};
use sonel_testkit::exponential::ExponentialDecay;
use sonel_testkit::uniform::Uniform;
use sonel_tests::octaves::{Filter, measured};
use sonel_tests::{Traced, meshes};

use crate::REALISATIONS;

/// Octaves with their reverberation times [s]: the highest decays three times as fast as the lowest.
const OCTAVES: [(f64, f64); 8] = [
    (63.0, 0.9),
    (125.0, 0.8),
    (250.0, 0.7),
    (500.0, 0.65),
    (1000.0, 0.6),
    (2000.0, 0.55),
    (4000.0, 0.45),
    (8000.0, 0.3),
];
const SETTINGS: SoundSettings =
    SoundSettings { volume: None, up: DVec3::Z, seed: 1, sample_rate_hz: 48_000, within: None };
/// Direct sound [m].
const DISTANCE: f64 = 10.29;
const SPEED: f64 = 343.0;
const BIN: f64 = 0.001;

/// Direct sound and exponential decays behind it that are 10 dB stronger, their times `stretched`.
fn decaying(stretched: f64) -> Response {
    of_times(OCTAVES.map(|(_, time)| stretched * time))
}

/// The same with these reverberation times [s].
fn of_times(times: [f64; OCTAVES.len()]) -> Response {
    let (bins, first) = (1000, (DISTANCE / SPEED / BIN) as usize);
    let direct = 1.0 / (4.0 * std::f64::consts::PI * DISTANCE * DISTANCE);
    let mut energy = vec![0.0; OCTAVES.len() * bins];
    for (band, time) in energy.chunks_exact_mut(bins).zip(times) {
        let decay = ExponentialDecay { reverberation_time: time, energy: 10.0 * direct };
        band[first + 1..].copy_from_slice(&decay.bins(BIN, bins - first - 1));
        band[first] += direct;
    }
    Response {
        center_frequency_hz: OCTAVES.map(|(center, _)| center).to_vec(),
        time_edges_s: (0..=bins).map(|edge| edge as f64 * BIN).collect(),
        receiver_names: vec!["seat".to_owned()],
        receiver_positions: vec![[DISTANCE, 0.0, 0.0]],
        receiver_directivities: Vec::new(),
        source_names: vec!["stage".to_owned()],
        source_positions: vec![[0.0; 3]],
        source_power_level_db: vec![90.0; OCTAVES.len()],
        speed_of_sound: SPEED,
        characteristic_impedance: 412.0,
        direct_times_s: Vec::new(),
        energy,
        batches: None,
        missing: None,
        arrivals: Arrivals {
            source: vec![0],
            receiver: vec![0],
            time_s: vec![DISTANCE / SPEED],
            energy: vec![direct; OCTAVES.len()],
            direction: vec![-1.0, 0.0, 0.0],
            order: vec![0],
            kind: vec![0],
        },
        directions: None,
        provenance: Default::default(),
    }
}

/// A parameter of every octave; not a number where a single realisation is too noisy for it.
fn read(response: &Response, parameter: Parameter) -> Vec<f64> {
    let value = |estimate: &ParameterValue| estimate.as_ref().map_or(f64::NAN, |estimate| estimate.value);
    parameters(response)[0].bands.iter().map(|band| value(band.parameter(parameter))).collect()
}

/// What realisations have of one octave, relative to its echogram.
struct Realised {
    /// Energy of each.
    energies: Vec<f64>,
    /// T30 of each that has one.
    times: Vec<f64>,
    /// T30 of their mean energies.
    time_of_mean: f64,
}

/// The realisations of `response`, octave by octave, relative to what is `expected`.
fn realisations(response: &Response, expected: &Response, volume: Option<f64>) -> Vec<Realised> {
    let (levels, times) = (read(expected, Parameter::Level), read(expected, Parameter::T30));
    let found: Vec<(Vec<f64>, Response)> = (1..=REALISATIONS)
        .into_par_iter()
        .map(|seed| {
            let pressure = Synthesizer::new(response, SoundSettings { volume, seed, ..SETTINGS })
                .impulse_response(0, 0)
                .expect("arrivals of the echogram");
            let received = |filter| measured(response, (0, 0), &pressure, filter);
            (read(&received(Filter::Sharp), Parameter::Level), received(Filter::Smooth))
        })
        .collect();
    let mut mean = found[0].1.clone();
    for (bin, energy) in mean.energy.iter_mut().enumerate() {
        *energy = found.iter().map(|(_, received)| received.energy[bin]).sum::<f64>() / found.len() as f64;
    }
    let times_of_mean = read(&mean, Parameter::T30);
    let times_of_each: Vec<Vec<f64>> =
        found.iter().map(|(_, received)| read(received, Parameter::T30)).collect();
    let of_band = |band: usize| Realised {
        energies: found.iter().map(|(level, _)| 10_f64.powf(0.1 * (level[band] - levels[band]))).collect(),
        times: times_of_each
            .iter()
            .map(|each| each[band] / times[band])
            .filter(|time| time.is_finite())
            .collect(),
        time_of_mean: times_of_mean[band] / times[band],
    };
    (0..OCTAVES.len()).map(of_band).collect()
}

/// Mean and standard deviation.
fn moments(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    (mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
}

/// Standard errors that chance may take a mean away: one mean of the thirty in 10⁴ tests.
const ERRORS: f64 = 4.5;

/// What is off by more than 0.1 dB of level and 0.5 % of T30 and chance, and spreads other than √(1/Bτ).
fn problems(found: &[Realised], spreads: bool) -> Vec<String> {
    let (mut problems, root) = (Vec::new(), (REALISATIONS as f64).sqrt());
    for (realisations, (center, time)) in found.iter().zip(OCTAVES) {
        let (mean, sigma) = moments(&realisations.energies);
        let off = 10.0 * mean.log10();
        if off.abs() > 0.1 + ERRORS * 4.34 * sigma / root {
            problems.push(format!("{center} Hz: level off by {off:.2} dB"));
        }
        // Of an exponential decay of rate k, τ = 2/k; direct sound does not vary.
        let predicted = 10.0 / 11.0 * (13.815_5 / time / (2.0 * center * 0.5_f64.sqrt())).sqrt();
        if spreads && (sigma / predicted - 1.0).abs() > ERRORS / (2.0 * (REALISATIONS - 1) as f64).sqrt() {
            problems.push(format!("{center} Hz: levels spread by {sigma:.4} instead of {predicted:.4}"));
        }
        // T30 of a single realisation is biased: the mean of a reciprocal is not that of the slope.
        let (times, ratio) = (realisations.times.len(), realisations.time_of_mean);
        let sigma = moments(&realisations.times).1 / root;
        if (ratio - 1.0).abs() > 0.005 + ERRORS * sigma + sigma * sigma
            || times < realisations.energies.len() * 9 / 10
        {
            problems.push(format!("{center} Hz: T30 {ratio:.4} of the echogram's, {times} times"));
        }
    }
    problems
}

#[test]
#[ignore = "long: cargo xtask accept"]
fn realisations_have_the_levels_times_and_spreads_of_the_echogram() {
    let response = decaying(1.0);
    let found = problems(&realisations(&response, &response, None), true);
    assert!(found.is_empty(), "{found:#?}");
    // Single reflections of a large room spread less.
    let found = problems(&realisations(&response, &response, Some(2000.0)), false);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn realisations_of_longer_decays_are_told_from_it() {
    let found = problems(&realisations(&decaying(1.1), &decaying(1.0), None), true);
    assert!(found.iter().any(|problem| problem.contains("T30")), "{found:#?}");
}

/// A room of `size` [m] with `boxes` on its floor, rendered at `receivers` [m] with edges.
fn furnished(size: [f64; 3], boxes: &[[DVec3; 2]], source: [f64; 3], receivers: &[[f64; 3]]) -> Response {
    let mut mesh = Mesh::shoebox(size, [0; 6]);
    for &[low, high] in boxes {
        meshes::add_box(&mut mesh, 0, low, high);
    }
    let material = Material::uniform("all", 0.3, 0.1, Bands::octaves().count());
    let scene = Scene::from_parts(mesh, vec![material], Bands::octaves(), 0.3).with_source("source", source);
    let scene = receivers
        .iter()
        .enumerate()
        .fold(scene, |scene, (index, &at)| scene.with_receiver(&format!("{index}"), at));
    let settings = Settings { emissions: 200, ..Settings::default() };
    let sound = RenderSettings { rays: Some(256), ..RenderSettings::default() };
    Traced::diffracting(scene, settings).respond(sound)
}

/// Of a bin with a strong arrival the weak ones beside it are what rounding leaves: no reason to give no impulse response.
#[test]
fn furnished_rooms_have_impulse_responses() {
    let heard = |response: &Response| {
        let synthesizer = Synthesizer::new(response, SoundSettings { volume: Some(50.0), ..SETTINGS });
        (0..response.receivers())
            .map(|r| synthesizer.impulse_response(0, r).map(drop))
            .collect::<Result<Vec<()>, _>>()
    };
    let boxes = [
        [dvec3(2.35, 1.42, 0.0), dvec3(2.77, 2.61, 0.46)],
        [dvec3(2.49, 0.3, 0.0), dvec3(3.45, 1.42, 0.98)],
        [dvec3(2.14, 0.47, 0.0), dvec3(2.62, 1.23, 1.72)],
    ];
    let room = furnished([6.29, 4.29, 3.04], &boxes, [1.79, 0.94, 1.04], &[[5.49, 0.85, 2.65]]);
    assert!(heard(&room).is_ok(), "{:?}", heard(&room));
    for seed in 0..1 {
        let mut numbers = Uniform::new(seed);
        let mut between = |low, high| numbers.between(low, high);
        let boxes: Vec<[DVec3; 2]> = (0..3_u32)
            .map(|number| {
                let low = dvec3(between(0.2, 1.0) + 1.6 * f64::from(number), between(0.2, 2.0), 0.0);
                [low, low + dvec3(between(0.2, 0.6), between(0.4, 1.2), between(0.4, 1.8))]
            })
            .collect();
        let receivers: Vec<[f64; 3]> =
            (0..6).map(|_| [between(0.3, 5.8), between(3.4, 3.8), between(1.0, 2.4)]).collect();
        let room =
            furnished([6.1, 4.0, 3.0], &boxes, [between(0.5, 5.5), between(3.3, 3.7), 2.6], &receivers);
        assert!(heard(&room).is_ok(), "{seed}: {:?}", heard(&room));
    }
}
