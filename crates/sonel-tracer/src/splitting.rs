//! How much energy packets usually have, and which of them have so much that they are split.
//!
//! Late in a room of unequal surfaces few packets carry nearly all energy. One with more than [`MUCH`] times the mean of those under way
//! becomes two of half its energy, which draw what follows on their own, so that many carry it [KahnHarris1951]. No expectation
//! depends on the threshold, so that a short run with other random numbers is enough to find it.

use sonel_acoustics::{BandValues, Lanes, lanes_of};
use sonel_map::{CoefficientTable, Emissions, PathView, PathWeight, Segment, sweep};

/// Energy of a packet that is split, in means of those under way at its time. Half of it lets twice as many go on.
const MUCH: f64 = 2.0;
/// Windows of path length in a run: 47 ms of three seconds, in which a room decays by some dB.
const WINDOWS: usize = 64;
/// Mean energy of packets relative to that at emission below which none is split [1]: −50 dB, where no parameter reads any more.
const LEAST: f64 = 1e-5;

/// Thresholds of one source.
#[derive(Debug, Clone)]
pub struct SplitThresholds {
    windows_per_length: f64,
    /// One over the threshold in each band, by window; zero where none is split.
    inverse: Vec<Vec<Lanes>>,
}

/// Energy and number of packets under way, by windows of path length.
pub(crate) struct UnderWay {
    windows_per_length: f64,
    emitted: f64,
    energy: Vec<Vec<Lanes>>,
    packets: Vec<f64>,
}

impl UnderWay {
    /// Of packets of `source` on `paths`, which are at most `reach` long [m].
    pub(crate) fn of<'a>(
        source: u32,
        paths: impl Iterator<Item = PathView<'a>>,
        emissions: &Emissions,
        table: &CoefficientTable,
        reach: f64,
    ) -> Self {
        let mut found = Self {
            windows_per_length: WINDOWS as f64 / reach,
            emitted: 0.0,
            energy: vec![vec![Lanes::ZERO; lanes_of(table.bands())]; WINDOWS],
            packets: vec![0.0; WINDOWS],
        };
        let mut weight = PathWeight::of(table);
        for path in paths {
            found.emitted += 1.0;
            let unit = emissions.layout.batch_count(emissions.layout.batch(path.emission)) as f64;
            weight.emit(1.0, unit, emissions.start(path.emission));
            sweep(emissions.origin(source), path.vertices, table, &mut weight, |segment| found.pass(segment));
        }
        found
    }

    /// Counts a packet in the windows that begin on `segment`.
    fn pass(&mut self, segment: &Segment<'_>) {
        let window = |length: f64| (length * self.windows_per_length).ceil().min(WINDOWS as f64) as usize;
        for window in window(segment.start_length)..window(segment.end_length) {
            self.energy[window].add(segment.energy);
            self.packets[window] += 1.0;
        }
    }

    /// The thresholds by which as many packets as in `paced` are under way: a run in which none was split.
    pub(crate) fn thresholds(&self, paced: &Self) -> SplitThresholds {
        let mut inverse = self.energy.clone();
        for (sums, packets) in inverse.iter_mut().zip(&paced.packets) {
            let least = LEAST * self.emitted;
            let bands = sums.values().filter(|&sum| sum > least).count() as f64;
            let mean = packets / paced.emitted * self.emitted / (MUCH * bands);
            sums.values_mut().for_each(|sum| *sum = if *sum > least { mean / *sum } else { 0.0 });
        }
        SplitThresholds { windows_per_length: self.windows_per_length, inverse }
    }
}

impl SplitThresholds {
    /// Whether a packet after a path of `length` [m] has so much energy that it is split.
    #[inline]
    pub fn is_exceeded(&self, weight: &PathWeight, length: f64) -> bool {
        let window = (length * self.windows_per_length) as usize;
        self.inverse.get(window).is_some_and(|inverse| weight.compared(inverse) > 1.0)
    }
}
