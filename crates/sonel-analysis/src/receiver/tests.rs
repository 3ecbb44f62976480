//! Parameters of exponential decays: thirds against octaves, measurements without a level.

use sonel_acoustics::BandWidth;
use sonel_echogram::Arrivals;
use sonel_echogram::provenance::{Measured, Provenance};
use sonel_testkit::exponential::ExponentialDecay;

use super::*;
use crate::open_plan::SPEECH_POWER_LEVEL_DB;

const OCTAVES: [f64; 8] = [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
const TALK: Talk = Talk {
    power_level_db: Some(SPEECH_POWER_LEVEL_DB),
    noise_level_db: [42.0, 38.0, 35.0, 32.0, 28.0, 24.0, 20.0],
};

/// Exponential decays of 0.6 s in all bands, of a source of `power_level_db` in each.
fn response(center_frequency_hz: Vec<f64>, power_level_db: f64) -> Response {
    let edges: Vec<f64> = (0..=1200).map(|edge| f64::from(edge) * 0.001).collect();
    let decay = ExponentialDecay { reverberation_time: 0.6, energy: 0.05 };
    let echogram: Vec<f64> = edges.windows(2).map(|pair| decay.energy_between(pair[0], pair[1])).collect();
    let bands = center_frequency_hz.len();
    Response {
        energy: echogram.repeat(bands),
        center_frequency_hz,
        time_edges_s: edges,
        receiver_names: vec!["seat".into()],
        receiver_positions: vec![[4.0, 0.0, 0.0]],
        receiver_directivities: Vec::new(),
        source_names: vec!["talker".into()],
        source_positions: vec![[0.0; 3]],
        source_power_level_db: vec![power_level_db; bands],
        speed_of_sound: 343.0,
        characteristic_impedance: 412.0,
        direct_times_s: vec![0.0],
        batches: None,
        missing: None,
        arrivals: Arrivals::default(),
        directions: None,
        provenance: Provenance::default(),
    }
}

/// Thirds of a source have a third of the power of its octaves.
#[test]
fn thirds_add_up_to_the_octaves_of_speech_and_noise() {
    let thirds = BandWidth::Third.nominal_series().filter(|hz| (50.0..=10_000.0).contains(hz)).collect();
    let octaves = response(OCTAVES.to_vec(), 90.0);
    let thirds = response(thirds, 90.0 - 10.0 * libm::log10(3.0));
    let value = |of: &ParameterValue| of.as_ref().expect("a value").value;
    for talk in [TALK, Talk { power_level_db: None, ..TALK }] {
        let [a, b] = [&octaves, &thirds].map(|response| parameters_of(response, Some(&talk)).remove(0));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        let [speech, of_thirds] = [&a, &b].map(|found| found.in_noise.as_ref().expect("noise"));
        near(value(&speech.level_db), value(&of_thirds.level_db));
        near(value(&speech.signal_to_noise_db), value(&of_thirds.signal_to_noise_db));
        for (octave, third) in a.octave_levels_db().into_iter().zip(b.octave_levels_db()) {
            near(octave.expect("a level"), third.expect("a level"));
        }
        for parameter in Parameter::IN_NOISE {
            let [octave, third] =
                [&a, &b].map(|found| value(&found.in_band(1000.0, parameter).expect("a band")));
            near(octave, third);
        }
    }
}

#[test]
fn a_measurement_has_nothing_that_needs_a_level() {
    let mut measured = response(OCTAVES.to_vec(), 0.0);
    measured.provenance.measured = Some(Measured { reached_db: vec![-60.0; 8] });
    let noisy = parameters_of(&measured, Some(&TALK)).remove(0);
    let speech = noisy.in_noise.as_ref().expect("noise");
    let of_bands =
        [Parameter::Level, Parameter::Strength, Parameter::SignalToNoise, Parameter::UsefulToDetrimental];
    let of_bands = of_bands.map(|parameter| noisy.in_band(1000.0, parameter).expect("a band"));
    let of_all = [
        &noisy.speech_transmission_index,
        &noisy.a_weighted_level_db,
        &speech.level_db,
        &speech.signal_to_noise_db,
    ];
    for value in of_all.into_iter().chain(&of_bands) {
        assert_eq!(*value, Err(Unsupported::NotCalibrated));
    }
    assert_eq!(noisy.octave_levels_db(), [None; 8]);
    let quiet = parameters(&measured).remove(0).speech_transmission_index.expect("the index of the room");
    assert_eq!(quiet.interval, Err(NoInterval::SingleMeasurement));
    assert!((quiet.value - 0.7).abs() < 0.1, "{}", quiet.value);
}
