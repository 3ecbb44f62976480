//! How much energy packets usually have, and which of them have so much that they are split.
//!
//! Late in a room of unequal surfaces few packets carry nearly all energy. One with more than [`MUCH`] times the mean of those under way
//! becomes two of half its energy, which draw what follows on their own, so that many carry it [KahnHarris1951]. No expectation
//! depends on the threshold, so that a short run with other random numbers is enough to find it.

use sonel_acoustics::{BandValues, Lanes, lanes_of};
use sonel_map::{Emissions, PathView, PathWeight, Segment};

use crate::packet::Surroundings;

/// Energy of a packet that is split, in means of those under way at its time. Half of it lets twice as many go on.
const MUCH: f64 = 2.0;
/// Windows of path length in a run: 47 ms of three seconds, in which a room decays by some dB.
const WINDOWS: usize = 64;
/// Mean energy of packets relative to that at emission below which none is split [1]: −50 dB, where no parameter reads any more.
const LEAST: f64 = 1e-5;

/// Thresholds of one source.
#[derive(Debug, Clone)]
pub struct Usual {
    windows_per_length: f64,
    /// One over the threshold in each band, by window; zero where none is split.
    inverse: Vec<Vec<Lanes>>,
}

/// Energy and number of packets under way, by windows of path length.
pub(crate) struct UnderWay {
    windows_per_length: f64,
    emitted: u64,
    energy: Vec<Vec<Lanes>>,
    packets: Vec<u64>,
}

impl UnderWay {
    /// Nothing yet, of packets with paths of up to `reach` [m] in so many `columns`.
    pub(crate) fn new(reach: f64, columns: usize) -> Self {
        Self {
            windows_per_length: WINDOWS as f64 / reach,
            emitted: 0,
            energy: vec![vec![Lanes::ZERO; lanes_of(columns)]; WINDOWS],
            packets: vec![0; WINDOWS],
        }
    }

    /// Adds a packet of `source`.
    pub(crate) fn add(
        &mut self,
        source: u32,
        path: PathView<'_>,
        emissions: &Emissions,
        surroundings: &Surroundings<'_>,
        weight: &mut PathWeight,
    ) {
        let unit = emissions.layout.batch_count(emissions.layout.batch(path.emission)) as f64;
        self.emitted += 1;
        emissions.follow(source, path, unit, &surroundings.table, weight, |segment| self.pass(segment));
    }

    /// Counts a packet in the windows that begin on `segment`.
    fn pass(&mut self, segment: &Segment<'_>) {
        let window = |length: f64| (length * self.windows_per_length).ceil().min(WINDOWS as f64) as usize;
        for window in window(segment.start_length)..window(segment.end_length) {
            self.energy[window].add(segment.energy);
            self.packets[window] += 1;
        }
    }

    /// The thresholds by which as many packets as in `paced` are under way: a run in which none was split.
    pub(crate) fn thresholds(&self, paced: &Self) -> Usual {
        let inverse = |(energy, &packets): (&Vec<Lanes>, &u64)| {
            let packets = packets as f64 / paced.emitted as f64;
            let mut inverse = energy.clone();
            let mean = |sum: f64| sum / self.emitted as f64;
            let bands = energy.values().filter(|&sum| mean(sum) > LEAST).count() as f64;
            inverse.values_mut().for_each(|value| {
                let mean = mean(*value);
                *value = if mean > LEAST { packets / (MUCH * bands * mean) } else { 0.0 };
            });
            inverse
        };
        let inverse = self.energy.iter().zip(&paced.packets).map(inverse).collect();
        Usual { windows_per_length: self.windows_per_length, inverse }
    }
}

impl Usual {
    /// Whether a packet after a path of `length` [m] has so much energy that it is split.
    #[inline]
    pub fn is_exceeded(&self, weight: &PathWeight, length: f64) -> bool {
        let window = (length * self.windows_per_length) as usize;
        self.inverse.get(window).is_some_and(|inverse| weight.compared(inverse) > 1.0)
    }
}
