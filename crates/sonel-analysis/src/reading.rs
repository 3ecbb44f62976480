//! Sweeps the paths of a map, with all tables prepared once.
//!
//! References: docs/physics.md §2.

use sonel_geometry::Geometry;
use sonel_map::{BandClasses, CoefficientTable, Emissions, PathView, PathWeight, Segment, SonelMap};

/// A map with what its paths need to be read.
pub struct Reading<'a> {
    /// The map.
    pub map: &'a SonelMap,
    /// Number of bands.
    pub bands: usize,
    /// Starts of its paths.
    pub emissions: Emissions,
    /// Coefficients of the materials.
    pub table: CoefficientTable,
}

impl<'a> Reading<'a> {
    /// Makes `map` ready, whose paths must be sound ([`SonelMap::check_paths`]); `geometry` is that of its scene.
    pub fn new(map: &'a SonelMap, geometry: &Geometry) -> Self {
        let classes = BandClasses::separate(map.header().scene.bands.count());
        let emissions = Emissions::of_map(map, geometry.center(), &classes);
        Self {
            map,
            bands: classes.count(),
            emissions,
            table: map.coefficients(&map.header().scene.materials, &classes),
        }
    }

    /// Visits the segments of `path` of `source` with energies in units of `unit`, see [`PathWeight::emit`].
    pub fn follow(
        &self,
        source: u32,
        path: PathView<'_>,
        unit: f64,
        weight: &mut PathWeight,
        visit: impl FnMut(&Segment<'_>),
    ) {
        self.emissions.follow(source, path, unit, &self.table, weight, visit);
    }
}
