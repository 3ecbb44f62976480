//! Measured impulse responses as responses: octaves, time zero, background noise.
//!
//! The mean of the samples is taken from them: no loudspeaker radiates a constant pressure, so it is an offset of the recorder.
//! Time zero is the first sample within 20 dB of the largest one [ISO3382-1]. Per octave ([`octave_filter`](mod@crate::octave_filter)) the noise
//! and the time at which the decay meets it are found by the iteration of [Lundeby1995]. The noise is taken from the energies; what a bin lacks
//! is taken from the next, so that sums stay. Beyond the crossing the decay goes on with its late rate: the correction for truncation of
//! [ISO3382-1]. The level that the crossing has in the decay curve decides which reverberation times can be read.
//!
//! References: [ISO3382-1], [Lundeby1995] (docs/references.md).

use sonel_echogram::provenance::{Measured, Provenance};
use sonel_echogram::{Arrivals, Response};

use crate::octave_filter::FilterBank;
use crate::wav::onset;
use crate::{Recording, SoundError};

/// Octaves, nominal centres [Hz].
const OCTAVES: [f64; 8] = [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];
/// Width of a bin [s].
const BIN: f64 = 1e-3;
/// Longest record after the onset [s]: no room decays for minutes.
const LONGEST: f64 = 600.0;
/// Bins of the first averages of Lundeby's iteration: 30 ms.
const FIRST_AVERAGE: usize = 30;
/// Part of the record in which the first estimate of the noise is taken.
const NOISE_PART: f64 = 0.1;
/// Averages per 10 dB of decay.
const AVERAGES_PER_10_DB: f64 = 5.0;
/// Above the noise, where the regression of the late decay ends, and its length [dB].
const ABOVE_NOISE_DB: f64 = 5.0;
const LATE_RANGE_DB: f64 = 20.0;
/// Beyond the crossing, where the noise begins to be taken [dB of decay].
const SAFETY_DB: f64 = 5.0;
/// Iterations.
const ITERATIONS: usize = 6;
/// dB per neper of energy.
const DB_PER_NEPER: f64 = 10.0 / std::f64::consts::LN_10;
/// Speed of sound and impedance of a response, which nothing that is read from it uses: the source is not calibrated.
const SPEED_OF_SOUND: f64 = 343.2;
const IMPEDANCE: f64 = 400.0;

/// The first channel of an impulse response as a response of one source at one receiver, called `receiver`, in the octaves that it holds. Its
/// provenance states the level of the decay curve at which each octave meets its noise.
///
/// # Errors
/// When it is silent, too short for any octave, longer than ten minutes, or its sample rate holds no octave.
pub fn response(recording: &Recording, receiver: &str) -> Result<Response, SoundError> {
    let rate = f64::from(recording.sample_rate_hz);
    let recorded = recording.channels.first().ok_or(SoundError::Empty)?;
    let offset = recorded.iter().map(|&sample| f64::from(sample)).sum::<f64>() / recorded.len() as f64;
    let samples: Vec<f32> = recorded.iter().map(|sample| sample - offset as f32).collect();
    let onset = onset(std::slice::from_ref(&samples)).ok_or(SoundError::Silent)?;
    let seconds = (samples.len() - onset) as f64 / rate;
    let count = (seconds / BIN) as usize;
    if count < 4 * FIRST_AVERAGE || seconds > LONGEST {
        return Err(SoundError::Length { seconds });
    }
    let is_held = |center: &f64| center * std::f64::consts::SQRT_2 <= 0.5 * rate;
    if !is_held(&OCTAVES[0]) {
        return Err(SoundError::NoOctave { sample_rate_hz: recording.sample_rate_hz });
    }
    let bank = FilterBank::new(&samples, rate);
    let border = |bin: usize| onset + (bin as f64 * BIN * rate).round() as usize;
    let mut centers = Vec::new();
    let (mut energy, mut reached_db) = (Vec::new(), Vec::new());
    for center in OCTAVES.into_iter().filter(is_held) {
        let filtered = bank.octave(center);
        let sum = |from: usize, to: usize| filtered[from..to].iter().map(|p| p * p).sum::<f64>();
        let mut bins: Vec<f64> =
            (0..count).map(|bin| sum(border(bin), border(bin + 1).min(samples.len()))).collect();
        // The filters have no phase: what rings before the onset belongs to it.
        bins[0] += sum(onset.saturating_sub((0.05 * rate) as usize), onset);
        centers.push(center);
        reached_db.push(compensate(&mut bins));
        energy.extend(bins);
    }
    let bands = centers.len();
    Ok(Response {
        center_frequency_hz: centers,
        time_edges_s: (0..=count).map(|bin| bin as f64 * BIN).collect(),
        receiver_names: vec![receiver.to_owned()],
        receiver_positions: vec![[0.0; 3]],
        receiver_directivities: Vec::new(),
        source_names: vec!["measured".to_owned()],
        source_positions: vec![[0.0; 3]],
        source_power_level_db: vec![0.0; bands],
        speed_of_sound: SPEED_OF_SOUND,
        characteristic_impedance: IMPEDANCE,
        direct_times_s: vec![0.0],
        energy,
        batches: None,
        missing: None,
        arrivals: Arrivals::default(),
        directions: None,
        provenance: Provenance {
            scene: Some("measurement".to_owned()),
            measured: Some(Measured { reached_db }),
            ..Provenance::default()
        },
    })
}

/// Frees `bins` of their noise and continues the decay beyond it; returns the level of the decay curve at the crossing [dB], at most 0.
fn compensate(bins: &mut [f64]) -> f64 {
    let Some(Crossing { at, noise, rate }) = crossing(bins) else {
        // Nothing stands out of the noise.
        bins.fill(0.0);
        return 0.0;
    };
    let mut lacking = 0.0;
    for bin in &mut bins[..at] {
        let free = *bin - noise + lacking;
        (*bin, lacking) = if free < 0.0 { (0.0, free) } else { (free, 0.0) };
    }
    // At the crossing the decay is as strong as the noise.
    for (later, bin) in bins[at..].iter_mut().enumerate() {
        *bin = noise * libm::exp(-rate * BIN * (later as f64 + 0.5));
    }
    let after: f64 = noise / (rate * BIN);
    let before: f64 = bins[..at].iter().sum();
    10.0 * libm::log10(after / (before + after))
}

/// Where a decay meets its noise.
struct Crossing {
    /// Bin.
    at: usize,
    /// Energy of the noise per bin.
    noise: f64,
    /// Of the late decay [1/s].
    rate: f64,
}

/// Lundeby's iteration; none where nothing decays into a noise.
fn crossing(bins: &[f64]) -> Option<Crossing> {
    let count = bins.len();
    let mean = |range: std::ops::Range<usize>| {
        let length = range.len().max(1) as f64;
        bins[range].iter().sum::<f64>() / length
    };
    let mut noise = mean(count - (NOISE_PART * count as f64) as usize..count);
    let mut width = FIRST_AVERAGE;
    let floor = bins.iter().copied().fold(0.0, f64::max) * f64::MIN_POSITIVE.sqrt();
    let level = |energy: f64| 10.0 * libm::log10(energy.max(floor).max(f64::MIN_POSITIVE));
    let averaged = |width: usize| -> Vec<(f64, f64)> {
        let middle = |at: usize| at as f64 + 0.5 * width as f64;
        (0..count / width).map(|k| (middle(k * width), level(mean(k * width..(k + 1) * width)))).collect()
    };
    let first = averaged(width);
    let peak = first.iter().map(|point| point.1).fold(f64::MIN, f64::max);
    let begin = first.iter().position(|point| point.1 >= peak)?;
    let end = begin + first[begin..].iter().position(|point| point.1 < level(noise) + 10.0)?;
    let (mut at_zero, mut slope) = line(&first[begin..end.max(begin + 2).min(first.len())])?;
    let mut at = (level(noise) - at_zero) / slope;
    for _ in 0..ITERATIONS {
        if slope >= 0.0 || !at.is_finite() || at <= 0.0 {
            return None;
        }
        width = ((10.0 / -slope / AVERAGES_PER_10_DB) as usize).clamp(1, count / 8);
        let from = (at + SAFETY_DB / -slope) as usize;
        let last = count - (NOISE_PART * count as f64) as usize;
        noise = mean(from.min(last)..count);
        let (high, low) = (level(noise) + ABOVE_NOISE_DB + LATE_RANGE_DB, level(noise) + ABOVE_NOISE_DB);
        let points = averaged(width);
        let loudest = points.iter().enumerate().max_by(|a, b| a.1.1.total_cmp(&b.1.1))?.0;
        let begin =
            loudest + points[loudest..].iter().position(|point| point.1 <= high.min(points[loudest].1))?;
        let end =
            begin + points[begin..].iter().position(|point| point.1 < low).unwrap_or(points.len() - begin);
        (at_zero, slope) = line(&points[begin..end.max(begin + 2).min(points.len())])?;
        at = (level(noise) - at_zero) / slope;
    }
    let rate = -slope / DB_PER_NEPER / BIN;
    (slope < 0.0 && at > 0.0 && rate.is_finite()).then(|| Crossing {
        at: (at as usize).clamp(1, count),
        noise,
        rate,
    })
}

/// Value at 0 and slope of the least squares line; none of fewer than two points.
fn line(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let count = points.len() as f64;
    let (mean_x, mean_y) =
        (points.iter().map(|p| p.0).sum::<f64>() / count, points.iter().map(|p| p.1).sum::<f64>() / count);
    let product: f64 = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    let square: f64 = points.iter().map(|p| (p.0 - mean_x) * (p.0 - mean_x)).sum();
    let slope = product / square;
    (points.len() >= 2 && slope.is_finite()).then_some((mean_y - slope * mean_x, slope))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_sampling::{Purpose, StreamFamily};

    const RATE: u32 = 16_000;

    /// Noise that decays with `time` [s] from 0.1 s on and meets stationary noise of `noise_db` below its beginning.
    fn recording(time: f64, noise_db: f64) -> Recording {
        let mut stream = StreamFamily::new(5, Purpose::Pulse, [0; 4]).stream(0);
        let floor = libm::pow(10.0, noise_db / 20.0);
        let sample = |at: usize| {
            let since = at as f64 / f64::from(RATE) - 0.1;
            let mut draw = || stream.uniform_fine() - stream.uniform_fine();
            let decay = if since < 0.0 { 0.0 } else { libm::exp(-6.907_755_3 * since / time) };
            (decay * draw() + floor * draw()) as f32
        };
        let count = (2.5 * f64::from(RATE)) as usize;
        Recording { sample_rate_hz: RATE, channels: vec![(0..count).map(sample).collect()] }
    }

    #[test]
    fn records_of_no_octave_or_of_hours_are_refused() {
        let of = |sample_rate_hz, count| {
            let mut click = vec![0.0; count];
            click[0] = 0.5;
            response(&Recording { sample_rate_hz, channels: vec![click] }, "seat")
        };
        assert!(matches!(of(177, 2000), Err(SoundError::NoOctave { sample_rate_hz: 177 })));
        assert_eq!(of(180, 2000).unwrap().center_frequency_hz, [63.0]);
        assert!(matches!(of(180, 200_000), Err(SoundError::Length { .. })));
        assert!(matches!(of(180, 18), Err(SoundError::Length { .. })));
    }

    /// The noise of a record of octaves of B Hz spreads the reverberation time by about 1/√(B T): 3 standard errors at 1000 Hz are 8 %.
    #[test]
    fn the_decay_goes_on_where_the_noise_was() {
        let response = response(&recording(1.0, -50.0), "seat").unwrap();
        assert_eq!(response.center_frequency_hz.len(), 7, "8 kHz is above the rate");
        let reached = &response.provenance.measured.as_ref().unwrap().reached_db;
        let band = 4;
        let crossing = reached[band];
        assert!((-62.0..-42.0).contains(&crossing), "{crossing}");
        let bins = response.echogram(0, 0, band);
        let after = |bin: usize| bins[bin..].iter().sum::<f64>();
        let slope = 10.0 * libm::log10(after(100) / after(1100)) / 60.0;
        assert!((slope - 1.0).abs() < 0.08, "{slope}");
        assert!(bins.iter().all(|energy| *energy >= 0.0));
    }

    #[test]
    fn a_loud_noise_is_told_by_a_high_crossing() {
        let response = response(&recording(1.0, -25.0), "seat").unwrap();
        let reached = response.provenance.measured.as_ref().unwrap().reached_db[4];
        assert!((-36.0..-15.0).contains(&reached), "{reached}");
    }

    #[test]
    fn an_offset_of_the_recorder_is_no_sound() {
        let found = |offset: f32| {
            let mut recording = recording(1.0, -50.0);
            recording.channels[0].iter_mut().for_each(|sample| *sample += offset);
            let Response { energy, provenance, .. } = response(&recording, "seat").unwrap();
            (energy, provenance.measured.unwrap().reached_db)
        };
        let (expected, expected_db) = found(0.0);
        let (energy, reached_db) = found(0.03);
        let largest = expected.iter().copied().fold(0.0, f64::max);
        assert!(
            energy.iter().zip(&expected).all(|(found, expected)| (found - expected).abs() < 1e-4 * largest)
        );
        assert!(reached_db.iter().zip(&expected_db).all(|(found, expected)| (found - expected).abs() < 0.1));
    }

    #[test]
    fn silence_and_clicks_are_errors() {
        let of = |samples: Vec<f32>| {
            response(&Recording { sample_rate_hz: RATE, channels: vec![samples] }, "seat")
        };
        assert!(of(vec![0.0; 16_000]).is_err() && of(vec![1.0; 100]).is_err());
    }
}
