//! Head-related impulse responses from SOFA files of the conventions SimpleFreeFieldHRIR and GeneralFIR [AES69], also those of arrays of microphones
//! that were measured as heads are.
//!
//! They are the pressure at the ears over that at the centre of the head without the head, and are taken as the file has them: nothing is
//! normalised, propagation delays that the file holds stay. They are converted to the sample rate of the impulse responses. A direction takes the weighted
//! mean of the three measured directions around it ([`Triangles`]) at the largest measured distance, delays apart from what is left without them
//! ([`crate::alignment`]): the time between the ears changes without steps. Where nothing is measured within 30° of an axis of the head,
//! the axis takes the mean of all measured directions, weighted by 1 / distance⁴.
//!
//! References: [AES69] (docs/references.md).

use glam::DVec3;
use rayon::prelude::*;
use sonel_sofa::{Sofa, SofaError, Triangles, Triplets, Weights};

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

/// Conventions that are read.
const CONVENTIONS: [&str; 2] = ["SimpleFreeFieldHRIR", "GeneralFIR"];

/// Longest responses at a rate, with their delays [samples].
#[must_use]
pub fn longest(sample_rate_hz: u32) -> usize {
    (LONGEST * sample_rate_hz as usize).div_ceil(SAMPLE_RATE_HZ as usize)
}

/// Impulse responses for all directions at both ears of a head, or at the microphones of anything else that was measured so.
#[derive(Debug, Clone, PartialEq)]
pub struct Head {
    /// Left and right ear, or every microphone, for each measured direction, and for axes that are not measured.
    pub(crate) responses: Vec<Vec<Aligned>>,
    triangles: Triangles,
}

impl Head {
    /// Reads a SOFA file for impulse responses of a sample rate, one of [`crate::SAMPLE_RATES_HZ`].
    ///
    /// # Errors
    /// When it is none, is damaged, of another convention, or has no finite responses.
    pub fn read(file: &[u8], sample_rate_hz: u32) -> Result<Self, SoundError> {
        let measured = measured(file, sample_rate_hz).map_err(|problem| SoundError::Head { problem })?;
        let length = measured[0].1[0].1.len();
        let transform = Transform::new((2 * length).next_power_of_two());
        let aligned = |(delay, taps): &(f64, Vec<f64>)| {
            let aligned = Aligned::new(taps, &transform);
            Aligned { delay: aligned.delay + delay, ..aligned }
        };
        let responses = measured.par_iter().map(|(_, all)| all.iter().map(aligned).collect()).collect();
        Ok(Self::new(measured.into_iter().map(|(towards, _)| towards).collect(), responses))
    }

    /// Responses at every microphone for unit vectors towards the sources.
    pub(crate) fn new(mut directions: Vec<DVec3>, mut responses: Vec<Vec<Aligned>>) -> Self {
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
            let mean = |microphone: usize| {
                let all = weights.iter().zip(&responses);
                Aligned::mean(all.map(|(weight, responses)| (weight / sum, &responses[microphone])))
            };
            let mean = (0..responses[0].len()).map(mean).collect();
            directions.push(axis);
            responses.push(mean);
        }
        Self { triangles: Triangles::new(&directions), responses }
    }

    /// Weights of the directions around the unit vector `u`: x front, y left, z up.
    pub(crate) fn weights(&self, u: DVec3) -> Weights {
        self.triangles.weights(u)
    }

    /// The response at a microphone for the unit vector `u`: x front, y left, z up.
    pub(crate) fn between(&self, u: DVec3, microphone: usize) -> Aligned {
        let around = self.weights(u);
        Aligned::mean(around.iter().map(|(index, weight)| (*weight, &self.responses[*index][microphone])))
    }

    /// Delay of these weights at a microphone [samples]. Silent responses have none.
    pub(crate) fn delay(&self, weights: &Weights, microphone: usize) -> f64 {
        let heard = weights.iter().map(|(index, weight)| (weight, &self.responses[*index][microphone]));
        let heard = heard.filter(|(_, response)| !response.taps.is_empty());
        let [delay, sum] =
            heard.fold([0.0; 2], |[delay, sum], (weight, it)| [delay + weight * it.delay, sum + weight]);
        if sum > 0.0 { delay / sum } else { 0.0 }
    }
}

/// Unit vectors towards the sources at the largest distance, x front, y left, z up, with delay [samples] and taps at every microphone.
type Measured = Vec<(DVec3, Vec<(f64, Vec<f64>)>)>;

/// What a file holds, at a sample rate.
fn measured(file: &[u8], sample_rate_hz: u32) -> Result<Measured, SofaError> {
    let sofa = Sofa::open(file)?;
    let convention = sofa.attribute("SOFAConventions").unwrap_or("none");
    if !CONVENTIONS.contains(&convention) {
        return Err(format!("the file holds the convention {convention}").into());
    }
    let (taps, rates) = (sofa.required("Data.IR")?, sofa.required("Data.SamplingRate")?);
    let (&[measurements, microphones, length], false) = (&taps.shape[..], taps.values.is_empty()) else {
        return Err(
            format!("Data.IR has the shape {:?}, not measurements, receivers, samples", taps.shape).into()
        );
    };
    let from = rates.values.first().copied().unwrap_or(f64::NAN);
    let is_other = |rate: &f64| rate.fract() > 0.0 || *rate as u32 != from as u32;
    if !SAMPLE_RATES_HZ.contains(&(from as u32)) || rates.values.iter().any(is_other) {
        return Err(
            format!("its sample rate is {from} Hz, whole numbers of 8000 … 192000 Hz are allowed").into()
        );
    }
    let places = Triplets::read(&sofa, "SourcePosition", measurements, measurements, None)?;
    let positions = sofa.required("SourcePosition")?.shape[0];
    if positions != measurements {
        return Err(format!("SourcePosition has {positions} rows, Data.IR {measurements}").into());
    }
    let view = Triplets::read(&sofa, "ListenerView", measurements, measurements, Some(DVec3::X))?;
    if (0..measurements).any(|row| view.at(row, row) != view.at(0, 0)) {
        return Err("the listener turns between measurements: needed is one view, with sources around".into());
    }
    let places: Vec<DVec3> = (0..measurements).map(|row| places.at(row, row)).collect();
    let farthest = places.iter().map(|place| place.length()).fold(0.0, f64::max);
    // Of two ears receiver 0 is the left one, unless the file has it on the right.
    let ears = Triplets::read(&sofa, "ReceiverPosition", microphones, measurements, Some(DVec3::ZERO))?;
    let is_swapped = microphones == 2 && ears.at(0, 0).y < ears.at(1, 0).y;
    let (table, rates) = (Table::new(), [from as u32, sample_rate_hz]);
    let delays = sofa.array("Data.Delay")?.map(|delays| delays.values).unwrap_or_default();
    let at_microphone = |measurement: usize, microphone: usize| {
        let microphone = if is_swapped { 1 - microphone } else { microphone };
        let row = measurement * microphones + microphone;
        let delay = delays.get(row).or(delays.get(microphone)).copied().unwrap_or(0.0);
        let taps = converted(&table, &taps.values[row * length..(row + 1) * length], rates);
        (delay * f64::from(sample_rate_hz) / from, taps)
    };
    let is_far = |&(_, place): &(usize, &DVec3)| place.length() >= farthest * (1.0 - SAME_DISTANCE);
    let far: Vec<(usize, &DVec3)> = places.iter().enumerate().filter(is_far).collect();
    let of_place = |&(measurement, place): &(usize, &DVec3)| {
        (
            place.normalize(),
            (0..microphones).map(|microphone| at_microphone(measurement, microphone)).collect(),
        )
    };
    let found: Measured = far.par_iter().map(of_place).collect();
    check(&found, sample_rate_hz).map(|()| found)
}

/// Refuses what are no finite responses of a length that is taken.
fn check(measured: &Measured, sample_rate_hz: u32) -> Result<(), SofaError> {
    let all = || measured.iter().flat_map(|(_, responses)| responses);
    let is_finite = measured.iter().all(|(towards, _)| towards.is_finite())
        && all().all(|(delay, taps)| delay.is_finite() && taps.iter().all(|tap| tap.is_finite()));
    if !is_finite {
        return Err("a response, delay or position is not finite".into());
    }
    if all().any(|(delay, _)| *delay < 0.0) {
        return Err("a delay is negative".into());
    }
    let allowed = longest(sample_rate_hz);
    let samples = all().map(|(delay, taps)| delay.round() + taps.len() as f64).fold(0.0, f64::max);
    if samples > allowed as f64 {
        return Err(format!(
            "its responses have {samples} samples at {sample_rate_hz} Hz with their delays, {allowed} are allowed"
        ).into());
    }
    Ok(())
}

/// A response as a filter of the same spectrum at another rate, causal and as long in time, by the windowed sinc of [`crate::fractional`]: what that
/// rings behind the last sample is left out; at a lower rate, where it rings longer, what precedes the first one is added to it.
fn converted(table: &Table, row: &[f64], [from, to]: [u32; 2]) -> Vec<f64> {
    let ratio = f64::from(to) / f64::from(from);
    let count = (row.len() as f64 * ratio).ceil() as usize;
    if from == to {
        return row.to_vec();
    }
    let row = row.iter().copied();
    if from < to {
        // A pulse of one sample is shorter at a higher rate: its spectrum stays.
        let silence = || std::iter::repeat_n(0.0, HALF);
        let padded = silence().chain(row).chain(silence()).map(|tap| tap as f32);
        let padded: Vec<f32> = padded.collect();
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
