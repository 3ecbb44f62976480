//! Sweeps the paths of a map, with all tables prepared once.
//!
//! References: docs/physics.md §2.

use glam::{DVec3, Vec3};
use sonel_geometry::Geometry;
use sonel_map::{
    BandClasses, BatchStart, CoefficientTable, EmissionDirections, EmissionLayout, PacketStart, PathView,
    PathWeight, Segment, SonelMap, sweep,
};

/// A map with what its paths need to be read.
pub struct Reading<'a> {
    /// The map.
    pub map: &'a SonelMap,
    /// Numbering of the emissions.
    pub layout: EmissionLayout,
    /// Number of bands.
    pub bands: usize,
    /// How the packets of each batch start.
    pub batches: Vec<BatchStart>,
    /// Coefficients of the materials.
    pub table: CoefficientTable,
    /// Place and air of each source.
    origins: Vec<(DVec3, u32)>,
    directions: Vec<EmissionDirections>,
}

impl<'a> Reading<'a> {
    /// Makes `map` ready, whose paths must be sound ([`SonelMap::check_paths`]); `geometry` is that of its scene.
    pub fn new(map: &'a SonelMap, geometry: &Geometry) -> Self {
        Self::with(map.coefficients(&BandClasses::separate(map.header().scene.bands.count())), map, geometry)
    }

    /// The same with the materials of the file, whatever the scene has by now ([`SonelMap::change`]).
    pub fn as_drawn(map: &'a SonelMap, geometry: &Geometry) -> Self {
        let scene = &map.header().scene;
        let materials = map.drawn_with().unwrap_or(&scene.materials);
        let table = CoefficientTable::new(materials, scene.bands.count(), map.header().settings.survival);
        let table =
            table.with_geometry(geometry).with_edges(map.edge_table()).with_media(scene, geometry.center());
        Self::with(table, map, geometry)
    }

    fn with(table: CoefficientTable, map: &'a SonelMap, geometry: &Geometry) -> Self {
        let (header, layout) = (map.header(), map.layout());
        let (scene, settings) = (&header.scene, &header.settings);
        let bands = scene.bands.count();
        let directions = |source| EmissionDirections::new(settings.seed, source, layout, settings.spectral);
        Self {
            map,
            layout,
            bands,
            batches: (0..layout.batches)
                .map(|batch| BatchStart::new(&layout, batch, settings.spectral))
                .collect(),
            table,
            origins: (0..scene.sources.len())
                .map(|source| {
                    (scene.sources[source].position - geometry.center(), scene.air_at_source(source))
                })
                .collect(),
            directions: (0..scene.sources.len() as u32).map(directions).collect(),
        }
    }

    /// How the packet of `emission` starts.
    pub fn start(&self, emission: u64) -> &PacketStart {
        self.batches[self.layout.batch(emission) as usize].packet(self.layout.lead(emission))
    }

    /// Unit direction in which `emission` left `source`: exact, where the rounded points of its first segment are not.
    pub fn direction(&self, source: u32, emission: u64) -> Vec3 {
        self.directions[source as usize].direction(emission)
    }

    /// Puts `weight` at the beginning of the path of `emission` of `source`; energies are in units of `unit`, see
    /// [`PathWeight::emit`].
    pub fn emit(&self, source: u32, emission: u64, unit: f64, weight: &mut PathWeight) {
        let emitter = &self.map.header().scene.sources[source as usize];
        let direction = self.direction(source, emission);
        weight.emit_from(emitter, direction, unit, self.start(emission));
    }

    /// Visits the segments of `path` of `source`, with a `weight` from [`Self::emit`].
    pub fn sweep(
        &self,
        source: u32,
        path: PathView<'_>,
        weight: &mut PathWeight,
        visit: impl FnMut(&Segment<'_>),
    ) {
        let origin = self.origins[source as usize];
        sweep(origin, path.vertices, &self.table, weight, visit);
    }
}
