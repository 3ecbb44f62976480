//! Plane waves that all sources and receivers share: the field of what arrives late.
//!
//! Wave k passes the source anywhere in the k-th 1/48 000 s, with a random sign, from a random direction u_k, and reaches a receiver
//! at t_k − u_k·x/c, x being the receiver less the source. The pressures at two receivers, a distance d apart, then have the coherence
//! sin(kd)/kd of a diffuse field [Cook1955], near and far, and a receiver that moves meets no border.
//!
//! Of the waves as many are left as reflections are expected at t_k in a room of volume V, 4πc³t²/V per second [Kuttruff2009, section 4.1], at
//! least 4000 per second. This depends on the wave alone, so that receivers share what is left.
//!
//! Where more are expected than there are, a wave stands for several and is spread by all-pass filters over a millisecond, the same way for all.
//!
//! All sources have the same waves, displaced by their position: for sources side by side, too, late sound has the coherence of a diffuse field, as
//! reciprocity demands.
//!
//! References: [Cook1955], [Kuttruff2009], [SchroederLogan1961] (docs/references.md).

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use glam::DVec3;
use realfft::num_complex::Complex;
use sonel_sampling::warp::uniform_sphere;
use sonel_sampling::{Purpose, StreamFamily};

/// Most waves per second.
pub const DENSEST: f64 = 48_000.0;
/// Fewest per second: four in a time bin of 1 ms, which is rarely without one.
pub const SPARSEST: f64 = 4000.0;

/// A wave without amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneWave {
    /// Time at the source [s].
    pub time: f64,
    /// Unit vector to where it comes from.
    pub towards: DVec3,
    /// 1 or −1.
    pub sign: f64,
    /// Waves expected per second at its time.
    pub density: f64,
    /// Whether it stands for several.
    pub is_spread: bool,
}

/// The waves that pass a source in a time [s], and some a little earlier and later, in a room of so many m³; without a volume all are left.
pub fn waves(
    time: Range<f64>,
    seed: u64,
    volume: Option<f64>,
    speed_of_sound: f64,
) -> impl Iterator<Item = PlaneWave> {
    // Waves per second over the square of the time in seconds [1/s³].
    let growth = volume.map(|volume| 4.0 * PI * libm::pow(speed_of_sound, 3.0) / volume);
    let family = StreamFamily::new(seed, Purpose::Pulse, [0; 4]);
    let [first, last] = [time.start, time.end].map(|time| libm::floor(time * DENSEST) as i64);
    (first..=last).filter_map(move |number| {
        let mut stream = family.stream(number.cast_unsigned());
        let time = (number as f64 + stream.uniform_fine()) / DENSEST;
        let expected = growth.map(|growth| growth * time * time);
        let density = expected.map_or(DENSEST, |expected| expected.clamp(SPARSEST, DENSEST));
        let is_left = stream.uniform_fine() * DENSEST < density;
        is_left.then(|| PlaneWave {
            time,
            towards: uniform_sphere(stream.uniform_pair()).as_dvec3().normalize(),
            sign: if stream.bits() & 1 == 0 { 1.0 } else { -1.0 },
            density,
            is_spread: expected.is_some_and(|expected| expected > DENSEST),
        })
    })
}

/// Delays of the all-pass filters that spread a wave [s].
const DELAYS: [f64; 3] = [0.07e-3, 0.30e-3, 0.57e-3];
/// Their feedback.
const FEEDBACK: f64 = 0.63;

/// Gains, all of the modulus 1, that spread a pulse by 0.7 ms about its time, at `count` frequencies `step_hz` apart from 0 Hz on: all-pass filters
/// in series [SchroederLogan1961], Π (1 − g e^(iωτ)) / (1 − g e^(−iωτ)), earlier than causal ones by Σ τ. The excess kurtosis of a train of pulses becomes
/// a twentieth at 48 kHz, a tenth at 16 kHz.
pub(crate) fn dispersion(step_hz: f64, count: usize) -> Vec<Complex<f64>> {
    let steps = DELAYS.map(|delay| {
        let (sin, cos) = libm::sincos(-TAU * step_hz * delay);
        Complex::new(cos, sin)
    });
    let mut turns = [Complex::<f64>::ONE; DELAYS.len()];
    let gain = |_| {
        let all: Complex<f64> = turns.iter().map(|turn| 1.0 - turn * FEEDBACK).product();
        turns.iter_mut().zip(steps).for_each(|(turn, step)| *turn *= step);
        all.conj() / all
    };
    (0..count).map(gain).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transform::Transform;

    /// Within four standard deviations of a sum of Bernoulli variables, at most the root of the number.
    #[test]
    fn waves_are_those_of_the_room_between_the_fewest_and_the_most() {
        for (time, volume, expected) in [
            (0.001, Some(200.0), 4000.0),
            (0.5, Some(200.0), 48_000.0),
            (0.001, None, 48_000.0),
            // 4πc³t²/V about 63.25 ms in 200 m³.
            (0.058_25, Some(200.0), 10_143.0),
            (-0.3, Some(200.0), 48_000.0),
        ] {
            let found = waves(time..time + 0.01, 1, volume, 343.0).count() as f64;
            let expected: f64 = 0.01 * expected;
            assert!(
                (found - expected).abs() < 4.0 * expected.sqrt() + 1.0,
                "{time}: {found}, not {expected}"
            );
        }
    }

    #[test]
    fn a_wave_is_the_same_in_whatever_interval_it_is_found() {
        let of = |seed, time| waves(time, seed, Some(200.0), 343.0).collect::<Vec<PlaneWave>>();
        let (early, late) = (of(1, -0.01..0.05), of(1, 0.0..0.1));
        let common = |wave: &&PlaneWave| (0.0001..0.0499).contains(&wave.time);
        assert_eq!(
            early.iter().filter(common).collect::<Vec<_>>(),
            late.iter().filter(common).collect::<Vec<_>>()
        );
        assert_ne!(late, of(2, 0.0..0.1));
    }

    /// A pulse keeps its spectrum and its time, to 0.01 ms, and has a twentieth of the excess kurtosis; one that is delayed alone has all of it.
    #[test]
    fn a_spread_pulse_keeps_spectrum_and_time() {
        let (count, rate) = (1 << 14, 48_000.0);
        let transform = Transform::new(count);
        let moments = |gains: Vec<Complex<f64>>| {
            assert!(gains.iter().all(|gain| (gain.norm() - 1.0).abs() < 1e-9));
            let signal = transform.signal(gains);
            let sum = |of: &dyn Fn(f64, f64) -> f64| {
                let time = |at: usize| (at as f64 - if 2 * at < count { 0.0 } else { count as f64 }) / rate;
                signal.iter().enumerate().map(|(at, value)| of(time(at), *value)).sum::<f64>()
            };
            let energy = sum(&|_, value| value.powi(2));
            assert!((energy - 1.0).abs() < 1e-3, "{energy}");
            (sum(&|time, value| time * value.powi(2)), sum(&|_, value| value.powi(4)))
        };
        let (step, lines) = (rate / count as f64, count / 2 + 1);
        let (time, fourth) = moments(dispersion(step, lines));
        assert!(time.abs() < 1e-5 && fourth < 0.05, "{time} s, {fourth}");
        let turn = |line: usize| Complex::from_polar(1.0, -TAU * line as f64 * step * 0.001);
        let (time, fourth) = moments((0..lines).map(turn).collect());
        assert!((time - 0.001).abs() < 1e-5 && fourth > 0.9, "{time} s, {fourth}");
    }
}
