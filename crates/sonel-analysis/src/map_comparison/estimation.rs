//! Estimates of every cell of a source from the batches of both maps, a few batches at a time.

use rayon::prelude::*;

use super::cell::CellStatistics;
use super::counterparts::{BandGroup, Places};
use super::incidence::{Incidence, Observer};
use super::moments::Moments;
use super::{Incomparable, MapPairing};
use crate::reading::Reading;

/// Batches walked together along the file, which is read as many times less. Memory and speed alone depend on it.
const BATCHES_PER_WALK: u32 = 8;
/// Batches held in memory at once, for each map.
const BATCHES_IN_FLIGHT: u32 = 32;

/// Everything common to the sources.
pub(super) struct Frame<'a> {
    /// A and B.
    pub readings: [Reading<'a>; 2],
    /// Relation of their noise.
    pub pairing: MapPairing,
    /// Whether an arrival after the same history weighs the same in both.
    pub alike: bool,
    /// Ends of the windows [s].
    pub window_ends: Vec<f64>,
    /// Bands in common.
    pub bands: Vec<BandGroup>,
    /// Place where energy arrives.
    pub places: Places,
}

impl Frame<'_> {
    /// The cells of one source, numbered as in A and as in B: `[place][window][band]`.
    pub(super) fn cells(&self, sources: [u32; 2]) -> Result<Vec<CellStatistics>, Incomparable> {
        let observers = [0, 1].map(|side| self.observer(side, sources[side]));
        let shares = [batch_shares(&observers[0], 'A')?, batch_shares(&observers[1], 'B')?];
        // A source with another number has other random numbers.
        let paired = self.pairing == MapPairing::Batches && sources[0] == sources[1];
        let paired = paired.then(Moments::default);
        let mut cells = vec![CellStatistics { paired, ..CellStatistics::default() }; observers[0].cells()];
        let most = observers.each_ref().map(|observer| observer.reading.emissions.layout.batches);
        for first in (0..most[0].max(most[1])).step_by(BATCHES_IN_FLIGHT as usize) {
            let (a, b) = rayon::join(|| walk(&observers[0], first), || walk(&observers[1], first));
            for index in 0..a.len().max(b.len()) {
                let batch = first as usize + index;
                let both = [0, 1].map(|side| [&a, &b][side].get(index).zip(shares[side].get(batch)));
                add_batch(&mut cells, both);
            }
        }
        for (side, observer) in observers.iter().enumerate() {
            add_packets(&mut cells, side, observer);
        }
        Ok(cells)
    }

    fn observer(&self, side: usize, source: u32) -> Observer<'_> {
        let reading = &self.readings[side];
        let speed = reading.map.header().scene.speed_of_sound;
        Observer {
            reading,
            source,
            places_of: &self.places.of[side],
            places: self.places.list.len(),
            window_ends: self.window_ends.iter().map(|end| end * speed).collect(),
            columns: self.bands.iter().map(|band| band.columns[side]).collect(),
        }
    }
}

/// Batches `first` … of a map, some along the file at a time.
fn walk(observer: &Observer<'_>, first: u32) -> Vec<Incidence> {
    let end = observer.reading.emissions.layout.batches.min(first + BATCHES_IN_FLIGHT);
    let starts: Vec<u32> = (first..end).step_by(BATCHES_PER_WALK as usize).collect();
    let walk = |start: u32| observer.walk(start..end.min(start + BATCHES_PER_WALK));
    starts.into_par_iter().flat_map_iter(walk).collect()
}

/// Weight of one batch in a column.
#[derive(Clone, Copy)]
struct Share {
    /// Part of the energy that its batch emits [0 … 1].
    held: f64,
    /// Part of everything that the map holds [0 … 1].
    weight: f64,
}

/// By batch and column.
fn batch_shares(observer: &Observer<'_>, map: char) -> Result<Vec<Vec<Share>>, Incomparable> {
    let reading = observer.reading;
    let mut shares: Vec<Vec<Share>> = (0..reading.emissions.layout.batches)
        .map(|batch| {
            let run = reading.emissions.batches[batch as usize].weight;
            observer.held_part(batch).into_iter().map(|held| Share { held, weight: held * run }).collect()
        })
        .collect();
    for column in 0..observer.columns.len() {
        let sum: f64 = shares.iter().map(|batch| batch[column].weight).sum();
        if shares.iter().filter(|batch| batch[column].weight > 0.0).count() < 2 {
            return Err(Incomparable::Batches { map });
        }
        shares.iter_mut().for_each(|batch| batch[column].weight /= sum);
    }
    Ok(shares)
}

/// A batch of one map with its shares.
type Side<'a> = Option<(&'a Incidence, &'a Vec<Share>)>;

fn add_batch(cells: &mut [CellStatistics], both: [Side<'_>; 2]) {
    let estimate = |side: usize, index: usize| -> Option<(f64, f64)> {
        let (found, shares) = both[side]?;
        let share = shares[index % shares.len()];
        (share.weight > 0.0).then(|| (share.weight, found[index][0] / share.held))
    };
    cells.par_iter_mut().enumerate().for_each(|(index, cell)| {
        let estimates = [estimate(0, index), estimate(1, index)];
        for (side, found) in estimates.into_iter().enumerate() {
            if let (Some((weight, value)), Some((batch, _))) = (found, both[side]) {
                cell.sides[side].add(weight, value);
                cell.arrived[side] += batch[index][1];
                cell.squared[side] += batch[index][2];
            }
        }
        if let (Some(paired), [Some((weight, a)), Some((_, b))]) = (&mut cell.paired, estimates) {
            paired.add(weight, b - a);
        }
    });
}

fn add_packets(cells: &mut [CellStatistics], side: usize, observer: &Observer<'_>) {
    let mut packets = vec![0.0; observer.columns.len()];
    for batch in 0..observer.reading.emissions.layout.batches {
        packets.iter_mut().zip(observer.packets(batch)).for_each(|(sum, more)| *sum += more);
    }
    for (index, cell) in cells.iter_mut().enumerate() {
        cell.packets[side] = packets[index % packets.len()];
    }
}
