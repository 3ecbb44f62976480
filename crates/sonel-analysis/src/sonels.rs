//! Lists the sonels of a map with all their properties.
//!
//! They come by source, emission and order of arrival, as they are stored. Chunks are read side by side and handed on in that
//! order, some at a time, so that memory does not grow with the map.
//!
//! References: docs/physics.md §2.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use sonel_geometry::Geometry;
use sonel_map::{
    Arrival, BandValues, CoefficientTable, Lanes, PathView, PathWeight, SegmentHistory, SonelMap,
};

use crate::reading::Reading;

/// Chunks read before they are handed on together: bounds the memory, whatever the number of threads.
const CHUNKS_IN_FLIGHT: usize = 16;

/// One sonel: an arrival at a surface within the run.
#[derive(Debug, Clone, Copy)]
pub struct Sonel<'a> {
    /// Index of the source.
    pub source: u32,
    /// Index of the emission among those of its source.
    pub emission: u64,
    /// Index of the band that led the packet.
    pub leading_band: u32,
    /// Events of the packet before.
    pub history: SegmentHistory,
    /// Position in the axes of the scene [m].
    pub position: DVec3,
    /// Unit vector in which it travelled when it arrived; zero where two arrivals fall on one point.
    pub direction: Vec3,
    /// Path length since emission [m].
    pub path_length: f64,
    /// Surface, side and event of the arrival.
    pub arrival: Arrival,
    energy: &'a [Lanes],
}

impl Sonel<'_> {
    /// Incident energy in `band`, without loss to air, relative to what the source emits in that band during the whole
    /// run [1].
    #[must_use]
    pub fn energy(&self, band: usize) -> f64 {
        self.energy.band(band)
    }
}

/// A map made ready for listing its sonels.
pub struct Sonels<'a> {
    reading: Reading<'a>,
    center: DVec3,
    chunks: Vec<(u32, u64)>,
}

impl<'a> Sonels<'a> {
    /// Makes `map` ready, whose paths must be sound ([`SonelMap::check_paths`]); `geometry` is that of its scene.
    #[must_use]
    pub fn new(map: &'a SonelMap, geometry: &Geometry) -> Self {
        Self {
            reading: Reading::new(map, geometry),
            center: geometry.center(),
            chunks: map.chunks().collect(),
        }
    }

    /// The map.
    #[must_use]
    pub fn map(&self) -> &'a SonelMap {
        self.reading.map
    }

    /// Number of sonels.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.map().sonel_count()
    }

    /// Gathers what `put` says of every sonel, chunk by chunk, and hands it to `take` in order.
    ///
    /// # Errors
    /// The first of `take`.
    pub fn gather<T: Default + Send, E>(
        &self,
        put: impl Fn(&Sonel<'_>, &mut T) + Sync,
        mut take: impl FnMut(T) -> Result<(), E>,
    ) -> Result<(), E> {
        for group in self.chunks.chunks(CHUNKS_IN_FLIGHT) {
            let parts: Vec<T> = group
                .par_iter()
                .map(|&chunk| {
                    let (mut part, mut weight) = (T::default(), PathWeight::of(&self.reading.table));
                    for path in self.map().chunk_paths(chunk) {
                        self.visit(chunk.0, path, &mut weight, &mut |sonel| put(sonel, &mut part));
                    }
                    part
                })
                .collect();
            parts.into_iter().try_for_each(&mut take)?;
        }
        Ok(())
    }

    fn visit(
        &self,
        source: u32,
        path: PathView<'_>,
        weight: &mut PathWeight,
        visit: &mut dyn FnMut(&Sonel<'_>),
    ) {
        let (emissions, emission) = (&self.reading.emissions, path.emission);
        // Where the speed of sound has a gradient, sound does not arrive in the direction in which it left.
        let table = &self.reading.table;
        let mut left =
            Some(emissions.direction(source, emission)).filter(|_| table.propagation().is_straight());
        self.reading.follow(source, path, emissions.share(emission), weight, |segment| {
            let left = left.take();
            let Some(arrival) = segment.arrival else { return };
            let direction =
                left.unwrap_or_else(|| arriving(table, segment.start.as_dvec3(), segment.end.as_dvec3()));
            visit(&Sonel {
                source,
                emission,
                leading_band: emissions.layout.lead_band(emission),
                history: segment.history,
                position: segment.end.as_dvec3() + self.center,
                direction,
                path_length: segment.end_length,
                arrival,
                energy: segment.energy,
            });
        });
    }
}

/// Unit direction in which sound from `start` arrives at `end`, about the middle of the scene [m]; zero where they are the same.
fn arriving(table: &CoefficientTable, start: DVec3, end: DVec3) -> Vec3 {
    let back = table.propagation().leg(end, start).filter(|_| start != end);
    back.map_or((end - start).normalize_or_zero(), |back| -back.arc.direction(0.0)).as_vec3()
}
