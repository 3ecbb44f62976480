//! Head-related impulse responses from SOFA files of the convention SimpleFreeFieldHRIR [AES69].
//!
//! They are the pressure at the ears over that at the centre of the head without the head, and are taken as the file has them: nothing is
//! normalised, propagation delays that the file holds stay. They are converted to the sample rate of the impulse responses. A direction takes the weighted
//! mean of the three measured directions around it ([`Triangles`]) at the largest measured distance, delays apart from what is left without them
//! ([`crate::alignment`]): the time between the ears changes without steps. Where nothing is measured within 30° of an axis of the head,
//! the axis takes the mean of all measured directions, weighted by 1 / distance⁴.
//!
//! References: [AES69] (docs/references.md).

use std::panic::catch_unwind;

use glam::DVec3;
use rayon::prelude::*;
use sofar::reader::{OpenOptions, Sofar};
use sonel_sofa::{Sofa, Triangles, UNREAD, Weights};

use crate::alignment::Aligned;
use crate::fractional::{HALF, Table};
use crate::transform::Transform;
use crate::{SAMPLE_RATE_HZ, SAMPLE_RATES_HZ, SoundError};

/// Distances closer than this part are one.
const SAME_DISTANCE: f64 = 1e-3;
/// Longest responses at 48 kHz, with their delays [samples].
const LONGEST: usize = 1 << 12;

/// Cosine of 30°, beyond which an axis of the head counts as not measured.
const MEASURED_COSINE: f64 = 0.866_025_403_784_438_6;

/// Arrays that a head is made of.
const ARRAYS: [&str; 5] =
    ["Data.IR", "Data.Delay", "Data.SamplingRate", "SourcePosition", "ReceiverPosition"];

/// Longest responses at a rate, with their delays [samples].
#[must_use]
pub fn longest(sample_rate_hz: u32) -> usize {
    (LONGEST * sample_rate_hz as usize).div_ceil(SAMPLE_RATE_HZ as usize)
}

/// Impulse responses of both ears for all directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Head {
    /// Left and right ear for each measured direction, and for axes that are not measured.
    responses: Vec<[Aligned; 2]>,
    triangles: Triangles,
}

impl Head {
    /// Reads a SOFA file for impulse responses of a sample rate, one of [`crate::SAMPLE_RATES_HZ`].
    ///
    /// # Errors
    /// When it is none, is damaged, of another convention, or has no finite responses.
    pub fn read(file: &[u8], sample_rate_hz: u32) -> Result<Self, SoundError> {
        let failed = |problem: String| SoundError::Head { problem };
        let mut options = OpenOptions::default();
        // No rate is asked for: the library would convert responses without keeping the gain of their spectra.
        let options = options.sample_rate(f32::NAN).normalized(false);
        // The library indexes what a damaged file says.
        Sofa::open(file).and_then(|sofa| sofa.check(&ARRAYS)).map_err(failed)?;
        let opened = catch_unwind(|| options.open_data(file).map_err(|_| UNREAD.to_owned()));
        let sofar = opened.unwrap_or_else(|_| Err(UNREAD.to_owned())).map_err(failed)?;
        check(&sofar).map_err(failed)?;
        let (directions, responses) = measured(&sofar, sample_rate_hz);
        let numbers = responses.iter().flatten().flat_map(|(delay, taps)| taps.iter().chain([delay]));
        let is_finite =
            numbers.copied().all(f64::is_finite) && directions.iter().all(|place| place.is_finite());
        if directions.is_empty() || !is_finite {
            return Err(failed("a response, delay or position is not finite".to_owned()));
        }
        let allowed = longest(sample_rate_hz);
        if responses.iter().flatten().any(|(delay, _)| *delay < 0.0) {
            return Err(failed("a delay is negative".to_owned()));
        }
        let samples = responses.iter().flatten().map(|(delay, taps)| delay.round() + taps.len() as f64);
        let found = samples.fold(0.0, f64::max);
        if found > allowed as f64 {
            return Err(failed(format!(
                "its responses have {found} samples at {sample_rate_hz} Hz with their delays, {allowed} are allowed"
            )));
        }
        let length = responses[0][0].1.len();
        let transform = Transform::new((2 * length).next_power_of_two());
        let aligned = |(delay, taps): &(f64, Vec<f64>)| {
            let aligned = Aligned::new(taps, &transform);
            Aligned { delay: aligned.delay + delay, ..aligned }
        };
        let responses = responses.par_iter().map(|ears| ears.each_ref().map(aligned)).collect();
        Ok(Self::new(directions, responses))
    }

    /// Responses of both ears for unit vectors towards the sources.
    pub(crate) fn new(mut directions: Vec<DVec3>, mut responses: Vec<[Aligned; 2]>) -> Self {
        let measured = directions.len();
        for axis in [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z] {
            if directions[..measured].iter().any(|direction| direction.dot(axis) >= MEASURED_COSINE) {
                continue;
            }
            let weights: Vec<f64> = directions[..measured]
                .iter()
                .map(|direction| direction.distance_squared(axis))
                .map(|squared| 1.0 / (squared * squared))
                .collect();
            let sum: f64 = weights.iter().sum();
            let mean = [0, 1].map(|ear| {
                Aligned::mean(weights.iter().zip(&responses).map(|(weight, ears)| (weight / sum, &ears[ear])))
            });
            directions.push(axis);
            responses.push(mean);
        }
        Self { triangles: Triangles::new(&directions), responses }
    }

    /// Weights of the directions around the unit vector `u`: x front, y left, z up.
    pub(crate) fn weights(&self, u: DVec3) -> Weights {
        self.triangles.weights(u)
    }

    /// Left and right ear for each direction that weights are of.
    pub(crate) fn responses(&self) -> &[[Aligned; 2]] {
        &self.responses
    }

    /// Delay of these weights at the left (0) or right (1) ear [samples]. Silent responses have none.
    pub(crate) fn delay(&self, weights: &Weights, ear: usize) -> f64 {
        let heard = weights.iter().map(|(index, weight)| (weight, &self.responses[*index][ear]));
        let heard = heard.filter(|(_, response)| !response.taps.is_empty());
        let [delay, sum] =
            heard.fold([0.0; 2], |[delay, sum], (weight, it)| [delay + weight * it.delay, sum + weight]);
        if sum > 0.0 { delay / sum } else { 0.0 }
    }
}

/// Delay [samples] and taps at the left and the right ear.
type BothEars = [(f64, Vec<f64>); 2];

/// Unit vectors towards the sources at the largest distance, x front, y left, z up, and their responses.
fn measured(sofar: &Sofar, sample_rate_hz: u32) -> (Vec<DVec3>, Vec<BothEars>) {
    let hrtf = sofar.hrtf();
    let places: Vec<DVec3> = hrtf
        .source_position
        .values
        .chunks_exact(3)
        .map(|place| DVec3::new(f64::from(place[0]), f64::from(place[1]), f64::from(place[2])))
        .collect();
    let farthest = places.iter().map(|place| place.length()).fold(0.0, f64::max);
    // Receiver 0 is the left ear, unless the file has it on the right.
    let is_swapped =
        matches!(hrtf.receiver_position.values[..], [_, first, _, _, second, _] if first < second);
    let (table, rates) = (Table::new(), [hrtf.sample_rate() as u32, sample_rate_hz]);
    let rows = hrtf.data_ir.values.par_chunks_exact(sofar.filter_len());
    let rows: Vec<Vec<f64>> = rows.map(|row| converted(&table, row, rates)).collect();
    let (mut directions, mut responses) = (Vec::new(), Vec::new());
    for (index, place) in places.iter().enumerate() {
        if place.length() < farthest * (1.0 - SAME_DISTANCE) || farthest <= 0.0 {
            continue;
        }
        let ear = |ear: usize| {
            let row = 2 * index + usize::from((ear == 1) != is_swapped);
            let delays = &hrtf.data_delay.values;
            let delay = delays.get(row).or(delays.get(row % 2)).map_or(0.0, |delay| f64::from(*delay));
            let delay = delay * f64::from(sample_rate_hz) / f64::from(hrtf.sample_rate());
            (delay, rows[row].clone())
        };
        directions.push(place.normalize());
        responses.push([ear(0), ear(1)]);
    }
    (directions, responses)
}

/// A response as a filter of the same spectrum at another rate, causal and as long in time, by the windowed sinc of [`crate::fractional`]: what that
/// rings behind the last sample is left out; at a lower rate, where it rings longer, what precedes the first one is added to it.
fn converted(table: &Table, row: &[f32], [from, to]: [u32; 2]) -> Vec<f64> {
    let ratio = f64::from(to) / f64::from(from);
    let count = (row.len() as f64 * ratio).ceil() as usize;
    let row = row.iter().map(|tap| f64::from(*tap));
    if from == to {
        return row.collect();
    }
    if from < to {
        // A pulse of one sample is shorter at a higher rate: its spectrum stays.
        let silence = || std::iter::repeat_n(0.0, HALF);
        let padded: Vec<f64> = silence().chain(row).chain(silence()).collect();
        return (0..count).map(|at| table.read(&padded, at as f64 / ratio + HALF as f64) / ratio).collect();
    }
    let mut sum = vec![0.0; count + 4 * HALF];
    for (at, tap) in row.enumerate() {
        let (first, values) = table.pulse(at as f64 * ratio);
        let place = sum[(first + HALF as isize) as usize..].iter_mut();
        place.zip(values).for_each(|(sum, value)| *sum += tap * value);
    }
    sum[HALF] += sum[..HALF].iter().sum::<f64>();
    sum[HALF..HALF + count].to_vec()
}

/// What the library does not refuse and this module needs.
fn check(sofar: &Sofar) -> Result<(), String> {
    let hrtf = sofar.hrtf();
    let convention = hrtf.get_attribute("SOFAConventions").unwrap_or("none");
    if convention != "SimpleFreeFieldHRIR" {
        return Err(format!("the file holds the convention {convention}"));
    }
    let (measured, length) = (sofar.num_measurements() as usize, sofar.filter_len());
    let found = (hrtf.r(), hrtf.data_ir.len(), hrtf.source_position.len());
    if measured == 0 || length == 0 || found != (2, 2 * measured * length, 3 * measured) {
        return Err("its arrays do not have the shapes of two ears, directions and samples".to_owned());
    }
    let rate = hrtf.sample_rate();
    if !SAMPLE_RATES_HZ.contains(&(rate as u32)) || rate.fract() > 0.0 {
        return Err(format!("its sample rate is {rate} Hz, whole numbers of 8000 … 192000 Hz are allowed"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cardioids in 26 directions, 64 samples: an ear towards a source has a pulse of 1 + ½ cos at sample 32 − 16 cos of the angle to its axis.
    const FILE: &[u8] = include_bytes!("../tests/cardioid-head.sofa");

    /// Sample and value of the largest sample from a direction.
    fn peak(head: &Head, u: DVec3, ear: usize) -> (usize, f64) {
        let samples = head.response(u, ear);
        let at = (0..samples.len()).max_by(|a, b| samples[*a].abs().total_cmp(&samples[*b].abs())).unwrap();
        (at, samples[at])
    }

    #[test]
    fn ears_have_the_responses_of_measured_directions() {
        let head = Head::read(FILE, SAMPLE_RATE_HZ).unwrap();
        let half = 0.5_f64.sqrt();
        for (u, left, right) in [
            (DVec3::X, (32, 1.0), (32, 1.0)),
            (DVec3::Y, (16, 1.5), (48, 0.5)),
            (DVec3::NEG_Y, (48, 0.5), (16, 1.5)),
            (DVec3::new(half, half, 0.0), (21, 1.0 + 0.5 * half), (43, 1.0 - 0.5 * half)),
        ] {
            for (ear, expected) in [left, right].into_iter().enumerate() {
                let found = peak(&head, u, ear);
                assert!(found.0 == expected.0 && (found.1 - expected.1).abs() < 1e-6, "{u} {ear}: {found:?}");
            }
        }
    }

    /// The sum of a response is its spectrum at 0 Hz; a pulse at sample 16 is at 1/3 ms.
    #[test]
    fn another_rate_keeps_spectrum_and_time() {
        for rate in [8000, 16_000, 44_100, 96_000, 192_000] {
            let head = Head::read(FILE, rate).unwrap();
            let sum: f64 = head.response(DVec3::Y, 0).iter().sum();
            assert!((sum / 1.5 - 1.0).abs() < 0.02, "{rate} Hz: {sum}");
            let off = peak(&head, DVec3::Y, 0).0 as f64 / f64::from(rate) - 1.0 / 3000.0;
            assert!(off.abs() < 1.0 / f64::from(rate), "{rate} Hz: {off} s");
        }
    }

    #[test]
    fn files_that_are_none_or_damaged_are_errors() {
        assert!(Head::read(b"RIFF", SAMPLE_RATE_HZ).unwrap_err().to_string().contains("SimpleFreeFieldHRIR"));
        assert!(Head::read(b"", SAMPLE_RATE_HZ).is_err());
        for length in (0..FILE.len()).step_by(1013) {
            assert!(Head::read(&FILE[..length], SAMPLE_RATE_HZ).is_err(), "cut at {length}");
        }
    }
}
