//! A rendering batch by batch: sums over the first batches of a map, which may be finished or go on.

use std::ops::ControlFlow;

use super::{Progress, Renderer};
use sonel_map::BandValues;

use crate::deposit::Deposits;
use crate::error::RenderError;
use crate::exact::mirror::Radiator;
use crate::receiver::{PreparedReceiver, ReceiverPoint, axes};
use crate::rendering::{CoarseEchogram, Rendering};

/// Sums over the first batches of one source at some receivers, each batch weighed by its share of the whole map.
#[derive(Clone)]
pub struct BatchSums {
    pub(super) source: usize,
    pub(super) receivers: Vec<PreparedReceiver>,
    /// Time borders of the batches at every receiver [s].
    pub(super) borders: Vec<Vec<f64>>,
    /// Number of batches.
    batches: u32,
    /// Everything but `total`.
    pub(super) rendering: Rendering,
    /// Energy that packets bring, and that of rays that are mirrored alone: apart, so that sums do not depend on where they paused.
    packets: Deposits,
    pub(super) mirrored: Deposits,
}

impl Renderer<'_> {
    /// Sums over no batch of `source`. `borders` gives for every receiver the coarse time borders [s] of its batches.
    ///
    /// # Errors
    /// [`RenderError::Receivers`] with all problems of all receivers.
    pub fn begin(
        &self,
        source: usize,
        receivers: &[ReceiverPoint],
        borders: &[Vec<f64>],
    ) -> Result<BatchSums, RenderError> {
        self.check_receivers(receivers)?;
        let (images, receivers) =
            rayon::join(|| self.image_sources(source), || self.prepare(source, receivers));
        let columns = axes(&receivers).columns();
        let (bins, bands) = (&self.prepared.bins, self.prepared.table.bands());
        let echograms = |count| Deposits::new(count * columns.fine, bins.count, bands);
        let mut rendering = Rendering::new(receivers.len(), columns, bins, bands);
        rendering.mirror_order = images.order();
        if let Some(modes) = &self.prepared.modes {
            let of_level = |receiver: &PreparedReceiver| {
                let factors = receiver.boundary.values().zip(&modes.absorbed);
                factors.map(|(factor, absorbed)| factor / absorbed).collect()
            };
            rendering.boundary = receivers.iter().map(of_level).collect();
        }
        rendering.sphere_radius = receivers.iter().map(|receiver| receiver.balls.early_radius()).collect();
        Ok(BatchSums {
            source,
            borders: borders.to_vec(),
            batches: 0,
            rendering,
            packets: echograms(receivers.len()),
            mirrored: echograms(if self.casts_specular_rays() { receivers.len() } else { 0 }),
            receivers,
        })
    }

    /// Adds the batches that `sums` lacks, which this renderer began, alone or with fewer batches. `progress` receives the share of them that is
    /// done, 0 when they begin. Sums of which it has broken off the extension are worth nothing.
    pub fn extend(&self, sums: &mut BatchSums, progress: Progress<'_>) -> ControlFlow<()> {
        progress(0.0)?;
        let batches = sums.batches..self.batches.max(sums.batches);
        sums.batches = batches.end;
        let (rendering, bands) = (&mut sums.rendering, self.prepared.table.bands());
        let nothing = CoarseEchogram::of_receivers(&sums.borders, rendering.columns.coarse, bands);
        rendering.batches.resize(batches.end as usize, nothing.clone());
        rendering.kernel_differences.resize(batches.end as usize, nothing);
        self.add_late_specular(sums, batches.clone(), &mut |_| progress(0.0))?;
        let BatchSums { source, receivers, borders, rendering, packets, .. } = sums;
        let together = self.receivers_in_flight();
        let tiles = receivers.len().div_ceil(together);
        for tile in 0..tiles {
            let range = tile * together..((tile + 1) * together).min(receivers.len());
            let done = &mut |share| progress((tile as f64 + share) / tiles as f64);
            let tile = self.tile(*source, receivers, borders, range);
            self.add_batches(rendering, packets, *source, &tile, batches.clone(), done)?;
        }
        ControlFlow::Continue(())
    }

    /// The rendering of the batches in `sums`, with everything that is deterministic.
    #[must_use]
    pub fn finish(&self, sums: BatchSums) -> Rendering {
        let BatchSums { source, receivers, borders, batches, mut rendering, packets, mirrored } = sums;
        rendering.total = packets;
        if self.casts_specular_rays() {
            rendering.total.add_receivers(0, &mirrored, 1.0);
        }
        // Batches of a whole map have the weights that it states, bit for bit.
        if (batches as usize) < self.prepared.emissions.batches.len() {
            let rendered = &self.prepared.emissions.batches[..batches as usize];
            rendering.scale(1.0 / rendered.iter().map(|batch| batch.weight).sum::<f64>());
        }
        let emitter = &self.map.header().scene.sources[source];
        let radiator = Radiator::new(emitter, self.geometry.center());
        let images = self.image_sources(source);
        // Last: which edges matter depends on what else is heard.
        self.add_deterministic(&mut rendering, source, radiator, images, &receivers, &borders);
        self.bound_unseen(&mut rendering, source, &receivers, &borders);
        rendering.spread(&self.prepared.classes)
    }

    /// Extends the intervals of receivers by what none of the packets brought that might have crossed their balls.
    fn bound_unseen(
        &self,
        rendering: &mut Rendering,
        source: usize,
        receivers: &[PreparedReceiver],
        borders: &[Vec<f64>],
    ) {
        for (index, (receiver, borders)) in receivers.iter().zip(borders).enumerate() {
            let fluence = |beam| receiver.balls.at(0.0, beam).fluence_per_crossing();
            let unseen = rendering.crossings.unseen(index, fluence);
            let time = self.prepared.bins.time(self.straight_length(source, receiver));
            rendering.add_unseen(index, borders, time, &unseen);
        }
    }

    /// Receivers that share a sweep: fewer, where their rays are so many that discs would fill the memory.
    fn receivers_in_flight(&self) -> usize {
        let rays = self.prepared.gather.as_ref().map_or(1, |(_, settings)| settings.rays);
        (super::RAYS_IN_FLIGHT / rays.max(1)).clamp(1, super::RECEIVERS_IN_FLIGHT) as usize
    }
}
