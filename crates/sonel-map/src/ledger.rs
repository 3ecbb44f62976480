//! The energy ledger per band, and the fates of packets.
//!
//! Per band: emitted = absorbed + transmitted + escaped + truncated + sampling (docs/physics.md §3). Every term is recorded
//! on its own at the place where it arises; the sampling term is expected minus actual energy passed on, so that the
//! balance can fail where an event, a probability or a coefficient is wrong. Sums are kept per chunk, as in the file, and
//! added in chunk order: shards joined equal the run made in one piece.

use bytemuck::{Pod, Zeroable};
use sonel_acoustics::{BandValues, Lanes, lanes_of};

use crate::classes::BandClasses;
use crate::coefficients::MaterialRow;
use crate::vertex::Event;

/// Why a packet ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// Roulette on absorption.
    Absorbed,
    /// Left the scene through a partition.
    Transmitted,
    /// Left an open scene.
    Escaped,
    /// Reached the end of the run.
    Expired,
    /// Met no surface in a closed room without cracks: a defect.
    Lost,
}

impl Fate {
    /// All, in their order.
    pub const ALL: [Self; 5] = [Self::Absorbed, Self::Transmitted, Self::Escaped, Self::Expired, Self::Lost];

    /// Name in docs/interface.md.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Absorbed => "absorbed",
            Self::Transmitted => "transmitted",
            Self::Escaped => "escaped",
            Self::Expired => "expired",
            Self::Lost => "lost",
        }
    }
}

/// Number of packets per [`Fate`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Fates {
    counts: [u64; Fate::ALL.len()],
}

impl Fates {
    /// The counts in the order of [`Fate`].
    #[must_use]
    pub fn from_counts(counts: [u64; 5]) -> Self {
        Self { counts }
    }

    /// The counts in the order of [`Fate`].
    #[must_use]
    pub fn counts(&self) -> [u64; 5] {
        self.counts
    }

    /// Packets that ended so.
    #[must_use]
    pub fn count(&self, fate: Fate) -> u64 {
        self.counts[fate as usize]
    }

    /// All packets.
    #[must_use]
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Records the end of one packet; an event that ends nothing is none.
    pub fn record(&mut self, last: Event) {
        let fate = match last {
            Event::Absorbed => Fate::Absorbed,
            Event::Escaped => Fate::Escaped,
            Event::Expired => Fate::Expired,
            Event::Lost => Fate::Lost,
            Event::Left => Fate::Transmitted,
            _ => unreachable!("a path ends in a final event"),
        };
        self.counts[fate as usize] += 1;
    }

    /// Adds the counts of another part of the run.
    pub fn add(&mut self, other: &Self) {
        self.counts.iter_mut().zip(other.counts).for_each(|(mine, theirs)| *mine += theirs);
    }
}

/// The balance of one band, in units of the energy emitted by one source over the whole run [1].
#[derive(Debug, Clone, Copy, PartialEq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct BandLedger {
    /// Sent out.
    pub emitted: f64,
    /// Turned to heat at surfaces, Σ e (α − τ).
    pub absorbed: f64,
    /// Left through partitions.
    pub transmitted: f64,
    /// Left an open scene, or a room through its cracks.
    pub escaped: f64,
    /// Still under way when packets were ended by time or loss.
    pub truncated: f64,
    /// Expected minus actual energy passed on by roulette and band weights, signed; zero on average.
    pub sampling: f64,
    /// Σ over packets of (sampling term)²: the variance of `sampling` if packets were independent.
    pub sampling_variance: f64,
}

/// Number of sums that a [`BandLedger`] holds, in the order of its fields, as in the file.
pub const LEDGER_TERMS: usize = 7;

impl BandLedger {
    /// The sums in field order.
    #[must_use]
    pub fn terms(&self) -> [f64; LEDGER_TERMS] {
        bytemuck::cast(*self)
    }

    /// From sums in field order.
    #[must_use]
    pub fn from_terms(terms: [f64; LEDGER_TERMS]) -> Self {
        bytemuck::cast(terms)
    }

    /// |emitted − everything recorded| / emitted: rounding only, if the code is right. Zero where nothing was emitted.
    #[must_use]
    pub fn relative_residual(&self) -> f64 {
        let recorded = self.absorbed + self.transmitted + self.escaped + self.truncated + self.sampling;
        if self.emitted > 0.0 { ((self.emitted - recorded) / self.emitted).abs() } else { 0.0 }
    }

    /// Standard deviation expected of `sampling` for independent packets; strata make the true one smaller.
    #[must_use]
    pub fn sampling_sigma(&self) -> f64 {
        self.sampling_variance.sqrt()
    }

    fn add(&mut self, other: &Self) {
        let terms: &mut [f64; LEDGER_TERMS] = bytemuck::cast_mut(self);
        terms.iter_mut().zip(other.terms()).for_each(|(mine, theirs)| *mine += theirs);
    }
}

/// The ledger of a run or of a part of it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Ledger {
    /// One balance per band. With S sources every band emits S units.
    pub bands: Vec<BandLedger>,
    /// What became of the packets.
    pub fates: Fates,
    /// Straight pieces of path traced, the last of each packet included.
    pub segments: u64,
}

impl Ledger {
    /// An empty ledger for `bands` bands.
    #[must_use]
    pub fn new(bands: usize) -> Self {
        Self { bands: vec![BandLedger::default(); bands], fates: Fates::default(), segments: 0 }
    }

    /// Adds the ledger of the part of the run that follows.
    pub fn add(&mut self, other: &Self) {
        for (mine, theirs) in self.bands.iter_mut().zip(&other.bands) {
            mine.add(theirs);
        }
        self.fates.add(&other.fates);
        self.segments += other.segments;
    }

    /// The largest [`BandLedger::relative_residual`].
    #[must_use]
    pub fn worst_residual(&self) -> f64 {
        self.bands.iter().map(BandLedger::relative_residual).fold(0.0, f64::max)
    }
}

/// The ledger of a chunk while it is traced: sums per packet first, so that long runs do not drift.
#[derive(Debug, Clone)]
pub struct ChunkLedger {
    /// The sums in the order of the fields of [`BandLedger`].
    terms: [Vec<Lanes>; LEDGER_TERMS],
    packet_sampling: Vec<Lanes>,
    /// What became of the packets.
    pub fates: Fates,
    /// Straight pieces of path traced.
    pub segments: u64,
}

const EMITTED: usize = 0;
const ABSORBED: usize = 1;
const TRANSMITTED: usize = 2;
const ESCAPED: usize = 3;
const TRUNCATED: usize = 4;
const SAMPLING: usize = 5;
const SAMPLING_VARIANCE: usize = 6;

impl ChunkLedger {
    /// An empty ledger for `columns` bands or classes of bands.
    #[must_use]
    pub fn new(columns: usize) -> Self {
        let nothing = vec![Lanes::ZERO; lanes_of(columns)];
        Self {
            terms: [(); LEDGER_TERMS].map(|()| nothing.clone()),
            packet_sampling: nothing,
            fates: Fates::default(),
            segments: 0,
        }
    }

    /// Opens the ledger of one packet: `unit` times `expected` leaves the source on average, `actual` did in this direction.
    /// All energies here and below are parts of what the whole run emits.
    #[inline]
    pub fn emitted(&mut self, unit: f64, expected: &[Lanes], actual: &[Lanes]) {
        self.terms[EMITTED].add_times(expected, unit);
        self.packet_sampling.set_times(expected, unit);
        self.packet_sampling.subtract(actual);
    }

    /// Records a segment with `energy`: what really went on from where it begins, if that is a wall.
    #[inline]
    pub fn segment(&mut self, energy: &[Lanes], leaves_wall: bool) {
        self.segments += 1;
        if leaves_wall {
            self.packet_sampling.subtract(energy);
        }
    }

    /// Records an arrival at a surface with `row`: `incident` energy, a part of which is expected to go on.
    #[inline]
    pub fn arrived(&mut self, incident: &[Lanes], row: &MaterialRow) {
        self.terms[ABSORBED].add_product(incident, &row.dissipated);
        self.packet_sampling.add_product(incident, &row.passed_on);
    }

    /// Records that a packet ended in `last`, with `remaining` energy on its way unless it was absorbed.
    pub fn ended(&mut self, last: Event, remaining: &[Lanes]) {
        match last {
            Event::Escaped => self.terms[ESCAPED].add(remaining),
            Event::Left => self.terms[TRANSMITTED].add(remaining),
            Event::Absorbed => {}
            _ => self.terms[TRUNCATED].add(remaining),
        }
        self.fates.record(last);
    }

    /// Closes the ledger of a packet, and of those it was split into.
    pub fn close(&mut self) {
        let packet = &self.packet_sampling;
        self.terms[SAMPLING].add(packet);
        self.terms[SAMPLING_VARIANCE].add_product(packet, packet);
    }

    /// The finished ledger of all bands, whose `classes` the columns are.
    #[must_use]
    pub fn finish(self, classes: &BandClasses) -> Ledger {
        let band = |band: usize| {
            BandLedger::from_terms(self.terms.each_ref().map(|term| term.band(classes.of(band))))
        };
        Ledger { bands: (0..classes.bands()).map(band).collect(), fates: self.fates, segments: self.segments }
    }
}
