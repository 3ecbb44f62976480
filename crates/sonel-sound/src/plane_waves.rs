//! Plane waves that all receivers of a source share: the field of what arrives late.
//!
//! Wave k passes the source anywhere in the k-th 1/48 000 s, with a random sign, from a random direction u_k, and reaches a receiver
//! at t_k − u_k·x/c, x being the receiver less the source. The pressures at two receivers, a distance d apart, then have the coherence
//! sin(kd)/kd of a diffuse field [Cook1955], near and far, and a receiver that moves meets no border.
//!
//! Of the waves as many are left as reflections are expected at t_k in a room of volume V, 4πc³t²/V per second [Kuttruff2009, section 4.1], at
//! least 4000 per second. This depends on the wave alone, so that receivers share what is left.
//!
//! References: [Cook1955], [Kuttruff2009] (docs/references.md).

use std::f64::consts::PI;

use glam::DVec3;
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
}

/// All waves of a source.
#[derive(Debug, Clone, Copy)]
pub struct PlaneWaves {
    family: StreamFamily,
    /// Waves per second over the square of the time in seconds [1/s³]; [`None`] where all are left.
    growth: Option<f64>,
}

impl PlaneWaves {
    /// Waves of source number `source` in a room of so many m³; without a volume all are left.
    #[must_use]
    pub fn new(seed: u64, source: usize, volume: Option<f64>, speed_of_sound: f64) -> Self {
        let growth = volume.map(|volume| 4.0 * PI * libm::pow(speed_of_sound, 3.0) / volume);
        Self { family: StreamFamily::new(seed, Purpose::Pulse, [source as u32, 0, 0, 0]), growth }
    }

    /// The waves that pass the source in the time from `begin` to `end`, and some a little earlier and later [s].
    pub fn between(self, begin: f64, end: f64) -> impl Iterator<Item = PlaneWave> {
        let number = |time: f64| libm::floor(time * DENSEST) as i64;
        (number(begin)..=number(end)).filter_map(move |number| self.wave(number))
    }

    /// Wave of a `number`, where it is left.
    fn wave(self, number: i64) -> Option<PlaneWave> {
        let mut stream = self.family.stream(number.cast_unsigned());
        let time = (number as f64 + stream.uniform_fine()) / DENSEST;
        let density = self.growth.map_or(DENSEST, |growth| (growth * time * time).clamp(SPARSEST, DENSEST));
        let is_left = stream.uniform_fine() * DENSEST < density;
        is_left.then(|| PlaneWave {
            time,
            towards: uniform_sphere(stream.uniform_pair()).as_dvec3().normalize(),
            sign: if stream.bits() & 1 == 0 { 1.0 } else { -1.0 },
            density,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let found = PlaneWaves::new(1, 0, volume, 343.0).between(time, time + 0.01).count() as f64;
            let expected: f64 = 0.01 * expected;
            assert!(
                (found - expected).abs() < 4.0 * expected.sqrt() + 1.0,
                "{time}: {found}, not {expected}"
            );
        }
    }

    #[test]
    fn a_wave_is_the_same_in_whatever_interval_it_is_found() {
        let waves = PlaneWaves::new(1, 0, Some(200.0), 343.0);
        let early: Vec<PlaneWave> = waves.between(-0.01, 0.05).collect();
        let late: Vec<PlaneWave> = waves.between(0.0, 0.1).collect();
        let common = |wave: &&PlaneWave| (0.0001..0.0499).contains(&wave.time);
        assert_eq!(
            early.iter().filter(common).collect::<Vec<_>>(),
            late.iter().filter(common).collect::<Vec<_>>()
        );
        assert_ne!(late, PlaneWaves::new(2, 0, Some(200.0), 343.0).between(0.0, 0.1).collect::<Vec<_>>());
    }
}
