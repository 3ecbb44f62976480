//! Interaural cross-correlation of a binaural impulse response, per octave.
//!
//! IACF(τ) = ∫ p_l(t) p_r(t + τ) dt / √(∫ p_l² dt ∫ p_r² dt), and IACC is the largest |IACF| for |τ| ≤ 1 ms [ISO3382-1, annex B]. Early is the
//! first 80 ms, late what follows, counted from the first sample at either ear within 20 dB of the largest one.
//!
//! The response is cut into its windows before it is filtered, so that no filter carries energy over a border. IACC depends on the squared gain
//! of the filter alone: that of [`octave_filter`](mod@crate::octave_filter).
//!
//! References: [ISO3382-1] annex B (docs/references.md).

use realfft::num_complex::Complex;

use crate::octave_filter::{SILENCE, squared_gain};
use crate::transform::{Spectrum, Transform};
use crate::wav::onset;
use crate::{Recording, SoundError};

/// Octaves, nominal centres [Hz].
const OCTAVES: [f64; 6] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0];
/// Octaves of the means [Hz].
const MEAN_OCTAVES: [f64; 3] = [500.0, 1000.0, 2000.0];
/// Longest delay between the ears [s].
const LONGEST_DELAY: f64 = 1e-3;
/// Border between early and late, from the onset [s].
const EARLY: f64 = 0.080;
/// What rounding leaves of a window's energy in a band without any.
const ROUNDING: f64 = 1e-12;

/// IACC of one octave, 0 … 1; none where an ear gets nothing in the window.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BandIacc {
    /// Nominal centre [Hz].
    pub center_frequency_hz: f64,
    /// Coefficient of the first 80 ms.
    pub early: Option<f64>,
    /// Coefficient of what follows.
    pub late: Option<f64>,
    /// Coefficient of both.
    pub all: Option<f64>,
}

/// IACC of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Iacc {
    /// From the first sample [s].
    pub onset: f64,
    /// Octaves from 125 to 4000 Hz, those that the sample rate holds.
    pub bands: Vec<BandIacc>,
}

impl Iacc {
    /// Means of early, late and all over 500, 1000 and 2000 Hz; none where one of them is missing.
    #[must_use]
    pub fn means(&self) -> [Option<f64>; 3] {
        let reads: [fn(&BandIacc) -> Option<f64>; 3] = [|band| band.early, |band| band.late, |band| band.all];
        reads.map(|read| {
            let own = |octave: &f64| {
                self.bands.iter().find(|band| band.center_frequency_hz.total_cmp(octave).is_eq())
            };
            let values: Option<Vec<f64>> =
                MEAN_OCTAVES.iter().map(|octave| own(octave).and_then(read)).collect();
            Some(values?.iter().sum::<f64>() / MEAN_OCTAVES.len() as f64)
        })
    }
}

/// IACC of a binaural impulse response: left and right channel.
///
/// # Errors
/// When there are not two channels, or both are silent.
pub fn iacc(recording: &Recording) -> Result<Iacc, SoundError> {
    let [left, right] = &recording.channels[..] else {
        return Err(SoundError::NotBinaural { channels: recording.channels.len() });
    };
    let rate = f64::from(recording.sample_rate_hz);
    let onset = onset(&recording.channels).ok_or(SoundError::Silent)?;
    let border = (onset + (EARLY * rate).round() as usize).min(left.len());
    let length = (left.len() + (SILENCE * rate) as usize).next_power_of_two();
    let transform = Transform::new(length);
    let windows = [onset..border, border..left.len(), onset..left.len()];
    let spectra = windows.map(|window| [left, right].map(|ear| transform.padded(&ear[window.clone()])));
    let lags = (LONGEST_DELAY * rate).round() as usize;
    let octaves = OCTAVES.into_iter().filter(|octave| octave * std::f64::consts::SQRT_2 <= 0.5 * rate);
    let bands = octaves
        .map(|octave| {
            let gain = |line: usize| squared_gain(line as f64 * rate / length as f64, octave);
            let gains: Vec<f64> = (0..transform.frequencies()).map(gain).collect();
            let [early, late, all] = spectra.each_ref().map(|ears| largest(&transform, ears, &gains, lags));
            BandIacc { center_frequency_hz: octave, early, late, all }
        })
        .collect();
    Ok(Iacc { onset: onset as f64 / rate, bands })
}

/// The largest |IACF| at up to so many `lags` of two ears through a filter of these squared gains; none where the energy of an ear is rounding.
fn largest(transform: &Transform, [left, right]: &[Spectrum; 2], gains: &[f64], lags: usize) -> Option<f64> {
    let in_octave = [left, right]
        .map(|ear| ear.iter().zip(gains).map(|(value, gain)| value.norm_sqr() * gain).sum::<f64>());
    let in_all = [left, right].map(|ear| ear.iter().map(Complex::norm_sqr).sum::<f64>());
    if in_octave.iter().zip(in_all).any(|(octave, all)| *octave <= ROUNDING * all) {
        return None;
    }
    let product = left.iter().zip(right).zip(gains);
    let product = product.map(|((left, right), gain)| left.conj() * right * gain).collect();
    let correlation = transform.signal(product);
    let near = correlation[..=lags].iter().chain(&correlation[correlation.len() - lags..]);
    let largest = near.fold(0.0_f64, |largest, value| largest.max(value.abs()));
    // One side of the spectrum has half of the energy, of which the ends have no double.
    let energy = 2.0 * (in_octave[0] * in_octave[1]).sqrt() / correlation.len() as f64;
    Some((largest / energy).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_sampling::{Purpose, Stream, StreamFamily};

    const RATE: u32 = 48_000;

    fn noise(stream: &mut Stream, count: usize) -> Vec<f32> {
        (0..count).map(|_| (stream.uniform_fine() - stream.uniform_fine()) as f32).collect()
    }

    fn stream() -> Stream {
        StreamFamily::new(3, Purpose::Pulse, [0; 4]).stream(0)
    }

    fn of(left: Vec<f32>, right: Vec<f32>) -> Iacc {
        iacc(&Recording { sample_rate_hz: RATE, channels: vec![left, right] }).unwrap()
    }

    #[test]
    fn equal_ears_have_one_with_any_delay_up_to_a_millisecond_and_less_with_a_longer_one() {
        let left = noise(&mut stream(), 24_000);
        for delay in [0, 20, 48] {
            let mut right = vec![0.0; delay];
            right.extend(&left[..left.len() - delay]);
            for band in of(left.clone(), right.iter().map(|sample| -0.3 * sample).collect()).bands {
                assert!(band.all.is_some_and(|all| all > 0.995), "{delay}: {band:?}");
            }
        }
        let mut right = vec![0.0; 96];
        right.extend(&left[..left.len() - 96]);
        assert!(of(left, right).bands[3].all.is_some_and(|all| all < 0.6));
    }

    /// p_r = a p_l + √(1 − a²) n: the correlation is a within its spread 1/√(2BT), B = 707 Hz and T = 1 s at 1 kHz: four times 0.027.
    #[test]
    fn a_mixture_has_its_share_early_and_late() {
        let (mut stream, border) = (stream(), (EARLY * f64::from(RATE)) as usize);
        let left = noise(&mut stream, 48_000 + border);
        let other = noise(&mut stream, left.len());
        let mixed = |(at, (left, other)): (usize, (&f32, &f32))| {
            if at < border { *left } else { 0.6 * left + 0.8 * other }
        };
        let right = left.iter().zip(&other).enumerate().map(mixed).collect();
        let found = of(left, right);
        assert!(found.onset < 0.001);
        let band = found.bands[3];
        assert!(band.early.is_some_and(|early| early > 0.995), "{band:?}");
        assert!(band.late.is_some_and(|late| (late - 0.6).abs() < 0.11), "{band:?}");
        let [early, late, all] = found.means();
        assert!(early > all && all > late, "{early:?} {late:?} {all:?}");
    }

    #[test]
    fn without_late_sound_or_at_a_deaf_ear_there_is_no_value() {
        let mut pulse = vec![0.0; 9600];
        pulse[480] = 1.0;
        let found = of(pulse.clone(), pulse.clone());
        assert!((found.onset - 0.01).abs() < 1e-12);
        assert!(
            found
                .bands
                .iter()
                .all(|band| band.late.is_none() && band.early.is_some_and(|early| early > 1.0 - 1e-9))
        );
        assert_eq!(found.means()[1], None);
        assert!(of(pulse.clone(), vec![0.0; 9600]).bands.iter().all(|band| band.all.is_none()));
        let short = of(pulse[..600].to_vec(), pulse[..600].to_vec());
        assert!(short.bands.iter().all(|band| band.late.is_none()));
        let of_channels =
            |channels| iacc(&Recording { sample_rate_hz: RATE, channels }).unwrap_err().to_string();
        assert!(of_channels(vec![pulse]).contains("two ears"));
        assert!(of_channels(vec![vec![0.0; 9]; 2]).contains("silent"));
    }

    #[test]
    fn a_low_sample_rate_holds_fewer_octaves() {
        let left = noise(&mut stream(), 8000);
        let low = iacc(&Recording { sample_rate_hz: 8000, channels: vec![left.clone(), left] }).unwrap();
        assert_eq!(low.bands.len(), 5);
    }
}
