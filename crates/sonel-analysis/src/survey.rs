//! Recomputes the energy ledger and the incident energies from the paths of a map.
//!
//! The survey uses the paths alone, so agreement with the stored ledger shows that paths, coefficients and ledger are consistent.
//!
//! References: docs/physics.md §2 and §3.

use rayon::prelude::*;
use sonel_geometry::Geometry;
use sonel_map::{
    BandClasses, BandValues, ChunkLedger, Lanes, Ledger, PathView, PathWeight, Segment, SonelMap, sweep,
};

use crate::reading::Reading;

/// Chunks walked side by side before they are added up: bounds the memory for scenes of many surfaces.
const GROUP_CHUNKS: usize = 16;
/// Rounding between two orders of summation, relative to the emitted energy.
const ROUNDING_SHARE: f64 = 1e-9;
/// Arrivals at a surface, or after a number of reflections.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Deposit {
    /// Sonels.
    pub hits: u64,
    /// Energy that arrived, per band, relative to what one source emits [1].
    pub incident: Vec<f64>,
    /// Energy that turned to heat, per band, relative to what one source emits [1].
    pub absorbed: Vec<f64>,
}

/// Contents of a map.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Survey {
    /// The ledger of all paths.
    pub ledger: Ledger,
    /// By surface.
    pub surfaces: Vec<Deposit>,
    /// By reflection order, from 0.
    pub orders: Vec<Deposit>,
}

/// Walks every path of `map`, whose paths must be sound ([`SonelMap::check_paths`]); `geometry` is that of its scene.
#[must_use]
pub fn survey(map: &SonelMap, geometry: &Geometry) -> Survey {
    let reading = Reading::new(map, geometry);
    let chunks: Vec<(u32, u64)> = map.chunks().collect();
    let mut total = reading.nothing();
    for group in chunks.chunks(GROUP_CHUNKS) {
        let parts: Vec<Survey> = group.par_iter().map(|&chunk| reading.survey(chunk)).collect();
        parts.iter().for_each(|part| total.add(part));
    }
    total
}

/// Where two ledgers of the same paths differ by more than rounding, a sentence each.
#[must_use]
pub fn differences(stored: &Ledger, found: &Ledger, center_frequencies_hz: &[f64]) -> Vec<String> {
    let mut sentences = Vec::new();
    if stored.fates != found.fates {
        let (stored, found) = (stored.fates.counts(), found.fates.counts());
        sentences.push(format!("fates of the packets: stored {stored:?}, paths {found:?}"));
    }
    if stored.segments != found.segments {
        sentences.push(format!("segments: stored {}, paths {}", stored.segments, found.segments));
    }
    for ((frequency, stored), found) in center_frequencies_hz.iter().zip(&stored.bands).zip(&found.bands) {
        let terms = [
            ("emitted", stored.emitted, found.emitted, ROUNDING_SHARE),
            ("absorbed", stored.absorbed, found.absorbed, ROUNDING_SHARE),
            ("transmitted", stored.transmitted, found.transmitted, ROUNDING_SHARE),
            ("escaped", stored.escaped, found.escaped, ROUNDING_SHARE),
            ("truncated", stored.truncated, found.truncated, ROUNDING_SHARE),
            ("sampling", stored.sampling, found.sampling, ROUNDING_SHARE),
        ];
        for (name, kept, walked, share) in terms {
            let agree = (kept - walked).abs() <= share * found.emitted;
            if !agree {
                sentences.push(format!("{name} at {frequency} Hz: stored {kept}, paths {walked}"));
            }
        }
    }
    sentences
}

impl Reading<'_> {
    fn nothing(&self) -> Survey {
        Survey {
            ledger: Ledger::new(self.bands),
            surfaces: vec![Deposit::none(self.bands); self.table.surface_count()],
            orders: Vec::new(),
        }
    }

    fn survey(&self, chunk: (u32, u64)) -> Survey {
        let mut found = self.nothing();
        let mut ledger = ChunkLedger::new(self.bands);
        let mut weight = PathWeight::of(&self.table);
        for path in self.map.chunk_paths(chunk) {
            self.survey_path(chunk.0, path, &mut weight, &mut ledger, &mut found);
        }
        found.ledger = ledger.finish(&BandClasses::separate(self.bands));
        found
    }

    fn survey_path(
        &self,
        source: u32,
        path: PathView<'_>,
        weight: &mut PathWeight,
        ledger: &mut ChunkLedger,
        found: &mut Survey,
    ) {
        let Reading { table, bands, .. } = self;
        self.account(source, path, weight, ledger, |segment| {
            if let Some(arrival) = segment.arrival {
                let row = &*table.row(arrival.surface, segment.direction());
                found.surfaces[arrival.surface.0 as usize].add(segment.energy, &row.dissipated);
                found.order(segment.history.order, *bands).add(segment.energy, &row.dissipated);
            }
        });
    }

    /// Enters a path in `ledger`, and visits its segments, with energies as parts of what its source emits.
    pub(crate) fn account(
        &self,
        source: u32,
        path: PathView<'_>,
        weight: &mut PathWeight,
        ledger: &mut ChunkLedger,
        mut visit: impl FnMut(&Segment<'_>),
    ) {
        let Reading { emissions, table, .. } = self;
        let share = emissions.share(path.emission);
        emissions.emit(source, path.emission, share, weight);
        ledger.emitted(share, &emissions.start(path.emission).expected, weight.energy());
        sweep(emissions.origin(source), path.vertices, table, weight, |segment| {
            visit(segment);
            if segment.is_part {
                return;
            }
            ledger.segment(segment.energy, segment.leaves_wall);
            if let Some(arrival) = segment.arrival {
                ledger.arrived(segment.energy, &table.row(arrival.surface, segment.direction()));
            }
            if segment.event.is_final() {
                ledger.ended(segment.event, segment.energy);
            }
        });
        ledger.close();
    }
}

impl Deposit {
    fn none(bands: usize) -> Self {
        Self { hits: 0, incident: vec![0.0; bands], absorbed: vec![0.0; bands] }
    }

    fn add(&mut self, incident: &[Lanes], dissipated: &[Lanes]) {
        self.hits += 1;
        for (band, (arrived, absorbed)) in self.incident.iter_mut().zip(&mut self.absorbed).enumerate() {
            *arrived += incident.band(band);
            *absorbed += incident.band(band) * dissipated.band(band);
        }
    }

    fn join(&mut self, other: &Self) {
        self.hits += other.hits;
        let sums = self.incident.iter_mut().chain(&mut self.absorbed);
        sums.zip(other.incident.iter().chain(&other.absorbed)).for_each(|(mine, theirs)| *mine += theirs);
    }
}

impl Survey {
    fn order(&mut self, order: u32, bands: usize) -> &mut Deposit {
        let order = order as usize;
        if self.orders.len() <= order {
            self.orders.resize(order + 1, Deposit::none(bands));
        }
        &mut self.orders[order]
    }

    fn add(&mut self, part: &Self) {
        self.ledger.add(&part.ledger);
        for (mine, theirs) in self.surfaces.iter_mut().zip(&part.surfaces) {
            mine.join(theirs);
        }
        for (order, theirs) in part.orders.iter().enumerate() {
            self.order(order as u32, theirs.incident.len()).join(theirs);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_map::BandLedger;
    use sonel_map::Event;

    fn ledger() -> Ledger {
        let band = BandLedger { emitted: 1.0, absorbed: 0.9, truncated: 0.1, ..BandLedger::default() };
        Ledger { bands: vec![band; 2], segments: 10, ..Ledger::new(2) }
    }

    #[test]
    fn equal_ledgers_do_not_differ() {
        let mut rounded = ledger();
        rounded.bands[1].absorbed += 1e-13;
        rounded.bands[1].truncated += 1e-13;
        assert!(differences(&ledger(), &rounded, &[500.0, 1000.0]).is_empty());
    }

    #[test]
    fn every_other_ledger_is_found() {
        type Change = fn(&mut Ledger);
        let changes: [(Change, &str); 7] = [
            (|ledger| ledger.bands[1].emitted += 1e-6, "emitted at 1000 Hz"),
            (|ledger| ledger.bands[1].absorbed -= 1e-6, "absorbed at 1000 Hz"),
            (|ledger| ledger.bands[0].escaped += 1e-6, "escaped at 500 Hz"),
            (|ledger| ledger.bands[0].truncated += 1e-5, "truncated at 500 Hz"),
            (|ledger| ledger.bands[0].sampling = f64::NAN, "sampling at 500 Hz"),
            (|ledger| ledger.segments += 1, "segments"),
            (|ledger| ledger.fates.record(Event::Lost), "fates"),
        ];
        for (change, sentence) in changes {
            let mut other = ledger();
            change(&mut other);
            let found = differences(&ledger(), &other, &[500.0, 1000.0]);
            assert!(found.len() == 1 && found[0].starts_with(sentence), "{sentence}: {found:?}");
        }
    }
}
