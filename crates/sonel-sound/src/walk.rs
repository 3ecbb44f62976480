//! What a listener hears of a recording while moving: convolution with a response that changes.
//!
//! At the time τ a listener at x(τ) gets from the (image) source at X what left it at τ − |X − x(τ)|/c. Listed arrivals of the rendered places are such image
//! sources, with 1/r and delay exact at every sample, so that Doppler shift is there without being made. Neighbouring places list the same image
//! sources: their sum with weights that fall linearly to the next place is that of one, and what only one of them lists fades in.
//!
//! Within a block of 256 samples the gains of channels go linearly from those of the directions where it begins to those where it ends. An ear has the
//! responses of both directions, faded, without their delays, which also go linearly from one to the other: a fade of delayed ones would be a comb
//! filter. A head looks along the aims of the places, between two of them along the mean.
//!
//! Late sound is convolved with responses at steps of 2 cm, whose plane waves are those of all receivers ([`crate::plane_waves`]) and whose energies
//! lie between those of the places. Each is heard for four steps through a Hann window over the path. Steps that are short beside the wave add up
//! coherently, long ones in energy: at wave number k the sum is divided by the root of Σ_ij w_i w_j sin(kd_ij)/kd_ij, its expected energy in a diffuse field
//! [Cook1955]. Above 4 kHz late sound fluctuates more slowly than the listener moves.
//!
//! References: [Cook1955] (docs/references.md).

use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::OnceLock;

use glam::DVec3;
use rayon::prelude::*;
use sonel_echogram::Response;

use crate::ambisonics::Frame;
use crate::crossover::Crossover;
use crate::fractional::HALF;
use crate::impulse::{SoundSettings, Step, Synthesizer};
use crate::microphones::{self, CLOSEST, Microphone};
use crate::path::Path;
use crate::pulses::Pulses;
use crate::spots::{Channels, Spot};
use crate::transform::{Transform, fast, through};
use crate::{SoundError, convolve};

/// Longest step between responses of late sound [m].
const STEP: f64 = 0.02;
/// Half the width of a window [steps].
const REACH: f64 = 2.0;
/// Means over the path of products of the weights of responses 0 … 3 steps apart, beyond 0 twice: (4 − m) (1 + ½ cos πm/2)/16 + 3/16π sin πm/2.
const PRODUCTS: [f64; 4] = [0.375, 0.375 + 0.375 / PI, 0.125, 0.125 - 0.375 / PI];
/// Samples between which filters are faded.
const BLOCK: usize = 256;
/// Samples that are made at a time, at least, so that long recordings take no more memory; a multiple of a block.
const SECTION: usize = 1 << 18;

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
    channels: Channels<'_>,
    signal: &[f32],
    step: Step<'_>,
    mut take: impl FnMut(usize, Vec<Vec<f32>>) -> Result<(), E>,
) -> Result<(), E> {
    let (found, expected) = (response.receivers(), path.pieces(spacing) + 1);
    if found != expected {
        return Err(SoundError::Places { found, expected }.into());
    }
    let spots = Spot::all(response, channels)?;
    let places = (0..found).map(|r| Pulses::of_arrivals(response, (s, r))).collect::<Result<Vec<_>, _>>()?;
    let synthesizer = Synthesizer::new(response, settings).with_step(step);
    let samples = if signal.is_empty() { 0 } else { signal.len() + synthesizer.samples - 1 };
    // What is heard at a time was sent within the response and the ringing of the filters before it.
    let (ringing, before) = (synthesizer.padding, synthesizer.samples + 2 * synthesizer.padding);
    let length = (4 * before).next_multiple_of(BLOCK).max(SECTION);
    let mut walked = Walk {
        response,
        s,
        path,
        channels,
        places,
        signal,
        first: 0,
        bands: OnceLock::new(),
        section: 0..0,
        synthesizer,
    };
    for begin in (0..samples.max(1)).step_by(length) {
        walked.section = begin..samples.min(begin + length);
        walked.first = begin.saturating_sub(before).min(signal.len());
        walked.signal = &signal[walked.first..signal.len().min(walked.section.end + ringing)];
        walked.bands = OnceLock::new();
        let mut sums = Vec::new();
        for spot in &spots {
            let mut own = walked.early(spot)?;
            walked.add_late(spot, &mut own)?;
            sums.extend(own);
        }
        take(samples, sums.iter().map(|sum| sum.iter().map(|sample| *sample as f32).collect()).collect())?;
    }
    Ok(())
}

struct Walk<'a> {
    response: &'a Response,
    s: usize,
    path: &'a Path,
    channels: Channels<'a>,
    /// Arrivals and late energies at every place.
    places: Vec<Pulses>,
    /// What is heard of the signal in the section, and the number of its first sample.
    signal: &'a [f32],
    first: usize,
    /// The signal in every band, made when it is first read.
    bands: OnceLock<Vec<Vec<f32>>>,
    /// Samples that are heard.
    section: Range<usize>,
    synthesizer: Synthesizer<'a>,
}

impl Walk<'_> {
    fn rate(&self) -> f64 {
        f64::from(self.synthesizer.settings.sample_rate_hz)
    }

    /// Position and number of pieces of the path behind the listener at a sample.
    fn at(&self, sample: isize) -> (DVec3, f64) {
        let (position, length) = self.path.at(self.path.begin() + sample as f64 / self.rate());
        (position, self.pieces(length))
    }

    /// Axes of the channels so many pieces along the path.
    fn frame(&self, pieces: f64) -> Frame {
        self.channels.frame(self.response, pieces, self.synthesizer.settings.up)
    }

    /// A length of the path in pieces between places.
    fn pieces(&self, length: f64) -> f64 {
        let pieces = (self.places.len() - 1) as f64;
        if pieces > 0.0 { (length / self.path.length() * pieces).clamp(0.0, pieces) } else { 0.0 }
    }

    /// The signal in every band, with the padding of the synthesizer about it.
    fn in_bands(&self) -> Vec<Vec<f32>> {
        let padding = self.synthesizer.padding;
        let length = fast(self.signal.len() + 2 * padding);
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

    /// Listed arrivals in the channels of a spot.
    fn early(&self, spot: &Spot<'_>) -> Result<Vec<Vec<f64>>, SoundError> {
        let mut sums = vec![vec![0.0; self.section.len()]; spot.channels()];
        let blocks: Vec<usize> = self.section.clone().step_by(BLOCK).collect();
        let stands = |begin: &usize| self.at((begin + BLOCK) as isize).1 <= self.at(*begin as isize).1;
        for stretch in blocks.chunk_by(|before, after| stands(before) && stands(after)) {
            let begin = stretch[0];
            let parts = if stretch.len() * BLOCK > self.synthesizer.samples {
                let end = self.section.end.min(begin + stretch.len() * BLOCK);
                vec![(begin, self.standing(begin..end, spot)?)]
            } else {
                let block = |begin: &usize| Ok((*begin, self.block(*begin, spot)?));
                stretch.par_iter().map(block).collect::<Result<_, SoundError>>()?
            };
            for (begin, channels) in parts {
                add(&mut sums, begin - self.section.start, channels);
            }
        }
        Ok(sums)
    }

    /// Listed arrivals in the channels of a spot while the listener stands: the signal convolved with their response there.
    fn standing(&self, samples: Range<usize>, spot: &Spot<'_>) -> Result<Vec<Vec<f64>>, SoundError> {
        let (position, at) = self.at(samples.start as isize);
        let padding = self.synthesizer.padding;
        let mut responses = vec![vec![0.0; self.synthesizer.samples + 2 * padding]; spot.channels()];
        for index in at.floor() as usize..=at.ceil() as usize {
            let offset = position + spot.offset() - DVec3::from(self.response.receiver_positions[index]);
            let weight = 1.0 - (at - index as f64).abs();
            let there = Microphone { position: offset, ..Microphone::POINT };
            let pulses = microphones::displaced(&self.places[index], &there, self.response.speed_of_sound)
                .map_err(|_| SoundError::ThroughSource { time_s: samples.start as f64 / self.rate() })?;
            let signal = |spectrum| self.synthesizer.transform.signal(spectrum);
            let parts = self.synthesizer.spectra(spot, &pulses, &self.frame(at), signal)?;
            for (response, part) in responses.iter_mut().zip(parts) {
                response.iter_mut().zip(part).for_each(|(sum, sample)| *sum += weight * sample);
            }
        }
        let narrow = |response: Vec<f64>| response.into_iter().map(|sample| sample as f32).collect();
        Ok(responses
            .into_iter()
            .map(|response| self.convolved(&samples, padding, narrow(response)))
            .collect())
    }

    /// Samples of the signal convolved with a response that begins `lead` samples before the emission.
    fn convolved(&self, samples: &Range<usize>, lead: usize, response: Vec<f32>) -> Vec<f64> {
        let (begin, end) = (samples.start + lead, samples.end + lead);
        let first = begin.saturating_sub(response.len().saturating_sub(1));
        let place = |sample: usize| sample.saturating_sub(self.first).min(self.signal.len());
        let heard = convolve(&self.signal[place(first)..place(end)], &response);
        heard.into_iter().skip(begin - first).map(f64::from).collect()
    }

    /// The samples of a block in the channels of a spot: with the filters of directions where it begins and where it ends, faded.
    fn block(&self, begin: usize, spot: &Spot<'_>) -> Result<Vec<Vec<f64>>, SoundError> {
        self.synthesizer.go_on()?;
        let [before, behind] = spot.reach();
        // One more, where the next block begins.
        let places = (0..=before + BLOCK + behind).map(|at| self.at((begin + at) as isize - before as isize));
        let places: Vec<(DVec3, f64)> = places.collect();
        let ends = [places[before], places[before + BLOCK]];
        let frames = ends.map(|(_, along)| self.frame(along));
        let range = |of: fn(f64, f64) -> f64| places.iter().map(|place| place.1).reduce(of).unwrap_or(0.0);
        let (first, last) = (range(f64::min).floor() as usize, range(f64::max).ceil() as usize);
        let mut sums = vec![[0, 1].map(|_| vec![0.0_f32; BLOCK]); spot.channels()];
        let share = |at: usize| (at as f64 - before as f64) / BLOCK as f64;
        for index in first..=last {
            let pulses = &self.places[index];
            let shapes = pulses.shapes.chunks_exact(self.response.bands());
            for ((time, direction), amplitude) in pulses.time.iter().zip(&pulses.direction).zip(shapes) {
                let length = self.response.speed_of_sound * time;
                let image = DVec3::from(self.response.receiver_positions[index]) + length * *direction
                    - spot.offset();
                let filters = [0, 1].map(|end| spot.filters(&frames[end], (image - ends[end].0).normalize()));
                let [lag, later] = filters.each_ref().map(|channels| channels[0].delay);
                let mut reading = Vec::with_capacity(places.len());
                for (at, (position, along)) in places.iter().enumerate() {
                    let (sample, own) = (begin as f64 + at as f64 - before as f64, image.distance(*position));
                    if own < CLOSEST {
                        return Err(SoundError::ThroughSource { time_s: sample.max(0.0) / self.rate() });
                    }
                    let weight = (1.0 - (along - index as f64).abs()).max(0.0);
                    let lag = lag + share(at).clamp(-1.0, 2.0) * (later - lag);
                    let delay = own / self.response.speed_of_sound * self.rate() + lag;
                    reading.push((sample - delay, weight * length / own));
                }
                let Some(heard) = self.read(&reading, amplitude) else { continue };
                for (end, filters) in filters.iter().enumerate() {
                    for (sums, filter) in sums.iter_mut().zip(filters) {
                        for (place, tap) in (filter.first..).zip(&filter.taps) {
                            let heard = heard[before.saturating_add_signed(-place)..].iter();
                            let places = sums[end].iter_mut();
                            places.zip(heard).for_each(|(sum, sample)| *sum += *tap as f32 * sample);
                        }
                    }
                }
            }
        }
        let faded = |[begin, end]: [Vec<f32>; 2]| {
            let pairs = begin.into_iter().zip(end).enumerate();
            pairs
                .map(|(at, (begin, end))| f64::from(begin) + share(before + at) * f64::from(end - begin))
                .collect()
        };
        Ok(sums.into_iter().map(faded).collect())
    }

    /// The signal with these amplitudes in bands at times of it [samples], each with a gain; none where that is silence.
    fn read(&self, reading: &[(f64, f64)], amplitude: &[f64]) -> Option<Vec<f32>> {
        let bands = self.bands.get_or_init(|| self.in_bands());
        let offset = self.synthesizer.padding as f64 - self.first as f64;
        let times = || reading.iter().map(|(time, _)| time + offset);
        let low = times().fold(f64::INFINITY, f64::min).floor() as i64 - HALF as i64;
        let high = times().fold(f64::NEG_INFINITY, f64::max).floor() as i64 + HALF as i64 + 1;
        let [begin, end] = [low, high].map(|place| place.clamp(0, bands[0].len() as i64));
        if begin >= end || reading.iter().all(|(_, gain)| *gain <= 0.0) {
            return None;
        }
        let mut mixed = vec![0.0; (high - low) as usize];
        for (band, amplitude) in bands.iter().zip(amplitude) {
            let places = mixed[(begin - low) as usize..].iter_mut();
            let samples = &band[begin as usize..end as usize];
            places.zip(samples).for_each(|(sum, sample)| *sum += *amplitude as f32 * sample);
        }
        let heard = |(time, gain): (f64, &(f64, f64))| {
            gain.1 * self.synthesizer.table.read(&mixed, time - low as f64)
        };
        Some(times().zip(reading).map(|pair| heard(pair) as f32).collect())
    }

    /// Adds late sound to the channels of a spot.
    fn add_late(&self, spot: &Spot<'_>, sums: &mut [Vec<f64>]) -> Result<(), SoundError> {
        let length = self.path.length();
        let steps = self.path.pieces(STEP);
        let step = length / steps.max(1) as f64;
        let equalizer = (steps > 0).then(|| self.equalizer(step));
        let numbers = if steps > 0 { -1..steps as i64 + 2 } else { 0..1 };
        let at = |sample: usize| self.path.at(self.path.begin() + sample as f64 / self.rate()).1;
        let lengths: Vec<f64> = self.section.clone().map(at).collect();
        let parts: Vec<(usize, Vec<Vec<f64>>)> = numbers
            .into_par_iter()
            .map(|number| {
                self.synthesizer.go_on()?;
                let along = number as f64 * step;
                let begin = lengths.partition_point(|length| *length < along - REACH * step);
                let end = lengths.partition_point(|length| *length <= along + REACH * step);
                if begin >= end {
                    return Ok((0, vec![Vec::new(); sums.len()]));
                }
                let responses = self.late_responses(spot, along, equalizer.as_deref())?;
                let of_channel = |response: Vec<f32>| {
                    let samples = self.section.start + begin..self.section.start + end;
                    let heard = self.convolved(&samples, 0, response).into_iter().zip(&lengths[begin..]);
                    let weight =
                        |length| if steps == 0 { 1.0 } else { window((length - along) / (REACH * step)) };
                    heard.map(|(sample, length)| weight(*length) * sample).collect()
                };
                Ok((begin, responses.into_iter().map(of_channel).collect()))
            })
            .collect::<Result<_, SoundError>>()?;
        for (begin, channels) in parts {
            add(sums, begin, channels);
        }
        Ok(())
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
        pulses.add_waves(self.response, self.s, (self.path.place(along), &late), self.synthesizer.waves());
        if pulses.time.is_empty() {
            return Ok(vec![Vec::new(); spot.channels()]);
        }
        if let Spot::Microphone(microphone) = spot {
            pulses = microphones::displaced(&pulses, microphone, self.response.speed_of_sound)?.into_owned();
        }
        self.synthesizer.spectra(spot, &pulses, &self.frame(place), |spectrum| {
            let equalized = equalizer.map(|equalizer| through(&spectrum, equalizer));
            self.synthesizer.pressure(equalized.unwrap_or(spectrum))
        })
    }

    /// Gains of windows that overlap, for steps of this length, at the frequencies of the transform.
    fn equalizer(&self, step: f64) -> Vec<f64> {
        let count = self.synthesizer.transform.frequencies();
        let per_line = TAU * self.rate() / (2.0 * (count - 1) as f64) / self.response.speed_of_sound * step;
        let gain = |line: usize| {
            let phase = per_line * line as f64;
            let diffuse = |steps: usize| {
                let angle = phase * steps as f64;
                if angle < 1e-6 { 1.0 } else { libm::sin(angle) / angle }
            };
            let energy: f64 =
                PRODUCTS.iter().enumerate().map(|(steps, product)| product * diffuse(steps)).sum();
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
