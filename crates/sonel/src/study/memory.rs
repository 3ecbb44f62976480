//! Own memory of a rendering.

use sonel_renderer::{BATCHES_IN_FLIGHT, Columns, RAYS_IN_FLIGHT, RECEIVERS_IN_FLIGHT};
use sonel_scene::Scene;

use crate::feasible::cores;
use crate::study::forecast::Effort;
use crate::study::response::PART;

/// Memory of a program by itself [bytes].
pub(crate) const PROGRAM: f64 = 10e6;
/// Coarse bins of a batch: 20 early and 200 late ones, with those before and after.
const COARSE: f64 = 222.0;
/// A disc with its place in lists [bytes]. A ray leaves about as many as a packet has segments.
const DISC_BYTES: f64 = 250.0;

/// What decides the own memory of a rendering, beside its numbers of packets, rays and receivers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RenderLoad {
    /// Columns of its echograms.
    pub columns: Columns,
    /// Whether visibility rays are cast.
    pub casts_rays: bool,
    /// Segments of a packet.
    pub segments: f64,
}

impl RenderLoad {
    /// Own memory [bytes]: echograms of the batches of a sweep and, of a part of the receivers, of all sources, of packets and of mirrored rays
    /// apart, the coarse ones of all batches with their kernels, and the discs of the batches that are rendered at once; the response of all
    /// receivers, and of a part once more, which is put beside the others.
    #[must_use]
    pub(crate) fn memory(&self, effort: Effort, scene: &Scene, receivers: usize, bin: f64) -> f64 {
        let bands = scene.bands.count();
        let lane_bytes = (size_of::<sonel_map::Lanes>() * sonel_map::lanes_of(bands)) as f64;
        let (bins, pairs) = (scene.duration / bin, (scene.sources.len() * receivers) as f64);
        let part = receivers.min(PART) as f64;
        let pairs_of_part = scene.sources.len() as f64 * part;
        let [together, batches] = [RECEIVERS_IN_FLIGHT, BATCHES_IN_FLIGHT].map(f64::from);
        let echograms = 2.0 * pairs_of_part + batches * part.min(together);
        let fine = bins * lane_bytes * echograms * self.columns.fine as f64;
        let of_batches = 2.0 * COARSE * f64::from(effort.batches) * self.columns.coarse as f64;
        let coarse = of_batches * lane_bytes * pairs_of_part;
        let (energy, estimates) =
            ((size_of::<f64>() * bands) as f64 * bins, (size_of::<f32>() * bands) as f64 * of_batches);
        let response = (pairs + pairs_of_part) * (energy * self.columns.fine as f64 + estimates);
        let discs = if self.casts_rays {
            let of_one = f64::from(effort.rays) / f64::from(effort.batches);
            let rays = of_one.max(f64::from(RAYS_IN_FLIGHT).min(of_one * part));
            DISC_BYTES * self.segments * rays * cores().min(batches)
        } else {
            0.0
        };
        PROGRAM + fine + coarse + discs + response
    }
}
