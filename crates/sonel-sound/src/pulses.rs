//! From echograms and arrivals to pulses.
//!
//! A listed arrival is one pulse on the nearest sample (at most 10.4 µs or 3.6 mm off) with the root of its energy in every band. What the
//! bins hold beside the arrivals becomes as many pulses as reflections are expected in a room of volume V, 4πc³t²/V per second
//! [Kuttruff2009, section 4.1], but at least one a bin and at most one a sample; each has an equal part of the bin's energy and lies
//! anywhere in its equal part of the bin. Sound without reflection keeps its sign; the sign of every other pulse is random, so that the
//! expected energy of a sum is the sum of the energies, as the echogram has it.
//!
//! Where the response has directions, an arrival has its own, and the pulses of a bin have random ones whose mean is that of the bin, over all
//! bands ([`crate::ambisonics`]); these take random numbers of their own.

use glam::DVec3;
use sonel_echogram::Response;
use sonel_sampling::{Purpose, Stream, StreamFamily};

use crate::{SAMPLE_RATE_HZ, SoundError, ambisonics};

const RATE: f64 = SAMPLE_RATE_HZ as f64;
/// Squared amplitude of a pulse for a fluence of 1/m²: 4π, so that direct sound is 1/r.
const PRESSURE_OF_FLUENCE: f64 = 4.0 * std::f64::consts::PI;
/// Sums in another order differ by less than this part of all that they sum.
const ROUNDING: f64 = 1e-9;

/// Pulses of one source at one receiver.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pulses {
    /// Sample of each, from the emission on. [P]
    pub sample: Vec<usize>,
    /// Amplitude in every band, relative to a free field at 1 m. [P, B]
    pub amplitude: Vec<f64>,
    /// Unit vector towards where each comes from, in the axes of the scene; empty where the response has no directions. [P]
    pub direction: Vec<DVec3>,
}

/// Samples of an impulse response as long as the echogram.
#[must_use]
pub fn sample_count(response: &Response) -> usize {
    let end = response.time_edges_s.last().copied().unwrap_or(0.0);
    nearest_sample(end) + 1
}

fn nearest_sample(time: f64) -> usize {
    libm::round(time.max(0.0) * RATE) as usize
}

impl Pulses {
    /// Pulses of source `s` at receiver `r` in a room of so many m³; without a volume one for every sample. Another `seed` gives other
    /// signs and times.
    ///
    /// # Errors
    /// When listed arrivals are not part of the echogram.
    pub fn new(
        response: &Response,
        (s, r): (usize, usize),
        volume: Option<f64>,
        seed: u64,
    ) -> Result<Self, SoundError> {
        let mut signs = stream(response, (s, r), seed, Purpose::Pulse);
        let mut pulses = Self::default();
        let echograms: Vec<&[f64]> =
            (0..response.bands()).map(|band| response.echogram(s, r, band)).collect();
        let mut rest: Vec<Vec<f64>> = echograms.iter().map(|echogram| echogram.to_vec()).collect();
        let mut moment = moments(response, (s, r));
        let mut directions = stream(response, (s, r), seed, Purpose::PulseDirection);
        pulses.add_arrivals(response, (s, r), (&mut rest, &mut moment), &mut signs)?;
        // What rounding leaves of a bin is no sound.
        for (rest, echogram) in rest.iter_mut().zip(&echograms) {
            let pairs = rest.iter_mut().zip(*echogram);
            pairs.filter(|(rest, whole)| **rest < ROUNDING * **whole).for_each(|(rest, _)| *rest = 0.0);
        }
        let direct = response.direct_time(s, r);
        for (bin, edges) in response.time_edges_s.windows(2).enumerate() {
            let energy: Vec<f64> = rest.iter().map(|band| band[bin]).collect();
            if energy.iter().all(|energy| *energy <= 0.0) {
                continue;
            }
            // Nothing is scattered to the receiver before its direct sound.
            let begin = if direct < edges[1] { edges[0].max(direct) } else { edges[0] };
            let count = reflections([begin, edges[1]], volume, response.speed_of_sound);
            let step = (edges[1] - begin) / count as f64;
            for index in 0..count {
                let time = begin + (index as f64 + signs.uniform_fine()) * step;
                let sign = random_sign(&mut signs);
                pulses.push(time, energy.iter().map(|energy| energy / count as f64), sign);
                if let Some(moment) = moment.get(bin) {
                    let all: f64 = energy.iter().sum();
                    pulses.direction.push(ambisonics::direction(*moment / all, &mut directions));
                }
            }
        }
        Ok(pulses)
    }

    /// Adds the listed arrivals and takes their energy out of `rest`, the echogram of every band, and out of the moments.
    fn add_arrivals(
        &mut self,
        response: &Response,
        (s, r): (usize, usize),
        (rest, moment): (&mut [Vec<f64>], &mut [DVec3]),
        stream: &mut Stream,
    ) -> Result<(), SoundError> {
        let (arrivals, bands) = (&response.arrivals, response.bands());
        for a in 0..arrivals.source.len() {
            if (arrivals.source[a] as usize, arrivals.receiver[a] as usize) != (s, r) {
                continue;
            }
            let (time, energy) = (arrivals.time_s[a], &arrivals.energy[a * bands..(a + 1) * bands]);
            let bin = bin_holding(response, (s, r), time, energy, rest).ok_or_else(|| {
                let receiver = response.receiver_names[r].clone();
                SoundError::ArrivalWithoutEnergy { receiver, time_s: time }
            })?;
            for (band, energy) in rest.iter_mut().zip(energy) {
                band[bin] -= energy;
            }
            let sign = if arrivals.order[a] == 0 { 1.0 } else { random_sign(stream) };
            self.push(time, energy.iter().copied(), sign);
            if let Some(moment) = moment.get_mut(bin) {
                let direction = DVec3::from_slice(&arrivals.direction[3 * a..]);
                *moment -= direction * energy.iter().sum::<f64>();
                self.direction.push(direction);
            }
        }
        Ok(())
    }

    fn push(&mut self, time: f64, energy: impl Iterator<Item = f64>, sign: f64) {
        self.sample.push(nearest_sample(time));
        // A pulse of amplitude a has the spectrum a² at all frequencies, so that its band mean is 4πF whatever the width of the band.
        self.amplitude.extend(energy.map(|energy| sign * (PRESSURE_OF_FLUENCE * energy).sqrt()));
    }
}

/// Moments of all bins, summed over the bands; none where the response has no directions.
fn moments(response: &Response, (s, r): (usize, usize)) -> Vec<DVec3> {
    let Some(directions) = &response.directions else { return Vec::new() };
    let (bands, bins) = (response.bands(), response.bins());
    let mut sums = vec![DVec3::ZERO; bins];
    let first = (s * response.receivers() + r) * bands;
    for band in first..first + bands {
        let of_band = directions.moment[3 * band * bins..3 * (band + 1) * bins].chunks_exact(3);
        for (sum, moment) in sums.iter_mut().zip(of_band) {
            *sum += DVec3::from_slice(moment);
        }
    }
    sums
}

fn stream(response: &Response, (s, r): (usize, usize), seed: u64, purpose: Purpose) -> Stream {
    let [x, y, z] = response.receiver_positions[r].map(|coordinate| (coordinate as f32).to_bits());
    StreamFamily::new(seed, purpose, [s as u32, x, y, z]).stream(0)
}

fn random_sign(stream: &mut Stream) -> f64 {
    if stream.bits() & 1 == 0 { 1.0 } else { -1.0 }
}

/// The bin of an arrival: that of its time or, at a border, the neighbour it was rounded to; the one that holds its energy.
fn bin_holding(
    response: &Response,
    (s, r): (usize, usize),
    time: f64,
    energy: &[f64],
    rest: &[Vec<f64>],
) -> Option<usize> {
    let edges = &response.time_edges_s;
    let candidates = [time, time * (1.0 - ROUNDING), time * (1.0 + ROUNDING)];
    let bins = candidates.map(|time| edges.partition_point(|edge| *edge <= time).saturating_sub(1));
    // Of a bin with a strong arrival the others leave what rounding makes of all of it.
    let holds = |bin: &usize| {
        let bands = rest.iter().enumerate().zip(energy);
        bands
            .map(|((band, rest), energy)| (rest.get(*bin), response.echogram(s, r, band).get(*bin), energy))
            .all(|(rest, whole, energy)| {
                rest.zip(whole).is_some_and(|(rest, whole)| rest + ROUNDING * whole >= *energy)
            })
    };
    bins.into_iter().find(holds)
}

/// Reflections expected between two times [s]: N(t) = 4π(ct)³/(3V); 1 … one a sample.
fn reflections([begin, end]: [f64; 2], volume: Option<f64>, speed_of_sound: f64) -> usize {
    let samples = ((end - begin) * RATE).max(1.0);
    let count = volume.map_or(samples, |volume| {
        let until =
            |time: f64| 4.0 / 3.0 * std::f64::consts::PI * libm::pow(speed_of_sound * time, 3.0) / volume;
        until(end) - until(begin)
    });
    libm::round(count.clamp(1.0, samples)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflections_are_those_of_the_room_between_one_a_bin_and_one_a_sample() {
        let of = |time: f64, volume| reflections([time, time + 0.001], volume, 343.0);
        assert_eq!(of(0.001, Some(200.0)), 1);
        assert_eq!(of(0.5, Some(200.0)), 48);
        assert_eq!(of(0.001, None), 48);
        // 4πc³t²/V = 10 143 1/s about 63.25 ms in 200 m³.
        assert_eq!(of(0.062_75, Some(200.0)), 10);
    }
}
