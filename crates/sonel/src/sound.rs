//! Impulse responses: pressure synthesised from the energies of a response.

use std::ops::RangeInclusive;

use glam::DVec3;
use rayon::prelude::*;
use sonel_sound::{Path, SoundSettings, Synthesizer};

use crate::{Error, Observer, ReceiverPoint, Response, Result};

pub use sonel_sound::ambisonics::{Axes, MOST_ORDER as MOST_AMBISONICS_ORDER};
pub use sonel_sound::wav::MOST_CHANNELS;
pub use sonel_sound::{
    Channels, Head, Iacc, Microphone, Recording, SAMPLE_RATE_HZ, SAMPLE_RATES_HZ, SoundError, Waypoint,
    convolve, iacc, resample, write_part,
};

/// How impulse responses are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoundOptions {
    /// Seed of the waves of late sound; by default that of the rendering.
    pub seed: Option<u64>,
    /// Samples per second, 8000 … 192 000.
    pub sample_rate_hz: u32,
    /// How long after direct sound arrivals and waves are kept [s]: 0 leaves direct sound alone. By default all are.
    pub within: Option<f64>,
}

impl Default for SoundOptions {
    fn default() -> Self {
        Self { seed: None, sample_rate_hz: SAMPLE_RATE_HZ, within: None }
    }
}

/// The microphone of a point relative to a receiver [m], in the axes of the scene.
#[must_use]
pub fn microphone(ReceiverPoint { name, position, sensitivity }: ReceiverPoint) -> Microphone {
    Microphone { name, position, pattern: sensitivity.pattern, aim: sensitivity.aim }
}

/// Distances between the places along a path [m].
pub const SPACINGS: RangeInclusive<f64> = 0.01..=10.0;

/// The places along a path at which [`Response::walk`] needs a response, at most `spacing` apart [m], named by the length of the path up to them.
#[must_use]
pub fn places(path: &Path, spacing: f64) -> Vec<ReceiverPoint> {
    let places = path.places(spacing);
    let step = path.length() / (places.len() - 1).max(1) as f64;
    let place = |(index, place)| ReceiverPoint::omni(&format!("{:.3} m", index as f64 * step), place);
    places.into_iter().enumerate().map(place).collect()
}

/// Samples that [`convolve_in_sections`] makes at a time, at least.
const SECTION: usize = 1 << 20;

/// `signal` convolved with `responses` of one length: `take` gets the length of each result [samples] and, one after the other, sections of all of
/// them, so that long recordings take no more memory.
///
/// # Errors
/// Those of `take`.
pub fn convolve_in_sections<E>(
    signal: &[f32],
    responses: &[Vec<f32>],
    mut take: impl FnMut(usize, Vec<Vec<f32>>) -> Result<(), E>,
) -> Result<(), E> {
    let memory = responses.first().map_or(0, Vec::len).saturating_sub(1);
    let (samples, length) = (signal.len() + memory, SECTION.max(4 * memory));
    for begin in (0..samples).step_by(length) {
        let [from, to] = [begin.saturating_sub(memory), begin + length].map(|place| place.min(signal.len()));
        let of = |response: &Vec<f32>| -> Vec<f32> {
            convolve(&signal[from..to], response).into_iter().skip(begin - from).take(length).collect()
        };
        take(samples, responses.par_iter().map(of).collect())?;
    }
    Ok(())
}

impl Response {
    /// What a listener hears of a `signal` that source `s` sends from the first time of the path on: `take` gets the length of the channels [samples]
    /// and, one after the other, sections of all of them. Delays of direct sound and listed reflections are exact at every sample, late sound fades between
    /// responses 2 cm apart. The response is that of the [`places`] of the path, along whose aims a head looks.
    ///
    /// # Errors
    /// When the response is one of other places, the sample rate is out of range, or the path leads through a source. The
    /// errors of [`Self::impulse_responses`] and of `take`.
    pub fn walk(
        &self,
        route: (usize, &Path, f64),
        channels: Channels<'_>,
        signal: &[f32],
        options: SoundOptions,
        observer: &dyn Observer,
        take: impl FnMut(usize, Vec<Vec<f32>>) -> Result<()>,
    ) -> Result<()> {
        let settings = self.settings(&[channels], options)?;
        let step = || observer.go_on();
        sonel_sound::walk(self.echograms(), settings, route, channels, signal, &step, take)
    }

    fn settings(&self, channels: &[Channels<'_>], options: SoundOptions) -> Result<SoundSettings> {
        let room = self.surroundings();
        let SoundOptions { seed, sample_rate_hz, within } = options;
        if !SAMPLE_RATES_HZ.contains(&sample_rate_hz) {
            return Err(Error::refused(format!(
                "the sample rate is {sample_rate_hz} Hz: give 8000 … 192000 Hz"
            )));
        }
        let have_axes = channels.iter().any(|channels| channels.have_axes());
        let up = if have_axes { room.upward()? } else { DVec3::Z };
        let (volume, seed) = (room.volume, seed.unwrap_or(room.seed));
        Ok(SoundSettings { volume, up, seed, sample_rate_hz, within })
    }

    /// Impulse responses of all sources at all receivers, [S × R, channels, samples]: pressure synthesised from the energies. Direct
    /// sound is 1/r, sample 0 is the emission.
    ///
    /// # Errors
    /// When the sample rate is out of range. When a microphone cannot be where it is. Where channels need directions: when the response has none. [`Error::Stopped`].
    pub fn impulse_responses(
        &self,
        channels: Channels<'_>,
        options: SoundOptions,
        observer: &dyn Observer,
    ) -> Result<Vec<Vec<Vec<f32>>>> {
        self.each_pair(&[channels], options, observer, |_, mut all| Ok(all.swap_remove(0)))
    }

    /// What `take` makes of the impulse responses of every pair (source, receiver), which are in the order of `channels`.
    ///
    /// # Errors
    /// The errors of [`Self::impulse_responses`] and of `take`.
    pub fn each_pair<T: Send, E: From<Error> + Send>(
        &self,
        channels: &[Channels<'_>],
        options: SoundOptions,
        observer: &dyn Observer,
        take: impl Fn((usize, usize), Vec<Vec<Vec<f32>>>) -> Result<T, E> + Sync,
    ) -> Result<Vec<T>, E> {
        let settings = self.settings(channels, options)?;
        let e = self.echograms();
        let pairs: Vec<(usize, usize)> =
            (0..e.sources()).flat_map(|s| (0..e.receivers()).map(move |r| (s, r))).collect();
        let step = || observer.go_on();
        let synthesizer = Synthesizer::new(e, settings).with_step(&step);
        let of_pair = |pair: (usize, usize)| {
            let all = channels.iter().map(|channels| synthesizer.heard(pair, *channels));
            take(pair, all.collect::<Result<_, _>>().map_err(Error::from)?)
        };
        pairs.into_par_iter().map(of_pair).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_those_of_the_whole() {
        let of = |count: usize, factor: usize| -> Vec<f32> {
            (0..count).map(|at| (at * factor % 1013) as f32 / 500.0 - 1.0).collect()
        };
        let (signal, responses) = (of(2 * SECTION + 77, 7919), [of(900, 31), of(900, 37)]);
        let mut joined = vec![Vec::new(); 2];
        convolve_in_sections(&signal, &responses, |samples, section| {
            assert_eq!(samples, signal.len() + 899);
            joined.iter_mut().zip(section).for_each(|(all, more)| all.extend(more));
            Ok::<(), ()>(())
        })
        .unwrap();
        for (joined, response) in joined.iter().zip(&responses) {
            let whole = convolve(&signal, response);
            assert_eq!(joined.len(), whole.len());
            let largest = whole.iter().fold(0.0_f32, |most, sample| most.max(sample.abs()));
            assert!(joined.iter().zip(&whole).all(|(a, b)| (a - b).abs() < 1e-5 * largest));
        }
    }
}
