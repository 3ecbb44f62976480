//! Incident energy per place, time window and batch, from the paths of one source.

use std::ops::Range;

use sonel_map::{BandValues, EmissionLayout, Lanes, PacketStart, PathWeight};

use super::counterparts::PlacesOf;
use crate::reading::Reading;

/// One source of one map, and how its arrivals are sorted.
pub(super) struct Observer<'a> {
    /// The map.
    pub reading: &'a Reading<'a>,
    /// Index of the source.
    pub source: u32,
    /// The places that each surface contributes to.
    pub places_of: &'a [PlacesOf],
    /// Number of places.
    pub places: usize,
    /// Ends of the windows as path lengths [m].
    pub window_ends: Vec<f64>,
    /// Bands looked at.
    pub columns: Vec<usize>,
}

/// Of the packets of one batch: incident energy per unit energy that the batch emits [1], arrivals in units of one packet's energy [1]
/// and their squares [1]; in cells `[place][window][column]`, or by surface instead of place.
pub(super) type Incidence = Vec<[f64; 3]>;

impl Observer<'_> {
    /// Number of cells.
    pub(super) fn cells(&self) -> usize {
        self.places * self.window_ends.len() * self.columns.len()
    }

    /// Part of the energy of `batch` that the emissions held by the map carry, per column: 1 for a whole map.
    pub(super) fn held_part(&self, batch: u32) -> Vec<f64> {
        self.over_leads(batch, |start| &start.expected)
    }

    /// Packets held by the map that carry each column.
    pub(super) fn packets(&self, batch: u32) -> Vec<f64> {
        self.over_leads(batch, |start| &start.carried)
    }

    fn over_leads(&self, batch: u32, of: impl Fn(&PacketStart) -> &[Lanes]) -> Vec<f64> {
        let (layout, held) = (self.reading.emissions.layout, self.held());
        let led = |total, lead| EmissionLayout { total, ..layout }.lead_count(batch, lead) as f64;
        let sum = |column: usize| {
            (0..layout.leads())
                .map(|lead| {
                    let start = self.reading.emissions.batches[batch as usize].packet(lead);
                    let each = of(start).band(column);
                    // A batch without packets has infinite energies and nobody to carry them.
                    let packets = led(held.end, lead) - led(held.start, lead);
                    if packets > 0.0 { packets * each } else { 0.0 }
                })
                .sum()
        };
        self.columns.iter().map(|&column| sum(column)).collect()
    }

    /// Emissions that the map holds.
    fn held(&self) -> Range<u64> {
        let layout = self.reading.emissions.layout;
        layout.emissions(self.reading.map.header().shard.chunks(layout.chunks()))
    }

    /// Walks the paths of `batches` in the order in which they are stored.
    pub(super) fn walk(&self, batches: Range<u32>) -> Vec<Incidence> {
        let cells = self.places_of.len() * self.window_ends.len() * self.columns.len();
        let mut tallies = vec![vec![[0.0; 3]; cells]; batches.len()];
        let mut weight = PathWeight::of(&self.reading.table);
        let (layout, held) = (self.reading.emissions.layout, self.held());
        let (leads, stride) =
            (u64::from(layout.leads()), u64::from(layout.leads()) * u64::from(layout.batches));
        let run = u64::from(batches.start) * leads..u64::from(batches.end) * leads;
        for round in held.start / stride..held.end.div_ceil(stride) {
            let emissions = round * stride + run.start..round * stride + run.end;
            for emission in emissions.start.max(held.start)..emissions.end.min(held.end) {
                let batch = (emission - emissions.start) / leads;
                self.path(emission, &mut weight, &mut tallies[batch as usize]);
            }
        }
        tallies.iter().map(|tally| self.by_place(tally)).collect()
    }

    fn path(&self, emission: u64, weight: &mut PathWeight, tally: &mut Incidence) {
        let Some(path) = self.reading.map.path(self.source, emission) else { return };
        let expected = &self.reading.emissions.start(emission).expected;
        self.reading.follow(self.source, path, 1.0, weight, |segment| {
            let Some(arrival) = segment.arrival else { return };
            let window = self.window_ends.partition_point(|&end| end < segment.end_length);
            if window == self.window_ends.len() {
                return;
            }
            let row = arrival.surface.0 as usize * self.window_ends.len() + window;
            let sums = &mut tally[row * self.columns.len()..][..self.columns.len()];
            for (sum, &column) in sums.iter_mut().zip(&self.columns) {
                let energy = segment.energy.band(column);
                if energy > 0.0 {
                    let packets = energy / expected.band(column);
                    *sum = [sum[0] + energy, sum[1] + packets, sum[2] + packets * packets];
                }
            }
        });
    }

    /// Cells by place from those by surface.
    fn by_place(&self, by_surface: &Incidence) -> Incidence {
        let per_place = self.window_ends.len() * self.columns.len();
        let mut found = vec![[0.0; 3]; self.cells()];
        for (places, sums) in self.places_of.iter().zip(by_surface.chunks_exact(per_place)) {
            for place in places.iter().flatten() {
                let cells = &mut found[*place as usize * per_place..];
                for (cell, sums) in cells.iter_mut().flatten().zip(sums.iter().flatten()) {
                    *cell += sums;
                }
            }
        }
        found
    }
}
