//! Echograms of sampled pressure by an octave analysis of its own; nothing of the synthesis is shared.

use std::f64::consts::PI;

use realfft::RealFftPlanner;
use sonel_echogram::{Arrivals, Response};
use sonel_sound::SAMPLE_RATE_HZ;

/// How an octave is cut out of the spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Filter {
    /// All of it alike and nothing else: for levels. It rings so long that it hides decays.
    Sharp,
    /// Towards its borders less and less, by cos² over the logarithm of frequency: for decays.
    Smooth,
}

impl Filter {
    /// Gain at a frequency so many octaves from the centre.
    fn gain(self, octaves: f64) -> f64 {
        match self {
            _ if octaves.abs() >= 0.5 => 0.0,
            Self::Sharp => 1.0,
            Self::Smooth => (PI * octaves).cos().powi(2),
        }
    }
}

/// `response` with one source and receiver, its energies measured from `pressure` in the same bins and octaves.
#[must_use]
pub fn measured(response: &Response, (s, r): (usize, usize), pressure: &[f32], filter: Filter) -> Response {
    let energy = response.center_frequency_hz.iter().flat_map(|center| {
        let squares = squared_octave(pressure, *center, filter);
        response
            .time_edges_s
            .windows(2)
            .map(|edges| {
                let sample =
                    |time: f64| ((time * f64::from(SAMPLE_RATE_HZ)).ceil() as usize).min(squares.len());
                squares[sample(edges[0])..sample(edges[1])].iter().sum::<f64>() / (4.0 * PI)
            })
            .collect::<Vec<f64>>()
    });
    let bands = response.bands();
    Response {
        energy: energy.collect(),
        receiver_names: vec![response.receiver_names[r].clone()],
        receiver_positions: vec![response.receiver_positions[r]],
        receiver_directivities: response.receiver_directivities.get(r).cloned().into_iter().collect(),
        source_names: vec![response.source_names[s].clone()],
        source_positions: vec![response.source_positions[s]],
        source_power_level_db: response.source_power_level_db[s * bands..(s + 1) * bands].to_vec(),
        batches: None,
        missing: None,
        arrivals: Arrivals::default(),
        directions: None,
        ..response.clone()
    }
}

/// Squared pressure in the octave about `center` [Hz], over the part of the spectrum that the filter takes.
fn squared_octave(pressure: &[f32], center: f64, filter: Filter) -> Vec<f64> {
    let length = 2 * pressure.len().next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let forward = planner.plan_fft_forward(length);
    let (mut padded, mut spectrum) = (forward.make_input_vec(), forward.make_output_vec());
    for (padded, sample) in padded.iter_mut().zip(pressure) {
        *padded = f64::from(*sample);
    }
    forward.process(&mut padded, &mut spectrum).expect("buffers are the plan's own");
    let step = f64::from(SAMPLE_RATE_HZ) / length as f64;
    let mut inside = 0.0;
    for (index, value) in spectrum.iter_mut().enumerate() {
        let gain = filter.gain((index as f64 * step / center).log2());
        *value *= gain;
        inside += gain * gain;
    }
    let backward = planner.plan_fft_inverse(length);
    let mut band = backward.make_output_vec();
    backward.process(&mut spectrum, &mut band).expect("the ends of a real signal's spectrum are real");
    let share = 2.0 * inside / length as f64;
    let scale = 1.0 / length as f64;
    band.truncate(pressure.len());
    band.into_iter().map(|value| (value * scale).powi(2) / share).collect()
}
