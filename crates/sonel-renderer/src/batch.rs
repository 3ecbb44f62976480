//! The classes with noise, one batch of emissions at a time.

use std::ops::Range;

use rayon::prelude::*;
use sonel_map::{EmissionDirections, Lanes, PathWeight, Segment, lanes_of, sweep};

use crate::connection::{DiffuseSonel, connect, normal_on, radiosity};
use crate::crossing::{cross, owns};
use crate::deposit::Deposits;
use crate::receiver::PreparedReceiver;
use crate::render::{PathClass, Renderer};
use crate::rendering::{CoarseEchogram, Rendering};

/// Batches rendered before they are added: bounds the memory, whatever the number of threads.
const BATCHES_IN_FLIGHT: u32 = 8;

/// One batch's estimate.
struct BatchEstimate {
    connected: Deposits,
    crossed: Deposits,
}

/// Buffers of one batch.
struct Scratch {
    radiosity: Vec<Lanes>,
    energy: Vec<Lanes>,
}

impl Renderer<'_> {
    /// Adds all batches of `source` at the receivers `tile` to `rendering`.
    pub(crate) fn add_batches(
        &self,
        rendering: &mut Rendering,
        source: usize,
        receivers: &[PreparedReceiver],
        borders: &[Vec<f64>],
        tile: Range<usize>,
        progress: &mut dyn FnMut(f64),
    ) {
        let scene = &self.map.header().scene;
        let seed = self.map.header().settings.seed;
        let directions = EmissionDirections::new(seed, source as u32, self.map.layout());
        let count = self.batches.len() as u32;
        let mirror_order = rendering.mirror_order;
        for first in (0..count).step_by(BATCHES_IN_FLIGHT as usize) {
            let group: Vec<BatchEstimate> = (first..count.min(first + BATCHES_IN_FLIGHT))
                .into_par_iter()
                .map(|batch| self.estimate(batch, source, &directions, &receivers[tile.clone()], mirror_order))
                .collect();
            for (batch, estimate) in (first as usize..).zip(group) {
                let weight = self.batches[batch].weight;
                let classes = [(PathClass::Connection, &estimate.connected), (PathClass::Crossing, &estimate.crossed)];
                for (class, deposits) in classes {
                    rendering.book(class, weight, &deposits.totals(self.table.bands()));
                    for (local, index) in tile.clone().enumerate() {
                        let distance = scene.sources[source].position - self.geometry.center();
                        let first_arrival = self.bins.time(distance.distance(receivers[index].exact));
                        rendering.total.add_receiver(index, deposits, local, weight);
                        let coarse: &mut CoarseEchogram = &mut rendering.batches[batch][index];
                        coarse.add_fine(&borders[local], deposits, local, &self.bins, first_arrival);
                    }
                }
            }
            progress(f64::from(count.min(first + BATCHES_IN_FLIGHT)) / f64::from(count));
        }
    }

    fn estimate(
        &self,
        batch: u32,
        source: usize,
        directions: &EmissionDirections,
        receivers: &[PreparedReceiver],
        mirror_order: u32,
    ) -> BatchEstimate {
        let emitter = &self.map.header().scene.sources[source];
        let (position, aim) = (emitter.position - self.geometry.center(), emitter.aim.as_vec3());
        let bands = self.table.bands();
        let empty = Deposits::new(receivers.len(), self.bins.count, bands);
        let mut estimate = BatchEstimate { connected: empty.clone(), crossed: empty };
        let zeros = vec![[0.0; 4]; lanes_of(bands)];
        let mut scratch = Scratch { radiosity: zeros.clone(), energy: zeros };
        let mut weight = PathWeight::new(bands);
        let layout = self.map.layout();
        for path in self.map.batch_paths(source as u32, batch) {
            let start = self.batches[batch as usize].packet(layout.hero(path.emission));
            let cosine = directions.direction(path.emission).dot(aim);
            weight.emit(emitter.directivity.factor(f64::from(cosine)), &start.counts, &start.carried);
            sweep(position, path.vertices, &self.table, &self.material_of, &mut weight, |segment| {
                self.hear_segment(segment, receivers, mirror_order, &mut scratch, &mut estimate);
            });
        }
        estimate
    }

    #[inline]
    fn hear_segment(
        &self,
        segment: &Segment<'_>,
        receivers: &[PreparedReceiver],
        mirror_order: u32,
        scratch: &mut Scratch,
        estimate: &mut BatchEstimate,
    ) {
        let surroundings = (&self.bins, self.air.as_ref());
        if owns(segment.history, mirror_order) {
            cross(segment, receivers, surroundings, &mut scratch.energy, &mut estimate.crossed);
        }
        let Some(arrival) = segment.arrival else { return };
        let row = self.table.material(self.material_of[arrival.surface.0 as usize]);
        if row.is_mirror {
            return;
        }
        radiosity(segment.energy, &row.diffuse, &mut scratch.radiosity);
        let sonel = DiffuseSonel {
            position: segment.end,
            normal: normal_on(arrival.side, self.normals[arrival.surface.0 as usize]),
            departure: self.geometry.leave(segment.end, arrival.surface, arrival.side),
            length: segment.end_length,
            radiosity: &scratch.radiosity,
        };
        connect(&sonel, receivers, self.geometry, surroundings, &mut scratch.energy, &mut estimate.connected);
    }
}
