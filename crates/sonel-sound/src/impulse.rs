//! Impulse responses: pulses shaped by band filters.
//!
//! p = Σ_b W_b ∗ Σ_k a_kb δ(t − t_k): the pulses of [`crate::pulses`] with their amplitudes in band b, filtered by the gain W_b of
//! [`crate::crossover`], summed over the bands. Pulses come before filters, so that a band holds nothing of another's changes in time.
//!
//! A pulse of amplitude 1 has the spectrum 1 at any sample rate, so that a recording keeps its level in a convolution at that rate, and
//! |P|² does not depend on the rate. To convert a response to another rate like a recording changes it by the ratio of the rates: 9.5 dB from 48 to
//! 16 kHz. So it is made at the rate that is wanted; bands above half of it are left out.

use std::borrow::Cow;
use std::ops::ControlFlow;
use std::sync::OnceLock;

use glam::DVec3;
use rayon::prelude::*;
use realfft::num_complex::Complex;
use sonel_echogram::Response;

use crate::ambisonics::Frame;
use crate::crossover::Crossover;
use crate::fractional::Table;
use crate::plane_waves::{PlaneWave, dispersion, waves};
use crate::pulses::{self, Pulses};
use crate::spots::{Channels, Spot};
use crate::transform::{Spectrum, Transform, fast, through};
use crate::{SoundError, fractional, head, microphones};

/// How impulse responses are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoundSettings {
    /// Volume of a closed room, from which the echo density follows [m³]; none in the open.
    pub volume: Option<f64>,
    /// Unit vector up in the axes of the scene, for ambisonics and ears.
    pub up: DVec3,
    /// Another seed gives other signs, times and directions of the waves.
    pub seed: u64,
    /// Samples per second, one of [`crate::SAMPLE_RATES_HZ`].
    pub sample_rate_hz: u32,
    /// How long after direct sound arrivals and waves are kept [s]: 0 leaves direct sound alone. By default all are.
    pub within: Option<f64>,
}

/// How far a listener may be beyond the receivers [m].
const MARGIN: f64 = 1.0;

/// Makes impulse responses of one response.
pub struct Synthesizer<'a> {
    pub(crate) response: &'a Response,
    pub(crate) settings: SoundSettings,
    /// Samples of an impulse response.
    pub(crate) samples: usize,
    /// Silence about the response in which the filters of bands ring behind those of a head [samples]: 0.17 s.
    pub(crate) padding: usize,
    crossover: Crossover,
    /// What spreads waves, at every frequency.
    dispersion: Spectrum,
    /// Waves that reach the receivers, drawn when they are first needed.
    waves: OnceLock<Vec<PlaneWave>>,
    pub(crate) table: Table,
    pub(crate) transform: Transform,
    step: Step<'a>,
}

/// Says between small steps of the work whether to go on.
pub type Step<'a> = &'a (dyn Fn() -> ControlFlow<()> + Sync);

impl<'a> Synthesizer<'a> {
    /// For all sources and receivers of a `response`.
    #[must_use]
    pub fn new(response: &'a Response, settings: SoundSettings) -> Self {
        let rate = f64::from(settings.sample_rate_hz);
        let end = response.time_edges_s.last().copied().unwrap_or(0.0);
        let samples = libm::round(end.max(0.0) * rate) as usize + 1;
        let padding = 2 * head::longest(settings.sample_rate_hz);
        let length = fast(samples + 2 * padding);
        let (step_hz, count) = (rate / length as f64, length / 2 + 1);
        let crossover = Crossover::new(&response.center_frequency_hz, step_hz, count);
        let dispersion = dispersion(step_hz, count);
        let transform = Transform::new(length);
        let table = Table::new();
        let step = &|| ControlFlow::Continue(());
        Self {
            response,
            settings,
            samples,
            padding,
            crossover,
            dispersion,
            waves: OnceLock::new(),
            table,
            transform,
            step,
        }
    }

    /// Calls `step` many times a second; its break ends the work with [`SoundError::Stopped`].
    #[must_use]
    pub fn with_step(self, step: Step<'a>) -> Self {
        Self { step, ..self }
    }

    pub(crate) fn go_on(&self) -> Result<(), SoundError> {
        if (self.step)().is_break() { Err(SoundError::Stopped) } else { Ok(()) }
    }

    /// Pressure of source `s` at receiver `r` relative to a free field at 1 m, from the emission to the end of the echogram.
    ///
    /// # Errors
    /// When listed arrivals are not part of the echogram.
    pub fn impulse_response(&self, s: usize, r: usize) -> Result<Vec<f32>, SoundError> {
        Ok(self.heard((s, r), Channels::Single)?.swap_remove(0))
    }

    /// The same in all channels. Channel 0 of ambisonics is the impulse response itself. At ears every pulse goes through the responses of its
    /// direction, between the measured ones around it.
    ///
    /// # Errors
    /// The errors of [`Self::impulse_response`], those of [`microphones::check`], and when a microphone is where a source is, or there are no
    /// directions that are needed.
    pub fn heard(&self, (s, r): (usize, usize), channels: Channels<'_>) -> Result<Vec<Vec<f32>>, SoundError> {
        let spots = Spot::all(self.response, channels)?;
        let frame = channels.frame(self.response, r as f64, self.settings.up);
        let pulses = self.pulses((s, r))?;
        let at_spot = |spot: &Spot<'_>| {
            let own = match spot {
                Spot::Microphone(own) => microphones::displaced(&pulses, own, self.response.speed_of_sound)?,
                _ => Cow::Borrowed(&pulses),
            };
            self.spectra(spot, &own, &frame, |spectrum| self.pressure(spectrum))
        };
        let all = spots.par_iter().map(at_spot).collect::<Result<Vec<_>, SoundError>>()?;
        Ok(all.into_iter().flatten().collect())
    }

    /// What `take` makes of the spectrum of every channel of a spot at which these pulses arrive.
    pub(crate) fn spectra<T>(
        &self,
        spot: &Spot<'_>,
        pulses: &Pulses,
        frame: &Frame,
        take: impl Fn(Spectrum) -> T,
    ) -> Result<Vec<T>, SoundError> {
        match spot {
            Spot::Microphone(microphone) => {
                let gain = |pulse: usize| microphone.gain(pulses.direction[pulse]);
                Ok(vec![take(self.in_bands(pulses, |alike| self.train(pulses, alike, gain))?)])
            }
            Spot::Ambisonics(order) => {
                let gains: Vec<_> = pulses.direction.iter().map(|u| frame.gains(*order, *u)).collect();
                let spectrum = |channel: usize| {
                    self.in_bands(pulses, |alike| self.train(pulses, alike, |pulse| gains[pulse][channel]))
                };
                (0..spot.channels()).map(|channel| spectrum(channel).map(&take)).collect()
            }
            Spot::Ear(ears, ear) => {
                let weights = pulses.direction.par_iter().map(|u| ears.head.weights(frame.local(*u)));
                let weights: Vec<_> = weights.collect();
                let spectrum = self.in_bands(pulses, |alike| {
                    let of =
                        |&pulse: &usize| (self.place(pulses, pulse), pulses.gain[pulse], &weights[pulse]);
                    ears.sum(*ear, alike.iter().map(of).collect())
                });
                Ok(vec![take(spectrum?)])
            }
        }
    }

    fn pulses(&self, (s, r): (usize, usize)) -> Result<Pulses, SoundError> {
        let mut pulses = Pulses::of_arrivals(self.response, (s, r))?;
        let late = std::mem::take(&mut pulses.late);
        let place = DVec3::from(self.response.receiver_positions[r]);
        pulses.add_waves(self.response, s, (place, &[(1.0, &late)]), self.waves());
        if let Some(within) = self.settings.within {
            // Sums in another order differ by rounding.
            let end = (self.response.direct_time(s, r) + within) * (1.0 + pulses::ROUNDING);
            let late = pulses.gain.iter_mut().zip(&pulses.time).filter(|(_, time)| **time > end);
            late.for_each(|(gain, _)| *gain = 0.0);
        }
        Ok(pulses)
    }

    /// The waves that reach the receivers and places between them from all sources.
    pub(crate) fn waves(&self) -> &[PlaneWave] {
        let draw = || {
            let SoundSettings { seed, volume, .. } = self.settings;
            let response = self.response;
            let to_receivers = |source: &[f64; 3]| {
                let source = DVec3::from(*source);
                let all = response.receiver_positions.iter();
                all.map(move |place| source.distance(DVec3::from(*place))).fold(0.0, f64::max)
            };
            let distance = response.source_positions.iter().map(to_receivers).fold(0.0, f64::max);
            let margin = (distance + MARGIN) / response.speed_of_sound;
            let ends = [response.time_edges_s.first(), response.time_edges_s.last()];
            let [first, last] = ends.map(|end| end.copied().unwrap_or(0.0));
            waves(first - margin..last + margin, seed, volume, response.speed_of_sound).collect()
        };
        self.waves.get_or_init(draw)
    }

    /// Samples from the emission to the end of the echogram of a spectrum.
    pub(crate) fn pressure(&self, spectrum: Spectrum) -> Vec<f32> {
        let pressure = self.transform.signal(spectrum);
        pressure[self.padding..self.padding + self.samples].iter().map(|value| *value as f32).collect()
    }

    /// Time of a pulse [samples].
    fn place(&self, pulses: &Pulses, pulse: usize) -> f64 {
        pulses.time[pulse] * f64::from(self.settings.sample_rate_hz)
    }

    /// The sum of pulses of one shape with their gains, and the number of its first sample.
    fn train(&self, pulses: &Pulses, alike: &[usize], gain: impl Fn(usize) -> f64) -> (isize, Vec<f64>) {
        let gain = |pulse: usize| gain(pulse) * pulses.gain[pulse];
        // A listed arrival has a shape of its own. Those of late sound are too many to be exact.
        if alike[0] < pulses.listed {
            let (first, values) = fractional::pulse(self.place(pulses, alike[0]));
            return (first, values.map(|value| gain(alike[0]) * value).to_vec());
        }
        let first =
            |pulse: &usize| self.place(pulses, *pulse).floor() as isize + 1 - fractional::HALF as isize;
        let begin = alike.iter().map(first).min().unwrap_or(0);
        let mut sum: Vec<f32> = Vec::new();
        for pulse in alike {
            let first = (first(pulse) - begin) as usize;
            sum.resize(sum.len().max(first + 2 * fractional::HALF), 0.0);
            let (gain, values) = (gain(*pulse) as f32, self.table.nearest(self.place(pulses, *pulse)));
            sum[first..].iter_mut().zip(values).for_each(|(sum, value)| *sum += gain * value);
        }
        (begin, sum.into_iter().map(f64::from).collect())
    }

    /// Spectrum of the sum of all pulses in their bands; `sum_of` gives the sum of some of one shape and the number of its first sample.
    fn in_bands(
        &self,
        pulses: &Pulses,
        sum_of: impl Fn(&[usize]) -> (isize, Vec<f64>),
    ) -> Result<Spectrum, SoundError> {
        let audible: Vec<usize> = (0..pulses.time.len()).filter(|&pulse| pulses.gain[pulse] != 0.0).collect();
        let kind = |pulse: &usize| (pulses.shape[*pulse], pulses.is_spread[*pulse]);
        let alike = audible.chunk_by(|a, b| kind(a) == kind(b));
        let (spread, others): (Vec<&[usize]>, Vec<&[usize]>) =
            alike.partition(|alike| pulses.is_spread[alike[0]]);
        let mut sum = vec![Complex::ZERO; self.transform.frequencies()];
        self.add_bands(&mut sum, pulses, &spread, &sum_of)?;
        sum.iter_mut().zip(&self.dispersion).for_each(|(value, gain)| *value *= gain);
        self.add_bands(&mut sum, pulses, &others, &sum_of)?;
        Ok(sum)
    }

    /// Adds the spectrum of pulses, by shape, to a sum.
    fn add_bands(
        &self,
        spectrum: &mut Spectrum,
        pulses: &Pulses,
        by_shape: &[&[usize]],
        sum_of: impl Fn(&[usize]) -> (isize, Vec<f64>),
    ) -> Result<(), SoundError> {
        if by_shape.is_empty() {
            return Ok(());
        }
        let bands = self.response.bands();
        let mut trains = vec![self.transform.silence(); bands];
        for alike in by_shape {
            self.go_on()?;
            let (begin, sum) = sum_of(alike);
            let shape = &pulses.shapes[pulses.shape[alike[0]] as usize * bands..][..bands];
            let first = self.padding.saturating_add_signed(begin);
            for (train, amplitude) in trains.iter_mut().zip(shape) {
                train[first..].iter_mut().zip(&sum).for_each(|(all, value)| *all += amplitude * value);
            }
        }
        for (band, train) in trains.into_iter().enumerate() {
            self.go_on()?;
            let part = through(&self.transform.spectrum(train), self.crossover.gains(band));
            spectrum.iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ambisonics::Axes;
    use crate::{Head, SAMPLE_RATE_HZ};
    use realfft::RealFftPlanner;
    use sonel_echogram::{Arrivals, Directions, Lateral};
    use std::f64::consts::PI;

    const ROOM: SoundSettings = SoundSettings {
        volume: Some(100.0),
        up: DVec3::Z,
        seed: 1,
        sample_rate_hz: SAMPLE_RATE_HZ,
        within: None,
    };
    const CENTERS: [f64; 3] = [500.0, 1000.0, 2000.0];
    /// On sample 590.
    const DIRECT_TIME: f64 = 590.0 / 48_000.0;

    /// 4.216 m from a source, with these energies of the direct sound and others in the bin behind it.
    fn response(direct: [f64; 3], behind: [f64; 3]) -> Response {
        let bins = 200;
        let mut energy = vec![0.0; 3 * bins];
        for band in 0..3 {
            energy[band * bins + 12] = direct[band];
            energy[band * bins + 13] = behind[band];
        }
        Response {
            center_frequency_hz: CENTERS.to_vec(),
            time_edges_s: (0..=bins).map(|edge| edge as f64 * 0.001).collect(),
            receiver_names: vec!["seat".to_owned()],
            receiver_positions: vec![[343.0 * DIRECT_TIME, 0.0, 0.0]],
            receiver_directivities: Vec::new(),
            source_names: vec!["stage".to_owned()],
            source_positions: vec![[0.0; 3]],
            source_power_level_db: vec![90.0; 3],
            speed_of_sound: 343.0,
            characteristic_impedance: 412.0,
            direct_times_s: Vec::new(),
            energy,
            batches: None,
            missing: None,
            arrivals: Arrivals {
                source: vec![0],
                receiver: vec![0],
                time_s: vec![DIRECT_TIME],
                energy: direct.to_vec(),
                direction: vec![-1.0, 0.0, 0.0],
                order: vec![0],
                kind: vec![0],
            },
            directions: None,
            provenance: Default::default(),
        }
    }

    /// Mean of |P|² over an octave.
    fn band_energy(pressure: &[f32], center: f64) -> f64 {
        band_energy_at(SAMPLE_RATE_HZ, pressure, center)
    }

    /// The same of pressure at another rate.
    fn band_energy_at(rate: u32, pressure: &[f32], center: f64) -> f64 {
        let mut samples: Vec<f64> = pressure.iter().map(|sample| f64::from(*sample)).collect();
        samples.resize(1 << 17, 0.0);
        let plan = RealFftPlanner::new().plan_fft_forward(samples.len());
        let (mut spectrum, step) = (plan.make_output_vec(), f64::from(rate) / samples.len() as f64);
        plan.process(&mut samples, &mut spectrum).unwrap();
        let inside = |index: usize| (0.5_f64.sqrt()..2_f64.sqrt()).contains(&(index as f64 * step / center));
        let squares: Vec<f64> = spectrum
            .iter()
            .enumerate()
            .filter(|(index, _)| inside(*index))
            .map(|(_, value)| value.norm_sqr())
            .collect();
        squares.iter().sum::<f64>() / squares.len() as f64
    }

    #[test]
    fn direct_sound_is_one_pulse_of_one_over_the_distance() {
        let distance = 343.0 * DIRECT_TIME;
        let response = response([1.0 / (4.0 * PI * distance * distance); 3], [0.0; 3]);
        let pressure = Synthesizer::new(&response, ROOM).impulse_response(0, 0).unwrap();
        assert_eq!(pressure.len(), 9601);
        for (sample, value) in pressure.iter().enumerate() {
            let expected = if sample == 590 { 1.0 / distance } else { 0.0 };
            assert!(
                (f64::from(*value) - expected).abs() < 1e-7,
                "sample {sample}: {value} instead of {expected}"
            );
        }
        let within = SoundSettings { within: Some(0.0), ..ROOM };
        let late = self::response([1.0 / (4.0 * PI * distance * distance); 3], [1.0; 3]);
        assert_eq!(Synthesizer::new(&late, within).impulse_response(0, 0).unwrap(), pressure);
        let within = SoundSettings { within: Some(0.001), ..ROOM };
        assert_ne!(Synthesizer::new(&late, within).impulse_response(0, 0).unwrap(), pressure);
    }

    #[test]
    fn an_arrival_has_its_energies_in_every_band() {
        let energies = [0.010, 0.004, 0.001];
        let response = response(energies, [0.0; 3]);
        let pressure = Synthesizer::new(&response, ROOM).impulse_response(0, 0).unwrap();
        for (center, energy) in CENTERS.into_iter().zip(energies) {
            let off = 10.0 * libm::log10(band_energy(&pressure, center) / (4.0 * PI * energy));
            assert!(off.abs() < 0.1, "{center} Hz: {off} dB");
        }
    }

    #[test]
    fn small_arrivals_beside_large_ones_in_one_bin_are_found_in_whatever_order_they_were_added() {
        let mut draw = sonel_testkit::uniform::Uniform::new(54);
        for _ in 0..50 {
            let mut response = response([0.0; 3], [0.0; 3]);
            let count = 2 + draw.below(20);
            // Sixteen decades: direct sound, and what edges send around furniture.
            let energy: Vec<f64> = (0..3 * count).map(|_| 10_f64.powf(draw.between(-16.0, 0.0))).collect();
            for band in 0..3 {
                // The renderer adds in another order than the list has.
                response.energy[band * 200 + 12] = energy[band..].iter().step_by(3).rev().sum();
            }
            response.arrivals = Arrivals {
                source: vec![0; count],
                receiver: vec![0; count],
                time_s: vec![DIRECT_TIME; count],
                energy,
                direction: [-1.0, 0.0, 0.0].repeat(count),
                order: vec![1; count],
                kind: vec![1; count],
            };
            let pulses = Synthesizer::new(&response, ROOM).pulses((0, 0)).unwrap();
            assert_eq!(pulses.time.len(), count, "rounding is no sound");
            // An arrival that the bin has not is still an error.
            let before = response.energy[12];
            response.energy[12] = before * 0.999_999;
            assert!(Synthesizer::new(&response, ROOM).pulses((0, 0)).is_err());
        }
    }

    /// Late sound has the same waves at every rate: to 0.05 dB of what 48 kHz has; conversion as of a recording changes it by 9.5 dB.
    #[test]
    fn every_rate_has_the_energies_of_its_bands() {
        let response = response([0.010, 0.004, 0.001], [0.02, 0.03, 0.04]);
        let at = |sample_rate_hz| {
            Synthesizer::new(&response, SoundSettings { sample_rate_hz, ..ROOM })
                .impulse_response(0, 0)
                .unwrap()
        };
        let off = |rate: u32, pressure: &[f32], center: f64| {
            let expected = band_energy(&at(SAMPLE_RATE_HZ), center);
            10.0 * libm::log10(band_energy_at(rate, pressure, center) / expected)
        };
        for rate in [8000, 16_000, 44_100, 96_000, 192_000] {
            let pressure = at(rate);
            assert_eq!(pressure.len(), rate as usize / 5 + 1);
            for center in CENTERS {
                let off = off(rate, &pressure, center);
                assert!(off.abs() < 0.05, "{rate} Hz, octave {center} Hz: {off} dB");
            }
        }
        let converted = crate::resample(&at(SAMPLE_RATE_HZ), SAMPLE_RATE_HZ, 16_000).unwrap();
        assert!((off(16_000, &converted, 1000.0) + 9.54).abs() < 0.1);
    }

    #[test]
    fn another_seed_is_another_realisation_and_the_same_seed_the_same() {
        let response = response([0.001; 3], [0.002; 3]);
        let realise = |seed| {
            Synthesizer::new(&response, SoundSettings { seed, volume: None, ..ROOM })
                .impulse_response(0, 0)
                .unwrap()
        };
        assert_eq!(realise(1), realise(1));
        assert_ne!(realise(1), realise(2));
    }

    /// With directions: the source ahead, along −x, and a bin behind whose sound comes from the left above, along (0, −0.6, 0.8), for 0.7 of it.
    fn directed(direct: [f64; 3], behind: [f64; 3]) -> Response {
        let response = response(direct, behind);
        let mut moment = vec![0.0; 3 * response.energy.len()];
        for band in 0..3 {
            moment[3 * (band * 200 + 12)] = -direct[band];
            moment[3 * (band * 200 + 13) + 1] = -0.42 * behind[band];
            moment[3 * (band * 200 + 13) + 2] = 0.56 * behind[band];
        }
        let lateral = [0, 1].map(|_| Lateral { energy: response.energy.clone(), ..Lateral::default() });
        let directions = Directions { lateral_axes: vec![[0.0, -1.0, 0.0]], lateral, moment };
        Response { directions: Some(directions), ..response }
    }

    const FIRST_ORDER: Channels<'_> = Channels::Ambisonics(1, Axes::Aim);

    #[test]
    fn the_first_channel_is_the_impulse_response_and_direct_sound_is_ahead() {
        let response = directed([0.001; 3], [0.0; 3]);
        let synthesizer = Synthesizer::new(&response, ROOM);
        let channels = synthesizer.heard((0, 0), Channels::Ambisonics(3, Axes::Aim)).unwrap();
        assert!(channels.len() == 16 && channels[0] == synthesizer.impulse_response(0, 0).unwrap());
        // Straight ahead: W, X, −R/2, U √¾, −L √⅜, P √⅝.
        let ahead = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, -0.5, 0.0, 0.75_f64.sqrt(), 0.0, 0.0, 0.0, 0.0];
        let ahead = ahead.into_iter().chain([-0.375_f64.sqrt(), 0.0, 0.625_f64.sqrt()]);
        for (channel, expected) in channels.iter().zip(ahead) {
            let found = f64::from(channel[590]) / f64::from(channels[0][590]);
            assert!((found - expected).abs() < 1e-6, "{found} instead of {expected}");
        }
    }

    /// The active intensity, mean products of W with X, Y and Z, is the moment of the bin: over 100 realisations of 48 pulses whose directions
    /// scatter by less than 1, within four standard errors, 4/√4800; from the other side it is not.
    #[test]
    fn the_intensity_of_late_sound_is_its_moment() {
        let response = directed([0.001; 3], [0.002; 3]);
        let mut sums = [0.0; 4];
        for seed in 0..100 {
            let channels = Synthesizer::new(&response, SoundSettings { seed, volume: None, ..ROOM })
                .heard((0, 0), FIRST_ORDER)
                .unwrap();
            for (sum, channel) in sums.iter_mut().zip(&channels) {
                let window = 624..672;
                let products = window.map(|at| f64::from(channels[0][at]) * f64::from(channel[at]));
                *sum += products.sum::<f64>();
            }
        }
        for (channel, expected) in [(1, 0.42), (2, 0.56), (3, 0.0)] {
            let found = sums[channel] / sums[0];
            assert!((found - expected).abs() < 0.058, "{channel}: {found} instead of {expected}");
            assert!(expected < 0.1 || (found + expected).abs() > 0.058);
        }
    }

    /// The source is on the left of a listener who looks along +y, so that the left ear is 16 samples early and thrice as loud as the right one,
    /// which the head delays by as much.
    #[test]
    fn direct_sound_from_the_left_reaches_the_left_ear_first() {
        let mut response = directed([0.001; 3], [0.0; 3]);
        let head = Head::read(include_bytes!("../tests/cardioid-head.sofa"), SAMPLE_RATE_HZ).unwrap();
        let peaks = |response: &Response| {
            let ears = Synthesizer::new(response, ROOM).heard((0, 0), Channels::Ears(&head)).unwrap();
            let mono = Synthesizer::new(response, ROOM).impulse_response(0, 0).unwrap()[590];
            let peak = |ear: &Vec<f32>| (0..ear.len()).max_by(|a, b| ear[*a].abs().total_cmp(&ear[*b].abs()));
            assert_eq!((ears.len(), ears[0].len()), (2, 9601));
            [0, 1].map(|ear| {
                let at = peak(&ears[ear]).unwrap();
                (at, f64::from(ears[ear][at] / mono))
            })
        };
        let expect = |found: [(usize, f64); 2], expected: [(usize, f64); 2]| {
            for (found, expected) in found.into_iter().zip(expected) {
                assert!(
                    found.0 == expected.0 && (found.1 - expected.1).abs() < 1e-5,
                    "{found:?}, not {expected:?}"
                );
            }
        };
        expect(peaks(&response), [(590 + 32, 1.0), (590 + 32, 1.0)]);
        response.directions.as_mut().unwrap().lateral_axes = vec![[-1.0, 0.0, 0.0]];
        expect(peaks(&response), [(590 + 16, 1.5), (590 + 48, 0.5)]);
    }

    #[test]
    fn ambisonics_need_directions() {
        let response = response([0.001; 3], [0.0; 3]);
        let error = Synthesizer::new(&response, ROOM).heard((0, 0), FIRST_ORDER).unwrap_err();
        assert!(error.to_string().contains("`directions`"), "{error}");
    }

    #[test]
    fn arrivals_that_are_not_in_the_echogram_are_refused() {
        let mut response = response([0.001; 3], [0.002; 3]);
        response.arrivals.energy[1] = 0.01;
        let error = Synthesizer::new(&response, ROOM).impulse_response(0, 0).unwrap_err().to_string();
        assert!(error.contains("\"seat\"") && error.contains("0.012292"), "{error}");
    }
}
