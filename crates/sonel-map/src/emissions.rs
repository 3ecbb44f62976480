//! All emissions of a run, ready to be traced or followed: where each begins, in which direction, in which batch.
//!
//! References: docs/physics.md §2, §6.

use glam::{DVec3, Vec3};
use sonel_scene::{Scene, Source};

use crate::classes::BandClasses;
use crate::coefficients::CoefficientTable;
use crate::emission::{BatchStart, EmissionDirections, EmissionLayout, PacketStart};
use crate::header::Settings;
use crate::reader::{PathView, SonelMap};
use crate::sweep::{Segment, sweep};
use crate::weight::PathWeight;

/// The emissions of all sources of a scene.
pub struct Emissions {
    sources: Vec<Source>,
    /// Numbering of those of each source.
    pub layout: EmissionLayout,
    /// Starts of the packets of each batch.
    pub batches: Vec<BatchStart>,
    /// Place about the scene's centre [m] and air of each source.
    origins: Vec<(DVec3, u32)>,
    directions: Vec<EmissionDirections>,
}

impl Emissions {
    /// The emissions of a run of `scene`, whose middle is `center` [m], with a column for each class of `bands` and of `leads`.
    #[must_use]
    pub fn new(
        scene: &Scene,
        center: DVec3,
        settings: &Settings,
        layout: EmissionLayout,
        bands: &BandClasses,
        leads: &BandClasses,
    ) -> Self {
        let Settings { seed, spectral, .. } = *settings;
        let sources = scene.sources.iter().enumerate();
        let origin =
            |(index, source): (usize, &Source)| (source.position - center, scene.air_at_source(index));
        Self {
            layout,
            batches: (0..layout.batches)
                .map(|batch| BatchStart::grouped(&layout, batch, spectral, bands, leads))
                .collect(),
            origins: sources.map(origin).collect(),
            directions: (0..scene.sources.len() as u32)
                .map(|source| EmissionDirections::new(seed, source, layout, spectral))
                .collect(),
            sources: scene.sources.clone(),
        }
    }

    /// The emissions of the run of `map`, with a column for each of `classes` of bands.
    #[must_use]
    pub fn of_map(map: &SonelMap, center: DVec3, classes: &BandClasses) -> Self {
        let (header, leads) = (map.header(), map.leads());
        Self::new(&header.scene, center, &header.settings, map.layout(), classes, leads.classes())
    }

    /// Share of the batch of `emission` in the run, N_g / N.
    #[must_use]
    pub fn share(&self, emission: u64) -> f64 {
        self.batches[self.layout.batch(emission) as usize].weight
    }

    /// Start of the packet of `emission`.
    #[must_use]
    pub fn start(&self, emission: u64) -> &PacketStart {
        self.batches[self.layout.batch(emission) as usize].packet(self.layout.lead(emission))
    }

    /// Place about the scene's centre [m] and air of `source`.
    #[must_use]
    pub fn origin(&self, source: u32) -> (DVec3, u32) {
        self.origins[source as usize]
    }

    /// Unit direction in which `emission` left `source`: exact, where the rounded points of its first segment are not.
    #[must_use]
    pub fn direction(&self, source: u32, emission: u64) -> Vec3 {
        self.directions[source as usize].direction(emission)
    }

    /// Puts `weight` at the beginning of the path of `emission` of `source`; energies are in units of `unit`, see
    /// [`PathWeight::emit`].
    pub fn emit(&self, source: u32, emission: u64, unit: f64, weight: &mut PathWeight) {
        let emitter = &self.sources[source as usize];
        weight.emit_from(emitter, self.direction(source, emission), unit, self.start(emission));
    }

    /// Visits the segments of `path` of `source` with energies in units of `unit`: [`Self::emit`], then [`sweep`].
    pub fn follow(
        &self,
        source: u32,
        path: PathView<'_>,
        unit: f64,
        table: &CoefficientTable,
        weight: &mut PathWeight,
        visit: impl FnMut(&Segment<'_>),
    ) {
        self.emit(source, path.emission, unit, weight);
        sweep(self.origin(source), path.vertices, table, weight, visit);
    }
}
