//! Emission i: its lead, its batch, and its point in the sequence of that batch.
//!
//! All three are functions of the index alone (docs/physics.md §6), so a run can be cut into shards or extended:
//! with n_l leads and G batches, block = ⌊i / n_l⌋, lead = i mod n_l, batch = block mod G. A lead is a band in one of the sets of
//! [`crate::Leads`].

use std::ops::Range;

use glam::Vec3;
use sonel_acoustics::{Lanes, to_lanes};
use sonel_sampling::{ScrambledSobol, warp};

use crate::classes::BandClasses;
use crate::spectral::Spectral;

/// Emissions whose paths are traced, written and checked as one unit.
///
/// A constant, because chunk borders decide the bytes of a map; about a quarter of a megabyte of paths, small enough to
/// spread fifty thousand emissions over many cores.
pub const CHUNK_EMISSIONS: u64 = 512;

/// Numbering of the emissions of one source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EmissionLayout {
    /// Emissions of one source, over all bands.
    pub total: u64,
    /// Number of bands, n_b.
    pub bands: u32,
    /// Sets of shares by which events are drawn: 1 unless variants differ in them.
    pub sets: u32,
    /// Number of batches, G.
    pub batches: u32,
}

impl EmissionLayout {
    /// Number of leads, n_l.
    #[must_use]
    pub fn leads(&self) -> u32 {
        self.bands * self.sets
    }

    /// The lead whose probabilities decide the life of emission `index`: band b in set v is number v n_b + b.
    #[must_use]
    pub fn lead(&self, index: u64) -> u32 {
        (index % u64::from(self.leads())) as u32
    }

    /// The band of [`Self::lead`].
    #[must_use]
    pub fn lead_band(&self, index: u64) -> u32 {
        self.lead(index) % self.bands
    }

    /// The batch of emission `index`.
    #[must_use]
    pub fn batch(&self, index: u64) -> u32 {
        (index / u64::from(self.leads()) % u64::from(self.batches)) as u32
    }

    /// Number of emissions of the same batch and lead before emission `index`.
    #[must_use]
    pub fn round(&self, index: u64) -> u32 {
        (index / (u64::from(self.leads()) * u64::from(self.batches))) as u32
    }

    /// Number of emissions of `batch` led by `lead`.
    #[must_use]
    pub fn lead_count(&self, batch: u32, lead: u32) -> u64 {
        let (leads, batches) = (u64::from(self.leads()), u64::from(self.batches));
        let (blocks, rest) = (self.total / leads, self.total % leads);
        let complete = (blocks + batches - 1 - u64::from(batch)) / batches;
        let in_broken_block = blocks % batches == u64::from(batch) && u64::from(lead) < rest;
        complete + u64::from(in_broken_block)
    }

    /// Emissions of `batch`, N_g.
    #[must_use]
    pub fn batch_count(&self, batch: u32) -> u64 {
        (0..self.leads()).map(|lead| self.lead_count(batch, lead)).sum()
    }

    /// Share of `batch` in all emissions, N_g / N; zero for an empty run.
    #[must_use]
    pub fn batch_weight(&self, batch: u32) -> f64 {
        if self.total == 0 { 0.0 } else { self.batch_count(batch) as f64 / self.total as f64 }
    }

    /// Chunks of one source.
    #[must_use]
    pub fn chunks(&self) -> u64 {
        self.total.div_ceil(CHUNK_EMISSIONS)
    }

    /// Indices of the emissions of these chunks.
    #[must_use]
    pub fn emissions(&self, chunks: Range<u64>) -> Range<u64> {
        let first = |chunk: u64| (chunk * CHUNK_EMISSIONS).min(self.total);
        first(chunks.start)..first(chunks.end)
    }

    /// Indices of `batch` in ascending order.
    pub fn batch_indices(&self, batch: u32) -> impl Iterator<Item = u64> + use<> {
        let (leads, stride) = (u64::from(self.leads()), u64::from(self.leads()) * u64::from(self.batches));
        let total = self.total;
        (u64::from(batch) * leads..total)
            .step_by(stride as usize)
            .flat_map(move |first| first..(first + leads).min(total))
    }
}

/// First directions of the packets of one source: regenerated from the seed, never stored.
///
/// Where bands share paths, the packets of a batch share one sequence, so that together they fill the sphere evenly; which
/// of a round's points goes to which lead is turned at random from round to round. Without that turn a lead
/// would get every n_l-th point, which for a power of two lie in one part of the sphere. Where bands have paths of
/// their own, each lead has a sequence of its own.
#[derive(Debug, Clone)]
pub struct EmissionDirections {
    layout: EmissionLayout,
    spectral: Spectral,
    sequences: Vec<ScrambledSobol>,
}

impl EmissionDirections {
    /// Directions of `source` under `seed`.
    #[must_use]
    pub fn new(seed: u64, source: u32, layout: EmissionLayout, spectral: Spectral) -> Self {
        let per_batch = match spectral {
            Spectral::Shared => 1,
            Spectral::PerBand => layout.leads(),
        };
        let sequences = (0..layout.batches * per_batch)
            .map(|number| ScrambledSobol::numbered(seed, source, number))
            .collect();
        Self { layout, spectral, sequences }
    }

    /// Unit direction in which emission `index` leaves.
    #[must_use]
    pub fn direction(&self, index: u64) -> Vec3 {
        let (leads, round) = (self.layout.leads(), self.layout.round(index));
        let (batch, lead) = (self.layout.batch(index), self.layout.lead(index));
        let point = match self.spectral {
            Spectral::Shared => {
                let sequence = &self.sequences[batch as usize];
                sequence.point(round * leads + (lead + sequence.turn(round) % leads) % leads)
            }
            Spectral::PerBand => self.sequences[(batch * leads + lead) as usize].point(round),
        };
        warp::uniform_sphere(point)
    }
}

/// How the packets of one batch start: packets of each lead, and which bands a packet carries.
#[derive(Debug, Clone)]
pub struct BatchStart {
    bands: u32,
    starts: Vec<PacketStart>,
    /// Share of the batch in the run, N_g / N.
    pub weight: f64,
}

/// The start of a packet, see [`crate::PathWeight::emit`].
#[derive(Debug, Clone)]
pub struct PacketStart {
    /// n_k: packets of the batch of each column of leads, zero for those that this one stands apart from.
    pub counts: Vec<Lanes>,
    /// Number of leads that each column stands for, zero likewise.
    pub sizes: Vec<Lanes>,
    /// 1 for the columns of bands carried.
    pub carried: Vec<Lanes>,
    /// Energy expected to leave the source with this packet, as a part of what its batch emits.
    pub expected: Vec<Lanes>,
}

impl BatchStart {
    /// The start of the packets of `batch`.
    #[must_use]
    pub fn new(layout: &EmissionLayout, batch: u32, spectral: Spectral) -> Self {
        let separate = |count: u32| BandClasses::separate(count as usize);
        Self::grouped(layout, batch, spectral, &separate(layout.bands), &separate(layout.leads()))
    }

    /// The start of the packets of `batch`, with one column for each class of bands and of leads.
    #[must_use]
    pub fn grouped(
        layout: &EmissionLayout,
        batch: u32,
        spectral: Spectral,
        bands: &BandClasses,
        leads: &BandClasses,
    ) -> Self {
        let starts = match spectral {
            Spectral::Shared => vec![PacketStart::new(layout, batch, bands, leads, |_| true)],
            Spectral::PerBand => {
                let start = |lead| PacketStart::new(layout, batch, bands, leads, |k| k == lead);
                (0..layout.bands).map(start).collect()
            }
        };
        Self { bands: layout.bands, starts, weight: layout.batch_weight(batch) }
    }

    /// The start of a packet of `lead`.
    #[must_use]
    pub fn packet(&self, lead: u32) -> &PacketStart {
        if self.starts.len() == 1 { &self.starts[0] } else { &self.starts[(lead % self.bands) as usize] }
    }
}

impl PacketStart {
    fn new(
        layout: &EmissionLayout,
        batch: u32,
        bands: &BandClasses,
        leads: &BandClasses,
        carries: impl Fn(u32) -> bool,
    ) -> Self {
        // Variants of a band are carried with it.
        let mut is_carried = vec![false; bands.count()];
        for band in (0..bands.bands()).filter(|&band| carries(band as u32 % layout.bands)) {
            is_carried[bands.of(band)] = true;
        }
        let none = vec![0.0; leads.count()];
        let (mut counts, mut sizes) = (none.clone(), none);
        for lead in (0..layout.leads()).filter(|&lead| carries(lead % layout.bands)) {
            let class = leads.of(lead as usize);
            counts[class] += layout.lead_count(batch, lead) as f64;
            sizes[class] += 1.0;
        }
        let packets: f64 = counts.iter().sum();
        let where_carried =
            |value: f64| to_lanes(is_carried.iter().map(move |&carried| if carried { value } else { 0.0 }));
        Self {
            carried: where_carried(1.0),
            expected: where_carried(1.0 / packets),
            counts: to_lanes(counts.iter().copied()),
            sizes: to_lanes(sizes.iter().copied()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_agree_with_enumeration_for_ragged_totals() {
        for total in [0, 1, 5, 6, 7, 191, 192, 193, 1000] {
            let layout = EmissionLayout { total, bands: 3, sets: 2, batches: 32 };
            let mut seen = 0;
            for batch in 0..32 {
                let indices: Vec<u64> = layout.batch_indices(batch).collect();
                seen += indices.len() as u64;
                assert!(indices.iter().all(|&i| layout.batch(i) == batch));
                for lead in 0..6 {
                    let led = indices.iter().filter(|&&i| layout.lead(i) == lead).count() as u64;
                    assert_eq!(
                        led,
                        layout.lead_count(batch, lead),
                        "total {total} batch {batch} lead {lead}"
                    );
                }
            }
            assert_eq!(seen, total);
        }
    }

    /// Mean direction of every leading band's packets: zero for a full sphere, half a radius for an eighth of it. Points in
    /// strata of a whole sequence (bands on their own) are sharper than independent ones.
    #[test]
    fn every_leading_band_sees_the_whole_sphere() {
        let layout = EmissionLayout { total: 64_000, bands: 8, sets: 1, batches: 32 };
        for spectral in [Spectral::Shared, Spectral::PerBand] {
            let directions = EmissionDirections::new(1, 0, layout, spectral);
            for batch in [0, 13] {
                for lead in 0..8 {
                    let led: Vec<u64> =
                        layout.batch_indices(batch).filter(|&i| layout.lead(i) == lead).collect();
                    let mean = led.iter().map(|&i| directions.direction(i)).sum::<Vec3>() / led.len() as f32;
                    // 250 independent directions: each component has a standard error of 1/√750.
                    assert!(mean.length() < 0.15, "{spectral:?} batch {batch} lead {lead}: {mean}");
                }
            }
        }
    }

    /// The directions that docs/formats/sonelmap.md states, for those who write a reader.
    #[test]
    fn first_directions_are_those_of_the_format_page() {
        let layout = EmissionLayout { total: 1000, bands: 8, sets: 1, batches: 32 };
        let directions = EmissionDirections::new(1, 0, layout, Spectral::Shared);
        for (emission, expected) in
            [(0, Vec3::new(0.0365, -0.3471, 0.9371)), (256, Vec3::new(-0.6911, -0.0746, -0.7189))]
        {
            assert!(directions.direction(emission).distance(expected) < 1e-4, "emission {emission}");
        }
    }

    /// All packets of a batch together keep the strata: the mean direction of a power of two of them all but vanishes.
    #[test]
    fn a_shared_batch_is_stratified_as_a_whole() {
        let layout = EmissionLayout { total: 32 * 1024, bands: 4, sets: 2, batches: 32 };
        let directions = EmissionDirections::new(1, 0, layout, Spectral::Shared);
        let mean = layout.batch_indices(3).map(|i| directions.direction(i)).sum::<Vec3>() / 1024.0;
        assert!(mean.length() < 0.005, "{mean}");
    }
}
