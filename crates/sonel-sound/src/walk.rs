//! What a listener hears of a recording while moving: convolution with a response that changes.
//!
//! At the time τ a listener at x(τ) gets from the (image) source at X what left it at τ − |X − x(τ)|/c. Listed arrivals of the rendered places are such image
//! sources, with 1/r and delay exact at every sample, so that Doppler shift is there without being made. Neighbouring places list the same image
//! sources: their sum with weights that fall linearly to the next place is that of one, and what only one of them lists fades in.
//!
//! Late sound is convolved with responses at steps of 2 cm, whose plane waves are those of all receivers ([`crate::plane_waves`]) and whose energies
//! lie between those of the places. Each is heard for four steps through a Hann window over the path. Steps that are short beside the wave add up
//! coherently, long ones in energy: at wave number k the sum is divided by the root of Σ_ij w_i w_j sin(kd_ij)/kd_ij, its expected energy in a diffuse field
//! [Cook1955]. Above 4 kHz late sound fluctuates more slowly than the listener moves.
//!
//! References: [Cook1955] (docs/references.md).

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::LazyLock;

use glam::DVec3;
use rayon::prelude::*;
use sonel_echogram::Response;

use crate::ambisonics::{Frame, channels};
use crate::crossover::Crossover;
use crate::fractional::HALF;
use crate::impulse::{SoundSettings, Step, Synthesizer};
use crate::microphones::{self, Microphone};
use crate::path::Path;
use crate::pulses::Pulses;
use crate::transform::{Transform, through};
use crate::{SoundError, convolve};

/// Longest step between responses of late sound [m].
const STEP: f64 = 0.02;
/// Half the width of a window [steps].
const REACH: f64 = 2.0;
/// Samples between which gains are linear.
const BLOCK: usize = 256;
/// Samples that are made at a time, at least, so that long recordings take no more memory; a multiple of a block.
const SECTION: usize = 1 << 18;
/// Smallest distance of a listener from a source [m].
const CLOSEST: f64 = 0.01;

/// Who moves; axes are those of the scene and do not turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Listener<'a> {
    /// A point.
    Point,
    /// Microphones about it.
    Array(&'a [Microphone]),
    /// Ambisonics of an order in [`Axes::Scene`](crate::ambisonics::Axes) with this unit vector up.
    Ambisonics(u32, DVec3),
}

/// Channels at one point that moves along.
enum Spot<'a> {
    Point,
    Microphone(&'a Microphone),
    Ambisonics(u32, Frame),
}

impl Spot<'_> {
    fn offset(&self) -> DVec3 {
        if let Self::Microphone(microphone) = self { microphone.position } else { DVec3::ZERO }
    }

    fn channels(&self) -> usize {
        if let Self::Ambisonics(order, _) = self { channels(*order) } else { 1 }
    }

    /// Gain of every channel for a direction, a unit vector.
    fn gains(&self, towards: DVec3) -> Vec<f64> {
        match self {
            Self::Point => vec![1.0],
            Self::Microphone(microphone) => vec![microphone.gain(towards)],
            Self::Ambisonics(order, frame) => frame.gains(*order, towards),
        }
    }
}

/// What a listener hears of a `signal` that source `s` sends from the first time of the `path` on: one or more channels, each as long as signal and echogram together.
/// `take` gets their length and, one after the other, sections of all channels. The response is that of the places of the path which are `spacing` apart. `step` is that of
/// [`Synthesizer::with_step`].
///
/// # Errors
/// When the response is one of other places, has no directions where they are needed, or the path leads through a source; the errors of `take`.
pub fn walk<E: From<SoundError>>(
    response: &Response,
    settings: SoundSettings,
    (s, path, spacing): (usize, &Path, f64),
    listener: Listener<'_>,
    signal: &[f32],
    step: Step<'_>,
    mut take: impl FnMut(usize, Vec<Vec<f32>>) -> Result<(), E>,
) -> Result<(), E> {
    let (found, expected) = (response.receivers(), path.pieces(spacing) + 1);
    if found != expected {
        return Err(SoundError::Places { found, expected }.into());
    }
    let spots: Vec<Spot<'_>> = match listener {
        Listener::Point => vec![Spot::Point],
        Listener::Array(array) => {
            microphones::check(response, array)?;
            array.iter().map(Spot::Microphone).collect()
        }
        Listener::Ambisonics(..) if response.directions.is_none() => {
            return Err(SoundError::NoDirections.into());
        }
        Listener::Ambisonics(order, up) => vec![Spot::Ambisonics(order, Frame::of_scene(up))],
    };
    let places = (0..found).map(|r| Pulses::of_arrivals(response, (s, r))).collect::<Result<Vec<_>, _>>()?;
    let synthesizer = Synthesizer::new(response, settings).with_step(step);
    let samples = if signal.is_empty() { 0 } else { signal.len() + synthesizer.samples - 1 };
    // What is heard at a time was sent within the response and the ringing of the filters before it.
    let (ringing, before) = (synthesizer.padding, synthesizer.samples + 2 * synthesizer.padding);
    let length = (4 * before).next_multiple_of(BLOCK).max(SECTION);
    let mut walked = Walk { response, s, path, places, signal, first: 0, section: 0..0, synthesizer };
    for begin in (0..samples.max(1)).step_by(length) {
        walked.section = begin..samples.min(begin + length);
        walked.first = begin.saturating_sub(before).min(signal.len());
        walked.signal = &signal[walked.first..signal.len().min(walked.section.end + ringing)];
        let mut sums = walked.early(&spots)?;
        let mut first = 0;
        for spot in &spots {
            walked.add_late(spot, &mut sums[first..first + spot.channels()])?;
            first += spot.channels();
        }
        take(samples, sums.iter().map(|sum| sum.iter().map(|sample| *sample as f32).collect()).collect())?;
    }
    Ok(())
}

struct Walk<'a> {
    response: &'a Response,
    s: usize,
    path: &'a Path,
    /// Arrivals and late energies at every place.
    places: Vec<Pulses>,
    /// What is heard of the signal in the section, and the number of its first sample.
    signal: &'a [f32],
    first: usize,
    /// Samples that are heard.
    section: Range<usize>,
    synthesizer: Synthesizer<'a>,
}

impl Walk<'_> {
    fn rate(&self) -> f64 {
        f64::from(self.synthesizer.settings.sample_rate_hz)
    }

    /// Position and number of pieces of the path behind the listener at a sample.
    fn at(&self, sample: usize) -> (DVec3, f64) {
        let (position, length) = self.path.at(self.path.begin() + sample as f64 / self.rate());
        (position, self.pieces(length))
    }

    /// A length of the path in pieces between places.
    fn pieces(&self, length: f64) -> f64 {
        let pieces = (self.places.len() - 1) as f64;
        if pieces > 0.0 { (length / self.path.length() * pieces).clamp(0.0, pieces) } else { 0.0 }
    }

    /// The signal in every band, with the padding of the synthesizer about it.
    fn bands(&self) -> Vec<Vec<f32>> {
        let padding = self.synthesizer.padding;
        let length = (self.signal.len() + 2 * padding).next_power_of_two();
        let transform = Transform::new(length);
        let crossover =
            Crossover::new(&self.response.center_frequency_hz, self.rate() / length as f64, length / 2 + 1);
        let mut padded = transform.silence();
        padded[padding..].iter_mut().zip(self.signal).for_each(|(to, from)| *to = f64::from(*from));
        let spectrum = transform.spectrum(padded);
        let of_band = |band: usize| {
            let signal = transform.signal(through(&spectrum, crossover.gains(band)));
            signal[..self.signal.len() + 2 * padding].iter().map(|sample| *sample as f32).collect()
        };
        (0..self.response.bands()).map(of_band).collect()
    }

    /// Listed arrivals in all channels of all spots.
    fn early(&self, spots: &[Spot<'_>]) -> Result<Vec<Vec<f64>>, SoundError> {
        let channels = spots.iter().map(Spot::channels).sum();
        let mut sums = vec![vec![0.0; self.section.len()]; channels];
        let bands = LazyLock::new(|| self.bands());
        let blocks: Vec<usize> = self.section.clone().step_by(BLOCK).collect();
        let stands = |begin: &usize| self.at(begin + BLOCK).1 <= self.at(*begin).1;
        for stretch in blocks.chunk_by(|before, after| stands(before) && stands(after)) {
            let begin = stretch[0];
            let parts = if stretch.len() * BLOCK > self.synthesizer.samples {
                let end = self.section.end.min(begin + stretch.len() * BLOCK);
                vec![(begin, self.standing(begin..end, spots)?)]
            } else {
                let block = |begin: &usize| Ok((*begin, self.block(*begin, spots, &bands)?));
                stretch.par_iter().map(block).collect::<Result<_, SoundError>>()?
            };
            for (begin, channels) in parts {
                add(&mut sums, begin - self.section.start, channels);
            }
        }
        Ok(sums)
    }

    /// Listed arrivals in all channels of all spots while the listener stands: the signal convolved with their response there.
    fn standing(&self, samples: Range<usize>, spots: &[Spot<'_>]) -> Result<Vec<Vec<f64>>, SoundError> {
        let (position, at) = self.at(samples.start);
        let (padding, rate) = (self.synthesizer.padding, self.rate());
        let mut all = Vec::new();
        for spot in spots {
            let mut responses = vec![vec![0.0; self.synthesizer.samples + 2 * padding]; spot.channels()];
            for index in at.floor() as usize..=at.ceil() as usize {
                let place = DVec3::from(self.response.receiver_positions[index]);
                let weight = 1.0 - (at - index as f64).abs();
                let pulses = microphones::displaced(
                    &self.places[index],
                    &Microphone::omni(position + spot.offset() - place),
                    self.response.speed_of_sound,
                )
                .map_err(|_| SoundError::ThroughSource { time_s: samples.start as f64 / rate })?;
                let gains: Vec<Vec<f64>> = pulses.direction.iter().map(|u| spot.gains(*u)).collect();
                for (channel, response) in responses.iter_mut().enumerate() {
                    let spectrum = self.synthesizer.spectrum(&pulses, |pulse| gains[pulse][channel])?;
                    let part = self.synthesizer.transform.signal(spectrum);
                    response.iter_mut().zip(part).for_each(|(sum, sample)| *sum += weight * sample);
                }
            }
            let narrow = |response: Vec<f64>| response.into_iter().map(|sample| sample as f32).collect();
            let heard = |response| self.convolved(&samples, padding, narrow(response));
            all.extend(responses.into_iter().map(heard));
        }
        Ok(all)
    }

    /// Samples of the signal convolved with a response that begins `lead` samples before the emission.
    fn convolved(&self, samples: &Range<usize>, lead: usize, response: Vec<f32>) -> Vec<f64> {
        let (begin, end) = (samples.start + lead, samples.end + lead);
        let first = begin.saturating_sub(response.len().saturating_sub(1));
        let place = |sample: usize| sample.saturating_sub(self.first).min(self.signal.len());
        let heard = convolve(&self.signal[place(first)..place(end)], &response);
        heard.into_iter().skip(begin - first).map(f64::from).collect()
    }

    /// The samples of a block in all channels.
    fn block(
        &self,
        begin: usize,
        spots: &[Spot<'_>],
        bands: &[Vec<f32>],
    ) -> Result<Vec<Vec<f64>>, SoundError> {
        self.synthesizer.go_on()?;
        // One more, where the next block begins.
        let places: Vec<(DVec3, f64)> = (begin..=begin + BLOCK).map(|sample| self.at(sample)).collect();
        let range = |of: fn(f64, f64) -> f64| places.iter().map(|place| place.1).reduce(of).unwrap_or(0.0);
        let (first, last) = (range(f64::min).floor() as usize, range(f64::max).ceil() as usize);
        let mut all = Vec::new();
        let mut way = [(0.0, 0.0); BLOCK + 1];
        let mut mixed = Vec::new();
        for spot in spots {
            let mut channels = vec![vec![0.0; BLOCK]; spot.channels()];
            for index in first..=last {
                let (place, pulses) =
                    (DVec3::from(self.response.receiver_positions[index]), &self.places[index]);
                let arrivals =
                    pulses.time.iter().zip(&pulses.direction).zip(pulses.shapes.chunks_exact(bands.len()));
                for ((time, direction), amplitude) in arrivals {
                    let length = self.response.speed_of_sound * time;
                    let image = place + length * *direction;
                    let towards = |at: usize| image - places[at].0 - spot.offset();
                    for (at, way) in way.iter_mut().enumerate() {
                        let own = towards(at).length();
                        if own < CLOSEST {
                            return Err(SoundError::ThroughSource {
                                time_s: (begin + at) as f64 / self.rate(),
                            });
                        }
                        let weight = (1.0 - (places[at].1 - index as f64).abs()).max(0.0);
                        let delay = own / self.response.speed_of_sound * self.rate();
                        let sent = (begin + at + self.synthesizer.padding) as f64 - self.first as f64;
                        *way = (sent - delay, weight * length / own);
                    }
                    let (read, gain) = (|way: &(f64, f64)| way.0, |way: &(f64, f64)| way.1);
                    if way.iter().map(gain).all(|gain| gain <= 0.0) {
                        continue;
                    }
                    let low = way.iter().map(read).fold(f64::INFINITY, f64::min).floor() as i64 - HALF as i64;
                    let high = way.iter().map(read).fold(f64::NEG_INFINITY, f64::max).floor() as i64
                        + HALF as i64
                        + 1;
                    if !mix(&mut mixed, (low, high), bands, amplitude) {
                        continue;
                    }
                    let gains = [0, BLOCK].map(|at| spot.gains(towards(at).normalize()));
                    for at in 0..BLOCK {
                        let heard = way[at].1 * self.synthesizer.table.read(&mixed, way[at].0 - low as f64);
                        let share = at as f64 / BLOCK as f64;
                        for (channel, (begin, end)) in channels.iter_mut().zip(gains[0].iter().zip(&gains[1]))
                        {
                            channel[at] += (begin + share * (end - begin)) * heard;
                        }
                    }
                }
            }
            all.extend(channels);
        }
        Ok(all)
    }

    /// Adds late sound to the channels of a spot.
    fn add_late(&self, spot: &Spot<'_>, sums: &mut [Vec<f64>]) -> Result<(), SoundError> {
        let length = self.path.length();
        let steps = self.path.pieces(STEP);
        let step = length / steps.max(1) as f64;
        let equalizer = (steps > 0).then(|| self.equalizer(step));
        let numbers = if steps > 0 { -1..steps as i64 + 2 } else { 0..1 };
        let parts: Vec<(usize, Vec<Vec<f64>>)> = numbers
            .into_par_iter()
            .map(|number| {
                self.synthesizer.go_on()?;
                let along = number as f64 * step;
                let (low, high) = (along - REACH * step, along + REACH * step);
                let (begin, end) = self.heard(low, high);
                if begin >= end {
                    return Ok((0, vec![Vec::new(); sums.len()]));
                }
                let weight = |sample: usize| {
                    let (_, found) = self.path.at(self.path.begin() + sample as f64 / self.rate());
                    let off = (found - along) / (REACH * step);
                    if steps == 0 { 1.0 } else { window(off) }
                };
                let weights: Vec<f64> = (begin..end).map(weight).collect();
                let responses = self.late_responses(spot, along, equalizer.as_deref())?;
                let of_channel = |response: Vec<f32>| {
                    let heard = self.convolved(&(begin..end), 0, response);
                    weights.iter().zip(heard).map(|(weight, sample)| weight * sample).collect()
                };
                Ok((begin - self.section.start, responses.into_iter().map(of_channel).collect()))
            })
            .collect::<Result<_, SoundError>>()?;
        for (begin, channels) in parts {
            add(sums, begin, channels);
        }
        Ok(())
    }

    /// Samples of the section at which the listener is between two lengths of the path.
    fn heard(&self, low: f64, high: f64) -> (usize, usize) {
        let (begin, end) = self.path.times(low, high);
        let sample = |time: f64| ((time - self.path.begin()) * self.rate()).max(0.0);
        let within = |sample: usize| sample.clamp(self.section.start, self.section.end);
        (within(sample(begin) as usize), within((sample(end).ceil() as usize).saturating_add(1)))
    }

    /// Late responses of all channels of a spot after a length of the path; empty ones where there is no late sound.
    fn late_responses(
        &self,
        spot: &Spot<'_>,
        along: f64,
        equalizer: Option<&[f64]>,
    ) -> Result<Vec<Vec<f32>>, SoundError> {
        let place = self.pieces(along);
        let before = place.floor() as usize;
        let after = (before + 1).min(self.places.len() - 1);
        let share = place - before as f64;
        let late = [(1.0 - share, &self.places[before].late[..]), (share, &self.places[after].late[..])];
        let mut pulses = Pulses::default();
        pulses.add_waves(
            self.response,
            self.s,
            (self.path.place(along), &late),
            self.synthesizer.waves(self.s),
        );
        if pulses.time.is_empty() {
            return Ok(vec![Vec::new(); spot.channels()]);
        }
        if let Spot::Microphone(microphone) = spot {
            pulses = microphones::displaced(&pulses, microphone, self.response.speed_of_sound)?;
        }
        let gains: Vec<Vec<f64>> = match spot {
            // Those of a microphone are in its pulses.
            Spot::Point | Spot::Microphone(_) => vec![vec![1.0]; pulses.time.len()],
            Spot::Ambisonics(..) => pulses.direction.iter().map(|u| spot.gains(*u)).collect(),
        };
        let of_channel = |channel: usize| {
            let mut spectrum = self.synthesizer.spectrum(&pulses, |pulse| gains[pulse][channel])?;
            if let Some(equalizer) = equalizer {
                spectrum = through(&spectrum, equalizer);
            }
            Ok(self.synthesizer.pressure(spectrum))
        };
        (0..spot.channels()).map(of_channel).collect()
    }

    /// Gains of windows that overlap, for steps of this length, at the frequencies of the transform.
    fn equalizer(&self, step: f64) -> Vec<f64> {
        let products = products();
        let count = self.synthesizer.transform.frequencies();
        let per_line = TAU * self.rate() / (2.0 * (count - 1) as f64) / self.response.speed_of_sound * step;
        let gain = |line: usize| {
            let phase = per_line * line as f64;
            let diffuse = |steps: usize| {
                let angle = phase * steps as f64;
                if angle < 1e-6 { 1.0 } else { libm::sin(angle) / angle }
            };
            let energy: f64 =
                products.iter().enumerate().map(|(steps, product)| product * diffuse(steps)).sum();
            1.0 / energy.sqrt()
        };
        (0..count).map(gain).collect()
    }
}

/// Adds channels to `sums` from a sample on, as far as these go.
fn add(sums: &mut [Vec<f64>], begin: usize, channels: Vec<Vec<f64>>) {
    for (sum, channel) in sums.iter_mut().zip(channels) {
        sum[begin..].iter_mut().zip(channel).for_each(|(sum, sample)| *sum += sample);
    }
}

/// Weight of a response whose place is `off` half widths away: four of them add up to 1.
fn window(off: f64) -> f64 {
    if off.abs() < 1.0 { 0.25 * (1.0 + libm::cos(PI * off)) } else { 0.0 }
}

/// Sums of products of the weights of responses so many steps apart, in the mean over the path; beyond 0, twice.
fn products() -> [f64; 4] {
    const PLACES: usize = 64;
    let mut sums = [0.0; 4];
    for place in 0..PLACES {
        let weight = |number: i32| window((f64::from(number) - place as f64 / PLACES as f64) / REACH);
        for first in -2..4 {
            for (steps, sum) in sums.iter_mut().enumerate() {
                let twice = if steps == 0 { 1.0 } else { 2.0 };
                *sum += twice * weight(first) * weight(first + steps as i32) / PLACES as f64;
            }
        }
    }
    sums
}

/// The samples `low` up to `high` of the sum of bands with these amplitudes, silence beyond their ends; whether there are any.
fn mix(mixed: &mut Vec<f64>, (low, high): (i64, i64), bands: &[Vec<f32>], amplitude: &[f64]) -> bool {
    let length = bands.first().map_or(0, Vec::len) as i64;
    mixed.clear();
    mixed.resize((high - low).max(0) as usize, 0.0);
    let (begin, end) = (low.clamp(0, length), high.clamp(0, length));
    if begin >= end {
        return false;
    }
    let target = &mut mixed[(begin - low) as usize..(end - low) as usize];
    for (band, amplitude) in bands.iter().zip(amplitude) {
        let samples = &band[begin as usize..end as usize];
        target.iter_mut().zip(samples).for_each(|(sum, sample)| *sum += amplitude * f64::from(*sample));
    }
    true
}
